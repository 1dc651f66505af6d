"""The samples are valid, their stages say what their texts say, and a real room can keep all their relations."""

from __future__ import annotations

from math import pi
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from echomodel.vocabulary import vocabulary
from echousd.graph import load_graph

SAMPLES = Path(__file__).parents[2] / "samples"
NAMES = ("bedroom", "dining_room", "living_dining", "living_room", "study")
BACK, FRONT, LEFT, RIGHT = pi / 2, -pi / 2, 0.0, pi  # yaw of furniture whose back is at that wall

# One possible arrangement per sample: name -> (size, position, yaw). It stands here to prove that there is one.
WITNESSES = {
    "bedroom": {
        "bed": ((2.0, 1.05, 2.2), (-0.97, 0, 0), BACK),
        "nightstand_left": ((0.5, 0.55, 0.42), (-1.86, 0, -1.3), BACK),
        "nightstand_right": ((0.5, 0.55, 0.42), (-1.86, 0, 1.3), BACK),
        "reading_lamp": ((0.25, 0.45, 0.25), (-1.86, 0.55, -1.3), BACK),
        "wardrobe": ((1.8, 2.25, 0.61), (1.78, 0, 0.5), FRONT),
        "pendant": ((0.6, 0.7, 0.6), (-0.8, 1.9, 0), 0.0),
    },
    "living_room": {
        "sofa": ((2.3, 0.86, 0.93), (-2.1, 0, 0), BACK),
        "coffee_table": ((1.2, 0.4, 0.7), (-0.6, 0, 0), BACK),
        "tv_stand": ((2.0, 0.54, 0.44), (2.35, 0, 0), FRONT),
        "armchair": ((0.85, 0.85, 0.86), (-0.6, 0, 1.35), RIGHT),
        "side_table": ((0.5, 0.55, 0.5), (-2.2, 0, -1.45), BACK),
        "floor_lamp": ((0.4, 1.6, 0.4), (-2.2, 0, 1.45), 0.0),
        "plant": ((0.6, 1.3, 0.6), (2.2, 0, 1.5), 0.0),
        "pendant": ((0.7, 0.8, 0.5), (-0.6, 1.8, 0), 0.0),
    },
    "dining_room": {
        "table": ((1.7, 0.75, 0.95), (0, 0, 0), 0.0),
        "chair_1": ((0.5, 0.86, 0.55), (-0.4, 0, -0.75), LEFT),
        "chair_2": ((0.5, 0.86, 0.55), (0.4, 0, -0.75), LEFT),
        "chair_3": ((0.5, 0.86, 0.55), (-0.4, 0, 0.75), RIGHT),
        "chair_4": ((0.5, 0.86, 0.55), (0.4, 0, 0.75), RIGHT),
        "sideboard": ((1.3, 0.95, 0.41), (-1.89, 0, 0), BACK),
        "plant": ((0.6, 1.3, 0.6), (1.7, 0, 1.3), 0.0),
        "pendant": ((1.0, 0.8, 0.5), (0, 1.8, 0), 0.0),
    },
    "study": {
        "desk": ((1.4, 0.75, 0.65), (-1.2, 0, 0), BACK),
        "desk_chair": ((0.55, 0.9, 0.57), (-0.55, 0, 0.15), FRONT),
        "desk_lamp": ((0.25, 0.45, 0.25), (-1.3, 0.75, -0.45), 0.0),
        "books": ((1.2, 1.97, 0.35), (0.4, 0, 1.52), RIGHT),
        "armchair": ((0.85, 0.85, 0.86), (0.9, 0, -0.9), FRONT),
        "floor_lamp": ((0.4, 1.6, 0.4), (1.2, 0, -0.2), 0.0),
        "ceiling_lamp": ((0.6, 0.2, 0.6), (0, 2.4, 0), 0.0),
    },
    "living_dining": {
        "sofa": ((2.3, 0.86, 0.93), (-1.7, 0, -2), BACK),
        "coffee_table": ((1.2, 0.4, 0.7), (-0.4, 0, -2), BACK),
        "tv_stand": ((2.0, 0.54, 0.44), (1.95, 0, -2), FRONT),
        "armchair": ((0.85, 0.85, 0.86), (-0.4, 0, -3.3), LEFT),
        "side_table": ((0.5, 0.55, 0.5), (-1.8, 0, -0.5), BACK),
        "floor_lamp": ((0.4, 1.6, 0.4), (-1.8, 0, -3.45), 0.0),
        "living_pendant": ((0.8, 0.8, 0.8), (-0.4, 1.8, -2), 0.0),
        "table": ((1.7, 0.75, 0.95), (0, 0, 2), 0.0),
        "chair_1": ((0.5, 0.86, 0.55), (-0.4, 0, 1.25), LEFT),
        "chair_2": ((0.5, 0.86, 0.55), (0.4, 0, 1.25), LEFT),
        "chair_3": ((0.5, 0.86, 0.55), (-0.4, 0, 2.75), RIGHT),
        "chair_4": ((0.5, 0.86, 0.55), (0.4, 0, 2.75), RIGHT),
        "sideboard": ((1.3, 0.95, 0.41), (0, 0, 3.78), RIGHT),
        "dining_pendant": ((1.0, 0.8, 0.5), (0, 1.8, 2), 0.0),
    },
}


