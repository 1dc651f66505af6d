"""Layers of ours (metres, +Y up, the room at `/Room`) made layers of other conventions, prim by prim.

Points, places, masses, joints, cameras and lights change with the unit and the up axis; no prim gets a scale for it.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Vt

from echousd.stage.files import prim_specs
from echousd.stage.paths import ROOM

# (x, y, z) with Y up -> (x, -z, y) with Z up; what looked along +Z looks along -Y. Of row vectors, as USD's matrices.
TURN = Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d(1, 0, 0), 90.0))
QUARTER = Gf.Quatd(Gf.Rotation(Gf.Vec3d(1, 0, 0), 90.0).GetQuat())
# These look along an axis of their own, which an up axis does not change; a bulb looks everywhere.
AIMED = ("Camera", "DomeLight", "RectLight", "DistantLight", "DiskLight", "CylinderLight")
POINTS = ("points", "normals", "primvars:normals")
BOXES = ("extent", "extentsHint")
PLACES = ("physics:centerOfMass", "physics:localPos0", "physics:localPos1", "physics:gravityDirection")
FRAMES = ("physics:principalAxes", "physics:localRot0", "physics:localRot1")
AXES = {"Y": "Z", "Z": "Y"}
OPS = {"rotateY": "rotateZ", "rotateZ": "rotateY", "rotateX": "rotateX"}  # Z the other way round
LENGTHS = {  # attribute that we write -> power of the unit that it is given in
    "points": 1, "extent": 1, "extentsHint": 1, "clippingRange": 1, "focalLength": 1, "focusDistance": 1,
    "horizontalAperture": 1, "verticalAperture": 1, "horizontalApertureOffset": 1, "verticalApertureOffset": 1,
    "inputs:radius": 1, "inputs:width": 1, "inputs:height": 1,
    "physics:centerOfMass": 1, "physics:localPos0": 1, "physics:localPos1": 1, "physics:gravityMagnitude": 1,
    "physics:diagonalInertia": 2, "drive:angular:physics:damping": 2, "physics:density": -3,
    "drive:linear:physics:maxForce": 1, "drive:angular:physics:maxForce": 2,
}  # fmt: skip
LIMITS = ("physics:lowerLimit", "physics:upperLimit")  # lengths of what slides, else degrees
SAYS_Y, SAYS_Z = "+Y up, +Z is the front", "+Z up, -Y is the front"


def rescale(layer: Sdf.Layer, metres: float, theirs: Callable[[str], bool] = lambda path: False) -> Sdf.Layer:
    """Give a layer of ours another unit, in place, and return it; one in that unit stays as it is.

    Arguments:
        metres: per unit. theirs: as for `turn_up`.
    """
    root = layer.pseudoRoot
    units = (root.GetInfo("metersPerUnit") if root.HasInfo("metersPerUnit") else 1.0) / metres
    if units == 1.0:
        return layer
    with Sdf.ChangeBlock():
        for spec in prim_specs(layer):
            for attribute in spec.attributes:
                if attribute.default is not None:
                    _rescale(attribute, spec, units, whole=any(_is_theirs(one, theirs) for one in spec.nameChildren))
        root.SetInfo("metersPerUnit", metres)
    return layer


def _rescale(attribute: Sdf.AttributeSpec, spec: Sdf.PrimSpec, units: float, *, whole: bool) -> None:
    """The value of an attribute in another unit, of which the present one has so many.

    Arguments:
        whole: below the prim stands somebody else's model, whose points its transform brings to ours.
    """
    name, value = attribute.name, attribute.default
    if name.startswith("xformOp:transform"):
        scaled = value * Gf.Matrix4d().SetScale(units)
        attribute.default = scaled if whole else Gf.Matrix4d(value).SetTranslateOnly(scaled.ExtractTranslation())
        return
    power = LENGTHS.get(name, 0)
    outside = spec.layer.GetPrimAtPath(spec.path.StripAllVariantSelections())
    kind = spec.typeName or (outside.typeName if outside else "")
    if name == "newton:friction":
        power = 1 if kind == "PhysicsPrismaticJoint" else 2
    if name.startswith("xformOp:translate") or (name in LIMITS and kind == "PhysicsPrismaticJoint"):
        power = 1
    if name == "inputs:intensity" and kind == "SphereLight":
        power = 2  # of what is normalized: radiance times area
    if not power:
        return
    if isinstance(value, Vt.Vec3fArray):
        attribute.default = Vt.Vec3fArray.FromNumpy(np.array(value) * np.float32(units**power))
    elif isinstance(value, float):
        attribute.default = value * units**power
    else:
        attribute.default = type(value)(*(round(v * units**power, 9) for v in value))


def move_room(layer: Sdf.Layer, path: str) -> Sdf.Layer:
    """Put what a layer of ours says of `/Room` at another path, in place, and return it; targets follow.

    Where the layer defines the room, it defines the prims above it as well.
    """
    room = layer.GetPrimAtPath(ROOM)
    if path == ROOM or room is None:
        return layer
    moved = Sdf.Layer.CreateAnonymous(".usda")
    moved.TransferContent(layer)
    del moved.rootPrims[room.name]
    Sdf.CreatePrimInLayer(moved, path)
    Sdf.CopySpec(layer, ROOM, moved, path)
    for above in Sdf.Path(path).GetParentPath().GetPrefixes() if room.specifier == Sdf.SpecifierDef else ():
        spec = moved.GetPrimAtPath(above)
        spec.specifier, spec.typeName, spec.kind = Sdf.SpecifierDef, "Xform", "assembly"
    moved.defaultPrim = Sdf.Path(path).GetPrefixes()[0].name
    for spec in prim_specs(moved):  # what was copied follows by itself; classes beside the room do not
        for link in () if spec.path.HasPrefix(path) else spec.relationships:
            link.targetPathList.ModifyItemEdits(lambda target: target.ReplacePrefix(ROOM, path))
    layer.TransferContent(moved)
    return layer


def turn_up(layer: Sdf.Layer, theirs: Callable[[str], bool] = lambda path: False) -> Sdf.Layer:
    """Turn a layer of ours with +Y up to +Z up, in place, and return it; one with +Z up stays as it is.

    Arguments:
        theirs: whether the asset path of a reference or payload is somebody else's model, which is not turned itself.

    Raises ValueError for a transform that is not among ours.
    """
    root = layer.pseudoRoot
    if root.GetInfo("upAxis") == "Z":
        return layer
    with Sdf.ChangeBlock():
        for spec in prim_specs(layer):
            for attribute in list(spec.attributes):
                _turn(attribute)
            _turn_ops(spec)
            if spec.typeName in AIMED or any(_is_theirs(child, theirs) for child in spec.nameChildren):
                _aim(spec)
            if spec.HasInfo("documentation"):
                spec.SetInfo("documentation", spec.GetInfo("documentation").replace(SAYS_Y, SAYS_Z))
        root.SetInfo("upAxis", "Z")
    return layer


def _turn(attribute: Sdf.AttributeSpec) -> None:
    """The values that are places, directions, boxes, frames or axes."""
    name, value = attribute.name, attribute.default
    if value is None:
        return
    if name in POINTS:
        attribute.default = type(value).FromNumpy(_turned(np.array(value)))
    elif name in BOXES:
        corners = _turned(np.array(value, np.float32)).reshape(-1, 2, 3)
        boxes = np.stack([corners.min(1), corners.max(1)], 1).reshape(-1, 3)
        attribute.default = Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(boxes))
    elif name in PLACES:
        attribute.default = _turned_one(value)
    elif name in FRAMES:
        attribute.default = type(value)(QUARTER * Gf.Quatd(value))
    elif name == "axis":
        attribute.default = AXES.get(value, value)


def _turned(points: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(np.stack([points[:, 0], -points[:, 2], points[:, 1]], 1) + 0.0).astype(points.dtype)


def _turned_one(value: Any) -> Any:
    x, y, z = value
    return type(value)(x, 0.0 - z, y)


def _turn_ops(spec: Sdf.PrimSpec) -> None:
    """The transforms of a prim, as seen between two turned frames."""
    for attribute in [each for each in spec.attributes if each.name.startswith("xformOp:")]:
        kind, value = attribute.name.split(":")[1], attribute.default
        if kind in OPS:
            if kind == "rotateZ" and value is not None:
                attribute.default = 0.0 - value
            if (name := _renamed(attribute.name)) != attribute.name:
                attribute.name = name
        elif value is None:
            continue
        elif kind == "translate":
            attribute.default = _turned_one(value)
        elif kind == "scale":
            attribute.default = type(value)(value[0], value[2], value[1])
        elif kind == "orient":
            attribute.default = type(value)(QUARTER * Gf.Quatd(value) * QUARTER.GetInverse())
        elif kind == "transform":
            attribute.default = TURN.GetInverse() * value * TURN
        else:
            raise ValueError(f"<{spec.path}>: {attribute.name} cannot be turned, allowed: {', '.join(OPS)}, translate")
    order = spec.attributes.get("xformOpOrder")
    if order is not None and order.default is not None:
        order.default = Vt.TokenArray([_renamed(name) for name in order.default])


def _renamed(op: str) -> str:
    for kind, to in OPS.items():
        if f"xformOp:{kind}" in op:
            return op.replace(f"xformOp:{kind}", f"xformOp:{to}", 1)
    return op


def _aim(spec: Sdf.PrimSpec) -> None:
    """Turn what a prim's own frame holds as well, which stays as it was: one more quarter about X, after its ops."""
    order = spec.attributes.get("xformOpOrder")
    ops = list(order.default) if order is not None and order.default is not None else []
    last = spec.attributes.get(ops[-1]) if ops else None
    if last is not None and last.name == "xformOp:transform":
        last.default = TURN * last.default
        return
    if last is not None and last.name == "xformOp:rotateX":
        last.default = last.default + 90.0
        return
    if order is None:
        order = Sdf.AttributeSpec(spec, "xformOpOrder", Sdf.ValueTypeNames.TokenArray, Sdf.VariabilityUniform)
    quarter = Sdf.AttributeSpec(spec, "xformOp:rotateX", Sdf.ValueTypeNames.Float)
    quarter.default = 90.0
    order.default = Vt.TokenArray([*ops, "xformOp:rotateX"])


def _is_theirs(spec: Sdf.PrimSpec, theirs: Callable[[str], bool]) -> bool:
    arcs = [*spec.payloadList.GetAddedOrExplicitItems(), *spec.referenceList.GetAddedOrExplicitItems()]
    return any(arc.assetPath and theirs(arc.assetPath) for arc in arcs)
