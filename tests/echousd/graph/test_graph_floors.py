"""Floors of graphs: proposed where nobody states one, and errors for those that cannot hold their furniture."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
import shapely

from echomodel.boxes2d import footprints
from echomodel.openings import USUAL, Opening, free_area, inward_normal, segment, swing_area
from echomodel.rooms.runs import WORKTOP
from echousd.graph import GraphError, Node, Relation, RoomSpec, SceneGraph
from echousd.graph.floors import (
    check_space,
    with_floor,
    with_lowered_windows,
    with_placed_openings,
    with_plan,
)
from echousd.make.edit import with_plan_of
from echousd.make.fitting import with_wider_floor
from echousd.shapes.fittings import window_sill

GRAPH = SceneGraph(
    "bedroom",
    (Node("bed", "double_bed"), Node("left", "nightstand"), Node("right", "nightstand"), Node("wardrobe", "wardrobe")),
    (Relation("left", "left", "bed"), Relation("right", "right", "bed")),
)
NOTHING = (np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))


def test_a_floor_is_proposed_once_and_follows_the_seed() -> None:
    made = [with_floor(GRAPH, seed) for seed in range(6)]
    assert made[2] == with_floor(GRAPH, 2)
    assert len({graph.room.size for graph in made}) > 3
    assert with_floor(made[0], 5) is made[0]
    stated = GRAPH.replaced(room=RoomSpec("bedroom", size=(3, 3)))
    assert with_floor(stated, 1) is stated


@pytest.mark.parametrize("yaw", [None, 0.3])
@pytest.mark.parametrize("x", [0.3, -5.0, 400.0])
def test_a_proposed_floor_holds_what_has_its_place_already(x: float, yaw: float | None) -> None:
    size, where = (1.6, 1.0, 2.0), np.array((x, 0.0, 0.4))
    placed = GRAPH.update_node("bed", size=size, position=tuple(where), yaw=yaw)
    for seed in range(4):
        made = with_plan(placed, seed).room
        assert {opening.kind for opening in made.openings} == {"door", "window"}
        assert np.allclose(made.extents, with_floor(GRAPH, seed).room.extents, atol=1.5)
        assert (made.size is not None) == (x == 0.3)
        for turn in (0.0, np.pi / 2) if yaw is None else (yaw,):
            corners = footprints(np.array([size]), where[None], np.array([turn]))[0]
            assert (corners >= made.corners.min(0) - 2e-3).all()
            assert (corners <= made.corners.max(0) + 2e-3).all()


def test_openings_are_placed_where_none_is_stated() -> None:
    graph = with_placed_openings(with_floor(GRAPH, 1), NOTHING, 1)
    assert {opening.kind for opening in graph.room.openings} == {"door", "window"}
    assert with_placed_openings(graph, NOTHING, 2) is graph
    assert with_placed_openings(GRAPH, NOTHING, 1) is GRAPH


@pytest.mark.parametrize("kind", ["kitchen", "utility_room", "bathroom", "living_room"])
def test_proposed_windows_and_their_boards_are_above_worktops(kind: str) -> None:
    nodes = (Node("sink", "sink_unit"), Node("base", "base_unit"))  # fitted units, in a living room as well
    for seed in range(4):
        graph = with_plan(SceneGraph(kind, nodes), seed)
        boards = [window_sill(o).bounds[0, 1] for o in graph.room.openings if o.kind == "window"]
        assert boards
        assert min(boards) >= WORKTOP
    dry = with_plan(GRAPH, 0).room.openings
    assert {opening.sill for opening in dry} == {0.0, USUAL["window"]["sill"]}


def test_a_plan_is_a_floor_and_openings_out_of_the_way_of_what_is_fixed() -> None:
    made = [with_plan(GRAPH, seed) for seed in range(30)]
    assert made[4] == with_plan(GRAPH, 4)
    assert all({opening.kind for opening in graph.room.openings} == {"door", "window"} for graph in made)
    assert 0 < sum(graph.room.floor_polygon is not None for graph in made) < 15
    stated = GRAPH.replaced(room=RoomSpec("bedroom", size=(4.0, 3.2)))
    wardrobe = {"size": (1.6, 2.2, 0.6), "yaw": 0.0}
    for x, z in ((-1.2, -1.3), (1.2, -1.3)):
        fixed = stated.update_node("wardrobe", position=(x, 0.0, z), **wardrobe)
        door = with_plan(fixed, 3).room.openings[0]
        assert fixed.room.corners is not None
        swing = shapely.Polygon(swing_area(fixed.room.corners, door))
        assert swing.intersection(shapely.box(x - 0.8, z - 0.3, x + 0.8, z + 0.3)).area < 0.01


def test_doors_slide_by_the_style_of_the_room_where_the_wall_beside_is_free() -> None:
    made = {
        style: [with_plan(GRAPH.with_room(style=style), seed).room for seed in range(40)]
        for style in (None, "industrial", "classic")
    }
    slid = {
        style: [(room, one) for room in rooms for one in room.openings if one.swing == "slide"]
        for style, rooms in made.items()
    }
    assert len(slid["classic"]) == 0 < len(slid[None]) < len(slid["industrial"]) < 30
    for room, door in (one for found in slid.values() for one in found):
        assert door.kind == "door"
        free = shapely.Polygon(free_area(room.corners, door))
        assert shapely.Polygon(room.corners).buffer(1e-6).covers(free)
        for other in (other for other in room.openings if other.kind == "window"):
            assert free.intersection(shapely.LineString(segment(room.corners, other))).length < 1e-3
    stated = GRAPH.with_room(size=(4.0, 3.2), style="industrial", openings=(Opening("d", "door", 0, 1.5, 0.9, 2.0),))
    assert {with_plan(stated, seed).room.openings[0].swing for seed in range(20)} == {"in"}


def test_windows_reach_down_by_the_style_of_the_room_where_nothing_stands_before_them() -> None:
    def lowered(boxes, style="japandi", room="bedroom", openings=()):
        asked = GRAPH.replaced(room=RoomSpec(room, size=(4.0, 3.2), style=style, openings=openings))
        planned = [with_placed_openings(asked, NOTHING, seed) for seed in range(60)]
        made = [with_lowered_windows(graph, asked, boxes(graph), seed) for seed, graph in enumerate(planned)]
        for before, after in ((a, b) for p, m in zip(planned, made, strict=True)
                              for a, b in zip(p.room.openings, m.room.openings, strict=True)):  # fmt: skip
            assert after.sill + after.height == pytest.approx(before.sill + before.height)
            assert after == before or after.kind == "window"
        return Counter(one.sill for graph in made for one in graph.room.openings if one.kind == "window")

    def before(high, off):
        def box(graph):
            window = next(one for one in graph.room.openings if one.kind == "window")
            near, far = segment(graph.room.corners, window)
            x, z = (near + far) / 2 + (off + 0.1) * inward_normal(graph.room.corners, window.edge)
            return np.array([(0.2, high, 0.2)]), np.array([(x, 0.0, z)]), np.zeros(1)

        return box

    free = lowered(lambda graph: NOTHING)
    assert set(free) == {0.0, 0.3, 0.9}
    assert 15 < free[0.0] < 40
    assert 5 < free[0.3] < 30
    assert lowered(lambda graph: NOTHING, "industrial")[0.0] == 0
    assert lowered(before(0.5, 0.65)) == free
    assert set(lowered(before(0.5, 0.4))) == {0.3, 0.9}  # in nobody's light, but in the way out
    assert set(lowered(before(0.5, 0.1))) == {0.9}
    assert set(lowered(before(0.25, 0.1))) == {0.3, 0.9}
    assert set(lowered(lambda graph: NOTHING, room="bathroom")) == {1.2}
    window = Opening("w", "window", 0, 1.0, 1.2, 1.0, 1.1)
    assert set(lowered(lambda graph: NOTHING, openings=(window,))) == {1.1}


def test_floors_that_do_not_hold_their_furniture_grow() -> None:
    cut = next(graph for graph in (with_plan(GRAPH, seed) for seed in range(60)) if graph.room.floor_polygon)
    extents = np.array(cut.room.extents)
    inside = np.array(cut.room.floor_polygon) * 0.9
    assert with_wider_floor(cut, inside) is cut
    wider = with_wider_floor(cut, np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * extents / 2 * 1.2).room
    assert wider.floor_polygon is None
    assert wider.openings == ()
    assert (np.array(wider.size) >= extents * 1.2 - 1e-9).all()


def test_the_plan_of_an_earlier_graph_stays() -> None:
    before = with_placed_openings(with_floor(GRAPH, 1), NOTHING, 1)
    assert with_plan_of(GRAPH, before) == before
    other = GRAPH.replaced(room=RoomSpec("bedroom", size=(9, 9)))
    assert with_plan_of(other, before) == other


def test_floors_that_are_too_small() -> None:
    def sized(x: float, z: float, graph: SceneGraph = GRAPH) -> SceneGraph:
        return graph.replaced(room=RoomSpec("bedroom", size=(x, z)))

    assert check_space(sized(4, 3.5)) == check_space(GRAPH) == ()
    (said,) = check_space(sized(2.5, 2.5))
    assert said.startswith("the floor of 2.50 x 2.50 m (6.2 m²) is small for furniture that covers about ")
    with pytest.raises(
        GraphError, match=r"1\.50 x 1\.50 m \(2\.2 m²\) is too small for its furniture, which covers at"
    ):
        check_space(sized(1.5, 1.5))
    long = GRAPH.update_node("wardrobe", size=(6.0, 2.2, 0.6))
    with pytest.raises(GraphError, match=r"too small for 'wardrobe', which is 6\.00 m long; allowed: up to 5\.32 m"):
        check_space(sized(4, 3.5, long))
