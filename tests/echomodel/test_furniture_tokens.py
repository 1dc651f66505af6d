"""Part tokens: there and back for all classes, one order, mirror copies folded, and what snapping promises."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echomodel.data.furniture import Choices, Style, sample_size, solids
from echomodel.data.furniture.assembly import pieces_of
from echomodel.data.furniture.carpentry import box
from echomodel.data.furniture.mirroring import MOST, mirrored, solids_of, tokens_of
from echomodel.data.furniture.snapping import loose_tokens, snapped
from echomodel.data.furniture.tokens import CENTRE, GROUPS, HOT, WIDTH, solid_of, token_of, word
from echomodel.data.tokenset import TokenSet, build_tokens
from echomodel.vocabulary import vocabulary

CATEGORIES = [category.name for category in vocabulary().categories]
SIZE = np.array([1.2, 0.8, 0.6])


def drawn(category: str, seed: int):
    rng = np.random.default_rng([seed, CATEGORIES.index(category)])
    style, size = Style.draw(rng), sample_size(category, rng)
    return [solid for solid in solids(category, style, Choices.draw(rng), size) if not solid.core], size


def bounds(parts) -> np.ndarray:
    meshes = [part.mesh()[0] for part in parts]
    return np.array([[*vertices.min(0), *vertices.max(0)] for vertices in meshes])


@pytest.mark.parametrize("category", CATEGORIES)
def test_unfolded_tokens_are_the_same_solids(category):
    for seed in range(2):
        parts, size = drawn(category, seed)
        tokens = tokens_of(parts, size)
        again = solids_of(tokens, size)
        if len(tokens) == MOST:
            assert len(again) <= len(parts)
            continue
        assert len(again) == len(parts)
        apart = np.abs(bounds(parts)[:, None] - bounds(again)[None]).max(2)
        assert apart.min(1).max() < 0.004
        assert apart.min(0).max() < 0.004
        looks = [sorted((part.role, part.material, type(part).__name__) for part in some) for some in (parts, again)]
        assert looks[0] == looks[1]
        moving = [
            sorted(joint.kind for joint in {p.joint.body: p.joint for p in s if p.joint}.values())
            for s in (parts, again)
        ]
        assert moving[0] == moving[1]


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from(CATEGORIES))
def test_the_order_of_the_solids_does_not_matter(seed, category):
    parts, size = drawn(category, seed)
    tokens = tokens_of(parts, size)
    order = np.random.default_rng(seed).permutation(len(parts))
    np.testing.assert_allclose(tokens_of([parts[n] for n in order], size), tokens, atol=1e-5)


def test_four_legs_are_one_token_and_two_sides_one():
    legs = [box((x, 0, z), (x + 0.05, 0.7, z + 0.05), role="leg") for x in (-0.6, 0.55) for z in (-0.3, 0.25)]
    board = box((-0.6, 0.7, -0.3), (0.6, 0.8, 0.3), role="top")
    tokens = tokens_of([*legs, board, box((0.1, 0.1, 0), (0.2, 0.7, 0.1), role="apron")], SIZE)
    assert [(word(t, "role"), word(t, "mirror")) for t in tokens] == [
        ("leg", "both"),
        ("top", "none"),
        ("apron", "none"),
    ]
    assert (tokens[0][CENTRE][[0, 2]] > 0).all()
    there = token_of(legs[0], SIZE)[None]
    np.testing.assert_allclose(mirrored(mirrored(there, 0), 0), there)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000))
def test_any_tokens_become_closed_solids_that_hang_together_in_their_box(seed):
    rng = np.random.default_rng(seed)
    tokens = rng.normal(0, 0.8, (int(rng.integers(1, 12)), WIDTH))
    size = np.exp(rng.uniform(np.log(0.05), np.log(4), 3))
    exact = snapped(tokens, size)
    assert not loose_tokens(exact, size)
    np.testing.assert_array_equal(exact, snapped(tokens, size))
    pieces = pieces_of(solids_of(exact, size), size)
    points = np.concatenate([piece.vertices for piece in pieces])
    assert (np.abs(points[:, [0, 2]]) <= size[[0, 2]] / 2 + 1e-6).all()
    assert points[:, 1].min() >= -1e-9
    assert points[:, 1].max() <= size[1] + 1e-6
    for piece in pieces:
        edges = np.sort(piece.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_the_order_does_not_matter_for_solids_that_differ_in_x_alone():
    # binary fractions: nothing but the place differs, and by less than places are rounded to
    pair = [box((x, 0.125, 0.125), (x + 0.25, 0.375, 0.25), role="leg") for x in (33 / 128, 33 / 128 + 1 / 1024)]
    np.testing.assert_array_equal(tokens_of(pair, SIZE), tokens_of(pair[::-1], SIZE))


def test_snapping_closes_gaps_and_straightens():
    legs = [box((x, 0.01, z), (x + 0.05, 0.68, z + 0.05), role="leg") for x in (-0.6, 0.55) for z in (-0.3, 0.25)]
    board = box((-0.59, 0.7, -0.3), (0.6, 0.8, 0.3), role="top")
    tokens = tokens_of([*legs, board], SIZE)
    assert loose_tokens(tokens, SIZE)
    exact = snapped(tokens, SIZE)
    made = bounds(solids_of(exact, SIZE))
    assert not loose_tokens(exact, SIZE)
    assert made[:, 1].min() == pytest.approx(0)
    np.testing.assert_allclose(made[made[:, 4].argmax()][[0, 3]], [-0.6, 0.6])
    floating = tokens_of([*legs, board, box((-0.02, 0.3, -0.02), (0.02, 0.32, 0.02), role="apron")], SIZE)
    assert "apron" not in [word(token, "role") for token in snapped(floating, SIZE)]


def test_words_that_say_nothing_are_the_first():
    solid = solid_of(np.zeros(WIDTH), SIZE)
    assert (solid.role, solid.material) == ("body", "wood")
    assert sum(GROUPS) == HOT


def test_a_set_of_tokens_is_written_and_read(tmp_path):
    build_tokens(tmp_path, 2, 3, 1)
    found = TokenSet.load(tmp_path)
    assert (found.style.tolist(), found.first_held) == ([0, 0, 0, 1, 1, 1], 1)
    assert found.tokens.shape == (found.count.sum(), WIDTH)
    with pytest.raises(ValueError, match="no set of part tokens"):
        TokenSet.load(tmp_path / "other")
    for content in (b"", (tmp_path / "tokens.npz").read_bytes()[:400]):
        (tmp_path / "tokens.npz").write_bytes(content)
        with pytest.raises(ValueError, match="no set of part tokens"):
            TokenSet.load(tmp_path)
