"""Rules on the files and values of a stage: paths that work elsewhere, images and values that can be read, at rest."""

import math
import re
from collections.abc import Iterable, Iterator
from functools import lru_cache
from pathlib import Path, PurePosixPath

import numpy as np
from pxr import Sdf, Tf, Usd, UsdGeom, UsdPhysics, UsdShade, Vt

from echomodel.vocabulary import vocabulary
from echousd.checks.reading import Authored, Finding, Reading, holder, rule
from echousd.exporting.packing import Reach, misfit
from echousd.stage.files import usd_error
from echousd.stage.harmless import as_written
from echousd.stage.units import METRES, UP_AXIS, upwards
from echousd.stage.values import LARGEST, UNREADABLE, asset, shown
from echousd.textures import READABLE, TextureError, decoded, file_of, texture_bytes

KILOGRAMS = "kilogramsPerUnit"
SAME = 1e-6  # relative difference of units that are the same
UNLIKE = math.log(2)  # of the factor by which something may be scaled beside its unit
LEVEL = 0.5  # cosine of the angle between a model's up and the room's
BAKED = "textures"  # folder of a room's own images, which are whole as they were written
ABSOLUTE = re.compile(r"^(?:/|\\\\|[A-Za-z]:[\\/]|file:)")


@rule("echo:RelativePaths")
def relative_paths(reading: Reading) -> Iterator[Finding]:
    """Every asset path is relative and written with forward slashes."""
    for layer, paths in reading.named_files.items():
        for path in (path for path in paths if ABSOLUTE.match(path) or "\\" in path):
            what = "absolute" if ABSOLUTE.match(path) else "written with backslashes"
            where = f"{layer.GetDisplayName()}: asset path {path!r}"
            yield Finding(holder(layer, path), f"{where} is {what}, allowed: ./relative/path")


@rule("echo:PathsInside")
def paths_inside(reading: Reading) -> Iterator[Finding]:
    """Every file that the room names lies below its folder: it stays behind when the folder is sent, or leaks."""
    if not reading.stage.GetRootLayer().realPath:
        return
    reach = Reach.of(reading.stage)
    for layer, paths in reading.named_files.items():
        if layer.realPath and not reach.holds(layer.realPath):
            continue  # what a layer outside names is outside with it; the layer itself is told
        for path in (path for path in paths if not ABSOLUTE.match(path)):
            full = layer.ComputeAbsolutePath(path)
            if full and not reach.holds(full):
                what = f"leads out of {reach.places[0]}, allowed: a file below it (--collect takes models along)"
                message = f"{layer.GetDisplayName()}: asset path {path!r} {what}"
                yield Finding(holder(layer, path), message, warning=bool(Sdf.FileFormat.FindByExtension(full)))


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
        content = texture_bytes(path)
        if content and not (Path(path).parent.name == BAKED and as_written(Path(path), content)):
            decoded(content, path)
    except TextureError as error:
        return str(error)
    return ""


@rule("echo:Units")
def units(reading: Reading) -> Iterator[Finding]:
    """The root layer says the unit and the up axis of the layers that it composes."""
    root, *others = reading.stage.GetLayerStack(includeSessionLayers=False)
    for key in (METRES, UP_AXIS):
        held = root.pseudoRoot.GetInfo(key) if root.pseudoRoot.HasInfo(key) else None
        below = next((layer for layer in others if layer.pseudoRoot.HasInfo(key)), None)
        if below is None:
            continue
        meant, here = below.pseudoRoot.GetInfo(key), root.GetDisplayName()
        told, there = (f"{value:g}" if isinstance(value, float) else str(value) for value in (held, meant))
        where = f"{key} is {there} in {below.GetDisplayName()}"
        if held is None:
            message = f"{here} sets no {key}, {where}; taken as {there} here, other programs may not: set it"
            yield Finding(Sdf.Path.absoluteRootPath, message, warning=True)
        elif held != meant:
            yield Finding(Sdf.Path.absoluteRootPath, f"{key} is {told} in {here}, but {where}, allowed: the same")


@rule("echo:Arcs")
def arcs(reading: Reading) -> Iterator[Finding]:
    """What is referenced is brought to the unit and up axis of the stage; masses are told in one unit."""
    stage = reading.stage
    mass = float(UsdPhysics.GetStageKilogramsPerUnit(stage))
    for layer in reading.named_files:
        authored = layer.pseudoRoot.GetInfo(KILOGRAMS) if layer.pseudoRoot.HasInfo(KILOGRAMS) else mass
        if not math.isclose(authored, mass, rel_tol=SAME):
            where = f"{KILOGRAMS} is {authored:g} in {layer.GetDisplayName()}"
            yield Finding(Sdf.Path.absoluteRootPath, f"{where}, {mass:g} in the stage, allowed: the same")
    up = upwards(stage)
    for prim in reading.distinct:
        for layer in _referenced(prim):
            try:
                world = reading.world(prim)[:3, :3]
            except UNREADABLE:
                continue
            size = float(np.cbrt(abs(np.linalg.det(world)))) * reading.metres
            unit = layer.pseudoRoot.GetInfo(METRES) if layer.pseudoRoot.HasInfo(METRES) else None
            if unit is not None and size > 0 and abs(math.log(size / unit)) > UNLIKE:
                message = f"{METRES} is {unit:g} in {layer.GetDisplayName()}, a unit of it is {size:.3g} m here"
                yield Finding(prim.GetPath(), f"{message}, allowed: the same")
            axis = layer.pseudoRoot.GetInfo(UP_AXIS) if layer.pseudoRoot.HasInfo(UP_AXIS) else None
            turned = world[:, 2 if axis == "Z" else 1]
            if axis is not None and turned @ up < LEVEL * np.linalg.norm(turned):
                message = f"{UP_AXIS} is {axis} in {layer.GetDisplayName()}, but its {axis} does not point up here"
                yield Finding(prim.GetPath(), message)


