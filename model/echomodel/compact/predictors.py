"""What the samplers call: the clean sample that a denoiser sees in a noisy one."""

from __future__ import annotations

from torch import Tensor

from echomodel.compact.model import CompactModel
from echomodel.compact.pairs import Pairs
from echomodel.graph import GraphBatch
from echomodel.objectives import clean_from
from echomodel.samplers import Predict


def layout_predictor(model: CompactModel, graph: GraphBatch, pairs: Pairs, latent: Tensor, rules: Tensor) -> Predict:
    """Clean boxes (N, 8) in noisy ones; arguments as for `LayoutDenoiser.context`."""
    context = model.layout.context(graph, pairs, latent, rules)

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
