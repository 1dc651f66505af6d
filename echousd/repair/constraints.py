"""The constraints of a room, linearised at its present boxes: relations, collisions, floor, walls and support."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echousd.repair.belonging import allowed_overlap
from echousd.repair.geometry import COLUMNS, axes, floor_rows, separation_rows, spread
from echousd.repair.placements import placement_rows
from echousd.repair.problem import ON_CEILING, ON_FLOOR, Problem, wall_gaps
from echousd.repair.relations import relation_margins

RELATION, COLLISION, FLOOR, WALL, SUPPORT, CEILING, OVERHANG, PLACEMENT = range(8)


@dataclass(frozen=True, eq=False)
class Linearised:
    """Constraints value + gradient . step >= 0 (or = 0) around the present boxes.

    Arguments:
        value: (r,) float, metres or ratio, the wanted slack already taken off.
        gradient: (r, n * 6) float.
        equal: (r,) bool, True where the value must be zero rather than not negative.
        kind: (r,) int, `RELATION` ... `PLACEMENT`.
        axis: (p,) int, separating axis chosen for each pair.
    """

    value: np.ndarray
    gradient: np.ndarray
    equal: np.ndarray
    kind: np.ndarray
    axis: np.ndarray


def linearise(
    problem: Problem,
    size: np.ndarray,
    position: np.ndarray,
    yaw: np.ndarray,
    *,
    handicap: np.ndarray,
    slack: float,
) -> Linearised:
    """All constraints at the present boxes; see `Linearised`.

    Arguments:
        size, position: (n, 3) float, metres; yaw: (n,) float, radians.
        handicap: (p, 5) float as `geometry.separation_rows`.
        slack: metres or ratio by which relations are to hold, so that rounding does not break them.
    """
    n = len(size)
    values: list[np.ndarray] = []
    gradients: list[np.ndarray] = []
    equals: list[bool] = []
    kinds: list[np.ndarray] = []

    def add(value: np.ndarray, gradient: np.ndarray, kind: int | np.ndarray, equal: bool = False) -> None:
        values.append(value)
        gradients.append(gradient.reshape(len(value), n * COLUMNS))
        equals.extend([equal] * len(value))
        kinds.append(np.broadcast_to(np.asarray(kind, int), len(value)))

    margin, by_pair = relation_margins(
        size, position, yaw, problem.triplets, rules=problem.rules, centre=problem.centre, fronts=problem.fronts
    )
    add(margin - slack, spread(by_pair, problem.triplets[:, [0, 2]], n), RELATION)

    apart, axis = separation_rows(size, position, yaw, problem.pairs, problem.order, handicap)
    allowed = np.where(problem.touching, 0.0, allowed_overlap(problem.categories, size, problem.pairs))
    add(apart.value + allowed - 0.002, apart.gradient, COLLISION)

    if problem.floor is not None:
        within, who = floor_rows(problem.floor, size, position, yaw)
        near = ~problem.fixed[who] & (within.value < 1.0)
        add(within.value[near], within.gradient[near], FLOOR)
        add(*_wall_rows(problem, size, position, yaw), WALL, equal=True)

    add(*_support_rows(problem, size, position), equal=True)
    add(*_overhang_rows(problem, size, position, yaw), OVERHANG)
    if problem.stated:
        walls = problem.surroundings
        margin, gradient = placement_rows(problem.stated, walls, problem.categories, size, position, yaw)
        add(margin - slack, gradient, PLACEMENT)
    return Linearised(
        np.concatenate(values), np.concatenate(gradients), np.array(equals, bool), np.concatenate(kinds), axis
    )


def _wall_rows(
    problem: Problem, size: np.ndarray, position: np.ndarray, yaw: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    leaning = np.flatnonzero(~np.isnan(problem.wall[:, 0, 0]) & ~problem.fixed)
    gradient = np.zeros((len(leaning), len(size), COLUMNS))
    normal = problem.wall[leaning, 1]
    r = np.arange(len(leaning))
    gradient[r, leaning, 0], gradient[r, leaning, 2] = normal[:, 0], normal[:, 1]
    reach = 0.5 * np.abs(np.einsum("nkd,nd->nk", axes(yaw[leaning]), normal)) * size[leaning][:, [0, 2]]
    gradient[r, leaning, 3], gradient[r, leaning, 5] = -reach[:, 0], -reach[:, 1]
    gap = wall_gaps(problem.wall[leaning], size[leaning], position[leaning], yaw[leaning])
    return gap - problem.behind[leaning], gradient


def _support_rows(
    problem: Problem, size: np.ndarray, position: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    on = ~problem.fixed & (
        (problem.carrier >= ON_FLOOR) | (problem.carrier == ON_CEILING) & (problem.height is not None)
    )
    who = np.flatnonzero(on)
    value = np.zeros(len(who))
    gradient = np.zeros((len(who), len(size), COLUMNS))
    for row, i in enumerate(who):
        gradient[row, i, 1] = 1.0
        carrier = problem.carrier[i]
        value[row] = position[i, 1]
        if carrier >= 0:
            value[row] -= position[carrier, 1] + size[carrier, 1]
            gradient[row, carrier, 1] = -1.0
            gradient[row, carrier, 4] = -size[carrier, 1]
        elif carrier == ON_CEILING and problem.height is not None:
            value[row] += size[i, 1] - problem.height
            gradient[row, i, 4] = size[i, 1]
    return value, gradient, np.where(problem.carrier[who] == ON_CEILING, CEILING, SUPPORT)


def _overhang_rows(
    problem: Problem, size: np.ndarray, position: np.ndarray, yaw: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """What stands on something keeps its footprint within that thing's, or its centre where it is the larger one."""
    who = np.flatnonzero(problem.carrier >= 0)
    who = who[~(problem.fixed[who] & problem.fixed[problem.carrier[who]])]
    n, u = len(size), axes(yaw)
    value = np.zeros(2 * len(who))
    gradient = np.zeros((2 * len(who), n, COLUMNS))
    for at, i in enumerate(who):
        k = problem.carrier[i]
        local = u[k] @ (position[i] - position[k])[[0, 2]]
        reach = 0.5 * np.abs(u[k] @ u[i].T) @ size[i][[0, 2]]
        for axis in (0, 1):
            row, sign = 2 * at + axis, 1.0 if local[axis] >= 0 else -1.0
            room = 0.5 * size[k, 2 * axis] - reach[axis]
            value[row] = max(room, 0.02) - abs(local[axis])
            gradient[row, i, [0, 2]] = -sign * u[k, axis]
            gradient[row, k, [0, 2]] = sign * u[k, axis]
    return value, gradient
