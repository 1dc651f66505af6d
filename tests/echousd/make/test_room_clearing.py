"""Furniture is moved apart by its solids: no-fit polygons, tucked chairs, sills, and what must stay."""

import numpy as np
import pytest
import shapely
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from echomodel.boxes import Boxes
from echomodel.triangles import box
from echousd.graph import Node, Relation, RoomSpec, SceneGraph
from echousd.graph.openings import Opening
from echousd.graph.text import stating
from echousd.make.clearing import cleared
from echousd.make.verdicts import relation_verdicts
from echousd.place.living import living_faults
from echousd.shapes.geometry import Collider, Geometry, Origin, Part
from echousd.shapes.hulls import depth, forbidden, forbidden_moves
from echousd.shapes.walls import walls_of_room

FLOOR = np.array([(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)])


def board(size, at):
    half = np.multiply(size, (0.5, 0, 0.5))
    return box(at - half, at + half + (0, size[1], 0))


def piece(*boards):
    """Geometry whose parts and colliders are the same boxes."""
    parts = tuple(Part(f"part_{n}", mesh, {"wood": np.arange(12)}) for n, mesh in enumerate(boards))
    colliders = tuple(Collider(f"collider_{n}", mesh, "convexHull") for n, mesh in enumerate(boards))
    return Geometry(parts, colliders, Origin("test"))


def table_piece():
    legs = [board((0.06, 0.7, 0.06), (x, 0, z)) for x in (-0.77, 0.77) for z in (-0.42, 0.42)]
    return piece(board((1.6, 0.05, 0.9), (0, 0.7, 0)), *legs)


def chair_piece():
    return piece(board((0.45, 0.45, 0.45), (0, 0, 0)), board((0.45, 0.45, 0.05), (0, 0.45, -0.2)))


def room(*things, relations=(), **spec):
    """Graph, boxes and geometry of (name, category, geometry, position, yaw, locked)."""
    nodes = tuple(Node(name, word, locked=locked) for name, word, _, _, _, locked in things)
    size = [np.ptp(geometry.mesh.bounds, axis=0) for _, _, geometry, *_ in things]
    boxes = Boxes(
        torch.tensor(np.array(size), dtype=torch.float32),
        torch.tensor([position for *_, position, _, _ in things], dtype=torch.float32),
        torch.tensor([yaw for *_, yaw, _ in things], dtype=torch.float32),
    )
    graph = SceneGraph(RoomSpec("dining_room", floor_polygon=tuple(map(tuple, FLOOR)), **spec), nodes, tuple(relations))
    return graph, boxes, {name: geometry for name, _, geometry, *_ in things}


@pytest.mark.parametrize("start", [0.25, 0.35, 0.4])
def test_a_chair_is_tucked_as_far_as_it_fits_its_back_a_millimetre_before_the_table(start):
    chair = ("chair", "dining_chair", chair_piece(), (0.2, 0.0, start), np.pi, False)
    graph, boxes, geometry = room(("table", "dining_table", table_piece(), (0, 0, 0), 0.0, True), chair)
    found, _ = cleared(graph, boxes, geometry, FLOOR, ())
    x, y, z = found.position[1].tolist()
    back = z + 0.2 - 0.025  # turned to the table, the back is on the far side
    assert back >= 0.45
    if start + 0.175 < 0.45:
        assert back == pytest.approx(0.451, abs=2e-4)
        assert (x, y) == pytest.approx((0.2, 0.0), abs=1e-4)
    else:
        assert found is boxes


def test_where_a_chair_would_be_pushed_to_the_wall_a_search_moves_its_table_with_all_who_sit_there():
    things = (
        ("table", "dining_table", table_piece(), (0, 0, 1.35), 0.0, False),
        ("back", "dining_chair", chair_piece(), (0, 0, 1.55), np.pi, False),
        ("front", "dining_chair", chair_piece(), (0, 0, 1.055), 0.0, False),
        ("lamp", "pendant_lamp", piece(board((0.3, 0.4, 0.3), (0, 0, 0))), (0, 1.8, 1.35), 0.0, False),
    )
    graph, boxes, geometry = room(*things)
    found, left = cleared(graph, boxes, geometry, FLOOR, ())
    assert left == ()
    way = np.asarray(found.position) - np.asarray(boxes.position)
    assert way[0].any()
    assert way[3, ::2] == pytest.approx(way[0, ::2], abs=1e-6)  # the lamp with it
    assert not living_faults(graph, found, FLOOR)
    alone = (*things[0][:-1], True)
    graph, boxes, geometry = room(alone, *things[1:])
    found, left = cleared(graph, boxes, geometry, FLOOR, ())
    assert left == living_faults(graph, found, FLOOR) == ()  # the chair goes to another side
    assert found.position[0].tolist() == boxes.position[0].tolist()


