"""Seating plans: the places that chairs and benches take around a table, so that sides are even and match."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.optimize import linear_sum_assignment

from echomodel.objective.company import STAGGERED
from echomodel.objective.sizes import TUCKED
from echousd.repair.arrange.attending import apart, out_of
from echousd.repair.arrange.costs import price
from echousd.repair.arrange.groups import GAIN, paid_by
from echousd.repair.arrange.setting import Poses, Setting, State

TRIED = 2  # plans that are tried with all seats at once
UNEVEN, AT_END = 0.25, 0.25  # for each chair more on one side or at one end than opposite, and for each at an end
STAGGER = 0.8  # for seats that are not opposite those of the other side
SPREAD, ELBOWS = 0.85, 0.03  # metres between the middles of two chairs at most, and between two chairs at least
OVERHANG = 0.1  # metres by which the seats of a side may be longer than it is
QUARTER = math.pi / 2


@dataclass(frozen=True)
class Plan:
    """How many chairs sit at both long sides and at both ends, and at which long sides (0, 1) benches stand."""

    chairs: tuple[int, int, int, int]
    benches: tuple[int, ...] = ()

    @property
    def ugly(self) -> float:
        """What a person would mind about it, as a price."""
        one, other, left, right = self.chairs
        sides = 0 if self.benches else abs(one - other)
        return UNEVEN * (sides + abs(left - right)) + AT_END * (left + right)


def plans(chairs: int, benches: int, along: int, across: int) -> list[Plan]:
    """The plans for so many chairs and benches, each of which takes a side, the least ugly first; none = no room.

    Arguments:
        along, across: chairs that fit at each long side, at each end.
    """
    out = []
    for taken in {0: ((),), 1: ((0,), (1,)), 2: ((0, 1),)}.get(benches, ()):
        free = [0 if side in taken else along for side in (0, 1)]
        for one, other, left in product(range(free[0] + 1), range(free[1] + 1), range(across + 1)):
            right = chairs - one - other - left
            if 0 <= right <= across:
                out.append(Plan((one, other, left, right), taken))
    return sorted(out, key=lambda plan: plan.ugly)


def seat_evenly(setting: Setting, state: State, own: np.ndarray) -> None:
    """Deal the seats of every table to the places of a plan at once, where that costs less; `state` is changed.

    Arguments:
        state: all boxes placed. own: (n,) float, as `paid_by`; those of dealt seats are changed.
    """
    for table in np.flatnonzero(setting.laid).tolist():
        at_it = np.isin(setting.stances, ("at", "foot")) & setting.seats & (setting.anchor == table)
        seats = np.flatnonzero(at_it)
        if len(seats) < 2 or (setting.fixed | setting.turned)[seats].any() or not setting.standing(table):
            continue
        before = _paid(setting, state, seats, own) + STAGGER * staggered(setting, state, table, seats)
        if before < GAIN * len(seats):
            continue
        best = state.position[seats].copy(), state.yaw[seats].copy(), own[seats].copy()
        for ugly, *dealt in _dealt(setting, state, table, seats):
            state.position[seats], state.yaw[seats], own[seats] = dealt
            after = _paid(setting, state, seats, own) + ugly
            if after < before - GAIN:
                before, best = after, (dealt[0], dealt[1], dealt[2])
        state.position[seats], state.yaw[seats], own[seats] = best


def _paid(setting: Setting, state: State, seats: np.ndarray, own: np.ndarray) -> float:
    return sum(paid_by(setting, state, i, own) for i in seats.tolist())


def staggered(setting: Setting, state: State, table: int, seats: np.ndarray) -> bool:
    """Whether seats around a table are not opposite those of the other side, though these are as many."""
    lateral, forward = _in_frame(setting, state, table, seats)
    sides, ends = (setting.size[table, axis] / 2 for axis in _axes_of(setting, table))
    for along, across, half in ((lateral, forward, sides), (forward, lateral, ends)):
        rows = [np.sort(along[(sign * across > 0) & (np.abs(along) < half)]) for sign in (-1, 1)]
        if len(rows[0]) == len(rows[1]) and (np.abs(rows[0] - rows[1]) > STAGGERED).any():
            return True
    return False


def _axes_of(setting: Setting, table: int) -> tuple[int, int]:
    """Axes of a table's size along its long sides and along its ends."""
    return (0, 2) if setting.size[table, 0] >= setting.size[table, 2] else (2, 0)


