"""The constraints of a room, linearised at its present boxes: relations, collisions, floor, walls and support."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from scipy import sparse

from echomodel.objective.support import ON_CEILING, ON_FLOOR, allowed_overlap
from echousd.place.geometry import COLUMNS, Rows, axes, floor_rows, separation_rows, spread, spread_sparsely
from echousd.place.placements import placement_rows
from echousd.place.problem import Problem, wall_gaps
from echousd.place.relations import relation_margins

RELATION, COLLISION, FLOOR, WALL, SUPPORT, CEILING, OVERHANG, PLACEMENT = range(8)
MANY = 60  # boxes beyond which constraints are sparse, and pairs far apart are none
HANDLES = 0.05  # metres at the front of a box that handles and doors take, on which nothing can stand
ROUNDED = 0.02  # metres at its back, where a top with rounded corners may end before its box
LONGEST_STEP = 0.6  # of any number in one round, metres or ratio

Matrix: TypeAlias = Any  # (r, m) float, an array of numpy or a sparse one


@dataclass(frozen=True, eq=False)
class Linearised:
    """Constraints value + gradient . step >= 0 (or = 0) around the present boxes.

    Arguments:
        value: (r,) float, metres or ratio, the wanted slack already taken off.
        gradient: (r, n * 6) float; sparse for very many boxes.
        equal: (r,) bool, True where the value must be zero rather than not negative.
        kind: (r,) int, `RELATION` ... `PLACEMENT`.
        axis: (p,) int, separating axis chosen for each pair.
        pair: (c,) int, number of the pair of each collision's row.
    """

    value: np.ndarray
    gradient: Matrix
    equal: np.ndarray
    kind: np.ndarray
    axis: np.ndarray
    pair: np.ndarray

    def boxes_of(self, row: int) -> list[int]:
        """The boxes that a constraint is about."""
        slopes = self.gradient[[row]]
        dense = slopes.toarray() if sparse.issparse(slopes) else slopes
        found: list[int] = np.flatnonzero(np.abs(dense.reshape(-1, COLUMNS)).sum(1) > 0).tolist()
        return found


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
    many = n > MANY
    values: list[np.ndarray] = []
    gradients: list[Matrix] = []
    equals: list[bool] = []
    kinds: list[np.ndarray] = []

    def add(value: np.ndarray, gradient: np.ndarray, kind: int | np.ndarray, equal: bool = False) -> None:
        flat = gradient.reshape(len(value), n * COLUMNS)
        put(value, sparse.csr_array(flat) if many else flat, kind, equal)

    def add_rows(rows: Rows, kind: int) -> None:
        if many:
            put(rows.value, spread_sparsely(rows.gradient, rows.who, n), kind)
        else:
            add(rows.value, spread(rows.gradient, rows.who, n), kind)

    def put(value: np.ndarray, gradient: Matrix, kind: int | np.ndarray, equal: bool = False) -> None:
        values.append(value)
        gradients.append(gradient)
        equals.extend([equal] * len(value))
        kinds.append(np.broadcast_to(np.asarray(kind, int), len(value)))

    margin, by_pair = relation_margins(
        size, position, yaw, problem.triplets, rules=problem.rules, centre=problem.centre, fronts=problem.fronts
    )
    add_rows(Rows(margin - slack, by_pair, problem.triplets[:, [0, 2]]), RELATION)

    apart, axis = separation_rows(size, position, yaw, problem.pairs, problem.order, handicap)
    allowed = np.where(problem.touching, 0.0, allowed_overlap(problem.categories, size, problem.pairs))
    apart = replace(apart, value=apart.value + allowed - 0.002)
    pair = np.arange(len(problem.pairs))
    if many:  # those apart that no step brings together
        pair = np.flatnonzero(apart.value <= LONGEST_STEP * np.abs(apart.gradient).sum((1, 2)) + 1e-6)
    add_rows(apart.take(pair), COLLISION)

    if problem.floor is not None:
        within = floor_rows(problem.floor, size, position, yaw)
        add_rows(within.take(~problem.fixed[within.who[:, 0]] & (within.value < 1.0)), FLOOR)
        add(*_wall_rows(problem, size, position, yaw), WALL, equal=True)

    add(*_support_rows(problem, size, position), equal=True)
    add(*_overhang_rows(problem, size, position, yaw), OVERHANG)
    if problem.stated:
        walls = problem.surroundings
        margin, gradient = placement_rows(problem.stated, walls, problem.categories, size, position, yaw)
        add(margin - slack, gradient, PLACEMENT)
    whole = stacked_rows(gradients)
    return Linearised(np.concatenate(values), whole, np.array(equals, bool), np.concatenate(kinds), axis, pair)


def stacked_rows(parts: Sequence[Matrix]) -> Matrix:
    """Rows of gradients below one another."""
    return sparse.vstack(parts, format="csr") if sparse.issparse(parts[0]) else np.concatenate(parts)


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
            room = 0.5 * size[k, 2 * axis] - reach[axis] - (0.0 if axis == 0 else HANDLES if sign > 0 else ROUNDED)
            value[row] = max(room, 0.02) - abs(local[axis])
            gradient[row, i, [0, 2]] = -sign * u[k, axis]
            gradient[row, k, [0, 2]] = sign * u[k, axis]
    return value, gradient
