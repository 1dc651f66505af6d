"""Scores of reconstructed shapes: F-score, IoU, Chamfer distance.

All distances are measured in the box frame, in which a shape fills the unit box; one voxel of the grid is 1/60 there,
and the F-score's threshold is 1/64.
"""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from echomodel.tsdf import mesh_from_tsdf

THRESHOLD = 1 / 64
SAMPLES = 8_000  # points whose distance is scored
DENSE = 40_000  # points by which the triangles of the other surface are found


def surface_points(mesh: trimesh.Trimesh, count: int, seed: int = 0) -> np.ndarray:
    """Points on a surface, evenly by area: (count, 3) float32, equal for equal seeds."""
    points, _ = trimesh.sample.sample_surface(mesh, count, seed=seed)
    return np.asarray(points, np.float32)


def surface_scores(ours: np.ndarray, reference: np.ndarray, threshold: float = THRESHOLD) -> dict[str, float]:
    """How well a grid matches another one.

    Arguments:
        ours, reference: (64, 64, 64) float, signed distances, negative inside; the reference holds a surface.
        threshold: distance in the box frame that counts as a hit.

    Returns:
        `f_score`, the harmonic mean of `precision` (our points near the reference) and `recall` (its points near ours);
        `chamfer`, the mean distance both ways, averaged; `iou` of the insides. A grid without surface scores 0 with a
        Chamfer distance of 1.
    """
    union = ((ours < 0) | (reference < 0)).sum()
    iou = float(((ours < 0) & (reference < 0)).sum() / max(union, 1))
    try:
        mesh = mesh_from_tsdf(ours)
    except ValueError:
        return {"f_score": 0.0, "precision": 0.0, "recall": 0.0, "chamfer": 1.0, "iou": iou}
    target = mesh_from_tsdf(reference)
    there, back = _distances(mesh, target), _distances(target, mesh)
    precision, recall = float((there <= threshold).mean()), float((back <= threshold).mean())
    f_score = 2 * precision * recall / (precision + recall) if precision + recall else 0.0
    chamfer = float(there.mean() + back.mean()) / 2
    return {"f_score": f_score, "precision": precision, "recall": recall, "chamfer": chamfer, "iou": iou}


def _distances(mesh: trimesh.Trimesh, target: trimesh.Trimesh) -> np.ndarray:
    """Distances of points on one surface to the other: to the triangle on which the nearest sample lies."""
    dense, face = trimesh.sample.sample_surface(target, DENSE, seed=0)
    points = surface_points(mesh, SAMPLES, seed=1).astype(float)
    found, index = cKDTree(dense).query(points)
    closest = trimesh.triangles.closest_point(target.triangles[face[index]], points)
    return np.minimum(found, np.linalg.norm(closest - points, axis=1))
