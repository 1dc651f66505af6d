"""Floors of given rooms: any outline with its doors and windows, as the generator sees its own."""

from __future__ import annotations

import numpy as np

from echomodel.openings import signed_area
from echomodel.rooms.floor import OVER_SILL, Floor, Rectangle, walls_of

FINEST = 0.25  # metres: cells in which slanted outlines are approximated
MOST = 12  # corners along an axis above which an outline counts as slanted
HEIGHT = 2.6  # metres
BEYOND = 1.0  # metres by which what is cut away reaches out of the bounding box


def floor_of(polygon: np.ndarray, rows: np.ndarray, height: float = HEIGHT) -> Floor:
    """The floor of a room that already has one, about the middle of its bounding box.

    Arguments:
        polygon: (k, 2) float, corners (x, z) in either turn, metres.
        rows: (o, ROW) float, doors and windows as `echomodel.openingrows` tells them.
        height: of the room, metres.
    """
    corners = np.asarray(polygon, float)
    corners = corners - (corners.max(0) + corners.min(0)) / 2
    half_x, half_z = corners.max(0)
    before = [(_before(row), float(row[7]) + OVER_SILL, bool(row[9] > 0.5)) for row in rows]
    doors = [rectangle for rectangle, _, window in before if not window]
    windows = [(rectangle, top) for rectangle, top, window in before if window]
    turned = corners if signed_area(corners) > 0 else corners[::-1]
    outline = tuple((float(x), float(z)) for x, z in turned)
    return Floor(
        float(half_x), float(half_z), outline, height, tuple(_cut_away(corners)), walls_of(outline), (),
        tuple(doors), tuple(windows), abs(signed_area(corners)),
    )  # fmt: skip


def _before(row: np.ndarray) -> Rectangle:
    """The rectangle before an opening that stays free."""
    jambs = row[:4].reshape(2, 2)
    points = np.concatenate([jambs, jambs + row[4:6] * row[6]])
    (x0, z0), (x1, z1) = points.min(0), points.max(0)
    return float(x0), float(z0), float(x1), float(z1)


def _cut_away(corners: np.ndarray) -> list[Rectangle]:
    """Rectangles of the bounding box that are no floor."""
    axes = []
    for axis in (0, 1):
        marks = np.unique(corners[:, axis].round(3))
        if len(marks) > MOST:
            marks = np.linspace(marks[0], marks[-1], max(2, round((marks[-1] - marks[0]) / FINEST) + 1))
        axes.append(marks)
    xs, zs = axes
    x, z = (xs[1:] + xs[:-1]) / 2, (zs[1:] + zs[:-1]) / 2
    end = np.roll(corners, -1, 0)
    outside = []
    for i, column in enumerate(x):
        for k, row in enumerate(z):
            crossed = (corners[:, 1] > row) != (end[:, 1] > row)
            run = np.where(end[:, 1] == corners[:, 1], 1.0, end[:, 1] - corners[:, 1])
            meets = corners[:, 0] + (row - corners[:, 1]) / run * (end[:, 0] - corners[:, 0])
            if (crossed & (meets > column)).sum() % 2 == 0:
                outside.append((i, k))
    last_x, last_z = len(x) - 1, len(z) - 1
    return [
        (
            float(xs[i]) - BEYOND * (i == 0), float(zs[k]) - BEYOND * (k == 0),
            float(xs[i + 1]) + BEYOND * (i == last_x), float(zs[k + 1]) + BEYOND * (k == last_z),
        )
        for i, k in outside
    ]  # fmt: skip
