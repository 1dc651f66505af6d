"""Placements as rules: against a wall, in a corner, between two others, each with a margin in metres.

As relations beyond SG-FRONT they are measured, guided to, placed and checked; the networks do not know them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce

import numpy as np
import torch
from torch import Tensor

from echomodel.boxes2d import outline, seen
from echomodel.openings import signed_area
from echomodel.rules.geometry import BoxesLike
from echomodel.vocabulary import Category, vocabulary

AT_WALL = 0.15  # metres between a wall and the side that stands against it
AT_CORNER = 0.25  # metres between each wall of a corner and what stands in it
WITHIN = 0.05  # metres by which a centre may leave the space between two others
DIRECTIONS = 48  # from which that space is looked at


@dataclass(frozen=True)
class Stated:
    """A placement of one box.

    Arguments:
        placement: name of its row. subject: number of the box. others: numbers of the boxes that it names.
    """

    placement: str
    subject: int
    others: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class Spread:
    """K poses of one box: size and position (K, 3), yaw (K,), float, metres and radians."""

    size: Tensor
    position: Tensor
    yaw: Tensor

    @cached_property
    def corners(self) -> Tensor:
        """(K, 4, 2) of the footprint: both of the back, then both of the front, in cyclic order."""
        return outline(self.size[:, [0, 2]] / 2, self.yaw) + self.centre[:, None]

    @property
    def centre(self) -> Tensor:
        """(K, 2) x and z."""
        return self.position[:, [0, 2]]


class Walls:
    """The walls of a floor: starts and inward normals (E, 2), lengths (E,), and which corners look into the room (E,).

    Arguments:
        floor: (E, 2) float, corners of the floor in either order, metres.
    """

    def __init__(self, floor: np.ndarray) -> None:
        self.start = torch.as_tensor(np.asarray(floor, float))
        edge = self.start.roll(-1, 0) - self.start
        self.length = edge.norm(dim=1).clamp_min(1e-9)
        self.along = edge / self.length[:, None]
        sign = 1.0 if signed_area(floor) > 0 else -1.0
        self.normal = sign * torch.stack([-self.along[:, 1], self.along[:, 0]], 1)
        before = self.along.roll(1, 0)
        self.inner = sign * (before[:, 0] * self.along[:, 1] - before[:, 1] * self.along[:, 0]) > 0.1

    def away(self, points: Tensor) -> Tensor:
        """(..., E) distance of points (..., 2) from the line of every wall, inwards positive."""
        return ((points[..., None, :] - self.start) * self.normal).sum(-1)

    def beside(self, points: Tensor) -> Tensor:
        """(..., E) how far points (..., 2) lie from the nearer end of every wall, along it; negative: past it."""
        at = ((points[..., None, :] - self.start) * self.along).sum(-1)
        return torch.minimum(at, self.length - at)


Measure = Callable[[Spread, Sequence[Spread], Walls, Category], Tensor]


def against_wall(own: Spread, others: Sequence[Spread], walls: Walls, kind: Category) -> Tensor:
    """The back stands against a wall; of beds and of what has no front any side but the front."""
    away = walls.away(own.corners).abs()  # (K, 4, E)
    sides = [torch.maximum(away[:, i], away[:, (i + 1) % 4]) for i in range(4)]
    lengthwise = [sides[1], sides[3]] if kind.role == "bed" or not kind.front else []
    every = [sides[0], *lengthwise, *([] if kind.front else [sides[2]])]
    gap = torch.stack(every).amin(0)
    return torch.minimum(AT_WALL - gap, walls.beside(own.centre)).amax(-1)


def in_corner(own: Spread, others: Sequence[Spread], walls: Walls, kind: Category) -> Tensor:
    """Both walls of one of the room's corners are near."""
    gap = walls.away(own.corners).amin(1).abs()  # (K, E)
    near = torch.minimum(AT_CORNER - gap, walls.beside(own.centre))
    both = torch.minimum(near, near.roll(1, 1))  # corner e lies between the walls e - 1 and e
    if not bool(walls.inner.any()):
        return both.amax(-1)
    return both[:, walls.inner].amax(-1)


def between(own: Spread, others: Sequence[Spread], walls: Walls | None, kind: Category) -> Tensor:
    """The centre lies in the space that the two others span (the hull of their footprints), and in neither of them."""
    angle = torch.arange(DIRECTIONS, dtype=own.position.dtype) * (2 * torch.pi / DIRECTIONS)
    way = torch.stack([angle.cos(), angle.sin()])
    reach = reduce(torch.maximum, [(other.corners @ way).amax(1) for other in others])  # (K, directions)
    inside = (reach - own.centre @ way).amin(-1) + WITHIN
    clear = [
        (seen(own.centre - other.centre, other.yaw).abs() - other.size[:, [0, 2]] / 2).amax(-1) for other in others
    ]
    return reduce(torch.minimum, [inside, *clear])


# a placement of the vocabulary -> what it means
RULES: dict[str, Measure] = {"against_wall": against_wall, "in_corner": in_corner, "between": between}


def placement_margins(
    boxes: BoxesLike, stated: Sequence[Stated], floor: np.ndarray | None, categories: Sequence[str]
) -> Tensor:
    """(M,) signed margin in metres of every placement, kept iff >= 0; NaN where it needs walls and none are known.

    Arguments:
        boxes: N boxes, metres and radians; differentiable in their tensors.
        stated: M placements. floor: (k, 2) float, corners of the floor in the boxes' frame.
        categories: N canonical category words.
    """
    size, position, yaw = (torch.as_tensor(v) for v in (boxes.size, boxes.position, boxes.yaw))
    every = [Spread(size[i : i + 1].double(), position[i : i + 1].double(), yaw[i : i + 1].double())
             for i in range(len(yaw))]  # fmt: skip
    walls = None if floor is None else Walls(floor)
    found = [margin_of(one, every, walls, categories) for one in stated]
    return torch.cat(found) if found else size.new_zeros(0).double()


def margin_of(
    one: Stated,
    every: Sequence[Spread] | Mapping[int, Spread],
    walls: Walls | None,
    categories: Sequence[str] | Mapping[int, str],
) -> Tensor:
    """(K,) margin of one placement, metres; NaN where it needs walls and there are none.

    Arguments:
        every: boxes by their number, each with K poses or with one. categories: their words.
    """
    own, others = every[one.subject], [every[i] for i in one.others]
    if walls is None and not others:
        return torch.full_like(own.yaw, torch.nan)
    return RULES[one.placement](own, others, walls, vocabulary().category(categories[one.subject]))  # type: ignore[arg-type]
