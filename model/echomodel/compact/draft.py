"""What a draft of the boxes says about the room: where each stands to the walls, and each pair to one another."""

from __future__ import annotations

import torch
from torch import Tensor

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
    return Boxes(boxes.size.clamp(0.02, FARTHEST), boxes.position.clamp(-FARTHEST, FARTHEST), boxes.yaw)


def wall_features(boxes: Boxes, floor: Tensor) -> Tensor:
    """Gaps to the walls at several scales, zeros where the floor is unknown: (N, WALL_FEATURES).

    Four gaps along the room's axes from the hull of the box, and eight of its outline to the nearest wall; negative
    beyond the wall. Then how it is turned to the wall next to its back, as sine and cosine of the angle and of four
    times that angle, which is zero for all that stands straight.

    Arguments:
        boxes: N boxes. floor: (N, K, 2) float32, corners of the floor under each, NaN = unknown.
    """
    ahead = wall_distances(boxes.position[:, [0, 2]], floor) - _hull_of(boxes)[:, [0, 0, 1, 1]]
    outline = footprint(boxes.size, boxes.position, boxes.yaw)
    there = known(floor)[:, None].to(ahead.dtype)
    gaps = torch.cat([ahead, signed_distance(outline, floor)], dim=1) * there
    turn = boxes.yaw - nearest_wall(outline[:, BACK], floor)
    turned = torch.stack([turn.sin(), turn.cos(), (4 * turn).sin(), (4 * turn).cos()], dim=1) * there
    return torch.cat([_scales(gaps), there, turned], dim=1)


def pair_features(boxes: Boxes, pairs: Pairs) -> Tensor:
    """How the sender's box stands to the receiver's, and whether it mirrors it about the room's axes.

    Shapes:
        N boxes, P pairs -> (P, PAIR_FEATURES)
    """
    i, j = pairs.receiver, pairs.sender
    apart = boxes.position[j] - boxes.position[i]
    cos, sin = boxes.yaw.cos(), boxes.yaw.sin()
    reach = _hull_of(boxes)
    gap = apart[:, [0, 2]].abs() - reach[i] - reach[j]
    extent = torch.stack([boxes.size.log().sum(1), boxes.size[:, 1].log()], dim=1)
    larger = extent[j] - extent[i]
    lift = boxes.position[j, 1] - boxes.position[i, 1] - boxes.size[i, 1]
    mirrored = (boxes.position[i] + boxes.position[j])[:, [0, 2]]
    return torch.cat(
        [
            apart / 2, torch.tanh(apart / ROUND_ABOUT), torch.tanh(gap / ROUND_ABOUT), torch.tanh(gap / NEAR),
            torch.tanh(_across(boxes, i, j)), torch.tanh(lift / ROUND_ABOUT)[:, None],
            torch.tanh(mirrored / ROUND_ABOUT), torch.tanh(mirrored / NEAR),
            larger / 2, torch.tanh(larger / RATIO),
            torch.stack([sin[j] * cos[i] - cos[j] * sin[i], cos[j] * cos[i] + sin[j] * sin[i]], 1),
            seen_from(boxes, i, j), seen_from(boxes, j, i),
            torch.tanh(_across(boxes, j, i)),
            torch.stack([(4 * (boxes.yaw[i] - boxes.yaw[j])).sin(), (4 * (boxes.yaw[i] - boxes.yaw[j])).cos()], 1),
        ],
        dim=1,
    )  # fmt: skip


def _across(boxes: Boxes, i: Tensor, j: Tensor) -> Tensor:
    """(P, 2) metres to the side and to the front of i at which j stands."""
    return seen((boxes.position[j] - boxes.position[i])[:, [0, 2]], boxes.yaw[i])


def seen_from(boxes: Boxes, i: Tensor, j: Tensor) -> Tensor:
    """Where j stands in the frame of i, the gaps between the two there, and the way from i's front to j: (P, 10)."""
    place = _across(boxes, i, j)
    half = boxes.size[:, [0, 2]] / 2
    gap = place.abs() - hull(half[j], boxes.yaw[j] - boxes.yaw[i]) - half[i]
    way = place / place.square().sum(1, keepdim=True).clamp_min(1e-4).sqrt()
    scales = [torch.tanh(numbers / scale) for numbers in (place, gap) for scale in (ROUND_ABOUT, NEAR)]
    return torch.cat([*scales, way], 1)


def _hull_of(boxes: Boxes) -> Tensor:
    """(N, 2) half extents of the boxes along the room's x and z, metres."""
    return hull(boxes.size[:, [0, 2]] / 2, boxes.yaw)


def _scales(gaps: Tensor) -> Tensor:
    return torch.cat([torch.tanh(gaps / 3), torch.tanh(gaps / ROUND_ABOUT), torch.tanh(gaps / NEAR)], dim=1)
