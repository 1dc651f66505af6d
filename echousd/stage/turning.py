"""Layers with +Y up made layers with +Z up, prim by prim: points, places, masses, joints, cameras and lights."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Vt

# (x, y, z) with Y up -> (x, -z, y) with Z up; what looked along +Z looks along -Y. Of row vectors, as USD's matrices.
TURN = Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d(1, 0, 0), 90.0))
QUARTER = Gf.Quatd(Gf.Rotation(Gf.Vec3d(1, 0, 0), 90.0).GetQuat())
# These look along an axis of their own, which an up axis does not change; a bulb looks everywhere.
AIMED = ("Camera", "DomeLight", "RectLight", "DistantLight", "DiskLight", "CylinderLight")
POINTS = ("points", "normals", "primvars:normals", "velocities", "accelerations")
BOXES = ("extent", "extentsHint")
PLACES = ("physics:centerOfMass", "physics:localPos0", "physics:localPos1", "physics:gravityDirection")
FRAMES = ("physics:principalAxes", "physics:localRot0", "physics:localRot1")
AXES = {"Y": "Z", "Z": "Y"}
OPS = {"rotateY": ("rotateZ", 1.0), "rotateZ": ("rotateY", -1.0), "rotateX": ("rotateX", 1.0)}
SAYS_Y, SAYS_Z = "+Y up, +Z is the front", "+Z up, -Y is the front"


def turn_up(layer: Sdf.Layer, theirs: Callable[[str], bool] = lambda path: False) -> Sdf.Layer:
    """Turn a layer of ours with +Y up to +Z up, in place, and return it; one with +Z up stays as it is.

    Arguments:
        theirs: whether the asset path of a reference or payload is somebody else's model, which is not turned itself.

    Raises ValueError for a transform that is not among ours.
    """
    root = layer.pseudoRoot
    if root.HasInfo("upAxis") and root.GetInfo("upAxis") == "Z":
        return layer
    paths: list[Sdf.Path] = []
    layer.Traverse(Sdf.Path.absoluteRootPath, paths.append)
    with Sdf.ChangeBlock():
        for path in paths:
            spec = layer.GetPrimAtPath(path) if path.IsPrimPath() or path.IsPrimVariantSelectionPath() else None
            if spec is None:
                continue
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
            to, sign = OPS[kind]
            name = attribute.name.replace(f"xformOp:{kind}", f"xformOp:{to}", 1)
            if sign < 0 and value is not None:
                attribute.default = 0.0 - value
            if name != attribute.name:
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
    for kind, (to, _) in OPS.items():
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
