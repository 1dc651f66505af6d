"""`echousd generate`: from a graph to a room on disk."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from echousd.cli.options import Force, Made, Outside, Wait, add_room_command
from echousd.cli.output import say
from echousd.cli.report import report, telling_faults

if TYPE_CHECKING:
    from echomodel.progress import StageListener
    from echousd.layers.house import Place
    from echousd.make.written import Written

TITLES = {
    "read": "Reading the graph",
    "load": "Loading the model",
    "assets": "Choosing models",
    "layout": "Placing the furniture",
    "place": "Placing the furniture",
    "shapes": "Shaping the furniture",
    "meshes": "Cleaning the meshes",
    "settle": "Simulating the room",
    "write": "Writing the layers",
    "preview": "Drawing the preview",
}


def register(app: typer.Typer) -> None:
    """Add the command."""
    add_room_command(app, generate, "echousd generate samples/bedroom.usda -o out/bedroom --seed 7")


def generate(
    graph: Annotated[Path, typer.Argument(help="Scene graph: a stage, YAML or JSON.", show_default=False)],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder of the room.", show_default=False)],
    room: Annotated[
        str | None, typer.Option(help="Prim path of one room of several; default: all of them.", hidden=True)
    ] = None,
    flat: Annotated[bool, typer.Option("--flat", help="One .usda or .usdc file instead.")] = False,
    json: Made = False,
    store: Annotated[
        Path | None, typer.Option(help="Folder where many rooms keep their assets and images once.", hidden=True)
    ] = None,
    force: Force = False,
    wait: Wait = False,
    outside: Outside = None,
    **given: Any,
) -> None:
    """Generate a room from a scene graph, as layers of USD; of a house, its rooms and a layer that composes them.

    Of a graph's numbers, lengths are metres in the room's frame (+Y up, the floor at 0), yaw is `90 deg` or radians
    about +Y: at 0 a front looks along +Z.
    """
    from echousd.folder.output import check_output, writing
    from echousd.options import RoomOptions

    started = time.perf_counter()
    options = RoomOptions(**given)
    check_output(output, flat=flat, force=force)
    if flat and store:
        raise ValueError(f"--store is {store}, which a file of --flat does not use; leave one of them out")
    house = () if room or flat else rooms_of(graph)
    with ExitStack() as held:
        if not house:
            held.enter_context(writing(output, flat=flat, force=force, wait=wait))
        held.enter_context(telling_faults())
        listen = held.enter_context(progress_bar())
        from echousd.make.pipeline import generate as make
        from echousd.make.written import write_room, write_rooms
        from echousd.progress import StageTimer

        spent = {"imports": time.perf_counter() - started}

        def one(path: str | None, folder: Path) -> Written:
            room = make(
                graph,
                room=path,
                options=options,
                outside=outside or (),
                earlier=None if flat else folder,
                progress=listen,
            )
            timer = StageTimer(listen)
            written = write_room(room, folder, timer, flat=flat, force=force, store=store)
            for stage, seconds in (*timer.seconds.items(), *room.timings.items()):
                spent[stage] = spent.get(stage, 0.0) + seconds
            return written

        if house:
            root, made = write_rooms(output, house, one, force=force, wait=wait)
            if not json:
                say(f"house    {root}")
        else:
            root, made = None, [one(room, output)]
    total = time.perf_counter() - started
    spent |= {"other": total - sum(spent.values()), "total": total}
    more = {"timings": {stage: round(seconds, 3) for stage, seconds in spent.items()}}
    report(made, since=started, json=json, house=root, more=more)


def rooms_of(graph: Path) -> Sequence[Place]:
    """The rooms of a stage that holds several; text is not worth loading USD for."""
    if graph.suffix.lower() not in (".usda", ".usdc", ".usd", ".usdz"):
        return ()
    from echousd.layers.house import places

    return places(graph)


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
