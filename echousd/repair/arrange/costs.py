"""What a pose costs: running into others, leaving the floor, broken relations, blocked fronts, way from the draft."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echomodel.rules.sets import APART
from echousd.repair.arrange.comfort import uncomfortable
from echousd.repair.arrange.outlook import missing, unseen
from echousd.repair.arrange.overlaps import beyond, depths
from echousd.repair.arrange.setting import Poses, Setting, State, Zones
from echousd.repair.placements import placement_margins_at
from echousd.repair.relations import margins_at

HIT, DEEP = 8.0, 30.0  # for running into something at all, and per metre
BROKEN, FAR = 12.0, 6.0  # for a broken relation at all, and per metre or ratio that it is missed by
GRAZE = 0.01  # metres
PULL, TURN = 0.35, 0.25  # per metre from the draft, and for looking the other way than the draft
FOLLOWS = 0.3  # share of that pull of chairs at their table: they go where it goes
FARTHEST = 4.0  # metres that the pull counts
UNPLACED, GUESSED = 0.15, 0.4  # weight of relations to what is not placed yet: as drafted, at what it attends
BLOCKED = 3.0  # for a front that cannot be opened
ALIKE = 0.8  # metres: poses that are nearer count as the same when one is regretted
CROWDED = 0.7  # for a chair in the way of a front
SEATED, ENDS = 0.75, 4  # metres from a table to behind its chairs; more chairs than that sit at its ends, too
ELBOWS, ELBOW = 1.5, 0.2  # for a seat or lamp so many metres before a seat of its own group
TUCKED = 0.35  # metres of the space before a second sofa that the coffee table of the group may take
TABLES = ("before", "foot", "near", "opposite", "at")  # stances of what may stand before a seat of its group
FOOT = 0.4  # metres at the foot of a bed
BEDSIDE, AROUND = 0.38, 0.3  # metres beside a bed, and beyond its foot on the way there
PULLED = ((0.4, 1.2), (0.65, 0.6))  # metres behind a chair, and what it costs to take them
KNEES, LEGS = 0.55, 0.45  # metres before a sofa, before an armchair
AHEAD, SPOILT = 1.25, 1.6  # metres before a sofa that other groups leave to its own, and for a piece in there
TAKEN, BEFORE_SHELVES = 0.8, 0.8  # metres to stand before shelves and cupboards, and for a piece in there
GLARE = 0.2  # metres of a stand before a window
SLACK = 0.01  # metres or ratio by which relations are to hold
NO_ZONES = Zones(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0), np.zeros(0, int))


def least(setting: Setting, state: State, i: int, poses: Poses) -> np.ndarray:
    """(K,) float: what box i pays at each pose at the least, whatever else there is: the pose itself and its way."""
    off = np.linalg.norm((poses.position - setting.draft[i])[:, [0, 2]], axis=1)
    turned = 0.5 * (1 - np.cos(poses.yaw - setting.heading[i]))
    pull = PULL * (FOLLOWS if setting.stances[i] == "at" and setting.anchor[i] >= 0 else 1.0)
    out = poses.price + pull * np.minimum(off, FARTHEST) + TURN * turned
    for x, z, yaw, paid in state.regrets.get(i, ()):
        near = np.hypot(poses.position[:, 0] - x, poses.position[:, 2] - z) < ALIKE
        out = out + paid * (near & (np.cos(poses.yaw - yaw) > 0.9))
    return out


@dataclass(frozen=True, eq=False)
class Known:
    """The part of the cost that is soon told, of box i at K poses.

    Arguments:
        others: (m,) int, the other boxes that are placed. depth: (K, m) float, as `overlaps.depths` of them.
        least, hit, left: (K,) float, what the pose itself costs, running into others, and leaving the floor.
        aside: (K, s) float, metres by which the relations that name a side are missed.
        floor: (K,) float, what the pose costs at the least.
    """

    others: np.ndarray
    depth: np.ndarray
    least: np.ndarray
    hit: np.ndarray
    left: np.ndarray
    aside: np.ndarray
    floor: np.ndarray

    def take(self, rows: np.ndarray) -> Known:
        """The same of the poses of these numbers."""
        of = (self.depth, self.least, self.hit, self.left, self.aside, self.floor)
        return Known(self.others, *(values[rows] for values in of))


def soon_told(setting: Setting, state: State, i: int, poses: Poses, bound: np.ndarray | None = None) -> Known:
    """The part of `price` that costs little time; bound: (K,) float, `least` of the poses where it is known."""
    bound = least(setting, state, i, poses) if bound is None else bound
    others = np.flatnonzero(state.placed)
    others = others[others != i]
    size = setting.size[i]
    depth = depths(size, poses, setting.size[others], state.position[others], state.yaw[others])
    beyond_shared = np.maximum(depth - setting.shared[i, others], 0.0)
    hit = (HIT * (beyond_shared > GRAZE) + DEEP * beyond_shared).sum(1)
    out = np.maximum(beyond(setting, size, poses), 0.0)
    left = HIT * (out > GRAZE) + DEEP * out
    aside = _aside(setting, state, i, poses)
    floor = bound + hit + left
    if aside.shape[1]:
        _, other, sides = setting.told[i]
        weight = _weight(setting, state, i, other[sides])
        floor = floor + ((BROKEN * (aside > SLACK) + FAR * aside) * weight).sum(1)
    return Known(others, depth, bound, hit, left, aside, floor)


def price(
    setting: Setting, state: State, i: int, poses: Poses, known: Known | None = None, below: float = np.inf
) -> np.ndarray:
    """(K,) float: what it costs to put box i at each pose among what is placed.

    Arguments:
        known: `soon_told` of the poses. below: costs that are certainly not less may be told as infinite.
    """
    known = known or soon_told(setting, state, i, poses)
    total = known.least + missing(setting, state, i, poses) + unseen(setting, state, i, poses)
    if setting.standing(i):
        total += uncomfortable(setting, state, i, poses, known.others, -known.depth)
    total += known.hit
    total += known.left
    if setting.standing(i):
        total += _in_zones(setting, state, i, poses, known.others)
    cheap = np.flatnonzero(total < below)
    out = np.full(len(poses), np.inf)
    if len(cheap):
        few = poses.take(cheap)
        out[cheap] = total[cheap] + _relations(setting, state, i, few, known.aside[cheap])
        out[cheap] += _misplaced(setting, state, i, few)
    return out


def _in_zones(setting: Setting, state: State, i: int, poses: Poses, others: np.ndarray) -> np.ndarray:
    at_home, near = setting.at_home[i].tolist(), others.tolist()
    home = [j for j in near if at_home[j]]
    circle = [j for j in home if setting.stances[j] not in TABLES]
    # of its own group's seats it leaves the knees free, and a table those of a second sofa
    kept_free: list[int] = []
    if setting.stances[i] not in TABLES:
        kept_free = [j for j in circle if setting.kinds[j].role in ("sofa", "seat")]
    elif setting.stances[i] == "before":
        kept_free = [j for j in circle if setting.stances[j] == "with"]
    strangers = [j for j in near if not at_home[j]]
    doors, strange = setting.doors, fronts(setting, state, strangers)
    light = setting.windows if setting.stances[i] == "opposite" else NO_ZONES  # of a screen
    own = fronts(setting, state, kept_free)
    close = own.price == BLOCKED  # the wider space before a sofa is for other groups to leave
    at_door, glare, before, knees = _depths_of(setting.size[i], poses, (doors, light, strange, own))
    out = (np.maximum(at_door, 0) > 0.04) @ doors.price
    out += (glare > GLARE) @ light.price
    out = out + (before > 0.03) @ strange.price * (CROWDED / BLOCKED if setting.movable[i] else 1.0)
    if kept_free:
        out = out + ELBOWS * (knees[:, close] > (TUCKED if setting.stances[i] == "before" else ELBOW)).sum(1)
    front = own_front(setting, i)
    if front is None:
        return out
    if setting.kinds[i].role == "sofa":
        out = out + _spoilt(setting, state, i, poses, strangers)
    size, forward = front
    ahead = Poses(poses.position + forward * _front(poses.yaw), poses.yaw, poses.price)
    seated = circle if setting.kinds[i].role in ("sofa", "seat") else []
    low = [j for j in home if setting.stances[j] == "before"] if setting.stances[i] == "with" else []
    solid = [j for j in strangers if setting.standing(j) and not setting.movable[j]]
    every = [*seated, *low, *solid]
    deep = depths(size, ahead, setting.size[every], state.position[every], state.yaw[every])
    parts = deep[:, : len(seated)], deep[:, len(seated) : len(every) - len(solid)], deep[:, len(every) - len(solid) :]
    for part, allowed in zip(parts, (ELBOW, TUCKED), strict=False):
        if part.shape[1]:
            out = out + ELBOWS * (part > allowed).sum(1)
    out = out + BLOCKED * (parts[2] > 0.03).sum(1)
    return out + BLOCKED * (beyond(setting, size, ahead) > 0.05)


def _spoilt(setting: Setting, state: State, i: int, poses: Poses, strangers: list[int]) -> np.ndarray:
    """(K,): what other groups' pieces in the space that a sofa looks into cost it."""
    size, forward = _ahead_of(setting, i, AHEAD)
    ahead = Poses(poses.position + forward * _front(poses.yaw), poses.yaw, poses.price)
    there = [j for j in strangers if setting.standing(j) and setting.stances[j] != "opposite"]
    share = np.where(setting.movable[there], CROWDED / BLOCKED, 1.0)
    deep = depths(size, ahead, setting.size[there], state.position[there], state.yaw[there])
    return SPOILT * (deep > 0.03) @ share


