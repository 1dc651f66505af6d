"""Convex hulls of points: exact ones, and those of what stands on a plane and is stood on."""

from __future__ import annotations

import fast_simplification
import numpy as np
from scipy.spatial import ConvexHull, QhullError

from echomodel.triangles import Mesh, area_normals, box
from echousd.shapes.geometry import Collider

FACES = 120  # of the hull of what stands
DIGITS = 4  # of metres, corners of a hull
FLAT = 0.012  # metres: what is as near to the top or the bottom belongs to it
THIN = 1e-4  # metres, least extent of the box of points in one plane


def convex_hull(points: np.ndarray) -> Mesh:
    """The convex hull with exact corners, facing outwards; of points in one plane their box, a tenth of a mm thick."""
    try:
        hull = ConvexHull(points, qhull_options="QbB Pp Qt")
    except QhullError:
        return box_around(points, THIN)
    normal = area_normals(points[hull.simplices])
    inwards = (normal * hull.equations[:, :3]).sum(1) < 0
    faces = np.where(inwards[:, None], hull.simplices[:, ::-1], hull.simplices)
    used, index = np.unique(faces, return_inverse=True)
    return Mesh(points[used], index.reshape(-1, 3))


def box_around(points: np.ndarray, least: float) -> Mesh:
    """The box of points (n, 3), metres, no extent below `least`."""
    low, high = points.min(0), points.max(0)
    thick = np.maximum(least - (high - low), 0) / 2
    return box(low - thick, high + thick)


def hull_volume(points: np.ndarray) -> float:
    """Volume of the convex hull of points (n, 3), m³; 0 of points in one plane."""
    try:
        return float(ConvexHull(points).volume)
    except QhullError:
        return 0.0


def rounded_hull(points: np.ndarray) -> Mesh:
    """The convex hull of points (n, 3), metres, that stay apart when they are written."""
    # corners nearer to one another than what is written would be one corner there, with faces that have two
    return convex_hull(np.unique(points.round(DIGITS), axis=0))


def standing_hull(mesh: Mesh) -> Collider:
    """One hull of a mesh (metres) that stands on a plane, however its base is rounded."""
    hull = convex_hull(mesh.vertices)
    corners = hull.vertices
    if len(hull.faces) > FACES:
        points, faces = corners.astype(np.float32), hull.faces.astype(np.int32)
        points, faces = fast_simplification.simplify(points, faces, target_count=FACES, agg=5)
        corners = points[np.unique(faces)].astype(float)
    corners = flush(corners, mesh.bounds)
    return Collider("collider", rounded_hull(np.concatenate([corners, soles(mesh)])), "convexHull")


def flush(points: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Points of a collider (n, 3) stretched to a box, the lowest and the highest on two planes: it is stood on.

    `bounds`: (2, 3) float, metres, what they must end with.
    """
    low, high = points.min(0), points.max(0)
    share = (points - low) / np.maximum(high - low, 1e-9)
    return snapped(bounds[0] + share * (bounds[1] - bounds[0]), bounds)


def snapped(points: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """(n, 3) float: points with those near the lowest or the highest plane of `bounds` (2, 3) on it."""
    bottom, top = bounds[0][1], bounds[1][1]
    reach = min(FLAT, 0.1 * (top - bottom))
    height = points[:, 1]
    height = np.where(height < bottom + reach, bottom, np.where(height > top - reach, top, height))
    return np.column_stack([points[:, 0], height, points[:, 2]])


def soles(mesh: Mesh) -> np.ndarray:
    """(32, 3) float: outlines of what a mesh stands on and of its top, each in one plane."""
    points, (low, high) = mesh.vertices, mesh.bounds[:, 1]
    reach = min(FLAT, 0.1 * (high - low))
    angle = np.arange(16) * np.pi / 8
    rays = np.stack([np.cos(angle), np.sin(angle)])
    found = []
    for level in (low, high):
        near = points[np.abs(points[:, 1] - level) <= reach]
        outline = near[(near[:, [0, 2]] @ rays).argmax(0)]
        outline[:, 1] = level
        found.append(outline)
    return np.concatenate(found)
