"""Slots of seats, as slots.py gives them: chairs at tables, sofas and armchairs in a group, and what goes with them."""

import math
from collections.abc import Sequence
from itertools import product

import numpy as np

from echomodel.boxes2d import axes
from echomodel.objective.access import DEEP, FARTHEST, WALKED_BEHIND, to_wall
from echomodel.objective.crowding import HAND
from echomodel.objective.sizes import TUCKED
from echomodel.vocabulary import Category, vocabulary
from echousd.place.problem import Problem
from echousd.place.slots import HALF_PI, INNER, Row, Size, Slot, head

DEEPER = 0.27  # metres that a chair is pushed under its table where room is scarce
# Share of the farthest watching distance at which a sofa stands in the room, in halls metres less than that.
AMID, NEARER = 0.7, 0.4
NIGHTSTAND = 0.55  # metres that a nightstand takes beside a bed
LONG = 1.3  # times as long as deep


def around(own: Size, anchor: Size, kind: Category, count: int, apart: float, ahead: float) -> list[Slot]:
    """Chairs: along both long sides of a table and at its ends, looking at it; along the front of one at a wall."""
    length, depth = float(anchor[0]), float(anchor[2])
    if kind.wall:
        spacing = max(min(length / max(count, 1), 0.7), float(own[0]) + 0.05)
        places = product(range(count), ((0.0, 0.0), (-0.15, 0.3), (0.2, 0.3)))
        front = depth / 2 + own[2] / 2 + apart
        return [((k - (count - 1) / 2) * spacing, front + off, math.pi, cost) for k, (off, cost) in places]
    if length >= depth:
        return _around(own, length, depth, count, -apart)
    # the long sides are the left and the right one: the same, turned by a quarter
    quarter = _around(own, depth, length, count, -apart)
    return [(forward, -lateral, turn + HALF_PI, cost) for lateral, forward, turn, cost in quarter]


