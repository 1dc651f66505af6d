"""Pillows, covers and tufted panels: closed at every detail, within their boxes, and no plain blocks."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from echomodel.dressing.textiles import LEAN, LIES, cushion, throw
from echomodel.furniture import draw_choices, draw_style, solids
from echomodel.furniture.cloth import cover, pillow, seam
from echomodel.furniture.pads import cushion as seat_cushion
from echomodel.furniture.sofas import BODIES, upholstered_arms
from echomodel.furniture.style import FAMILIES
from echomodel.furniture.tufting import Tufted

HALF = np.array([0.4, 0.1, 0.25])
MADE = {
    "pillow": pillow((0, 0, 0), HALF, "linen"),
    "cover": cover(-HALF, HALF, "blanket", 0.04, 0.03, np.random.default_rng(1)),
    "tufted": Tufted(half=HALF[[0, 2, 1]]),
    "channels": Tufted(half=HALF[[0, 2, 1]], channels=True),
}


@pytest.mark.parametrize("detail", range(4))
@pytest.mark.parametrize("name", MADE)
def test_cloth_is_closed_and_within_its_box(name, detail):
    made = MADE[name]
    mesh = trimesh.Trimesh(*made.mesh(detail))
    assert mesh.is_watertight
    assert mesh.volume > 0.25 * np.prod(2 * made.half)
    assert (abs(mesh.vertices) <= made.half + 1e-6).all()


def test_corners_of_a_pillow_stand_out_and_its_seams_are_thin():
    points = MADE["pillow"].mesh()[0]
    corner = points[np.argmax(points[:, 0] + points[:, 2])]
    middle = points[abs(points[:, 2]) < 0.02]
    assert corner[0] == pytest.approx(HALF[0])
    assert middle[:, 0].max() < 0.93 * HALF[0]
    assert -0.3 * HALF[1] < corner[1] < -0.1 * HALF[1]  # they droop


def test_a_cord_runs_along_the_innerof_its_cushion():
    cushion = trimesh.Trimesh(*pillow((0, 0, 0), (0.25, 0.24, 0.08), "linen").mesh())
    line = seam((0.25, 0.24, 0.08))
    assert np.linalg.norm(line[1:] - line[:-1], axis=1).max() < 0.09
    assert np.abs(trimesh.proximity.signed_distance(cushion, line)).max() < 0.004


def test_no_two_cushions_are_alike():
    one, other = (pillow((x, 0, 0), (0.25, 0.24, 0.08), "linen").mesh()[0] - (x, 0, 0) for x in (0.0, 0.4))
    assert np.abs(one - other).max() > 0.005


def test_a_cushion_stands_on_all_of_its_lower_side():
    points = pillow((0, 0.24, 0), (0.25, 0.24, 0.08), "linen").mesh()[0]
    inner = points[np.abs(points[:, 0]) < 0.2]
    assert inner[:, 1].min() < 0.006  # its middle, not its corners alone
    assert inner[:, 1].max() < 0.475  # above it draws in


def test_a_deep_cushion_leans_back_over_a_wider_foot():
    wide, tall = 0.45, 0.42
    upright, leaning = (
        np.concatenate([one.mesh()[0] for one in cushion((wide, tall, deep), np.random.default_rng(3))])
        for deep in (0.15, 0.15 + LEAN * tall)
    )

    def slice_of(points, share):
        z = points[abs(points[:, 1] / tall - share) < 0.06, 2]
        return (z.max() + z.min()) / 2, np.ptp(z)

    assert abs(slice_of(upright, 0.9)[0] - slice_of(upright, 0.1)[0]) < 0.01
    assert slice_of(leaning, 0.1)[0] - slice_of(leaning, 0.9)[0] == pytest.approx(LEAN * tall * 0.88, abs=0.02)
    assert slice_of(leaning, 0.1)[1] > 1.4 * slice_of(upright, 0.1)[1]
    np.testing.assert_allclose(np.ptp(leaning, axis=0), (wide, tall, 0.15 + LEAN * tall), atol=0.03)


def test_a_cover_has_folds_and_two_covers_differ():
    def tops(seed):
        points = cover(-HALF, HALF, "blanket", 0.04, 0.03, np.random.default_rng(seed)).mesh()[0]
        return points[(abs(points[:, [0, 2]]) < HALF[[0, 2]] - 0.045).all(1) & (points[:, 1] > 0), 1]

    assert 0.008 < np.ptp(tops(1)) < 0.031
    assert not np.allclose(np.sort(tops(1))[-40:], np.sort(tops(2))[-40:])


@pytest.mark.parametrize("falls", [False, True])
def test_a_cover_hangs_over_its_sides_and_at_its_foot_where_it_falls(falls):
    points = cover(-HALF, HALF, "blanket", 0.04, 0.03, np.random.default_rng(1), falls=falls).mesh()[0]
    foot = points[(points[:, 2] > HALF[2] - 0.04) & (abs(points[:, 0]) < HALF[0] - 0.05)]
    assert (foot[:, 1].min() < -0.5 * HALF[1]) == falls
    assert foot[:, 1].max() > HALF[1] - 0.035  # a round edge
    hem = points[(abs(points[:, 2]) < 0.15) & (points[:, 0] > HALF[0] - 0.04) & (points[:, 1] < 0)]
    assert np.ptp(hem[hem[:, 1] < -0.06, 0]) > 0.01  # waves


def test_a_cover_that_hangs_hides_the_corners_of_its_frame():
    for seed in range(5):
        cloth = cover((-0.8, 0.3, -1.0), (0.8, 0.6, 1.0), "linen", 0.1, 0.03, np.random.default_rng(seed), falls=True)
        hem = cloth.mesh()[0]
        hem = hem[hem[:, 1] < 0.4]
        assert (hem[:, 0] + hem[:, 2]).max() > 1.75, seed  # a corner as round as its edges ends at 1.74
        assert (hem[:, 2] - hem[:, 0]).max() > 1.75, seed


def test_what_hangs_of_a_cover_swells_between_narrow_folds():
    """A board's edge is straight; that of a duvet stands out by centimetres for most of its way."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        points = cover((-0.8, 0.3, -1.0), (0.8, 0.7, 1.0), "blanket", 0.12, 0.085, rng, falls=True).mesh()[0]
        foot = points[(points[:, 2] > 0.85) & (abs(points[:, 0]) < 0.6) & (abs(points[:, 1] - 0.42) < 0.06), 2]
        assert len(foot) > 15
        assert np.ptp(foot) > 0.02, seed
        assert foot.max() - np.median(foot) < np.median(foot) - foot.min(), seed


