"""Collisions between the meshes of a room: boxes first, then points of one surface inside the other solid.

Depth is measured to the other's faces, so that boards thinner than twice `DEEP` that cross are no collision.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import trimesh
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from trimesh.triangles import closest_point

from echousd.place.geometry import axes, pair_indices, separation
from echousd.place.report import TOUCH, Collision
from echousd.shapes.fittings import SKIRTING
from echousd.stage.contents import RoomObject, Solid, Surrounding

DEEP = 0.006  # metres: a point of one surface this far inside the other mesh is a collision
IN_WALL = SKIRTING + 0.003  # metres: furniture stands at the wall behind its skirting
PRESSED = 0.04  # metres: cushions and blankets press into what they lie on
NEAR = 0.05  # metres between two boxes that are one
SAMPLES = 600  # points per surface and pair


def find_collisions(
    objects: Sequence[RoomObject],
    strangers: Sequence[Surrounding] = (),
    small: Sequence[Surrounding] = (),
    shell: Sequence[Surrounding] = (),
) -> tuple[Collision, ...]:
    """All pairs whose meshes reach into each other, deepest first; boxes may: a chair stands under its table.

    Arguments:
        strangers: other furniture than the graph's. small: things of a dressing. shell: walls, and what is in them.
    """
    things: list[tuple[str, Solid]] = [(one.node.name, one) for one in objects]
    things += [(one.name, one.shape) for one in strangers if one.shape is not None]
    little = [(one.name, one.shape) for one in small if one.shape is not None]
    fixed = [(one.name, one.shape) for one in shell if one.shape is not None]
    found = _hits(things, None, DEEP) + _hits(things, fixed, IN_WALL)
    found += _hits(things, little, PRESSED) + _hits(little, None, IN_WALL)
    return tuple(sorted(found, key=lambda hit: -hit.depth))


def _hits(
    first: Sequence[tuple[str, Solid]], second: Sequence[tuple[str, Solid]] | None, deep: float
) -> list[Collision]:
    """Pairs of the first and the second, or of the first alone, that reach further than `deep` into each other."""
    things = [*first, *(second or ())]
    if second is None:
        pairs = pair_indices(len(first))
    else:
        pairs = np.stack(np.meshgrid(np.arange(len(first)), len(first) + np.arange(len(second)), indexing="ij"), -1)
        pairs = pairs.reshape(-1, 2)
    if not len(pairs):
        return []
    size, position = np.array([one.size for _, one in things]), np.array([one.position for _, one in things])
    overlap = -separation(size, position, np.array([one.yaw for _, one in things]), pairs)
    found = []
    for (i, j), depth in zip(pairs[overlap > TOUCH].tolist(), overlap[overlap > TOUCH], strict=True):
        one, other = things[i][1], things[j][1]
        if len(one.faces) and len(other.faces):
            reach = max(mesh_depth(one, other), depth if _one_place(one, other) else 0.0)
        else:
            reach = depth if second is None else 0.0
        if reach > deep:
            found.append(Collision(things[i][0], things[j][0], float(reach)))
    return found


def _one_place(one: Solid, other: Solid) -> bool:
    """Whether two things fill one box: surfaces that are the same reach nowhere into one another."""
    near = np.abs(one.position - other.position).max() < NEAR
    return bool(near and np.abs(one.size - other.size).max() < NEAR)


def mesh_depth(first: Solid, second: Solid) -> float:
    """How deep one surface reaches into the other solid in metres, 0 where they do not meet."""
    return max(_reach(first, second), _reach(second, first))


def _reach(surface: Solid, solid: Solid) -> float:
    points = surface_points(surface, solid)
    if not len(points):
        return 0.0
    within = points[inside_solid(points, solid)]
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


def surface_points(surface: Solid, solid: Solid) -> np.ndarray:
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


def _local(points: np.ndarray, solid: Solid) -> np.ndarray:
    u = axes(np.array([solid.yaw]))[0]
    offset = points - solid.position
    plan = offset[..., [0, 2]] @ u.T
    return np.stack((plan[..., 0], offset[..., 1] - solid.size[1] / 2, plan[..., 1]), -1)


def _within(points: np.ndarray, solid: Solid) -> np.ndarray:
    return (np.abs(_local(points, solid)) <= solid.size / 2).all(-1)


def _touches(triangles: np.ndarray, solid: Solid) -> np.ndarray:
    local = _local(triangles, solid)
    return ((local.min(1) <= solid.size / 2) & (local.max(1) >= -solid.size / 2)).all(-1)


def inside_solid(points: np.ndarray, solid: Solid) -> np.ndarray:
    """(s,) bool: whether points (s, 3) are inside a solid.

    Around its closed pieces nothing turns but within their boxes, so that most points are compared with few triangles.
    """
    faces = solid.faces
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    count = len(solid.points)
    graph = sparse.coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), (count, count))
    piece = connected_components(graph, directed=False)[1][faces[:, 0]]
    low, high = edges.min(1), edges.max(1)
    _, where = np.unique(low * count + high, return_inverse=True)
    balance = np.bincount(where, np.where(edges[:, 0] < edges[:, 1], 1, -1))
    open_pieces = np.unique(np.tile(piece, 3)[balance[where] != 0])
    loose = np.isin(piece, open_pieces)
    turns = winding_number(points, solid.points[faces[loose]]) if loose.any() else np.zeros(len(points))
    order = np.argsort(piece[~loose], kind="stable")
    closed = faces[~loose][order]
    for part in np.split(closed, np.flatnonzero(np.diff(piece[~loose][order])) + 1) if len(closed) else ():
        corners = solid.points[part]
        near = ((points >= corners.min((0, 1))) & (points <= corners.max((0, 1)))).all(1)
        if near.any():
            turns[near] += winding_number(points[near], corners)
    return np.asarray(turns > 0.5)


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