def _around(own: Size, length: float, depth: float, count: int, tuck: float) -> list[Slot]:
    out = []
    fits = max(int((length + 0.1) // (own[0] + 0.06)), 1)
    wanted = max(1, min(fits, math.ceil(count / 2)))
    free = length - 2 * TUCKED * (count > 2 * wanted)  # what sits at the ends keeps off the corners
    for per_side in sorted({wanted, max(wanted - 1, 1), fits}):
        spacing = max(min(free / per_side, 0.85), float(own[0]) + HAND + 0.01)
        more = 0.0 if per_side == wanted else 0.25 if count % 2 else 0.9
        for k in range(per_side):
            lateral = (k - (per_side - 1) / 2) * spacing
            for tucked, push in ((tuck, 0.0), (DEEPER, 0.5), (-0.1, 0.7)):
                forward = depth / 2 + own[2] / 2 - tucked
                cost = more + push
                out.append((lateral, -forward, 0.0, cost))
                out.append((lateral, forward, math.pi, cost))
    at_ends = (0.9 if count <= 2 * wanted else 0.1) + (1.5 if own[0] > depth + 0.1 else 0.0)  # no bench across an end
    for tucked, push in ((tuck, 0.0), (DEEPER, 0.5), (-0.1, 0.7)):
        out.append((length / 2 + own[2] / 2 - tucked, 0.0, -HALF_PI, at_ends + push))
        out.append((-length / 2 - own[2] / 2 + tucked, 0.0, HALF_PI, at_ends + push))
    return out


def at_front(own: Size, anchor: Size, kind: Category, count: int, apart: float, ahead: float) -> list[Slot]:
    """Chairs at desks and dressing tables: in the middle of the front, looking at it."""
    out = []
    for tucked, push in ((-apart, 0.0), (0.25, 0.1), (0.0, 0.2), (0.4, 0.4)):
        for lateral in (0.0, -0.12, 0.12, -0.3, 0.3):
            if abs(lateral) < anchor[0] / 2:
                out.append((lateral, anchor[2] / 2 + own[2] / 2 - min(tucked, 0.6 * own[2]), math.pi,
                            push + 2.0 * abs(lateral)))  # fmt: skip
    return out


def company(own: Size, anchor: Size, kind: Category, count: int, apart: float, ahead: float) -> list[Slot]:
    """Armchairs: beside the coffee table or before the sofa, turned into the group."""
    out = []
    if kind.role == "board":  # around the coffee table, but not on its long side towards the sofa
        for side in (-1.0, 1.0):
            for gap, more in ((0.45, 0.0), (0.6, 0.05), (0.8, 0.2), (0.35, 0.2)):
                for forward in (0.0, 0.3, -0.3, 0.6, -0.6):
                    lateral = side * (anchor[0] / 2 + own[2] / 2 + gap)
                    out.append((lateral, forward, math.atan2(-lateral, -forward), more + 0.3 * abs(forward)))
        for side in (-1.0, 1.0):
            for lateral in (0.0, 0.5, -0.5):
                forward = side * (anchor[2] / 2 + own[2] / 2 + 0.45)
                out.append((lateral, forward, math.atan2(-lateral, -forward), 0.25))
        return out
    for side in (-1.0, 1.0):
        for away in (0.3, 0.5, 0.8):
            for forward in (1.1, 1.4, 0.8):
                lateral = side * (anchor[0] / 2 + own[2] / 2 + away - 0.4)
                at = anchor[2] / 2 + forward
                out.append((lateral, at, math.atan2(-lateral, 0.6 - at), 0.2))
        out.append((side * (anchor[0] / 2 + own[0] / 2 + 0.5), 0.0, -side * 0.5, 0.5))
    return out


def joined(own: Size, anchor: Size, kind: Category, count: int, apart: float, ahead: float) -> list[Slot]:
    """A second sofa: opposite the first across the coffee table, or at a right angle at one of its ends."""
    middle = anchor[2] / 2 + own[2] / 2
    out = [(0.0, middle + away, math.pi, cost) for away, cost in ((1.6, 0.3), (1.9, 0.4), (1.35, 0.6))]
    for side in (-1.0, 1.0):
        for gap, more in ((0.25, 0.0), (0.5, 0.1), (0.1, 0.2)):
            lateral = side * (anchor[0] / 2 + own[2] / 2 + gap)
            for forward in (0.3, 0.6, 0.0):
                out.append((lateral, anchor[2] / 2 + forward + own[0] / 2 - 0.3, -side * HALF_PI, more + 0.2 * forward))
    return out


def sides(own: Size, table: Size) -> list[Slot]:
    """A second sofa again: at any side of the table that it shares, looking at it, or level with one end of that side,
    where its corner is near the table's and there is room for knees."""
    out = []
    ways = ((0.18, 0, 0.0), (0.3, 0, 0.1), (0.45, 0, 0.1), (0.35, 1, 0.0), (0.35, -1, 0.0))
    for quarter, turn in enumerate((0.0, HALF_PI, math.pi, -HALF_PI)):
        deep, wide = table[[2, 0]] if quarter % 2 == 0 else table[[0, 2]]
        for gap, end, more in ways:
            away, level = deep / 2 + own[2] / 2 + gap, end * (own[0] - wide) / 2
            at = math.sin(turn) * away + math.cos(turn) * level, math.cos(turn) * away - math.sin(turn) * level
            out.append((*at, turn + math.pi, more))
    return out


def before(own: Size, anchor: Size, kind: Category, count: int, apart: float, ahead: float) -> list[Slot]:
    """Coffee tables: before the sofa, in reach, the long side along it."""
    inner = kind.name in vocabulary().cornered
    out = []
    for turn, more in ((0.0, 0.0), (math.pi, 0.02), (HALF_PI, 0.8)):
        depth, width = (own[2], own[0]) if turn != HALF_PI else (own[0], own[2])
        if width < depth * 0.95:
            more += 0.3
        for gap, away in ((apart, 0.0), (0.32, 0.05), (0.46, 0.05), (0.25, 0.3), (0.6, 0.3)):
            gap = gap - INNER if inner else gap
            for lateral in (0.0, -0.08, 0.08, -0.2, 0.2, -0.35, 0.35):
                if abs(lateral) < anchor[0] / 2:
                    out.append((lateral, anchor[2] / 2 + depth / 2 + gap, turn, more + away + 1.5 * abs(lateral)))
    return out


def in_view(problem: Problem, i: int, at_walls: Sequence[Row]) -> list[Row]:
    """In the room before a screen at the far wall, where a sofa at its own wall would be too far from it."""
    if not any(role == "opposite" and a == i for role, a in zip(problem.slot_roles, problem.anchor, strict=True)):
        return []
    rows = np.array(at_walls).reshape(-1, 4)
    front = axes(rows[:, 2])[1]
    free = to_wall(problem.plan, np.zeros(len(rows), int), rows[:, :2], front)
    deep, most = free + float(problem.size[i, 2]) / 2 > DEEP, FARTHEST - NEARER
    away = [free - AMID * FARTHEST, np.full(len(rows), WALKED_BEHIND - 0.01 - problem.behind[i]), free - most]
    keep = [free > FARTHEST, deep, deep & (free > most + WALKED_BEHIND)]
    out = [(rows + np.pad(off[:, None] * front, ((0, 0), (0, 2))))[at] for off, at in zip(away, keep, strict=True)]
    return [(x, z, yaw, more) for x, z, yaw, more in np.concatenate(out).tolist()]


def beside(own: Size, anchor: Size, kind: Category, count: int, apart: float, ahead: float) -> list[Slot]:
    """Side tables and floor lamps: at the ends of a sofa, beside an armchair, at the head of a bed."""
    out = []
    if kind.role == "bed":  # before its middle one gets in
        for lateral, forward, turn, more in head(own, anchor, kind, count, min(apart, 0.1), 0.0):
            further = lateral + math.copysign(NIGHTSTAND, lateral)
            out += [(lateral, forward, turn, more), (further, forward, turn, more + 0.3)]
    for side in (-1.0, 1.0):
        for gap, more in ((apart, 0.0), (apart + 0.08, 0.1), (apart + 0.21, 0.3)):
            lateral = side * (anchor[0] / 2 + own[0] / 2 + gap)
            back = -anchor[2] / 2 + own[2] / 2
            if kind.role == "bed":
                more += 0.8
            out += [
                (lateral, max(ahead, min(back, 0.0)), 0.0, more),
                (lateral, back, 0.0, more + 0.02),
                (lateral, back / 2, 0.0, more + 0.05),
            ]
    return out


def foot(own: Size, anchor: Size, kind: Category, count: int, apart: float, ahead: float) -> list[Slot]:
    """Benches and ottomans: at the foot of a bed, before a sofa or armchair: half of 28 real ones leave 0.59 m."""
    out = []
    bed = kind.role == "bed"
    askew = 1.5 if max(own[0], own[2]) > LONG * min(own[0], own[2]) else 0.3  # a bench lies along the foot
    for gap, more in ((0.04 if bed else 0.5, 0.0), (0.1 if bed else 0.6, 0.1), (0.2 if bed else 0.35, 0.3)):
        for lateral in (0.0, -0.15, 0.15) if bed else (0.0, -0.5, 0.5, -0.9, 0.9, -1.3, 1.3):
            for turn in (0.0, HALF_PI):
                depth = own[2] if turn == 0.0 else own[0]
                wide = 0.0 if (own[0] >= own[2]) == (turn == 0.0) else askew
                out.append((lateral, anchor[2] / 2 + depth / 2 + gap, turn, more + wide + 0.2 * abs(lateral)))
    if not bed:  # at the sides of the group
        for side in (-1.0, 1.0):
            out.append((side * (anchor[0] / 2 + own[2] / 2 + 0.3), anchor[2] / 2 + 0.6, -side * HALF_PI, 0.4))
    return out


def midway(position: np.ndarray, yaw: np.ndarray, others: Sequence[int]) -> list[Row]:
    """On the line between the centres of two others and a little beside it, turned as either of them."""
    at, turn = position[list(others)][:, [0, 2]], yaw[list(others)]
    way = at[1] - at[0]
    aside = np.array([-way[1], way[0]]) / max(float(np.linalg.norm(way)), 1e-9)
    return [
        (*(at[0] + share * way + lateral * aside).tolist(), float(heading), 0.05 + 0.2 * abs(lateral))
        for share in (0.3, 0.4, 0.5, 0.6, 0.7)
        for lateral in (0.0, -0.3, 0.3, -0.6, 0.6)
        for heading in turn
    ]
