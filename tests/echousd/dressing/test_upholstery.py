"""Cushions stand and lean on what of their seat is level."""

import itertools

import numpy as np
import pytest

from echomodel.boxes2d import upright
from echomodel.dressing import KINDS, usual
from echomodel.dressing.textiles import LEAN
from echomodel.triangles import joined
from echousd import generate
from echousd.dressing.dress import dressed
from echousd.dressing.seats import at_back, behind, over_arm, standing_on
from echousd.dressing.setting import ORIGIN, geometry_of, standing
from echousd.dressing.soft_tops import STEP, Seat, heights_of, let_down
from echousd.graph import SceneGraph
from echousd.shapes.geometry import Collider, Geometry, Part
from echousd.shapes.hulls import convex_hull, depth, forbidden_moves


@pytest.mark.parametrize("kind", ["cushion", "lumbar_cushion", "pouf"])
def test_soft_things_weigh_what_real_ones_do_whatever_covers_them(kind):
    row, luck = KINDS[kind], np.random.default_rng(0)
    sizes = [tuple(luck.uniform(row.low, row.high).tolist()) for _ in range(40)]
    found = [geometry_of(kind, size, variant).mass.mass for variant, size in enumerate(sizes)]
    low, high = (1.0, 9.0) if kind == "pouf" else (0.2, 1.3)
    assert low < min(found) < max(found) < high


def seat_of(*solids):
    """An armchair that collides by hulls of points (n, 3)."""
    hulls = tuple(Collider(f"collider_{n}", convex_hull(points), "convexHull") for n, points in enumerate(solids))
    part = Part("mesh", joined([hull.mesh for hull in hulls]), {})
    return standing("seat", "armchair", np.array([0.8, 0.8, 0.8]), np.zeros(3), 0.0, Geometry((part,), hulls, ORIGIN))


def test_a_cushion_stands_on_what_of_its_seat_is_level():
    corners = np.array(list(itertools.product((-0.4, 0.4), (0.0, 0.42), (-0.4, 0.4))))
    size = np.array([0.45, 0.42, 0.15])
    assert let_down(seat_of(corners), np.array([0.1, 0.435, 0.0]), size) == pytest.approx([0.1, 0.42, 0.0])
    assert let_down(seat_of(corners), np.array([0.1, 0.5, 0.0]), size) is None  # far above it
    assert let_down(seat_of(corners), np.array([0.5, 0.42, 0.0]), size) is None  # half beside it
    raked = corners.copy()
    raked[:, 1] += np.where(corners[:, 1] > 0.2, 0.2 * corners[:, 2], 0.0)
    assert let_down(seat_of(raked), np.array([0.1, 0.43, 0.0]), size) is None


def test_cushions_lie_on_their_seat_not_on_the_foot_of_its_back():
    """Where seat and back meet, heights pass through all between them; the cushion's edge touches the back there."""
    line = np.arange(-0.5, 0.5, STEP) + STEP / 2
    height, size = np.full((len(line), len(line)), 0.42), np.array([0.5, 0.48, 0.18])
    height[:, :5], height[:, 5] = 0.8, 0.485
    seat = Seat(line, line, height, 0.42)
    spot = at_back(seat, 0.0, size)
    assert spot[2] < -0.25  # against the back
    assert spot[1] == pytest.approx(0.43)


@pytest.mark.parametrize(("rise", "hangs"), [(0.0, True), (0.05, True), (0.14, False)])
def test_a_throw_hangs_over_an_arm_that_is_level(rise, hangs):
    """The walls of a tub chair rise to its back and are round in plan: a throw over them reaches into both sides."""
    line = np.arange(-0.4, 0.4, STEP) + STEP / 2
    height = np.full((len(line), len(line)), 0.4)
    arms = np.abs(line) > 0.27
    height[arms] = 0.75 - rise * line / 0.5  # over half a metre
    box = np.array(list(itertools.product((-0.4, 0.4), (0.0, 0.42), (-0.4, 0.4))))
    for side in (-1.0, 1.0):
        for seed in range(4):
            found = over_arm(seat_of(box), Seat(line, line, height, 0.4), side, np.random.default_rng(seed))
            assert (found is not None) == hangs


