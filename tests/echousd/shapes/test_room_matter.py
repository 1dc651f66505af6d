"""Solids weigh what real furniture does: walls, tubes and fillings; centres and moments of hollow things."""

import numpy as np
import pytest
import trimesh

from echomodel.furniture import sample_size, solids
from echomodel.furniture.solids import MeshedSolid, Solid, pieces_of
from echomodel.furniture.style import WIDTH, piece_of
from echomodel.vocabulary import vocabulary
from echousd.shapes.matter import MATTER, PARTS, weighed

ROWS = vocabulary().categories
PIECES = 12  # of each category; some of those draws are larger than anything that placing leaves in a room


def piece(mesh: trimesh.Trimesh, material: str = "wood", role: str = "") -> MeshedSolid:
    return MeshedSolid(Solid(material=material, role=role), np.asarray(mesh.vertices), np.asarray(mesh.faces), None)


def tensor(mass):
    return mass.axes @ np.diag(mass.inertia) @ mass.axes.T


def test_a_board_is_massive_and_a_block_is_hollow():
    board = weighed([piece(trimesh.creation.box((1.0, 0.018, 0.5)))])
    assert board.mass == pytest.approx(1.0 * 0.018 * 0.5 * 620.0)
    block = weighed([piece(trimesh.creation.box((1.0, 0.4, 0.5)))])
    assert block.mass == pytest.approx(620.0 * 0.010 * 2 * (0.4 + 0.5 + 0.2))


@pytest.mark.parametrize("material", ["fruit", "metal", "fabric"])
def test_centres_and_moments_are_those_of_the_textbook(material):
    x, y, z = 0.6, 0.8, 1.0
    mesh = trimesh.creation.box((x, y, z))
    mesh.apply_transform(trimesh.transformations.rotation_matrix(0.4, (1, 2, 3)))
    mesh.apply_translation((0.3, 2.0, -1.0))
    mass = weighed([piece(mesh, material)])
    matter, volume, area = MATTER[material], x * y * z, 2 * (x * y + y * z + z * x)
    walls = min(volume, area * matter.wall)
    assert mass.mass == pytest.approx(matter.density * walls + matter.core * (volume - walls))
    np.testing.assert_allclose(mass.centre, (0.3, 2.0, -1.0), atol=1e-9)

    def solid(u, v):
        return volume * (u * u + v * v) / 12

    def hollow(u, v, w):  # moments of six plates about the axis across u and v
        sides = 2 * (v * w) * (u * u / 4 + v * v / 12) + 2 * (u * w) * (v * v / 4 + u * u / 12)
        return sides + 2 * (u * v) * (u * u + v * v) / 12

    massive = walls == volume
    wall = matter.density * walls / (volume if massive else area)
    inside = matter.core * (volume - walls) / volume
    wanted = [
        (wall * solid(u, v) if massive else wall * hollow(u, v, w)) + inside * solid(u, v)
        for u, v, w in ((y, z, x), (x, z, y), (x, y, z))
    ]
    np.testing.assert_allclose(np.sort(mass.inertia), np.sort(wanted), rtol=1e-9)
    turn = trimesh.transformations.rotation_matrix(0.4, (1, 2, 3))[:3, :3]
    np.testing.assert_allclose(tensor(mass), turn @ np.diag(wanted) @ turn.T, atol=1e-9)


def test_two_solids_together_weigh_as_one():
    whole = trimesh.creation.box((1.0, 0.012, 0.4))
    halves = [trimesh.creation.box((0.5, 0.012, 0.4)) for _ in range(2)]
    for sign, half in zip((-1, 1), halves, strict=True):
        half.apply_translation((0.25 * sign, 0, 0))
    one, two = weighed([piece(whole)]), weighed([piece(half) for half in halves])
    assert two.mass == pytest.approx(one.mass)
    np.testing.assert_allclose(two.centre, one.centre, atol=1e-12)
    np.testing.assert_allclose(tensor(two), tensor(one), atol=1e-9)


def test_roles_tell_what_materials_do_not():
    pot = trimesh.creation.cylinder(0.2, 0.4)
    vase, planted = weighed([piece(pot, "ceramic")]), weighed([piece(pot, "ceramic", "pot")])
    assert planted.mass > vase.mass + 10
    assert {material for _, material in PARTS} <= set(MATTER)


@pytest.mark.parametrize("row", ROWS, ids=[row.name for row in ROWS])
def test_no_piece_is_lighter_or_heavier_than_real_ones(row):
    rng = np.random.default_rng(len(row.name))
    low, high = row.kg
    assert 0 < low < high
    outside = []
    for _ in range(PIECES):
        style, choices = piece_of(rng.uniform(-1, 1, WIDTH))
        size = sample_size(row.name, rng, style)
        mass = weighed(pieces_of(solids(row.name, style, choices, size), size, 1)).mass
        assert 0.6 * low < mass < 1.5 * high
        if not low <= mass <= high:
            outside.append(mass)
    assert len(outside) <= 1, (low, high, outside)


def test_a_television_of_55_inches_weighs_about_16_kg():
    style, choices = piece_of(np.zeros(WIDTH))
    size = np.array([1.23, 0.75, 0.2])
    assert 11 < weighed(pieces_of(solids("tv", style, choices, size), size, 1)).mass < 22
