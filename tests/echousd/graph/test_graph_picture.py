"""Pictures of graphs: boxes do not overlap, sides are where the words say, files are pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from echomodel.vocabulary import vocabulary
from echousd.graph import Node, Relation, SceneGraph, load_graph, starting_graph
from echousd.graph.picture import CELL, HEIGHT, WIDTH, _curves, _forces, _muddle, arrows, draw_graph, places


def overlaps(place: np.ndarray) -> int:
    gap = np.abs(place[:, None] - place[None])
    return int(((gap < (WIDTH, HEIGHT)).all(-1).sum() - len(place)) / 2)


@pytest.mark.parametrize("room", ["bedroom", "living_room", "dining_room", "living_dining_room", "study"])
def test_boxes_keep_apart_and_directions_hold(room):
    graph = starting_graph(room)
    place = places(graph)
    assert overlaps(place) == 0
    where = dict(zip(graph.names, place, strict=True))
    for relation in graph.relations:
        front, right = vocabulary().predicate(relation.predicate).step
        if front or right:
            assert (where[relation.subject] - where[relation.object]) @ (right, front) > 0, relation


def test_the_same_graph_gives_the_same_picture(tmp_path):
    graph = starting_graph("bedroom")
    for name in ("a.svg", "b.svg", "a.png", "b.png"):
        draw_graph(graph, tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert (tmp_path / "a.svg").read_text() == (tmp_path / "b.svg").read_text()


def test_objects_with_positions_are_drawn_as_a_plan():
    places_in_room = {"a": (0, 0, 0), "b": (0, 0, 2), "c": (2, 0, 0)}
    graph = SceneGraph("study", tuple(Node(name, "desk", position=p) for name, p in places_in_room.items()))
    a, b, c = places(graph)
    assert b[0] > a[0] + WIDTH
    assert c[1] > a[1] + HEIGHT


def test_a_picture_shows_boxes_and_arrows(tmp_path):
    graph = SceneGraph("study", (Node("a", "double_bed"), Node("b", "wardrobe")), (Relation("a", "left", "b"),))
    draw_graph(graph, tmp_path / "g.png")
    with Image.open(tmp_path / "g.png") as image:
        colours = {tuple(pixel) for pixel in np.asarray(image.convert("RGB")).reshape(-1, 3).tolist()}
    assert {(0xDB, 0xE7, 0xF5), (0xE6, 0xD9, 0xEA), (0x3B, 0x6E, 0xA8)} <= colours  # bed, wardrobe, a direction


def test_every_relation_has_its_arrow_in_the_colour_of_its_kind(tmp_path):
    graph = starting_graph("bedroom")
    draw_graph(graph, tmp_path / "graph.svg")
    text = (tmp_path / "graph.svg").read_text()
    kinds = {kind.name: kind.colour for kind in vocabulary().predicate_kinds}
    for kind in {vocabulary().predicate(relation.predicate).kind for relation in graph.relations}:
        mine = [one for one in arrows(graph) if one.kind == kind]
        lines = text.count(f"stroke: {kinds[kind]}")
        assert lines > len(mine), kind  # each, and the line of the legend


def test_texts_are_drawn_as_they_are(tmp_path):
    nodes = (Node("a", "desk", style="$\\frac{1}$ [red] <b>"), Node("b" * 90, "desk", style="ß" * 300, locked=True))
    draw_graph(SceneGraph("study", nodes), tmp_path / "g.png")
    assert (tmp_path / "g.png").stat().st_size > 1000


def test_names_are_whole_but_for_long_ones(tmp_path):
    nodes = (Node("bed", "double_bed"), Node("n" * 22, "desk"), Node("m" * 23, "desk"))
    draw_graph(SceneGraph("study", nodes), tmp_path / "g.svg")
    drawn = (tmp_path / "g.svg").read_text()
    assert all(f"<!-- {text} -->" in drawn for text in ("bed", "double bed", "n" * 22, "m" * 20 + "…"))
    assert "m" * 21 not in drawn


@pytest.mark.parametrize("far", [(6.0, 0.0), (0.0, 5.0), (-4.0, 3.0)])
def test_words_of_arrows_between_the_same_boxes_lie_beside_each_other(far):
    nodes = tuple(Node(name, "chair") for name in "ab")
    stated = ["a left b", "b close_by a", "a bigger_than b"]
    joined = arrows(SceneGraph("study", nodes, tuple(Relation(*words.split()) for words in stated)))
    curves = _curves(joined, {"a": np.zeros(2), "b": np.array(far)})
    middles = np.array([curve.middle for curve in curves])
    assert middles.mean(0) == pytest.approx(np.array(far) / 2)
    way = np.array(far) / np.linalg.norm(far)
    aside = (middles - middles.mean(0)) @ [-way[1], way[0]]
    assert np.diff(np.sort(aside)).min() > 0.3  # inches


def test_a_placing_is_muddled_by_what_makes_it_hard_to_read():
    none, across = np.zeros((0, 2)), np.array([[1.0, 0.0]])
    corners = np.array([[0, 0], [4, 3], [4, 0], [0, 3]]) * CELL

    def muddle(place, *ends, ways=none, directed=none):
        return _muddle(
            np.asarray(place, float), np.array(ends, int).reshape(-1, 2), np.array(directed, int).reshape(-1, 2), ways
        )

    sides, crossed = muddle(corners, (0, 2), (1, 3)), muddle(corners, (0, 1), (2, 3))
    longer = 0.1 * 2 * (5 - 4)  # arrows of five cells for those of four
    assert crossed - sides == pytest.approx(1 + longer)
    over = muddle([*corners, corners[:2].mean(0)], (0, 1)) - muddle([*corners, corners[2:].mean(0) * [1, 0.1]], (0, 1))
    assert over == pytest.approx(2)  # an arrow that runs over a box
    told = [muddle(corners, ways=across, directed=[pair]) for pair in ((2, 0), (3, 0), (0, 2))]
    assert np.diff(told) == pytest.approx([2, 2])  # at the right, above, at the left
    assert muddle(corners * 2) - muddle(corners) == pytest.approx(0.3 * (48 - 12) / 4)


def test_related_boxes_attract_all_others_repel_and_words_pull_to_their_side():
    place, none = np.array([[0.0, 0.0], [9.0, 0.0]]), np.zeros((0, 2), int)
    related, alone = _forces(place, np.array([[0, 1]]), none, none), _forces(place, none, none, none)
    assert related[0, 0] > 0 > related[1, 0]
    assert alone[0, 0] < 0 < alone[1, 0]
    pulled = _forces(place, none, np.array([[0, 1]]), np.array([[1.0, 0.0]])) - alone  # 0 shall be right of 1
    assert pulled[0, 0] > 0 > pulled[1, 0]
    for move in (related, alone, pulled):
        assert move.sum(0) == pytest.approx(np.zeros(2), abs=1e-9)


def test_relations_of_one_kind_share_an_arrow():
    nodes = tuple(Node(name, "chair") for name in "ab")
    stated = ["a left b", "a front b", "a close_by b", "b above a", "a same_style_as b", "a bigger_than b"]
    graph = SceneGraph("study", nodes, tuple(Relation(*words.split()) for words in stated))
    found = {(arrow.subject, arrow.kind): arrow for arrow in arrows(graph)}
    assert found["a", "direction"].words == ("left", "front")
    assert not found["a", "direction"].both_ways
    assert found["a", "closeness"].both_ways
    assert len(found) == 5


def test_what_is_said_twice_is_drawn_once():
    nodes = tuple(Node(name, "chair") for name in "ab")
    stated = ["a left b", "b right a", "a near b", "b near a", "a bigger b", "b smaller a", "a above b", "b shorter a"]
    relations = [Relation(*words.split()) for words in stated]
    drawn = arrows(SceneGraph("study", nodes, tuple(relations)))
    assert [(arrow.subject, arrow.words) for arrow in drawn] == [
        ("a", ("left",)),
        ("a", ("close by",)),
        ("a", ("bigger than",)),
        ("a", ("above",)),
        ("b", ("shorter than",)),
    ]


def test_a_large_graph_still_makes_a_picture(tmp_path):
    nodes = tuple(Node(f"n{i}", "chair") for i in range(100))
    relations = tuple(Relation(f"n{i}", "left", f"n{j}") for i in range(100) for j in (i + 1, i + 7) if j < 100)
    draw_graph(SceneGraph("study", nodes, relations), tmp_path / "g.png")
    with Image.open(tmp_path / "g.png") as image:
        assert max(image.size) <= 42 * 160


def test_the_samples_are_drawn_without_overlap():
    for path in sorted((Path(__file__).parents[3] / "samples").glob("*.yaml")):
        assert overlaps(places(load_graph(path))) == 0, path
