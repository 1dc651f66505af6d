"""Rooms of boxes become graphs: whose relations they have, and which they get."""

from dataclasses import replace

import numpy as np
import pytest
from pxr import Sdf, Usd

from echomodel.roomboxes import RoomBoxes
from echomodel.vocabulary import vocabulary
from echousd.graph import Node, SceneGraph
from echousd.stage.boxes import graph_of, read_dressing, room_of
from echousd.stage.encoding import StageError
from echousd.stage.write import graph_layer

ROOM = RoomBoxes(
    "one", "bedroom", np.array([(-2, -2), (2, -2), (2, 2), (-2, 2.0)]), 2.6, ("double_bed", "nightstand", "nightstand"),
    np.array([(1.6, 0.5, 2.0), (0.5, 0.5, 0.4), (0.5, 0.5, 0.4)]),
    np.array([(0, 0, -0.9), (1.1, 0, -1.7), (-1.1, 0, -1.7)]), np.zeros(3), ("a", "", "b"), (4, -1, 4),
)  # fmt: skip
TOLD = np.array([(1, vocabulary().predicate_id("close_by"), 0)])


@pytest.mark.parametrize("rules", [None, "strict", "sgfront"])
def test_relations_of_the_room_are_kept_by_whatever_rules(rules):
    graph = graph_of(replace(ROOM, relations=TOLD), rules)
    assert [str(relation) for relation in graph.relations] == ["nightstand_1 close_by double_bed"]


def test_a_room_without_relations_is_labelled_by_rules_alone():
    assert graph_of(ROOM, None).relations == ()
    labelled = {str(relation) for relation in graph_of(ROOM, "strict").relations}
    assert {"nightstand_1 close_by double_bed", "double_bed bigger_than nightstand_2"} <= labelled


@pytest.mark.parametrize("relations", [TOLD, np.zeros((0, 3), int)])
def test_a_room_comes_back_from_its_graph(relations):
    room = replace(ROOM, relations=relations)
    again = room_of(graph_of(room), "one")
    for name in ("size", "position", "yaw", "floor_polygon", "relations"):
        np.testing.assert_array_equal(getattr(again, name), getattr(room, name))
    for name in ("id", "room_type", "height", "categories", "models", "styles"):
        assert getattr(again, name) == getattr(room, name)
    bare = replace(room, styles=(), models=())
    assert room_of(graph_of(bare), "one").styles == (-1, -1, -1)
    theirs = graph_of(room).update_node("double_bed", style="art_deco")  # a style that nobody counted
    assert room_of(theirs, "one").styles == (0, -1, 1)


def test_a_room_whose_height_nobody_states_is_as_high_as_it_is_made():
    graph = graph_of(ROOM).with_room(height=None)
    assert room_of(graph, "one").height == graph.room.tall == 2.8
    taller = graph.update_node("double_bed", size=(1.6, 3.1, 2.0))
    assert room_of(taller, "one").height == 3.1


def test_without_a_floor_a_room_is_the_rectangle_around_its_furniture_however_it_is_turned():
    graph = graph_of(replace(ROOM, floor_polygon=np.zeros((0, 2))), None)
    corners = room_of(graph, "one").floor_polygon
    bed, stand = np.hypot(1.6, 2.0) / 2, np.hypot(0.5, 0.4) / 2
    low, high = (-1.1 - stand, -1.7 - stand), (1.1 + stand, -0.9 + bed)
    low = min(low[0], -bed), min(low[1], -0.9 - bed)
    assert corners.tolist() == [pytest.approx(one) for one in (low, (high[0], low[1]), high, (low[0], high[1]))]


def test_names_styles_and_models_of_the_nodes():
    graph = graph_of(ROOM, None)
    assert graph.names == ("double_bed", "nightstand_1", "nightstand_2")
    assert [node.style for node in graph.nodes] == ["style_4", None, "style_4"]
    assert [node.attributes.get("model") for node in graph.nodes] == ["a", None, "b"]
    assert graph.room.floor_polygon == tuple(map(tuple, ROOM.floor_polygon.tolist()))
    assert graph_of(replace(ROOM, floor_polygon=np.zeros((0, 2))), None).room.floor_polygon is None


def test_small_things_are_read_with_what_their_prims_state():
    nodes = (Node("bed", "double_bed"), Node("mat", "wardrobe", size=(1.5, 0.02, 1.0)))
    stage = Usd.Stage.Open(graph_layer(SceneGraph("bedroom", nodes)))
    prim = next(prim for prim in stage.Traverse() if prim.GetName() == "mat")
    prim.CreateAttribute("echo:shapes", Sdf.ValueTypeNames.Token).Set("dressing")
    prim.GetAttribute("echo:category").Set("rug")
    found = read_dressing(stage).nodes
    assert [(node.name, node.category) for node in found] == [("mat", "rug")]
    assert found[0].size == pytest.approx((1.5, 0.02, 1.0))
    prim.GetAttribute("echo:category").Clear()
    with pytest.raises(StageError, match="mat>: no category, allowed: echo:category, one of those of small things"):
        read_dressing(stage)
