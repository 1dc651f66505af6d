"""`layers/physics.usda`: rigid bodies with masses for what can be moved, static colliders for what cannot."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from pxr import Gf, Usd, UsdPhysics

from echomodel.vocabulary import vocabulary
from echousd.room.geometry import Mass
from echousd.room.joints import ARTICULATED, ARTICULATION, STATIC, write_mass

GRAVITY = 9.81  # m/s²


@dataclass(frozen=True)
class Body:
    """One object for the physics layer.

    Arguments:
        root: path of the object. colliders: path -> approximation. category: its word. size: (x, y, z), metres.
        mass: what it weighs, None = estimated from category and size.
        articulated: whether its asset has joints; then it is one body only in its variant `static`.
    """

    root: str
    colliders: Mapping[str, str]
    category: str
    size: tuple[float, float, float]
    mass: Mass | None = None
    articulated: bool = False


def movable(category: str) -> bool:
    """Whether an object of this category is a rigid body; what hangs on a wall or a ceiling is not."""
    return vocabulary().category(category).support in ("floor", "table")


def mass(category: str, size: tuple[float, float, float]) -> float:
    """Estimated mass in kilograms, at least 0.2."""
    return round(max(0.2, float(np.prod(size)) * vocabulary().category(category).density), 2)


def write_physics(stage: Usd.Stage, bodies: Iterable[Body], static_meshes: Iterable[str]) -> None:
    """Author the physics scene, bodies and colliders as overs.

    Arguments:
        stage: receives the opinions; its units are metres and kilograms, its up axis is Y below `/Room`.
        bodies: the furniture.
        static_meshes: paths of meshes that collide as they are and never move (floor, walls).
    """
    scene = UsdPhysics.Scene.Define(stage, "/Room/PhysicsScene")
    scene.CreateGravityMagnitudeAttr(GRAVITY)
    for body in bodies:
        for path, approximation in body.colliders.items():
            guide = stage.OverridePrim(path)
            UsdPhysics.CollisionAPI.Apply(guide)
            UsdPhysics.MeshCollisionAPI.Apply(guide).CreateApproximationAttr(approximation)
        if movable(body.category):
            root = stage.OverridePrim(body.root)
            if not body.articulated:
                rigid(root, body)
                continue
            variants = root.GetVariantSets().AddVariantSet(ARTICULATION)
            for name in (STATIC, ARTICULATED):
                variants.AddVariant(name)
                variants.SetVariantSelection(name)
                with variants.GetVariantEditContext():
                    if name == STATIC:
                        rigid(root, body)
                    else:
                        UsdPhysics.ArticulationRootAPI.Apply(root)
            variants.ClearVariantSelection()
    for path in static_meshes:
        prim = stage.OverridePrim(path)
        UsdPhysics.CollisionAPI.Apply(prim)
        UsdPhysics.MeshCollisionAPI.Apply(prim).CreateApproximationAttr(UsdPhysics.Tokens.none)


def rigid(prim: Usd.Prim, body: Body) -> None:
    """Make a prim one rigid body."""
    UsdPhysics.RigidBodyAPI.Apply(prim)
    if body.mass is None:
        UsdPhysics.MassAPI.Apply(prim).CreateMassAttr(mass(body.category, body.size))
    else:
        write_mass(prim, body.mass)


def set_gravity(stage: Usd.Stage, up_axis: str) -> None:
    """Gravity's direction is in world space, so it follows the stage's up axis, not `/Room`."""
    direction = Gf.Vec3f(0, -1, 0) if up_axis == "Y" else Gf.Vec3f(0, 0, -1)
    UsdPhysics.Scene(stage.GetPrimAtPath("/Room/PhysicsScene")).CreateGravityDirectionAttr(direction)
