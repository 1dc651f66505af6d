"""`echousd train`: recipes to weights; `echousd data`: data sets, made, looked at and converted."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from echomodel.files import check_free
from echomodel.late import Late
from echousd.cli.options import Replace, documented_command
from echousd.cli.output import counted

if TYPE_CHECKING:
    import trimesh

    from echomodel.roomboxes import RoomBoxes
    from echousd.assets.record import AssetRecord


Terminal, progress_bar = Late("echousd.cli.terminal:Terminal"), Late("echousd.cli.progress:progress_bar")
load_rooms, with_known_words = (Late(f"echomodel.data.roomset:{name}") for name in ("load_rooms", "with_known_words"))
app = typer.Typer()


@documented_command(app, "train")
def train(
    recipe: Path, settings: list[str] | None = None, out: Path | None = None, resume: bool = False,
    minutes: float | None = None,
) -> None:  # fmt: skip
    """Train a part of the echo model; a run that was stopped continues bit for bit with --resume."""
    from echomodel.training.recipe import read_recipe
    from echomodel.training.run import open_run

    console = Terminal(stderr=True)
    folder = out or Path("runs") / recipe.stem
    plan = read_recipe(recipe, settings)
    there = [name for name in ("checkpoint.safetensors", "weights.safetensors") if (folder / name).exists()]
    if there and not resume:
        raise ValueError(f"{folder}: holds {there[0]} already, continue it with --resume or choose another --output")

    def report(step: int, values: dict[str, float]) -> None:
        console.print(f"step {step}/{plan.steps}  " + "  ".join(f"{k} {v:.4g}" for k, v in values.items()))

    trainer = open_run(plan, folder, resume=resume, report=report)
    reached = trainer.run(seconds=None if minutes is None else minutes * 60)
    console.print(f"stopped at step {reached} of {plan.steps}: {folder}/weights.safetensors")


data_app = typer.Typer(help="Rooms and furniture to learn from.", no_args_is_help=True)
app.add_typer(data_app, name="data")

Seed = Annotated[int, typer.Option(help="Seed of the world; equal seeds give equal bytes.")]
Rooms = Annotated[Path, typer.Argument(help="Rooms file (JSON) or folder of a room set.")]


@documented_command(data_app, "data build")
def build(out: Path, recipe: str = "smoke", seed: Seed = 0) -> None:
    """Make rooms and shapes to train on; run again to continue a build that was stopped."""
    from echomodel.data.shapeset import build_data

    with progress_bar() as listen:
        rooms, shapes = build_data(out, recipe, seed, listen)
    size = sum(path.stat().st_size for path in out.rglob("*") if path.is_file()) / 1e6
    Terminal(stderr=True).print(f"{out}: {len(rooms)} rooms, {len(shapes)} shapes, {size:.1f} MB")


@documented_command(data_app, "data rooms")
def rooms_command(out: Path, count: int = 100, seed: Seed = 0, room: str | None = None, force: Replace = False) -> None:
    """Generate rooms into a rooms file."""
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


@documented_command(data_app, "data search")
def search(
    out: Path, count: int = 20_000, seed: Seed = 0, drafts: int = 2, weights: str | None = None, workers: int = 1,
    minutes: float | None = None, unsearched: bool = False, rooms: str | None = None,
) -> None:  # fmt: skip
    """Search rooms without a fault to train on, from several starts each; OUT/rooms.npz is the set."""
    from echousd.place.examples import GRAPHS, PLAIN, ExamplesPlan, search_examples

    console = Terminal(stderr=True)

    def report(row: dict[str, float]) -> None:
        console.print("  ".join(f"{name} {value}" for name, value in row.items()))

    plan = ExamplesPlan(seed, drafts, weights, not unsearched, rooms)
    shards = -(-count // (PLAIN if unsearched else GRAPHS))
    found = search_examples(out, plan, shards=shards, workers=workers, minutes=minutes, report=report)
    console.print(f"{out}/rooms.npz: {len(found)} rooms, {int(found.counts.sum())} objects")


@documented_command(data_app, "data plot")
def plot(
    rooms: Rooms, out: Path, limit: int = 50, columns: int = 10, room: str | None = None, labels: bool = True,
    force: Replace = False,
) -> None:  # fmt: skip
    """Draw rooms from above: rectangles coloured per class, a red line to each front."""
    from echomodel.data.roomset import rooms_of_type
    from echomodel.data.sheet import plot_rooms

    check_free(out, force=force)
    found = load_rooms(rooms)
    if room is not None:
        found = rooms_of_type(found, room, rooms)
    plot_rooms(found[:limit], out, columns=columns, labels=labels)


@documented_command(data_app, "data meshes")
def meshes(library: Path, out: Path, copies: int = 2) -> None:
    """Make a shape set from the usable models of a library: metric size, flood-filled distances, attribution.

    Classes and fronts are those of the index; `echousd assets review` tells how they are corrected.
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


@documented_command(data_app, "data to-usd")
def to_usd(
    rooms: Rooms, out: Path, limit: int | None = None, rules: str = "strict", known: bool = True,
    force: Replace = False,
) -> None:  # fmt: skip
    """Write rooms of any source as USD stages with their scene graphs."""
    from echousd.stage.boxes import write_stages

    check_free(out, force=force)
    found = load_rooms(rooms, limit)
    write_stages(with_known_words(found) if known else found, out, None if rules == "none" else rules)


@documented_command(data_app, "data import")
def import_rooms(
    sources: list[Path], out: Path, room: str = "all", split: str = "trainval", force: Replace = False,
) -> None:  # fmt: skip
    """Bring rooms of any source into one file: for `echousd train --set data=FILE.npz`, or for eval.

    A set holds every twentieth room out and is labelled anew where it is read; a rooms file keeps what is told.
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


@documented_command(data_app, "data to-sgfront")
def to_sgfront(
    rooms: Rooms, out: Path, split: str = "trainval", drop: float = 0.5, seed: int = 0, force: Replace = False,
) -> None:  # fmt: skip
    """Write rooms in the files of SG-FRONT, labelled by its rules."""
    from echomodel.data.sgfront import write_sgfront

    check_free(out, force=force)
    write_sgfront(out, with_known_words(load_rooms(rooms)), split=split, drop=drop, seed=seed)