@pytest.mark.parametrize("variant", [228333841, *range(30)])  # the first had tassels, which were its lowest
def test_a_cushion_that_leans_stands_on_its_foot(variant):
    size, _ = usual("cushion", np.random.default_rng(variant))
    if variant > 30:
        size = np.array([0.5137, 0.4937, 0.1778])
    made = geometry_of("cushion", tuple(np.add(size, (0, 0, LEAN * size[1])).tolist()), variant)
    corners = np.concatenate([collider.mesh.vertices for collider in made.colliders])
    foot = corners[corners[:, 1] < corners[:, 1].min() + 0.005]
    assert foot[:, 2].min() + 0.005 < made.mass.centre[2] < foot[:, 2].max() - 0.005


@pytest.mark.parametrize("variant", range(4))
def test_corners_of_a_cushion_that_leans_reach_into_no_curved_back(variant):
    size = np.array([0.44, 0.42, 0.17 + LEAN * 0.42])
    body = geometry_of("cushion", tuple(size.tolist()), variant).colliders[0].mesh.vertices
    floor = np.array([(x, y, z) for x in (-0.4, 0.4) for y in (0.2, 0.42) for z in (-0.4, 0.4)])
    wall = floor * (0.6, 3.0, 0.05) + (0.0, -0.2, -0.25)
    backs = [wall @ upright(turn) for turn in np.radians((-64, 64))]
    host = seat_of(floor, *backs)
    spot = standing_on(host, np.array([0.0, 0.43, 0.0]), 0.1, size, body)
    assert spot[1] == pytest.approx(0.42)
    stood = body @ upright(-0.1) + spot + (0.0, 0.002, 0.0)
    assert depth(forbidden_moves([stood], [floor, *backs], 0.1), np.zeros(2)) < 0.001


@pytest.mark.parametrize("lean", [0.0, 0.3])
@pytest.mark.parametrize("turn", [0.0, 0.2])
def test_a_cushion_finds_how_a_back_leans_and_bends(lean, turn):
    """A flat back, and two that meet in a corner as the walls of a tub do."""
    size, foot = np.array([0.44, 0.42, 0.17]), np.array([0.0, 0.42, 0.0])
    wall = np.array([(x, y, z) for x in (-0.35, 0.35) for y in (0.0, 1.0) for z in (-0.5, -0.25)])
    wall[:, 2] -= lean * (wall[:, 1] - 0.42)
    aside, back, bend = behind(seat_of(wall), foot, turn, size)
    assert aside == pytest.approx(np.tan(turn), abs=0.01)
    assert back == pytest.approx(lean / np.cos(turn), abs=0.01)
    assert abs(bend) < 0.01
    walls = [wall @ upright(side) for side in (-0.5, 0.5)]
    assert behind(seat_of(*walls), foot, 0.0, size)[2] > 0.03


@pytest.mark.parametrize("variant", range(4))
def test_a_bent_cushion_reaches_forward_at_its_sides(variant):
    made = [geometry_of("cushion", (0.44, 0.42, 0.17 + bend), variant, (0.04, bend)) for bend in (0.0, 0.06)]
    straight, bent = (each.parts[0].mesh.vertices for each in made)
    sides, middle = np.abs(straight[:, 0]) > 0.17, np.abs(straight[:, 0]) < 0.05
    ahead = (bent - straight)[:, 2]
    assert ahead[sides].mean() - ahead[middle].mean() == pytest.approx(0.06, abs=0.015)


@pytest.mark.parametrize("seed", [106, 108])
def test_no_bed_comes_through_its_throw(seed):
    made = dressed(generate(SceneGraph.from_yaml("room: bedroom\nobjects: {bed: double_bed}"), seed=seed))
    bed, throw = made.objects["bed"], next(thing for thing in made.placed if thing.kind == "throw")
    mesh = geometry_of("throw", tuple(throw.size.tolist()), throw.variant, throw.lie).parts[0].mesh
    x, z = (np.arange(0.1 - half, half - 0.1, 0.02) for half in bed.size[[0, 2]] / 2)
    at = bed.in_plan(throw.position)
    cloth = heights_of(mesh.triangles + np.insert(at, 1, throw.position[1] - bed.position[1]), x, z)
    below = heights_of(bed.geometry.mesh.triangles, x, z)
    assert np.nanmax(np.where(np.isfinite(cloth), below - cloth, -1)) < 0.004
