"""Layout denoiser: boxes of all objects at once, with an echo in every layer of every step (EchoScene 3.3).

The first layers draft the boxes. The draft is measured as a person would measure a floor plan: gaps to the walls, to
doors and windows, and how each pair stands to one another. The next layers hear that and refine the draft, as often as
the config says.
"""

from __future__ import annotations

import math
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace

import torch
from torch import Tensor, nn

from echomodel.boxes import Boxes, BoxScale
from echomodel.compact.draft import PAIR_FEATURES, WALL_FEATURES, measurable, pair_features, wall_features
from echomodel.compact.learned import WordTable
from echomodel.compact.pairs import Alone, EchoLayer, Pairs, level_features
from echomodel.config import CompactConfig
from echomodel.graph import GraphBatch
from echomodel.samplers import clean_from
from echomodel.surroundings import GRID, OPENING_FEATURES, PLAN, clearances, plan_features, room_features

BOX = 8
WILDEST = 8.0  # at high noise the clean boxes of the `noise` objective may lie anywhere


@dataclass(frozen=True, eq=False)
class LayoutContext:
    """What stays the same over all steps: `nodes` (N, width), pairs, `floor` (N, K, 2) and `openings` (N, O, ROW) in
    metres, and `scale`."""

    nodes: Tensor
    pairs: Pairs
    floor: Tensor
    openings: Tensor
    scale: BoxScale


