"""Kitchens are planned as one group before everything else is placed; what the graph states comes first."""

import json

import numpy as np
import torch

from echomodel.boxes import Boxes
from echousd.graph import SceneGraph
from echousd.place.living import living_faults
from echousd.place.placing import place

WORDS = ("base_unit", "base_unit", "sink_unit", "hob_unit", "fridge", "wall_unit", "range_hood", "ceiling_lamp")


def kitchen(relations=(), **fixed):
    names = [f"{word}_{k}" if WORDS.count(word) > 1 else word for k, word in enumerate(WORDS)]
    objects = {name: {"category": word, **fixed.get(name, {})} for name, word in zip(names, WORDS, strict=True)}
    room = {"type": "kitchen", "size": [3.6, 3.0]}
    graph = SceneGraph.from_yaml(json.dumps({"room": room, "objects": objects, "relations": list(relations)}))
    rng = np.random.default_rng(3)
    n = len(WORDS)
    where = np.stack([rng.uniform(-1.5, 1.5, n), np.zeros(n), rng.uniform(-1.2, 1.2, n)], 1)
    size = np.full((n, 3), 0.7)
    for k, node in enumerate(graph.nodes):
        if node.position is not None:
            size[k], where[k] = node.size, node.position
    boxes = Boxes(*(torch.tensor(v, dtype=torch.float32) for v in (size, where, np.zeros(n))))
    return graph, place(graph, boxes)


def test_units_stand_in_a_row_without_a_fault():
    graph, found = kitchen()
    assert found.collisions == ()
    assert {fault.rule for fault in living_faults(graph, found.boxes)} == set()
    assert set(found.boxes.size[:4, 2].tolist()) == {np.float32(0.6)}  # one front line


def test_the_graph_says_where_in_the_row():
    for side in ("left", "right"):
        graph, found = kitchen([f"fridge {side} sink_unit"])
        assert (found.verdict != 0).all()
        assert {f.rule for f in living_faults(graph, found.boxes)} <= {"work_triangle"}


def test_what_stands_already_stays_and_is_built_around():
    place_of = {"size": [0.6, 1.8, 0.6], "position": [-1.5, 0.0, -1.19], "yaw": 0.0}
    graph, found = kitchen(fridge=place_of)
    at = graph.names.index("fridge")
    assert found.boxes.position[at].tolist() == [-1.5, 0.0, np.float32(-1.19)]
    rules = {fault.rule for fault in living_faults(graph, found.boxes)}
    assert "apart" not in rules
    assert found.collisions == ()


def test_a_bench_told_to_be_at_a_wall_has_its_back_there():
    room = {"type": "hallway", "size": [3.6, 1.9]}
    bench = {"category": "bench", "place": "against_wall"}
    graph = SceneGraph.from_yaml(json.dumps({"room": room, "objects": {"bench": bench}}))
    for x, z, yaw in ((0.3, -0.4, 1.6), (-1.2, 0.4, -1.5), (0.0, 0.0, 1.5)):
        drawn = Boxes(torch.tensor([[1.1, 0.45, 0.35]]), torch.tensor([[x, 0.0, z]]), torch.tensor([yaw]))
        found = place(graph, drawn).boxes
        front = np.array([np.sin(found.yaw[0]), np.cos(found.yaw[0])])
        back = np.asarray(found.position[0, [0, 2]]) - front * float(found.size[0, 2]) / 2
        assert np.abs(np.abs(back) - (1.8, 0.95)).min() < 0.3
