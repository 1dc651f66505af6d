"""Placements as rules: against a wall, in a corner, between two others, each with a margin in metres.

As relations beyond SG-FRONT they are measured, guided to, placed and checked; the networks do not know them.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import reduce

import numpy as np

from echomodel.arrays import Array, at_least, cast, kit, norm
from echomodel.boxes2d import along_sides, seen
from echomodel.floors import AT_WALL, Walls
from echomodel.graph import Stated
from echomodel.rules.geometry import BoxesLike, Spread
from echomodel.rules.margins import floating
from echomodel.vocabulary import Category, vocabulary

AT_CORNER = 0.25  # metres between each wall of a corner and what stands in it
WITHIN = 0.05  # metres by which a centre may leave the space between two others
DETOUR = 0.5  # metres that the way from one to the other is longer by way of it, at most
WAYS = np.stack([way(np.arange(48) * (np.pi / 24)) for way in (np.cos, np.sin)])  # from which that space is looked at
Measure = Callable[[Spread, Sequence[Spread], Walls, Category], Array]


def against_wall(own: Spread, others: Sequence[Spread], walls: Walls, kind: Category) -> Array:
    """The back stands against a wall; of beds and of what has no front any side but the front."""
    xp, away = kit(own.yaw), abs(walls.away(own.corners))  # (K, 4, E)
    sides = [xp.maximum(away[:, i], away[:, (i + 1) % 4]) for i in range(4)]
    lengthwise = [sides[1], sides[3]] if kind.role == "bed" or not kind.front else []
    every = [sides[0], *lengthwise, *([] if kind.front else [sides[2]])]
    gap = reduce(xp.minimum, every)
    return xp.amax(xp.minimum(AT_WALL - gap, walls.beside(own.centre)), -1)


def in_corner(own: Spread, others: Sequence[Spread], walls: Walls, kind: Category) -> Array:
    """Both walls of one of the room's corners are near."""
    xp = kit(own.yaw)
    gap = abs(xp.amin(walls.away(own.corners), 1))  # (K, E)
    near = xp.minimum(AT_CORNER - gap, walls.beside(own.centre))
    both = xp.minimum(near, xp.concat([near[:, -1:], near[:, :-1]], 1))  # corner e lies between the walls e - 1 and e
    return xp.amax(both[:, walls.inner] if walls.inner.any() else both, -1)


def between(own: Spread, others: Sequence[Spread], walls: Walls | None, kind: Category) -> Array:
    """The centre lies within the hull of the two others' footprints, in neither, about on the way between them."""
    xp, own_centre, way = kit(own.yaw), own.centre, cast(WAYS, own.yaw)
    reach = reduce(xp.maximum, [xp.amax(other.corners @ way, 1) for other in others])  # (K, directions)
    inside = xp.amin(reach - own_centre @ way, -1) + WITHIN
    off = [abs(seen(own_centre - other.centre, other.yaw)) - other.size[:, ::2] / 2 for other in others]
    one, two = others
    along, both = along_sides(one.centre - two.centre, one.size[:, ::2] / 2, one.yaw, two.size[:, ::2] / 2, two.yaw)
    direct = at_least(xp.amax(abs(along) - both, -1), 0.0)
    detour = sum(norm(at_least(aside, 0.0)) for aside in off) - direct
    return reduce(xp.minimum, [inside, DETOUR - detour, *(xp.amax(aside, -1) for aside in off)])


# a placement of the vocabulary -> what it means
RULES: dict[str, Measure] = {"against_wall": against_wall, "in_corner": in_corner, "between": between}


def placement_margins(
    boxes: BoxesLike, stated: Sequence[Stated], floor: np.ndarray | None, categories: Sequence[str]
) -> Array:
    """(M,) signed margin in metres of every placement, kept iff >= 0; NaN where it needs walls and none are known.

    Arguments:
        boxes: N boxes, metres and radians; differentiable in their arrays, if these are.
        stated: M placements. floor: (k, 2) float, corners of the floor in the boxes' frame.
        categories: N canonical category words.
    """
    xp = kit(boxes.yaw)
    own = floating(boxes, xp.float64)
    named = {i for one in stated for i in (one.subject, *one.others)}
    every = {i: Spread(own.size[i : i + 1], own.position[i : i + 1], own.yaw[i : i + 1]) for i in named}
    walls = None if floor is None else Walls(floor)
    found = [margin_of(one, every, walls, categories) for one in stated]
    return xp.concat(found) if found else own.yaw[:0]


def margin_of(
    one: Stated, every: Sequence[Spread] | Mapping[int, Spread], walls: Walls | None,
    categories: Sequence[str] | Mapping[int, str],
) -> Array:  # fmt: skip
    """(K,) margin of one placement, metres; NaN where it needs walls and there are none.

    Arguments:
        every: boxes by their number, each with K poses or with one. categories: their words.
    """
    own, others = every[one.subject], [every[i] for i in one.others]
    if walls is None and not others:
        return kit(own.yaw).full_like(own.yaw, np.nan)
    return RULES[one.placement](own, others, walls, vocabulary().category(categories[one.subject]))  # type: ignore[arg-type]
