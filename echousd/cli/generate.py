"""`echousd generate`: from a graph to a room on disk."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from echousd.cli.output import say

if TYPE_CHECKING:
    from echomodel.progress import StageListener
    from echousd.room import Room
    from echousd.room.house import Place

TITLES = {
    "read": "Reading the graph",
    "load": "Loading the model",
    "layout": "Placing the furniture",
    "repair": "Repairing the layout",
    "shapes": "Shaping the furniture",
    "meshes": "Cleaning the meshes",
    "settle": "Simulating the room",
    "write": "Writing the layers",
    "preview": "Drawing the preview",
}


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(epilog="Example: echousd generate samples/bedroom.usda -o out/bedroom --seed 7")(generate)


def generate(
    graph: Annotated[Path, typer.Argument(help="Scene graph (.usda, .usdc, .usd, .yaml, .json).", show_default=False)],
    output: Annotated[
        Path,
        typer.Option(
            "-o", "--output", help="Folder of the room (with --flat: a .usda or .usdc file).", show_default=False
        ),
    ],
    room: Annotated[str | None, typer.Option(help="Prim path of one room of several; default: all of them.")] = None,
    seed: Annotated[int, typer.Option(help="Seed of all randomness, 0 to 2^63 - 1.")] = 0,
    preset: Annotated[
        str | None, typer.Option(help="Which model: compact, paper or released; default: what the weights say.")
    ] = None,
    weights: Annotated[
        Path | None,
        typer.Option(help="Weights file or folder, from convert or train; default: those that ship."),
    ] = None,
    model: Annotated[Path | None, typer.Option(hidden=True, help="The same as --weights.")] = None,
    shapes: Annotated[
        str | None,
        typer.Option(help="parts: built of parts, with doors and drawers; sdf: free shapes; boxes. Default: parts."),
    ] = None,
    samples: Annotated[int, typer.Option(help="Layouts of the same furniture, as one variant set.", min=1)] = 1,
    drafts: Annotated[
        int | None, typer.Option(help="Layouts to choose the best from; default: 8.", min=1, max=64)
    ] = None,
    fit: Annotated[str, typer.Option(help="keep: all that is asked for; drop: leave out what has no place.")] = "keep",
    steps: Annotated[int | None, typer.Option(help="Sampling steps; default: the model's.", min=1)] = None,
    faces: Annotated[int, typer.Option(help="Face budget of each mesh.", min=100)] = 5000,
    up_axis: Annotated[str, typer.Option("--up-axis", help="Y or Z.")] = "Y",
    walls: Annotated[
        bool, typer.Option("--walls/--no-walls", help="Walls around the floor, with doors and windows.")
    ] = True,
    ceiling: Annotated[bool, typer.Option("--ceiling", help="Add a ceiling.")] = False,
    dress: Annotated[str, typer.Option(help="Small things, rugs, curtains: none, some or full.")] = "some",
    atlas: Annotated[bool, typer.Option("--atlas", help="Unwrap without overlaps (extra: texture).")] = False,
    repair: Annotated[
        bool, typer.Option("--repair/--no-repair", help="Move and size boxes until the graph is kept.")
    ] = True,
    settle: Annotated[
        bool, typer.Option("--settle", help="Simulate the room and put everything where it rests (extra: sim).")
    ] = False,
    flat: Annotated[bool, typer.Option("--flat", help="Write one file instead of a folder of layers.")] = False,
    crate: Annotated[
        str | None, typer.Option("--crate-version", help="Older usdc version for older hosts, e.g. 0.8.0.")
    ] = None,
    timings: Annotated[bool, typer.Option("--timings", help="Print how long each stage took.")] = False,
    store: Annotated[
        Path | None, typer.Option(help="Folder where many rooms keep their assets and images once.")
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Write into a folder that is not ours, replace a file.")
    ] = False,
    wait: Annotated[bool, typer.Option("--wait", help="Wait for another process that writes the folder.")] = False,
) -> None:
    """Generate a room from a scene graph: boxes, shapes, materials, physics, cameras, as layers of USD.

    A stage of several rooms becomes a folder for each and a root layer that composes them.
    """
    from echousd.room.manifest import check_seed

    started = time.perf_counter()
    check_seed(seed)
    check_output(output, flat=flat, force=force)
    if flat and store:
        raise ValueError(f"--store is {store}, which a file of --flat does not use; leave one of them out")
    set_crate_version(crate)
    if settle:
        from echousd.settle import require_engine, settled

        require_engine()
    house = () if room or flat else rooms_of(graph)
    with ExitStack() as held:
        if not house:
            held.enter_context(writing(output, flat=flat, force=force, wait=wait))
        held.enter_context(telling_faults())
        listen = held.enter_context(progress_bar())
        gc.disable()  # imports make a million objects and no garbage; looking for it took a fifth of their time
        try:
            from echousd.room.pipeline import generate as make
            from echousd.room.room import RoomOptions
            from echousd.room.save import save_flat, save_layers, write_preview, write_sheet
        finally:
            gc.enable()
        options = RoomOptions(up_axis.upper(), walls, atlas, ceiling, dress)
        spent = {"imports": time.perf_counter() - started}
        restless: list[str] = []

        def one(path: str | None, folder: Path) -> tuple[Room, Path, Path | None]:
            made = make(
                graph, room=path, seed=seed, shapes=shapes, model=weights or model, preset=preset, repair=repair,
                samples=samples, drafts=drafts, earlier=None if flat else folder, steps=steps, faces=faces,
                options=options, fit=fit, progress=listen,
            )  # fmt: skip
            if settle:
                with took(spent, "settle", listen):
                    found = settled(made)
                moved = tuple(f"{name} stands where it comes to rest" for name in found.moved)
                made = replace(found.room, notes=(*made.notes, *moved, *found.restless))
                restless.extend(found.restless)
            with took(spent, "write", listen):
                if flat:
                    root = save_flat(made, folder, force=force)
                else:
                    root = save_layers(made, folder, force=force, store=store)
            preview = None
            if not flat:
                with took(spent, "preview", listen):
                    preview = write_preview(root)
                    preview = write_sheet(root) or preview
            for stage, seconds in made.timings.items():
                spent[stage] = spent.get(stage, 0.0) + seconds
            return made, root, preview

        made = generate_house(output, house, one, force=force, wait=wait) if house else [one(room, output)]
    if timings:
        total = time.perf_counter() - started
        spent |= {"other": total - sum(spent.values()), "total": total}
        for stage, seconds in spent.items():
            typer.echo(f"{stage:>10} {seconds:7.2f} s")
    for each in made:
        report(*each)
    end(made, restless)


Made = tuple["Room", Path, Path | None]


def rooms_of(graph: Path) -> Sequence[Place]:
    """The rooms of a stage that holds several."""
    if graph.suffix.lower() not in (".usda", ".usdc", ".usd", ".usdz"):
        return ()
    from echousd.room.house import places

    return places(graph)


def generate_house(
    output: Path, house: Sequence[Place], one: Callable[[str, Path], Made], *, force: bool, wait: bool
) -> list[Made]:
    """Every room of a house in a folder of its own, and the layer that composes them."""
    from echousd.room.house import check_house, write_house

    root = output / f"{output.name}.usda"
    check_house(root, force=force)
    made = []
    for place in house:
        with writing(output / place.name, flat=False, force=force, wait=wait):
            made.append(one(place.path, output / place.name))
    write_house(root, house, {place.name: each[1] for place, each in zip(house, made, strict=True)}, force=force)
    say(f"house    {root}")
    return made


@contextmanager
def took(spent: dict[str, float], stage: str, listen: StageListener) -> Iterator[None]:
    """Note how long a stage took, and tell the bar."""
    started = time.perf_counter()
    listen(stage, 0, 1)
    yield
    listen(stage, 1, 1)
    spent[stage] = spent.get(stage, 0.0) + time.perf_counter() - started


def end(made: Sequence[Made], restless: Sequence[str] = ()) -> None:
    """Exit code 1 if a room has faults, or pieces that do not rest."""
    if restless or any(room.faults for room, *_ in made):
        raise typer.Exit(1)


def check_output(output: Path, *, flat: bool, force: bool) -> None:
    """Refuse before the long work what would be refused after it; raises ValueError."""
    if flat:
        if output.suffix not in (".usda", ".usdc"):
            raise ValueError(f"{output}: with --flat the output is a file that ends in .usda or .usdc")
        if output.exists() and not force:
            raise ValueError(f"{output}: exists; choose another file or use --force")
        return
    if output.suffix in (".usda", ".usdc", ".usd", ".usdz"):
        raise ValueError(f"{output}: the output is a folder; --flat writes one file")
    from echousd.room.folder import check_writable

    if output.exists() and not output.is_dir():
        raise ValueError(f"{output}: is a file, the output must be a folder")
    check_writable(output)


@contextmanager
def writing(output: Path, *, flat: bool, force: bool, wait: bool) -> Iterator[None]:
    """Have the folder for this process alone, from what is read of it to what is written."""
    if flat:
        yield
        return
    from echousd.room.folder import claim
    from echousd.room.lock import locked

    with locked(output, wait=wait):
        claim(output, force=force)
        yield


@contextmanager
def telling_faults() -> Iterator[None]:
    """Leave it to `report` to tell what a finished room does not keep."""
    import warnings

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "the room has faults")
        yield


def set_crate_version(version: str | None) -> None:
    """Make USD write usdc files of an older version; must come before USD writes its first one."""
    if version is None:
        return
    import os
    import re

    found = re.fullmatch(r"0\.(\d{1,2})\.\d", version, re.ASCII)
    if not found or int(found[1]) < 7:
        raise ValueError(f"crate version is {version!r}, allowed: 0.7.0 and newer, such as 0.8.0")
    os.environ["USD_WRITE_NEW_USDC_FILES_AS_VERSION"] = version


@contextmanager
def progress_bar() -> Iterator[StageListener]:
    """A bar per stage on a terminal, a plain line per stage elsewhere (on stderr)."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    if not console.is_terminal:
        told: set[str] = set()

        def plain(stage: str, done: int, total: int) -> None:
            if stage not in told:
                told.add(stage)
                typer.echo(TITLES.get(stage, stage), err=True)

        yield plain
        return
    bar = Progress(TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), console=console)
    tasks: dict[str, Any] = {}
    with bar:

        def listen(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bar.add_task(TITLES.get(stage, stage), total=total)
            bar.update(tasks[stage], completed=done, total=total)

        yield listen


def report(room: Room, root: Path, preview: Path | None) -> None:
    """Say what was made and what the graph asked for in vain."""
    say(f"room     {root}")
    if preview is not None:
        say(f"preview  {preview}")
    for number, found in enumerate(room.outcomes):
        counts, several = found.counts(), len(room.outcomes) > 1
        kept = f"{counts['kept']} of {counts['kept'] + counts['broken']} measured relations kept"
        say(f"layout_{number} {kept}" if several else f"graph    {len(room.names)} objects, {kept}")
        for verdict in found.broken:
            say(f"broken   {verdict.subject} {verdict.predicate} {verdict.object} (margin {verdict.margin:+.2f})")
        for hit in found.collisions:
            say(f"collide  {hit.first} and {hit.second} by {hit.depth:.2f} m")
    for note in room.notes:
        say(f"note     {note}")
