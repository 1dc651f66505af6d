"""How whole a generated shape is, and whether it bears what stands on it: of several draws the best is kept."""

from __future__ import annotations

import numpy as np
import torch
from scipy import ndimage
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.vocabulary import vocabulary

FILLED = 60  # voxels that a shape spans on every axis of its box-normalised grid
TOP = 58  # voxel from which on a column counts as reaching the top of the box
PLAY = 0.1  # metres between the bottom of one and the top of the other


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


def bearing(grids: Tensor, boxes: Boxes, triplets: Tensor) -> Tensor:
    """How much of the ground under what stands on each shape is really there, at the top of its box.

    A desk with a shelf at its back fills its box as well as a plain one, but a lamp in its middle would float.

    Arguments:
        grids: (N, 64, 64, 64) float signed distances, negative inside.
        boxes: N boxes.
        triplets: (E, 3) int64; `standing_on` with the subject at the object's top counts.

    Returns:
        (N,) float32 in [0, 1]; 1 for whatever bears nothing.
    """
    out = torch.ones(len(grids), device=grids.device)
    high = (grids[:, :, TOP:] < 0).any(2)  # (N, x, z): columns that reach the top
    resting = [predicate.id for predicate in vocabulary().predicates if predicate.rests]
    for above, _, below in triplets[torch.isin(triplets[:, 1], triplets.new_tensor(resting))].tolist():
        gap = boxes.position[above, 1] - boxes.position[below, 1] - boxes.size[below, 1]
        if above == below or abs(float(gap)) > PLAY:
            continue
        x, z = (boxes.position[above] - boxes.position[below])[[0, 2]].tolist()
        sin, cos = float(boxes.yaw[below].sin()), float(boxes.yaw[below].cos())
        place = np.array([cos * x - sin * z, sin * x + cos * z])
        extent = boxes.size[below][[0, 2]].cpu().numpy()
        foot = float(boxes.size[above][[0, 2]].min()) / 4
        first = np.round((place - foot) / extent * FILLED + 31.5).clip(2, 61).astype(int)
        last = np.round((place + foot) / extent * FILLED + 31.5).clip(2, 61).astype(int)
        ground = high[below, first[0] : last[0] + 1, first[1] : last[1] + 1]
        out[below] = torch.minimum(out[below], ground.float().mean())
    return out


def merit(grids: Tensor, boxes: Boxes, triplets: Tensor) -> Tensor:
    """What draws are chosen by: (N,), whole shapes that bear what stands on them first."""
    return wholeness(grids) * (0.1 + 0.9 * bearing(grids, boxes, triplets))


def group_means(values: Tensor, groups: Tensor) -> Tensor:
    """Each value (N, ...) replaced by the mean of its group; groups (N,) int64 in [0, N)."""
    total = torch.zeros_like(values).index_add(0, groups, values)
    count = torch.zeros_like(values).index_add(0, groups, torch.ones_like(values))
    return (total / count.clamp_min(1))[groups]
