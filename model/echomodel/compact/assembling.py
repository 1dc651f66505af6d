"""Sampling the part tokens of furniture with a compact model that has the token branch."""

from __future__ import annotations

import torch
from torch import Tensor

from echomodel.compact.given import Sampling
from echomodel.compact.model import CompactModel
from echomodel.compact.pairs import pairs_of
from echomodel.graph import GraphBatch
from echomodel.randomness import normal


@torch.no_grad()
def sample_tokens(
    model: CompactModel, graph: GraphBatch, size: Tensor, equal: Tensor, generator: torch.Generator, how: Sampling
) -> list[Tensor]:
    """Tokens (T_i, D) of the N pieces of S scenes: first how many each has, then what they are.

    Arguments:
        graph: N nodes, told who is of one style. size: (N, 3) float32, metres.
        equal: (N,) int64, number of each piece's group in [0, N); a group has one count and one noise.
        how: to sample; known pieces are not supported.
    """
    settings, network = model.config.tokens, model.tokens
    pairs = pairs_of(graph, model.config.predicates)
    latent = model.latent(graph.category, pairs)
    odds = torch.softmax(network.counts(network.nodes(graph, size, latent)), dim=1)
    count = (torch.multinomial(odds, 1, generator=generator)[:, 0] + 1)[equal]
    context = network.context(graph, size, pairs, latent, count)
    most, width = context.mask.shape[1], network.values
    noise = settings.temperature * normal((graph.num_nodes, most, width), generator, size.device)[equal]

    def predict(x: Tensor, level: Tensor) -> Tensor:
        return network(x, level, context)

    found = how.denoised(predict, noise, settings)
    return [tokens[:many] for tokens, many in zip(found, count.tolist(), strict=True)]
