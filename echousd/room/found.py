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


def _room_in(folder: Path) -> Path | None:
    manifest = find_manifest(folder)
    root = None if manifest is None else folder / f"{manifest['name']}.usda"
    return root if root is not None and root.is_file() else None
