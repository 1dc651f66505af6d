"""`echousd eval`: scores of a model on rooms (`layout`) and on shapes (`shapes`)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from echomodel.files import write_json, write_picture
from echousd.cli.output import plain_json, say_json

if TYPE_CHECKING:
    import numpy as np
    import trimesh
    from rich.console import Console

ROW = 12  # pieces of rooms in a row of their sheet
eval_app = typer.Typer(help="Scores of a model: relations, sizes, collisions, shapes.", no_args_is_help=True)


def register(app: typer.Typer) -> None:
    """Add the topic."""
    app.add_typer(eval_app, name="eval")


@eval_app.command("suite")
def suite(
    systems: Annotated[
        list[str] | None,
        typer.Argument(
            help="default, network, guided, shuffled, generator, random, retrieval, real, each also with +search or "
            "+half; weights; rooms from elsewhere. None: default, network, guided.",
            show_default=False,
        ),
    ] = None,
    against: Annotated[
        str, typer.Option(help="Rooms file, room set or SG-FRONT folder; generated: held-out rooms of the generator.")
    ] = "generated",
    out: Annotated[Path, typer.Option("-o", "--output", help="REPORT: gets .md, .json and .html.")] = Path("report"),
    only: Annotated[str, typer.Option(help="Sections, with commas; default: all.")] = "",
    samples: Annotated[int, typer.Option(help="Rooms that every system lays out.", min=2)] = 24,
    seed: Annotated[int, typer.Option(help="Seed of every draw.")] = 0,
    workers: Annotated[int, typer.Option(help="Processes that place rooms.", min=1)] = 2,
) -> None:
    """Ask systems the same rooms, score them beside chance and plain baselines, and write a report.

    Example: echousd eval suite default guided --against rooms.json -o report --only relations,faults
    """
    from rich.progress import Progress

    from echousd.cli.output import say
    from echousd.cli.terminal import Terminal
    from echousd.evaluation.report import write_report
    from echousd.evaluation.suite import SYSTEMS, SuiteSettings, evaluate

    chosen = tuple(word.strip() for word in only.split(",") if word.strip())
    asked = tuple(systems) if systems else SYSTEMS
    settings = SuiteSettings(asked, against, samples, seed, chosen, workers=workers)
    command = f"echousd eval suite {' '.join(asked)} --against {against} --samples {samples} --seed {seed}"
    command += f" --only {','.join(chosen)}" if chosen else ""
    console = Terminal(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as bar:
        tasks: dict = {}

        def progress(what: str, done: int, total: int) -> None:
            tasks.setdefault(what, bar.add_task(what, total=total) if what not in tasks else None)
            bar.update(tasks[what], completed=done)

        found, run = evaluate(settings, progress)
    for path in write_report(found, run, out, command):
        say(str(path))


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
        sampler = model_layouts(weights, seed, rules, steps, relation_guidance)
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
        _print_layout(result, Terminal())


def _print_layout(result: dict, console: Console) -> None:
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


@eval_app.command("shapes")
def shapes(
    meshes: Annotated[Path | None, typer.Option(help="Set of real meshes, made by `echousd data meshes`.")] = None,
    shape_set: Annotated[Path | None, typer.Option("--set", help="Shape set, made by `echousd data build`.")] = None,
    model: Annotated[Path | None, typer.Option(help="Weights file or folder; default: those that ship.")] = None,
    limit: Annotated[int, typer.Option(min=1, help="Held-out shapes to reconstruct.")] = 200,
    rooms: Annotated[
        int, typer.Option(min=0, help="Rooms to fill with generated shapes; 0 = reconstruction only.")
    ] = 12,
    steps: Annotated[int | None, typer.Option(help="Sampling steps; default the model's.", min=1)] = None,
    seed: Annotated[int, typer.Option(help="Seed of the choice, the rooms and the sampling.")] = 0,
    per_class: Annotated[
        int, typer.Option(min=0, help="Objects to generate of every class, cleaned as in rooms; 0 = none.")
    ] = 0,
    sheet: Annotated[Path | None, typer.Option(help="Write a contact sheet of what is generated per class.")] = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Write all figures to a JSON file.")] = None,
    json_out: Annotated[bool, typer.Option("--json", help="Print all figures as JSON.")] = False,
    source: Annotated[
        str | None, typer.Option("--shapes", help="parts or sdf; default: sdf where a set is named, else parts.")
    ] = None,
) -> None:
    """Reconstruct held-out shapes and generate shapes for new rooms, and score both against a set.

    Examples: echousd eval shapes --sheet parts.png, or
    echousd eval shapes --shapes sdf --set data/packed/shapes --rooms 12 --sheet shapes.png
    """
    from rich.progress import Progress

    from echomodel.data.shapeset import ShapeSet
    from echomodel.data.sheet import contact_sheet
    from echomodel.loading import load_model
    from echomodel.metrics.shape_evaluation import ShapeEvaluation, class_shapes, evaluate_shapes
    from echousd.cli.terminal import Terminal

    source = source or ("parts" if meshes is None and shape_set is None else "sdf")
    if source not in ("parts", "sdf"):
        raise ValueError(f"--shapes is {source!r}, allowed: parts, sdf")
    if source == "parts":
        _parts(meshes or shape_set, model, per_class or 8, rooms, seed, steps, sheet, out, json_out=json_out)
        return
    if (meshes is None) == (shape_set is None):
        raise ValueError("name one set to compare with: --meshes FOLDER or --set FOLDER")
    folder = meshes or shape_set
    assert folder is not None
    found = ShapeSet(folder / "shapes" if (folder / "shapes").is_dir() else folder)
    console = Terminal(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as bar:
        tasks: dict = {}

        def progress(what: str, done: int, total: int) -> None:
            if what not in tasks:
                tasks[what] = bar.add_task(what, total=total)
            bar.update(tasks[what], completed=done)

        settings = ShapeEvaluation(limit=limit, rooms=rooms, seed=seed, steps=steps)
        loaded = load_model(model)
        result, made = evaluate_shapes(loaded, found, settings, progress)
        if per_class:
            result["classes"], made = _cleaned(class_shapes(loaded, per_class, seed, progress))
    if sheet is not None and made:
        write_picture(sheet, contact_sheet([(name, made[name][: per_class or 8]) for name in sorted(made)]))
    if out is not None:
        write_json(out, plain_json(result))
    if json_out:
        say_json(result)
    else:
        _print_shapes(result)


def _parts(
    compared: Path | None,
    weights: Path | None,
    per_class: int,
    rooms: int,
    seed: int,
    steps: int | None,
    sheet: Path | None,
    out: Path | None,
    *,
    json_out: bool,
) -> None:
    """Score furniture made of parts, against a set of shapes as well where one is named."""
    from echomodel.data.shapeset import ShapeSet
    from echomodel.data.sheet import contact_sheet
    from echomodel.echo import EchoModel
    from echomodel.metrics.parts_evaluation import ROOMS, PartsEvaluation, evaluate_parts
    from echousd.cli.terminal import Terminal

    folder = compared / "shapes" if compared and (compared / "shapes").is_dir() else compared
    shapes = None if folder is None else ShapeSet(folder)
    settings = PartsEvaluation(per_class=per_class, rooms=rooms, seed=seed, steps=steps)
    result, made = evaluate_parts(EchoModel.load(weights), settings, shapes)
    standing = made.pop(ROOMS, [])
    if sheet is not None:
        write_picture(sheet, contact_sheet([(name, made[name]) for name in sorted(made)]))
        rows = [("", standing[start : start + ROW]) for start in range(0, len(standing), ROW)]
        if rows:
            write_picture(sheet.with_stem(f"{sheet.stem}_rooms"), contact_sheet(rows))
    if out is not None:
        write_json(out, plain_json(result))
    if json_out:
        say_json(result)
        return
    console, pieces, style = Terminal(), result["pieces"], result["style"]
    for where, counts in (("alone", pieces), ("in rooms", result.get("rooms_pieces"))):
        if counts:
            console.print(
                f"{counts['pieces']:.0f} pieces {where}, {counts['closed']:.0f} closed, {counts['loose']:.0f} with a "
                f"loose part, boxes filled to {1000 * counts['box_error']:.2g} mm"
            )
    console.print(
        f"style distance across classes: told {style['told']:.3f}, nothing told {style['untold']:.3f}, "
        f"of other suites {style['other']:.3f}, ratio {style['ratio']:.2f}"
    )
    console.print(
        f"within a class: style distance {result['diversity']['style_distance']:.3f}, "
        f"{result['diversity']['distinct']} of {pieces['pieces']:.0f} pieces differ"
    )
    for name in ("sets", "shapes_sets"):
        if "mean" in result.get(name, {}):
            row = result[name]["mean"]
            what = "drawn anew" if name == "sets" else result["shapes_set"]
            console.print(f"against {what}: MMD {row['mmd']:.4f}, COV {row['cov']:.2f}, 1-NNA {row['acc']:.2f}")


def _cleaned(shapes: dict[str, list[tuple[np.ndarray, np.ndarray]]]) -> tuple[dict, dict[str, list[trimesh.Trimesh]]]:
    """Generated shapes as the meshes that a room would get, and how many of them are closed."""
    from echousd.shapes.meshing import mesh_from_shape

    made: dict[str, list[trimesh.Trimesh]] = {}
    scores = {"objects": 0, "empty": 0, "watertight": 0}
    for name, objects in shapes.items():
        made[name] = []
        for grid, size in objects:
            scores["objects"] += 1
            try:
                clean = mesh_from_shape(grid, size)
            except ValueError:
                scores["empty"] += 1
                continue
            scores["watertight"] += clean.watertight
            made[name].append(clean.mesh)
    return scores, made


def _print_shapes(result: dict) -> None:
    from rich.table import Table

    from echousd.cli.terminal import Terminal

    console = Terminal()
    table = Table("reconstruction", "n", "F-score", "IoU", "Chamfer", box=None)
    rows = result["reconstruction"]
    for name in ["all", *sorted((n for n in rows if n != "all"), key=lambda n: rows[n]["f_score"])]:
        row = rows[name]
        table.add_row(
            name, f"{row['n']:.0f}", *(f"{row[key]:.3f}" for key in ("f_score", "iou")), f"{row['chamfer']:.4f}"
        )
    console.print(table)
    if "classes" in result:
        made = result["classes"]
        console.print(
            f"\n{made['objects']} of all classes, {made['empty']} empty, {made['watertight']} closed when clean"
        )
    if "generation" not in result:
        return
    made = result["generation"]
    console.print(f"\n{made['objects']} generated, {made['empty']} empty, {made['watertight']:.1%} watertight")
    if made["style"]:
        style = made["style"]
        console.print(
            f"Chamfer within a style group {style['within']:.5f}, in the class {style['between']:.5f}, ratio "
            f"{style['ratio']:.2f} ({style['within_n']:.0f} pairs)"
        )
    table = Table("sets", "n", "MMD", "COV", "1-NNA", box=None)
    for name, row in made["sets"].items():
        table.add_row(name, f"{row['n']:.0f}", f"{row['mmd']:.4f}", f"{row['cov']:.2f}", f"{row['acc']:.2f}")
    console.print(table)
