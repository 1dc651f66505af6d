"""What became of rooms: told to a person, or as JSON for scripts."""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from echousd.cli.output import say, say_json

if TYPE_CHECKING:
    from echousd.make.written import Written


@contextmanager
def telling_faults() -> Iterator[None]:
    """Leave it to `report` to tell what a finished room does not keep."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "the room has faults")
        yield


def report(
    made: Sequence[Written],
    *,
    since: float = 0.0,
    json: bool = False,
    more: Mapping[str, Any] | None = None,
) -> None:
    """Say what was made and what the graphs asked for in vain; exit code 1 for faults.

    Arguments:
        made: the rooms.
        since: `time.perf_counter()` when the command began.
        json: as one JSON object instead of lines.
        more: further entries of the JSON object.
    """
    faults = [fault for each in made for fault in each.room.faults]
    if json:
        files = [path for each in made for path in (each.root, each.preview)]
        rooms = {"rooms": [_room(each) for each in made]}
        say_written([path for path in files if path], since, faults, {**rooms, **(more or {})})
    else:
        for each in made:
            tell_room(each)
    if faults:
        raise typer.Exit(1)


def say_written(
    files: Sequence[Path], since: float, faults: Sequence[str] = (), more: Mapping[str, Any] | None = None
) -> None:
    """Print as one JSON object which files were written, what is wrong with them, and how long it took.

    Arguments:
        files: what was written, previews too; not the layers below a room's root.
        since: `time.perf_counter()` when the command began.
        faults: a sentence each.
        more: further entries.
    """
    told = {"ok": not faults, "written": [str(path) for path in files], "faults": list(faults)}
    say_json({**told, "seconds": round(time.perf_counter() - since, 3), **(more or {})}, indent=2)


def say_done(
    json: bool, files: Sequence[Path], since: float, lines: Iterable[str], more: Mapping[str, Any] | None = None
) -> None:
    """Say what a command has written: as one JSON object (`say_written`), or in lines."""
    if json:
        say_written(files, since, more=more)
    else:
        for line in lines:
            say(line)


def _room(written: Written) -> dict[str, Any]:
    room = written.room
    return {
        "room": str(written.root),
        "preview": str(written.preview) if written.preview else None,
        "objects": len(room.names),
        "layouts": [found.to_json() for found in room.outcomes],
        "notes": list(room.notes),
    }


def tell_room(written: Written) -> None:
    """Say what became of a room."""
    room = written.room
    say(f"room     {written.root}")
    if written.preview is not None:
        say(f"preview  {written.preview}")
    for number, found in enumerate(room.outcomes):
        counts, several = found.counts(), len(room.outcomes) > 1
        kept = f"{counts['kept']} of {counts['kept'] + counts['broken']} measured relations kept"
        say(f"layout_{number} {kept}" if several else f"graph    {len(room.names)} objects, {kept}")
        for verdict in found.broken:
            say(f"broken   {verdict.said} (margin {verdict.margin:+.2f})")
        for hit in found.collisions:
            say(f"collide  {hit.first} and {hit.second} by {hit.depth:.2f} m")
        for sentence in found.restless:
            say(f"restless {sentence}")
    for note in room.notes:
        say(f"note     {note}")
