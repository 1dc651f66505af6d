"""The table of terms: complete, documented, and its relations and physics told apart room by room."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest
import torch

from echomodel.boxes import Boxes
from echomodel.graph import Stated
from echomodel.guidance import missed
from echomodel.objective import KINDS, TERMS, faults_of, plan_of
from echomodel.objective.table import OfKind
from echomodel.vocabulary import vocabulary

DOCS = Path(__file__).parents[3] / "docs"
FLOOR = np.array([(-2.5, -2.0), (2.5, -2.0), (2.5, 2.0), (-2.5, 2.0)])
ELL = np.array([(-2.5, -2.0), (2.5, -2.0), (2.5, 0.0), (0.0, 0.0), (0.0, 2.0), (-2.5, 2.0)])
SIZES = {
    "double_bed": (1.8, 1.0, 2.1), "nightstand": (0.5, 0.5, 0.4), "table_lamp": (0.3, 0.5, 0.3),
    "wardrobe": (1.2, 2, 0.6), "dining_table": (1.6, 0.75, 0.9), "dining_chair": (0.45, 0.9, 0.5),
    "pendant_lamp": (0.5, 0.6, 0.5),
}  # fmt: skip


def plan(*things, floor=FLOOR, told=(), stated=(), height=2.6):
    """A plan of (category, (x, y, z), yaw in degrees)."""
    words = [thing[0] for thing in things]
    boxes = Boxes(
        torch.tensor([SIZES[word] for word in words]),
        torch.tensor([thing[1] for thing in things]),
        torch.tensor([np.radians(thing[2]) for thing in things]),
    )
    rows = np.array([(a, vocabulary().predicate_id(word), b) for a, word, b in told]).reshape(-1, 3)
    return plan_of(boxes, words, floor, (), rows, height=height, stated=stated)


def broken(of, *kinds):
    return {fault.rule for fault in faults_of(of, kinds)}


def test_names_are_there_once_and_every_term_explains_itself():
    assert len({term.name for term in TERMS}) == len(TERMS)
    for term in TERMS:
        assert (term.kind in KINDS, term.unit in ("m", "rad", "share"), term.weight > 0) == (True,) * 3, term.name
        assert all((term.means, term.source, term.says)), term.name
        assert all("{a}" in sentence for sentence in term.says), term.name
    assert [KINDS.index(term.kind) for term in TERMS] == sorted(KINDS.index(term.kind) for term in TERMS)


def test_a_room_where_nothing_is_wrong_is_asked_for_more_by_some_terms():
    eased = {term.name for term in TERMS if term.eased.slack > term.slack}
    assert eased == {term.name for term in TERMS if term.ease}
    assert {"chair_pulls_out", "groups_apart", "bed_side_free"} <= eased
    assert all(term.eased.find is term.find and term.eased.weight == term.weight for term in TERMS)


@pytest.mark.parametrize("term", [term for term in TERMS if isinstance(term.find, OfKind)], ids=lambda term: term.name)
def test_terms_that_wait_for_a_kind_find_nothing_in_rooms_without(term):
    others = [row for row in vocabulary().categories if not term.find.kind(row)]
    size = np.array([(1.5, 0.8, 0.6)] * len(others))
    place = np.array([(0.4 * (k % 8), 0.0, 0.4 * (k // 8)) for k in range(len(others))])
    room = plan_of(Boxes(size, place, np.arange(len(others)) * np.pi / 2), [row.name for row in others], 4 * FLOOR)
    assert len(others) > 20
    assert not len(term.find.itself(room).who)


def test_the_page_is_up_to_date():
    spec = importlib.util.spec_from_file_location("make_rules", DOCS / "make_rules.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert (DOCS / "RULES.md").read_text("utf-8") == module.page(), "run python docs/make_rules.py"


@pytest.mark.parametrize(
    ("word", "kept", "wrong"),
    [
        ("left", (0.5, 0.0, -1.6), (0.5, 0.0, 1.6)),
        ("close_by", (1.2, 0.0, -1.0), (2.2, 0.0, 1.7)),
        ("front", (1.5, 0.0, 0.0), (-1.5, 0.0, 0.0)),
    ],
)
def test_relations_are_terms_of_their_word(word, kept, wrong):
    for place, faults in ((kept, set()), (wrong, {word})):
        room = plan(("nightstand", place, 0), ("double_bed", (0.0, 0.0, 0.0), 0), told=[(0, word, 1)])
        assert broken(room, "relations") == faults
        assert (float(missed(room, ["relations"])) > 0) == bool(faults)


def test_relations_of_the_published_rules_are_measured_by_these():
    room = plan(("nightstand", (0.04, 0.0, 1.5), 0), ("double_bed", (0.0, 0.0, 0.0), 0), told=[(0, "front", 1)])
    assert broken(room, "relations") == {"front"}
    object.__setattr__(room, "rules", "sgfront")
    assert broken(room, "relations") == set()


def test_places_are_terms():
    told = [Stated("against_wall", 0)]
    assert broken(plan(("wardrobe", (0.0, 0.0, -1.68), 0), stated=told), "relations") == set()
    assert broken(plan(("wardrobe", (0.0, 0.0, -1.0), 0), stated=told), "relations") == {"placed"}
    sentence = faults_of(plan(("wardrobe", (0.0, 0.0, -1.0), 0), stated=told), ["relations"])[0].sentence(["it"])
    assert sentence == "it is not against_wall"


BED = ("double_bed", (0.0, 0.0, -0.9), 0)


@pytest.mark.parametrize(
    ("things", "floor", "faults"),
    [
        ([BED, ("nightstand", (1.2, 0.0, -1.75), 0)], FLOOR, set()),
        ([BED, ("nightstand", (1.1, 0.0, -1.75), 0)], FLOOR, {"apart"}),  # 5 cm in the bed
        ([BED, ("nightstand", (0.0, 1.02, -1.0), 0)], FLOOR, {"rests"}),  # over it, on nothing
        ([("dining_table", (0, 0, 0), 0), ("dining_chair", (0.0, 0.0, 0.5), 180)], FLOOR, set()),  # tucked
        ([("dining_table", (0, 0, 0), 0), ("dining_chair", (0.0, 0.0, 0.05), 180)], FLOOR, {"apart"}),
        ([("wardrobe", (2.2, 0.0, 1.0), 90)], FLOOR, set()),
        ([("wardrobe", (2.25, 0.0, 1.0), 90)], FLOOR, {"on_floor"}),
        ([("wardrobe", (0.0, 0.0, 0.4), 0)], ELL, {"on_floor"}),
        ([("dining_table", (0.3, 0.0, -0.3), 0)], ELL, {"on_floor"}),  # no corner of it is outside
        ([("dining_table", (-0.9, 0.0, -0.3), 0)], ELL, set()),
        ([("nightstand", (1.0, 0.0, 0.0), 0), ("table_lamp", (1.0, 0.5, 0.0), 0)], FLOOR, set()),
        ([("nightstand", (1.0, 0.0, 0.0), 0), ("table_lamp", (1.0, 0.55, 0.0), 0)], FLOOR, {"rests"}),
        ([("nightstand", (1.0, 0.0, 0.0), 0), ("table_lamp", (1.3, 0.5, 0.0), 0)], FLOOR, {"rests"}),
        ([("pendant_lamp", (0.0, 2.0, 0.0), 0)], FLOOR, set()),
        ([("pendant_lamp", (0.0, 1.8, 0.0), 0)], FLOOR, {"rests"}),
        ([("pendant_lamp", (0.0, 2.1, 0.0), 0)], FLOOR, {"rests", "in_height"}),
        ([("nightstand", (0.0, -0.4, 0.0), 0)], FLOOR, {"rests", "in_height"}),
    ],
)  # fmt: skip
def test_physics(things, floor, faults):
    assert broken(plan(*things, floor=floor), "physics") == faults


def test_without_walls_and_ceiling_nothing_leaves_them():
    room = plan(("wardrobe", (9.0, 0.0, 0.0), 0), ("pendant_lamp", (0.0, 1.0, 0.0), 0), floor=None, height=None)
    assert broken(room, "physics") == set()
