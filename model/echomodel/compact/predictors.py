"""What the samplers call: the clean sample that a denoiser sees in a noisy one."""

from __future__ import annotations

import numpy as np
import torch
from scipy import ndimage
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.compact.model import CompactModel
from echomodel.compact.pairs import Pairs
from echomodel.graph import GraphBatch
from echomodel.objectives import clean_from
from echomodel.samplers import Predict
from echomodel.vocabulary import vocabulary


def layout_predictor(model: CompactModel, graph: GraphBatch, pairs: Pairs, latent: Tensor, rules: Tensor) -> Predict:
    """Clean boxes (N, 8) in noisy ones; arguments as for `LayoutDenoiser.context`."""
    context = model.layout.context(graph, pairs, latent, rules, model.scale(graph.category))

    def predict(x: Tensor, level: Tensor) -> Tensor:
        return clean_from(model.layout(x, level, context), x, level, model.config.layout.objective)

    return predict


def shape_predictor(model: CompactModel, graph: GraphBatch, size: Tensor, pairs: Pairs, latent: Tensor) -> Predict:
    """Clean codes (N, K) in noisy ones; arguments as for `ShapeDenoiser.context`."""
    context = model.shape.context(graph, size, pairs, latent)
    settings = model.config.shape

    def predict(x: Tensor, level: Tensor) -> Tensor:
        output = model.shape(x, level, context)
        return output if settings.prediction == "sample" else clean_from(output, x, level, settings.objective)

    return predict


def agreeing(predict: Predict, groups: Tensor) -> Predict:
    """Clean codes on which each group agrees, their mean, so that equal furniture stays equal from the first step on.

    Arguments:
        predict: the denoiser's clean sample (N, K).
        groups: (N,) int64, number of each node's group in [0, N). Known nodes (level 0) speak for their whole group.
    """
    alone = bool((groups == torch.arange(len(groups), device=groups.device)).all())

    def agreed(x: Tensor, level: Tensor) -> Tensor:
        clean = predict(x, level)
        weight = torch.where(level == 0, 1.0, 1e-6).to(clean)[:, None]
        return group_means(clean * weight, groups) / group_means(weight, groups)

    return predict if alone else agreed


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
