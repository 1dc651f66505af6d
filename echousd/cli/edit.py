"""`echousd edit`, `update`, `adopt`: change a room, make anew only what changes; complete somebody's stage."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from echomodel.late import Late
from echousd.cli.options import Force, Made, Outside, Wait, add_room_command
from echousd.cli.output import report, say, say_done, telling_faults

if TYPE_CHECKING:
    from echousd.graph import SceneGraph
    from echousd.graph.changes import EditRequest

check_output, held, writing = (Late(f"echousd.folder.folder:{word}") for word in ("check_output", "held", "writing"))
pictures = Late("echousd.folder.ownership:pictures")
check_ours, own_root, room_at = (Late(f"echousd.folder.found:{word}") for word in ("check_ours", "own_root", "room_at"))
read_room, write_pictures = Late("echousd.make.reading:read_room"), Late("echousd.make.save:write_pictures")
progress_bar, StageTimer = Late("echousd.cli.progress:progress_bar"), Late("echomodel.progress:StageTimer")
app = typer.Typer()


def edit(
    room: Path, dry_run: bool = False, undo: bool = False, redo: bool = False, recover: bool = False,
    output: Path | None = None, force: Force = False, wait: Wait = False, outside: Outside = None, json: Made = False,
    **changes: Any,
) -> None:  # fmt: skip
    """Change what a room holds; objects that the change does not touch stay byte for byte.

    Every change may be given several times.
    """
    from echousd.folder.found import is_home, refuse_house
    from echousd.graph.changes import EditRequest
    from echousd.make.wishes import wished

    asked = {kind: changes.pop(kind, None) for kind in EditRequest.__dataclass_fields__}
    wishes = EditRequest(**{kind: words for kind, words in asked.items() if words})
    does = {"--undo takes the last edit back": undo, "--redo makes it again": redo}
    alone = [word for word, asked in ({**does, "--recover finishes what was interrupted": recover}).items() if asked]
    if alone and (wishes != EditRequest() or dry_run or output is not None or len(alone) > 1):
        raise ValueError(f"{alone[0]} and does nothing else; leave the other options out")
    if recover:
        _recover(room, wait, json)
        return
    of_home = undo or redo or wishes == EditRequest(relate=wishes.relate, unrelate=wishes.unrelate) != EditRequest()
    if of_home and is_home(room):
        edit_home(room_at(room), wishes, redo - undo, output, dry_run=dry_run, force=force, wait=wait, json=json)
        return
    refuse_house(room)
    room = room_at(room)
    check_ours(room)
    if alone:
        from echousd.make import edit as steps

        done = (steps.undo if undo else steps.redo)(room, wait=wait)
        _say_steps(own_root(room), "undone" if undo else "redone", done, json)
        return
    changes["outside"] = (*(outside or ()), *wishes.folders)
    _change(
        f"edit {_name_of(wishes, changes)}", lambda: (room, wished(read_room(room), wishes)), output or room.parent,
        changes, dry_run=dry_run, force=force, wait=wait, json=json,
    )  # fmt: skip


def edit_home(
    root: Path, wishes: EditRequest, step: int, output: Path | None, *, dry_run: bool, force: bool, wait: bool,
    json: bool,
) -> None:  # fmt: skip
    """Change how its rooms lie to each other, or take that back (`step` -1) or make it again (1).

    Its plan follows, and what it opens.
    """
    from echousd.cli.plan import generate_home
    from echousd.home.assemble import remembered, stepped

    home, options = remembered(root)
    there = stepped(root, step) if step else None
    for sentence in wishes.unrelate:
        home = home.unrelate(sentence)
    for sentence in wishes.relate:
        home = home.relate(sentence)
    generate_home(
        root, home, output or root.parent, options, (), force=force, json=json, dry_run=dry_run, wait=wait, there=there
    )


def update(
    layer: Path, dry_run: bool = False, wait: Wait = False, outside: Outside = None, json: Made = False,
    **changes: Any,
) -> None:  # fmt: skip
    """Bring a room up to date with what a stronger layer changes: its relations, objects and transforms.

    What the layer moves is the artist's wish: it stays where it was put, locked, and the others make way.
    """
    from echousd.folder.found import layer_over
    from echousd.make.wishes import artists_wishes

    layer = layer_over(layer)
    check_ours(layer)

    def wanted() -> tuple[Path, SceneGraph]:
        own, graph, moved, changes["copies"] = artists_wishes(layer)
        for name in moved if not json else ():
            say(f"locked   {name}, where {layer.name} puts it")
        return own, graph

    changes["outside"] = outside or ()
    run = f"update {_name_of(layer.name, layer.read_bytes(), changes)}"
    _change(run, wanted, layer.parent, changes, dry_run=dry_run, force=False, wait=wait, json=json)


def _name_of(*asked: object) -> str:
    """A word that tells a run from those of which something else was asked."""
    from echomodel.files import digest

    return digest(repr(asked).encode())


def _recover(room: Path, wait: bool, json: bool) -> None:
    """Finish what an interrupted run has begun, and say what it was."""
    from echousd.folder import history

    folder = room if room.is_dir() else room.parent
    if not folder.is_dir():
        raise ValueError(f"{room}: no such folder")
    with held(folder, wait=wait) as finished:
        root = room_at(folder)
        _say_finished(root, history.steps_of(root, finished) if finished else (), json)


def _say_finished(room: Path, steps: Sequence[str], json: bool) -> None:
    """Draw a room whose run was finished, and say what it did; exit code 1 where it has faults."""
    from echousd.folder.manifest import find_manifest

    write_pictures(room)
    _say_steps(room, "finished", steps, json)
    layouts = (find_manifest(room.parent, room.stem) or {}).get("layouts", ())
    if any(layout["broken"] or layout["collisions"] or layout.get("restless") for layout in layouts):
        raise typer.Exit(1)


def _say_steps(room: Path, word: str, steps: Sequence[str], json: bool) -> None:
    lines = [*(f"{word:<8} {step}" for step in steps), f"room     {room}"]
    drawn = (room.parent / name for name in pictures(room.parent, room.stem))
    say_done(json, [room, *drawn], lines, {word: list(steps)})


def _change(
    run: str, wanted: Callable[[], tuple[Path, SceneGraph]], folder: Path, options: dict[str, Any], *, dry_run: bool,
    force: bool, wait: bool, json: bool,
) -> None:  # fmt: skip
    """Have the room in a folder become what `wanted` says (its root layer and the graph), or say what would happen.

    The `run` that did the same and was interrupted is finished instead.
    """
    from echousd.folder.history import steps_of
    from echousd.make.edit import carried, touched
    from echousd.make.edit import edit as change
    from echousd.make.finished import write_room

    check_output(folder, flat=False, force=force)
    with writing(folder, flat=False, force=force, wait=wait, run="" if dry_run else run) as finished:
        if finished:
            _say_finished(room_at(folder), steps_of(room_at(folder), run), json)
            return
        root, graph = wanted()
        room = read_room(root)
        steps = room.graph.diff(graph).lines()
        if not steps:
            raise ValueError("nothing to change; use --add, --remove, --relate, --unrelate, --move and others (--help)")
        if dry_run:
            fresh, moving = touched(room.graph, graph, room.boxes)
            moving |= carried(room.graph, graph, room.boxes)[1]
            plan = {"changes": list(steps), "new": sorted(fresh), "moves": sorted(moving)}
            lines = [*steps, *(f"new      {n}" for n in sorted(fresh)), *(f"moves    {n}" for n in sorted(moving))]
            say_done(json, [], lines, plan)
            return
        with telling_faults(), progress_bar() as listen:
            shown = own_root(root).with_suffix(".png").is_file()  # who wanted no picture gets none
            made = change(root, graph, progress=listen, **options)
            written = write_room(made, folder, StageTimer(listen), force=force, preview=shown)
    for step in steps if not json else ():
        say(step)
    report([written], json=json, more={"changes": list(steps)})


def adopt(
    stage: Path, output: Path, room: str | None = None, add: list[str] | None = None, relate: list[str] | None = None,
    names: bool = False, force: Force = False, wait: Wait = False, outside: Outside = None, json: Made = False,
    **changes: Any,
) -> None:  # fmt: skip
    """Complete a stage that others began: its furniture stays where and as it is, new pieces stand around it.

    The stage is not written; the room refers to the pieces in it, with --collect to copies. What a person would point
    at in their arrangement is told and left as it is.
    """
    from echousd.options import RoomOptions

    options = RoomOptions(**changes)
    check_output(output, flat=False, force=force)
    with writing(output, flat=False, force=force, wait=wait), telling_faults(), progress_bar() as listen:
        from echousd.make.finished import write_room
        from echousd.make.wishes import adopt as complete
        from echousd.make.wishes import seen_in_theirs

        given: dict[str, Any] = {"options": options, "outside": outside or (), "progress": listen}
        made = complete(stage, room=room, add=add, relate=relate or (), names=names, **given)
        written = write_room(made, output, StageTimer(listen), force=force)
    kept = sum(node.asset is not None for node in made.graph.nodes)
    seen = seen_in_theirs(made)
    if not json:
        say(f"adopted  {kept} objects of {stage.name}, {len(made.graph.nodes) - kept} new")
        for one in seen:
            say(f"theirs   {one}")
    more = {"adopted": kept, "new": len(made.graph.nodes) - kept, "theirs": seen}
    report([written], json=json, more=more)


add_room_command(app, "edit", edit, edits=True, asks=True)
add_room_command(app, "update", update, edits=True)
add_room_command(app, "adopt", adopt)
