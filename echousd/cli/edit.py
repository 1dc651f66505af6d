"""`echousd edit`: change the graph of a room, make anew only what the change touches."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from echousd.cli.options import Force, Made, Outside, Wait, add_room_command
from echousd.cli.output import say
from echousd.cli.report import report, say_done, telling_faults

if TYPE_CHECKING:
    from echousd.graph import SceneGraph
    from echousd.options import EditRequest


def register(app: typer.Typer) -> None:
    """Add the command."""
    example = 'echousd edit out/bedroom/bedroom.usda --add stool:stool --relate "stool close by bed"'
    add_room_command(app, edit, example, edits=True, asks=True)
    add_room_command(app, update, "echousd update out/bedroom/mine.usda", edits=True)


def edit(
    room: Annotated[Path, typer.Argument(help="Room that generate made: root layer or folder.", show_default=False)],
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Say what would change and who would move; write nothing.")
    ] = False,
    undo: Annotated[bool, typer.Option("--undo", help="Take the last edit back, byte for byte; alone.")] = False,
    redo: Annotated[bool, typer.Option("--redo", help="Make again what --undo took back last; alone.")] = False,
    recover: Annotated[
        bool, typer.Option("--recover", help="Finish what a run that was interrupted has begun to write; alone.")
    ] = False,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Other folder; default: in place.")] = None,
    force: Force = False,
    wait: Wait = False,
    outside: Outside = None,
    json: Made = False,
    **given: Any,
) -> None:
    """Change what a room holds; objects that the change does not touch stay byte for byte.

    Every option may be given several times.
    """
    from echousd.folder.found import is_home, refuse_house, room_at
    from echousd.make.reading import read_room
    from echousd.make.wishes import wished
    from echousd.options import EditRequest

    asked = {kind: given.pop(kind, None) for kind in EditRequest.__dataclass_fields__}
    wishes = EditRequest(**{kind: words for kind, words in asked.items() if words})
    if not recover:
        if wishes == EditRequest(relate=wishes.relate, unrelate=wishes.unrelate) != EditRequest() and is_home(room):
            edit_home(room_at(room), wishes, output, dry_run=dry_run, force=force, json=json)
            return
        refuse_house(room)
        room = room_at(room)
    if undo or redo or recover:
        if wishes != EditRequest() or dry_run or output is not None or undo + redo + recover > 1:
            does = "--undo takes the last edit back" if undo else "--redo makes it again"
            does = "--recover finishes what was interrupted" if recover else does
            raise ValueError(f"{does} and does nothing else; leave the other options out")
        if recover:
            _recover(room, wait, json)
        else:
            _step(room, wait, json, "undo" if undo else "redo")
        return
    given["outside"] = outside or ()
    nothing = "nothing to change; use --add, --remove, --relabel, --relate, --unrelate, --move and others (--help)"
    _change(
        f"edit {_name_of(wishes, given)}", lambda: (room, wished(read_room(room), wishes)), output or room.parent,
        given, nothing, dry_run=dry_run, force=force, wait=wait, json=json,
    )  # fmt: skip


def edit_home(root: Path, wishes: EditRequest, output: Path | None, *, dry_run: bool, force: bool, json: bool) -> None:
    """Change how the rooms of a home lie to each other: its plan follows, and the rooms that it moves or opens."""
    from echousd.cli.generate import generate_home
    from echousd.home.assemble import remembered

    home, options = remembered(root)
    for sentence in wishes.unrelate:
        home = home.unrelate(sentence)
    for sentence in wishes.relate:
        home = home.relate(sentence)
    generate_home(root, home, output or root.parent, options, (), force=force, json=json, dry_run=dry_run)


def update(
    layer: Annotated[Path, typer.Argument(help="Your layer over a room, or its folder.", show_default=False)],
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say what would change; write nothing.")] = False,
    wait: Wait = False,
    outside: Outside = None,
    json: Made = False,
    **given: Any,
) -> None:
    """Bring a room up to date with what a stronger layer changes: its relations, objects and transforms.

    What the layer moves is the artist's wish: it stays where it was put, locked, and the others make way.
    """
    from echousd.folder.found import layer_over
    from echousd.make.wishes import artists_wishes

    layer = layer_over(layer)

    def wanted() -> tuple[Path, SceneGraph]:
        own, graph, moved = artists_wishes(layer)
        for name in moved if not json else ():
            say(f"locked   {name}, where {layer.name} puts it")
        return own, graph

    given["outside"] = outside or ()
    nothing = f"{layer}: changes nothing about the room"
    run = f"update {_name_of(layer.name, layer.read_bytes(), given)}"
    _change(run, wanted, layer.parent, given, nothing, dry_run=dry_run, force=False, wait=wait, json=json)


def _name_of(*asked: object) -> str:
    """A word that tells a run from those of which something else was asked."""
    from echousd.folder.journal import digest

    return digest(repr(asked).encode())


def _step(room: Path, wait: bool, json: bool, run: str) -> None:
    """Take the last edit of a room back (`undo`), or make it again (`redo`), and say what it was."""
    from echousd.folder import history
    from echousd.folder.folder import held
    from echousd.make.save import write_pictures

    started = time.perf_counter()
    step = {"undo": history.undo, "redo": history.redo}[run]
    with held(room.parent, wait=wait, run=run) as finished:
        steps = history.told(room, run) if finished == run else step(room)
        pictures = write_pictures(room)
    _say_steps(room, pictures, {"undo": "undone", "redo": "redone"}[run], steps, started, json)


def _recover(room: Path, wait: bool, json: bool) -> None:
    """Finish what an interrupted run has begun, and say what it was."""
    from echousd.folder import history
    from echousd.folder.folder import held
    from echousd.folder.found import room_at

    started, folder = time.perf_counter(), room if room.is_dir() else room.parent
    if not folder.is_dir():
        raise ValueError(f"{room}: no such folder")
    with held(folder, wait=wait) as finished:
        root = room_at(folder)
        _say_finished(root, history.told(root, finished) if finished else (), started, json)


def _say_finished(room: Path, steps: Sequence[str], started: float, json: bool) -> None:
    """Draw a room whose run was finished, and say what it did; exit code 1 where it has faults."""
    from echousd.folder.manifest import find_manifest
    from echousd.make.save import write_pictures

    _say_steps(room, write_pictures(room), "finished", steps, started, json)
    layouts = (find_manifest(room.parent, room.stem) or {}).get("layouts", ())
    if any(layout["broken"] or layout["collisions"] or layout.get("restless") for layout in layouts):
        raise typer.Exit(1)


def _say_steps(
    room: Path, pictures: Sequence[Path], word: str, steps: Sequence[str], started: float, json: bool
) -> None:
    lines = [*(f"{word:<8} {step}" for step in steps), f"room     {room}"]
    say_done(json, [room, *pictures], started, lines, {word: list(steps)})


def _change(
    run: str,
    wanted: Callable[[], tuple[Path, SceneGraph]],
    folder: Path,
    options: dict[str, Any],
    nothing: str,
    *,
    dry_run: bool,
    force: bool,
    wait: bool,
    json: bool,
) -> None:
    """Have the room in a folder become what `wanted` says (its root layer and the graph), or say what would happen.

    The `run` that did the same and was interrupted is finished instead.
    """
    from echousd.cli.generate import progress_bar
    from echousd.folder.found import room_at
    from echousd.folder.history import told
    from echousd.folder.output import check_output, writing
    from echousd.make.edit import edit as change
    from echousd.make.edit import touched
    from echousd.make.reading import read_room
    from echousd.make.written import write_room
    from echousd.progress import StageTimer

    started = time.perf_counter()
    check_output(folder, flat=False, force=force)
    with writing(folder, flat=False, force=force, wait=wait, run="" if dry_run else run) as finished:
        if finished:
            _say_finished(room_at(folder), told(room_at(folder), run), started, json)
            return
        root, graph = wanted()
        old = read_room(root).graph
        steps = old.diff(graph).lines()
        if not steps:
            raise ValueError(nothing)
        if dry_run:
            fresh, moving = touched(old, graph)
            plan = {"changes": list(steps), "new": sorted(fresh), "moves": sorted(moving)}
            lines = [*steps, *(f"new      {n}" for n in sorted(fresh)), *(f"moves    {n}" for n in sorted(moving))]
            say_done(json, [], started, lines, plan)
            return
        with telling_faults(), progress_bar() as listen:
            made = change(root, graph, progress=listen, **options)
            written = write_room(made, folder, StageTimer(listen), force=force)
    for step in steps if not json else ():
        say(step)
    report([written], since=started, json=json, more={"changes": list(steps)})
