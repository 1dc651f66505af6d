"""Drafts by the room generator: given furniture in a given room, told relations first."""

import numpy as np
import pytest
import torch

from echomodel.boxes import Boxes
from echomodel.drafts import drafted
from echomodel.floors import footprint, signed_distance
from echomodel.graph import GraphBatch
from echomodel.openingrows import ROW, clearances, opening_rows
from echomodel.rooms import generate_rooms
from echomodel.rooms.outline import floor_of
from echomodel.rules import label_relations, verdicts
from echomodel.rules.telling import told_relations
from echomodel.samplers import sample
from echomodel.vocabulary import vocabulary


def seeded(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


@pytest.fixture(scope="module")
def rooms():
    return generate_rooms(24, seed=71)


def told(rooms, per_object):
    graphs = []
    for number, room in enumerate(rooms):
        edges = torch.from_numpy(label_relations(room))
        graphs.append(GraphBatch.from_room(room, triplets=told_relations(edges, room, per_object, seeded(number))))
    return graphs


def test_drafts_hold_the_furniture_on_its_floor(rooms):
    graph = GraphBatch.pack(told(rooms, 0))
    boxes, share = drafted(graph, seeded(), rules="strict")
    assert len(boxes) == graph.num_nodes
    assert share.tolist() == [1.0] * len(rooms)
    inside = signed_distance(footprint(boxes.size, boxes.position, boxes.yaw), graph.floor[graph.scene]) > -0.1
    assert inside.all(1).float().mean() > 0.97
    again, _ = drafted(graph, seeded(), rules="strict")
    other, _ = drafted(graph, seeded(1), rules="strict")
    assert torch.equal(boxes.position, again.position)
    assert not torch.equal(boxes.position, other.position)


def test_drafts_keep_what_is_told(rooms):
    graph = GraphBatch.pack(told(rooms, 1.0))
    kept = {}
    for draws in (1, 16):
        boxes, share = drafted(graph, seeded(), rules="strict", draws=draws)
        verdict = verdicts(boxes, graph.triplets)
        kept[draws] = float((verdict == 1).sum() / (verdict >= 0).sum())
        if draws == 16:
            scene = graph.scene[graph.triplets[:, 0]]
            broken = torch.zeros(len(rooms)).index_add_(0, scene, (verdict == 0).float())
            assert torch.equal(share >= 1, broken == 0)
    assert kept[16] > 0.75
    assert kept[16] > kept[1]


def test_doors_stay_free(rooms):
    graph = GraphBatch.pack(told(rooms, 0))
    boxes, _ = drafted(graph, seeded(), rules="strict")
    words = [category.name for category in vocabulary().categories]
    standing = torch.tensor([vocabulary().category(words[k]).support == "floor" for k in graph.category.tolist()])
    clear = clearances(boxes, graph.openings[graph.scene])[standing, 5]  # tanh of the clearance of doors over 0.4 m
    assert (clear < -0.15).float().mean() < 0.02


def test_scenes_without_a_floor_cannot_be_arranged():
    with pytest.raises(ValueError, match="a scene without a floor cannot be arranged"):
        drafted(GraphBatch.single([3, 4]), seeded(), rules="strict")


def test_a_slanted_outline_is_cut_from_its_bounding_box():
    floor = floor_of(np.array([[0.0, 0.0], [5.0, 0.0], [5.0, 2.0], [3.0, 4.0], [0.0, 4.0]]), np.zeros((0, ROW)))
    assert (floor.half_x, floor.half_z) == (2.5, 2.0)
    assert floor.holds(-2.4, -1.9, 0.4, 1.9)
    assert not floor.holds(2.0, 1.5, 2.4, 1.9)
    assert len(floor.walls) == 5
    reversed_turn = floor_of(np.array([[0.0, 0.0], [0.0, 4.0], [5.0, 4.0], [5.0, 0.0]]), np.zeros((0, ROW)))
    for wall in reversed_turn.walls:  # every wall's normal points into the room
        x, z = wall.point(wall.length / 2, 0.5)
        assert reversed_turn.holds(x - 0.1, z - 0.1, x + 0.1, z + 0.1)


def test_sampling_begins_on_a_draft():
    draft, x = torch.randn(5, 8, generator=seeded()), torch.randn(5, 8, generator=seeded(1))
    seen = []

    def predict(noisy, level):
        seen.append((noisy, float(level[0])))
        return draft

    assert torch.equal(sample("ddim", predict, x, 20, "velocity", draft=draft, start=0.0), draft)
    found = sample("ddim", predict, x, 20, "velocity", draft=draft, start=0.25)
    assert torch.allclose(found, draft, atol=1e-5)
    assert [round(level, 3) for _, level in seen] == [0.25, 0.2, 0.15, 0.1, 0.05]
    assert (seen[0][0] - draft).abs().mean() < (x - draft).abs().mean()
    with pytest.raises(ValueError, match=r"start is 1\.5, allowed: 0 to 1"):
        sample("ddim", predict, x, 20, "velocity", draft=draft, start=1.5)


def test_what_is_told_is_near_and_grows(rooms):
    for room in rooms[:8]:
        edges = torch.from_numpy(label_relations(room))
        few, many = (told_relations(edges, room, per, seeded()) for per in (0.5, 2.0))
        assert len(few) == round(0.5 * len(room))
        assert len(few) <= len(many) <= 2 * len(room)
        assert {tuple(row) for row in few.tolist()} <= {tuple(row) for row in edges.tolist()}
        pairs = {frozenset(row[::2]) for row in few.tolist()}
        assert len(pairs) == len(few)  # one relation for each pair


def test_clearances_know_doors_and_windows(rooms):
    room = next(room for room in rooms if {"door", "window"} <= {opening.kind for opening in room.openings})
    rows = opening_rows(room.openings, room.floor_polygon)
    assert rows.shape == (len(room.openings), ROW)
    door = rows[[o.kind == "door" for o in room.openings]][:1]
    middle, inward = (door[0, :2] + door[0, 2:4]) / 2, door[0, 4:6]
    places = torch.stack([middle + inward * away for away in (0.3, 3.0)])
    position = torch.stack([places[:, 0], torch.zeros(2), places[:, 1]], 1)
    boxes = Boxes(torch.full((2, 3), 0.3), position, torch.zeros(2))
    clear = clearances(boxes, door[None].expand(2, -1, -1))
    assert clear[0, 5] < 0 < clear[1, 5]
    assert (clear[:, 10:] == 0).all()  # no window was told
    assert (clearances(boxes, torch.zeros(2, 0, ROW)) == 0).all()
