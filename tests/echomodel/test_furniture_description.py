"""Descriptions of furniture: there and back, every vector a sensible piece, bodies that move, no part that floats."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echomodel.furniture import Choices, draw_choices, draw_style, mesh_of, sample_size, solids
from echomodel.furniture.drawn import draw_styles
from echomodel.furniture.solids import FINEST, pieces_of
from echomodel.furniture.style import FAMILIES, GROUPS, OPEN, STYLE, WIDTH, described, piece_of
from echomodel.metrics.furniture import loose_solids
from echomodel.vocabulary import vocabulary

CATEGORIES = [category.name for category in vocabulary().categories]


def drawn(category: str, seed: int):
    rng = np.random.default_rng([seed, CATEGORIES.index(category)])
    style, choices = draw_style(rng), draw_choices(rng)
    return style, choices, sample_size(category, rng)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from(CATEGORIES))
def test_a_piece_is_rebuilt_from_its_description(seed, category):
    style, choices, size = drawn(category, seed)
    again, same = piece_of(described(style, choices))
    kinds = [(getattr(style, name), getattr(again, name)) for name in ("family", "legs", "back", "fronts", "shade")]
    assert all(one == other for one, other in kinds)
    np.testing.assert_allclose(same.values, choices.values, atol=1e-6)
    first, second = (mesh_of(solids(category, *pair, size), size) for pair in ((style, choices), (again, same)))
    np.testing.assert_allclose(first.vertices, second.vertices, atol=1e-4)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from((None, *vocabulary().styles)))
def test_kinds_are_those_of_one_family_or_of_the_style_that_is_told(seed, told):
    style, _ = piece_of(np.random.default_rng(seed).normal(0, 1.5, WIDTH), told)
    kinds = {part: tuple(odds) for part, odds in FAMILIES[style.family].items()} | dict(told.kinds if told else ())
    assert told is None or style.family == told.family
    assert all(getattr(style, part) in allowed for part, allowed in kinds.items())


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from(CATEGORIES), st.integers(0, FINEST))
def test_any_vector_gives_closed_solids_that_fill_the_box(seed, category, detail):
    rng = np.random.default_rng(seed)
    style, choices = piece_of(rng.normal(0, 1.5, WIDTH))
    size = np.exp(rng.uniform(np.log(0.01), np.log(40), 3))
    pieces = pieces_of(solids(category, style, choices, size), size, detail)
    points = np.concatenate([piece.vertices for piece in pieces])
    assert np.isfinite(points).all()
    np.testing.assert_allclose(points.max(0) - points.min(0), size, rtol=1e-6)
    for piece in pieces:
        edges = np.sort(piece.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


@pytest.mark.parametrize("category", ["dresser", "wardrobe", "nightstand", "desk", "wine_cabinet"])
def test_drawers_and_doors_are_bodies_with_room_to_move(category):
    seen = set()
    for seed in range(6):
        style, choices, size = drawn(category, seed)
        pieces = pieces_of(solids(category, style, choices, size), size)
        bodies = {}
        for piece in pieces:
            if piece.joint:
                bodies.setdefault(piece.joint.body, []).append(piece)
        for body, members in bodies.items():
            joint = members[0].joint
            assert all(member.joint == joint for member in members)
            assert joint.reach > 0
            assert abs(np.linalg.norm(joint.axis) - 1) < 1e-9
            seen.add(body.rsplit("_", 1)[0])
            if joint.kind == "prismatic" and joint.axis[2]:
                assert joint.reach < size[2]
    assert seen & {"drawer", "door"}


@pytest.mark.parametrize("category", CATEGORIES)
def test_no_part_floats(category):
    for seed in (7, 8):
        style, choices, size = drawn(category, seed)
        parts = solids(category, style, choices, size)
        assert [(number, parts[number].role) for number in loose_solids(parts)] == []


def test_a_loose_solid_is_found():
    from dataclasses import replace

    style, choices, size = drawn("dining_table", 0)
    parts = solids("dining_table", style, choices, size)
    away = replace(parts[-1], centre=parts[-1].centre + np.array([0, 3.0, 0]))
    assert loose_solids([*parts, away]) == [len(parts)]


def test_choices_answer_by_name():
    choices = Choices(np.linspace(0, 1, len(OPEN)))
    assert choices.number("kind") == 0.0
    assert choices.chance("kind", 0.01)
    assert not choices.chance("detail", 0.99)
    assert choices.whole("detail", 2, 5) == 4
    assert choices.pick("kind", ["a", "b"], [0.1, 0.9]) == "a"
    assert choices.pick("detail", ["a", "b"], [0.9, 0.1]) == "b"
    assert choices.between("detail", 1.0, 2.0) == pytest.approx(2.0)
    np.testing.assert_array_equal(choices.stream("rows").random(4), choices.stream("rows").random(4))


def test_styles_drawn_in_one_go_tell_one_word_of_each_kind():
    styles = draw_styles(20, np.random.default_rng(0))
    assert styles.shape == (20, STYLE)
    assert ((styles[:, : sum(GROUPS)] == 1).sum(1) == len(GROUPS)).all()
    assert np.abs(styles).max() <= 1 + 1e-6


def test_bad_descriptions_and_choices_are_refused_in_one_line():
    with pytest.raises(ValueError, match=rf"description is \(3,\) float64, expected \({WIDTH},\) finite numbers"):
        piece_of(np.zeros(3))
    with pytest.raises(ValueError, match=r"expected .* finite numbers"):
        piece_of(np.full(WIDTH, np.nan))
    with pytest.raises(ValueError, match=r"open choices are \(2,\), expected \(18,\) finite numbers"):
        Choices(np.zeros(2))
