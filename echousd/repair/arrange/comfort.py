"""What a person wishes beyond what must be: ways between groups, even chairs, room to pull them out, a free view."""

from __future__ import annotations

import numpy as np

from echomodel.rules.sets import NEAR
from echomodel.vocabulary import vocabulary
from echousd.repair.arrange.outlook import to_wall
from echousd.repair.arrange.overlaps import beyond, depths
from echousd.repair.arrange.setting import Poses, Setting, State
from echousd.repair.geometry import depth_inside

UNEVEN = 1.0  # for chairs of a table whose middle lies half a table off its own
ODD = 0.9  # half tables by which it may, of an odd number of seats
PULLED, AT_WALL = 1.6, 1.3  # for a chair that cannot be pulled out before furniture, before a wall
PULL, PULL_WALL = 0.4, 0.3  # metres behind a chair
EASE, TIGHT = 0.7, 0.9  # metres behind a chair that one would like, and the price of none of them
STRIP, FLUSH, PASSED = 0.6, 0.06, 0.4  # for a bed so many metres off the wall beside it: of no use to anybody
HEMMED = 1.2  # for a side of a table right at a wall
WALKED, ELBOWS = 1.05, 0.5  # metres from a table's side to the wall where people sit, and where nobody does
CLOSE = 4.0  # per metre that something of the walls cannot be as close by a table as it is told to
FACED = 3.0  # for a side table or lamp before its sofa or bed, not beside it
HIDDEN = 3.5  # for something high between a screen and its viewer
HIGH = 0.65  # metres
BESIDE = 0.3  # metres beside the line of sight
ON_SIGHT = np.linspace(0.15, 0.85, 7)[:, None]  # places on the line of sight
ENDS = 4  # more chairs than that sit at the ends of a table, too
SOLID = ("sofa", "board", "bed", "storage")


def uncomfortable(
    setting: Setting, state: State, i: int, poses: Poses, others: np.ndarray, gap: np.ndarray
) -> np.ndarray:
    """(K,) float: what box i pays at each pose for how near it stands to others and what it spoils.

    Arguments:
        others: (m,) int, boxes that are placed. gap: (K, m) float, metres between box i at each pose and them.
    """
    wish, dear = setting.wishes[0][i, others], setting.wishes[1][i, others]
    near = wish > 0
    out = (dear[near] * (1 - gap[:, near] / wish[near]).clip(0.0, 1.0)).sum(1)
    if setting.stances[i] == "foot" and setting.seats[i]:  # a bench
        out = out + _uneven(setting, state, i, poses)
    if setting.stances[i] == "at":
        out = out + _uneven(setting, state, i, poses) + _boxed_in(setting, state, i, poses, others)
    if setting.stances[i] == "beside":
        out = out + FACED * _before(setting, state, i, poses)
    if setting.laid[i] and not (setting.kinds[i].wall or setting.kinds[i].access):
        out = out + HEMMED * _hemmed(setting, i, poses)
    if setting.kinds[i].role == "bed":
        out = out + STRIP * _strips(setting, i, poses)
    return out + _hiding(setting, state, i, poses)


def _strips(setting: Setting, i: int, poses: Poses) -> np.ndarray:
    """(K,): at how many sides of a bed a strip is left to the wall that is too narrow to get in by."""
    side = np.stack([np.cos(poses.yaw), -np.sin(poses.yaw)], -1)
    out = np.zeros(len(poses))
    for sign in (-1.0, 1.0):
        near, far = (
            depth_inside(setting.floor, poses.position[:, [0, 2]] + sign * (setting.size[i, 0] / 2 + away) * side) > 0
            for away in (FLUSH, PASSED)
        )
        out += near & ~far
    return out


def _before(setting: Setting, state: State, i: int, poses: Poses) -> np.ndarray:
    """(K,) bool: the middle of something that goes beside a sofa or bed lies ahead of its front."""
    seat = int(setting.anchor[i])
    if seat < 0 or not state.placed[seat] or setting.kinds[seat].role not in ("sofa", "bed"):
        return np.zeros(len(poses), bool)
    return _local(state.position[seat], float(state.yaw[seat]), poses.position)[:, 1] > setting.size[seat, 2] / 2


def _hemmed(setting: Setting, i: int, poses: Poses) -> np.ndarray:
    """(K,): how much of the way around a table the walls take, summed over its four sides; where furniture of the walls
    is told to stand close by, metres by which it cannot instead of the side where it can."""
    taken, ahead = [], []
    width, depth = setting.size[i, [0, 2]] / 2
    chairs = float(setting.sitting[(setting.anchor == i) & setting.seats].sum())
    for axis, half, other in ((1, depth, width), (0, width, depth)):
        sat_at = other >= half or chairs > ENDS
        for sign in (-1.0, 1.0):
            free = to_wall(setting, poses.position[:, [0, 2]], sign * poses.axes[:, axis]) - half
            taken.append((1 - free / (WALKED if sat_at else ELBOWS)).clip(0.0, 1.0))
            ahead.append(free)
    out = np.sum(taken, 0)
    close = vocabulary().predicate_id("close_by")
    told, other, _ = setting.told[i]
    for j in other[told[:, 1] == close].tolist():
        if setting.kinds[j].wall and setting.kinds[j].role != "sofa":
            side = np.argmin(ahead, 0)[None]
            off = np.take_along_axis(np.stack(ahead), side, 0)[0] - setting.size[j, 2] - NEAR
            out = out - np.take_along_axis(np.stack(taken), side, 0)[0] + CLOSE * off.clip(0.0, 2.0)
            break
    return out


