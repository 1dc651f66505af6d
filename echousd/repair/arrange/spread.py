"""How evenly the floor is used: the largest empty circle, and what it costs."""

from __future__ import annotations

import numpy as np

from echomodel.objective.zones import bare_limit
from echousd.repair.arrange.setting import Setting, State
from echousd.repair.geometry import depth_inside

CELL = 0.3  # metres between two points of the floor that are looked at
EVEN = 0.8  # share of the radius that a person would call bare, from which on one costs something
BARE = 2.5  # per metre of radius over that


def bareness(setting: Setting, state: State) -> float:
    """What the largest empty circle of the floor costs where all boxes stand."""
    return float(_price(setting, _nearest(setting, state, np.arange(len(setting.size)))[None])[0])


def bareness_of(setting: Setting, state: State, members: np.ndarray, shifts: np.ndarray) -> np.ndarray:
    """(K,) float: the same where some boxes stand elsewhere by each of the shifts (K, 3)."""
    others = np.setdiff1d(np.arange(len(setting.size)), members)
    there = _nearest(setting, state, others)
    if not _price(setting, there[None])[0]:  # nothing is bare even without them
        return np.zeros(len(shifts))
    moved = np.stack([_nearest(setting, state, members, shift) for shift in shifts])
    return _price(setting, np.minimum(there, moved))


def _price(setting: Setting, radius: np.ndarray) -> np.ndarray:
    """(K,): from the distances (K, P) of the floor's points to what is nearest."""
    count = sum(setting.standing(i) for i in range(len(setting.size)))
    _, walls, area = _floor(setting)
    largest = np.minimum(radius, walls).max(1, initial=0.0)
    return BARE * np.maximum(largest - EVEN * bare_limit(area, count), 0.0)


def _nearest(setting: Setting, state: State, boxes: np.ndarray, shift: np.ndarray | None = None) -> np.ndarray:
    """(P,) float: metres from the floor's points to the nearest of some boxes."""
    points = _floor(setting)[0]
    out = np.full(len(points), np.inf)
    for i in boxes.tolist():
        if not setting.standing(i):
            continue
        at = state.position[i] if shift is None else state.position[i] + shift
        away = points - at[[0, 2]]
        c, s = np.cos(state.yaw[i]), np.sin(state.yaw[i])
        lateral = np.abs(c * away[:, 0] - s * away[:, 1]) - setting.size[i, 0] / 2
        forward = np.abs(s * away[:, 0] + c * away[:, 1]) - setting.size[i, 2] / 2
        np.minimum(out, np.hypot(lateral.clip(0.0), forward.clip(0.0)), out=out)
    return out


def _floor(setting: Setting) -> tuple[np.ndarray, np.ndarray, float]:
    """Points (P, 2) on the floor, their distances (P,) to the walls, and its area in square metres."""
    if "floor" not in setting.cells:
        polygon = setting.floor.polygon
        low, high = polygon.min(0), polygon.max(0)
        xs, zs = (np.arange(a + CELL / 2, b, CELL) for a, b in zip(low, high, strict=True))
        points = np.stack(np.meshgrid(xs, zs), -1).reshape(-1, 2)
        walls = depth_inside(setting.floor, points)
        x, z = polygon.T
        area = float(abs(x @ np.roll(z, -1) - z @ np.roll(x, -1)) / 2)
        setting.cells["floor"] = points[walls > 0], walls[walls > 0], area
    return setting.cells["floor"]
