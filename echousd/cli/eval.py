"""`echousd eval`: scores of a model on rooms (`layout`); other topics add their own."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from echomodel.files import write_json
from echousd.cli.output import plain_json, say_json

if TYPE_CHECKING:
    from rich.console import Console

eval_app = typer.Typer(help="Scores of a model: relations, sizes, collisions, shapes.", no_args_is_help=True)


def register(app: typer.Typer) -> None:
    """Add the topic."""
    app.add_typer(eval_app, name="eval")


@eval_app.command("layout")
def layout(
    rooms: Annotated[Path, typer.Option(help="Rooms file (JSON) or folder of a room set.")],
    rules: Annotated[str, typer.Option(help="strict or sgfront, for labels and scores.")] = "strict",
    change: Annotated[bool, typer.Option("--change", help="Also after turning one relation per room round.")] = False,
    add: Annotated[bool, typer.Option("--add", help="Also after adding one object per room.")] = False,
    complete: Annotated[bool, typer.Option("--complete", help="Also with half of the true boxes given.")] = False,
    seed: Annotated[int, typer.Option(help="Seed of the dropping, the edits and the sampling.")] = 0,
    drop: Annotated[float, typer.Option(help="Share of the relations that the graph does not tell.")] = 0.5,
    told: Annotated[
        float | None, typer.Option(help="Relations an object that are told, near pairs first, in place of --drop.")
    ] = None,
    limit: Annotated[int | None, typer.Option(help="Only the first rooms.")] = None,
    held_out: Annotated[bool, typer.Option("--held-out", help="Of a room set, what training does not see.")] = False,
    contradictions: Annotated[
        bool, typer.Option("--contradictions", help="Keep what contradicts a changed relation, as published.")
    ] = False,
    steps: Annotated[int | None, typer.Option(help="Sampling steps; default: the model's.", min=1)] = None,
    guidance: Annotated[float, typer.Option(help="Scale of guidance towards the relations, 1 = off.")] = 1.0,
    relation_guidance: Annotated[
        float | None, typer.Option(help="Pull of the rules' margins while sampling, 0 = off; default: the model's.")
    ] = None,
    place: Annotated[bool, typer.Option("--place", help="Place the layouts, as generate does.")] = False,
    drafts: Annotated[int, typer.Option(help="With --place: the best of so many layouts of each room.")] = 1,
    judge: Annotated[bool, typer.Option("--judge", help="Also: can a classifier tell them from true ones?")] = False,
    seeds: Annotated[int, typer.Option(help="Also: how different are so many layouts of one graph?")] = 0,
    model: Annotated[
        str | None, typer.Option(help='Weights, or "truth" for the true boxes; default: those that ship.')
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Write all figures to a JSON file.")] = None,
    json_out: Annotated[bool, typer.Option("--json", help="Print all figures as JSON.")] = False,
) -> None:
    """Label rooms by rule, have their boxes sampled from the graphs alone, and score them.

    With --told, also what a person would point at (the living rules).

    Example: echousd eval layout --rooms rooms.json --rules sgfront --change --add
    """
    from rich.progress import Progress

    from echomodel.data.roomset import load_rooms
    from echomodel.metrics.layout_evaluation import LayoutEvaluation, evaluate_layout
    from echomodel.metrics.layout_sources import model_layouts, true_layouts
    from echousd.cli.terminal import Terminal
    from echousd.place.drafts import placed

    found = load_rooms(rooms, limit, held_out=held_out)
    settings = LayoutEvaluation(
        rules, drop, seed, change, add, complete, contradictions, told=told, judge=judge, drafts=drafts, seeds=seeds
    )
    console = Terminal(stderr=True)
    if model == "truth":
        if seeds or drafts > 1:
            raise ValueError("--seeds and --drafts need several layouts of a room, the true one is one")
        sampler = true_layouts(found)
    else:
        weights = None if model is None else Path(model)
        extra = {"guidance": guidance, "relation_guidance": relation_guidance}
        sampler = model_layouts(weights, seed, rules, steps, extra)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task("sampling", total=None)
        result = evaluate_layout(
            found, sampler, settings, lambda done, total: bar.update(task, completed=done, total=total),
            placed(rules) if place else None,
        )  # fmt: skip
    if out is not None:
        write_json(out, plain_json(result))
    if json_out:
        say_json(result)
    else:
        _print(result, Terminal())


def _print(result: dict, console: Console) -> None:
    from rich.table import Table

    from echomodel.metrics.report import rows_between

    modes = [mode for mode in ("generation", "change", "add", "complete") if mode in result]
    table = Table("relations kept", *modes, "n", box=None)

    def cell(share: float | None) -> str:
        return "-" if share is None else f"{share:.3f}"

    for name in result["generation"]["groups"]:
        count = sum(
            entry["n"]
            for predicate, entry in result["generation"]["relations"].items()
            if predicate.split("_")[0] in name or predicate == name
        )
        table.add_row(name, *(cell(result[mode]["groups"].get(name)) for mode in modes), str(count))
    for name in ("total", "mean"):
        table.add_row(name, *(cell(result[mode][name]) for mode in modes), "")
    for name in ("edited", "untouched"):
        if len(modes) > 1:
            parts = [cell(result[mode][name]["total"]) if name in result[mode] else "" for mode in modes]
            table.add_row(f"total, {name}", *parts, "")
    settings = result["settings"]
    told = f"{settings['drop']:.0%} of relations dropped"
    if settings["told"] is not None:
        told = f"{settings['told']:g} relations an object told, near pairs first"
    console.print(f"{result['rooms']} rooms, rules {settings['rules']}, {told}")
    console.print(table)
    sizes = [row for row in result["sizes"] if row["ks"] is not None]
    if sizes:
        off = [row for row in sizes if abs(row["median_ratio"] - 1) > 0.1 or row["ks"] > 0.25]
        console.print(f"\nsizes: {len(off)} of {len(sizes)} classes and axes are off (median by 10% or KS above 0.25)")
        table = Table("class", "axis", "n", "median ratio", "KS", box=None)
        for row in sorted(off, key=lambda row: -row["ks"])[:15]:
            table.add_row(row["category"], row["axis"], str(row["n"]), f"{row['median_ratio']:.2f}", f"{row['ks']:.2f}")
        console.print(table)
    ours, real = result["figures"]["overlap"], result["real_figures"]["overlap"]
    console.print(
        f"\nfloor pairs that overlap {ours['floor_pairs']:.3f} (true rooms {real['floor_pairs']:.3f}), objects outside "
        f"the floor {ours['outside_floor']:.3f} ({real['outside_floor']:.3f})"
    )
    rows = [row for row in rows_between(result["figures"], result["real_figures"]) if row.section.startswith("pair")]
    table = Table("pairs and headings", "", "here", "true", "distance", box=None)
    for row in sorted(rows, key=lambda row: -row.distance)[:12]:
        values = (" ".join(f"{v:.2f}" for v in part) for part in (row.ours, row.real))
        table.add_row(row.section, row.name, *values, f"{row.distance:.2f}")
    console.print(table)
    _print_rooms(result, console)


def _print_rooms(result: dict, console: Console) -> None:
    """What a person would point at, the judge and how different the layouts are, where they were asked for."""
    from rich.table import Table

    if "living" in result:
        ours, real = result["living"], result["real_living"]
        table = Table("what a person would point at", "here", "true", box=None)
        rows = [
            ("faults an object", "per_object"),
            ("rooms without a fault", "free_of_faults"),
            ("walkable", "walkable"),
        ]
        for text, name in rows:
            table.add_row(text, *("-" if of[name] is None else f"{of[name]:.3f}" for of in (ours, real)))
        for name in ours["rules"] | real["rules"]:
            table.add_row(f"  {name}", *(f"{of['rules'].get(name, 0.0):.4f}" for of in (ours, real)))
        console.print(table)
    if "judge" in result:
        console.print(f"\na judge tells them from true rooms: {result['judge']['here']:.2f} right (0.5 = it cannot)")
    if "variety" in result:
        found = result["variety"]
        console.print(f"\n{found['seeds']} layouts of a graph are {found['here']:.2f} m apart ({found['rooms']} rooms)")
