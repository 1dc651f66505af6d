"""`echousd train`: recipes to weights; `echousd data`: data sets, made, looked at and converted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from echomodel.files import check_free
from echomodel.late import Late
from echousd.cli.options import Replace
from echousd.cli.output import counted

if TYPE_CHECKING:
    import trimesh

    from echomodel.roomboxes import RoomBoxes
    from echousd.assets.record import AssetRecord


Terminal, progress_bar = Late("echousd.cli.terminal:Terminal"), Late("echousd.cli.progress:progress_bar")
load_rooms, with_known_words = (Late(f"echomodel.data.roomset:{name}") for name in ("load_rooms", "with_known_words"))
app = typer.Typer()


@app.command("train")
def train(
    recipe: Annotated[Path, typer.Argument(help="Recipe file (TOML), see model/recipes.")],
    settings: Annotated[list[str] | None, typer.Option("--set", help="Change a field: key.sub=value.")] = None,
    out: Annotated[Path | None, typer.Option("-o", "--output", help="The run's folder; default: runs/RECIPE.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Continue from the folder's checkpoint.")] = False,
    minutes: Annotated[float | None, typer.Option(help="Stop (with a checkpoint) after so many minutes.")] = None,
) -> None:
    """Train a part of the echo model; a run that was stopped continues bit for bit with --resume.

    Example: echousd train model/recipes/layout.toml --set data=data/full --set steps=20000
    """
    from echomodel.training.recipe import read_recipe
    from echomodel.training.start import open_run

    console = Terminal(stderr=True)
    folder = out or Path("runs") / recipe.stem
    plan = read_recipe(recipe, settings)
    if not resume and (folder / "checkpoint.safetensors").exists():
        raise ValueError(f"{folder}: holds a run already, continue it with --resume or choose another --output")

    def report(step: int, values: dict[str, float]) -> None:
        console.print(f"step {step}/{plan.steps}  " + "  ".join(f"{k} {v:.4g}" for k, v in values.items()))

    trainer = open_run(plan, folder, resume=resume, report=report)
    reached = trainer.run(seconds=None if minutes is None else minutes * 60)
    console.print(f"stopped at step {reached} of {plan.steps}: {folder}/weights.safetensors")


data_app = typer.Typer(help="Rooms and furniture to learn from.", no_args_is_help=True)
app.add_typer(data_app, name="data")

Seed = Annotated[int, typer.Option(help="Seed of the world; equal seeds give equal bytes.")]
Rooms = Annotated[Path, typer.Argument(help="Rooms file (JSON) or folder of a room set.")]


@data_app.command("build")
def build(
    out: Annotated[Path, typer.Option("-o", "--output", help="Folder of the data set.")],
    recipe: Annotated[str, typer.Option(help="smoke (seconds), packed (at most 40 MB) or full.")] = "smoke",
    seed: Seed = 0,
) -> None:
    """Make rooms and shapes to train on; run again to continue a build that was stopped.

    Example: echousd data build --recipe packed --seed 1 -o data/packed
    """
    from echomodel.data.build import build_data

    with progress_bar() as listen:
        rooms, shapes = build_data(out, recipe, seed, listen)
    size = sum(path.stat().st_size for path in out.rglob("*") if path.is_file()) / 1e6
    Terminal(stderr=True).print(f"{out}: {len(rooms)} rooms, {len(shapes)} shapes, {size:.1f} MB")


@data_app.command("rooms")
def rooms_command(
    out: Annotated[Path, typer.Option("-o", "--output", help="A rooms file (.json), or a set to train on (.npz).")],
    count: Annotated[int, typer.Option(help="Number of rooms.")] = 100,
    seed: Seed = 0,
    room: Annotated[str | None, typer.Option(help="Room type; default a mixture.")] = None,
    force: Replace = False,
) -> None:
    """Generate rooms into a rooms file.

    Example: echousd data rooms --count 50 --room bedroom -o bedrooms.json
    """
    from echomodel.rooms.generator import generate_rooms
    from echomodel.vocabulary import vocabulary

    _check_one_file(out, force=force)
    kind = None if room is None else vocabulary().room_type(room).name
    _write_one_file(out, generate_rooms(count, seed, room_type=kind), "generated rooms")


def _check_one_file(out: Path, *, force: bool) -> None:
    if out.suffix not in (".npz", ".json"):
        raise ValueError(f"{out}: allowed are a set to train on (.npz) and a rooms file (.json)")
    check_free(out, force=force)


def _write_one_file(out: Path, found: list[RoomBoxes], kind: str) -> None:
    """Rooms in a rooms file, or in a set to train on, which holds known words alone; says how many."""
    from echomodel.data.roomset import kept_out, pack_rooms
    from echomodel.roomboxes import write_rooms

    left = ""
    if out.suffix == ".json":
        write_rooms(out, found)
    else:
        known = [one for one in with_known_words(found) if len(one)]
        pack_rooms(out, known, [kept_out(k) for k in range(len(known))], {"kind": kind})
        left = f"; objects of unknown words left out: {sum(map(len, found)) - sum(map(len, known))}"
        found = known
    Terminal(stderr=True).print(f"{out}: {counted(len(found), 'room')}{left}")


@data_app.command("search")
def search(
    out: Annotated[Path, typer.Option("-o", "--output", help="Folder of the rooms; run again to go on.")],
    count: Annotated[int, typer.Option(help="Graphs to search rooms of, or rooms to look through.", min=1)] = 20_000,
    seed: Seed = 0,
    drafts: Annotated[int, typer.Option(help="Drafts of the network a room, beside one arrangement.", min=0)] = 2,
    weights: Annotated[str | None, typer.Option(help="Weights that draw them; default: those that ship.")] = None,
    workers: Annotated[int, typer.Option(help="Processes.", min=1)] = 1,
    minutes: Annotated[float | None, typer.Option(help="Begin nothing after so many minutes.")] = None,
    unsearched: Annotated[bool, typer.Option(help="The generator's rooms that miss no term, none searched.")] = False,
    rooms: Annotated[str | None, typer.Option(help="A packed set whose rooms are searched on, not new ones.")] = None,
) -> None:
    """Search rooms without a fault to train on, from several starts each; OUT/rooms.npz is the set.

    Example: echousd data search --count 200 --seed 7 -o data/found
    """
    from echousd.place.examples import GRAPHS, PLAIN, ExamplesPlan, search_examples

    console = Terminal(stderr=True)

    def report(row: dict[str, float]) -> None:
        console.print("  ".join(f"{name} {value}" for name, value in row.items()))

    plan = ExamplesPlan(seed, drafts, weights, not unsearched, rooms)
    shards = -(-count // (PLAIN if unsearched else GRAPHS))
    found = search_examples(out, plan, shards=shards, workers=workers, minutes=minutes, report=report)
    console.print(f"{out}/rooms.npz: {len(found)} rooms, {int(found.counts.sum())} objects")


@data_app.command("plot")
def plot(
    rooms: Rooms,
    out: Annotated[Path, typer.Option("-o", "--output", help="Picture file.")],
    limit: Annotated[int, typer.Option(help="Number of rooms.")] = 50,
    columns: Annotated[int, typer.Option(help="Rooms in a row.", min=1, max=1000)] = 10,
    room: Annotated[str | None, typer.Option(help="Only rooms of this type.")] = None,
    labels: Annotated[bool, typer.Option(help="Write the categories.")] = True,
    force: Replace = False,
) -> None:
    """Draw rooms from above: rectangles coloured per class, a red line to each front.

    Example: echousd data plot rooms.json -o rooms.png --limit 20 --room bedroom
    """
    from echomodel.data.roomset import rooms_of_type
    from echomodel.data.sheet import plot_rooms

    check_free(out, force=force)
    found = load_rooms(rooms)
    if room is not None:
        found = rooms_of_type(found, room, rooms)
    plot_rooms(found[:limit], out, columns=columns, labels=labels)


@data_app.command("meshes")
def meshes(
    library: Annotated[Path, typer.Argument(help="Index of a library (.parquet), from echousd assets index.")],
    out: Annotated[Path, typer.Option("-o", "--output", help="Folder of the set.")],
    copies: Annotated[int, typer.Option(min=1, help="Stored shapes per training mesh: 1 as it is, 2 with mirror.")] = 2,
) -> None:
    """Make a shape set from the usable models of a library: metric size, flood-filled distances, attribution.

    Classes and fronts are those of the index; `echousd assets review` tells how they are corrected.

    Example: echousd data meshes models.parquet -o data/meshes
    """
    from functools import partial

    import numpy as np

    from echomodel.data.shapeset import MeshModel, build_meshes
    from echousd.assets.measure import measure
    from echousd.assets.table import read_library
    from echousd.shapes.originals.loading import library_file

    found, console = read_library(library), Terminal(stderr=True)

    def model(record: AssetRecord) -> MeshModel:
        def load() -> trimesh.Trimesh:
            return measure(library_file(found, record)).turned(np.eye(3)).apply_transform(record.pose())

        about = record.id, record.category, record.name, record.licence, record.author
        return MeshModel(*about, f"{record.sha256} {record.turn} {record.dims}", load)

    models = [model(record) for record in found.records.values() if record.usable]
    with progress_bar() as listen:
        shapes = build_meshes(
            out, models, copies=copies, progress=partial(listen, "meshes"),
            skipped=lambda line: console.print(f"skipped: {line}"),
        )  # fmt: skip
    console.print(f"{out}: {len(shapes)} shapes, {int(shapes.held_out.sum())} held out")


@data_app.command("to-usd")
def to_usd(
    rooms: Rooms,
    out: Annotated[Path, typer.Option("-o", "--output", help="Folder for the stages, one per room.")],
    limit: Annotated[int | None, typer.Option(help="Only the first rooms.")] = None,
    rules: Annotated[str, typer.Option(help="Label rooms without relations: strict, sgfront or none.")] = "strict",
    known: Annotated[bool, typer.Option(help="Leave out objects that the vocabulary does not hold.")] = True,
    force: Replace = False,
) -> None:
    """Write rooms of any source as USD stages with their scene graphs.

    Example: echousd data to-usd rooms.json -o stages --limit 10
    """
    from echousd.stage.boxes import write_stages

    check_free(out, force=force)
    found = load_rooms(rooms, limit)
    if known:
        kept = with_known_words(found)
        # Relations speak of places in the list: they stay valid only where nothing was left out.
        found = [
            room if len(room) < len(old) else replace(room, relations=old.relations)
            for room, old in zip(kept, found, strict=True)
        ]
    write_stages(found, out, None if rules == "none" else rules)


@data_app.command("import")
def import_rooms(
    sources: Annotated[
        list[Path], typer.Argument(help="Rooms files, sets, stages, SG-FRONT, folders, what eval reads.")
    ],
    out: Annotated[Path, typer.Option("-o", "--output", help="A set to train on (.npz), or a rooms file (.json).")],
    room: Annotated[str, typer.Option(help="Of SG-FRONT: bedroom, livingroom, diningroom, library or all.")] = "all",
    split: Annotated[str, typer.Option(help="Of SG-FRONT: trainval or test.")] = "trainval",
    force: Replace = False,
) -> None:
    """Bring rooms of any source into one file: for `echousd train --set data=FILE.npz`, or for eval.

    A set holds every twentieth room out and is labelled anew where it is read; a rooms file keeps what is told.

    Example: echousd data import my_stages more_rooms.json -o mine.npz
    """
    from echomodel.data.sgfront import SGFront
    from echousd.evaluation.runs import rooms_from

    _check_one_file(out, force=force)
    found: list[RoomBoxes] = []
    for source in sources:
        sgfront = (source / "classes_all.txt").exists()
        found += SGFront(source, room, split).rooms() if sgfront else rooms_from(source)
    if not found:
        raise ValueError(f"{', '.join(map(str, sources))}: no room found")
    _write_one_file(out, found, "imported rooms")


@data_app.command("to-sgfront")
def to_sgfront(
    rooms: Rooms,
    out: Annotated[Path, typer.Option("-o", "--output", help="Folder for the files.")],
    split: Annotated[str, typer.Option(help="trainval or test.")] = "trainval",
    drop: Annotated[float, typer.Option(help="Share of the relations that is left out.")] = 0.5,
    seed: Annotated[int, typer.Option(help="Seed of the dropping.")] = 0,
    force: Replace = False,
) -> None:
    """Write rooms in the files of SG-FRONT, labelled by its rules.

    Example: echousd data to-sgfront rooms.json -o sgfront
    """
    from echomodel.data.sgfront import write_sgfront

    check_free(out, force=force)
    write_sgfront(out, with_known_words(load_rooms(rooms)), split=split, drop=drop, seed=seed)
