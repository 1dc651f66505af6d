"""Where the front of a model is, by its shape: backs of seats, heads of beds, plain rears of cases."""

from __future__ import annotations

import numpy as np
import trimesh

from echomodel.vocabulary import vocabulary
from echousd.assets.shape import sampled

SAMPLES = 4000
SURE = 0.12  # share by which one side must outdo its opposite to be believed against a convention


def front_by_shape(mesh: trimesh.Trimesh, category: str) -> tuple[int, float]:
    """(quarters, evidence): quarter turns about +Y, counter-clockwise from above, that bring the front to +Z.

    Arguments:
        mesh: +Y up, any unit. category: of the vocabulary; what looks alike from all sides has no evidence.

    Seats, sofas and beds are highest at their back; cases and screens are plain and flat there and stand with it, the
    wide side, to the wall. Evidence is 0 where nothing tells, and near 1 where all does.
    """
    role = vocabulary().category(category).role
    points, normals, _ = sampled(mesh, SAMPLES)
    weight = np.full(SAMPLES, 1 / SAMPLES)
    low, high = points.min(0), points.max(0)
    size = np.maximum(high - low, 1e-9)
    at = (points - low) / size  # 0 to 1
    if role in ("seat", "sofa", "bed"):
        scores = _heights(at, weight)
    elif role in ("storage", "screen"):
        scores = _plainness(at, normals, weight, size)
    else:
        return 0, 0.0
    # scores: how much each side, +Z, +X, -Z, -X in the order of quarter turns, looks like a back
    opposite = np.roll(scores, 2)
    best = int(np.argmax(scores - opposite))
    back_to_front = (best + 2) % 4
    evidence = float(scores[best] - opposite[best])
    # a front at +X (place 1) comes to +Z by turning clockwise once, that is three quarters counter-clockwise
    return (4 - back_to_front) % 4, evidence


def _heights(at: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Of the surface in the upper part, how much lies near each side, as shares of what lies there."""
    upper = at[:, 1] > 0.62
    if upper.sum() < 20:
        upper = at[:, 1] > 0.5
    total = max(float(weight[upper].sum()), 1e-9)
    lean = [at[:, 2], at[:, 0], 1 - at[:, 2], 1 - at[:, 0]]
    return np.array([float((weight * upper * (side > 0.68)).sum()) / total for side in lean])


def _plainness(at: np.ndarray, normals: np.ndarray, weight: np.ndarray, size: np.ndarray) -> np.ndarray:
    """How much of each side is one plane at its very end, weighted by how wide the side is."""
    axes = ((2, 1.0), (0, 1.0), (2, -1.0), (0, -1.0))
    wide = max(size[0], size[2])
    found = []
    for axis, sign in axes:
        end = at[:, axis] > 0.99 if sign > 0 else at[:, axis] < 0.01
        facing = np.abs(normals[:, axis]) > 0.9
        across = size[0] if axis == 2 else size[2]
        flat = float((weight * (end & facing)).sum())
        near = at[:, axis] > 0.6 if sign > 0 else at[:, axis] < 0.4
        around = max(float((weight * (near & facing)).sum()), 1e-9)
        found.append(flat / around * (across / wide) ** 2)
    return np.array(found)
