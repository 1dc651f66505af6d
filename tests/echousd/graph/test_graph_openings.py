"""Openings in the graph: words, texts, errors with their line, differences, doors into what is locked."""

from __future__ import annotations

import re

import pytest

from echomodel.openings import Opening
from echousd.graph import GraphError, Node, RoomSpec, SceneGraph
from echousd.graph.difference import sentence
from echousd.graph.floors import check_doors
from echousd.graph.openings import opening_from_words

ROOM = RoomSpec("bedroom", size=(4.0, 3.0))
TEXT = """
room: {type: bedroom, size: [4, 3]}
objects: [wardrobe]
doors:
  - {wall: south, offset: 0.6, hinge: right}
windows: [north, {wall: 0, at: middle, width: 1.0}]
"""


@pytest.mark.parametrize(
    ("entry", "kind", "expected"),
    [
        ("north", "window", Opening("window", "window", 1, 0.8, 1.4, 1.3, 0.9)),
        ("front 1.2 1.6", "window", Opening("window", "window", 1, 1.2, 1.6, 1.3, 0.9)),
        ("south 0.6 hinge=right swing=outwards name=in", "door", Opening("in", "door", 3, 0.6, 0.9, 2, 0, "right", "out")),  # noqa: E501
        ({"wall": "left", "at": "end"}, "door", Opening("door", "door", 0, 3.0, 0.9, 2.0)),
        ({"edge": 2}, "passage", Opening("passage", "passage", 2, 1.4, 1.2, 2.1)),
        (2, "door", Opening("door", "door", 2, 0.1, 0.9, 2.0)),
        ({"wall": 2, "width": 2.9}, "door", Opening("door", "door", 2, 0.1, 2.9, 2.0)),
        ({"wall": 3, "width": 2.9}, "door", Opening("door", "door", 3, 0.05, 2.9, 2.0)),  # no more is free at each side
    ],
)  # fmt: skip
def test_words(entry: object, kind: str, expected: Opening) -> None:
    assert opening_from_words(entry, kind, ROOM) == expected


def test_words_on_an_outline_name_the_longest_wall_that_lies_there() -> None:
    outline = RoomSpec("bedroom", floor_polygon=((0, 0), (1, 0), (1, 1), (4, 1), (4, 3), (0, 3)))
    assert opening_from_words("west", "door", outline).edge == 2  # two walls look to -z: 1 m and 3 m
    assert opening_from_words("north", "door", outline).edge == 3


def test_a_text_with_openings_comes_back() -> None:
    graph = SceneGraph.from_yaml(TEXT)
    door, window, other = graph.room.openings
    assert (door.edge, door.offset, door.hinge) == (3, 0.6, "right")
    assert (window.edge, other.edge, other.offset, other.name) == (1, 0, 1.5, "window_2")
    assert SceneGraph.from_yaml(graph.to_yaml()) == SceneGraph.from_json(graph.to_json()) == graph


def test_walls_of_a_floor_that_is_still_unknown() -> None:
    graph = SceneGraph.from_yaml("room: bedroom\nobjects: [wardrobe]\ndoors: south 0.4\n")
    assert graph.room.openings == (Opening("door", "door", 3, 0.4, 0.9, 2.0),)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("offset: 0.6", "offset: 2.5", "5: room: openings: door 'door': reaches from 2.50 to 3.40 m along wall 3"),
        ("hinge: right", "hinge: top", "5: opening 'door': hinge is 'top', allowed: left, right"),
        ("wall: south", "wall: up", "5: door 'door': wall 'up', allowed: 0 to 3, north (front)"),
        ("wall: south", "wall: 4", "5: door 'door': wall 4, allowed: 0 to 3, north (front)"),
        ("wall: south, ", "", "5: door 'door': wall is missing, allowed: 0 to 3, north"),
        ("offset: 0.6", "ofset: 0.6", "5: door: unknown field 'ofset', did you mean offset?"),
        ("windows: [north,", "windows: ['south 0.5',", "6: room: openings: window 'window' and door 'door' overlap by 0.90 m on wall 3"),  # noqa: E501
        ("windows: [north,", "windows: [north blue,", "6: window 'window': offset is 'blue', allowed: a number, metres"),  # noqa: E501
        (", size: [4, 3]", "", "6: window 'window': offset is missing, allowed: metres along the wall, or say the size of the room"),  # noqa: E501
    ],
)  # fmt: skip
def test_faults_name_their_line(old: str, new: str, said: str) -> None:
    from echousd.graph.text import graph_from_text

    with pytest.raises(
        GraphError,
        match="^" + re.escape("room.yaml:" + said).replace("room:\\ openings:\\ ", "(room: openings: |room: )?"),
    ):
        graph_from_text(SceneGraph, TEXT.replace(old, new), "yaml", "room.yaml")


def test_a_door_into_what_is_locked() -> None:
    room = ROOM.replaced(openings=(opening_from_words("south 0.1", "door", ROOM),))
    box = {"size": (1.0, 2.0, 0.6), "position": (-1.5, 0.0, 1.0), "yaw": 0.0}
    graph = SceneGraph(room, (Node("wardrobe", "wardrobe", locked=True, **box), Node("bed", "double_bed")))
    with pytest.raises(
        GraphError, match=r"^door 'door' opens into the locked object 'wardrobe' \(0\.\d\d m² of its swing\)"
    ):
        check_doors(graph)
    turned = graph.update_node("wardrobe", yaw=None)  # in the way however it is turned
    assert turned.node("wardrobe").yaw is None
    with pytest.raises(GraphError, match=r"opens into the locked object 'wardrobe'"):
        check_doors(turned)
    check_doors(turned.update_node("wardrobe", position=(-0.5, 0.0, 1.0)))  # lengthwise it is not
    check_doors(graph.lock("wardrobe", False))
    check_doors(graph.replaced(room=room.replaced(openings=(opening_from_words("south 0.1 swing=out", "door", ROOM),))))


def test_openings_fit_the_usual_height_where_none_is_stated():
    tall = opening_from_words("south 0.1 height=3.2", "door", ROOM)
    graph = SceneGraph(RoomSpec("bedroom", size=(4.0, 3.0), openings=(tall,)), (Node("bed", "double_bed"),))
    with pytest.raises(GraphError, match=r"^door 'door': its top is at 3.20 m, allowed: up to 2.80 m, the height of"):
        check_doors(graph)
    check_doors(graph.replaced(room=graph.room.replaced(height=3.4)))


def test_differences() -> None:
    before = SceneGraph.from_yaml(TEXT)
    door, window, other = before.room.openings
    moved = Opening(**{**door.to_json(), "offset": 0.7})
    after = before.replaced(room=before.room.replaced(openings=(moved, window), height=2.5))
    assert before.diff(after).lines() == [
        "~ room: height none -> 2.5",
        f"- {sentence(other)}",
        f"~ {sentence(door)} -> {sentence(moved)}",
    ]
    assert not before.diff(before)
