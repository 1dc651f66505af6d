"""What a draft of the boxes says about the room: where each stands to the walls, and each pair to one another."""

from __future__ import annotations

from echomodel.arrays import Array, at_least, cast, clipped, dot, kit
from echomodel.boxes import Boxes
from echomodel.boxes2d import hull, seen
from echomodel.compact.pairs import Pairs
from echomodel.floors import SIDES, footprint, known, signed_distance
from echomodel.surroundings import NEAR, ROUND_ABOUT, nearest_wall, wall_distances

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
    return xp.concat([_scales(gaps), there, turned], 1)


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


def _scales(gaps: Array) -> Array:
    xp = kit(gaps)
    return xp.concat([xp.tanh(gaps / 3), xp.tanh(gaps / ROUND_ABOUT), xp.tanh(gaps / NEAR)], 1)
