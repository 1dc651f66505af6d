"""Where a robot gets to in a room: how much of its floor, and what it can touch from there."""

from __future__ import annotations

import numpy as np
import pytest

from echomodel.boxes import Boxes
from echomodel.objective import plan_of, unreached, walk
from echomodel.openings import Opening

FLOOR = np.array([(-2.5, -2.0), (2.5, -2.0), (2.5, 2.0), (-2.5, 2.0)])


def test_the_walkable_share_counts_what_the_robot_gets_to():
    block = Boxes(np.array([[5.0, 1.0, 0.4]]), np.array([[0.0, 0.0, 0.5]]), np.zeros(1))
    door = Opening("door", "door", 0, 2.0, 0.9, 2.0)
    found = walk(plan_of(block, ["sideboard"], FLOOR, (door,)))
    front, behind = 2.3 - 0.4, 1.3 - 0.4  # depths of the two halves less the robot's radius at both sides
    assert found.share == pytest.approx(front / (front + behind), abs=0.03)
    assert not found.lost


@pytest.mark.parametrize("yaw", [0.0, 0.4, np.pi / 2, 2.5])
def test_arms_reach_as_far_from_every_side_of_a_turned_box(yaw):
    ahead = np.array([np.sin(yaw), np.cos(yaw)])
    things, turn = np.array([[1.6, 0.8, 0.4]] * 2), np.full(2, yaw)
    for far, reached in ((0.2 + 0.5, True), (0.2 + 1.0, False)):  # from the middle of the bar to the strip of floor
        strip = np.array([(-1.0, 0.0), (1.0, 0.0), (1.0, 0.5), (-1.0, 0.5)])
        strip = strip @ np.stack([(ahead[1], -ahead[0]), ahead]) + (far - 0.2) * ahead
        boxes = Boxes(things, np.array([(0.0, 0.0, 0.0), (50.0, 0.0, 50.0)]), turn)
        found = walk(plan_of(boxes, ["chair", "chair"], strip))
        assert found.lost == ([1] if reached else [0, 1])


def ways_in(width, opening, *more):
    """What is told of a room with something right across it, but for a way at the right wall so wide."""
    size, x = (5.0 - width, 0.9, 0.4), -width / 2
    boxes = Boxes(*(np.array(column) for column in zip((size, (x, 0.0, -0.6), 0.0), *more, strict=True)))
    words = ["sideboard", *["dining_table", "dining_chair"][: len(more)]]
    return [(fault.object, fault.sentence(words)) for fault in unreached(plan_of(boxes, words, FLOOR, (opening,)))]


@pytest.mark.parametrize(("width", "kept"), [(0.53, False), (0.57, True)])
@pytest.mark.parametrize("kind", ["door", "passage", "window"])
def test_a_person_walks_in_from_each_door(width, kept, kind):
    there, across = (Opening("way", kind, edge, 2.0, 0.9, 2.0) for edge in (0, 2))
    told = [] if kept or kind == "window" else [(0, "sideboard leaves less than 0.6 m to come in from a door")]
    assert ways_in(width, there) == told
    assert ways_in(width, across) == []  # the larger part is before it


def test_who_walks_in_pulls_no_chair_aside():
    door, table = Opening("door", "door", 0, 2.0, 0.9, 2.0), ((1.2, 0.75, 0.8), (1.9, 0.0, 0.9), 0.0)
    for x, told in ((2.2, [(2, "dining_chair leaves less than 0.6 m to come in from a door")]), (0.9, [])):
        chair = ((0.4, 0.9, 0.4), (x, 0.0, -0.25 if told else 0.9), np.pi)
        assert ways_in(0.8, door, table, chair) == told
