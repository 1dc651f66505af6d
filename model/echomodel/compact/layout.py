"""Layout denoiser: boxes of all objects at once, with an echo in every layer of every step (EchoScene 3.3)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from echomodel.compact.echo import EchoLayer, level_features
from echomodel.compact.pairs import Pairs
from echomodel.config import CompactConfig
from echomodel.graph import GraphBatch

BOX = 8


@dataclass(frozen=True, eq=False)
class LayoutContext:
    """What stays the same over all steps: `nodes` (N, width), pairs."""

    nodes: Tensor
    pairs: Pairs


class LayoutDenoiser(nn.Module):
    """Predicts the objective's target for noisy boxes; each node has its own noise level, 0 = known.

    Shapes:
        boxes (N, 8), level (N,) in [0, 1], `LayoutContext` -> (N, 8)
    """

    def __init__(self, config: CompactConfig) -> None:
        super().__init__()
        layout, width = config.layout, config.layout.width
        self.frequencies = layout.frequencies
        self.category = nn.Embedding(config.categories, width)
        self.room_type = nn.Embedding(config.room_types, width)
        self.rules = nn.Embedding(len(config.rules), width)
        self.floor = nn.Sequential(nn.Linear(6, width), nn.SiLU(), nn.Linear(width, width))
        self.latent = nn.Linear(config.latent.width, width)
        self.box = nn.Linear(BOX * (1 + 2 * layout.frequencies), width)
        self.known = nn.Parameter(torch.randn(width) * 0.02)
        self.level = nn.Sequential(nn.Linear(64, 128), nn.SiLU())
        self.modulation = nn.Linear(128, 2 * width * layout.layers)
        self.layers = nn.ModuleList(EchoLayer(width, config.predicates) for _ in range(layout.layers))
        self.norm = nn.LayerNorm(width)
        self.head = nn.Linear(width, BOX)
        for table in (self.category, self.room_type, self.rules):
            nn.init.normal_(table.weight, std=0.3)
        for layer in (self.modulation, self.head):
            nn.init.zeros_(layer.weight)
            nn.init.zeros_(layer.bias)

    def context(self, graph: GraphBatch, pairs: Pairs, latent: Tensor, rules: Tensor) -> LayoutContext:
        """Everything that does not depend on the step.

        Arguments:
            graph: S scenes with N nodes.
            pairs: the merged relations of the graph.
            latent: (N, latent width), output of the graph manipulator.
            rules: (S,) int64, which of the config's rule sets the relations are meant in.
        """
        room = self.room_type(graph.room_type) + self.rules(rules) + self.floor(floor_features(graph.floor))
        return LayoutContext(self.category(graph.category) + self.latent(latent) + room[graph.scene], pairs)

    def forward(self, boxes: Tensor, level: Tensor, context: LayoutContext) -> Tensor:
        known = (level == 0).to(boxes.dtype)[:, None]
        x = context.nodes + self.box(box_features(boxes, self.frequencies)) + known * self.known
        modulations = self.modulation(self.level(level_features(level))).chunk(len(self.layers), dim=1)
        for layer, modulation in zip(self.layers, modulations, strict=True):
            x = layer(x, context.pairs, modulation)
        return self.head(self.norm(x))


def box_features(boxes: Tensor, frequencies: int) -> Tensor:
    """The box and the sines and cosines of its numbers at doubling frequencies: (N, 8) -> (N, 8 (1 + 2 F))."""
    scales = math.pi / 4 * 2.0 ** torch.arange(frequencies, device=boxes.device, dtype=boxes.dtype)
    angles = (boxes[:, :, None] * scales).flatten(1)
    return torch.cat([boxes, torch.sin(angles), torch.cos(angles)], dim=1)


def floor_features(floor: Tensor) -> Tensor:
    """Extents in metres, their logarithms and whether they are known: (S, 2) with NaN -> (S, 6)."""
    known = torch.isfinite(floor)
    extent = torch.where(known, floor, torch.ones_like(floor))
    return torch.cat([extent / 5 * known, extent.log() * known, known.to(floor.dtype)], dim=1)
