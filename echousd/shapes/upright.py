"""Rooms of other units and up axes, read as if they had metres and +Y up, which everything here reckons with."""

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


def in_our_frame(geometry: Geometry, metres: float, *, z_up: bool) -> Geometry:
    """A piece in the object's frame: metres, +Y up, +Z its front; joints have no places when read.

    Arguments:
        metres: per unit in which it was read. z_up: read with +Z up, -Y its front.
    """
    if metres == 1.0 and not z_up:
        return geometry
    turn = Z_TO_Y if z_up else np.eye(3)
    parts = tuple(replace(part, mesh=_brought(part.mesh, metres * turn)) for part in geometry.parts)
    colliders = tuple(replace(collider, mesh=_brought(collider.mesh, metres * turn)) for collider in geometry.colliders)
    original = geometry.original
    if original is not None:
        pose = np.eye(4)
        pose[:3, :3] = metres * turn
        original = replace(original, pose=pose @ original.pose)
    mass = geometry.mass
    if mass is not None:
        mass = Mass(mass.mass, metres * turn @ mass.centre, metres**2 * mass.inertia, turn @ mass.axes)
    return replace(geometry, parts=parts, colliders=colliders, mass=mass, original=original)


def _brought(mesh: trimesh.Trimesh, to_ours: np.ndarray) -> trimesh.Trimesh:
    out = mesh.copy()
    out.vertices = np.asarray(mesh.vertices) @ to_ours.T
    return out
