"""Rooms from wherever they lie: a rooms file, or the folder of a room set."""

from __future__ import annotations

from pathlib import Path

from echomodel.data.roomset import RoomSet
from echomodel.roomboxes import RoomBoxes, read_rooms
from echomodel.vocabulary import vocabulary


def load_rooms(path: Path, limit: int | None = None, *, held_out: bool = False) -> list[RoomBoxes]:
    """Rooms of a rooms file, or of the folder that `echousd data build` made (its held-out ones only, if so asked).

    Raises ValueError for anything else.
    """
    if not path.exists():
        raise ValueError(f"{path}: no such file or folder")
    if path.is_dir():
        rooms = RoomSet(path / "rooms" if (path / "rooms").is_dir() else path)
        numbers = rooms.held_out.nonzero()[0] if held_out else range(len(rooms))
        return [rooms.room(int(k)) for k in numbers[:limit]]
    if held_out:
        raise ValueError(f"{path}: a rooms file holds nothing out, allowed with --held-out: a folder of a room set")
    return read_rooms(path)[:limit]


def rooms_of_type(rooms: list[RoomBoxes], word: str, path: Path) -> list[RoomBoxes]:
    """Those of a room type, in any spelling; raises ValueError naming `path` where there are none."""
    wanted = vocabulary().room_type(word).name
    kept = [room for room in rooms if vocabulary().room_type(room.room_type).name == wanted]
    if not kept:
        raise ValueError(f"{path}: holds no room of type {wanted}")
    return kept
