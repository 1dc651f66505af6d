"""Rules measure arrays of numpy as they measure tensors of torch, and answer in the library that they are asked in."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from echomodel.boxes import Boxes
from echomodel.floors import Walls
from echomodel.graph import Stated
from echomodel.rules import RULE_SETS, margins, rule_set, verdicts
from echomodel.rules.geometry import Spread, pairs
from echomodel.rules.margins import pair_margins
from echomodel.rules.placements import RULES, margin_of, placement_margins
from echomodel.vocabulary import vocabulary

SEEDS, WORDS = st.integers(0, 10_000), vocabulary()
NOTCHED = np.array([(-2.0, -2.0), (2.0, -2.0), (2.0, 0.0), (0.0, 0.0), (0.0, 2.0), (-2.0, 2.0)])
KINDS = ("wardrobe", "sofa", "single_bed", "plant")  # with a front, with one, lengthwise, without


def drawn(seed: int, count: int = 12) -> Spread:
    """Boxes that stand on the floor, on one another or hang, square and askew, two of them in one place."""
    rng = np.random.default_rng(seed)
    position = rng.uniform(-2, 2, (count, 3))
    position[:, 1] = rng.choice([0.0, 0.5, 1.8], count)
    position[1] = position[0]
    return Spread(rng.uniform(0.2, 2.5, (count, 3)), position, rng.choice([0.0, np.pi / 2, 0.4, -2.0], count))


def tensors(boxes: Spread) -> Boxes:
    return Boxes(*(torch.from_numpy(of) for of in (boxes.size, boxes.position, boxes.yaw)))


def same(found: object, expected: torch.Tensor) -> None:
    assert isinstance(found, np.ndarray)
    assert isinstance(expected, torch.Tensor)
    assert found.dtype == expected.numpy().dtype
    np.testing.assert_allclose(found, expected.numpy(), rtol=0, atol=1e-9)


@settings(max_examples=25, deadline=None)
@given(SEEDS, st.sampled_from(sorted(RULE_SETS)), st.booleans())
def test_relations(seed: int, name: str, headed: bool) -> None:
    boxes, rules = drawn(seed), rule_set(name)
    subject, object_ = (~np.eye(len(boxes.yaw), dtype=bool)).nonzero()
    fronts = np.random.default_rng(seed).random(len(boxes.yaw)) < 0.6 if headed else None
    there = None if fronts is None else torch.from_numpy(fronts)
    ends, centre = (torch.from_numpy(subject), torch.from_numpy(object_)), np.full_like(boxes.position, 0.3)
    ours = pairs(boxes, subject, object_, centre, oriented=rules.oriented, fronts=fronts)
    theirs = pairs(tensors(boxes), *ends, torch.from_numpy(centre), oriented=rules.oriented, fronts=there)
    for rule in rules.rules.values():
        for margin in {rule.margin, rule.label} - {None}:
            same(margin(ours), margin(theirs))
    told = np.arange(len(subject)) % len(WORDS.predicates)  # those that nobody measures, too
    same(pair_margins(ours, told, rules), pair_margins(theirs, torch.from_numpy(told), rules))
    triplets, centre = np.stack([subject, told, object_], 1), np.array([0.3, 0.3])
    for ask in (margins, verdicts):
        found = ask(boxes, triplets, rules=name, center=centre, fronts=fronts)
        same(found, ask(tensors(boxes), torch.from_numpy(triplets), rules=name, center=centre, fronts=there))
        assert len(found) == len(triplets)


@settings(max_examples=25, deadline=None)
@given(SEEDS, st.sampled_from(sorted(RULES)), st.sampled_from(KINDS), st.sampled_from([NOTCHED, NOTCHED[::-1]]))
def test_placements(seed: int, placement: str, kind: str, floor: np.ndarray) -> None:
    boxes = drawn(seed)
    others, categories = (1, 2) if placement == "between" else (), [kind] * len(boxes.yaw)
    stated = [Stated(placement, k, tuple(k + other for other in others)) for k in range(len(categories) - 2)]
    asked = stated, floor, categories
    same(placement_margins(boxes, *asked), placement_margins(tensors(boxes), *asked))
    every = [drawn(seed + k) for k in range(3)]  # many poses of one
    asked = Walls(floor), categories
    poses = [Spread(one.size, one.position, one.yaw) for one in map(tensors, every)]
    same(margin_of(stated[0], every, *asked), margin_of(stated[0], poses, *asked))


def test_nothing_to_measure() -> None:
    boxes, none = drawn(0), np.zeros((0, 3), np.int64)
    same(margins(boxes, none), margins(tensors(boxes), torch.from_numpy(none)))
    same(verdicts(boxes, none), verdicts(tensors(boxes), torch.from_numpy(none)))
    same(placement_margins(boxes, [], None, []), placement_margins(tensors(boxes), [], None, []))
    assert np.isnan(placement_margins(boxes, [Stated("in_corner", 0)], None, KINDS)).all()


@pytest.mark.parametrize("name", sorted(RULE_SETS))
def test_single_precision_stays(name: str) -> None:
    boxes = drawn(3)
    small = Spread(*(of.astype(np.float32) for of in (boxes.size, boxes.position, boxes.yaw)))
    triplets = np.array([[i, row.id, i + 1] for i in range(4) for row in WORDS.predicates])
    found, expected = margins(small, triplets, rules=name), margins(boxes, triplets, rules=name)
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-4)
