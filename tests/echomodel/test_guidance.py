"""Guidance moves boxes to where the terms of the objective want them, and leaves known ones and all sizes alone."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from echomodel.boxes import Boxes, BoxStatistics
from echomodel.graph import GraphBatch
from echomodel.guidance import LATE, guided, mended
from echomodel.objective import KINDS, faults_of
from echomodel.openings import Opening
from echomodel.standing import openings_of, plan_of_graph, settled
from echomodel.surroundings import centred
from echomodel.training.layout_losses import outside
from echomodel.vocabulary import vocabulary

FLOOR = np.array([(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)])
SCALE = BoxStatistics((-1.0,) * 3, (1.0,) * 3, (-2.0, -1.0, -2.0), (2.0, 1.0, 2.0), log_size=True).scale()
SIZES = {"wardrobe": (1.0, 2.0, 0.6), "desk": (1.2, 0.75, 0.6), "office_chair": (0.5, 0.9, 0.5),
         "plant": (0.4, 0.9, 0.4), "nightstand": (0.5, 0.5, 0.4), "pendant_lamp": (0.4, 0.5, 0.4)}  # fmt: skip


def room(*things, told=(), openings=(), placements=(), floor=FLOOR):
    """A plan of (category, (x, y, z), yaw in degrees) and its boxes."""
    words = vocabulary()
    graph = GraphBatch.single(
        [words.category_id(word) for word, *_ in things],
        [(a, words.predicate_id(word), b) for a, word, b in told],
        floor=floor, openings=openings, placements=placements, height=2.6,
    )  # fmt: skip
    size, place = ([of(thing) for thing in things] for of in (lambda t: SIZES[t[0]], lambda t: t[1]))
    yaw = torch.tensor([float(np.radians(thing[2])) for thing in things])
    return plan_of_graph(graph, "strict"), Boxes(torch.tensor(size), torch.tensor(place), yaw)


def faults(plan, boxes):
    object.__setattr__(plan, "size", boxes.size)
    return {fault.rule for fault in faults_of(plan.at(boxes.position, boxes.yaw), KINDS)}


@pytest.mark.parametrize(
    ("things", "more", "wrong"),
    [
        ([("nightstand", (0.5, 0.0, -1.0), 0), ("plant", (0.0, 0.0, 1.7), 0)],
         {"told": [(0, "close_by", 1)]}, "close_by"),
        ([("wardrobe", (0.0, 0.0, -1.6), 0), ("nightstand", (0.2, 0.0, -1.5), 0)], {}, "apart"),
        ([("wardrobe", (0.0, 0.0, -1.9), 0)], {}, "on_floor"),
        ([("pendant_lamp", (0.0, 1.5, 0.0), 0), ("plant", (1.7, 0.3, 1.7), 0)], {}, "rests"),
        ([("wardrobe", (0.1, 0.0, -1.69), 0)],
         {"openings": [Opening("door", "door", 0, 1.0, 0.9, 2.0)]}, "door_free"),
        ([("plant", (0.8, 0.0, -0.8), 0)], {"placements": [(0, "in_corner", -1, -1)]}, "placed"),
    ],
)  # fmt: skip
def test_what_a_term_misses_is_mended_and_none_shrinks(things, more, wrong):
    kinds = [row.name for row in vocabulary().placements]
    more = {key: [(a, kinds.index(b), c, d) for a, b, c, d in rows] if key == "placements" else rows
            for key, rows in more.items()}  # fmt: skip
    plan, boxes = room(*things, **more)
    assert wrong in faults(plan, boxes)
    after = mended(plan, boxes, strength=0.1, rounds=40)
    assert wrong not in faults(plan, after)
    torch.testing.assert_close(after.size, boxes.size)


def test_known_boxes_stay():
    plan, boxes = room(("wardrobe", (0.0, 0.1, 0.0), 0), ("desk", (0.6, 0.0, 0.2), 0))
    after = mended(plan, boxes, strength=0.1, rounds=40, fixed=torch.tensor([True, False]))
    assert torch.equal(after.position[0], boxes.position[0])
    assert after.yaw[0] == boxes.yaw[0]
    assert "apart" not in faults(plan, after)


@pytest.mark.parametrize("tilt", [0.0, 20.0])
def test_what_is_almost_square_to_a_wall_ends_so(tilt):
    turn = np.radians(tilt)
    floor = FLOOR @ np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    yaws = (tilt + 2.0, tilt - 92.5, tilt + 184.0, tilt + 1.0)  # the third is turned too far, the last is known
    plan, boxes = room(*(("plant", (0.8 * k - 1.2, 0.3, 0.0), yaw) for k, yaw in enumerate(yaws)), floor=floor)
    after = settled(plan, boxes, torch.tensor([False, False, False, True]))
    assert np.degrees(after.yaw.numpy()) == pytest.approx([tilt, tilt - 90, tilt + 184, tilt + 1], abs=1e-3)
    assert after.position[:, 1].tolist() == pytest.approx([0.0, 0.0, 0.0, 0.3])
    assert torch.equal(after.position[:, ::2], boxes.position[:, ::2])
    assert torch.equal(after.size, boxes.size)


def test_a_chair_stays_under_its_desk():
    plan, boxes = room(("desk", (0.0, 0.0, -1.7), 0), ("office_chair", (0.0, 0.0, -1.3), 180))
    after = mended(plan, boxes, strength=0.1, rounds=40)
    assert 0.3 < float((after.position[1] - after.position[0])[2]) < 0.55


def test_rooms_do_not_meet():
    plan, boxes = room(("wardrobe", (0.0, 0.0, -1.69), 0), ("wardrobe", (0.1, 0.0, -1.69), 0))
    object.__setattr__(plan, "scene", torch.tensor([0, 1]))
    for name in ("floor", "height"):
        object.__setattr__(plan, name, torch.cat([getattr(plan, name)] * 2))
    object.__setattr__(plan, "openings", ((), ()))
    after = mended(plan, boxes, strength=0.1, rounds=20)
    assert float((after.position - boxes.position).norm(dim=1).max()) < 0.05


def test_only_what_is_nearly_drawn_is_pulled_and_known_numbers_stay():
    plan, boxes = room(("wardrobe", (0.0, 0.0, 0.0), 0), ("desk", (0.6, 0.0, 0.2), 0))
    x = boxes.encode(SCALE)
    pull = guided(lambda x, level: x, plan, SCALE, strength=0.1, rounds=20)
    assert torch.equal(pull(x, torch.full((2,), LATE + 0.1)), x)
    moved = pull(x, torch.tensor([0.1, 0.0]))
    assert torch.equal(moved[1], x[1])
    assert torch.equal(moved[:, :3], x[:, :3])
    assert "apart" not in faults(plan, Boxes.decode(moved, SCALE))


def test_openings_come_back_from_their_rows():
    said = [Opening("w", "window", 1, 0.5, 1.4, 1.3, 0.9), Opening("d", "door", 2, 0.3, 0.9, 2.0),
            Opening("p", "passage", 3, 1.0, 1.2, 2.1)]  # fmt: skip
    graph = GraphBatch.single([0], floor=FLOOR, openings=said)
    found = openings_of(graph.floor[0].numpy(), graph.openings[0].tolist())
    assert [(one.kind, one.edge, one.hinge) for one in found] == [
        ("window", 1, "left"), ("door", 2, "left"), ("door", 2, "right"), ("passage", 3, "left")
    ]  # fmt: skip
    for one, other in zip((found[0], found[1], found[3]), said, strict=True):
        assert (one.offset, one.width, one.height, one.sill) == pytest.approx(
            (other.offset, other.width, other.height, other.sill), abs=1e-5
        )


def test_what_lies_beyond_the_walls_is_measured():
    boxes = Boxes(torch.full((2, 3), 0.5), torch.tensor([[0.5, 0.0, -1.0], [0.0, 0.0, 1.5]]), torch.zeros(2))
    notched = [(-2.0, -1.5), (0.0, -1.5), (0.0, -0.5), (2.0, -0.5), (2.0, 1.5), (-2.0, 1.5)]
    missed = outside(boxes, torch.stack([torch.tensor(notched), torch.full((6, 2), torch.nan)]))
    assert missed[0].max() == 0.75  # the first stands in the notch, its back farthest
    assert missed[1].max() == 0  # nothing is known of the second one's floor
    assert outside(boxes[:1], torch.from_numpy(centred((9.0, 9.0)))[None]).max() == 0
