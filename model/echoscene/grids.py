"""Our grids of signed distances in the published frame and unit, and back (SPEC: section 10)."""

from __future__ import annotations

import torch
from torch import Tensor

DISTANCE = 4 / 64  # our grids hold distances over 4 voxels, the published ones in sides of the grid
LEVEL = 0.02  # the published iso value of the truncated distance


def published_grids(grids: Tensor, side: int = 64) -> Tensor:
    """Our grids (K, 64, 64, 64) in the published frame, whose +X is an object's front, and unit: (K, 1, R, R, R).

    `side` is R, 64 or a part of it for a smaller autoencoder, whose voxels are means.
    """
    turned = (grids.flip(1).transpose(1, 3) * DISTANCE)[:, None].contiguous()
    return turned if side == grids.shape[1] else torch.nn.functional.avg_pool3d(turned, grids.shape[1] // side)


def turned_back(grids: Tensor) -> Tensor:
    """Published grids (K, 1, R, R, R) in our frame, (K, R, R, R): the point (x, y, z) of theirs is (-z, y, x) in its
    box, a quarter turn."""
    return grids[:, 0].transpose(1, 3).flip(1).contiguous()
