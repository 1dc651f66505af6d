"""Parametric furniture: closed meshes of the right size for every category, distances that agree with the mesh."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from echomodel.furniture import Choices, draw_choices, draw_style, mesh_of, sample_size, solids
from echomodel.furniture.bent import Bow, Shell
from echomodel.furniture.chairs import BODIES
from echomodel.furniture.pads import Pad
from echomodel.furniture.seating import back_rest
from echomodel.furniture.solids import Ball, Block, Lathe, Tube, Turned, rotation
from echomodel.furniture.style import OPEN
from echomodel.metrics.furniture import loose_solids
from echomodel.sizes import size_score, size_statistics
from echomodel.tsdf import mesh_from_tsdf, tsdf_from_mesh, tsdf_of
from echomodel.vocabulary import UnknownWord, vocabulary

CATEGORIES = [category.name for category in vocabulary().categories]

SOLIDS = {
    "rounded": Block(half=np.array([0.3, 0.1, 0.5]), radius=0.05, turn=rotation(0.3, 0.5, 0.2)),
    "disc": Turned(low=(0.3, 0.3), high=(0.3, 0.3), height=0.2, rounding=0.04),
    "leg": Turned(low=(0.03, 0.03), high=(0.05, 0.05), height=0.7, power=np.inf, turn=rotation(0.2, 0.3)),
    "top": Turned(low=(0.8, 0.4), high=(0.8, 0.4), height=0.1, power=6.0),
    "ball": Ball(half=np.array([0.3, 0.2, 0.3]), power=3.0),
    "tube": Tube(points=np.array([[0.0, 0, 0], [0.1, 0.5, 0.02], [0.3, 0.9, 0.1], [0.6, 1.2, 0.25]]), radius=0.08),
    "shell": Shell(half=(0.4, 0.5), thickness=0.08),
}


def furniture(category, style, rng, size):
    """One piece of furniture as a mesh."""
    return mesh_of(solids(category, style, draw_choices(rng), size), size, round=vocabulary().category(category).round)


@pytest.mark.parametrize("name", SOLIDS)
def test_the_distance_of_a_solid_agrees_with_its_mesh(name):
    mesh = mesh_of([SOLIDS[name]])
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0
    exact, ours = tsdf_from_mesh(mesh), tsdf_of([SOLIDS[name]])
    band = np.abs(exact) < 0.5
    assert np.abs(exact - ours)[band].mean() * 4 < 0.25  # voxels; round meshes are inscribed polygons
    assert ((exact < 0) & (ours < 0)).sum() / ((exact < 0) | (ours < 0)).sum() > 0.93


@pytest.mark.parametrize("category", ["armchair", "lounge_chair", "loveseat_sofa"])
def test_nothing_comes_out_behind_a_wall_bent_round_a_seat(category):
    looked_at = 0
    for seed in range(120):
        rng = np.random.default_rng([seed, 5])
        style = draw_style(rng)
        parts = solids(category, style, draw_choices(rng), sample_size(category, rng, style))
        walls = [part for part in parts if isinstance(part, Shell) and part.role == "back"]
        for wall in walls:
            for inside in (part for part in parts if part.role in ("base", "seat")):
                x, _, z = (mesh_of([inside]).vertices - wall.centre).T
                out = (np.abs(x) / wall.half[0]) ** wall.power + (np.maximum(-z, 0) / wall.half[1]) ** wall.power
                assert out.max() < 1.0
                looked_at += 1
    assert looked_at >= 10


@pytest.mark.parametrize("category", CATEGORIES)
def test_a_piece_is_watertight_fills_its_size_and_survives_the_grid(category):
    for seed in range(3):
        rng = np.random.default_rng([seed, 11])
        style = draw_style(rng)
        size = sample_size(category, rng, style)
        mesh = furniture(category, style, rng, size)
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        assert mesh.volume > 0
        share = mesh.extents / size
        fills = [max(share[[0, 2]]), share[1]] if vocabulary().category(category).round else share
        np.testing.assert_allclose(fills, 1.0, rtol=1e-6)
        assert abs(mesh.bounds[0, 1]) < 1e-9
    back = mesh_from_tsdf(tsdf_of(solids(category, style, draw_choices(np.random.default_rng(0)), size)))
    assert back.is_watertight
    # Up to two voxels more for parts thickened at the edge of the box, two less for tips of thin parts.
    assert (back.extents < 1.06).all()
    assert (back.extents > 0.9).all()


def test_the_same_generator_makes_the_same_piece_and_another_style_another_one():
    size = np.array([0.48, 0.9, 0.52])
    first, again, other = (
        furniture("dining_chair", draw_style(np.random.default_rng(s)), np.random.default_rng(5), size)
        for s in (1, 1, 2)
    )
    np.testing.assert_array_equal(first.vertices, again.vertices)
    assert len(other.vertices) != len(first.vertices) or not np.allclose(other.vertices, first.vertices)


def test_pieces_of_one_style_are_closer_in_size_than_pieces_of_different_styles():
    rng = np.random.default_rng(0)
    styles = [draw_style(rng) for _ in range(300)]
    pairs = np.log([[sample_size("dining_chair", rng, style) for _ in range(2)] for style in styles])
    within = np.abs(pairs[:, 0] - pairs[:, 1]).mean()
    assert within < 0.8 * np.abs(pairs[:, 0] - np.roll(pairs[:, 1], 1, axis=0)).mean()


@pytest.fixture(scope="module")
def styles():
    rng = np.random.default_rng(3)
    return [style for _ in range(750) for style in (None, draw_style(rng))]


@pytest.mark.parametrize("category", CATEGORIES)
def test_sizes_have_the_percentiles_of_real_rooms(category, styles):
    rng = np.random.default_rng(3)
    statistics = size_statistics(category)
    sizes = np.array([sample_size(category, rng, style) for style in styles])
    low, median, high = np.percentile(sizes, [5, 50, 95], axis=0)
    np.testing.assert_allclose(median, statistics.median, rtol=0.10)
    np.testing.assert_allclose(low, statistics.low, rtol=0.20)
    np.testing.assert_allclose(high, statistics.high, rtol=0.20)


def test_scores_of_sizes_undo_the_draw_and_shifts_move_them():
    rng = np.random.default_rng(3)
    sizes = np.array([sample_size("wardrobe", rng, shift=(0.5, 0.0, -0.5)) for _ in range(1500)])
    np.testing.assert_allclose(np.median(size_score("wardrobe", sizes), axis=0), [0.5, 0.0, -0.5], atol=0.12)
    statistics = size_statistics("wardrobe")
    ends = np.array([statistics.low, statistics.median, statistics.high])
    np.testing.assert_allclose(size_score("wardrobe", ends), np.array([[-1.645], [0], [1.645]]) * np.ones(3), atol=1e-3)


def test_bad_words_and_sizes_are_refused_in_one_line():
    style, rng = draw_style(np.random.default_rng(0)), np.random.default_rng(0)
    with pytest.raises(UnknownWord, match="unknown category 'sculpture'"):
        sample_size("sculpture", rng, style)
    with pytest.raises(UnknownWord, match="unknown category 'sculpture'"):
        solids("sculpture", style, draw_choices(rng), np.ones(3))
    with pytest.raises(ValueError, match=r"size of chair is \[1.0, -1.0, 1.0\], need three positive numbers in metres"):
        solids("chair", style, draw_choices(rng), np.array([1.0, -1.0, 1.0]))


@pytest.mark.parametrize("size", [(0.25, 1.4, 0.86), (0.86, 1.4, 0.25), (0.3, 1.5, 0.45)])
def test_no_shade_of_a_floor_lamp_is_a_long_oval(size):
    rng = np.random.default_rng(4)
    for _ in range(20):
        parts = solids("floor_lamp", draw_style(rng), draw_choices(rng), np.array(size))
        shades = [part for part in parts if part.role == "shade" and isinstance(part, Lathe)]
        assert all(1 / 1.7 < part.squash < 1.7 for part in shades)
        assert mesh_of(parts, np.array(size)).is_watertight


def drawn(number, **told):
    """A style and open choices, the style's fields as told."""
    rng = np.random.default_rng(number)
    return replace(draw_style(rng), **told), draw_choices(rng)


