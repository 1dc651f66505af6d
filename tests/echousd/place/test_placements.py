"""Placements that a graph states are kept by placing and judged by verdicts and check."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from echomodel.boxes import Boxes
from echousd.checks import check
from echousd.graph import Node, Relation, RoomSpec, SceneGraph
from echousd.make.verdicts import relation_verdicts
from echousd.place.placing import place

ROOM = RoomSpec("living_room", size=(4.6, 4.0), height=2.7)
KINDS = {"sofa": "sofa", "armchair": "armchair", "table": "side_table", "plant": "plant", "board": "dining_table"}
SIZES = [[2.0, 0.85, 0.9], [0.8, 0.9, 0.8], [0.45, 0.5, 0.45], [0.5, 1.1, 0.5], [1.4, 0.75, 0.8]]


def graph_of(**fields: dict) -> SceneGraph:
    nodes = tuple(Node(name, kind, **fields.get(name, {})) for name, kind in KINDS.items())
    return SceneGraph(ROOM, nodes, (Relation("armchair", "front", "sofa"),))


def drawn(seed: int) -> Boxes:
    luck = np.random.default_rng(seed)
    position = np.zeros((5, 3))
    position[:, [0, 2]] = luck.uniform(-1.5, 1.5, (5, 2))
    values = np.array(SIZES), position, luck.choice([0, np.pi / 2, np.pi, -np.pi / 2], 5)
    return Boxes(*(torch.tensor(v, dtype=torch.float32) for v in values))


@pytest.mark.parametrize("seed", range(4))
def test_placing_puts_things_where_the_graph_says(seed):
    graph = graph_of(
        plant={"place": "in_corner"}, board={"place": "against_wall"}, table={"between": ("sofa", "armchair")}
    )
    states = [verdict.state for verdict in relation_verdicts(graph, place(graph, drawn(seed)).boxes)]
    assert states == ["kept"] * 4


def test_without_placements_nothing_changes():
    one, other = (place(graph, drawn(0)).boxes for graph in (graph_of(), graph_of(plant={"title": "Farn"})))
    assert np.array_equal(one.position, other.position)


def test_verdicts_say_what_was_asked():
    graph = graph_of(plant={"place": "in_corner"}, table={"between": ("sofa", "armchair")})
    boxes = drawn(1)
    found = relation_verdicts(graph, boxes)
    assert [verdict.sentence for verdict in found[1:]] == ["table between sofa and armchair", "plant in_corner"]
    assert {verdict.state for verdict in found[1:]} == {"broken"}
    nowhere = graph.replaced(room=RoomSpec("living_room"))
    assert [verdict.state for verdict in relation_verdicts(nowhere, boxes)][1:] == ["broken", "unmeasured"]


def test_check_measures_placements(tmp_path):
    import echousd

    graph = graph_of(plant={"place": "in_corner"}, table={"between": ("sofa", "armchair")})
    boxes = drawn(1)
    for good in (True, False):
        placed = place(graph, boxes).boxes if good else boxes
        room = echousd.generate(graph, shapes="boxes", boxes=placed, place=False, walls=False, dress="none")
        root = room.save(tmp_path / str(good))
        found = {each.sentence: each.state == "kept" for each in check(root).relations}
        assert found["plant in_corner"] is good
        assert found["table between sofa and armchair"] is good
