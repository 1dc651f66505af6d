"""The discrete stage of the repair: rooms that no least movement would put right."""

from __future__ import annotations

from importlib import import_module

import numpy as np
import pytest

from echomodel.boxes import Boxes
from echomodel.openings import Opening
from echomodel.rules.living import faults
from echomodel.vocabulary import vocabulary
from echousd.repair import RepairConfig, repair_boxes
from echousd.repair.arrange.costs import least, price
from echousd.repair.arrange.places import places

FLOOR = np.array([(-2.2, -1.9), (2.2, -1.9), (2.2, 1.9), (-2.2, 1.9)])
ID = {p.name: p.id for p in vocabulary().predicates}
BEDROOM = ["double_bed", "nightstand", "nightstand", "wardrobe", "pendant_lamp", "table_lamp"]
SIZE = np.array([(1.7, 1.0, 2.1), (0.5, 0.5, 0.4), (0.5, 0.5, 0.4), (1.5, 2.2, 0.6), (0.5, 0.7, 0.5), (0.3, 0.5, 0.3)])
POSITION = np.array([(-0.5, 0, 0.2), (-1.6, 0, -1.0), (1.3, 0, 1.2), (1.2, 0, 0.9), (0.4, 2, 0.4), (-1.5, 0.5, -1)])
YAW = np.array([1.4, 1.5, 0.3, 2.74, 0.0, 0.0])  # the wardrobe is turned by 157 degrees
TOLD = np.array([(1, ID["close_by"], 0), (2, ID["close_by"], 0), (5, ID["standing_on"], 1)])


def found(done, openings=()):
    """Rules that the room breaks."""
    import torch

    boxes = Boxes(*(torch.as_tensor(v) for v in (done.size, done.position, done.yaw)))
    return [f.rule for f in faults(boxes, BEDROOM, FLOOR, openings, TOLD)]


def bedroom(**options):
    """The shaken bedroom, repaired."""
    return repair_boxes(BEDROOM, SIZE, POSITION, YAW, TOLD, floor_polygon=FLOOR, height=2.7, **options)


def test_no_layout_leaves_repair_with_a_crooked_wardrobe():
    shaken = bedroom(config=RepairConfig(arrange=False))
    assert {"parallel", "nightstand_at_head"} & set(found(shaken))
    done = bedroom()
    assert found(done) == []
    assert (done.verdict == 1).all()
    assert not done.collisions
    assert not done.outside


def test_equal_drafts_give_equal_rooms():
    one, two = bedroom(), bedroom()
    assert np.array_equal(one.position, two.position)
    assert np.array_equal(one.yaw, two.yaw)


def test_the_pose_taken_is_the_cheapest_of_all(monkeypatch):
    module = import_module("echousd.repair.arrange.arrange")
    put, seen = module._put, []

    def checked(setting, state, i):
        poses = places(setting, state, i)
        poses = poses.take(np.argsort(least(setting, state, i, poses), kind="stable"))
        cost = price(setting, state, i, poses)
        own, best = put(setting, state, i)
        assert best == pytest.approx(cost.min(), abs=1e-9)
        assert np.array_equal(state.position[i], poses.position[cost.argmin()])
        assert state.yaw[i] == poses.yaw[cost.argmin()]
        seen.append(len(poses))
        return own, best

    monkeypatch.setattr(module, "_put", checked)
    bedroom()
    assert max(seen) > module.BLOCK  # more than are looked at together


@pytest.mark.parametrize("edge", range(4))
def test_doors_swing_and_windows_give_light(edge):
    openings = (
        Opening("door", "door", edge, 0.3, 0.9, 2.0),
        Opening("window", "window", (edge + 2) % 4, 1.2, 1.4, 1.3, sill=0.9),
    )
    rules = found(bedroom(openings=openings), openings)
    assert "door_free" not in rules
    assert "window_free" not in rules


def test_what_is_fixed_or_turned_by_hand_stays():
    fixed, turned = np.arange(6) == 0, np.isin(np.arange(6), (0, 3))
    done = bedroom(fixed=fixed, turned=turned)
    assert np.array_equal(done.position[0], POSITION[0])
    assert done.yaw[0] == YAW[0]
    assert done.yaw[3] == YAW[3]


def test_the_graph_comes_before_what_is_usual():
    stated = np.concatenate([TOLD[2:], [(1, ID["front"], 0), (2, ID["behind"], 0), (3, ID["left"], 0)]])
    done = repair_boxes(BEDROOM, SIZE, POSITION, YAW, stated, floor_polygon=FLOOR, height=2.7)
    assert (done.verdict == 1).all()


def test_sizes_that_no_such_furniture_has_are_mended():
    huge = SIZE.copy()
    huge[0], huge[4] = (2.9, 1.0, 3.1), (1.8, 1.4, 1.8)
    done = repair_boxes(BEDROOM, huge, POSITION, YAW, TOLD, floor_polygon=FLOOR, height=2.7)
    assert done.size[0].max() < 2.6
    assert done.size[4].max() < 1.3
    rigid = repair_boxes(BEDROOM, huge, POSITION, YAW, TOLD, floor_polygon=FLOOR, height=2.7, rigid=np.ones(6, bool))
    assert np.array_equal(rigid.size, huge)


def test_a_piece_whose_places_are_all_far_fetched() -> None:
    """An L-shaped sofa with its pendant told, from a room that once stopped the repair."""
    words = [
        "l_shaped_sofa",
        "coffee_table",
        "pendant_lamp",
        "dining_chair",
        "dining_chair",
        "dining_table",
        "lounge_chair",
    ]
    size = [
        [2.91, 0.66, 1.54], [0.8, 0.35, 0.57], [0.98, 0.92, 0.63], [0.46, 0.81, 0.55], [0.46, 0.81, 0.55],
        [2.53, 0.74, 0.97], [0.85, 0.8, 0.58],
    ]  # fmt: skip
    position = [
        [-1.24, 0.0, -1.16], [-0.91, 0.0, 0.15], [-1.4, 1.78, -0.21], [1.52, 0.0, -0.06], [2.77, 0.0, -1.25],
        [2.14, 0.0, -0.65], [0.85, 0.0, -0.02],
    ]  # fmt: skip
    yaw = [0.0, 0.0, 0.0, 1.57, -1.57, 1.57, -1.57]
    floor = np.array([[-3.25, 1.95], [3.25, 1.95], [3.25, -1.95], [-3.25, -1.95]])
    told = np.array([[4, 3, 5], [2, 6, 0], [1, 9, 0], [5, 8, 3]])
    done = repair_boxes(words, np.array(size), np.array(position), np.array(yaw), told, floor_polygon=floor, height=2.7)
    assert (done.verdict != 0).all()