def bounds(parts):
    """(n, 2, 3) float, least and greatest corners of some solids."""
    return np.array([[vertices.min(0), vertices.max(0)] for vertices in (part.mesh(2)[0] for part in parts)])


@pytest.mark.parametrize("category", ["desk", "dressing_table"])
def test_where_people_sit_is_room_for_knees_and_support_on_both_sides(category):
    for number in range(60):
        width = 0.8 + 0.01 * number
        parts = solids(category, *drawn(number), np.array([width, 0.76, 0.5]))
        low = bounds([part for part in parts if part.role != "core"])
        low = low[low[:, 0, 1] < 0.12]
        assert low[:, 0, 0].min() < -0.3 * width, number
        assert low[:, 1, 0].max() > 0.3 * width, number
        left, right = low[low[:, 0, 0] < -0.2 * width, 1, 0].max(), low[low[:, 1, 0] > 0.2 * width, 0, 0].min()
        assert right - left > 0.4, number


@pytest.mark.parametrize("category", ["dresser", "cabinet"])
def test_legs_stand_under_the_body_that_a_lid_overhangs(category):
    for number in range(30):
        style, choices = drawn(number, family="rustic", legs="straight")
        parts = solids(category, style, choices, np.array([0.45, 0.7, 0.4]))
        legs, sides = ([part for part in parts if part.role == role] for role in ("leg", "side"))
        assert np.abs(bounds(legs)[:, :, 0]).max() <= np.abs(bounds(sides)[:, :, 0]).max() + 1e-6, number


def test_only_a_high_cabinet_for_children_has_a_gable():
    for high, gabled in ((0.76, False), (1.5, True)):
        size, found = np.array([0.6, high, 0.32]), set()
        for style in range(12):
            look = draw_style(np.random.default_rng(style))
            parts = solids("children_cabinet", look, draw_choices(np.random.default_rng(style)), size)
            found.add(any(part.role == "roof" for part in parts))
        assert found == {gabled, False}


