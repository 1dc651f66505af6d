"""Distances to walls agree with shapely on arbitrary floors; unknown floors say nothing."""

from __future__ import annotations

import numpy as np
import shapely
import torch
from hypothesis import given
from hypothesis import strategies as st

from echomodel.floors import footprint, signed_distance
from echomodel.rooms.floor import sample_floor
from echomodel.rooms.statistics import room_type_statistics
from echomodel.surroundings import GRID, centred, extents, padded, plan_features, wall_distances

UNKNOWN = torch.full((1, 4, 2), torch.nan)


def drawn_floor(seed: int) -> np.ndarray:
    """Corners of a floor with notches, askew to the axes now and then."""
    rng = np.random.default_rng(seed)
    corners = np.array(sample_floor(room_type_statistics("living_dining_room"), rng).polygon, float)
    turn = rng.choice([0.0, 0.4])
    return corners @ np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])


@given(st.integers(0, 500))
def test_signed_distance_is_shapelys(seed: int) -> None:
    corners = drawn_floor(seed)
    points = np.random.default_rng(seed).uniform(-7, 7, (40, 2))
    room = shapely.Polygon(corners)
    inside = shapely.contains_xy(room, points[:, 0], points[:, 1])
    distance = shapely.distance(room.exterior, shapely.points(points))
    floor = padded([torch.tensor(corners, dtype=torch.float32)[None], torch.zeros(1, 30, 2)])[:1]
    found = signed_distance(torch.tensor(points, dtype=torch.float32)[None], floor)[0]
    np.testing.assert_allclose(found, np.where(inside, distance, -distance), atol=1e-4)


@given(st.integers(0, 500))
def test_wall_distances_are_shapelys(seed: int) -> None:
    corners = drawn_floor(seed)
    point = np.random.default_rng(seed).uniform(-3, 3, 2)
    room = shapely.Polygon(corners).exterior
    for number, step in enumerate(np.array([[99, 0], [-99, 0], [0, 99], [0, -99]])):
        met = room.intersection(shapely.LineString([point, point + step]))
        wanted = 0.0 if met.is_empty else met.distance(shapely.Point(point))
        places = torch.tensor(point, dtype=torch.float32)[None], torch.tensor(corners, dtype=torch.float32)[None]
        assert abs(float(wall_distances(*places)[0, number]) - wanted) < 1e-3


def test_a_footprint_starts_at_the_back_left_and_turns_with_the_box() -> None:
    size, position = torch.tensor([[2.0, 1.0, 4.0]]), torch.tensor([[10.0, 0.0, 20.0]])
    assert footprint(size, position, torch.zeros(1))[0, [0, 1, 4]].tolist() == [[9, 18], [10, 18], [11, 22]]
    turned = footprint(size, position, torch.tensor([torch.pi / 2]))[0, 1]
    torch.testing.assert_close(turned, torch.tensor([8.0, 20.0]))  # the front looks along +x


def test_floors_of_different_numbers_of_corners_stand_together() -> None:
    floor = padded([torch.from_numpy(centred((4, 3)))[None], torch.zeros(1, 6, 2), UNKNOWN])
    assert floor.shape == (3, 6, 2)
    assert extents(floor)[0].tolist() == [4, 3]
    assert extents(floor)[2].isnan().all()


def test_a_plan_tells_notches_apart_and_nothing_of_unknown_floors() -> None:
    notched = torch.tensor([[[-2.0, -1.5], [0, -1.5], [0, 0], [2, 0], [2, 1.5], [-2, 1.5]]])
    plans = plan_features(padded([torch.from_numpy(centred((4, 3)))[None], notched, UNKNOWN]))
    assert plans.shape == (3, 6 + GRID**2)
    assert torch.equal(plans[0, :6], plans[1, :6])
    assert (plans[0, 6:] > 0).all()
    assert (plans[1, 6:] < 0).sum() == GRID**2 / 4
    assert not plans[2].any()
