"""Colliders of furniture that is one mesh: a hull, or the shape itself with few faces."""

from __future__ import annotations

import fast_simplification
import numpy as np
import trimesh

from echomodel.vocabulary import vocabulary
from echousd.room.geometry import Collider

FACES, HULL_FACES = 400, 120
FLAT = 0.012  # metres: what is as near to the top or the bottom belongs to it


def approximation(category: str) -> str:
    """The UsdPhysics approximation of a category's collider, `convexHull` or `convexDecomposition`."""
    return "convexHull" if vocabulary().category(category).solid else "convexDecomposition"


def collider(mesh: trimesh.Trimesh, category: str) -> Collider:
    """A light mesh for collisions: a hull where the approximation is one, else the shape with few faces."""
    kind = approximation(category)
    if kind == "convexHull":
        return standing_hull(mesh)
    return Collider("collider", flush(_reduced(mesh, FACES), mesh.bounds), kind)


def standing_hull(mesh: trimesh.Trimesh, name: str = "collider") -> Collider:
    """One hull of a mesh (metres) that stands on a plane, however its base is rounded."""
    light = flush(_reduced(mesh.convex_hull, HULL_FACES), mesh.bounds)
    return Collider(name, trimesh.convex.convex_hull(np.concatenate([light.vertices, soles(mesh)])), "convexHull")


def flush(mesh: trimesh.Trimesh, bounds: np.ndarray) -> trimesh.Trimesh:
    """The mesh stretched to a box, its lowest and highest points on two planes: it stands, and is stood on.

    Arguments:
        mesh: a collider, metres. bounds: (2, 3) float, what it must end with.
    """
    low, high = mesh.bounds
    share = (np.asarray(mesh.vertices) - low) / np.maximum(high - low, 1e-9)
    points = bounds[0] + share * (bounds[1] - bounds[0])
    bottom, top = bounds[0][1], bounds[1][1]
    reach = min(FLAT, 0.1 * (top - bottom))
    points[:, 1] = np.where(points[:, 1] < bottom + reach, bottom, points[:, 1])
    points[:, 1] = np.where(points[:, 1] > top - reach, top, points[:, 1])
    return trimesh.Trimesh(points, mesh.faces, process=False)


def soles(mesh: trimesh.Trimesh, directions: int = 16) -> np.ndarray:
    """(2 * directions, 3) float: outlines of what a mesh stands on and of its top, each in one plane."""
    points, (low, high) = np.asarray(mesh.vertices), mesh.bounds[:, 1]
    reach = min(FLAT, 0.1 * (high - low))
    angle = np.arange(directions) * 2 * np.pi / directions
    rays = np.stack([np.cos(angle), np.sin(angle)])
    found = []
    for level in (low, high):
        near = points[np.abs(points[:, 1] - level) <= reach]
        outline = near[(near[:, [0, 2]] @ rays).argmax(0)]
        outline[:, 1] = level
        found.append(outline)
    return np.concatenate(found)


def _reduced(mesh: trimesh.Trimesh, faces: int) -> trimesh.Trimesh:
    """The mesh with at most about `faces` triangles, used vertices only."""
    if len(mesh.faces) > faces:
        points, triangles = fast_simplification.simplify(
            np.asarray(mesh.vertices, np.float32), np.asarray(mesh.faces, np.int32), target_count=faces, agg=5
        )
        mesh = trimesh.Trimesh(points, triangles, process=True)
    out = mesh.copy()
    out.update_faces(out.nondegenerate_faces())
    out.remove_unreferenced_vertices()
    return out
