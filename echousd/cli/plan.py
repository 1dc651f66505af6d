"""`echousd plan`: from a graph of rooms, or somebody's floor plan, to a plan, and from a plan to other programs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from echomodel.files import check_free
from echomodel.late import Late
from echousd.cli.options import SAID, Force, Written, documented_command, group_of
from echousd.cli.output import say_done
from echousd.naming import LAYER_FORMS

if TYPE_CHECKING:
    from echousd.home.graph import HomeGraph
    from echousd.home.plan import HomePlan
    from echousd.options import RoomOptions


plan_app = typer.Typer(cls=group_of("export"), no_args_is_help=True, epilog=SAID["plan export"]["examples"])
draw_plans, write_home = Late("echousd.home.draw:draw_plans"), Late("echousd.home.stages:write_home")
faults_of, plan_there = Late("echousd.graph.consistency:faults_of"), Late("echousd.home.existing:plan_there")
app = typer.Typer()
app.add_typer(plan_app, name="plan", help="Plan a home, draw or write its plan; read somebody's floor plan.")


@documented_command(plan_app, "plan import")
def import_(
    source: Path, output: Path, form: str | None = None, unit: str | None = None, storey: str | None = None,
    lenient: bool = False, picture: Path | None = None, force: Force = False, json: Written = False,
) -> None:  # fmt: skip
    """Read a floor plan of another program: its rooms, doors and windows, and its furniture, which stays put.

    Rooms without furniture get what such rooms usually hold.
    """
    from echousd.graph.picture import PICTURES
    from echousd.home.importing.formats import import_plan

    _writable(output, LAYER_FORMS, force)
    if picture is not None:
        _writable(picture, PICTURES, force)
    made = import_plan(source, format=form, unit=unit, storey=storey, lenient=lenient)
    found = made.found
    write_home(made.plan.home, output, made.plan)
    if picture is not None:
        draw_plans(
            [made.plan], picture, found.lines or [room.corners[[*range(len(room.corners)), 0]] for room in found.rooms]
        )
    many = ", ".join(f"{count} {what}" for what, count in made.counts.items())
    lines = [f"wrote {output}", f"format   {found.format}: {found.frame}", f"found    {many}, {made.plan.area:.1f} m²"]
    lines += [f"ignored  {count} x {what}" for what, count in made.ignored.items()]
    facts = {"format": found.format, "frame": found.frame, "found": made.counts, "ignored": made.ignored}
    say_done(json, [output, *([picture] if picture else [])], lines, facts)


def _writable(path: Path, endings: tuple[str, ...], force: bool) -> None:
    from echousd.graph import GraphError

    if path.suffix.lower() not in endings:
        raise GraphError(f"{path}: extension {path.suffix!r}, allowed: {', '.join(endings)}")
    check_free(path, force=force)


@documented_command(plan_app, "plan export")
def export(
    source: Path, output: Path, several: int = 1, seed: int = 0, force: Force = False, json: Written = False,
) -> None:  # fmt: skip
    """Plan a home, or take the plan that it has with what stands in it, and draw it or write it down."""
    from echousd.folder.found import room_at
    from echousd.graph import GraphError
    from echousd.graph.picture import PICTURES
    from echousd.home.draw import write_dxf, write_procthor
    from echousd.home.files import load_home
    from echousd.home.plan import plans
    from echousd.home.stages import furniture

    form = output.suffix.lower()
    _writable(output, (*PICTURES, ".dxf", ".json", *LAYER_FORMS), force)
    if several > 1 and form not in PICTURES:
        raise GraphError(f"--plans is {several}, allowed with a picture; name one by its --seed")
    source = room_at(source) if source.is_dir() else source
    home = load_home(source)
    if home is None:
        raise GraphError(f"{source}: no home, allowed: a file with rooms and how they lie to each other")
    there = plan_there(source, home)
    with faults_of(str(source)):
        found = [there] if there else plans(home, several, seed)
    things = furniture(there, source) if there else []
    if form in PICTURES:
        draw_plans(found, output, things=things)
    elif form == ".dxf":
        write_dxf(found[0], output, things)
    elif form == ".json":
        write_procthor(found[0], output)
    else:
        write_home(found[0].home, output, found[0])
    lines = [f"wrote {output}", *(f"plan     {len(one.floors)} rooms, {one.area:.1f} m²" for one in found)]
    areas = {name: round(float(area), 3) for name, area in found[0].areas.items()}
    say_done(json, [output], lines, {"areas": areas})


def generate_home(
    graph: Path, home: HomeGraph, output: Path, options: RoomOptions, outside: Sequence[Path], *, force: bool,
    json: bool, dry_run: bool = False, wait: bool = False, there: tuple[HomePlan, int] | None = None,
) -> None:  # fmt: skip
    """Plan a home, make its rooms side by side, and say what became of each; exit code 1 for faults.

    Arguments:
        graph: the file that it comes from; a home that was made is planned anew, from the plan that it has.
        dry_run: say what would be made, and make nothing.
        there: a plan that it had, and its number; None = a new one.
    """
    from echousd.cli.progress import progress_bar
    from echousd.folder.found import is_home
    from echousd.home.assemble import earlier, wanted_jobs, write_rooms
    from echousd.home.existing import next_plan

    stated = None if is_home(graph) else plan_there(graph, home)
    before = graph if is_home(graph) else earlier(output, options.seed)
    with faults_of(str(graph)):
        plan, number = there or (stated or next_plan(home, seed=options.seed, before=before), None)
    if dry_run:
        again, _ = wanted_jobs(plan, output, options)
        lines = [f"{'opened' if job.begin else 'new':8} {job.id}" for job in again]
        facts = {"new": [job.id for job in again if not job.begin], "opened": [job.id for job in again if job.begin]}
        say_done(json, [], lines, facts)
        return
    with progress_bar() as listen:
        made = write_rooms(
            plan, output, options, outside=[str(path) for path in outside], force=force,
            tell=lambda done, total: listen("rooms", done, total), wait=wait, number=number,
        )  # fmt: skip
    faults = [f"{name}: {why}" for name, why in made.failed.items()]
    lines = [f"home     {made.root}", f"plan     {len(plan.floors)} rooms, {plan.area:.1f} m²"]
    for name, row in made.rooms.items():
        if name in made.failed:
            lines.append(f"failed   {name}: {made.failed[name]}")
        elif row is None:
            lines.append(f"kept     {name}")
        else:
            kept = f"{row['relations_kept']} of {row['relations_asked']} measured relations kept"
            lines.append(f"room     {name}: {row['objects']} objects, {kept}")
            faults += [] if row["check"] else [f"{name}: {'; '.join(row['check_errors']) or 'see echousd check'}"]
    rows = {name: dict(row) if row else None for name, row in made.rooms.items()}
    say_done(json, [made.root], lines, {"rooms": rows}, faults)
