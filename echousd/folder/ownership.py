"""What in a room's folder is ours, by digest, and what becomes of everything else: it is kept, under a free name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from pxr import Sdf, Tf

from echomodel.files import telling
from echomodel.late import Late
from echousd.draw.pictures import is_ours
from echousd.folder.folder import backup_name, digest, digest_of
from echousd.folder.within import inside
from echousd.naming import STAGE_FORMS, free_name
from echousd.pending import STAGING
from echousd.stage.harmless import check_harmless
from echousd.stage.paths import coarse_file, component_file, payload_file

if TYPE_CHECKING:
    from echousd.room import RoomData

references_of = Late("echousd.store:references_of")


def free_assets(folder: Path, room: RoomData, recorded: Mapping[str, str]) -> dict[str, str]:
    """Object name -> asset name, where new assets keep off names whose files in `folder` are somebody else's."""
    renamed: dict[str, str] = {}
    files = (path for path in (folder / "assets").rglob("*") if path.is_symlink() or not path.is_dir())
    inner = (path.relative_to(folder) for path in files)
    taken = {path.parts[1] for path in inner if path.as_posix() not in recorded} | set(room.assets.values())
    for asset in dict.fromkeys(room.assets.values()):
        parts = (component_file(asset), payload_file(asset), coarse_file(asset))
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


def referenced(
    folder: Path, recorded: Mapping[str, str], gone: Iterable[str], replaced: Iterable[str]
) -> dict[str, str]:
    """Path -> the layer that refers to it, for those of `gone` that a layer which is not ours needs.

    Layers anywhere in the folder and beside it are asked, but for those that are `replaced`. One file of an asset needs
    all of it.
    """
    gone, replaced = list(gone), set(replaced)
    if not gone:
        return {}
    needed: dict[str, str] = {}
    top = folder.resolve()
    for layer in sorted((*folder.rglob("*.usd*"), *folder.parent.glob("*.usd*"))):
        if layer.suffix not in STAGE_FORMS or not layer.is_file() or STAGING in layer.parts:
            continue
        own = layer.relative_to(folder).as_posix() if layer.is_relative_to(folder) else ""
        if own in replaced or (own in recorded and digest_of(layer) == recorded[own]):
            continue
        check_harmless(layer)
        for dependency in references_of(layer):
            target = (layer.parent / dependency).resolve()
            if target.is_relative_to(top):
                needed.setdefault(_unit(target.relative_to(top).as_posix()), layer.name)
    return {path: needed[_unit(path)] for path in gone if _unit(path) in needed}


def merged_root(path: Path, current: bytes, fresh: bytes) -> bytes:
    """The artist's root layer with our sublayers and data brought up to date; raises ValueError where it is broken."""
    theirs, ours = Sdf.Layer.CreateAnonymous(".usda"), Sdf.Layer.CreateAnonymous(".usda")
    try:
        readable = theirs.ImportFromString(current.decode("utf-8")) and ours.ImportFromString(fresh.decode("utf-8"))
    except (UnicodeDecodeError, Tf.ErrorException):
        readable = False
    if not readable:
        raise ValueError(f"{path}: edited by hand and no longer readable as USD; repair it or delete it")
    for key in ("upAxis", "metersPerUnit", "defaultPrim"):
        held, new = (layer.pseudoRoot.GetInfo(key) for layer in (theirs, ours))
        if held != new:
            raise ValueError(f"{path}: edited by hand, {key} {held}; a room with {new} needs another folder")
    present = [path for path in theirs.subLayerPaths if path in ours.subLayerPaths or not path.startswith("./layers/")]
    theirs.subLayerPaths = present + [layer for layer in ours.subLayerPaths if layer not in present]
    theirs.customLayerData = {**theirs.customLayerData, **ours.customLayerData}
    return theirs.ExportToString().encode("utf-8")


def pictures(folder: Path, name: str) -> list[str]:
    """Pictures of ours that show the room called `name` as it is now: another state must not be seen with them."""
    return [path for path in (f"{name}.png", f"{name}_layouts.png") if is_ours(folder / path)]


def loses_text(layer: bytes) -> bool:
    """Whether a text layer that USD can read holds more than USD would write of it: remarks, an order of lines."""
    read = Sdf.Layer.CreateAnonymous(".usda")
    return read.ImportFromString(layer.decode("utf-8")) and read.ExportToString().encode("utf-8") != layer


def _unit(path: str) -> str:
    """The asset's folder that a path lies in, else the path itself."""
    parts = PurePosixPath(path).parts
    return "/".join(parts[:2]) if len(parts) > 2 and parts[0] == "assets" else path
