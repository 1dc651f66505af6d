"""What a pose leaves to others: places for those who attend the piece, and a view between a screen and its seat."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from echousd.repair.arrange.attending import slots_at, stance
from echousd.repair.arrange.overlaps import beyond, depths
from echousd.repair.arrange.places import wrapped
from echousd.repair.arrange.setting import Poses, Setting, State
from echousd.repair.arrange.slots import Slot
from echousd.repair.geometry import depth_inside

MISSING = 1.6  # for each place that those who attend a piece would not find
UNTOLD = 5.0  # for each of these that cannot stand on the side that is stated
GOOD = 0.11  # price of a place up to which it is none for want of a better one
BESIDE = 0.8  # share of its half extent that a place lies off the piece's middle, to be on a side of it
ELBOW = 0.3  # metres behind a chair, to pull it out
VIEW = 1.1  # per metre that a screen is beside the line of sight
OFF_AXIS, ASIDE = 0.4, 1.5  # tangent of the angle from which on a screen is off its viewer's axis, and for that
NEAR, FAR = 1.6, 4.3  # metres between a screen and its viewer
RANGE, OUT_OF_RANGE = 5.1, 2.0  # metres from which on nobody watches, and for that
SHIFTS = (0.0, -0.4, 0.4)  # metres beside the axis at which a place for a screen is looked for
BLOCKED = 2.0  # for such a place that a door, furniture or a corner takes
TURNED_AWAY, BACK = math.cos(math.radians(115.0)), 1.8  # for a seat that turns the back on its group's screen


def missing(setting: Setting, state: State, i: int, poses: Poses) -> np.ndarray:
    """(K,): the price of places that those who attend box i, and are not placed, would miss at each pose."""
    out = np.zeros(len(poses))
    for slots, asked, members in _waiting(setting, state, i):
        if (members[0], i) not in setting.spots:
            best = [slot for slot in slots if slot[3] <= GOOD]
            good = len(_distinct(best, 0.3))
            rest = slots if asked.any() else ()
            setting.spots[members[0], i] = np.array(_distinct([*best, *rest], 0.3)).reshape(-1, 2), good
        local, good = setting.spots[members[0], i]
        if not len(local):  # all of its places are far-fetched
            continue
        c, s = np.cos(poses.yaw)[:, None], np.sin(poses.yaw)[:, None]
        offset = np.stack([c * local[:, 0] + s * local[:, 1], c * local[:, 1] - s * local[:, 0]], -1)
        points = poses.position[:, None, [0, 2]] + offset
        size = setting.size[members[0]]
        reach = 0.35 * float(min(size[0], size[2])) + ELBOW * (setting.stances[members[0]] == "at")
        free = _free(setting, state, i, points, reach)
        told = (offset * asked > BESIDE * _half(setting, i, poses)[:, None]) | (asked == 0)
        kept = free & told.all(-1)
        out += MISSING * np.maximum(min(len(members), good) - kept[:, :good].sum(1), 0)
        if asked.any():
            out += (UNTOLD - MISSING) * np.maximum(min(len(members), len(local)) - kept.sum(1), 0)
    return out


def _half(setting: Setting, i: int, poses: Poses) -> np.ndarray:
    """(K, 2) float: half of what box i takes along x and z at each pose, metres."""
    cos, sin = (np.abs(turn) for turn in poses.turns)
    width, depth = setting.size[i, [0, 2]] / 2
    return np.concatenate([cos * width + sin * depth, sin * width + cos * depth], 1)


def _waiting(setting: Setting, state: State, i: int) -> list[tuple[list[Slot], np.ndarray, list[int]]]:
    """Those who attend box i and are not placed: their slots, the side that is stated for them (2,), who they are."""
    groups: dict[tuple[float, ...], tuple[list[Slot], np.ndarray, list[int]]] = {}
    for j in np.flatnonzero((setting.anchor == i) & ~state.placed).tolist():
        if setting.carrier[j] == i:
            continue
        slots = slots_at(setting, j, i)
        if slots:
            asked = setting.order[i, j]
            key = (*setting.size[j].round(2).tolist(), *asked.tolist(), float(setting.kinds[j].name == ""))
            groups.setdefault(key, (slots, asked, []))[2].append(j)
    return list(groups.values())


def _free(setting: Setting, state: State, i: int, points: np.ndarray, reach: float) -> np.ndarray:
    """(K, S) bool: which points (K, S, 2) lie on the floor and in nothing that stands, with `reach` metres to spare."""
    free = depth_inside(setting.floor, points.reshape(-1, 2)).reshape(points.shape[:2]) > reach
    for j in np.flatnonzero(state.placed).tolist():
        if j == i or not setting.standing(j) or setting.anchor[j] == i:
            continue
        away = points - state.position[j, [0, 2]]
        c, s = math.cos(state.yaw[j]), math.sin(state.yaw[j])
        lateral = np.abs(c * away[..., 0] - s * away[..., 1]) - setting.size[j, 0] / 2
        forward = np.abs(s * away[..., 0] + c * away[..., 1]) - setting.size[j, 2] / 2
        free &= np.maximum(lateral, forward) > reach
    return free


def _distinct(slots: Sequence[Slot], apart: float) -> list[tuple[float, float]]:
    out: list[tuple[float, float]] = []
    for lateral, forward, _, _ in slots:
        if all(math.hypot(lateral - a, forward - b) > apart for a, b in out):
            out.append((lateral, forward))
    return out


def unseen(setting: Setting, state: State, i: int, poses: Poses) -> np.ndarray:
    """(K,): what it costs a screen not to be before its sofa or bed, these not to have a place for it before them, and
    others who sit there to turn the back on it."""
    out = np.zeros(len(poses))
    anchor = int(setting.anchor[i])
    if anchor >= 0 and state.placed[anchor] and stance(setting, i, anchor) == "opposite":
        out += _view(poses.position, poses.yaw, state.position[anchor], state.yaw[anchor])
    if setting.stances[i] in ("company", "with") and setting.kinds[i].front:
        out += _behind(setting, state, i, poses)
    for j in np.flatnonzero(setting.anchor == i).tolist():
        if stance(setting, j, i) == "opposite":
            if state.placed[j]:
                out += _view(state.position[j], state.yaw[j], poses.position, poses.yaw)
            elif setting.standing(j):
                out += _no_place(setting, state, i, j, poses)
    return out


def _view(screen: np.ndarray, screen_yaw: np.ndarray, seat: np.ndarray, seat_yaw: np.ndarray) -> np.ndarray:
    away = (screen - seat)[..., [0, 2]]
    lateral = np.abs(np.cos(seat_yaw) * away[..., 0] - np.sin(seat_yaw) * away[..., 1])
    forward = np.sin(seat_yaw) * away[..., 0] + np.cos(seat_yaw) * away[..., 1]
    facing = np.abs(wrapped(np.asarray(screen_yaw - seat_yaw - math.pi)))
    aside = ASIDE * (lateral > OFF_AXIS * forward)
    return VIEW * np.minimum(lateral, 3.0) + np.minimum(1.6 * facing, 3.0) + aside + _far(forward)


def _far(forward: np.ndarray) -> np.ndarray:
    """What it costs that so many metres lie between a screen and its viewer."""
    far = np.maximum(forward - FAR, 0) + 2 * np.maximum(NEAR - forward, 0)
    return 0.6 * np.minimum(far, 4.0) + OUT_OF_RANGE * (forward > RANGE)


def _behind(setting: Setting, state: State, i: int, poses: Poses) -> np.ndarray:
    """(K,): the price of turning the back on the screen that one's group watches."""
    out = np.zeros(len(poses))
    for k in np.flatnonzero(state.placed & (setting.group == setting.group[i])).tolist():
        if setting.stances[k] != "opposite":
            continue
        away = (state.position[k] - poses.position)[:, [0, 2]]
        forward = np.sin(poses.yaw) * away[:, 0] + np.cos(poses.yaw) * away[:, 1]
        out += BACK * (forward < TURNED_AWAY * np.linalg.norm(away, axis=1))
    return out


