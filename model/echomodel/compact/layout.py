"""Layout denoiser: boxes of all objects at once, with an echo in every layer of every step (EchoScene 3.3).

The first layers draft the boxes. The draft is measured as a person would measure a floor plan: gaps to the walls, to
doors and windows, and how each pair stands to one another. The next layers hear that and refine the draft, as often as
the config says.
"""

import math
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace

from echomodel.arrays import NUMPY, Array, at_least, cast, clipped, dot, held, kit, parted
from echomodel.boxes import Boxes, BoxScale
from echomodel.boxes2d import hull, seen
from echomodel.compact.pairs import Layers, Pairs
from echomodel.config import LayoutConfig
from echomodel.floors import SIDES, footprint, known, signed_distance
from echomodel.graph import GraphBatch
from echomodel.samplers import clean_from
from echomodel.surroundings import (
    NEAR,
    ROUND_ABOUT,
    clearances,
    nearest_wall,
    plan_features,
    room_features,
    wall_distances,
)

BOX = 8
WILDEST = 8.0  # at high noise the clean boxes of the `noise` objective may lie anywhere


FARTHEST = 20.0  # metres
RATIO = 0.2  # scale at which logarithms of volumes and heights are told
WALL_FEATURES = 3 * 12 + 1 + 4
PAIR_FEATURES = 23 + 24
BACK = SIDES.index((0, -1))  # middle of the back of a footprint


def measurable(boxes: Boxes) -> Boxes:
    """The boxes within bounds: a draft from pure noise may lie anywhere, what is measured on it must stay finite."""
    return Boxes(clipped(boxes.size, 0.02, FARTHEST), clipped(boxes.position, -FARTHEST, FARTHEST), boxes.yaw)


def wall_features(boxes: Boxes, floor: Array) -> Array:
    """Gaps to the walls at several scales, zeros where the floor is unknown: (N, WALL_FEATURES).

    Four gaps along the room's axes from the hull of the box, and eight of its outline to the nearest wall; negative
    beyond the wall. Then how it is turned to the wall next to its back, as sine and cosine of the angle and of four
    times that angle, which is zero for all that stands straight.

    Arguments:
        boxes: N boxes. floor: (N, K, 2) float32, corners of the floor under each, NaN = unknown.
    """
    xp = kit(floor)
    ahead = wall_distances(boxes.position[:, ::2], floor) - _hull_of(boxes)[:, [0, 0, 1, 1]]
    outline = footprint(boxes.size, boxes.position, boxes.yaw)
    there = cast(known(floor), ahead)[:, None]
    gaps = xp.concat([ahead, signed_distance(outline, floor)], 1) * there
    turn = boxes.yaw - nearest_wall(outline[:, BACK], floor)
    turned = xp.stack([xp.sin(turn), xp.cos(turn), xp.sin(4 * turn), xp.cos(4 * turn)], 1) * there
    scales = [xp.tanh(gaps / length) for length in (3, ROUND_ABOUT, NEAR)]
    return xp.concat([*scales, there, turned], 1)


def pair_features(boxes: Boxes, pairs: Pairs) -> Array:
    """How the sender's box stands to the receiver's, and whether it mirrors it about the room's axes.

    Shapes:
        N boxes, P pairs -> (P, PAIR_FEATURES)
    """
    xp, i, j = kit(boxes.yaw), pairs.receiver, pairs.sender
    apart = boxes.position[j] - boxes.position[i]
    cos, sin = xp.cos(boxes.yaw), xp.sin(boxes.yaw)
    reach = _hull_of(boxes)
    gap = abs(apart[:, ::2]) - reach[i] - reach[j]
    extent = xp.stack([xp.log(boxes.size).sum(1), xp.log(boxes.size[:, 1])], 1)
    larger = extent[j] - extent[i]
    lift = boxes.position[j, 1] - boxes.position[i, 1] - boxes.size[i, 1]
    mirrored = (boxes.position[i] + boxes.position[j])[:, ::2]
    turn = 4 * (boxes.yaw[i] - boxes.yaw[j])
    return xp.concat(
        [
            apart / 2, xp.tanh(apart / ROUND_ABOUT), xp.tanh(gap / ROUND_ABOUT), xp.tanh(gap / NEAR),
            xp.tanh(_across(boxes, i, j)), xp.tanh(lift / ROUND_ABOUT)[:, None],
            xp.tanh(mirrored / ROUND_ABOUT), xp.tanh(mirrored / NEAR),
            larger / 2, xp.tanh(larger / RATIO),
            xp.stack([sin[j] * cos[i] - cos[j] * sin[i], cos[j] * cos[i] + sin[j] * sin[i]], 1),
            seen_from(boxes, i, j), seen_from(boxes, j, i),
            xp.tanh(_across(boxes, j, i)),
            xp.stack([xp.sin(turn), xp.cos(turn)], 1),
        ],
        1,
    )  # fmt: skip


def measured(boxes: Boxes, floor: Array, openings: Array, pairs: Pairs) -> tuple[Array, Array, Array]:
    """What is measured on N boxes: gaps to the walls (N, WALL_FEATURES), clearances of doors and windows
    (N, OPENING_FEATURES), and how pairs stand to one another (P, PAIR_FEATURES)."""
    return wall_features(boxes, floor), clearances(boxes, openings), pair_features(boxes, pairs)


def _across(boxes: Boxes, i: Array, j: Array) -> Array:
    """(P, 2) metres to the side and to the front of i at which j stands."""
    return seen((boxes.position[j] - boxes.position[i])[:, ::2], boxes.yaw[i])


def seen_from(boxes: Boxes, i: Array, j: Array) -> Array:
    """Where j stands in the frame of i, the gaps between the two there, and the way from i's front to j: (P, 10)."""
    xp, place = kit(boxes.yaw), _across(boxes, i, j)
    half = boxes.size[:, ::2] / 2
    gap = abs(place) - hull(half[j], boxes.yaw[j] - boxes.yaw[i]) - half[i]
    way = place / xp.sqrt(at_least(dot(place, place), 1e-4))[:, None]
    scales = [xp.tanh(numbers / scale) for numbers in (place, gap) for scale in (ROUND_ABOUT, NEAR)]
    return xp.concat([*scales, way], 1)


def _hull_of(boxes: Boxes) -> Array:
    """(N, 2) half extents of the boxes along the room's x and z, metres."""
    return hull(boxes.size[:, ::2] / 2, boxes.yaw)


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
    measure = staticmethod(measured)  # or the same, compiled for a machine

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
        walls, openings, pairs = self.measure(boxes, context.floor, context.openings, context.pairs)
        concat = kit(clean).concat
        features = concat([box_features(clean, self.settings.frequencies), walls, openings], 1)
        stated = concat([context.pairs.stated, pairs], 1)
        return features, replace(context.pairs, stated=stated)


def temperatures(settings: LayoutConfig, like: Array) -> Array:
    """(BOX,) scales of the noise that sampling adds: places and headings have the branch's temperature, sizes vary as
    they do."""
    return cast([1.0] * 3 + [settings.temperature] * (BOX - 3), like)


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
