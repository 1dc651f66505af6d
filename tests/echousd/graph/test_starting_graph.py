from __future__ import annotations

import re

import pytest
from graph_strategies import WORDS
from hypothesis import given, settings
from hypothesis import strategies as st

from echomodel.vocabulary import UnknownWord, vocabulary
from echousd.graph import GraphError, Relation, RoomSpec, starting_graph

TYPICAL = {room.name: dict(room.contents) for room in WORDS.room_types}


def test_a_bedroom_with_counts():
    graph = starting_graph(RoomSpec("bedroom", size=(4, 3)), {"desk": 1, "bedside table": 1, "pendant_lamp": 0})
    assert graph.names == ("double_bed", "nightstand", "wardrobe", "desk")
    assert graph.room.size == (4.0, 3.0)
    assert [str(relation) for relation in graph.relations] == [
        "nightstand close_by double_bed",
        "nightstand left double_bed",
        "desk right double_bed",
        "wardrobe taller_than double_bed",
        "wardrobe right double_bed",
    ]


def test_several_of_a_kind_share_a_style_and_stand_on_both_sides():
    graph = starting_graph("bedroom")
    assert graph.node("nightstand_1").style == graph.node("nightstand_2").style == "nightstand"
    assert graph.relation("nightstand_1", "left", "double_bed")
    assert graph.relation("nightstand_2", "right", "double_bed")


def test_each_lamp_has_a_nightstand_of_its_own():
    graph = starting_graph("bedroom", {"table_lamp": 2})
    assert graph.relation("table_lamp_1", "standing_on", "nightstand_1")
    assert graph.relation("table_lamp_2", "standing_on", "nightstand_2")


def test_words_of_the_tables_are_the_vocabularys():
    categories = {category.name for category in WORDS.categories}
    for habit in vocabulary().habits:
        assert {*habit.categories, *habit.anchors} <= categories
        assert {*habit.predicates, *habit.sides} <= {predicate.name for predicate in WORDS.predicates}


@settings(deadline=None, max_examples=100)
@given(
    st.sampled_from(sorted(TYPICAL)),
    st.dictionaries(st.sampled_from([c.name for c in WORDS.categories]), st.integers(0, 5), max_size=20),
)
def test_any_counts_give_a_valid_graph(room, counts):
    wanted = {**TYPICAL[room], **counts}
    if not any(wanted.values()):
        return
    graph = starting_graph(room, counts)
    for category, count in wanted.items():
        assert sum(node.category == category for node in graph.nodes) == count


@pytest.mark.parametrize(
    ("counts", "text"),
    [
        ({"nightstnd": 2}, "unknown category 'nightstnd': did you mean nightstand?"),
        ({"desk": -1}, "count of desk: found -1, allowed: an integer from 0 to 100"),
        ({"desk": 101}, "count of desk: found 101, allowed"),
        ({"desk": True}, "count of desk: found True, allowed"),
        (dict.fromkeys(TYPICAL["bedroom"], 0), "the graph is empty, allowed: at least one object"),
    ],
)
def test_faults(counts, text):
    with pytest.raises((GraphError, UnknownWord), match=re.escape(text)):
        starting_graph("bedroom", counts)


def test_what_is_stated_wins_over_what_is_usual():
    stated = Relation("desk", "left", "nightstand")
    graph = starting_graph("bedroom", {"nightstand": 1, "desk": 1}, [stated])
    said = [str(relation) for relation in graph.relations]
    assert said[-1] == "desk left nightstand"
    assert "nightstand left double_bed" in said
    assert "desk right double_bed" not in said
    with pytest.raises(GraphError, match="'sofa' is no object of this graph"):
        starting_graph("bedroom", {}, [Relation("double_bed", "left", "sofa")])


@pytest.mark.parametrize(
    ("room", "counts", "guest", "host"),
    [
        ("study", {"desk": 2, "office_chair": 2}, "office_chair", "desk"),
        ("bedroom", {"single_bed": 2, "double_bed": 0, "nightstand": 2}, "nightstand", "single_bed"),
        ("dining_room", {"dining_table": 2, "dining_chair": 8}, "dining_chair", "dining_table"),
    ],
)
def test_what_serves_one_piece_is_dealt_to_all_of_its_kind(room, counts, guest, host):
    graph = starting_graph(room, counts)
    served = [r.object for r in graph.relations if r.predicate == "close_by" and r.subject.startswith(guest)]
    assert served.count(f"{host}_1") == served.count(f"{host}_2") == counts[guest] // 2
    if counts[guest] == 2:  # each is the first of its own, so all stand at the same side
        mine = [r for r in graph.relations if r.subject.startswith(guest)]
        sides = [r.predicate for r in mine if r.predicate in ("left", "right")]
        assert len(set(sides)) <= 1


@pytest.mark.parametrize(
    ("room", "counts"), [("bedroom", {"office_chair": 1, "chair": 1}), ("study", {"office_chair": 1, "chair": 3})]
)
def test_chairs_of_whatever_kind_are_dealt_to_all_desks(room, counts):
    graph = starting_graph(room, {"desk": 2, **counts})
    hosts = [r.object for r in graph.relations if r.predicate == "close_by" and "chair" in r.subject]
    assert hosts.count("desk_1") == hosts.count("desk_2") == sum(counts.values()) // 2


def test_armchairs_keep_the_first_sofa_company():
    graph = starting_graph("living_room", {"sofa": 0, "multi_seat_sofa": 2, "armchair": 2})
    mine = [r for r in graph.relations if r.subject.startswith("armchair")]
    beside = {r.object for r in mine if r.predicate in ("left", "right")}
    assert beside == {"multi_seat_sofa_1"}


def test_a_bath_has_its_shower_in_a_corner_and_kitchens_one_style():
    assert {node.name: node.place for node in starting_graph("bathroom").nodes}["shower"] == "in_corner"
    assert {node.place for node in starting_graph("hallway").nodes} == {None, "against_wall"}
    assert {node.style for node in starting_graph("kitchen", {"wall_unit": 3}).nodes} == {None}


def test_a_large_floor_holds_more_until_it_is_as_full_as_most():
    usual = len(starting_graph("living_room").nodes)
    small, large, huge = (starting_graph(RoomSpec("living_room", size=size)) for size in ((4, 4), (7, 5), (9, 8)))
    assert len(small.nodes) == usual < len(large.nodes) <= len(huge.nodes) < 20
    words = [node.category for node in large.nodes]
    assert len(words) == len(set(words)), "one of each"
    assert sum(word in ("multi_seat_sofa", "l_shaped_sofa", "loveseat_sofa") for word in words) == 1
    assert "pendant_lamp" in words, "the most usual thing that it lacks"
    assert ("desk" in words) == ("office_chair" in words), "no table without who sits at it"
    assert starting_graph("living_room", area=35.0).names == large.names


@pytest.mark.parametrize("room", ["study", "hallway", "bathroom"])
def test_nobody_sleeps_where_nobody_did(room):
    words = {node.category for node in starting_graph(room, area=60.0).nodes}
    assert not words & {"double_bed", "single_bed", "kids_bed", "wardrobe", "nightstand", "dining_chair"}


def test_what_is_counted_comes_after_what_fills_the_floor():
    graph = starting_graph(RoomSpec("living_room", size=(7, 5)), {"bookshelf": 3, "ottoman": 0})
    words = [node.category for node in graph.nodes]
    assert words.count("bookshelf") == 3
    assert "ottoman" not in words