def test_what_is_locked_stays_and_what_cannot_go_is_named():
    box = piece(board((1, 1, 1), (0, 0, 0)))
    graph, boxes, geometry = room(
        ("first", "cabinet", box, (0, 0, 0), 0.0, True), ("second", "cabinet", box, (0.9, 0, 0), 0.0, True)
    )
    found, left = cleared(graph, boxes, geometry, FLOOR, ())
    assert found is boxes
    (hit,) = left
    assert (hit.first, hit.second, round(hit.depth, 3)) == ("first", "second", 0.1)
    free = graph.replaced(nodes=tuple(node.replaced(locked=node.name == "first") for node in graph.nodes))
    found, left = cleared(free, boxes, geometry, FLOOR, ())
    assert left == ()
    assert found.position[0].tolist() == boxes.position[0].tolist()
    assert found.position[1].tolist() == pytest.approx([1.001, 0, 0], abs=1e-4)


def test_what_stands_on_a_piece_goes_with_it():
    box, lamp = piece(board((0.5, 0.5, 0.4), (0, 0, 0))), piece(board((0.2, 0.4, 0.2), (0, 0, 0)))
    graph, boxes, geometry = room(
        ("bed", "double_bed", piece(board((1.6, 0.6, 2.0), (0, 0, 0))), (0, 0, 0), 0.0, True),
        ("nightstand", "nightstand", box, (1.0, 0, -0.5), 0.0, False),
        ("lamp", "table_lamp", lamp, (1.0, 0.5, -0.5), 0.0, False),
        relations=[Relation("lamp", "standing_on", "nightstand")],
    )
    found, left = cleared(graph, boxes, geometry, FLOOR, ())
    assert left == ()
    assert found.position[2, 0] == found.position[1, 0]
    assert found.position[2, 0] == pytest.approx(1.051, abs=1e-3)


def test_a_lamp_stands_where_its_desk_is_as_high_as_its_box():
    desk = piece(board((1.6, 0.05, 0.8), (0, 0.7, 0)), board((1.6, 1.2, 0.3), (0, 0, -0.25)))  # with a shelf behind
    lamp = piece(board((0.2, 0.4, 0.2), (0, 0, 0)))
    told = [Relation("lamp", "standing_on", "desk")]
    for z, there in ((0.15, -0.198), (-0.22, -0.22)):
        lamps = ("lamp", "table_lamp", lamp, (0.3, 1.2, z), 0.0, False)
        graph, boxes, geometry = room(("desk", "desk", desk, (0, 0, 0), 0.0, False), lamps, relations=told)
        found, _ = cleared(graph, boxes, geometry, FLOOR, ())
        assert found.position[1].tolist() == pytest.approx([0.3, 1.2, there], abs=2e-3)
        assert verdicts_of(graph, found) == ["kept"]


def test_what_is_close_by_goes_along_and_no_told_relation_is_broken():
    block = piece(board((1.0, 1.0, 1.0), (0, 0, 0)))
    small = piece(board((0.4, 0.5, 0.4), (0, 0, 0)))
    close = [Relation("stand", "close_by", "bed")]
    things = (
        ("wardrobe", "wardrobe", block, (-0.9, 0, 0), 0.0, True),
        ("bed", "single_bed", block, (0.0, 0, 0), 0.0, False),
    )
    stand = ("stand", "nightstand", small, (-1.13, 0, 0.75), 0.0, False)
    # their corners are 0.43 m apart, 0.45 m are allowed: where the bed goes, the nightstand must follow
    graph, boxes, geometry = room(*things, stand, relations=close)
    assert verdicts_of(graph, boxes) == ["kept"]
    found, left = cleared(graph, boxes, geometry, FLOOR, ())
    assert left == ()
    assert verdicts_of(graph, found) == ["kept"]
    # locked where it is, the bed has no place within half a metre: a search finds it one farther away
    fixed = graph.replaced(nodes=tuple(node.replaced(locked=node.name != "bed") for node in graph.nodes))
    found, left = cleared(fixed, boxes, geometry, FLOOR, ())
    assert left == ()
    assert verdicts_of(fixed, found) == ["kept"]
    assert np.linalg.norm(found.position[1] - np.asarray(boxes.position)[1]) > 0.5


def test_what_stands_in_a_corner_still_does_when_it_is_moved_apart():
    plant, shelf = piece(board((0.4, 1.0, 0.4), (0, 0, 0))), piece(board((0.8, 1.8, 0.3), (0, 0, 0)))
    graph, boxes, geometry = room(
        ("fern", "plant", plant, (-1.75, 0, -1.75), 0.0, False),
        ("bookshelf", "bookshelf", shelf, (-1.2, 0, -1.8), 0.0, False),
    )
    graph = stating(graph, "fern in corner")
    found, left = cleared(graph, boxes, geometry, FLOOR, ())
    assert left == ()
    assert verdicts_of(graph, found) == ["kept"]


def verdicts_of(graph, boxes):
    return [verdict.state for verdict in relation_verdicts(graph, boxes)]


