"""Placing on small rooms whose right answer is known, and on noisy rooms whose relations are known."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from echomodel.boxes import Boxes
from echomodel.floors import signed_distance
from echomodel.objective.support import allowed_overlap
from echomodel.rules import margins, verdicts
from echomodel.vocabulary import UnknownWord, vocabulary
from echousd.graph import Node, Relation, RoomSpec, SceneGraph
from echousd.place.conflicts import sentence
from echousd.place.geometry import Floor, depth_inside, separation
from echousd.place.placing import PlacedBoxes, place, place_boxes
from echousd.place.solver import PlaceConfig

FLOOR = np.array([(-2.0, -1.8), (2.0, -1.8), (2.0, 1.8), (-2.0, 1.8)])


def boxes(size, position, yaw) -> Boxes:
    return Boxes(*(torch.tensor(np.asarray(v, float), dtype=torch.float32) for v in (size, position, yaw)))


def broken(graph: SceneGraph, found: PlacedBoxes) -> set[str]:
    return {str(one) for one, kept in zip(graph.relations, found.verdict, strict=True) if kept == 0}


def bedroom() -> tuple[SceneGraph, np.ndarray, np.ndarray, np.ndarray]:
    graph = SceneGraph(
        RoomSpec("bedroom", size=(4.0, 3.6), height=2.7),
        (
            Node("bed", "double_bed"),
            Node("left_stand", "nightstand"),
            Node("right_stand", "nightstand"),
            Node("wardrobe", "wardrobe"),
            Node("lamp", "pendant_lamp"),
            Node("bench", "tv_stand"),
            Node("tv", "tv"),
        ),
        (
            Relation("left_stand", "left", "bed"),
            Relation("right_stand", "right", "bed"),
            Relation("left_stand", "close_by", "bed"),
            Relation("wardrobe", "taller_than", "bed"),
            Relation("bench", "front", "bed"),
            Relation("tv", "standing_on", "bench"),
            Relation("lamp", "above", "bed"),
            Relation("bed", "bigger_than", "wardrobe"),
            Relation("left_stand", "same_style_as", "right_stand"),
        ),
    )
    size = np.array(
        [
            [1.8, 0.9, 2.0],
            [0.5, 0.5, 0.4],
            [0.5, 0.5, 0.4],
            [1.2, 2.2, 0.6],
            [0.6, 0.7, 0.6],
            [1.4, 0.5, 0.4],
            [1, 0.6, 0.1],
        ]
    )
    position = np.array(
        [[-0.9, 0.1, 0], [-1.6, 0, -0.7], [-1.9, 0, 1.3], [0.6, 0, 1.7], [1.0, 1.5, 0.9], [2.0, -0.1, 0], [1.6, 0, 0.2]]
    )
    q = np.pi / 2
    return graph, size, position, np.array([q, q, q + 0.1, np.pi, 0.0, -q, -q])


def test_everything_that_was_asked_for_holds_afterwards() -> None:
    graph, size, position, yaw = bedroom()
    result = place(graph, boxes(size, position, yaw))
    assert result.verdict.tolist() == [1] * 8 + [-1]  # nobody measures a style
    assert not result.conflicts
    assert not result.collisions
    assert not result.outside
    found = dict(zip(graph.names, result.boxes.position, strict=True))
    sizes = dict(zip(graph.names, result.boxes.size, strict=True))
    for name in ("bed", "left_stand", "right_stand", "wardrobe", "bench"):
        assert found[name][1] == 0.0
    assert found["tv"][1] == pytest.approx(sizes["bench"][1], abs=1e-5)
    assert found["lamp"][1] + sizes["lamp"][1] == pytest.approx(2.7, abs=0.01)
    # Backs at their walls but for centimetres: bed and nightstands at x = -2, wardrobe at z = 1.8 or -1.8, bench at
    # x = 2.
    assert found["bed"][0] - sizes["bed"][2] / 2 == pytest.approx(-1.94, abs=0.07)
    assert found["right_stand"][0] - sizes["right_stand"][2] / 2 == pytest.approx(-1.94, abs=0.07)
    assert abs(found["wardrobe"][2]) + sizes["wardrobe"][2] / 2 == pytest.approx(1.74, abs=0.07)
    assert result.boxes.yaw[2].item() == pytest.approx(np.pi / 2, abs=1e-6)


def test_a_good_room_stays_as_it_is() -> None:
    graph, size, position, yaw = bedroom()
    once = place(graph, place(graph, boxes(size, position, yaw)).boxes)
    again = place(graph, once.boxes)
    assert np.linalg.norm(again.position - once.position, axis=1).max() < 0.01
    assert again.size == pytest.approx(once.size, rel=0.01)


def test_locked_and_known_objects_never_move() -> None:
    graph, size, position, yaw = bedroom()
    graph = graph.lock("bed").update_node("wardrobe", position=tuple(position[3]), size=(1.2, 2.2, 0.6))
    result = place(graph, boxes(size, position, yaw))
    for number in (0, 3):
        assert np.array_equal(result.boxes.position[number], torch.tensor(position[number], dtype=torch.float32))
        assert np.array_equal(result.boxes.size[number], torch.tensor(size[number], dtype=torch.float32))
    assert result.boxes.yaw[0].item() == pytest.approx(np.pi / 2)
    assert broken(graph, result) == set()


def test_the_same_boxes_give_the_same_room() -> None:
    graph, size, position, yaw = bedroom()
    first, second = (place(graph, boxes(size, position, yaw)) for _ in range(2))
    assert np.array_equal(first.boxes.position, second.boxes.position)
    assert np.array_equal(first.boxes.size, second.boxes.size)


def test_relations_in_conflict_are_named() -> None:
    graph = SceneGraph(
        RoomSpec("bedroom", size=(6.0, 6.0)),
        (Node("a", "plant", position=(-2.5, 0, 0), locked=True), Node("b", "plant", position=(2.5, 0, 0), locked=True),
         Node("c", "ottoman"), Node("d", "wardrobe")),
        (Relation("c", "close_by", "a"), Relation("c", "close_by", "b"), Relation("d", "taller_than", "c")),
    )  # fmt: skip
    result = place(
        graph,
        boxes(
            [[0.4, 1, 0.4], [0.4, 1, 0.4], [0.5, 0.4, 0.5], [1, 2, 0.6]],
            [[-2.5, 0, 0], [2.5, 0, 0], [0, 0, 0], [0, 0, 2]],
            [0] * 4,
        ),
    )
    assert broken(graph, result) == {"c close_by a", "c close_by b"}
    told = [sentence(one, graph) for one in result.conflicts]
    assert told == ["cannot hold together: 'c close_by a', 'c close_by b'"]


def test_too_much_furniture_is_reported_not_hidden() -> None:
    graph = SceneGraph(
        RoomSpec("bedroom", size=(2.0, 2.0)),
        tuple(Node(f"bed_{i}", "double_bed", size=(1.6, 0.5, 1.9)) for i in range(3)),
    )
    result = place(graph, boxes([[1.6, 0.5, 1.9]] * 3, [[0, 0, 0], [0.1, 0, 0], [-0.1, 0, 0.1]], [0.0] * 3))
    assert result.collisions or result.outside
    assert "apart" in " ".join(sentence(one, graph) for one in result.conflicts)


def test_chairs_may_be_under_the_table_but_not_in_one_another() -> None:
    size = np.array([[1.6, 0.75, 0.9], [0.5, 0.9, 0.5], [0.5, 0.9, 0.5]])
    position = np.array([[0.0, 0, 0], [0.3, 0, 0.5], [0.35, 0, 0.55]])
    done = place_boxes(
        ["dining_table", "dining_chair", "dining_chair"], size, position, np.zeros(3), np.zeros((0, 3), int)
    )
    assert not done.collisions
    pairs = np.array([(0, 1), (0, 2), (1, 2)])
    gaps = separation(done.size, done.position, done.yaw, pairs)
    assert gaps[2] > -1e-6
    assert gaps[:2].min() < -0.1


@pytest.mark.parametrize("reach", [None, 0.15, 0.0])
def test_chairs_reach_under_their_table_by_what_their_solids_allow(reach) -> None:
    square = np.array([(-1.6, -1.6), (1.6, -1.6), (1.6, 1.6), (-1.6, 1.6)])
    nodes = Node("table", "dining_table"), Node("one", "dining_chair"), Node("other", "dining_chair")
    graph = SceneGraph(RoomSpec("dining_room", floor_polygon=tuple(map(tuple, square))), nodes)
    size = np.array([(1.4, 0.75, 0.9), (0.5, 0.9, 0.5), (0.5, 0.9, 0.5)])
    drawn = boxes(size, np.array([(0, 0, 0), (0, 0, 0.5), (0, 0, -0.5)]), np.array([0.0, np.pi, 0.0]))
    limit = () if reach is None else ((0, reach),)
    found = place(graph, drawn, config=PlaceConfig(reach=limit))
    pairs = np.array([(0, 1), (0, 2)])
    under = -separation(found.size, found.position, found.yaw, pairs)
    assert (under > 0.19 if reach is None else under < reach + 0.011).all(), under


def test_noisy_rooms_get_their_relations_back() -> None:
    rng = np.random.default_rng(5)
    kept = measured = hit = 0
    ids = {p.name: p.id for p in vocabulary().predicates}
    for _ in range(3):
        n = 8
        categories = ["armchair", "shelf", "cabinet", "dresser", "nightstand", "lounge_chair", "cabinet", "lazy_sofa"]
        spots = rng.permutation([(x, z) for x in (-2.1, -0.7, 0.7, 2.1) for z in (-2.0, 0.0, 2.0)])[:n]
        position = np.stack((spots[:, 0], np.zeros(n), spots[:, 1]), 1)
        size = rng.uniform(0.4, 1.0, (n, 3))
        every = [
            (i, p, j) for i in range(n) for j in range(n) if i != j for p in range(1, 12) if p != ids["standing_on"]
        ]
        triplets = torch.tensor(every)
        clean = Boxes(*(torch.tensor(v, dtype=torch.float32) for v in (size, position, np.zeros(n))))
        triplets = triplets[margins(clean, triplets) >= 1e-3]
        floor = np.array([(-3, -3), (3, -3), (3, 3), (-3, 3.0)])
        start = position + rng.normal(0, 0.3, position.shape) * (1, 0.3, 1)
        done = place_boxes(
            categories, size * np.exp(rng.normal(0, 0.1, size.shape)), start, np.zeros(n), triplets.numpy(),
            floor_polygon=floor, height=2.6,
        )  # fmt: skip
        kept, measured = kept + int((done.verdict == 1).sum()), measured + int((done.verdict >= 0).sum())
        hit += len(done.collisions)
        assert not done.outside
    assert measured > 250
    assert kept / measured >= 0.995
    assert hit == 0


def test_very_many_boxes_end_where_few_would(monkeypatch) -> None:
    rng = np.random.default_rng(3)
    count = 24
    floor = np.array([(-4.0, -4.0), (4.0, -4.0), (4.0, 1.0), (1.0, 1.0), (1.0, 4.0), (-4.0, 4.0)])
    words = ["dining_table", "dining_chair", "bookshelf", "nightstand"] * (count // 4)
    size = rng.uniform(0.4, 0.9, (count, 3))
    position = np.stack([rng.uniform(-3.5, 3.5, count), np.zeros(count), rng.uniform(-3.5, 0.5, count)], -1)
    close_by = vocabulary().predicate_id("close_by")
    triplets = np.array([(4 * k + 1, close_by, 4 * k) for k in range(count // 4)])

    def ends() -> PlacedBoxes:
        config = PlaceConfig(arrange=False)
        return place_boxes(words, size, position, np.zeros(count), triplets, floor_polygon=floor, config=config)

    few = ends()
    monkeypatch.setattr("echousd.place.constraints.MANY", 8)
    many = ends()
    np.testing.assert_allclose(many.position, few.position, atol=1e-5)
    np.testing.assert_allclose(many.size, few.size, atol=1e-5)
    assert [pair for pair, _ in many.collisions] == [pair for pair, _ in few.collisions]
    assert many.conflicts == few.conflicts


def test_verdicts_are_those_of_the_returned_boxes(monkeypatch) -> None:
    monkeypatch.setattr("echousd.place.solver.ROUNDS", 0)  # nothing is mended
    graph, size, position, yaw = bedroom()
    result = place(graph, boxes(size, position, yaw), config=PlaceConfig(arrange=False))
    index = {name: i for i, name in enumerate(graph.names)}
    triplets = torch.tensor(
        [(index[r.subject], vocabulary().predicate_id(r.predicate), index[r.object]) for r in graph.relations]
    )
    found = verdicts(result.boxes, triplets).tolist()
    assert found == result.verdict.tolist()
    assert 0 in found


def test_inside_of_a_floor_with_a_notch() -> None:
    floor = Floor(np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], float)[::-1])
    distance = depth_inside(floor, np.array([(0.5, 0.5), (1.5, 1.5), (1.2, 0.9), (-0.25, 1.0)]))
    np.testing.assert_allclose(distance, [0.5, -0.5, 0.1, -0.25], atol=1e-12)
    assert floor.reflex.tolist() == [[1.0, 1.0]]


def test_bad_input_is_named() -> None:
    graph, size, position, yaw = bedroom()
    with pytest.raises(ValueError, match=r"6 boxes for a graph of 7 objects"):
        place(graph, boxes(size[:6], position[:6], yaw[:6]))
    position[2, 0] = np.nan
    with pytest.raises(ValueError, match=r"box 2 \(nightstand\) is not finite"):
        place(graph, boxes(size, position, yaw))
    with pytest.raises(ValueError, match="not a floor"):
        place_boxes(
            ["bed"], np.ones((1, 3)), np.zeros((1, 3)), np.zeros(1), np.zeros((0, 3)), floor_polygon=np.zeros((4, 2))
        )


def test_fixed_boxes_without_relations_stay_where_they_are() -> None:
    nodes = (
        Node("bed", "double_bed", size=(1.6, 0.5, 2.0), position=(0.0, 0.0, 0.0), yaw=0.0),
        Node("stand", "nightstand", size=(0.5, 0.5, 0.5), position=(0.4, 0.0, 0.4), yaw=0.0),
    )
    for count in (1, 2):
        graph = SceneGraph(RoomSpec("bedroom"), nodes[:count])
        fixed = boxes(*([getattr(n, field) for n in nodes[:count]] for field in ("size", "position", "yaw")))
        found = place(graph, fixed)
        assert np.array_equal(found.boxes.position, fixed.position)
        assert np.array_equal(found.boxes.size, fixed.size)


def test_a_category_that_the_vocabulary_does_not_hold_is_refused():
    """Formerly it silently stood on the floor like a cabinet."""
    with pytest.raises(UnknownWord, match="unknown category 'wardrob': did you mean wardrobe"):
        place_boxes(["wardrob"], np.ones((1, 3)), np.zeros((1, 3)), np.zeros(1), np.zeros((0, 3), int))


def test_who_may_reach_into_whom():
    pairs, size = np.array([[0, 1], [1, 0]]), np.array([[0.4, 0.9, 0.5], [1.6, 0.75, 0.9]])
    for words, share in (
        (("dining_chair", "dining_table"), 0.65),
        (("dining_chair", "coffee_table"), 0.0),
        (("nightstand", "double_bed"), 0.1),
        (("wardrobe", "double_bed"), 0.0),
        (("ottoman", "l_shaped_sofa"), 0.5),
        (("armchair", "side_table"), 0.0),  # which stands beside it
        (("armchair", "corner_side_table"), 0.0),
    ):
        assert allowed_overlap(words, size, pairs) == pytest.approx(share * 0.4)


def test_two_beds_that_mirror_each_other_are_turned_alike() -> None:
    graph = SceneGraph(
        RoomSpec("bedroom", size=(4.4, 4.4), height=2.7),
        (Node("a", "single_bed"), Node("b", "single_bed")),
        (Relation("a", "symmetrical_to", "b"),),
    )
    stand = [(-1.1, 0, -1.2), (-1.1, 0, 1.2)]
    done = place(graph, boxes([(1.0, 0.5, 2.0)] * 2, stand, [np.pi / 2, 0.0]))
    assert broken(graph, done) == set()
    turn = done.boxes.yaw
    images = (-turn[0], np.pi - turn[0])
    alike = [abs(np.exp(1j * turn[1]) - np.exp(1j * image)) for image in images]
    assert min(alike) < 0.3


@pytest.mark.parametrize("corners", [FLOOR, np.array([(0, 0), (4, 0), (4, 2), (2, 2), (2, 3.5), (0, 3)], float)])
def test_the_depth_of_points_is_their_distance_to_the_border(corners: np.ndarray) -> None:
    import shapely

    floor, polygon = Floor(corners), shapely.Polygon(corners)
    points = np.random.default_rng(0).uniform(-3, 6, (200, 2))
    there = shapely.points(points)
    away = shapely.distance(there, polygon.exterior)
    expected = np.where(shapely.contains(polygon, there), away, -away)
    np.testing.assert_allclose(depth_inside(floor, points), expected, atol=2e-6)
    padded = torch.from_numpy(floor.polygon)[None]
    np.testing.assert_allclose(signed_distance(torch.from_numpy(points)[None], padded)[0], expected, atol=2e-6)


def test_a_nightstand_touches_its_bed_at_most() -> None:
    size, position = np.array([[1.8, 1.0, 2.1], [0.5, 0.5, 0.4]]), np.array([[0, 0, -0.7], [1.12, 0, -1.55]], float)
    done = place_boxes(
        ["double_bed", "nightstand"], size, position, np.zeros(2), np.zeros((0, 3)), floor_polygon=FLOOR, height=2.7,
        config=PlaceConfig(arrange=False),
    )  # fmt: skip
    assert separation(done.size, done.position, done.yaw, np.array([(0, 1)]))[0] > -0.001


@pytest.mark.parametrize("depth", [0.4, 0.24])
@pytest.mark.parametrize(("side", "kept"), [(1, 0.05), (-1, 0.02)])
def test_a_screen_keeps_from_the_handles_and_the_rounded_back_of_its_stand(
    depth: float, side: int, kept: float
) -> None:
    """The front of a box is handles alone, its back corners may be round: what has room does not stand there."""
    size = np.array([[1.2, 1.2, depth], [0.9, 0.55, 0.18]])
    position = np.array([[0, 0, -1.6], [0, 1.2, -1.6 + side * (depth - 0.18) / 2]])
    done = place_boxes(
        ["cabinet", "tv"], size, position, np.zeros(2), np.array([(1, vocabulary().predicate_id("standing_on"), 0)]),
        floor_polygon=FLOOR, height=2.7, config=PlaceConfig(arrange=False),
    )  # fmt: skip
    (_, _, edge), (_, _, own) = done.position + done.size * [0, 0, 0.5 * side]
    assert side * (edge - own) > min(kept, done.size[0, 2] / 2 - done.size[1, 2] / 2 - 0.02) - 1e-3


@pytest.mark.parametrize("word", ["pendant_lamp", "wall_lamp", "ceiling_lamp"])
def test_what_cannot_be_met_never_leaves_the_room(word):
    ids = {p.name: p.id for p in vocabulary().predicates}
    size = np.array([(1.8, 0.9, 2.0), (0.4, 0.6, 0.4)])
    position = np.array([(0.0, 0.0, 0.0), (0.2, 2.0, 0.3)])
    floor = np.array([(-2, -2), (2, -2), (2, 2), (-2, 2.0)])
    told = np.array([(0, ids["above"], 1)])  # the bed above the lamp
    done = place_boxes(["double_bed", word], size, position, np.zeros(2), told, floor_polygon=floor, height=2.6)
    assert (done.position[:, 1] >= 0).all()
    assert (done.position[:, 1] + done.size[:, 1] <= 2.6 + 1e-6).all()


def test_stiffness_beyond_the_digits_of_a_float_is_solved():
    from echousd.place.solver import _least

    rng = np.random.default_rng(0)
    rows, value, diagonal = rng.normal(size=(6, 12)), rng.normal(size=6), np.full(12, 1e-3)
    for stiff in (1e3, 1e17):  # the second is indefinite by rounding
        found = _least(rows, np.full(6, stiff), diagonal, value, np.zeros(12))
        assert np.allclose(rows @ found, -value, atol=1e-4)
        assert np.abs(found).max() < 10
