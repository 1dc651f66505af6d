"""`layers/physics.usda`: rigid bodies with masses for what can be moved, static colliders for what cannot."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from pxr import Gf, Usd, UsdPhysics

from echomodel.vocabulary import vocabulary
from echousd.room.looks import kind_of

GRAVITY = 9.81  # m/s²
# Mass over the volume of the whole box, kg/m³: furniture is mostly hollow. A wardrobe of 1.6 x 2.2 x 0.6 m: 150 kg.
BULK_DENSITY = {
    "bed": 55.0,
    "sofa": 50.0,
    "chair": 28.0,
    "stool": 60.0,
    "office_chair": 30.0,
    "ottoman": 70.0,
    "bench": 60.0,
    "bar_stool": 40.0,
    "table": 35.0,
    "coffee_table": 60.0,
    "side_table": 60.0,
    "cabinet": 70.0,
    "lamp_below": 18.0,
    "table_lamp": 60.0,
    "ceiling_lamp": 25.0,
    "pendant_lamp": 15.0,
    "wall_lamp": 30.0,
    "plant": 45.0,
    "tv": 150.0,
}


@dataclass(frozen=True)
class Body:
    """One object for the physics layer: its root, its collider, and what is known about it (size in metres)."""

    root: str
    collider: str
    approximation: str
    category: str
    size: tuple[float, float, float]


def movable(category: str) -> bool:
    """Whether an object of this category is a rigid body; what hangs on a wall or a ceiling is not."""
    return vocabulary().category(category).support in ("floor", "table")


def mass(category: str, size: tuple[float, float, float]) -> float:
    """Estimated mass in kilograms, at least 0.2."""
    return round(max(0.2, float(np.prod(size)) * BULK_DENSITY[kind_of(category)]), 2)


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
        guide = stage.OverridePrim(body.collider)
        UsdPhysics.CollisionAPI.Apply(guide)
        UsdPhysics.MeshCollisionAPI.Apply(guide).CreateApproximationAttr(body.approximation)
        if movable(body.category):
            root = stage.OverridePrim(body.root)
            UsdPhysics.RigidBodyAPI.Apply(root)
            UsdPhysics.MassAPI.Apply(root).CreateMassAttr(mass(body.category, body.size))
    for path in static_meshes:
        prim = stage.OverridePrim(path)
        UsdPhysics.CollisionAPI.Apply(prim)
        UsdPhysics.MeshCollisionAPI.Apply(prim).CreateApproximationAttr(UsdPhysics.Tokens.none)


def set_gravity(stage: Usd.Stage, up_axis: str) -> None:
    """Gravity's direction is in world space, so it follows the stage's up axis, not `/Room`."""
    direction = Gf.Vec3f(0, -1, 0) if up_axis == "Y" else Gf.Vec3f(0, 0, -1)
    UsdPhysics.Scene(stage.GetPrimAtPath("/Room/PhysicsScene")).CreateGravityDirectionAttr(direction)
