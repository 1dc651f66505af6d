"""Species of plants: each fills the box that it is asked for, and looks like no other."""

import numpy as np
import pytest

from echomodel.furniture import draw_choices, draw_style, solids
from echomodel.furniture.bent import Blade
from echomodel.furniture.plants import SPECIES, grown, species
from echomodel.furniture.solids import pieces_of

BOXES = {"floor": (np.array([0.5, 1.1, 0.5]), 0.25, 0.15), "table": (np.array([0.24, 0.27, 0.24]), 0.09, 0.06)}


@pytest.mark.parametrize("name", SPECIES)
def test_a_species_fills_its_box(name):
    for where in SPECIES[name]["where"]:
        size, soil, pot = BOXES[where]
        for seed in range(3):
            parts = grown(name, soil, size, pot, np.random.default_rng(seed))
            points = np.concatenate([part.mesh()[0] for part in parts])
            assert points[:, 1].max() == pytest.approx(size[1], rel=0.1)
            assert np.ptp(points, axis=0)[[0, 2]] == pytest.approx(size[[0, 2]], rel=0.45)


def test_there_are_a_dozen_for_floors_and_eight_for_tables():
    assert len(species("floor")) >= 12
    assert len(species("table")) >= 8


def test_plants_of_the_furniture_are_of_many_species():
    size, seen = np.array([0.5, 1.1, 0.5]), set()
    for seed in range(60):
        rng = np.random.default_rng(seed)
        parts = solids("plant", draw_style(rng), draw_choices(rng), size)
        if seed < 20:  # the rest are looked at for their leaves
            pieces = pieces_of(parts, size)
            assert np.ptp(np.concatenate([piece.vertices for piece in pieces]), axis=0).max() < 1.2
        leaves = [part for part in parts if part.role == "leaf"]
        seen.add((leaves[0].material, round(leaves[0].width / leaves[0].length, 3)))
    assert len(seen) >= 10


@pytest.mark.parametrize("name", SPECIES)
def test_leaves_that_rise_are_younger_and_lighter(name):
    size, soil, pot = BOXES[SPECIES[name]["where"][0]]
    leaves = [part for part in grown(name, soil, size, pot, np.random.default_rng(1)) if isinstance(part, Blade)]
    row, rise = SPECIES[name], {leaf.material: [] for leaf in leaves}
    for leaf in leaves:
        rise[leaf.material].append(leaf.turn[1, 2])
    assert set(rise) == {row["leaf"], row["young"]}
    assert min(rise[row["young"]]) >= max(rise[row["leaf"]])
