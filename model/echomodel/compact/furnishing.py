"""Sampling descriptions of furniture with a compact model."""

from __future__ import annotations

import torch
from torch import Tensor

from echomodel.compact.given import CompactSampling
from echomodel.compact.model import CompactModel
from echomodel.compact.pairs import pairs_of
from echomodel.compact.predictors import agreeing
from echomodel.graph import GraphBatch
from echomodel.vocabulary import vocabulary


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
) -> Tensor:
    """Descriptions (N, D) of all pieces of S scenes.

    Arguments:
        graph: S scenes, N nodes. size: (N, 3) float32, metres.
        latent: (N, latent width), of the graph.
        equal: (N,) int64, number of each piece's group in [0, N); a group agrees on one description.
        noise: (N, D) starting noise. how: to sample.
    """
    context = model.furniture.context(graph, size, pairs_of(graph, model.config.predicates), latent)

    def predict(x: Tensor, level: Tensor) -> Tensor:
        return model.furniture(x, level, context)

    return how.denoised(agreeing(predict, equal), noise, model.config.furniture)