def test_the_front_of_a_seat_is_fuller_in_its_middle():
    style = replace(draw_style(np.random.default_rng(3)), softness=0.7)
    points = seat_cushion((-0.4, 0.3, -0.3), (0.4, 0.45, 0.3), style).mesh()[0]
    front = points[points[:, 2] > 0.2]
    middle, ends = front[abs(front[:, 0]) < 0.15], front[abs(front[:, 0]) > 0.35]
    assert middle[:, 2].max() == pytest.approx(0.3, abs=0.005)
    assert ends[:, 2].max() < 0.28
    assert 0.34 < middle[middle[:, 2].argmax(), 1] < 0.4  # over the seam below, and below the one over it


def test_a_throw_lies_over_narrow_valleys_and_in_broad_ones():
    def lowest(columns):
        below = np.zeros(LIES)
        below[:, columns] = 0.08
        points = throw((2.0, 0.3, 0.6), np.random.default_rng(1), (0.3, 0.3, *below.ravel()))[0].mesh()[0]
        return points[abs(points[:, 0]) < 0.3, 1].min()

    assert lowest([14]) > lowest(range(10, 18)) + 0.03


def test_sofas_have_eight_bodies_and_each_family_builds_several():
    assert len(BODIES) == 8
    for family in FAMILIES:
        assert sum(row["odds"].get(family, 0) > 0 for row in BODIES) >= 4
    rng, size, made = np.random.default_rng(0), np.array([2.1, 0.82, 0.92]), set()
    for _ in range(40):
        parts = solids("multi_seat_sofa", draw_style(rng), draw_choices(rng), size)
        made.add(tuple(sorted((type(part).__name__, part.role) for part in parts)))
    assert len(made) >= 12


