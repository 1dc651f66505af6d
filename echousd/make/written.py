"""A room on disk with its pictures, as the command line makes it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from echousd.make.finished import Room
from echousd.make.save import save_layers, write_pictures
from echousd.progress import StageTimer


@dataclass(frozen=True, eq=False)
class Written:
    """A room and where it lies."""

    room: Room  # what was made
    root: Path  # its root layer, or the flat file
    preview: Path | None = None  # the picture to look at, None = there is none


def write_room(
    room: Room, output: Path, timer: StageTimer, *, flat: bool = False, force: bool = False, store: Path | None = None
) -> Written:
    """Write a room as layers with pictures, or as one flat file without; raises ValueError, see `Room.save`."""
    with timer.stage("write"):
        if flat:
            from echousd.make.flat import save_flat

            return Written(room, save_flat(room, output, force=force))
        root = save_layers(room, output, force=force, store=store)
    if not room.options.preview:
        return Written(room, root)
    with timer.stage("preview"):
        drawn = write_pictures(root)
    return Written(room, root, drawn[-1] if drawn else None)
