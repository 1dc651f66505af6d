"""What in a room's folder is ours, by digest, and what becomes of everything else: it is kept, under a free name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from echomodel.files import digest, telling
from echousd.draw.pictures import is_ours
from echousd.folder.folder import backup_name
from echousd.folder.within import inside
from echousd.naming import free_name
from echousd.stage.paths import asset_file

if TYPE_CHECKING:
    from echousd.room import RoomData


def free_assets(folder: Path, room: RoomData, recorded: Mapping[str, str]) -> dict[str, str]:
    """Object name -> asset name, where new assets keep off names whose files in `folder` are somebody else's."""
    renamed: dict[str, str] = {}
    files = (path for path in (folder / "assets").rglob("*") if path.is_symlink() or not path.is_dir())
    inner = (path.relative_to(folder) for path in files)
    taken = {path.parts[1] for path in inner if path.as_posix() not in recorded} | set(room.assets.values())
    for asset in dict.fromkeys(room.assets.values()):
        parts = (asset_file(asset), asset_file(asset, "geo"), asset_file(asset, "low"))
        foreign = any(path not in recorded and inside(folder, path, "an asset").exists() for path in parts)
        if foreign and asset not in room.carried:
            renamed[asset] = free_name(asset, taken)
            taken.add(renamed[asset])
    return {name: renamed.get(asset, asset) for name, asset in room.assets.items()}


def backups(
    folder: Path, files: Iterable[str], recorded: Mapping[str, str], fresh: Mapping[str, bytes]
) -> dict[str, str]:
    """Path -> free name beside it, for files that a run replaces though somebody else wrote or edited them.

    What lies under such a name already, byte for byte, is not kept twice (then the name is "").
    """
    out: dict[str, str] = {}
    for path in files:
        current = read(folder, path)
        if current is None or current == fresh.get(path) or digest(current) == recorded.get(path):
            continue
        place = folder / path
        earlier = place.parent.glob(f"{place.stem}.edited*{place.suffix}")
        known = any(copy.is_file() and copy.read_bytes() == current for copy in earlier)
        out[path] = "" if known else backup_name(folder, path)
    return out


def read(folder: Path, path: str) -> bytes | None:
    """The file's bytes, None where there is none; raises ValueError for a link that leads out of the folder."""
    place = inside(folder, path, "a file of the room")
    with telling(place, "cannot be read", "; nothing was changed"):
        return place.read_bytes() if place.is_file() else None


def pictures(folder: Path, name: str) -> list[str]:
    """Pictures of ours that show the room called `name` as it is now: another state must not be seen with them."""
    return [path for path in (f"{name}.png", f"{name}_layouts.png") if is_ours(folder / path)]