def _ahead_of(setting: Setting, i: int, depth: float) -> tuple[np.ndarray, float]:
    """Size (3,) of the space of a depth before a box and how far before the box's centre its own centre is."""
    size = np.array([0.9 * setting.size[i, 0], min(float(setting.size[i, 1]), 1.8), depth])
    return size, float(setting.size[i, 2] / 2 + depth / 2 + 0.005)


def _depths_of(size: np.ndarray, poses: Poses, zones: Sequence[Zones]) -> list[np.ndarray]:
    """(K, z) float for each of some zones: how deep a box (3,) at each pose runs into them, metres."""
    counts = [len(one.yaw) for one in zones]
    joined = [np.concatenate([getattr(one, name) for one in zones]) for name in ("size", "position", "yaw")]
    return np.split(depths(size, poses, *joined), np.cumsum(counts)[:-1], axis=1)


def own_front(setting: Setting, i: int) -> tuple[np.ndarray, float] | None:
    """Size (3,) of the space before a front and how far before the box's centre its own centre is; None = no front."""
    depth, role = 0.75 * setting.kinds[i].access, setting.kinds[i].role
    depth = KNEES if role == "sofa" else LEGS if setting.stances[i] == "company" else 0.0 if role == "seat" else depth
    if depth <= 0 or not setting.standing(i):
        return None
    return _ahead_of(setting, i, depth)


