"""`echousd generate`: from a graph to a room on disk."""

from __future__ import annotations

import gc
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from echousd.cli.options import Assets, Licenses, Outside, Stretch, Wait
from echousd.cli.output import say
from echousd.cli.report import report, telling_faults

if TYPE_CHECKING:
    from echomodel.progress import StageListener
    from echousd.room.house import Place
    from echousd.room.written import Written

TITLES = {
    "read": "Reading the graph",
    "load": "Loading the model",
    "assets": "Choosing models",
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
        typer.Option(
            help="parts: built of parts, with doors and drawers; sdf: free shapes; library: models of --assets; "
            "guided: those most like free shapes; boxes. Default: parts."
        ),
    ] = None,
    assets: Assets = None,
    outside: Outside = None,
    stretch: Stretch = 1.15,
    licenses: Licenses = None,
    text: Annotated[
        str, typer.Option(help='What models shall be like, "mid-century oak" (extra: text).', show_default=False)
    ] = "",
    collect: Annotated[
        bool, typer.Option("--collect", help="Take models along with their files instead of referring to them.")
    ] = False,
    samples: Annotated[int, typer.Option(help="Layouts of the same furniture, as one variant set.", min=1)] = 1,
    drafts: Annotated[
        int | None, typer.Option(help="Layouts to choose the best from; default: 8.", min=1, max=64)
    ] = None,
    fit: Annotated[str, typer.Option(help="keep: all that is asked for; drop: leave out what has no place.")] = "keep",
    steps: Annotated[int | None, typer.Option(help="Sampling steps; default: the model's.", min=1)] = None,
    faces: Annotated[int, typer.Option(help="Face budget of each mesh.", min=100)] = 5000,
    up_axis: Annotated[str, typer.Option("--up-axis", help="Y or Z, assets included.")] = "Y",
    walls: Annotated[
        bool, typer.Option("--walls/--no-walls", help="Walls around the floor, with doors and windows.")
    ] = True,
    ceiling: Annotated[bool, typer.Option("--ceiling", help="Add a ceiling.")] = False,
    dress: Annotated[str, typer.Option(help="Small things, rugs, curtains: none, some or full.")] = "some",
    dress_graph: Annotated[
        bool, typer.Option("--dress-graph", help="Small things are nodes of the graph, too, in their own layer.")
    ] = False,
    atlas: Annotated[bool, typer.Option("--atlas", help="Unwrap without overlaps (extra: texture).")] = False,
    merge: Annotated[
        bool, typer.Option("--merge", help="One mesh for what moves together, not one for legs, top, back ...")
    ] = False,
    closed: Annotated[bool, typer.Option("--closed", help="The same as one closed surface, without insides.")] = False,
    materialx: Annotated[
        bool, typer.Option("--materialx", help="Give materials a MaterialX network beside UsdPreviewSurface.")
    ] = False,
    instances: Annotated[
        bool, typer.Option("--instances", help="Pieces that share an asset are instances of it.")
    ] = False,
    thumbnails: Annotated[
        bool, typer.Option("--thumbnails", help="A picture of every asset in its folder (extra: render).")
    ] = False,
    crated: Annotated[bool, typer.Option("--crate", help="Layers as usdc, which opens faster, not as text.")] = False,
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
    json: Annotated[bool, typer.Option("--json", help="Print what was made, faults and seconds as JSON.")] = False,
    store: Annotated[
        Path | None, typer.Option(help="Folder where many rooms keep their assets and images once.")
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Write into a folder that is not ours, replace a file.")
    ] = False,
    wait: Wait = False,
) -> None:
    """Generate a room from a scene graph: boxes, shapes, materials, physics, cameras, as layers of USD.

    A stage of several rooms becomes a folder for each and a root layer that composes them. Of a graph's numbers,
    lengths are metres in the room's frame (+Y up, the floor at 0), yaw is `90 deg` or radians about +Y: at 0 a
    front looks along +Z.
    """
    from echousd.room.manifest import check_seed
    from echousd.room.output import check_output, set_crate_version, writing

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
            from echousd.assets.choose import asked_of
            from echousd.room.pipeline import generate as make
            from echousd.room.progress import StageTimer
            from echousd.room.room import RoomOptions
            from echousd.room.written import write_room, write_rooms
        finally:
            gc.enable()
        meshes = "closed" if closed else "bodies" if merge else "parts"
        options = RoomOptions(
            up_axis.upper(), walls, atlas, ceiling, dress, merge=meshes, materialx=materialx, crate=crated,
            instances=instances, thumbnails=thumbnails, dress_graph=dress_graph,
        )  # fmt: skip
        wishes = asked_of(assets, stretch=stretch, licences=licenses, collect=collect, text=text, outside=outside or ())
        spent = {"imports": time.perf_counter() - started}
        restless: list[str] = []

        def one(path: str | None, folder: Path) -> Written:
            room = make(
                graph, room=path, seed=seed, shapes=shapes, model=weights or model, preset=preset, repair=repair,
                samples=samples, drafts=drafts, earlier=None if flat else folder, steps=steps, faces=faces,
                options=options, fit=fit, progress=listen, assets=wishes,
            )  # fmt: skip
            timer = StageTimer(listen)
            if settle:
                with timer.stage("settle"):
                    found = settled(room)
                room = found.noted
                restless.extend(found.restless)
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
    if timings:
        total = time.perf_counter() - started
        spent |= {"other": total - sum(spent.values()), "total": total}
        for stage, seconds in spent.items() if not json else ():
            typer.echo(f"{stage:>10} {seconds:7.2f} s")
    more = {"timings": {stage: round(seconds, 3) for stage, seconds in spent.items()}} if timings else {}
    report(made, restless, since=started, json=json, house=root, more=more)


def rooms_of(graph: Path) -> Sequence[Place]:
    """The rooms of a stage that holds several; text is not worth loading USD for."""
    if graph.suffix.lower() not in (".usda", ".usdc", ".usd", ".usdz"):
        return ()
    from echousd.room.house import places

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
