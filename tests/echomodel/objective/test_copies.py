"""Copies of a room are judged as each of them alone, whatever moves in them, in numpy as in torch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from plans import tensors_of

from echomodel.boxes import Boxes
from echomodel.graph import Stated
from echomodel.objective import TERMS, copies, lounging, plan_of
from echomodel.objective.copies import copies_of
from echomodel.rooms.generator import generate_rooms
from echomodel.rules import label_relations

ROOMS = [
    room
    for count, seed, word in ((3, 5, None), (2, 7, "living_dining_room"), (2, 3, "bedroom"))
    for room in generate_rooms(count, seed, room_type=word)
    if len(room) > 4
]


@pytest.fixture(scope="module", params=range(len(ROOMS)))
def copied(request):
    """A plan, seven copies of it with two boxes elsewhere, each of them as a plan in torch, which boxes move."""
    room = ROOMS[request.param]
    told = label_relations(room, rules="strict", drop=0.7, rng=np.random.default_rng(0))
    stated = (Stated("against_wall", 0), Stated("between", 1, (0, 2)))
    plan = plan_of(room, room.categories, room.floor_polygon, room.openings, told, height=2.7, stated=stated)
    luck = np.random.default_rng(request.param)
    position, yaw = plan.position[None].repeat(7, 0), plan.yaw[None].repeat(7, 0)
    moved = np.zeros(len(plan), bool)
    moved[[1, len(plan) // 2]] = True
    position[:, moved] += luck.normal(size=(7, moved.sum(), 3)) * (0.6, 0.0, 0.6)
    yaw[:, moved] += luck.integers(0, 4, (7, moved.sum())) * np.pi / 2
    alone = [tensors_of(replace(plan, position=position[k], yaw=yaw[k])) for k in range(7)]
    for one in alone:
        for name in ("anchor", "carrier", "joins"):
            vars(one)[name] = torch.from_numpy(getattr(plan, name))
    return plan, copies_of(plan, position, yaw, moved), alone, moved


@pytest.mark.parametrize("term", TERMS, ids=[term.name for term in TERMS])
def test_terms_find_in_copies_what_they_find_in_each(copied, term):
    plan, room, alone, moved = copied
    seen, differ = term.find(room), {}
    for k, one in enumerate(alone):
        whole = term.find(one)
        rows = seen.who // len(plan) == k
        here = sorted(zip((seen.who[rows] % len(plan)).tolist(), seen.margin[rows].tolist(), strict=True))
        every = sorted(zip(whole.who.tolist(), whole.margin.tolist(), strict=True))
        for who, margin in here:
            match = [row for row in every if row[0] == who and row[1] == pytest.approx(margin, abs=1e-6)]
            assert match, (term.name, who, margin, every)
            every.remove(match[0])
        differ[k] = [(who, round(margin, 6)) for who, margin in every]  # left out, as it stands alike in all copies
    assert all(left == differ[0] for left in differ.values()), term.name
    assert not any(moved[who] for who, _ in differ[0])


@pytest.mark.parametrize("term", TERMS, ids=[term.name for term in TERMS])
def test_what_a_term_does_not_look_at_changes_nothing_that_it_finds(copied, term):
    plan, _, alone, moved = copied
    if bool(copies.looks_at(plan, term.find)[moved].any()):
        return
    found = [term.find(one) for one in alone]
    for one in found:
        assert torch.equal(one.who, found[0].who)
        assert torch.allclose(one.margin, found[0].margin)


def test_who_attends_nobody_is_judged_in_any_number_of_copies():
    size, at = np.full((3, 3), 0.8), np.array([(0.0, 0.0, 0.0), (1.5, 0.0, 0.0), (0.0, 0.0, 1.5)])
    boxes = Boxes(size, at, np.zeros(3))
    room = plan_of(boxes, ["armchair", "bookshelf", "plant"], np.array([(-2, -2), (4, -2), (4, 3), (-2, 3)], float))
    assert room.anchor.tolist() == [-1, -1, -1]
    many = copies_of(room, at[None].repeat(60, 0), np.zeros((60, 3)), np.array([True, False, False]))
    none = np.full(60, -1)
    assert np.array_equal(many.gap(np.arange(60) * 3, none), np.full(60, float(room.gap(np.array([0]), none[:1])[0])))
    assert lounging.looks_in(many).margin.tolist() == lounging.looks_in(room).margin.tolist() * 60


def test_terms_look_at_what_they_are_about(copied):
    plan = copied[0]
    chairs = plan.stands("at") & (plan.anchor >= 0)
    looks = {term.name: copies.looks_at(plan, term.find) for term in TERMS}
    assert bool((looks["apart"] & looks["on_floor"]).all())
    assert bool(looks["seat_faces"][chairs & ~plan.solid].all())
    assert not bool(looks["pendant_over"][chairs].any())
