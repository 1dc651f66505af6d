"""Sizes and proportions of furniture as people know it, from the rows of the vocabulary."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from shapely.geometry import MultiPoint
from shapely.ops import unary_union

from echomodel.furniture import draw_choices, draw_style, solids
from echomodel.furniture.household import PANEL
from echomodel.furniture.solids import Ball, pieces_of
from echomodel.objective.sizes import EDGE, FEET, fitting_loads, in_proportion, laid_tables, size_range, usual_sizes
from echomodel.sizes import usual_range
from echomodel.vocabulary import vocabulary

ROUND = [row.name for row in vocabulary().categories if row.round]
WITHIN = np.zeros((1, 3), bool)
SIDE = st.floats(0.05, 4.0)


@example("tv", (1.2, 1.1, 0.1))  # the one that has a proportion
@given(st.sampled_from([row.name for row in vocabulary().categories]), st.tuples(SIDE, SIDE, SIDE))
def test_usual_sizes_are_in_range_and_in_proportion(word, size):
    (found,) = usual_sizes([word], np.array([size]), lenient=WITHIN)
    row, low, high = vocabulary().category(word), *np.array(size_range(word))
    assert (found >= low - 1e-9).all()
    assert (found <= high + 1e-9).all()
    if row.round:
        assert found[0] == pytest.approx(found[2])
    if row.aspect:
        assert row.aspect[0] - 1e-9 <= found[0] / found[1] <= row.aspect[1] + 1e-9
    for side, limits in zip(found, usual_range(word), strict=False):
        assert limits[0] - 1e-9 <= side <= limits[1] + 1e-9 or row.aspect


def test_what_people_need_of_sizes():
    told = {"pendant_lamp": (0.25, 0.7, 0), "dining_chair": (0.78, 0.95, 1), "chair": (0.78, 0.95, 1)}
    told |= {"stool": (0.42, 0.48, 1), "dining_table": (0.72, 0.78, 1), "table": (0.72, 0.78, 1)}
    for word, (low, high, side) in told.items():
        assert usual_range(word)[side] == (low, high)


def test_round_things_keep_their_volume_and_stated_ones_their_size():
    size = np.array([(1.05, 0.8, 0.76), (1.05, 0.8, 0.76), (0.5, 0.8, 0.5)])
    found = in_proportion(["pendant_lamp", "pendant_lamp", "dresser"], size, np.array([True, False, True]))
    assert found[0, 0] == found[0, 2]
    assert found[0].prod() == pytest.approx(size[0].prod())
    assert np.array_equal(found[1:], size[1:])


def test_what_stands_side_by_side_on_one_piece_has_room_there():
    words, size = ["sideboard", "tv", "table_lamp"], np.array([(1.1, 0.9, 0.4), (1.1, 0.6, 0.2), (0.35, 0.6, 0.35)])
    found = fitting_loads(words, size, np.array([-1, 0, 0]), np.ones(3, bool))
    assert found[1:, 0].sum() == pytest.approx(1.1 - 2 * EDGE)
    alone = fitting_loads(words[::2], size[::2], np.array([-1, 0]), np.ones(2, bool))
    assert alone[1, 0] == pytest.approx(0.35)


@pytest.mark.parametrize("word", [row.name for row in vocabulary().categories if row.bears])
def test_what_carries_something_has_a_plane_top(word):
    """A vanity without a lamp on it has its mirror."""
    words, size = [word, "table_lamp"], np.array([(1.1, 1.5, 0.45), (0.3, 0.5, 0.3)])
    carrying = fitting_loads(words, size, np.array([-1, 0]), np.ones(2, bool))[0]
    assert (fitting_loads(words, size, np.array([-1, -1]), np.ones(2, bool)) == size).all()
    for style in range(20):
        rng = np.random.default_rng(style)
        pieces = pieces_of(solids(word, draw_style(rng), draw_choices(rng), carrying), carrying, 0)
        tops = [piece.vertices[piece.vertices[:, 1] > carrying[1] - 0.03][:, [0, 2]] for piece in pieces]
        top = unary_union([MultiPoint(points).convex_hull.buffer(1e-4) for points in tops if len(points) > 2])
        assert top.area > 0.8 * carrying[0] * carrying[2], style


def test_a_screen_fits_its_stand_and_stays_a_screen():
    size = np.array([(0.8, 0.9, 0.4), (1.3, 0.8, 0.05), (0.35, 0.5, 0.2), (0.5, 0.5, 0.5)])
    words = ["dresser", "tv", "nightstand", "table_lamp"]
    found = fitting_loads(words, size, np.array([-1, 0, -1, 2]), np.ones(4, bool))
    assert found[1, 0] == pytest.approx(0.8 - 2 * EDGE)
    assert found[1, 0] / found[1, 1] == pytest.approx(vocabulary().category("tv").aspect[0])
    assert found[1, 2] == FEET
    assert found[3, 0] == found[3, 2] == pytest.approx(0.2 - 2 * EDGE)


@given(st.integers(0, 300), st.floats(0.5, 1.7), st.floats(0.4, 1.2), st.floats(0.04, 0.25))
def test_screens_are_16_to_9_or_wider_in_any_box(seed, w, h, d):
    rng = np.random.default_rng(seed)
    parts = solids("tv", draw_style(rng), draw_choices(rng), np.array([w, h, d]))
    panel = np.concatenate([p.mesh()[0] for p in parts if p.role in ("housing", "screen")])
    wide, high, _ = np.ptp(panel, axis=0)
    assert PANEL[0] - 0.01 <= wide / high <= PANEL[1] + 0.01
    assert panel[:, 1].max() == pytest.approx(h, abs=0.01)


@pytest.mark.parametrize("word", ROUND)
def test_what_is_round_is_stretched_alike_in_plan(word):
    """Every solid that its program turns round a vertical axis is a circle in the finished piece."""
    rng = np.random.default_rng(7)
    for _ in range(12):
        size = np.array([0.6, 0.9, 0.6]) * rng.uniform(0.7, 1.2)
        size[2] = size[0]
        parts = solids(word, draw_style(rng), draw_choices(rng), size)
        seen = [part for part in parts if not part.core]
        for piece in pieces_of(parts, size, round=True):
            before = np.ptp(piece.solid.mesh()[0], axis=0)
            after = np.ptp(piece.vertices, axis=0)
            if piece.solid.role in ("shade", "pot", "seat", "top", "bulb") and before[0] == pytest.approx(before[2]):
                assert after[0] == pytest.approx(after[2], rel=1e-3), (word, piece.solid.role)
        assert seen


@pytest.mark.parametrize("word", ["pendant_lamp", "floor_lamp", "table_lamp", "ceiling_lamp"])
def test_globes_are_spheres(word):
    rng, globes = np.random.default_rng(3), 0
    for _ in range(60):
        low, high = np.array(size_range(word))
        (size,) = usual_sizes([word], rng.uniform(low, high)[None], lenient=WITHIN)
        style = replace(draw_style(rng), shade="sphere")
        for piece in pieces_of(solids(word, style, draw_choices(rng), size), size, round=True):
            if isinstance(piece.solid, Ball) and piece.solid.role == "shade":
                globes += 1
                extent = np.ptp(piece.vertices, axis=0)
                assert extent.max() < 1.2 * extent.min(), (word, size, extent)
    assert globes


@pytest.mark.parametrize(("chairs", "least"), [(2, 0.56), (4, 1.12), (6, 1.68), (8, 1.98)])
def test_a_table_is_long_enough_for_who_sits_at_it(chairs, least):
    words = ["dining_table", *["dining_chair"] * chairs]
    size = np.array([[0.5, 0.75, 0.8], *[[0.42, 0.9, 0.5]] * chairs])
    anchor = np.array([-1, *[0] * chairs])
    found = laid_tables(words, size, anchor, np.ones(len(words), bool))
    assert found[0, [0, 2]].max() == pytest.approx(max(least, 0.8))
    assert np.array_equal(laid_tables(words, size, anchor, np.zeros(len(words), bool)), size)


@pytest.mark.parametrize(("chairs", "bench", "least"), [(4, 1.2, 1.42), (7, 1.2, 3.1), (2, 1.5, 1.5)])
def test_a_table_is_long_enough_for_a_bench_and_who_sits_opposite(chairs, bench, least):
    """Two chairs sit at the ends, the others along the side that the bench leaves."""
    words = ["dining_table", "bench", *["dining_chair"] * chairs]
    size = np.array([[0.5, 0.75, 0.8], [bench, 0.45, 0.4], *[[0.42, 0.9, 0.5]] * chairs])
    found = laid_tables(words, size, np.array([-1, *[0] * (chairs + 1)]), np.ones(len(words), bool))
    assert found[0, [0, 2]].max() == pytest.approx(least)
