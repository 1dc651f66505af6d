"""Rules on the files of a stage: paths that work on another machine, images that can be read."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import lru_cache
from pathlib import PurePosixPath

from pxr import Sdf, Tf, Usd, UsdShade, UsdUtils

from echousd.checks.findings import Finding, Rule, prims
from echousd.packing import Reach
from echousd.stage.encoding import StageError
from echousd.stage.units import unit_faults
from echousd.stage.values import asset
from echousd.textures import READABLE, TextureError, file_of, read_image

ABSOLUTE = re.compile(r"^(?:/|\\\\|[A-Za-z]:[\\/]|file:)")


def relative_paths(stage: Usd.Stage) -> Iterator[Finding]:
    """Every asset path is relative and written with forward slashes."""
    session = stage.GetSessionLayer()
    told = set()
    for layer in stage.GetUsedLayers():
        if layer == session:
            continue
        for path in _asset_paths(layer):
            if (layer.identifier, path) in told or not (ABSOLUTE.match(path) or "\\" in path):
                continue
            told.add((layer.identifier, path))
            what = "absolute" if ABSOLUTE.match(path) else "written with backslashes"
            where = layer.GetDisplayName()
            yield Finding(_holder(layer, path), f"{where}: asset path {path!r} is {what}, allowed: ./relative/path")


def paths_inside(stage: Usd.Stage) -> Iterator[Finding]:
    """Every file that the room names lies below its folder: it stays behind when the folder is sent, or leaks."""
    if not stage.GetRootLayer().realPath:
        return
    reach = Reach.of(stage)
    told = set()
    for layer in stage.GetUsedLayers():
        if layer == stage.GetSessionLayer() or (layer.realPath and not reach.holds(layer.realPath)):
            continue  # what a layer outside names is outside with it; the layer itself is told
        for path in _asset_paths(layer):
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


def images(stage: Usd.Stage) -> Iterator[Finding]:
    """Every image that a shader reads can be read."""
    known: dict[str, str] = {}
    for prim in prims(stage):
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


def _asset_paths(layer: Sdf.Layer) -> list[str]:
    """All asset paths that a layer authors: sublayers, references, payloads, clips, attributes, metadata."""
    copy = Sdf.Layer.CreateAnonymous(".usda")
    copy.TransferContent(layer)
    found: list[str] = []

    def note(path: str) -> str:
        found.append(path)
        return path

    UsdUtils.ModifyAssetPaths(copy, note)
    for spec in _specs(layer):
        identifier = (spec.assetInfo or {}).get("identifier") if isinstance(spec, Sdf.PrimSpec) else None
        if identifier:
            found.append(getattr(identifier, "path", str(identifier)))
    return found


def _specs(layer: Sdf.Layer) -> list[Sdf.Spec]:
    paths: list[Sdf.Path] = []
    layer.Traverse(Sdf.Path.absoluteRootPath, paths.append)
    return [spec for spec in map(layer.GetObjectAtPath, paths) if spec]


def _holder(layer: Sdf.Layer, path: str) -> Sdf.Path:
    """The prim of a layer whose opinions mention an asset path; the pseudo-root for sublayers."""
    for spec in _specs(layer):
        if isinstance(spec, Sdf.AttributeSpec) and getattr(spec.default, "path", None) == path:
            return spec.path.GetPrimPath()
        if isinstance(spec, Sdf.PrimSpec):
            arcs = [*spec.referenceList.GetAddedOrExplicitItems(), *spec.payloadList.GetAddedOrExplicitItems()]
            identifier = (spec.assetInfo or {}).get("identifier")
            if any(arc.assetPath == path for arc in arcs) or getattr(identifier, "path", None) == path:
                return spec.path
    return Sdf.Path.absoluteRootPath


def units(stage: Usd.Stage) -> Iterator[Finding]:
    """The root layer says the unit and the up axis of the layers that it composes."""
    for message, wrong in unit_faults(stage):
        yield Finding(Sdf.Path.absoluteRootPath, message, warning=not wrong)


RULES = (
    Rule("echo:Units", "Unit and up axis of the root layer are those of the layers below.", units),
    Rule("echo:RelativePaths", "Asset paths are relative and use forward slashes.", relative_paths),
    Rule("echo:Images", "Images can be read.", images),
    Rule("echo:PathsInside", "Files that a room names lie below its folder.", paths_inside),
)
