"""Sets of shapes beside each other: MMD, COV and 1-NNA by Chamfer and earth mover's distance (EchoScene, table 3)."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor


def chamfer_matrix(first: Tensor, second: Tensor, chunk: int = 16) -> Tensor:
    """Chamfer distances between point sets: mean squared distance to the nearest point, summed over both directions.

    Arguments:
        first: (A, P, 3) float32. second: (B, Q, 3) float32. chunk: sets of `second` compared at a time.

    Returns:
        (A, B) float32.

    Raises:
        ValueError: not two non-empty lists of point sets, or a point is not finite.
    """
    _check(first, second)
    rows = []
    for one in first:
        parts = []
        for others in second.split(chunk):
            # by differences: exact zeros for equal points, which the expanded square does not give
            squares = torch.cdist(one[None], others, compute_mode="donot_use_mm_for_euclid_dist").square()
            parts.append(squares.amin(2).mean(1) + squares.amin(1).mean(1))
        rows.append(torch.cat(parts))
    return torch.stack(rows)


def earth_mover_matrix(first: Tensor, second: Tensor) -> Tensor:
    """Earth mover's distances between point sets: mean distance under the best assignment of points to points.

    Arguments:
        first: (A, P, 3), second: (B, P, 3) float32, as many points each.

    Returns:
        (A, B) float32.

    Raises ValueError as `chamfer_matrix`, and for different numbers of points.
    """
    from scipy.optimize import linear_sum_assignment

    _check(first, second)
    if first.shape[1] != second.shape[1]:
        raise ValueError(f"point sets hold {first.shape[1]} and {second.shape[1]} points, expected as many in both")
    rows = []
    for one in first:
        costs = [torch.cdist(one, other).numpy() for other in second]
        rows.append([float(cost[linear_sum_assignment(cost)].mean()) for cost in costs])
    return torch.tensor(rows)


def coverage(sample_to_reference: Tensor) -> dict[str, float]:
    """Minimum matching distance and coverage (Achlioptas et al. 2018).

    Arguments:
        sample_to_reference: (S, R) float32 distances.

    Returns:
        `mmd`: mean over references of the nearest sample; `mmd_smp`: mean over samples of the nearest reference;
        `cov`: references that are nearest to some sample, as a fraction.
    """
    if sample_to_reference.ndim != 2 or not sample_to_reference.numel():
        raise ValueError(f"distance matrix is {tuple(sample_to_reference.shape)}, expected (samples, references)")
    nearest, index = sample_to_reference.min(1)
    return {
        "mmd": float(sample_to_reference.amin(0).mean()),
        "mmd_smp": float(nearest.mean()),
        "cov": len(index.unique()) / sample_to_reference.shape[1],
    }


def one_nearest_neighbour(within_first: Tensor, between: Tensor, within_second: Tensor) -> dict[str, float]:
    """Accuracy of a leave-one-out nearest neighbour in telling two sets apart; 0.5 is best (Lopez-Paz et al. 2017).

    Arguments:
        within_first: (A, A), between: (A, B), within_second: (B, B) float32 distances.

    Returns:
        `acc` over both sets, `acc_t` over the first, `acc_f` over the second.
    """
    a, b = between.shape
    if tuple(within_first.shape) != (a, a) or tuple(within_second.shape) != (b, b) or not (a and b):
        raise ValueError(
            f"distance matrices are {tuple(within_first.shape)}, {tuple(between.shape)}, {tuple(within_second.shape)}, "
            "expected (A, A), (A, B), (B, B)"
        )
    matrix = torch.cat([torch.cat([within_first, between], 1), torch.cat([between.t(), within_second], 1)])
    matrix = matrix + torch.diag(torch.full((a + b,), torch.inf))
    label = torch.cat([torch.ones(a), torch.zeros(b)])
    right = (label[matrix.argmin(1)] == label).float()
    return {"acc": float(right.mean()), "acc_t": float(right[:a].mean()), "acc_f": float(right[a:].mean())}


def compare_sets(
    samples: Tensor, references: Tensor, matrix: Callable[[Tensor, Tensor], Tensor] = chamfer_matrix
) -> dict[str, float]:
    """All of the above for two lists of point sets, samples (S, P, 3) and references (R, P, 3) float32.

    And `variety`: mean distance of two samples.
    """
    between = matrix(samples, references)
    within = matrix(references, references), matrix(samples, samples)
    variety = float(within[1].sum() / max(len(samples) * (len(samples) - 1), 1))
    return coverage(between) | one_nearest_neighbour(within[0], between.t(), within[1]) | {"variety": variety}


def _check(first: Tensor, second: Tensor) -> None:
    for name, sets in (("first", first), ("second", second)):
        if sets.ndim != 3 or sets.shape[2] != 3 or not sets.numel():
            raise ValueError(f"{name} point sets are {tuple(sets.shape)}, expected (sets, points, 3), none of them 0")
        if not bool(torch.isfinite(sets).all()):
            raise ValueError(f"{name} point sets hold a coordinate that is not finite")
