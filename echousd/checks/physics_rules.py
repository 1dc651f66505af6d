"""Rules on physics: no body inside another, colliders that engines take and that fit, gravity that points down."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from pxr import Tf, Usd, UsdGeom, UsdPhysics

from echousd.checks.findings import Finding, Rule
from echousd.checks.reading import Reading, below
from echousd.stage.contents import triangulated
from echousd.stage.encoding import LABELS, StageError
from echousd.stage.units import up_axis
from echousd.stage.values import array, texts

OFF = 0.25  # metres between the boxes of geometry and colliders, which are hulls or a few boxes

CONCAVE = (UsdPhysics.Tokens.none, UsdPhysics.Tokens.meshSimplification)


def nested_bodies(reading: Reading) -> Iterator[Finding]:
    """No rigid body lies below another one, unless it resets the transform stack."""
    for prim in reading.prims:
        if not prim.HasAPI(UsdPhysics.RigidBodyAPI) or UsdGeom.Xformable(prim).GetResetXformStack():
            continue
        above = _body_above(prim.GetParent())
        if above:
            yield Finding(
                prim.GetPath(), f"a rigid body inside the rigid body <{above.GetPath()}>, allowed: side by side"
            )


def dynamic_colliders(reading: Reading) -> Iterator[Finding]:
    """What moves collides with hulls or primitives: engines refuse triangle meshes on dynamic bodies."""
    for prim in reading.prims:
        if not prim.IsA(UsdGeom.Mesh) or not prim.HasAPI(UsdPhysics.CollisionAPI):
            continue
        body = _body_above(prim)
        if not body or not _dynamic(UsdPhysics.RigidBodyAPI(body)):
            continue
        shape = UsdPhysics.MeshCollisionAPI(prim)
        kind = (
            shape.GetApproximationAttr().Get() if prim.HasAPI(UsdPhysics.MeshCollisionAPI) else UsdPhysics.Tokens.none
        )
        if kind in CONCAVE:
            yield Finding(
                prim.GetPath(),
                f"physics:approximation is {kind!r} on a collider of the dynamic body <{body.GetPath()}>, "
                "allowed: convexHull, convexDecomposition, boundingCube, boundingSphere",
            )


def colliders(reading: Reading) -> Iterator[Finding]:
    """Every rigid body has colliders, and they fill the same box as its geometry."""
    bodies = False
    for prim in reading.prims:
        if not prim.HasAPI(UsdPhysics.RigidBodyAPI):
            continue
        bodies = True
        shapes = [found for found in below(prim) if found.IsA(UsdGeom.Gprim)]
        solid = [found for found in shapes if _collides(found)]
        if shapes and not solid and not _collides(prim):
            yield Finding(prim.GetPath(), "a rigid body without colliders: it falls through the floor")
            continue
        seen = [found for found in shapes if not reading.is_guide(found)]
        try:
            boxes = [_bounds(gprims, reading) for gprims in (seen, solid)]
        except (StageError, Tf.ErrorException):  # the rules on values report it
            continue
        if boxes[0] is None or boxes[1] is None:
            continue
        apart = float(np.abs(boxes[0] - boxes[1]).max()) * reading.metres
        if apart > OFF:
            yield Finding(prim.GetPath(), f"its colliders end {apart:.2g} m from its geometry, allowed: {OFF:g} m")
    if bodies:
        yield from _bare_shell(reading)


def _bare_shell(reading: Reading) -> Iterator[Finding]:
    """Floors that bodies fall through, and walls that they pass."""
    for prim in reading.prims:
        try:
            words = texts(prim.GetAttribute(LABELS))
        except (StageError, Tf.ErrorException):  # the rules on values report it
            continue
        if not {"floor", "wall"} & set(words):
            continue
        shapes = [found for found in below(prim) if found.IsA(UsdGeom.Gprim)]
        if shapes and not any(map(_collides, (prim, *shapes))):
            what = "floor without colliders: bodies fall through" if "floor" in words else "wall without colliders"
            yield Finding(prim.GetPath(), f"a {what}", warning="floor" not in words)


def _collides(prim: Usd.Prim) -> bool:
    """Whether a prim is a collider that is switched on."""
    if not prim.HasAPI(UsdPhysics.CollisionAPI):
        return False
    try:
        return UsdPhysics.CollisionAPI(prim).GetCollisionEnabledAttr().Get() is not False
    except Tf.ErrorException:  # the rules on values report it
        return True


def _bounds(gprims: list[Usd.Prim], reading: Reading) -> np.ndarray | None:
    """(2, 3) float: box around some prims in the world, None for none."""
    corners = []
    for prim in gprims:
        points, _ = triangulated(prim)
        if len(points):
            world = reading.world(prim)
            turned = points @ world[:3, :3].T + world[:3, 3]
            corners += [turned.min(0), turned.max(0)]
    return np.stack([np.min(corners, 0), np.max(corners, 0)]) if corners else None


def gravity(reading: Reading) -> Iterator[Finding]:
    """Gravity points down."""
    up = np.array([0.0, 0, 1] if up_axis(reading.stage) == UsdGeom.Tokens.z else [0.0, 1, 0])
    for prim in reading.prims:
        if prim.GetTypeName() != "PhysicsScene":
            continue
        try:
            direction = array(prim.GetAttribute("physics:gravityDirection"))
        except (StageError, Tf.ErrorException):
            continue
        if direction.shape == (3,) and direction @ up > 0:
            shown = ", ".join(f"{value:g}" for value in direction)
            axis = up_axis(reading.stage)
            yield Finding(prim.GetPath(), f"gravity points along ({shown}), allowed: downwards on a {axis}-up stage")


def _body_above(prim: Usd.Prim) -> Usd.Prim | None:
    while prim and not prim.IsPseudoRoot():
        if prim.HasAPI(UsdPhysics.RigidBodyAPI):
            return prim
        prim = prim.GetParent()
    return None


def _dynamic(body: UsdPhysics.RigidBodyAPI) -> bool:
    enabled = body.GetRigidBodyEnabledAttr().Get()
    return enabled is not False and not body.GetKinematicEnabledAttr().Get()


RULES = (
    Rule("echo:NestedBodies", "No rigid body lies inside another one.", nested_bodies),
    Rule("echo:DynamicColliders", "Dynamic bodies have no triangle-mesh colliders.", dynamic_colliders),
    Rule("echo:Colliders", "Rigid bodies have colliders, where their geometry is.", colliders),
    Rule("echo:Gravity", "Gravity points down.", gravity),
)