def _referenced(prim: Usd.Prim) -> list[Sdf.Layer]:
    """The root layers of the files that a prim references itself."""
    if not prim.HasAuthoredReferences():
        return []
    found = Usd.PrimCompositionQuery.GetDirectReferences(prim).GetCompositionArcs()
    own = set(prim.GetStage().GetLayerStack())
    return [layer for layer in dict.fromkeys(arc.GetTargetLayer() for arc in found) if layer not in own]


WRAPS = ("black", "clamp", "repeat", "mirror", "useMetadata")
WORDS = {"inputs:sourceColorSpace": ("raw", "sRGB", "auto"), "inputs:wrapS": WRAPS, "inputs:wrapT": WRAPS}
ENGINES = {"physics:approximation": ("sdf", "sphereFill", "convexMeshSimplification")}  # words that only some know
SPOKEN = {"echo:predicate": "predicates", "echo:roomType": "room_types"}
INVERTED = "!invert!"
RESET = "!resetXformStack!"
WITHOUT_NUMBERS = (str, Sdf.AssetPath, Vt.IntArray, Vt.TokenArray, type(None), Tf.ErrorException)  # most values


@rule("echo:ValueTypes", "authored")
def value_types(_reading: Reading, authored: Authored) -> Iterator[str]:
    """Every value can be read is of the type of its attribute and one of its words: clients read nothing, or crash."""
    attribute, found, name, kind = authored.attribute, authored.value, authored.name, authored.attribute.GetTypeName()
    if isinstance(found, Tf.ErrorException):
        yield f"a value that cannot be read: {usd_error(found)}"
    elif misfit(kind, found):
        yield f"holds {shown(found)}, allowed: {kind}"
    elif isinstance(found, str) and kind == Sdf.ValueTypeNames.Token:
        words = attribute.GetMetadata("allowedTokens") or WORDS.get(name)
        if words and name in SPOKEN:  # the schema may be older than the words
            words = (*words, *(row.name for row in getattr(vocabulary(), SPOKEN[name])))
        if words and found not in (*words, *ENGINES.get(name, ())):
            yield f"is {found!r}, allowed: {', '.join(words)}"


@rule("echo:FiniteValues", "authored")
def finite_values(_reading: Reading, authored: Authored) -> Iterator[str]:
    """No NaN, no infinity (but for physics' "unlimited"), nothing beyond a thousand million."""
    if isinstance(authored.value, WITHOUT_NUMBERS):
        return
    try:
        found = np.asarray(authored.value)
    except (TypeError, ValueError):
        return
    if found.dtype.kind != "f":
        return
    physical = authored.name.startswith("physics")
    bad = np.isnan(found) if physical else ~(np.abs(found) <= LARGEST)
    if bad.any():
        message = f"{found[bad].flat[0]:g}" + (f" ({int(bad.sum())} of {bad.size} numbers)" if bad.size > 1 else "")
        yield f"holds {message}, allowed: -{LARGEST:g} to {LARGEST:g}"


@rule("echo:TransformOps", "prims")
def transform_ops(_reading: Reading, prim: Usd.Prim) -> Iterator[str]:
    """Every op that an xformOpOrder names is there; what is not there does not move its prim."""
    attribute = prim.GetAttribute(UsdGeom.Tokens.xformOpOrder)
    order = attribute.Get() if attribute else None
    for name in order if isinstance(order, Iterable) else ():
        if name != RESET and not prim.HasAttribute(str(name).removeprefix(INVERTED)):
            yield f"xformOpOrder names {name!r}, allowed: ops that the prim has"


@rule("echo:AtRest", "authored")
def at_rest(_reading: Reading, authored: Authored) -> Iterator[str]:
    """Nothing moves or changes shape over time: placement, collisions and relations are measured at rest."""
    moves = authored.name.startswith("xformOp") or authored.name in ("points", "visibility")
    if moves and (count := authored.attribute.GetNumTimeSamples()):
        yield f"has {count} time samples, allowed: one value, without time"


@rule("echo:Variants", "prims")
def variants(_reading: Reading, prim: Usd.Prim) -> Iterator[str]:
    """Every chosen variant exists."""
    if prim.IsInstanceProxy() or not prim.HasAuthoredMetadata("variantSelection"):
        return
    chosen = {key: word for spec in reversed(prim.GetPrimStack()) for key, word in spec.variantSelections.items()}
    sets = prim.GetVariantSets()
    names = sets.GetNames() if chosen else ()
    for name, word in chosen.items():
        there = sets.GetVariantSet(name).GetVariantNames() if name in names else []
        if word and word not in there:
            allowed = ", ".join(there) or "none (there is no such variant set)"
            yield f"variant {name!r} is {word!r}, allowed: {allowed}"


@rule("echo:PayloadsLoaded")
def payloads_loaded(reading: Reading) -> Iterator[Finding]:
    """Every payload is loaded: what is not loaded cannot be checked."""
    for prim in Usd.PrimRange.Stage(reading.stage, Usd.PrimIsActive & Usd.PrimIsDefined & ~Usd.PrimIsAbstract):
        if prim.HasAuthoredPayloads() and not prim.IsLoaded():
            yield Finding(prim.GetPath(), "its payload is not loaded, so nothing below it was checked; load it first")
