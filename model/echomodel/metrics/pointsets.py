"""Scores of shapes: reconstructions by F-score, IoU and Chamfer distance; sets beside each other by MMD, COV and 1-NNA.

Distances are measured in the box frame, in which a shape fills the unit box; one voxel of the grid is 1/60 there, and
the F-score's threshold is 1/64. Sets are compared as in EchoScene's table 3.
"""

from collections.abc import Callable, Mapping

import numpy as np
import torch
import trimesh
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree
from torch import Tensor

from echomodel.tsdf import mesh_from_tsdf

THRESHOLD = 1 / 64
SAMPLES = 8_000  # points whose distance is scored
DENSE = 40_000  # points by which the triangles of the other surface are found


def surface_points(mesh: trimesh.Trimesh, count: int, seed: int = 0) -> np.ndarray:
    """Points on a surface, evenly by area: (count, 3) float32, equal for equal seeds."""
    points, _ = trimesh.sample.sample_surface(mesh, count, seed=seed)
    return np.asarray(points, np.float32)


def surface_scores(ours: np.ndarray, reference: np.ndarray) -> dict[str, float]:
    """How well a grid matches another one.

    `ours`, `reference`: (64, 64, 64) float, signed distances, negative inside; the reference holds a surface.

    Returns `f_score`, the harmonic mean of `precision` (our points near the reference) and `recall` (its points near
    ours); `chamfer`, the mean distance both ways, averaged; `iou` of the insides. A grid without surface scores 0 with
    a Chamfer distance of 1.
    """
    union = ((ours < 0) | (reference < 0)).sum()
    iou = float(((ours < 0) & (reference < 0)).sum() / max(union, 1))
    try:
        mesh = mesh_from_tsdf(ours)
    except ValueError:
        return {"f_score": 0.0, "precision": 0.0, "recall": 0.0, "chamfer": 1.0, "iou": iou}
    target = mesh_from_tsdf(reference)
    there, back = _distances(mesh, target), _distances(target, mesh)
    precision, recall = float((there <= THRESHOLD).mean()), float((back <= THRESHOLD).mean())
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


LEAST = 4  # shapes of a class that has scores
CHUNK = 16  # point sets compared at a time
EXACT = "donot_use_mm_for_euclid_dist"  # zeros for equal points, which the expanded square does not give
Measure = Callable[[Tensor, Tensor], Tensor]


def chamfer(one: Tensor, others: Tensor) -> Tensor:
    """(B,) distances of points (P, 3) to sets (B, Q, 3): mean squares to the nearest point, summed over both ways."""
    found = []
    for part in others.split(CHUNK):
        squares = torch.cdist(one[None], part, compute_mode=EXACT).square()
        found.append(squares.amin(2).mean(1) + squares.amin(1).mean(1))
    return torch.cat(found)


def earth_mover(one: Tensor, others: Tensor) -> Tensor:
    """(B,) mean distances of points (P, 3) to those of (B, P, 3) under the best assignment of points to points."""
    costs = (torch.cdist(one, other, compute_mode=EXACT).numpy() for other in others)
    return torch.tensor([float(cost[linear_sum_assignment(cost)].mean()) for cost in costs])


def compared(apart: Tensor, count: int) -> dict[str, float]:
    """What tells two sets from each other, by (N, N) distances of which the first `count` are references.

    Returns `mmd`, minimum matching distance: mean over references of the nearest sample; `mmd_smp`: mean over samples
    of the nearest reference; `cov`: references that are nearest to some sample, as a fraction (Achlioptas et al. 2018).
    `acc`: accuracy of a leave-one-out nearest neighbour, 0.5 is best (Lopez-Paz et al. 2017), `acc_t` over references,
    `acc_f` over samples. `variety`: mean distance of two samples.
    Raises ValueError where either set is empty.
    """
    samples = len(apart) - count
    if min(samples, count) < 1:
        raise ValueError(f"{samples} samples and {count} references, allowed: 1 or more of each")
    nearest, index = apart[count:, :count].min(1)
    reference = torch.arange(len(apart)) < count
    right = (reference[apart.clone().fill_diagonal_(torch.inf).argmin(1)] == reference).float()
    return {
        "mmd": float(apart[count:, :count].amin(0).mean()),
        "mmd_smp": float(nearest.mean()),
        "cov": len(index.unique()) / count,
        "acc": float(right.mean()),
        "acc_t": float(right[:count].mean()),
        "acc_f": float(right[count:].mean()),
        "variety": float(apart[count:, count:].sum() / max(samples * (samples - 1), 1)),
    }


def compare_sets(samples: Tensor, references: Tensor, measure: Measure = chamfer) -> dict[str, float]:
    """`compared` for two lists of point sets, samples (S, P, 3) and references (R, P, 3) float32.

    Raises ValueError for what is not such lists, and for a point that is not finite.
    """
    sets = torch.cat([references, samples])
    odd = int((~torch.isfinite(sets)).sum())
    if sets.ndim != 3 or sets.shape[2] != 3 or odd:
        raise ValueError(f"point sets are {tuple(sets.shape)}, {odd} numbers not finite, expected (sets, points, 3)")
    apart = torch.zeros(len(sets), len(sets))
    for k, one in enumerate(sets[:-1]):
        apart[k, k + 1 :] = measure(one, sets[k + 1 :])
    return compared(apart + apart.T, len(references))


def set_scores(
    generated: Mapping[str, np.ndarray], references: Mapping[str, np.ndarray], *, points: int = 0
) -> dict[str, dict[str, float]]:
    """`compare_sets` of generated and reference shapes, class by class; those with less than `LEAST` are left out.

    Arguments:
        generated, references: class -> (n, p, 3) float32 surface points; both are cut to the smaller number.
        points: by the earth mover's distance of so many points each; 0 = by the Chamfer distance of all.
    """
    scores: dict[str, dict[str, float]] = {}
    for label in sorted(set(generated) & set(references)):
        count = min(len(generated[label]), len(references[label]))
        if count >= LEAST:
            ours, real = (torch.as_tensor(side[label][:count, : points or None]) for side in (generated, references))
            scores[label] = compare_sets(ours, real, earth_mover if points else chamfer)
    return scores