def test_a_cushion_is_fuller_in_its_middle_and_a_bent_board_hollow():
    flat, puffed = (Pad(half=np.array([0.3, 0.1, 0.3]), radius=0.06, crown=crown).mesh()[0] for crown in (0.0, 0.02))
    assert puffed[:, 1].max() == pytest.approx(0.1, abs=0.01)
    assert np.linalg.norm(puffed, axis=1).max() < np.linalg.norm(flat, axis=1).max() - 0.02
    board = Bow(half=np.array([0.3, 0.2, 0.012]), bow=0.05).mesh()[0]
    ends = abs(board[:, 0]) > 0.29
    assert board[ends, 2].min() > -0.02
    assert board[abs(board[:, 0]) < 0.05, 2].max() < -0.03


def test_cushions_in_a_row_touch_and_no_two_are_dented_alike():
    for number in range(8):
        style, choices = drawn(number, arms="box", back="rails")
        parts = solids("multi_seat_sofa", style, choices, np.array([2.2, 0.85, 0.95]))
        for role in ("seat", "back"):
            pads = sorted((p for p in parts if isinstance(p, Pad) and p.role == role), key=lambda pad: pad.centre[0])
            tops = [pad.mesh()[0] - pad.centre for pad in pads]
            for (left, a), (right, b) in itertools.pairwise(zip(pads, tops, strict=True)):
                assert (left.centre + a)[:, 0].max() >= (right.centre + b)[:, 0].min(), number
                assert len(a) != len(b) or np.ptp(abs(a - b), axis=0).max() > 0.001, number


def test_trestles_and_bows_hold_together():
    for number in range(20):
        table = solids("dining_table", *drawn(number, legs="trestle", round_tops=0.0), np.array([1.8, 0.75, 1.4]))
        chair = solids("chinese_chair", *drawn(number), np.array([0.6, 0.9, 0.5]))
        assert not loose_solids(table), number
        assert not loose_solids(chair), number


@pytest.mark.parametrize("back", [*BODIES, "cushion"])
def test_a_back_may_have_a_body_of_its_own_which_holds_together(back):
    made = {True: set(), False: set()}
    for number in range(12):
        style, choices = drawn(number, back=back)
        for other in made:
            values = np.where(np.arange(len(OPEN)) == OPEN.index("form"), 0.0 if other else 0.99, choices.values)
            size = sample_size("dining_chair", np.random.default_rng(number), style)
            parts = solids("dining_chair", style, Choices(values), size)
            assert not loose_solids(parts), number
            made[other].add(tuple(sorted((type(part).__name__, part.role) for part in parts)))
    assert not made[True] & made[False]


def test_no_stile_shows_before_the_board_of_a_back():
    for number in range(20):
        style, _ = drawn(number, bulk=1.5, softness=0.2)
        board, *stiles = back_rest(style, "panel", 0.4, 0.45, 0.9, -0.2, 0.03, 0.0)
        front = bounds([board])[0, 1, 2]
        assert all(bounds([stile])[0, 1, 2] < front + 1e-6 for stile in stiles), number


@pytest.mark.parametrize("softness", [0.2, 0.8])
def test_no_two_faces_of_an_arched_headboard_lie_in_one_plane(softness):
    style = replace(draw_style(np.random.default_rng(1)), headboard="arched", softness=softness)
    size = np.array([1.7, 1.1, 2.1])
    parts = [p.mesh()[0] for p in solids("double_bed", style, draw_choices(np.random.default_rng(2)), size)
             if p.role == "headboard"]  # fmt: skip
    fronts, rears = ([round(float(end(part[:, 2])), 4) for part in parts] for end in (np.max, np.min))
    assert len(set(fronts)) == len(set(rears)) == len(parts) == 2


def test_office_chairs_have_a_net_in_a_frame_and_a_pad_for_the_head_or_a_padded_back():
    size, choices = np.array([0.62, 1.15, 0.6]), draw_choices(np.random.default_rng(0))
    for tufting, count in ((0.9, 4), (0.1, 1)):
        style = replace(draw_style(np.random.default_rng(1)), tufting=tufting, back="panel")
        parts = solids("office_chair", style, choices, size)
        assert sum(part.role == "back" for part in parts) == count
        assert not loose_solids(parts)
        assert mesh_of(parts, size).bounds[1, 1] == pytest.approx(size[1], abs=1e-6)


def test_the_net_of_an_office_chair_hangs_in_a_frame_around_it():
    style = replace(draw_style(np.random.default_rng(1)), tufting=0.9, back="slats")
    made = solids("office_chair", style, draw_choices(np.random.default_rng(1)), np.array([0.6, 1.1, 0.6]))
    (frame,) = (part for part in made if part.role == "back" and isinstance(part, Tube))
    points = frame.mesh()[0]
    wide, tall, _ = np.ptp(points, axis=0)
    assert 0.4 < wide < 0.6
    assert 0.4 < tall < 0.65
    assert points[np.abs(points[:, 0]) < 0.05, 1].max() > points[:, 1].max() - 0.06  # no heart