def test_tufted_panels_fold_along_both_diagonals():
    vertices, faces = MADE["tufted"].mesh(1)
    middles = vertices[faces].mean(1)
    front = np.round(middles[middles[:, 2] > 0], 6)
    assert {tuple(row) for row in front} == {tuple(row) for row in front * (-1, 1, 1) + 0.0}


def test_a_button_is_where_folds_meet():
    panel = Tufted(half=np.array([0.45, 0.25, 0.06]), apart=0.2)
    cloth, *buttons = sorted(trimesh.Trimesh(*panel.mesh(3)).split(), key=lambda part: -part.volume)
    assert len(buttons) == 10  # between four columns and two rows of diamonds
    for button in buttons:
        x, y, z = button.bounds.mean(0)
        around = cloth.vertices[np.linalg.norm(cloth.vertices[:, :2] - (x, y), axis=1) < 0.08]
        assert around[:, 2].min() == pytest.approx(around[np.linalg.norm(around[:, :2] - (x, y), axis=1).argmin(), 2])
        assert z > around[:, 2].min()
    assert len(trimesh.Trimesh(*replace(panel, channels=True).mesh(3)).split()) == 1


@pytest.mark.parametrize(("arms", "softness"), [("box", 0.7), ("box", 0.2), ("slim", 0.5), ("rolled", 0.5)])
def test_arms_are_no_plain_boxes_and_stay_within_the_seat(arms, softness):
    style = replace(draw_style(np.random.default_rng(3)), arms=arms, softness=softness, piping=0.0)
    parts = upholstered_arms(2.0, 0.1, 0.6, 0.9, 0.16, style)
    points = np.concatenate([part.mesh()[0] for part in parts])
    assert np.abs(points[:, 0]).max() < 1.02
    low, high = (np.abs(points[there, 0]) for there in (points[:, 1] < 0.3, points[:, 1] > 0.45))
    assert high.max() > low.max() + 0.01
    assert arms == "rolled" or softness > 0.4 or high.min() > low.min() + 0.01  # firm ones flare


def test_armchairs_are_made_like_sofas():
    rng, size, made = np.random.default_rng(1), np.array([0.85, 0.85, 0.85]), set()
    for _ in range(40):
        parts = solids("armchair", draw_style(rng), draw_choices(rng), size)
        made.add(tuple(sorted((type(part).__name__, part.role) for part in parts)))
    assert any(("Tufted", "back") in one for one in made)
    assert len(made) >= 12


@pytest.mark.parametrize("channels", [False, True])
def test_padded_panels_have_no_face_without_area(channels):
    for apart in np.linspace(0.06, 0.5, 60):
        panel = Tufted(half=np.array([0.2, 0.226, 0.06]), apart=apart, channels=channels)
        for detail in range(4):
            vertices, faces = panel.local_mesh(detail)
            one, other = (vertices[faces[:, k]] - vertices[faces[:, 0]] for k in (1, 2))
            assert np.linalg.norm(np.cross(one, other), axis=1).min() > 1e-7, (apart, detail)


def test_every_bed_is_made():
    for seed in range(12):
        rng = np.random.default_rng(seed)
        made = solids("double_bed", draw_style(rng), draw_choices(rng), np.array([1.7, 1.0, 2.1]))
        assert sum(one.role == "cover" for one in made) == 2  # and a sheet turned back over it