class LayoutDenoiser(nn.Module):
    """Predicts the objective's target for noisy boxes; each node has its own noise level, 0 = known.

    `config`: its `layout` and what it shares with the other parts.

    Raises ValueError for a negative number of drafts, or fewer layers than drafts and the last prediction need.

    Shapes:
        boxes (N, 8), level (N,) in [0, 1], `LayoutContext` -> (N, 8)
    """

    def __init__(self, config: CompactConfig) -> None:
        super().__init__()
        layout, width = config.layout, config.layout.width
        self.frequencies, self.objective, self.layers = layout.frequencies, layout.objective, layout.layers
        each, rest = divmod(layout.layers, max(layout.drafts, 0) + 1)
        if layout.drafts < 0 or not each:
            raise ValueError(f"layout.layers {layout.layers} are too few for layout.drafts {layout.drafts}")
        self.category = WordTable("categories", config.categories, width)
        self.room_type = WordTable("room_types", config.room_types, width)
        self.rules = nn.Embedding(len(config.rules), width)
        self.floor = nn.Sequential(nn.Linear(6 + GRID**2, width), nn.SiLU(), nn.Linear(width, width))
        self.opening = nn.Sequential(nn.Linear(PLAN, width), nn.SiLU(), nn.Linear(width, width))
        self.tidy = nn.Embedding(2, width)  # the weights that ship knew shaken rooms; the second row is for others
        self.latent = nn.Linear(config.latent.width, width)
        self.box = nn.Linear(BOX * (1 + 2 * layout.frequencies), width)
        self.known = nn.Parameter(torch.randn(width) * 0.02)
        self.level = nn.Sequential(nn.Linear(64, 128), nn.SiLU())
        self.modulation = nn.Linear(128, 2 * width * layout.layers)
        measured = BOX * (1 + 2 * layout.frequencies) + WALL_FEATURES + OPENING_FEATURES
        self.rounds = nn.ModuleList(
            nn.ModuleList(
                EchoLayer(width, 2 * len(config.predicates) + PAIR_FEATURES * (n > 0)) if layout.echo else Alone(width)
                for _ in range(layers)
            )
            for n, layers in enumerate([each + rest] + [each] * layout.drafts)
        )
        self.measured = nn.ModuleList(nn.Linear(measured, width) for _ in range(layout.drafts))
        self.norms = nn.ModuleList(nn.LayerNorm(width) for _ in self.rounds)
        self.heads = nn.ModuleList(nn.Linear(width, BOX) for _ in self.rounds)
        for table in (self.category, self.room_type, self.rules):
            nn.init.normal_(table.weight, std=0.3)
        nn.init.zeros_(self.tidy.weight)
        for layer in (self.modulation, self.opening[-1], *self.heads):  # type: ignore[assignment]
            nn.init.zeros_(layer.weight)
            nn.init.zeros_(layer.bias)

    def context(self, graph: GraphBatch, pairs: Pairs, latent: Tensor, rules: Tensor, scale: BoxScale) -> LayoutContext:
        """Everything that does not depend on the step.

        Arguments:
            graph: S scenes with N nodes.
            pairs: the merged relations of the graph.
            latent: (N, latent width), output of the graph manipulator.
            rules: (S,) int64, which of the config's rule sets the relations are meant in.
            scale: what the boxes' numbers stand for, node by node.
        """
        room = self.room_type(graph.room_type) + self.rules(rules) + self.floor(plan_features(graph.floor))
        openings, there = room_features(graph.openings)
        room = room + self.tidy.weight[1]
        room = room + (self.opening(openings) * there[..., None]).sum(1)
        nodes = self.category(graph.category) + self.latent(latent) + room[graph.scene]
        return LayoutContext(nodes, pairs, graph.floor[graph.scene], graph.openings[graph.scene], scale)

    def forward(self, boxes: Tensor, level: Tensor, context: LayoutContext) -> Tensor:
        return self.drafts(boxes, level, context)[-1]

    def drafts(self, boxes: Tensor, level: Tensor, context: LayoutContext) -> list[Tensor]:
        """The drafts of the prediction, (N, 8) each, and the prediction, the last of them."""
        known = (level == 0).to(boxes.dtype)[:, None]
        with exactly(boxes):
            x = context.nodes + self.box(box_features(boxes, self.frequencies)) + known * self.known
        modulations = iter(self.modulation(self.level(level_features(level))).chunk(self.layers, dim=1))
        pairs, out = context.pairs, [torch.zeros_like(boxes)]
        for number, layers in enumerate(self.rounds):
            if number:
                draft = clean_from(out[-1].detach(), boxes, level, self.objective).clamp(-WILDEST, WILDEST)
                with exactly(boxes):
                    features, pairs = self._measure(draft, context)
                    x = x + self.measured[number - 1](features)
            for layer in layers:  # type: ignore[attr-defined]
                x = layer(x, pairs, next(modulations))
            with exactly(boxes):
                out.append(out[-1] + self.heads[number](self.norms[number](x)))
        return out[1:]

    def _measure(self, clean: Tensor, context: LayoutContext) -> tuple[Tensor, Pairs]:
        """What the nodes (N, F) and the pairs are told about a draft of the boxes."""
        boxes = measurable(Boxes.decode(clean, context.scale))
        walls, openings = wall_features(boxes, context.floor), clearances(boxes, context.openings)
        features = torch.cat([box_features(clean, self.frequencies), walls, openings], dim=1)
        told = torch.cat([context.pairs.told, pair_features(boxes, context.pairs)], dim=1)
        return features, replace(context.pairs, told=told)


def exactly(x: Tensor) -> AbstractContextManager[None]:
    """Numbers that stand for centimetres are not rounded where the rest is computed in bfloat16."""
    device = x.device.type
    return torch.autocast(device, enabled=False) if torch.amp.is_autocast_available(device) else nullcontext()


def box_features(boxes: Tensor, frequencies: int) -> Tensor:
    """The box and the sines and cosines of its numbers at doubling frequencies: (N, 8) -> (N, 8 (1 + 2 F))."""
    scales = math.pi / 4 * 2.0 ** torch.arange(frequencies, device=boxes.device, dtype=boxes.dtype)
    angles = (boxes[:, :, None] * scales).flatten(1)
    return torch.cat([boxes, torch.sin(angles), torch.cos(angles)], dim=1)
