"""Placements as rules: what counts as against a wall, in a corner, between two others, and by how much."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from echomodel.boxes import Boxes
from echomodel.graph import Stated
from echomodel.rules.placements import WAYS, placement_margins

FLOOR = np.array([(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)])
NOTCHED = np.array([(-2.0, -2.0), (2.0, -2.0), (2.0, 0.0), (0.0, 0.0), (0.0, 2.0), (-2.0, 2.0)])


def margin(placement, boxes, categories, floor=FLOOR, subject=0, others=()) -> float:
    """Boxes as (width, depth, x, z, yaw)."""
    rows = torch.tensor(boxes, dtype=torch.float64)
    size = torch.stack([rows[:, 0], torch.ones(len(rows)).double(), rows[:, 1]], 1)
    position = torch.stack([rows[:, 2], torch.zeros(len(rows)).double(), rows[:, 3]], 1)
    stated = [Stated(placement, subject, tuple(others))]
    return float(placement_margins(Boxes(size, position, rows[:, 4]), stated, floor, categories))


def test_the_space_between_two_others_is_looked_at_from_all_around():
    assert np.linalg.norm(WAYS, axis=0) == pytest.approx(1.0)
    steps = (WAYS * np.roll(WAYS, -1, 1)).sum(0)
    assert steps == pytest.approx(np.cos(2 * np.pi / WAYS.shape[1]))


def test_the_back_is_what_stands_against_a_wall():
    assert margin("against_wall", [(1.6, 0.6, 0, -1.69, 0.0)], ["wardrobe"]) == pytest.approx(0.14)
    assert margin("against_wall", [(1.6, 0.6, 0, -1.5, 0.0)], ["wardrobe"]) == pytest.approx(-0.05)
    assert margin("against_wall", [(1.6, 0.6, 0, -1.69, np.pi)], ["wardrobe"]) < 0  # its doors are at the wall
    assert margin("against_wall", [(1.6, 0.6, 0, -1.69, 0.4)], ["wardrobe"]) < 0  # askew


@pytest.mark.parametrize(("category", "kept"), [("single_bed", True), ("sofa", False), ("plant", True)])
def test_beds_and_what_has_no_front_may_stand_lengthwise(category, kept):
    found = margin("against_wall", [(0.9, 1.6, -1.5, 0, 0.0)], [category])
    assert (found >= 0) is kept


@pytest.mark.parametrize("floor", [NOTCHED, NOTCHED[::-1].copy()])
def test_a_corner_is_one_that_looks_into_the_room(floor):
    assert margin("in_corner", [(0.4, 0.4, -1.75, 1.75, 0.3)], ["plant"], floor) > 0.1
    assert margin("in_corner", [(0.4, 0.4, -1.0, 1.75, 0.0)], ["plant"], floor) < 0
    assert margin("in_corner", [(0.4, 0.4, -0.3, -0.3, 0.0)], ["plant"], floor) < 0  # at the notch's outer corner
    assert margin("in_corner", [(0.4, 0.4, -0.25, 1.75, 0.0)], ["plant"], floor) > 0.1


def test_between_is_the_space_that_two_others_span():
    bed, wardrobe = (1.6, 2.0, -1.0, -0.9, 0.0), (1.0, 0.6, 1.2, -1.6, 0.0)
    for x, z, kept in ((0.2, -1.7, True), (0.2, 1.0, False), (-1.0, -0.9, False), (1.9, -1.9, False)):
        found = margin(
            "between", [(0.4, 0.4, x, z, 0.0), bed, wardrobe], ["nightstand", "double_bed", "wardrobe"], others=(1, 2)
        )
        assert (found >= 0) is kept, (x, z, found)


def test_beside_one_and_far_from_the_other_is_not_between():
    words, beds = ["nightstand", "single_bed", "single_bed"], ((1.0, 2.0, -1.0, 0.0, 0.0), (1.0, 2.0, 1.0, 0.0, 0.0))
    assert margin("between", [(0.5, 0.4, 0.0, -0.8, 0.0), *beds], words, others=(1, 2)) > 0.1
    across = ((1.0, 2.0, -1.0, -1.0, np.pi / 2), (1.0, 2.0, 1.0, 1.0, 0.0))  # side of one, foot of the other
    assert margin("between", [(0.5, 0.4, -1.7, -0.3, 0.0), *across], words, others=(1, 2)) < -0.3
    assert margin("between", [(0.5, 0.4, 0.3, -0.2, 0.0), *across], words, others=(1, 2)) > 0.1


@pytest.mark.parametrize("away", [(3.0, 2.5), (-3.0, 2.5), (-9.0, -9.0)])
def test_a_room_may_lie_anywhere(away):
    x, z = away
    floor = NOTCHED * [1.0, 0.5] + away
    assert margin("in_corner", [(0.4, 0.4, x - 1.75, z + 0.75, 0.0)], ["plant"], floor) > 0.1
    assert margin("in_corner", [(0.4, 0.4, x - 0.3, z - 0.3, 0.0)], ["plant"], floor) < 0


def test_walls_that_nobody_knows_leave_a_placement_unmeasured():
    assert np.isnan(margin("in_corner", [(0.4, 0.4, 0, 0, 0.0)], ["plant"], floor=None))


def test_margins_have_gradients_that_lead_there():
    position = torch.tensor([[0.4, 0.0, 0.1]], dtype=torch.float64, requires_grad=True)
    size = torch.tensor([[0.4, 1.0, 0.4]], dtype=torch.float64)
    boxes = Boxes(size, position, torch.zeros(1, dtype=torch.float64))
    (slope,) = torch.autograd.grad(placement_margins(boxes, [Stated("in_corner", 0)], FLOOR, ["plant"]).sum(), position)
    assert float(slope.abs().sum()) > 0.5