@pytest.mark.parametrize("walls", [False, True])
def test_high_furniture_keeps_clear_of_a_window_sill(walls):
    window = Opening("window", "window", 0, 1.0, 1.5, 1.2, 0.9)
    wall = np.array([-2.0, -2.0])  # the first edge runs along x at z -2
    tall = piece(board((0.8, 2.0, 0.4), (0, 0, 0)))
    graph, boxes, geometry = room(
        ("wardrobe", "wardrobe", tall, (float(wall[0]) + 1.7, 0, -1.79), 0.0, False), openings=(window,)
    )
    found, _ = cleared(graph, boxes, geometry, FLOOR, walls_of_room(graph, FLOOR, 2.8, 0) if walls else ())
    assert (found is not boxes) is walls
    if walls:
        assert found.position[0, 2] - 0.2 >= -2.0 + 0.04


def test_high_furniture_beside_a_window_keeps_clear_of_its_curtain_rail():
    window = Opening("window", "window", 0, 1.6, 1.2, 1.3, 0.9)
    tall = piece(board((0.8, 2.4, 0.4), (0, 0, 0)))  # ends 5 cm before the window, which its rail does not
    graph, boxes, geometry = room(("wardrobe", "wardrobe", tall, (-0.85, 0, -1.79), 0.0, False), openings=(window,))
    walls = walls_of_room(graph, FLOOR, 2.8, 0)
    held = graph.replaced(nodes=tuple(node.replaced(locked=True) for node in graph.nodes))
    _, stuck = cleared(held, boxes, geometry, FLOOR, walls)
    assert [(hit.first, hit.second) for hit in stuck] == [("wardrobe", "Wall_1")]
    found, left = cleared(graph, boxes, geometry, FLOOR, walls)
    assert left == ()
    assert found is not boxes


def test_what_is_boxed_in_takes_along_who_stands_in_its_way():
    # the bed's head is in the window's sill, the bench stands at its foot: both go, or the collision is told
    window = Opening("window", "window", 0, 1.0, 1.5, 1.2, 0.9)
    bed = piece(board((1.6, 1.0, 2.0), (0, 0, 0)))
    block = piece(board((3.9, 0.4, 0.4), (0, 0, 0)))
    side = piece(board((1.1, 0.5, 2.0), (0, 0, 0)))
    graph, boxes, geometry = room(
        ("bed", "double_bed", bed, (0, 0, -0.99), 0.0, False), ("bench", "bench", block, (0, 0, 0.215), 0.0, False),
        ("left", "sideboard", side, (-1.36, 0, -0.98), 0.0, False),
        ("right", "sideboard", side, (1.36, 0, -0.98), 0.0, False), openings=(window,),
    )  # fmt: skip
    found, left = cleared(graph, boxes, geometry, FLOOR, walls_of_room(graph, FLOOR, 2.8, 0))
    assert left == ()
    assert (np.asarray(found.position) != np.asarray(boxes.position)).any(1)[:2].all()  # bed and bench
    held = graph.replaced(nodes=tuple(node.replaced(locked=True) for node in graph.nodes))
    _, stuck = cleared(held, boxes, geometry, FLOOR, walls_of_room(graph, FLOOR, 2.8, 0))
    assert (stuck[0].first, stuck[0].second) == ("bed", "Wall_1")


def solids(seed, count):
    rng = np.random.default_rng(seed)
    return [rng.uniform(-0.4, 0.4, (10, 3)) + rng.uniform(-0.3, 0.3, 3) for _ in range(count)]


def meet(first, second):
    """The slow, obvious twin: whether two hulls share a point, by linear programming."""
    n, m = len(first), len(second)
    equal = np.vstack([np.hstack([first.T, -second.T]), np.r_[np.ones(n), np.zeros(m)], np.r_[np.zeros(n), np.ones(m)]])
    return linprog(np.zeros(n + m), A_eq=equal, b_eq=[0, 0, 0, 1, 1], bounds=(0, None)).status == 0


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.floats(-1.2, 1.2), st.floats(-1.2, 1.2))
def test_forbidden_moves_are_those_at_which_two_solids_meet(seed, x, z):
    moving, fixed = solids(seed, 2)
    polygon = forbidden(moving, fixed)
    reach = 0.0 if polygon is None else depth(polygon, np.array([x, z]))
    moved = np.add(moving, (x, 0, z))
    if polygon is not None and 0 < polygon.boundary.distance(shapely.Point(x, z)) < 1e-6:
        return
    assert (reach > 0) == meet(moved, fixed)


def test_forbidden_moves_of_several_solids_are_those_of_any():
    moving, fixed = solids(3, 3), solids(4, 2)
    every = forbidden_moves(moving, fixed, 2.0)
    for x in np.linspace(-0.9, 0.9, 7):
        assert (depth(every, np.array([x, 0.1])) > 0) == any(
            meet(np.add(one, (x, 0, 0.1)), other) for one in moving for other in fixed
        )
