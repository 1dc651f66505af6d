"""Collisions between the meshes of a room: boxes first, then points of one surface inside the other solid.

Depth is measured to the other's faces, so that boards thinner than twice `DEEP` that cross are no collision.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import trimesh
from scipy.spatial import cKDTree
from trimesh.triangles import closest_point

from echousd.repair.geometry import axes, pair_indices, separation
from echousd.repair.report import TOUCH, Collision
from echousd.stage.contents import RoomObject

DEEP = 0.006  # metres: a point of one surface this far inside the other mesh is a collision
SAMPLES = 600  # points per surface and pair


def find_collisions(objects: Sequence[RoomObject]) -> tuple[Collision, ...]:
    """All pairs whose meshes reach into each other, deepest first; boxes may: a chair stands under its table."""
    if len(objects) < 2:
        return ()
    size = np.array([thing.size for thing in objects])
    position = np.array([thing.position for thing in objects])
    yaw = np.array([thing.yaw for thing in objects])
    pairs = pair_indices(len(objects))
    depth = -separation(size, position, yaw, pairs)
    found = []
    for (i, j), overlap in zip(pairs.tolist(), depth, strict=True):
        if overlap > TOUCH:
            deep = mesh_depth(objects[i], objects[j]) if len(objects[i].faces) and len(objects[j].faces) else overlap
            if deep > DEEP:
                found.append(Collision(objects[i].node.name, objects[j].node.name, float(deep)))
    return tuple(sorted(found, key=lambda hit: -hit.depth))


def mesh_depth(first: RoomObject, second: RoomObject) -> float:
    """How deep one surface reaches into the other solid in metres, 0 where they do not meet."""
    return max(_reach(first, second), _reach(second, first))


def _reach(surface: RoomObject, solid: RoomObject) -> float:
    points = surface_points(surface, solid)
    if not len(points):
        return 0.0
    within = points[winding_number(points, solid.points[solid.faces]) > 0.5]
    if not len(within):
        return 0.0
    triangles = solid.points[solid.faces]
    skin = np.concatenate((solid.points, _scatter(solid.points, solid.faces, 4000)))
    deepest = 0.0
    # A sample of the skin is further away than the skin itself: deepest first, until no point can be deeper.
    at_most = cKDTree(skin).query(within)[0]
    for number in np.argsort(-at_most):
        if at_most[number] <= max(deepest, DEEP):
            break
        near = closest_point(triangles, np.broadcast_to(within[number], (len(triangles), 3)))
        far = np.linalg.norm(near - within[number], axis=1)  # NaN where a triangle has no area
        deepest = max(deepest, float(np.fmin.reduce(far, initial=at_most[number])))
    return deepest


def surface_points(surface: RoomObject, solid: RoomObject) -> np.ndarray:
    """(s, 3) float: vertices and scattered points of a surface that lie in the other object's box."""
    near = surface.faces[_touches(surface.points[surface.faces], solid)]
    if not len(near):
        return np.zeros((0, 3))
    points = np.concatenate((surface.points[near].reshape(-1, 3), _scatter(surface.points, near, 4 * SAMPLES)))
    points = points[_within(points, solid)]
    if len(points) <= SAMPLES:
        return points
    return points[np.random.default_rng(0).choice(len(points), SAMPLES, replace=False)]


def _scatter(points: np.ndarray, faces: np.ndarray, count: int) -> np.ndarray:
    mesh = trimesh.Trimesh(points, faces, process=False)
    if not mesh.area_faces.sum() > 0:
        return np.zeros((0, 3))
    return np.asarray(trimesh.sample.sample_surface(mesh, count, seed=0)[0])


def _local(points: np.ndarray, solid: RoomObject) -> np.ndarray:
    u = axes(np.array([solid.yaw]))[0]
    offset = points - solid.position
    plan = offset[..., [0, 2]] @ u.T
    return np.stack((plan[..., 0], offset[..., 1] - solid.size[1] / 2, plan[..., 1]), -1)


def _within(points: np.ndarray, solid: RoomObject) -> np.ndarray:
    return (np.abs(_local(points, solid)) <= solid.size / 2).all(-1)


def _touches(triangles: np.ndarray, solid: RoomObject) -> np.ndarray:
    local = _local(triangles, solid)
    return ((local.min(1) <= solid.size / 2) & (local.max(1) >= -solid.size / 2)).all(-1)


def winding_number(points: np.ndarray, triangles: np.ndarray, block: int = 400_000) -> np.ndarray:
    """(s,) float: generalised winding number of a triangle soup around points, 1 inside, 0 outside (Jacobson 2013).

    Arguments:
        points: (s, 3) float; triangles: (f, 3, 3) float.
        block: largest number of point-triangle pairs held at once.
    """
    out = np.zeros(len(points))
    step = max(1, block // max(len(triangles), 1))
    corners = triangles.astype(np.float32)
    for start in range(0, len(points), step):
        a, b, c = np.moveaxis(corners[None] - points[start : start + step, None, None].astype(np.float32), 2, 0)
        la, lb, lc = (np.sqrt((v * v).sum(-1)) for v in (a, b, c))
        triple = (a * np.cross(b, c)).sum(-1)
        below = la * lb * lc + (a * b).sum(-1) * lc + (b * c).sum(-1) * la + (c * a).sum(-1) * lb
        out[start : start + step] = np.arctan2(triple, below).sum(-1) / (2 * np.pi)
    return out
