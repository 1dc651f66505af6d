"""Rules on the files of a stage: paths that work on another machine, images that can be read."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import lru_cache
from pathlib import PurePosixPath

from pxr import Sdf, Tf, UsdShade

from echousd.checks.findings import Finding, Rule
from echousd.checks.reading import Reading, specs
from echousd.exporting.packing import Reach
from echousd.stage.encoding import StageError
from echousd.stage.units import unit_faults
from echousd.stage.values import asset
from echousd.textures import READABLE, TextureError, file_of, read_image

ABSOLUTE = re.compile(r"^(?:/|\\\\|[A-Za-z]:[\\/]|file:)")


def relative_paths(reading: Reading) -> Iterator[Finding]:
    """Every asset path is relative and written with forward slashes."""
    told = set()
    for layer, paths in reading.named_files.items():
        for path in paths:
            if (layer.identifier, path) in told or not (ABSOLUTE.match(path) or "\\" in path):
                continue
            told.add((layer.identifier, path))
            what = "absolute" if ABSOLUTE.match(path) else "written with backslashes"
            where = layer.GetDisplayName()
            yield Finding(_holder(layer, path), f"{where}: asset path {path!r} is {what}, allowed: ./relative/path")


def paths_inside(reading: Reading) -> Iterator[Finding]:
    """Every file that the room names lies below its folder: it stays behind when the folder is sent, or leaks."""
    if not reading.stage.GetRootLayer().realPath:
        return
    reach = Reach.of(reading.stage)
    told = set()
    for layer, paths in reading.named_files.items():
        if layer.realPath and not reach.holds(layer.realPath):
            continue  # what a layer outside names is outside with it; the layer itself is told
        for path in paths:
            if not path or (layer.identifier, path) in told or ABSOLUTE.match(path):
                continue
            told.add((layer.identifier, path))
            full = layer.ComputeAbsolutePath(path)
            if full and not reach.holds(full):
                where = f"{layer.GetDisplayName()}: asset path {path!r} leads out of the room's folder"
                is_layer = bool(Sdf.FileFormat.FindByExtension(full))
                yield Finding(
                    _holder(layer, path), f"{where} {reach.places[0]}, allowed: a file below it", warning=is_layer
                )


def images(reading: Reading) -> Iterator[Finding]:
    """Every image that a shader reads can be read."""
    known: dict[str, str] = {}
    for prim in reading.prims:
        if not prim.IsA(UsdShade.Shader):
            continue
        try:
            file = asset(prim.GetAttribute("inputs:file")) if prim.HasAttribute("inputs:file") else None
        except (StageError, Tf.ErrorException):  # the rules on values report it
            continue
        path = str(file.resolvedPath) if file else ""
        if not path or PurePosixPath(path.rstrip("]")).suffix.lower() not in READABLE:
            continue
        if path not in known:
            known[path] = _image_fault(path, _stamp(path))
        if known[path]:
            yield Finding(prim.GetPath(), known[path])


def _stamp(path: str) -> tuple[int, ...]:
    """What changes with a file."""
    try:
        found = file_of(path).stat()
    except (OSError, ValueError):
        return ()
    return found.st_ino, found.st_size, found.st_mtime_ns


@lru_cache(maxsize=4096)  # rooms of one store share their images
def _image_fault(path: str, _stamp: tuple[int, ...]) -> str:
    try:
        read_image(path)
    except TextureError as error:
        return str(error)
    return ""


def _holder(layer: Sdf.Layer, path: str) -> Sdf.Path:
    """The prim of a layer whose opinions mention an asset path; the pseudo-root for sublayers."""
    for spec in specs(layer):
        if isinstance(spec, Sdf.AttributeSpec) and getattr(spec.default, "path", None) == path:
            return spec.path.GetPrimPath()
        if isinstance(spec, Sdf.PrimSpec):
            arcs = [*spec.referenceList.GetAddedOrExplicitItems(), *spec.payloadList.GetAddedOrExplicitItems()]
            identifier = (spec.assetInfo or {}).get("identifier")
            if any(arc.assetPath == path for arc in arcs) or getattr(identifier, "path", None) == path:
                return spec.path
    return Sdf.Path.absoluteRootPath


def units(reading: Reading) -> Iterator[Finding]:
    """The root layer says the unit and the up axis of the layers that it composes."""
    for message, wrong in unit_faults(reading.stage):
        yield Finding(Sdf.Path.absoluteRootPath, message, warning=not wrong)


RULES = (
    Rule("echo:Units", "Unit and up axis of the root layer are those of the layers below.", units),
    Rule("echo:RelativePaths", "Asset paths are relative and use forward slashes.", relative_paths),
    Rule("echo:Images", "Images can be read.", images),
    Rule("echo:PathsInside", "Files that a room names lie below its folder.", paths_inside),
)
