"""Rooms whose prims have +Z up, read as if they had +Y up, which everything here reckons with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import trimesh
from pxr import Usd, UsdGeom

from echousd.shapes.geometry import Geometry, Mass
from echousd.stage.contents import Z_TO_Y, room_frame
from echousd.stage.values import matrix


def stands_z_up(room: Usd.Prim) -> bool:
    """Whether a room's own axes have +Z up: not where a prim of +Y up is turned as a whole."""
    cache = UsdGeom.XformCache()
    own = room_frame(room, cache) @ matrix(cache.GetLocalToWorldTransform(room), room)
    return bool(abs(own[1, 2]) > abs(own[1, 1]))


def as_y_up(geometry: Geometry) -> Geometry:
    """A piece with +Z up, -Y its front, in the object's frame: +Y up, +Z its front; joints have no places when read."""
    parts = tuple(replace(part, mesh=_turned(part.mesh)) for part in geometry.parts)
    colliders = tuple(replace(collider, mesh=_turned(collider.mesh)) for collider in geometry.colliders)
    original = geometry.original
    if original is not None:
        pose = np.eye(4)
        pose[:3, :3] = Z_TO_Y
        original = replace(original, pose=pose @ original.pose)
    mass = geometry.mass
    if mass is not None:
        mass = Mass(mass.mass, Z_TO_Y @ mass.centre, mass.inertia, Z_TO_Y @ mass.axes)
    return replace(geometry, parts=parts, colliders=colliders, mass=mass, original=original)


def _turned(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    out = mesh.copy()
    out.vertices = np.asarray(mesh.vertices) @ Z_TO_Y.T
    return out
