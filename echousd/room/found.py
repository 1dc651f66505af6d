"""Which rooms a path means: a file, the folder of a room, a folder of such folders, or a pattern."""

from __future__ import annotations

import glob
from pathlib import Path

from echousd.room.manifest import find_manifest


def rooms_at(place: Path) -> list[Path]:
    """The root layers of the rooms at a path, sorted; raises ValueError for a folder or pattern without any."""
    if place.is_dir():
        rooms = [_room_in(folder) for folder in (place, *sorted(p for p in place.rglob("*") if p.is_dir()))]
        found = [room for room in rooms if room is not None]
        if not found:
            raise ValueError(f"{place}: no room in this folder")
        return found
    if not place.exists() and glob.has_magic(str(place)):
        found = [room for path in sorted(glob.glob(str(place), recursive=True)) for room in rooms_at(Path(path))]  # noqa: PTH207
        if not found:
            raise ValueError(f"{place}: matches nothing")
        return found
    return [place]


def room_at(place: Path) -> Path:
    """The one root layer at a path: a file itself, of a folder its room; raises ValueError where several are."""
    if not place.is_dir():
        return place
    found = _room_in(place)
    if found is not None:
        return found
    rooms = rooms_at(place)
    if len(rooms) > 1:
        named = [path.relative_to(place) for path in (*sorted(place.glob("*.usda")), *rooms)]  # a house, then its rooms
        shown = ", ".join(map(str, named[:8])) + ", ..." * (len(named) > 8)
        raise ValueError(f"{place}: a folder of {len(rooms)} rooms, name one file: {shown}")
    return rooms[0]


def _room_in(folder: Path) -> Path | None:
    manifest = find_manifest(folder)
    root = None if manifest is None else folder / f"{manifest['name']}.usda"
    return root if root is not None and root.is_file() else None
