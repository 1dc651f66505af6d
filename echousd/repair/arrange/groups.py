"""Whole groups move: a sofa with its table slides along its wall, a table with its chairs both ways."""

from __future__ import annotations

from itertools import product

import numpy as np

from echomodel.vocabulary import vocabulary
from echousd.repair.arrange.costs import least, price
from echousd.repair.arrange.setting import Poses, Setting, State
from echousd.repair.arrange.spread import bareness, bareness_of

FAR = np.array([0.3, 0.45, 0.6, 0.8, 1.0, 1.3, 1.6, 2.0, 2.5])
SLIDES = np.concatenate([-FAR[::-1], [0.0], FAR])  # metres
SHOVES = (-1.2, -0.6, 0.6, 1.2)  # metres that it makes way for another group
HOPE = 0.3  # share of what that one pays that it may cost to make way at most
CRAMPED = 2.0  # that a group pays together, from which on others make way for it
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


def slide_groups(setting: Setting, state: State, own: np.ndarray) -> None:
    """Slide every group as one to where its members pay least together; `state` is changed.

    Arguments:
        state: all boxes placed but lamps. own: (n,) float, as `paid_by`.
    """
    for members in _groups(setting):
        if setting.fixed[members].any():
            continue
        before = _bill(setting, state, members, own) + bareness(setting, state)
        if before < GAIN:
            continue
        for way in _ways(setting, state, int(setting.group[members[0]])):
            for slide in (_best_slide, _mirror_slide):
                shift = slide(setting, state, members, own, way, before - GAIN)
                if not shift.any():
                    continue
                kept = state.position[members].copy()
                state.position[members] += shift
                after = _bill(setting, state, members, own, before - GAIN)
                after += bareness(setting, state) if after < before - GAIN else 0.0
                if after < before - GAIN:
                    before = after
                else:
                    state.position[members] = kept


def make_way(setting: Setting, state: State, own: np.ndarray) -> None:
    """Slide the group next to the most cramped one away and this one after, if both pay less then; `state` is changed.

    Arguments:
        state: all boxes placed but lamps. own: (n,) float, as `paid_by`.
    """
    groups = [members for members in _groups(setting) if not setting.fixed[members].any()]
    if len(groups) < 2:
        return
    bills = [_bill(setting, state, members, own) for members in groups]
    members, cramped = groups[int(np.argmax(bills))], max(bills)
    if cramped < CRAMPED:
        return
    others = min((group for group in groups if group is not members), key=lambda one: _between(state, members, one))
    there = _bill(setting, state, others, own)
    kept = state.position.copy()
    best, found = cramped + there + bareness(setting, state) - GAIN, kept
    for way, step in product(_ways(setting, state, int(setting.group[others[0]])), SHOVES):
        state.position[others] += step * way
        if _bill(setting, state, others, own, there + HOPE * cramped) < there + HOPE * cramped:
            for own_way in _ways(setting, state, int(setting.group[members[0]])):
                state.position[members] += _best_slide(setting, state, members, own, own_way)
            after = _bill(setting, state, others, own, best)
            after += _bill(setting, state, members, own, best - after) if after < best else 0.0
            after += bareness(setting, state) if after < best else 0.0
            if after < best:
                best, found = after, state.position.copy()
        state.position[:] = kept
    state.position[:] = found


def _between(state: State, members: np.ndarray, others: np.ndarray) -> float:
    """Metres between the middles of two groups."""
    return float(np.linalg.norm(state.position[members].mean(0) - state.position[others].mean(0)))


def _groups(setting: Setting) -> list[np.ndarray]:
    """Numbers of the boxes of every group of two or more, but for lamps of the ceiling and what keeps to its wall."""
    stays = np.array([stance == "near" for stance in setting.stances], bool)  # a sideboard does not go with its table
    stays |= (setting.carrier >= 0) & stays[setting.carrier.clip(0)]  # nor does what stands on it
    standing = np.flatnonzero(~setting.hanging & ~stays)
    found = [standing[setting.group[standing] == root] for root in np.unique(setting.group[standing]).tolist()]
    return [members for members in found if len(members) > 1]


def _bill(setting: Setting, state: State, members: np.ndarray, own: np.ndarray, below: float = np.inf) -> float:
    """What boxes pay together; infinite where that is certainly not below a bound, which some of them may tell."""
    out = 0.0
    for i in members.tolist():
        out += paid_by(setting, state, i, own)
        if out >= below:
            return np.inf
    return out


def _ways(setting: Setting, state: State, root: int) -> list[np.ndarray]:
    """Unit vectors (3,) along which a group may slide: along the wall of what it is about, or both ways."""
    yaw = float(state.yaw[root])
    side = np.array([np.cos(yaw), 0.0, -np.sin(yaw)])
    if setting.kinds[root].wall or setting.kinds[root].access:
        return [side]
    return [side, np.array([np.sin(yaw), 0.0, np.cos(yaw)])]


def _best_slide(
    setting: Setting, state: State, members: np.ndarray, own: np.ndarray, way: np.ndarray, below: float = np.inf
) -> np.ndarray:
    """(3,) float: the slide along a way that costs the members least among all others; none where it cannot cost less
    than `below`."""
    slid = [
        Poses(
            state.position[i] + SLIDES[:, None] * way,
            np.full(len(SLIDES), state.yaw[i]),
            np.full(len(SLIDES), own[i]) + 0.0,
        )
        for i in members.tolist()
    ]
    floor = sum((least(setting, state, i, poses) for i, poses in zip(members.tolist(), slid, strict=True)), np.zeros(1))
    if not (floor[SLIDES != 0] < below).any():
        return np.zeros(3)
    state.placed[members], state.along[members] = False, True
    total = bareness_of(setting, state, members, SLIDES[:, None] * way)
    for i, poses in zip(members.tolist(), slid, strict=True):
        total += price(setting, state, i, poses)
    state.placed[members], state.along[members] = True, False
    return SLIDES[int(total.argmin())] * way


def _mirror_slide(
    setting: Setting, state: State, members: np.ndarray, own: np.ndarray, way: np.ndarray, below: float
) -> np.ndarray:
    """(3,) float: the slide along a way that brings two members which mirror each other to the room's middle."""
    mirrors = vocabulary().predicate_id("symmetrical_to")
    told = setting.triplets[setting.triplets[:, 1] == mirrors][:, [0, 2]]
    for pair in told[np.isin(told, members).all(1)]:
        away = setting.centre - state.position[pair][:, [0, 2]].mean(0)
        return float(away @ way[[0, 2]]) * way
    return np.zeros(3)
