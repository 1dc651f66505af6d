"""Where a robot gets to in a room: how much of its floor, and what it can touch from there."""

from __future__ import annotations

import numpy as np
import pytest

from echomodel.boxes import Boxes
from echomodel.objective import plan_of, walk
from echomodel.openings import Opening

FLOOR = np.array([(-2.5, -2.0), (2.5, -2.0), (2.5, 2.0), (-2.5, 2.0)])


def test_the_walkable_share_counts_what_the_robot_gets_to():
    block = Boxes(np.array([[5.0, 1.0, 0.4]]), np.array([[0.0, 0.0, 0.5]]), np.zeros(1))
    door = Opening("door", "door", 0, 2.0, 0.9, 2.0)
    found = walk(plan_of(block, ["sideboard"], FLOOR, (door,)))
    front, behind = 2.3 - 0.4, 1.3 - 0.4  # depths of the two halves less the robot's radius at both sides
    assert found.share == pytest.approx(front / (front + behind), abs=0.03)
    assert found.reached.all()


@pytest.mark.parametrize("yaw", [0.0, 0.4, np.pi / 2, 2.5])
def test_arms_reach_as_far_from_every_side_of_a_turned_box(yaw):
    ahead = np.array([np.sin(yaw), np.cos(yaw)])
    things, turn = np.array([[1.6, 0.8, 0.4]] * 2), np.full(2, yaw)
    for far, reached in ((0.2 + 0.5, True), (0.2 + 1.0, False)):  # from the middle of the bar to the strip of floor
        strip = np.array([(-1.0, 0.0), (1.0, 0.0), (1.0, 0.5), (-1.0, 0.5)])
        strip = strip @ np.stack([(ahead[1], -ahead[0]), ahead]) + (far - 0.2) * ahead
        boxes = Boxes(things, np.array([(0.0, 0.0, 0.0), (50.0, 0.0, 50.0)]), turn)
        found = walk(plan_of(boxes, ["chair", "chair"], strip))
        assert found.reached.tolist() == [reached, False]
