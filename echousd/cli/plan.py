"""`echousd plan`: from a graph of rooms, or somebody's floor plan, to a plan."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from echousd.cli.options import Force, Written
from echousd.cli.report import say_done

EXAMPLES = """Examples:

    echousd plan flat.yaml -o plans.png --plans 6

    echousd plan flat.yaml -o planned.usda --seed 3        (echousd generate planned.usda -o flat furnishes this one)

    echousd plan flat/home.usda -o flat.dxf"""


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("plan", epilog=EXAMPLES)(plan)


def plan(
    source: Annotated[Path, typer.Argument(metavar="HOME", help="Home: YAML, JSON or stage.", show_default=False)],
    output: Annotated[
        Path,
        typer.Option(
            "-o", "--output", help="Picture (.png, .svg, .pdf), drawing (.dxf) or stage (.usda).", show_default=False
        ),
    ],
    several: Annotated[int, typer.Option("--plans", help="Plans side by side in a picture.", min=1, max=12)] = 1,
    seed: Annotated[int, typer.Option(help="Seed of the plan.", min=0)] = 0,
    force: Force = False,
    json: Written = False,
) -> None:
    """Plan a home, or take the plan that it has, and draw it or write it down."""
    from echousd.graph import GraphError
    from echousd.graph.files import STAGE_FORMS
    from echousd.home.draw import PICTURES, draw_plans, write_dxf
    from echousd.home.files import load_home
    from echousd.home.given import plan_of, plan_there
    from echousd.home.plan import plans
    from echousd.home.stages import write_home

    started, form = time.perf_counter(), output.suffix.lower()
    if form not in (*PICTURES, ".dxf", *STAGE_FORMS[:-1]):
        allowed = ", ".join((*PICTURES, ".dxf", *STAGE_FORMS[:-1]))
        raise GraphError(f"{output}: extension {output.suffix!r}, allowed: {allowed}")
    if output.exists() and not force:
        raise GraphError(f"{output} exists, allowed: a new path, or --force to overwrite it")
    if several > 1 and form not in PICTURES:
        raise GraphError(f"--plans is {several}, allowed with a picture; name one by its --seed")
    home = load_home(source)
    if home is None:
        raise GraphError(f"{source}: no home, allowed: a file with rooms and how they lie to each other")
    if several > 1:
        found = [one] if (one := plan_there(source, home)) else plans(home, several, seed)
    else:
        found = [plan_of(source, home, seed=seed)]
    if form in PICTURES:
        draw_plans(found, output)
    elif form == ".dxf":
        write_dxf(found[0], output)
    else:
        write_home(found[0].home, output, found[0])
    lines = [f"wrote {output}", *(f"plan     {len(one.floors)} rooms, {one.area:.1f} m²" for one in found)]
    areas = {name: round(float(area), 3) for name, area in found[0].areas.items()}
    say_done(json, [output], started, lines, {"areas": areas})
