"""Sampling descriptions of furniture with a compact model."""

from __future__ import annotations

import torch
from torch import Tensor

from echomodel.compact.model import CompactModel
from echomodel.compact.pairs import pairs_of
from echomodel.compact.predictors import agreeing
from echomodel.config import Sampler
from echomodel.graph import GraphBatch
from echomodel.progress import StepListener
from echomodel.samplers import Predict, guided, sample
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
    *,
    generator: torch.Generator,
    steps: int | None = None,
    sampler: Sampler | None = None,
    known: Tensor | None = None,
    known_mask: Tensor | None = None,
    guidance: float = 1.0,
    bare_latent: Tensor | None = None,
    progress: StepListener | None = None,
) -> Tensor:
    """Descriptions (N, D) of all pieces of S scenes.

    Arguments:
        graph: S scenes, N nodes. size: (N, 3) float32, metres.
        latent: (N, latent width), of the graph; `bare_latent` of the graph without relations, for `guidance`.
        equal: (N,) int64, number of each piece's group in [0, N); a group agrees on one description.
        noise: (N, D) starting noise.
        known, known_mask: (N, D) and (N,) bool; where true the description is given and comes back unchanged.
        guidance: scale of classifier-free guidance towards the relations, 1 = off.
        generator, steps, sampler, progress: as for `EchoModel.sample_layout`.
    """
    settings = model.config.furniture
    predict = furniture_predictor(model, graph, size, latent)
    if guidance != 1.0 and bare_latent is not None:
        bare = graph.with_triplets(graph.triplets[:0])
        predict = guided(predict, furniture_predictor(model, bare, size, bare_latent), guidance)
    return sample(
        sampler or settings.sampler, agreeing(predict, equal), noise, steps or settings.steps, settings.objective,
        known=known, known_mask=known_mask, generator=generator, progress=progress,
    )  # fmt: skip
