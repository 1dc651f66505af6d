"""Whole groups move: a sofa with its table slides along its wall, chairs are dealt evenly around their table."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment

from echousd.repair.arrange.costs import price
from echousd.repair.arrange.places import at_anchor
from echousd.repair.arrange.setting import Poses, Setting, State

SLIDES = np.array([-1.6, -1.0, -0.6, -0.3, 0.0, 0.3, 0.6, 1.0, 1.6])  # metres
EVEN = 0.11  # places at a table that cost more are makeshift
GAIN = 0.05  # that a slide must save
AT_WALL = 0.15  # metres: what stands so near a wall slides along it


def paid_by(setting: Setting, state: State, i: int, own: np.ndarray) -> float:
    """What box i pays where it stands; own: (n,) float, the prices of their poses by themselves.

    Asked again for an equal state it is remembered; `state.regrets` must not change meanwhile.
    """
    key = (i, float(own[i]), state.position.tobytes(), state.yaw.tobytes(), state.placed.tobytes())
    if key not in state.bills:
        here = Poses(state.position[i : i + 1].copy(), state.yaw[i : i + 1].copy(), own[i : i + 1])
        state.bills[key] = float(price(setting, state, i, here)[0])
    return state.bills[key]


def seat_evenly(setting: Setting, state: State, own: np.ndarray) -> None:
    """Deal the chairs of every table to its own even places at once, where that costs less; `state` is changed.

    Arguments:
        state: all boxes placed. own: (n,) float, as `paid_by`; those of dealt chairs are changed.
    """
    for table in np.flatnonzero(setting.laid).tolist():
        seats = np.array([stance == "at" for stance in setting.stances]) & (setting.anchor == table)
        chairs = np.flatnonzero(seats & ~setting.fixed & ~setting.turned)
        if len(chairs) < 2 or len(chairs) < seats.sum() or not setting.standing(table):
            continue
        before = sum(paid_by(setting, state, int(i), own) for i in chairs)
        if before < GAIN * len(chairs):
            continue
        kept = state.position[chairs].copy(), state.yaw[chairs].copy(), own[chairs].copy()
        state.placed[chairs] = False
        first = at_anchor(setting, state, int(chairs[0]), table)
        places = Poses.of([row for row in first if row[3] <= EVEN], float(state.position[chairs[0], 1]))
        if len(places) >= len(chairs):
            cost = np.stack([price(setting, state, int(i), places) for i in chairs])
            rows, slots = linear_sum_assignment(cost)
            state.position[chairs[rows]], state.yaw[chairs[rows]] = places.position[slots], places.yaw[slots]
            own[chairs[rows]] = places.price[slots]
        state.placed[chairs] = True
        if sum(paid_by(setting, state, int(i), own) for i in chairs) > before - GAIN:
            state.position[chairs], state.yaw[chairs], own[chairs] = kept


def slide_groups(setting: Setting, state: State, own: np.ndarray) -> None:
    """Slide every group as one to where its members pay least together; `state` is changed.

    Arguments:
        state: all boxes placed. own: (n,) float, as `paid_by`.
    """
    for root in np.unique(setting.group).tolist():
        members = np.flatnonzero(setting.group == root)
        if len(members) < 2 or setting.fixed[members].any():
            continue
        before = sum(paid_by(setting, state, int(i), own) for i in members)
        if before < GAIN:
            continue
        for way in _ways(setting, state, root):
            shift = _best_slide(setting, state, members, own, way)
            if not shift.any():
                continue
            kept = state.position[members].copy()
            state.position[members] += shift
            after = sum(paid_by(setting, state, int(i), own) for i in members)
            if after < before - GAIN:
                before = after
            else:
                state.position[members] = kept


def _ways(setting: Setting, state: State, root: int) -> list[np.ndarray]:
    """Unit vectors (3,) along which a group may slide: along the wall of what it is about, or both ways."""
    yaw = float(state.yaw[root])
    side = np.array([np.cos(yaw), 0.0, -np.sin(yaw)])
    if setting.kinds[root].wall or setting.kinds[root].access:
        return [side]
    return [side, np.array([np.sin(yaw), 0.0, np.cos(yaw)])]


def _best_slide(setting: Setting, state: State, members: np.ndarray, own: np.ndarray, way: np.ndarray) -> np.ndarray:
    """(3,) float: the slide along a way that costs the members least among all others."""
    state.placed[members] = False
    total = np.zeros(len(SLIDES))
    for i in members.tolist():
        poses = Poses(
            state.position[i] + SLIDES[:, None] * way,
            np.full(len(SLIDES), state.yaw[i]),
            np.full(len(SLIDES), own[i]) + 0.0,
        )
        total += price(setting, state, i, poses)
    state.placed[members] = True
    return SLIDES[int(total.argmin())] * way
