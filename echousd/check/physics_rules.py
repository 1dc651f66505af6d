"""Rules on rigid bodies: none inside another, no triangle meshes as colliders of what moves."""

from __future__ import annotations

from collections.abc import Iterator

from pxr import Usd, UsdGeom, UsdPhysics

from echousd.check.findings import Finding, Rule, prims

CONCAVE = (UsdPhysics.Tokens.none, UsdPhysics.Tokens.meshSimplification)


def nested_bodies(stage: Usd.Stage) -> Iterator[Finding]:
    """No rigid body lies below another one, unless it resets the transform stack."""
    for prim in prims(stage):
        if not prim.HasAPI(UsdPhysics.RigidBodyAPI) or UsdGeom.Xformable(prim).GetResetXformStack():
            continue
        above = _body_above(prim.GetParent())
        if above:
            yield Finding(
                prim.GetPath(), f"a rigid body inside the rigid body <{above.GetPath()}>, allowed: side by side"
            )


def dynamic_colliders(stage: Usd.Stage) -> Iterator[Finding]:
    """What moves collides with hulls or primitives: engines refuse triangle meshes on dynamic bodies."""
    for prim in prims(stage):
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
)
