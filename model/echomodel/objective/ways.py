"""Ways: from the door a robot of 0.2 m radius finds its way to every piece (grid search, as SceneEval and PhyScene)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echomodel.openings import Opening, inward_normal, segment

CELL = 0.05  # metres
ROBOT = 0.2  # metres, its radius
ARM = 0.4  # metres between the robot and what it can take hold of


@dataclass(frozen=True, eq=False)
class Ways:
    """What can be walked to.

    Arguments:
        reached: (n,) bool, boxes that the robot can touch.
        share: of the floor that is free for its middle, the share that it can get to; 1 where nothing is free.
    """

    reached: np.ndarray
    share: float


def ways(
    size: np.ndarray,
    position: np.ndarray,
    yaw: np.ndarray,
    obstacle: np.ndarray,
    polygon: np.ndarray,
    openings: Sequence[Opening] = (),
) -> Ways:
    """Walk from the doors and passages, or in the largest free part of the room where there are none.

    Arguments:
        size, position: (n, 3) float, metres; yaw: (n,) float, radians.
        obstacle: (n,) bool, what stands in the way.
        polygon: (k, 2) float, corners of the floor, metres.
    """
    from scipy import ndimage

    low, high = polygon.min(0) - CELL, polygon.max(0) + CELL
    xs, zs = (np.arange(a, b + CELL, CELL) for a, b in zip(low, high, strict=True))
    free = _inside(xs, zs, polygon)
    near = [_near(xs, zs, size[i], position[i], float(yaw[i])) for i in range(len(size))]
    away = [_distance(xs[x], zs[z], size[i], position[i], float(yaw[i])) for i, (x, z) in enumerate(near)]
    for i in np.flatnonzero(obstacle):
        free[near[i]] &= away[i] > 0
    # the distance to the next cell that is not free, less half of that cell
    room = (ndimage.distance_transform_edt(free) - 0.5) * CELL >= ROBOT - 0.5 * CELL
    parts, count = ndimage.label(room)
    if not count:
        return Ways(np.zeros(len(size), bool), 1.0)
    start = _entered(parts, xs, zs, polygon, openings)
    if not start:
        areas = np.bincount(parts.ravel())[1:]
        start = {int(areas.argmax()) + 1}
    walked = np.isin(parts, sorted(start))
    reached = np.array([bool((away[i][walked[near[i]]] <= ROBOT + ARM).any()) for i in range(len(size))], bool)
    return Ways(reached, float(walked.sum() / room.sum()))


def _entered(
    parts: np.ndarray, xs: np.ndarray, zs: np.ndarray, polygon: np.ndarray, openings: Sequence[Opening]
) -> set[int]:
    """Numbers of the free parts that lie before a door or passage."""
    out: set[int] = set()
    for opening in openings:
        if opening.kind == "window" or opening.edge >= len(polygon):
            continue
        inside = segment(polygon, opening).mean(0) + inward_normal(polygon, opening.edge) * (ROBOT + 2 * CELL)
        near = np.hypot(xs[:, None] - inside[0], zs[None] - inside[1]) < 0.35
        met = np.bincount(parts[near], minlength=1)
        met[0] = 0
        if met.any():
            out.add(int(met.argmax()))
    return out


def _inside(xs: np.ndarray, zs: np.ndarray, polygon: np.ndarray) -> np.ndarray:
    """(len(xs), len(zs)) bool, whether cells lie on the floor (even-odd rule)."""
    x, z = xs[:, None, None], zs[None, :, None]
    start, end = polygon, np.roll(polygon, -1, 0)
    crossed = (start[:, 1] > z) != (end[:, 1] > z)
    run = np.where(end[:, 1] == start[:, 1], 1.0, end[:, 1] - start[:, 1])
    meets = start[:, 0] + (z - start[:, 1]) / run * (end[:, 0] - start[:, 0])
    return (crossed & (meets > x)).sum(-1) % 2 == 1


def _near(xs: np.ndarray, zs: np.ndarray, size: np.ndarray, position: np.ndarray, yaw: float) -> tuple[slice, slice]:
    """The cells around a box that hold all those within reach of it."""
    cos, sin = abs(np.cos(yaw)), abs(np.sin(yaw))
    far = ROBOT + ARM + CELL
    x, z = (cos * size[0] + sin * size[2]) / 2 + far, (sin * size[0] + cos * size[2]) / 2 + far
    return (
        slice(*np.searchsorted(xs, (position[0] - x, position[0] + x))),
        slice(*np.searchsorted(zs, (position[2] - z, position[2] + z))),
    )


def _distance(xs: np.ndarray, zs: np.ndarray, size: np.ndarray, position: np.ndarray, yaw: float) -> np.ndarray:
    """(len(xs), len(zs)) float: metres from cells to a footprint, 0 inside it."""
    dx, dz = xs[:, None] - position[0], zs[None] - position[2]
    cos, sin = np.cos(yaw), np.sin(yaw)
    lateral = np.abs(cos * dx - sin * dz) - size[0] / 2
    forward = np.abs(sin * dx + cos * dz) - size[2] / 2
    return np.hypot(np.maximum(lateral, 0.0), np.maximum(forward, 0.0))
