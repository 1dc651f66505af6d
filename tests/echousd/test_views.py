"""Where a camera inside a room stands: it sees far, and nothing that hangs at a wall fills its picture."""

from __future__ import annotations

import numpy as np

from echousd.sight import Furniture
from echousd.views import inside_view

FLOOR = np.array([(0.0, 0.0), (0.0, 4.0), (5.0, 4.0), (5.0, 0.0)])


def boxes(*rows: tuple[float, ...]) -> Furniture:
    found = np.array(rows, float).reshape(-1, 7)
    return Furniture(found[:, :3], found[:, 3:6], found[:, 6])


BED = boxes((1.8, 0.6, 2.0, 2.5, 0.0, 1.2, 0.0))


def test_the_camera_stays_away_from_curtains() -> None:
    free = inside_view(FLOOR, BED, 2.8)
    corner = free[[0, 2], 3]
    spot = corner - 0.7 * free[[0, 2], 2] / np.linalg.norm(free[[0, 2], 2])  # on the way that it looks
    curtain = boxes((0.4, 2.2, 0.09, spot[0], 0.0, spot[1], 0.0))
    other = inside_view(FLOOR, BED, 2.8, curtain)
    assert np.linalg.norm(other[[0, 2], 3] - corner) > 1.0
    assert np.allclose(inside_view(FLOOR, BED, 2.8, boxes((0.5, 0.5, 0.1, 2.5, 1.5, 2.0, 0.0))), free)  # far away


def test_the_camera_looks_into_the_larger_part_of_a_room_with_a_corner() -> None:
    floor = np.array([(0.0, 0.0), (0.0, 5.0), (6.0, 5.0), (6.0, 3.0), (2.0, 3.0), (2.0, 0.0)])
    chair = boxes((0.5, 0.9, 0.5, 3.0, 0.0, 4.0, 0.0))
    eye = inside_view(floor, chair, 2.8)[[0, 2], 3]
    assert min(np.linalg.norm(eye - corner) for corner in floor[[0, 1, 2, 3, 5]]) < 0.6
    assert np.linalg.norm(eye - floor[4]) > 1.0  # not behind the edge that juts in


def test_crowding_counts_what_is_in_the_picture() -> None:
    eye, way = np.array([0.0, 1.5, 0.0]), np.array([1.0, 0.0])
    ahead, behind = (boxes((0.3, 2.0, 0.3, x, 0.0, 0.0, 0.0)) for x in (0.6, -0.6))
    assert ahead.crowding(eye, 1.0, way) == ahead.crowding(eye, 1.0) == behind.crowding(eye, 1.0) > 0
    assert behind.crowding(eye, 1.0, way) == 0