def _uneven(setting: Setting, state: State, i: int, poses: Poses) -> np.ndarray:
    """(K,): how far the middle of the chairs around a table is off its own, in half sides of the table."""
    table = int(setting.anchor[i])
    if table < 0 or not setting.laid[table] or not state.placed[table]:
        return np.zeros(len(poses))
    seats = (setting.anchor == table) & state.placed & setting.seats
    mates = np.array([j for j in np.flatnonzero(seats) if j != i], int)
    half = setting.size[table, [0, 2]] / 2 + 0.3
    own = _local(state.position[table], float(state.yaw[table]), poses.position) / half
    there = _local(state.position[table], float(state.yaw[table]), state.position[mates]).reshape(-1, 2) / half
    places = setting.sitting
    odd = places[(setting.anchor == table) & setting.seats].sum() % 2  # one sits alone
    middle = np.abs(own * places[i] + (there * places[mates, None]).sum(0))
    return UNEVEN * (middle - ODD * odd).clip(min=0.0).sum(1)


def _local(position: np.ndarray, yaw: float, points: np.ndarray) -> np.ndarray:
    """(K, 2): lateral and forward of points (K, 3) in the frame of a box."""
    away = points[:, [0, 2]] - position[[0, 2]]
    c, s = np.cos(yaw), np.sin(yaw)
    return np.stack([c * away[:, 0] - s * away[:, 1], s * away[:, 0] + c * away[:, 1]], -1)


def _boxed_in(setting: Setting, state: State, i: int, poses: Poses, others: np.ndarray) -> np.ndarray:
    """(K,): the price of a chair that cannot be pulled out."""
    back = -np.stack([np.sin(poses.yaw), np.zeros_like(poses.yaw), np.cos(poses.yaw)], -1)

    def behind(depth: float) -> tuple[np.ndarray, Poses]:
        size = np.array([0.7 * setting.size[i, 0], 0.8, depth])
        return size, Poses(poses.position + (setting.size[i, 2] / 2 + depth / 2 + 0.01) * back, poses.yaw, poses.price)

    solid = [j for j in others if setting.standing(j) and setting.kinds[j].role in SOLID and setting.anchor[i] != j]
    size, space = behind(PULL)
    deep = depths(size, space, setting.size[solid], state.position[solid], state.yaw[solid])
    size, space = behind(PULL_WALL)
    out = PULLED * (deep > 0.02).any(1) + AT_WALL * (beyond(setting, size, space) > 0.02)
    size, space = behind(EASE)
    deep = depths(size, space, setting.size[solid], state.position[solid], state.yaw[solid])
    tight = np.maximum(deep.max(1, initial=0.0), beyond(setting, size, space))
    return out + TIGHT * (tight / EASE).clip(0.0, 1.0)


def _hiding(setting: Setting, state: State, i: int, poses: Poses) -> np.ndarray:
    """(K,): the price of standing in the line of sight to a screen, or of a screen that something hides."""
    out = np.zeros(len(poses))
    high = setting.size[:, 1] > HIGH
    screens = [k for k, stance in enumerate(setting.stances) if stance == "opposite" and setting.anchor[k] >= 0]
    for k in screens:
        seat = int(setting.anchor[k])
        if i == k and state.placed[seat]:
            ends = poses.position[:, None, [0, 2]], state.position[seat, [0, 2]]
            points = ends[0] + ON_SIGHT * (ends[1] - ends[0])
            for j in np.flatnonzero(state.placed & high).tolist():
                if j not in (seat, k) and setting.standing(j):
                    inside = _within(points, state.position[j], state.yaw[j], setting.size[j])
                    out += HIDDEN * inside.any(1)
        elif i not in (k, seat) and high[i] and state.placed[k] and state.placed[seat]:
            if not setting.standing(i):
                continue
            start, end = state.position[k, [0, 2]], state.position[seat, [0, 2]]
            points = (start + ON_SIGHT * (end - start))[None]
            away = points - poses.position[:, None, [0, 2]]
            c, s = np.cos(poses.yaw)[:, None], np.sin(poses.yaw)[:, None]
            lateral = np.abs(c * away[..., 0] - s * away[..., 1]) < setting.size[i, 0] / 2 + BESIDE
            forward = np.abs(s * away[..., 0] + c * away[..., 1]) < setting.size[i, 2] / 2 + BESIDE
            out += HIDDEN * (lateral & forward).any(1)
    return out


def _within(points: np.ndarray, position: np.ndarray, yaw: float, size: np.ndarray) -> np.ndarray:
    """(K, P) bool: which points (K, P, 2) lie in a footprint that is grown by `BESIDE`."""
    away = points - position[[0, 2]]
    c, s = np.cos(yaw), np.sin(yaw)
    lateral = np.abs(c * away[..., 0] - s * away[..., 1]) < size[0] / 2 + BESIDE
    return lateral & (np.abs(s * away[..., 0] + c * away[..., 1]) < size[2] / 2 + BESIDE)
