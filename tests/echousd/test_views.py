"""Where a camera inside a room stands: it sees far, and nothing that hangs at a wall fills its picture."""

from __future__ import annotations

import numpy as np
import pytest

from echousd.sight import Furniture
from echousd.views import APERTURE, WIDE, inside_view, view_matrix

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
    far = corner - 2.6 * free[[0, 2], 2] / np.linalg.norm(free[[0, 2], 2])
    assert np.allclose(inside_view(FLOOR, BED, 2.8, boxes((0.5, 0.5, 0.1, far[0], 1.5, far[1], 0.0))), free)


def test_the_camera_turns_away_from_what_its_picture_would_cut_off() -> None:
    free = inside_view(FLOOR, BED, 2.8)
    eye, half = free[:3, 3], APERTURE / 2 / WIDE
    edge = eye - 1.3 * free[:3, 2] + 1.1 * free[:3, 0]  # at the right border of its picture
    plant = boxes((0.4, 1.3, 0.4, edge[0], 0.0, edge[2], 0.0))
    other = inside_view(FLOOR, BED, 2.8, plant)
    assert plant.filled(other, half, 2.0) < 0.25 * plant.filled(free, half, 2.0)


def test_the_camera_looks_down_a_little_in_the_smallest_room() -> None:
    floor = np.array([(0.0, 0.0), (0.0, 2.2), (2.2, 2.2), (2.2, 0.0)])
    view = inside_view(floor, boxes((1.0, 0.75, 0.5, 1.1, 0.0, 0.3, 0.0)), 2.8)
    assert -0.35 < -view[1, 2] / np.linalg.norm(view[[0, 2], 2]) < 0.0


def test_the_camera_comes_nearer_where_the_room_is_large() -> None:
    floor = np.array([(0.0, 0.0), (0.0, 9.0), (10.0, 9.0), (10.0, 0.0)])
    group = boxes((2.2, 0.8, 0.9, 5.0, 0.0, 4.0, 0.0), (1.1, 0.4, 0.6, 5.0, 0.0, 5.2, 0.0))
    eye = inside_view(floor, group, 2.8)[[0, 2], 3]
    assert 2.0 < np.linalg.norm(eye - (5.0, 4.4)) < 5.5


def test_the_camera_looks_into_the_larger_part_of_a_room_with_a_corner() -> None:
    floor = np.array([(0.0, 0.0), (0.0, 5.0), (6.0, 5.0), (6.0, 3.0), (2.0, 3.0), (2.0, 0.0)])
    chair = boxes((0.5, 0.9, 0.5, 3.0, 0.0, 4.0, 0.0))
    eye = inside_view(floor, chair, 2.8)[[0, 2], 3]
    assert min(np.linalg.norm(eye - corner) for corner in floor[[0, 1, 2, 3, 5]]) < 0.6
    assert np.linalg.norm(eye - floor[4]) > 1.0  # not behind the edge that juts in


def test_only_what_is_near_and_in_the_picture_fills_it() -> None:
    view = view_matrix(np.array([0.0, 1.5, 0.0]), np.array([1.0, 1.5, 0.0]))
    ahead, behind, beside, far = (
        boxes((0.3, 2.0, 0.3, x, 0.0, z, 0.0)) for x, z in ((0.8, 0.0), (-0.8, 0.0), (0.3, 0.9), (3.0, 0.0))
    )
    assert ahead.nearness(view[:3, 3], 1.0)[0] == behind.nearness(view[:3, 3], 1.0)[0] == pytest.approx(0.35)
    assert ahead.filled(view, 1.0, 1.0) > 0.05
    assert behind.filled(view, 1.0, 1.0) == far.filled(view, 1.0, 1.0) == 0
    assert beside.filled(view, 0.5, 1.0) == 0  # a narrow picture does not reach so far