def fronts(setting: Setting, state: State, boxes: list[int]) -> Zones:
    """The spaces before the fronts of some boxes and at both sides of beds."""
    rows: list[tuple[float, ...]] = []
    for j in boxes:
        waits = bool(setting.laid[j]) and bool((setting.seats & (setting.anchor == j) & ~state.placed).any())
        key = (j, waits, *state.position[j].tolist(), float(state.yaw[j]))
        if key not in state.zones:
            state.zones[key] = [tuple(map(float, row)) for row in _zones_of(setting, state, j)]
        rows += state.zones[key]
    table = np.array(rows, float).reshape(-1, 9)
    return Zones(table[:, :3], table[:, 3:6], table[:, 6], table[:, 7], table[:, 8].astype(int))


def _zones_of(setting: Setting, state: State, j: int) -> list[tuple[float, ...]]:
    rows: list[tuple[float, ...]] = []
    front = own_front(setting, j)
    x, _, z = state.position[j]
    c, s = np.cos(state.yaw[j]), np.sin(state.yaw[j])
    if front is not None:
        size, forward = front
        rows.append((*size, x + s * forward, 0.02, z + c * forward, state.yaw[j], BLOCKED, j))
        wide = {"sofa": (AHEAD, SPOILT), "storage": (TAKEN, BEFORE_SHELVES)}.get(setting.kinds[j].role)
        if wide:
            size, forward = _ahead_of(setting, j, wide[0])
            rows.append((*size, x + s * forward, 0.02, z + c * forward, state.yaw[j], wide[1], j))
    if setting.laid[j] and not setting.kinds[j].access:
        rows += _seats(setting, state, j)
    if setting.stances[j] == "at" and not setting.kinds[j].solid:
        for depth, cost in PULLED:
            away = setting.size[j, 2] / 2 + depth / 2 + 0.01
            size = np.array([0.7 * setting.size[j, 0], 0.8, depth])
            rows.append((*size, x - s * away, 0.02, z - c * away, state.yaw[j], cost, j))
    if setting.kinds[j].role == "bed":
        for side in (-1, 1):
            lateral = side * (setting.size[j, 0] / 2 + BEDSIDE / 2 + 0.01)
            start, end = -0.15 * setting.size[j, 2], 0.5 * setting.size[j, 2] + AROUND
            size, forward = np.array([BEDSIDE, 1.0, end - start]), (start + end) / 2
            at = (x + c * lateral + s * forward, 0.02, z - s * lateral + c * forward)
            rows.append((*size, *at, state.yaw[j], 0.5 * BLOCKED, j))
        forward = setting.size[j, 2] / 2 + FOOT / 2
        size = np.array([0.8 * setting.size[j, 0], 1.0, FOOT])
        rows.append((*size, x + s * forward, 0.02, z + c * forward, state.yaw[j], 0.5 * BLOCKED, j))
    return rows


