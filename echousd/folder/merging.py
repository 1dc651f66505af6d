"""Layers of others in a room's folder: a root layer that an artist edited, and which of them refer to what goes."""

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path, PurePosixPath

from pxr import Sdf, Tf

from echomodel.late import Late
from echousd.folder.journal import digest_of
from echousd.naming import STAGE_FORMS
from echousd.pending import STAGING
from echousd.stage.harmless import check_harmless

references_of = Late("echousd.store:references_of")


def referenced(
    folder: Path, recorded: Mapping[str, str], gone: Collection[str], replaced: Iterable[str]
) -> dict[str, str]:
    """Path -> the layer that refers to it, for those of `gone` that a layer which is not ours needs.

    Layers anywhere in the folder and beside it are asked, but for those that are `replaced`. One file of an asset needs
    all of it.
    """
    replaced = set(replaced)
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


def loses_text(layer: bytes) -> bool:
    """Whether a text layer that USD can read holds more than USD would write of it: remarks, an order of lines."""
    read = Sdf.Layer.CreateAnonymous(".usda")
    return read.ImportFromString(layer.decode("utf-8")) and read.ExportToString().encode("utf-8") != layer


def _unit(path: str) -> str:
    """The asset's folder that a path lies in, else the path itself."""
    parts = PurePosixPath(path).parts
    return "/".join(parts[:2]) if len(parts) > 2 and parts[0] == "assets" else path
