"""How whole a generated shape is: of several draws the most whole is kept."""

from __future__ import annotations

import numpy as np
import torch
from scipy import ndimage
from torch import Tensor

FILLED = 60  # voxels that a shape spans on every axis of its box-normalised grid


def wholeness(grids: Tensor) -> Tensor:
    """Share of a shape's volume in its largest piece times the shares of its box's sides that it spans.

    Arguments:
        grids: (N, 64, 64, 64) float signed distances, negative inside.

    Returns:
        (N,) float32 in [0, 1]: 1 for one piece that fills its box, 0 for an empty grid.
    """
    return torch.tensor([_whole(grid.cpu().numpy() < 0) for grid in grids], dtype=torch.float32, device=grids.device)


def _whole(inside: np.ndarray) -> float:
    parts, count = ndimage.label(inside)
    if not count:
        return 0.0
    volume = np.bincount(parts.ravel())[1:]
    spans = 1.0
    for axis in range(3):
        used = np.flatnonzero(inside.any(axis=tuple(other for other in range(3) if other != axis)))
        spans *= min((used[-1] - used[0] + 1) / FILLED, 1.0)
    return float(volume.max() / volume.sum() * spans)


def group_means(values: Tensor, groups: Tensor) -> Tensor:
    """Each value (N, ...) replaced by the mean of its group; groups (N,) int64 in [0, N)."""
    total = torch.zeros_like(values).index_add(0, groups, values)
    count = torch.zeros_like(values).index_add(0, groups, torch.ones_like(values))
    return (total / count.clamp_min(1))[groups]
