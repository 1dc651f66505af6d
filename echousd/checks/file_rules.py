"""Rules on the files of a stage: paths that work on another machine, images that can be read."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from functools import lru_cache
from pathlib import PurePosixPath

import numpy as np
from pxr import Sdf, Usd, UsdPhysics, UsdShade

from echousd.checks.findings import UNREADABLE, Finding, rule
from echousd.checks.reading import Reading, specs
from echousd.exporting.packing import Reach
from echousd.stage.units import METRES, UP_AXIS, unit_faults, up_axis
from echousd.stage.values import asset
from echousd.textures import READABLE, TextureError, file_of, read_image

KILOGRAMS = "kilogramsPerUnit"
SAME = 1e-6  # relative difference of units that are the same
UNLIKE = math.log(2)  # of the factor by which something may be scaled beside its unit
LEVEL = 0.5  # cosine of the angle between a model's up and the room's
ABSOLUTE = re.compile(r"^(?:/|\\\\|[A-Za-z]:[\\/]|file:)")


@rule("echo:RelativePaths")
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


@rule("echo:PathsInside")
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


@rule("echo:Images", "prims", UsdShade.Shader)
def images(_reading: Reading, prim: Usd.Prim) -> Iterator[str]:
    """Every image that a shader reads can be read."""
    file = asset(prim.GetAttribute("inputs:file")) if prim.HasAttribute("inputs:file") else None
    path = str(file.resolvedPath) if file else ""
    if file and file.path and not path and "<" not in file.path:
        yield f"inputs:file is {file.path!r}, where no file is"
    if path and PurePosixPath(path.rstrip("]")).suffix.lower() in READABLE:
        fault = _image_fault(path, _stamp(path))
        if fault:
            yield fault


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


@rule("echo:Units")
def units(reading: Reading) -> Iterator[Finding]:
    """The root layer says the unit and the up axis of the layers that it composes."""
    for message, wrong in unit_faults(reading.stage):
        yield Finding(Sdf.Path.absoluteRootPath, message, warning=not wrong)


@rule("echo:Arcs")
def arcs(reading: Reading) -> Iterator[Finding]:
    """What is referenced is brought to the unit and up axis of the stage; masses are told in one unit."""
    stage = reading.stage
    mass = float(UsdPhysics.GetStageKilogramsPerUnit(stage))
    for layer in reading.named_files:
        told = layer.pseudoRoot.GetInfo(KILOGRAMS) if layer.pseudoRoot.HasInfo(KILOGRAMS) else mass
        if not math.isclose(told, mass, rel_tol=SAME):
            where = f"{KILOGRAMS} is {told:g} in {layer.GetDisplayName()}"
            yield Finding(Sdf.Path.absoluteRootPath, f"{where}, {mass:g} in the stage, allowed: the same")
    up = np.array([0.0, 0, 1] if up_axis(stage) == "Z" else [0.0, 1, 0])
    for prim in reading.distinct:
        for layer in _referenced(prim):
            try:
                world = reading.world(prim)[:3, :3]
            except UNREADABLE:
                continue
            size = float(np.cbrt(abs(np.linalg.det(world)))) * reading.metres
            unit = layer.pseudoRoot.GetInfo(METRES) if layer.pseudoRoot.HasInfo(METRES) else None
            if unit is not None and size > 0 and abs(math.log(size / unit)) > UNLIKE:
                told = f"{METRES} is {unit:g} in {layer.GetDisplayName()}, a unit of it is {size:.3g} m here"
                yield Finding(prim.GetPath(), f"{told}, allowed: the same")
            axis = layer.pseudoRoot.GetInfo(UP_AXIS) if layer.pseudoRoot.HasInfo(UP_AXIS) else None
            turned = world[:, 2 if axis == "Z" else 1]
            if axis is not None and turned @ up < LEVEL * np.linalg.norm(turned):
                told = f"{UP_AXIS} is {axis} in {layer.GetDisplayName()}, but its {axis} does not point up here"
                yield Finding(prim.GetPath(), told)


def _referenced(prim: Usd.Prim) -> list[Sdf.Layer]:
    """The root layers of the files that a prim references itself."""
    if not prim.HasAuthoredReferences():
        return []
    found = Usd.PrimCompositionQuery.GetDirectReferences(prim).GetCompositionArcs()
    own = set(prim.GetStage().GetLayerStack())
    return [layer for layer in dict.fromkeys(arc.GetTargetLayer() for arc in found) if layer not in own]
