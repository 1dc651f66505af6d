"""Layout denoiser: boxes of all objects at once, with an echo in every layer of every step (EchoScene 3.3).

The first layers draft the boxes. The draft is measured as a person would measure a floor plan: gaps to the walls, to
doors and windows, and how each pair stands to one another. The next layers hear that and refine the draft, as often as
the config says. Where they hear the room, too, it is each wall, door, passage and window from where a node stands now.
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
from echomodel.floors import (
    GRID,
    OPENING_FEATURES,
    PLAN,
    clearances,
    edges,
    known,
    plan_features,
    room_features,
    signed_area,
)
from echomodel.graph import GraphBatch
from echomodel.samplers import clean_from

SCALES = (3.0, 0.4, 0.08)  # metres at which a gap is told
SIDE = 10  # start and end (x, z), inward normal (x, z), depth that stays free, sill, top, kind
WALL, DOOR, WINDOW = 0.0, 1.0, 2.0  # kinds of sides
SIDE_FEATURES = 4 * len(SCALES) + 15


class RoomEcho(nn.Module):
    """An echo of the room: x_i <- x_i + W / sqrt(m_i) * sum_k silu(A x_i + P f_ik) over the m_i sides of i's room.

    It begins at zero, so that weights that know no sides stay what they are until it is trained.

    `width`: channels of a node.

    Shapes:
        x (N, width), features (N, M, SIDE_FEATURES), there (N, M) -> (N, width)
    """

    def __init__(self, width: int) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(width)
        self.node = nn.Linear(width, width)
        self.told = nn.Linear(SIDE_FEATURES, width, bias=False)
        self.message = nn.Linear(width, width)
        nn.init.normal_(self.told.weight, std=0.3)
        nn.init.zeros_(self.message.weight)
        nn.init.zeros_(self.message.bias)

    def forward(self, x: Tensor, features: Tensor, there: Tensor) -> Tensor:
        heard = nn.functional.silu(self.node(self.norm(x))[:, None] + self.told(features))
        return x + self.message((heard * there[..., None]).sum(1) * there.sum(1, keepdim=True).clamp_min(1).rsqrt())


def sides_of(floor: Tensor, openings: Tensor) -> Tensor:
    """The walls and openings of rooms: floor (S, K, 2), openings (S, O, ROW) in metres -> (S, M, SIDE), NaN = none."""
    start, end = edges(floor)
    along = end - start
    length = along.norm(dim=-1, keepdim=True)
    inward = torch.stack([-along[..., 1], along[..., 0]], -1) / length.clamp_min(1e-6)
    inward = inward * torch.where(signed_area(floor) < 0, -1.0, 1.0)[:, None, None]
    walls = torch.cat([start, end, inward, torch.zeros_like(length).expand(-1, -1, 4)], -1)
    there = (length > 1e-3) & known(floor)[:, None, None]
    kinds = torch.where(openings[..., 9:] > 0.5, WINDOW, DOOR)
    return torch.cat([torch.where(there, walls, torch.nan), torch.cat([openings[..., :9], kinds], -1)], 1)


def side_features(boxes: Boxes, sides: Tensor) -> tuple[Tensor, Tensor]:
    """Every side as each node finds it: in the side's own frame, so that it is alike at all walls, and by the compass.

    Told are the gap between the box and the side's line, and the way to both of its ends along it, and to its nearest
    point; where that lies in the room; how the box is turned to it; how long, deep and high it is.

    Arguments:
        boxes: N boxes. sides: (N, M, SIDE), those of the room of each, NaN = none.

    Returns (N, M, SIDE_FEATURES) and (N, M) float32, 1 for those that are there; the others are zero.
    """
    there = torch.isfinite(sides[..., 0])
    sides = torch.where(there[..., None], sides, 0.0)
    start, end, inward = sides[..., 0:2], sides[..., 2:4], sides[..., 4:6]
    along = torch.stack([inward[..., 1], -inward[..., 0]], -1)
    one, other = ((point * along).sum(-1) for point in (start, end))
    place = boxes.position[:, None, [0, 2]]
    sin, cos = boxes.yaw.sin()[:, None], boxes.yaw.cos()[:, None]
    front = torch.stack([sin * inward[..., 0] + cos * inward[..., 1], sin * along[..., 0] + cos * along[..., 1]], -1)
    half = boxes.size[:, None, [0, 2]] / 2
    reach_in = front[..., 1].abs() * half[..., 0] + front[..., 0].abs() * half[..., 1]
    reach_along = front[..., 0].abs() * half[..., 0] + front[..., 1].abs() * half[..., 1]
    at = (place * along).sum(-1)
    gap = ((place - start) * inward).sum(-1) - reach_in
    first = at - torch.minimum(one, other) - reach_along
    last = torch.maximum(one, other) - at - reach_along
    run = end - start
    length = run.square().sum(-1)
    share = (((place - start) * run).sum(-1) / length.clamp_min(1e-6)).clamp(0, 1)
    way = start + share[..., None] * run - place
    gaps = torch.stack([gap, first, last, (way.square().sum(-1) + 1e-9).sqrt()], -1)
    under = sides[..., 7] - (boxes.position[:, 1] + boxes.size[:, 1])[:, None]
    kind = sides[..., 9:]
    told = [torch.tanh(gaps / scale) for scale in SCALES] + [torch.tanh(way / scale) for scale in SCALES[:2]]
    told += [inward, front, length.clamp_min(1e-9).sqrt()[..., None] / 3, sides[..., 6:9]]
    told += [torch.tanh(under / SCALES[1])[..., None], (kind == DOOR).to(gaps), (kind == WINDOW).to(gaps)]
    return torch.cat(told, -1) * there[..., None], there.to(gaps)


BOX = 8
WILDEST = 8.0  # at high noise the clean boxes of the `noise` objective may lie anywhere


@dataclass(frozen=True, eq=False)
class LayoutContext:
    """What stays the same over all steps: `nodes` (N, width), pairs, `floor` (N, K, 2) and `openings` (N, O, ROW) in
    metres, `scale`, and `sides` (N, M, SIDE) where the network hears them."""

    nodes: Tensor
    pairs: Pairs
    floor: Tensor
    openings: Tensor
    scale: BoxScale
    sides: Tensor | None = None


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
        self.room = nn.ModuleList(RoomEcho(width) for _ in self.rounds) if layout.sides else None
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
        sides = None if self.room is None else sides_of(graph.floor, graph.openings)[graph.scene]
        return LayoutContext(nodes, pairs, graph.floor[graph.scene], graph.openings[graph.scene], scale, sides)

    def forward(self, boxes: Tensor, level: Tensor, context: LayoutContext) -> Tensor:
        return self.drafts(boxes, level, context)[-1]

    def drafts(self, boxes: Tensor, level: Tensor, context: LayoutContext) -> list[Tensor]:
        """The drafts of the prediction, (N, 8) each, and the prediction, the last of them."""
        known = (level == 0).to(boxes.dtype)[:, None]
        with exactly(boxes):
            x = context.nodes + self.box(box_features(boxes, self.frequencies)) + known * self.known
        modulations = iter(self.modulation(self.level(level_features(level))).chunk(self.layers, dim=1))
        pairs, out, draft = context.pairs, [torch.zeros_like(boxes)], boxes
        for number, layers in enumerate(self.rounds):
            if number:
                draft = clean_from(out[-1].detach(), boxes, level, self.objective).clamp(-WILDEST, WILDEST)
                with exactly(boxes):
                    features, pairs = self._measure(draft, context)
                    x = x + self.measured[number - 1](features)
            if self.room is not None and context.sides is not None:
                with exactly(boxes):
                    heard = side_features(measurable(Boxes.decode(draft, context.scale)), context.sides)
                x = self.room[number](x, *heard)
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
