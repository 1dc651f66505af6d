"""Furniture denoiser: descriptions of all pieces of a scene at once; at every step each hears the others (3.4).

A description (`echomodel.furniture.style`) has the same places in all classes, so what a chair hears of its
table it can say of itself: legs, edges, fronts, how soft, how slender.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from echomodel.compact.learned import WordTable
from echomodel.compact.pairs import Alone, EchoLayer, Pairs, level_features
from echomodel.config import CompactConfig
from echomodel.graph import GraphBatch


@dataclass(frozen=True, eq=False)
class FurnitureContext:
    """What stays the same over all steps: `nodes` (N, width) and pairs."""

    nodes: Tensor
    pairs: Pairs


class FurnitureDenoiser(nn.Module):
    """Says the clean description of every object in a noisy one; each has its own level, 0 = known.

    Kinds are said as the probabilities of their words, so that the mean of what fits is a mixture and no third thing.

    Shapes:
        descriptions (N, D), level (N,) in [0, 1], `FurnitureContext` -> (N, D)
    """

    def __init__(self, config: CompactConfig) -> None:
        own, width = config.furniture, config.furniture.width
        super().__init__()
        self.kinds, self.numbers = own.kinds, own.numbers
        self.values = sum(own.kinds) + own.numbers
        self.category = WordTable("categories", config.categories, width)
        self.room_type = WordTable("room_types", config.room_types, width)
        self.size = nn.Sequential(nn.Linear(3, width), nn.SiLU(), nn.Linear(width, width))
        self.latent = nn.Linear(config.latent.width, width)
        self.own = nn.Linear(self.values, width)
        self.level = nn.Sequential(nn.Linear(64, 128), nn.SiLU())
        self.modulation = nn.Linear(128, 2 * width * own.layers)
        told = 2 * len(config.predicates)
        self.trust = nn.Sequential(nn.Linear(told, 32), nn.SiLU(), nn.Linear(32, own.voices)) if own.echo else None
        self.heard = nn.Linear(own.voices * (self.values + 1), width) if own.echo else None
        self.layers = nn.ModuleList(
            (EchoLayer(width, told) if own.echo else Alone(width)) for _ in range(own.layers)
        )  # fmt: skip
        self.norm = nn.LayerNorm(width)
        self.head = nn.Linear(width, self.values)
        for table in (self.category, self.room_type):
            nn.init.normal_(table.weight, std=0.3)
        for layer in (self.modulation, self.head):
            nn.init.zeros_(layer.weight)
            nn.init.zeros_(layer.bias)

    def context(self, graph: GraphBatch, size: Tensor, pairs: Pairs, latent: Tensor) -> FurnitureContext:
        """Everything that does not depend on the step; arguments as for `ShapeDenoiser.context`."""
        nodes = self.category(graph.category) + self.size(size.clamp_min(0.01).log()) + self.latent(latent)
        return FurnitureContext(nodes + self.room_type(graph.room_type)[graph.scene], pairs)

    def forward(self, x: Tensor, level: Tensor, context: FurnitureContext) -> Tensor:
        return self.clean(self.scores(x, level, context))

    def clean(self, scores: Tensor) -> Tensor:
        """(..., D) that scores (..., D) stand for: each word's probability on [-1, 1], numbers cut."""
        *words, numbers = scores.split([*self.kinds, self.numbers], dim=-1)
        said = [2 * torch.softmax(part, dim=-1) - 1 for part in words]
        return torch.cat([*said, numbers.clamp(-1.0, 1.0)], dim=-1)

    def scores(self, x: Tensor, level: Tensor, context: FurnitureContext) -> Tensor:
        """Logarithms of the words' odds, and the numbers as they are: (N, D)."""
        h = context.nodes + self.own(x)
        if self.heard is not None:
            h = h + self.heard(self._voices(x, level, context.pairs))
        modulations = self.modulation(self.level(level_features(level))).chunk(len(self.layers), dim=1)
        for layer, modulation in zip(self.layers, modulations, strict=True):
            h = layer(h, context.pairs, modulation)
        return self.head(self.norm(h))

    def _voices(self, x: Tensor, level: Tensor, pairs: Pairs) -> Tensor:
        """Means of the others' descriptions, weighted by what is told of the pair and by how clear they are.

        Shapes:
            x (N, D), level (N,) -> (N, voices * (D + 1)), the last number of each voice its weight
        """
        assert self.trust is not None
        clear = torch.log1p(2 * (1 - level) / (level + 0.05))  # 0 for pure noise, 3.7 for a known piece
        weight = torch.sigmoid(self.trust(pairs.told)) * clear[pairs.sender, None]
        total = torch.zeros(len(x), weight.shape[1], device=x.device, dtype=weight.dtype)
        total = total.index_add(0, pairs.receiver, weight)
        out = []
        for voice in range(weight.shape[1]):
            spoken = torch.zeros_like(x).index_add(
                0, pairs.receiver, weight[:, voice, None] * x.index_select(0, pairs.sender)
            )
            out += [spoken / (total[:, voice, None] + 0.05), torch.tanh(total[:, voice, None])]
        return torch.cat(out, dim=1)