def test_there_are_five_samples_and_each_has_both_forms():
    assert sorted(path.stem for path in SAMPLES.glob("*.yaml")) == list(NAMES)
    assert {path.stem for path in SAMPLES.glob("*.usda")} >= set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_the_stage_says_what_the_text_says(name):
    """After a change: `echousd new samples/NAME.usda --from samples/NAME.yaml --force`."""
    assert load_graph(SAMPLES / f"{name}.usda") == load_graph(SAMPLES / f"{name}.yaml")


@pytest.mark.parametrize("name", NAMES)
def test_every_object_is_related_and_relations_stay_few(name):
    graph = load_graph(SAMPLES / f"{name}.yaml")
    assert {end for relation in graph.relations for end in (relation.subject, relation.object)} == set(graph.names)
    assert 1 <= len(graph.relations) / len(graph.nodes) <= 3


def test_the_two_zone_room_has_fourteen_objects():
    graph = load_graph(SAMPLES / "living_dining.yaml")
    assert graph.room.type == "living_dining_room"
    assert len(graph.nodes) == 14


@pytest.mark.parametrize("name", NAMES)
def test_an_arrangement_keeps_every_relation(name):
    from echomodel.rules import verdicts

    graph, witness, words = load_graph(SAMPLES / f"{name}.yaml"), WITNESSES[name], vocabulary()
    assert set(witness) == set(graph.names)
    boxes = SimpleNamespace(
        size=np.array([witness[n][0] for n in graph.names], float),
        position=np.array([witness[n][1] for n in graph.names], float),
        yaw=np.array([witness[n][2] for n in graph.names], float),
    )
    triplets = np.array(
        [
            (graph.names.index(r.subject), words.predicate_id(r.predicate), graph.names.index(r.object))
            for r in graph.relations
        ]
    )
    broken = [str(r) for r, kept in zip(graph.relations, verdicts(boxes, triplets).tolist(), strict=True) if kept == 0]
    assert broken == []


@pytest.mark.parametrize("name", NAMES)
def test_the_arrangement_lies_inside_the_room_and_nothing_collides(name):
    from shapely import Polygon, box

    graph, witness = load_graph(SAMPLES / f"{name}.yaml"), WITNESSES[name]
    assert graph.room.extents is not None
    width, depth = graph.room.extents
    floor = box(-width / 2 - 1e-6, -depth / 2 - 1e-6, width / 2 + 1e-6, depth / 2 + 1e-6)
    solids = {}
    for object_name, (size, position, yaw) in witness.items():
        corners = [(x * size[0] / 2, z * size[2] / 2) for x, z in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
        turned = [(np.cos(yaw) * x + np.sin(yaw) * z, -np.sin(yaw) * x + np.cos(yaw) * z) for x, z in corners]
        foot = Polygon([(position[0] + x, position[2] + z) for x, z in turned])
        assert floor.contains(foot), object_name
        solids[object_name] = (foot, position[1], position[1] + size[1])
        assert solids[object_name][2] <= graph.room.height + 1e-6, object_name
    for one, (foot, low, high) in solids.items():
        for other, (foot_2, low_2, high_2) in solids.items():
            if one < other and min(high, high_2) - max(low, low_2) > 1e-6:
                assert foot.intersection(foot_2).area < 1e-6, (one, other)


@pytest.mark.parametrize("name", NAMES)
def test_a_sample_stage_holds_one_room(name):
    from echousd.stage.read import read_rooms

    rooms = read_rooms(SAMPLES / f"{name}.usda")
    assert list(rooms) == ["/Room"]
    assert rooms["/Room"] == load_graph(SAMPLES / f"{name}.yaml")
