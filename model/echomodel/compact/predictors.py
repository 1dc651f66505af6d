"""What the samplers call: the clean sample that a denoiser sees in a noisy one."""

from __future__ import annotations

import torch
from torch import Tensor

from echomodel.compact.model import CompactModel
from echomodel.compact.pairs import Pairs
from echomodel.compact.wholeness import group_means
from echomodel.graph import GraphBatch
from echomodel.objectives import clean_from
from echomodel.samplers import Predict


def layout_predictor(model: CompactModel, graph: GraphBatch, pairs: Pairs, latent: Tensor, rules: Tensor) -> Predict:
    """Clean boxes (N, 8) of tidy rooms in noisy ones; arguments as for `LayoutDenoiser.context`."""
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
