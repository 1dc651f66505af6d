"""Several rooms in one plan: each is judged as it is alone."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
import torch

from echomodel.boxes import Boxes
from echomodel.guidance import missed
from echomodel.objective import faults_of, plan_of
from echomodel.rooms.generator import generate_rooms


def packed_plan(plans):
    scene = np.concatenate([np.full(len(plan), number) for number, plan in enumerate(plans)])
    most, given = max(plan.floor.shape[1] for plan in plans), np.zeros(len(scene), bool)
    floors = [np.pad(np.asarray(plan.floor), [(0, 0), (0, most - plan.floor.shape[1]), (0, 0)], constant_values=np.nan)
              for plan in plans]  # fmt: skip
    return type(plans[0])(
        tuple(kind for plan in plans for kind in plan.kinds),
        *(np.concatenate([np.asarray(getattr(plan, name)) for plan in plans]) for name in ("size", "position", "yaw")),
        scene, np.concatenate(floors), ((),) * len(plans), np.zeros((0, 3), int), given,
    )  # fmt: skip


def test_another_rooms_wardrobe_hides_no_screen():
    floor = np.array([[-3, -3], [3, -3], [3, 3], [-3, 3]], float)
    seen = Boxes(
        torch.tensor([[2.0, 0.8, 0.9], [1.6, 0.5, 0.4]]),
        torch.tensor([[0.0, 0.0, -1.5], [0.0, 0.0, 1.7]]),
        torch.tensor([0.0, math.pi]),
    )
    between = Boxes(torch.tensor([[1.5, 2.2, 0.6]]), torch.zeros(1, 3), torch.zeros(1))
    plans = [plan_of(seen, ["sofa", "tv_stand"], floor), plan_of(between, ["wardrobe"], floor)]
    said = {fault.rule for fault in faults_of(packed_plan(plans))}
    assert said == {fault.rule for plan in plans for fault in faults_of(plan)}
    assert "view_free" not in said


def test_no_sentence_names_less_than_nothing():
    rng = np.random.default_rng(0)
    for room in generate_rooms(12, 3):
        place, low, high = room.position.copy(), *(f(room.floor_polygon, 0) for f in (np.min, np.max))
        moved = np.flatnonzero(rng.random(len(room)) < 0.5)
        place[moved[:, None], [0, 2]] = rng.uniform(low, high, (len(moved), 2))
        shaken = replace(room, position=place)
        for fault in faults_of(plan_of(shaken, shaken.categories, shaken.floor_polygon)):
            assert not re.search(r"-\d|nan|inf\b", fault.says), fault


def test_several_rooms_at_once_are_judged_as_one_by_one():
    rooms = generate_rooms(6, 11)
    plans = [plan_of(room, room.categories, room.floor_polygon) for room in rooms]
    start, alone = 0, []
    for plan in plans:
        alone += [(f.object + start, f.rule) for f in faults_of(plan)]
        start += len(plan)
    together = packed_plan(plans)
    assert sorted((f.object, f.rule) for f in faults_of(together)) == sorted(alone)
    assert float(missed(together)) == pytest.approx(sum(float(missed(plan)) for plan in plans))