def _seats(setting: Setting, state: State, j: int) -> list[tuple[float, ...]]:
    """The spaces along the sides of a table at which chairs that are not placed yet are to stand."""
    chairs = setting.seats & (setting.anchor == j)
    if not (chairs & ~state.placed).any():
        return []
    x, _, z = state.position[j]
    c, s = np.cos(state.yaw[j]), np.sin(state.yaw[j])
    width, depth = setting.size[j, [0, 2]]
    rows = []
    for across, length, deep in ((0, width, depth), (1, depth, width)):
        if length < deep and chairs.sum() <= ENDS:
            continue
        for side in (-1, 1):
            away = side * (deep / 2 + SEATED / 2)
            lateral, forward = (away, 0.0) if across else (0.0, away)
            size = (SEATED, 1.0, 0.9 * length) if across else (0.9 * length, 1.0, SEATED)
            at = (x + c * lateral + s * forward, 0.02, z - s * lateral + c * forward)
            rows.append((*size, *at, state.yaw[j], 0.6 * BLOCKED, j))
    return rows


def _front(yaw: np.ndarray) -> np.ndarray:
    return np.stack([np.sin(yaw), np.zeros_like(yaw), np.cos(yaw)], -1)


def _aside(setting: Setting, state: State, i: int, poses: Poses) -> np.ndarray:
    """(K, s): metres by which the relations of box i that name a side are missed.

    Sides are a matter of the centres alone here: whatever runs into the other pays for that anyway.
    """
    _, other, sides = setting.told[i]
    if not sides.any():
        return np.zeros((len(poses), 0))
    other = other[sides]
    where = state.position[other]
    asked = setting.order[other, i]
    along = (poses.position[:, None, [0, 2]] - where[:, [0, 2]]) * asked
    return np.where(asked != 0, APART + SLACK - along, 0.0).max(2).clip(min=0)


def _relations(setting: Setting, state: State, i: int, poses: Poses, aside: np.ndarray) -> np.ndarray:
    """Broken relations between box i and others, those that are not placed at a small weight."""
    told, other, sides = setting.told[i]
    count = len(poses)
    if not len(told):
        return np.zeros(count)
    weight = _weight(setting, state, i, other)
    missed = np.zeros((count, len(told)))
    missed[:, sides] = aside
    asked = ~sides & (weight > 0)
    if asked.any():
        missed[:, asked] = _missed(setting, state, i, poses, told[asked])
    return ((BROKEN * (missed > SLACK) + FAR * missed) * weight).sum(1)


def _weight(setting: Setting, state: State, i: int, other: np.ndarray) -> np.ndarray:
    """(r,) float: how much relations of box i count, by their other ends; what attends it and lamps follow."""
    anchor = setting.anchor[other]
    guess = np.where((anchor >= 0) & state.placed[anchor], GUESSED, UNPLACED)
    follows = (anchor == i) | setting.hanging[other] | state.along[other]
    return np.where(state.placed[other], 1.0, np.where(follows, 0.0, guess))


def _misplaced(setting: Setting, state: State, i: int, poses: Poses) -> np.ndarray:
    """(K,): broken placements that name box i; those that name what is not placed at a small weight."""
    out = np.zeros(len(poses))
    for one in setting.stated:
        involved = [one.subject, *one.others]
        if i not in involved:
            continue
        margin = placement_margins_at(
            one, i, (poses.position, poses.yaw), setting.surroundings, setting.categories, setting.size,
            state.position, state.yaw,
        )  # fmt: skip
        missed = np.maximum(SLACK - margin, 0.0)
        weight = 1.0 if all(state.placed[k] for k in involved if k != i) else UNPLACED
        out = out + weight * (BROKEN * (missed > SLACK) + FAR * missed)
    return out


def _missed(setting: Setting, state: State, i: int, poses: Poses, told: np.ndarray) -> np.ndarray:
    """(K, r): by how much relations `told` (r, 3) are missed with box i at each pose, the others as they are so far."""
    margin = margins_at(
        i, (poses.position, poses.yaw), told, setting.size, state.position, state.yaw, rules=setting.rules,
        centre=setting.centre, fronts=setting.fronts,
    )  # fmt: skip
    return np.maximum(SLACK - margin, 0.0)
