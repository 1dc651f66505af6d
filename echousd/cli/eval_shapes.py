"""`echousd eval shapes`: reconstruction and generation scores of a model's shapes, with a contact sheet."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from echomodel.files import write_json, write_picture
from echousd.cli.output import plain_json, say_json

if TYPE_CHECKING:
    import numpy as np
    import trimesh

ROW = 12  # pieces of rooms in a row of their sheet


def register(app: typer.Typer) -> None:
    """Add the command to `echousd eval`."""
    from echousd.cli.eval import eval_app

    eval_app.command("shapes")(shapes)


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
        _print(result)


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


def _print(result: dict) -> None:
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