def _in_frame(setting: Setting, state: State, table: int, seats: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(k,), (k,): where seats stand along the long sides of a table and across them, from its middle, metres."""
    away = (state.position[seats] - state.position[table])[:, [0, 2]]
    turn = float(state.yaw[table]) + (QUARTER if _axes_of(setting, table)[0] == 2 else 0.0)
    c, s = math.cos(turn), math.sin(turn)
    return c * away[:, 0] - s * away[:, 1], s * away[:, 0] + c * away[:, 1]


def _dealt(
    setting: Setting, state: State, table: int, seats: np.ndarray
) -> Iterator[tuple[float, np.ndarray, np.ndarray, np.ndarray]]:
    """The cheapest plans: how ugly each is, and position (k, 3), yaw (k,) and price (k,) of the seats in it."""
    benches = np.array([setting.stances[i] == "foot" for i in seats])
    found = _places(setting, table, seats[~benches], seats[benches])
    keys = sorted({place for _, places in found for place in places})
    if not keys:
        return
    state.placed[seats] = False
    poses = [_poses(setting, state, table, int(i), keys) for i in seats]
    costs = np.stack([price(setting, state, int(i), there) for i, there in zip(seats, poses, strict=True)])
    state.placed[seats] = True
    number = {key: column for column, key in enumerate(keys)}
    ranked = []
    for plan, places in found:
        columns = np.array([number[place] for place in places])
        chosen = np.empty(len(seats), int)
        part, row = 0.0, 0
        for kind in (~benches, benches):
            cost = costs[kind][:, columns[row : row + kind.sum()]]
            at, to = linear_sum_assignment(cost)
            part, row = part + float(cost[at, to].sum()), row + int(kind.sum())
            chosen[np.flatnonzero(kind)[at]] = columns[row - int(kind.sum()) :][to]
        ranked.append((part + plan.ugly, plan.ugly, chosen))
    for _, ugly, chosen in sorted(ranked, key=lambda one: one[0])[:TRIED]:
        rows = list(zip(poses, chosen.tolist(), strict=True))
        position = np.stack([there.position[column] for there, column in rows])
        yield ugly, position, np.array([there.yaw[c] for there, c in rows]), np.zeros(len(seats))


def _places(
    setting: Setting, table: int, chairs: np.ndarray, benches: np.ndarray
) -> list[tuple[Plan, list[tuple[int, float]]]]:
    """The plans of a table with their places, as many as seats, those of the chairs first: side, metres along it."""
    kind = setting.kinds[table]
    long, deep = (0, 2) if kind.wall else _axes_of(setting, table)
    length, depth = float(setting.size[table, long]), float(setting.size[table, deep])
    if kind.access or not len(chairs) or (setting.size[benches, 0] > length + OVERHANG).any():
        return []
    width = float(setting.size[chairs, 0].max())
    if kind.wall:  # they sit along its front
        row = _in_a_row(len(chairs), length, width)
        return [] if row is None or len(benches) else [(Plan((0, len(chairs), 0, 0)), [(1, at) for at in row])]
    out = []
    for plan in plans(len(chairs), len(benches), _fit(length, width), _fit(depth, width)):
        ends = plan.chairs[2] + plan.chairs[3] > 0
        places: list[tuple[int, float]] = []
        for side, count in enumerate(plan.chairs):
            row = _in_a_row(count, length - 2 * TUCKED * ends if side < 2 else depth, width)
            places += [(side, at) for at in row or ()]
        if len(places) == len(chairs):
            out.append((plan, places + [(side, 0.0) for side in plan.benches]))
    return out


def _fit(length: float, width: float) -> int:
    return int((length + OVERHANG) // (width + ELBOWS))


def _in_a_row(count: int, length: float, width: float) -> list[float] | None:
    """Middles of so many chairs along a side, metres from its own; None where they do not fit."""
    spacing = max(min(length / max(count, 1), SPREAD), width + ELBOWS)
    if (count - 1) * spacing + width > length + OVERHANG:
        return None if count else []
    return [round((k - (count - 1) / 2) * spacing, 3) for k in range(count)]


def _poses(setting: Setting, state: State, table: int, i: int, places: list[tuple[int, float]]) -> Poses:
    """Poses of a seat at places around a table, pushed a little below it."""
    kind = setting.kinds[table]
    long, deep = (0, 2) if kind.wall else _axes_of(setting, table)
    own = float(setting.size[i, 2])
    near, _ = apart(setting, i, table)
    before, beside = (float(setting.size[table, axis]) / 2 + own / 2 + near for axis in (deep, long))
    rows = []
    for side, along in places:
        slot = ((along, -before, 0.0), (along, before, math.pi), (beside, along, -QUARTER), (-beside, along, QUARTER))
        lateral, forward, turn = slot[side]
        if long == 2:  # the same, turned by a quarter
            lateral, forward, turn = forward, -lateral, turn + QUARTER
        rows.append(out_of(state.position[table], float(state.yaw[table]), (lateral, forward, turn, 0.0)))
    return Poses.of(rows, float(state.position[i, 1]))
