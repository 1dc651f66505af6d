"""Layout denoiser: boxes of all objects at once, with an echo in every layer of every step (EchoScene 3.3).

The first layers draft the boxes. The draft is measured as a person would measure a floor plan: gaps to the walls, to
doors and windows, and how each pair stands to one another. The next layers hear that and refine the draft, as often as
the config says.
"""

from __future__ import annotations

import math
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace

from echomodel.arrays import NUMPY, Array, cast, clipped, held, kit, parted
from echomodel.boxes import Boxes, BoxScale
from echomodel.compact.draft import measurable, pair_features, wall_features
from echomodel.compact.pairs import Layers, Pairs
from echomodel.config import LayoutConfig
from echomodel.graph import GraphBatch
from echomodel.samplers import clean_from
from echomodel.surroundings import clearances, plan_features, room_features

BOX = 8
WILDEST = 8.0  # at high noise the clean boxes of the `noise` objective may lie anywhere


@dataclass(frozen=True, eq=False)
class LayoutContext:
    """What stays the same over all steps: `nodes` (N, width), pairs, `floor` (N, K, 2) and `openings` (N, O, ROW) in
    metres, and `scale`."""

    nodes: Array
    pairs: Pairs
    floor: Array
    openings: Array
    scale: BoxScale


class Layout(Layers):
    """Predicts the objective's target for noisy boxes; each node has its own noise level, 0 = known.

    Shapes:
        boxes (N, 8), level (N,) in [0, 1], `LayoutContext` -> (N, 8)
    """

    settings: LayoutConfig

    def context(self, graph: GraphBatch, pairs: Pairs, latent: Array, rules: Array, scale: BoxScale) -> LayoutContext:
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

    def forward(self, boxes: Array, level: Array, context: LayoutContext) -> Array:
        """The prediction."""
        return self.drafts(boxes, level, context)[-1]

    def drafts(self, boxes: Array, level: Array, context: LayoutContext) -> list[Array]:
        """The drafts of the prediction, (N, 8) each, and the prediction, the last of them."""
        known, settings = cast(level == 0, boxes)[:, None], self.settings
        with exactly(boxes):
            x = context.nodes + self.box(box_features(boxes, settings.frequencies)) + known * self.known
        modulations, pairs = iter(parted(self.modulated(level), settings.layers)), context.pairs
        out = [kit(boxes).zeros_like(boxes)]
        for number, layers in enumerate(self.rounds):
            if number:
                draft = clipped(clean_from(held(out[-1]), boxes, level, settings.objective), -WILDEST, WILDEST)
                with exactly(boxes):
                    features, pairs = self._measure(draft, context)
                    x = x + self.measured[number - 1](features)
            for layer in layers:
                x = layer(x, pairs, next(modulations))
            with exactly(boxes):
                out.append(out[-1] + self.heads[number](self.norms[number](x)))
        return out[1:]

    def _measure(self, clean: Array, context: LayoutContext) -> tuple[Array, Pairs]:
        """What the nodes (N, F) and the pairs are told about a draft of the boxes."""
        boxes = measurable(Boxes.decode(clean, context.scale))
        walls, openings = wall_features(boxes, context.floor), clearances(boxes, context.openings)
        concat = kit(clean).concat
        features = concat([box_features(clean, self.settings.frequencies), walls, openings], 1)
        told = concat([context.pairs.told, pair_features(boxes, context.pairs)], 1)
        return features, replace(context.pairs, told=told)


def exactly(x: Array) -> AbstractContextManager[None]:
    """Numbers that stand for centimetres are not rounded where the rest is computed in bfloat16."""
    if isinstance(x, NUMPY):
        return nullcontext()
    torch, device = kit(x), x.device.type
    return torch.autocast(device, enabled=False) if torch.amp.is_autocast_available(device) else nullcontext()


def box_features(boxes: Array, frequencies: int) -> Array:
    """The box and the sines and cosines of its numbers at doubling frequencies: (N, 8) -> (N, 8 (1 + 2 F))."""
    xp, scales = kit(boxes), cast([math.pi / 4 * 2.0**octave for octave in range(frequencies)], boxes)
    angles = (boxes[:, :, None] * scales).reshape(len(boxes), -1)
    return xp.concat([boxes, xp.sin(angles), xp.cos(angles)], 1)