def _no_place(setting: Setting, state: State, i: int, screen: int, poses: Poses) -> np.ndarray:
    """(K,): what the best place at the wall before each pose would cost a screen that is not placed yet."""
    width, height, depth = setting.size[screen]
    front = np.stack([np.sin(poses.yaw), np.cos(poses.yaw)], -1)
    side = np.stack([np.cos(poses.yaw), -np.sin(poses.yaw)], -1)
    others = [j for j in np.flatnonzero(state.placed).tolist() if j != i and setting.standing(j)]
    best = np.full(len(poses), np.inf)
    for lateral in SHIFTS:
        from_ = poses.position[:, [0, 2]] + lateral * side
        forward = to_wall(setting, from_, front) - depth / 2 - 0.02
        at = from_ + forward[:, None] * front
        there = Poses(np.stack([at[:, 0], np.zeros(len(at)), at[:, 1]], -1), poses.yaw + math.pi, poses.price)
        size, doors, light = np.array([width, height, depth]), setting.doors, setting.windows
        cost = (depths(size, there, doors.size, doors.position, doors.yaw) > 0.04).any(1) * BLOCKED
        cost += (depths(size, there, light.size, light.position, light.yaw) > 0.2) @ light.price
        hit = depths(size, there, setting.size[others], state.position[others], state.yaw[others]) > 0.01
        cost += BLOCKED * (hit.any(1) | (beyond(setting, size, there) > 0.05))
        best = np.minimum(best, cost + VIEW * abs(lateral) + _far(forward))
    return best


def to_wall(setting: Setting, start: np.ndarray, front: np.ndarray) -> np.ndarray:
    """(K,) float: metres from points (K, 2) along directions (K, 2) to the first wall."""
    out = np.full(len(start), 30.0)
    for corner, along, length, _ in setting.walls:
        normal = np.array([-along[1], along[0]])
        speed, away = front @ normal, (corner - start) @ normal
        with np.errstate(divide="ignore", invalid="ignore"):
            reach = away / speed
        at = (start + np.nan_to_num(reach)[:, None] * front - corner) @ along
        met = (np.abs(speed) > 1e-6) & (reach > 0) & (at > -1e-6) & (at < length + 1e-6)
        out = np.where(met, np.minimum(out, reach), out)
    return out
