"""Colliders of furniture that is one mesh: a hull, or the shape itself with few faces."""

from __future__ import annotations

import fast_simplification
import numpy as np
import trimesh

from echomodel.vocabulary import vocabulary
from echousd.room.geometry import Collider

FACES, HULL_FACES = 400, 120


def approximation(category: str) -> str:
    """The UsdPhysics approximation of a category's collider, `convexHull` or `convexDecomposition`."""
    return "convexHull" if vocabulary().category(category).solid else "convexDecomposition"


def collider(mesh: trimesh.Trimesh, category: str) -> Collider:
    """A light mesh for collisions: a hull where the approximation is one, else the shape with few faces."""
    kind = approximation(category)
    light = _reduced(mesh.convex_hull, HULL_FACES).convex_hull if kind == "convexHull" else _reduced(mesh, FACES)
    return Collider("collider", light, kind)


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
