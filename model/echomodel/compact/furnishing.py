"""Sampling descriptions of furniture with a compact model."""

from __future__ import annotations

import torch
from torch import Tensor

from echomodel.compact.given import CompactSampling
from echomodel.compact.model import CompactModel
from echomodel.compact.pairs import pairs_of
from echomodel.compact.predictors import agreeing
from echomodel.graph import GraphBatch
from echomodel.samplers import Predict, guided
from echomodel.vocabulary import vocabulary


def furniture_predictor(model: CompactModel, graph: GraphBatch, size: Tensor, latent: Tensor) -> Predict:
    """Clean descriptions (N, D) in noisy ones; arguments as for `FurnitureDenoiser.context`."""
    context = model.furniture.context(graph, size, pairs_of(graph, model.config.predicates), latent)

    def predict(x: Tensor, level: Tensor) -> Tensor:
        return model.furniture(x, level, context)

    return predict


def with_whole_styles(graph: GraphBatch, groups: Tensor) -> GraphBatch:
    """The graph with every two nodes of one group told to be of one style: who is like my like is like me.

    Arguments:
        groups: (N,) int64, number of each node's style group in [0, N).
    """
    alike = (groups[:, None] == groups) & (graph.scene[:, None] == graph.scene)
    subject, target = (alike & ~torch.eye(len(groups), dtype=torch.bool, device=groups.device)).nonzero(as_tuple=True)
    told = torch.stack([subject, torch.full_like(subject, vocabulary().predicate_id("same_style_as")), target], dim=1)
    return graph.with_triplets(torch.cat([graph.triplets, told]).unique(dim=0))


@torch.no_grad()
def sample_descriptions(
    model: CompactModel,
    graph: GraphBatch,
    size: Tensor,
    latent: Tensor,
    equal: Tensor,
    noise: Tensor,
    how: CompactSampling,
    bare_latent: Tensor | None = None,
) -> Tensor:
    """Descriptions (N, D) of all pieces of S scenes.

    Arguments:
        graph: S scenes, N nodes. size: (N, 3) float32, metres.
        latent: (N, latent width), of the graph; `bare_latent` of the graph without relations, for `guidance`.
        equal: (N,) int64, number of each piece's group in [0, N); a group agrees on one description.
        noise: (N, D) starting noise. how: to sample.
    """
    predict = furniture_predictor(model, graph, size, latent)
    if how.guidance != 1.0 and bare_latent is not None:
        bare = graph.with_triplets(graph.triplets[:0])
        predict = guided(predict, furniture_predictor(model, bare, size, bare_latent), how.guidance)
    return how.denoised(agreeing(predict, equal), noise, model.config.furniture)
