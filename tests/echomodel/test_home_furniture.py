"""Kitchens, bathrooms and what else a home has: closed, true to size, and what makes each what it is."""

from dataclasses import replace

import numpy as np
import pytest

from echomodel.furniture import draw_choices, draw_style, mesh_of, sample_size, solids
from echomodel.furniture.distances import distance
from echomodel.furniture.fronts import front
from echomodel.furniture.shades import shade
from echomodel.vocabulary import vocabulary

HOME = (
    "base_unit", "wall_unit", "tall_unit", "sink_unit", "hob_unit", "range_hood", "fridge", "dishwasher",
    "kitchen_island", "toilet", "washbasin", "shower", "bathtub", "mirror_cabinet", "towel_radiator",
    "washing_machine", "coat_rack",
    "shoe_cabinet", "radiator", "fireplace", "piano", "cot", "toy_box", "kids_table", "kids_chair", "garden_table",
    "garden_chair",
)  # fmt: skip
HAS = {
    "sink_unit": "tap", "hob_unit": "oven", "range_hood": "chimney", "fridge": "cold", "dishwasher": "door",
    "toilet": "lid", "washbasin": "basin", "shower": "tray", "bathtub": "tap", "mirror_cabinet": "door",
    "coat_rack": "shelf", "fireplace": "stone", "piano": "keys", "cot": "bar", "toy_box": "lid",
    "washing_machine": "door",
}  # fmt: skip


def drawn(name, seed):
    rng = np.random.default_rng([seed, 7])
    style = draw_style(rng)
    size = sample_size(name, rng, style)
    return solids(name, style, draw_choices(rng), size), size


@pytest.mark.parametrize("name", HOME)
def test_pieces_are_closed_and_as_large_as_they_say(name):
    roles = set()
    for seed in range(4):
        parts, size = drawn(name, seed)
        mesh = mesh_of(parts, size)
        assert mesh.is_watertight
        assert np.allclose(mesh.extents, size, atol=1e-6)
        corners = np.concatenate([part.mesh(1)[0] for part in parts if not part.core])
        assert np.all(np.abs(size / np.ptp(corners, axis=0) - 1) < 0.13), (seed, size)  # handles stand out
        roles |= {part.role for part in parts}
    if name in HAS and name != "fireplace":  # a stove has none
        assert HAS[name] in roles


def test_a_run_of_units_is_cut_to_its_length_and_level():
    rng = np.random.default_rng(0)
    style, choices = draw_style(rng), draw_choices(rng)
    for width in (0.6, 1.2, 2.4):
        parts = solids("base_unit", style, choices, np.array([width, 0.9, 0.6]))
        backs = [part for part in parts if part.role == "back"]
        assert len(backs) == round(width / 0.6)
    tops = {}
    for name, height in (("base_unit", 0.9), ("hob_unit", 0.9), ("dishwasher", 0.9), ("sink_unit", 1.17)):
        parts = solids(name, style, choices, np.array([0.6, height, 0.6]))
        slabs = [part.mesh(1)[0] for part in parts if part.role == "worktop"]
        tops[name] = max(float(slab[:, 1].max()) for slab in slabs)
    assert max(tops.values()) - min(tops.values()) < 1e-9  # one worktop, the tap above it


def test_basins_and_tubs_are_hollow():
    inside_of = {"sink_unit": (0.0, 0.85, 0.0), "bathtub": (0.0, 0.4, 0.0), "washbasin": (0.0, 0.85, 0.03)}
    for name, inside in inside_of.items():
        for seed in range(4):
            parts, _ = drawn(name, seed)
            at = np.array(inside)
            away = min(float(distance(part, *at, np.full(3, 0.01))) for part in parts if not part.core)
            assert away > 0, (name, seed)


def test_what_hangs_says_how_high():
    hung = {row.name: row.mounted for row in vocabulary().categories if row.mounted}
    assert set(hung) == {"wall_unit", "range_hood", "mirror_cabinet", "towel_radiator"}
    for name, low in hung.items():
        assert vocabulary().category(name).support == "wall"
        assert low + vocabulary().category(name).sizes[2][1] < 2.61  # below the ceiling


def test_the_doors_of_a_wardrobe_have_a_grip_where_lower_fronts_have_none():
    style = replace(draw_style(np.random.default_rng(0)), handles="none", fronts="flat")
    made = {h: front((0.0, 0.0), (0.5, h), 0.3, 1, 1, "door", style, 0.5) for h in (0.7, 2.0)}
    grips = {h: [part for part in parts if part.role == "handle"] for h, parts in made.items()}
    assert len(grips[0.7]) == 0
    assert len(grips[2.0]) == 1


@pytest.mark.parametrize(("tufting", "at_least", "at_most"), [(0.1, 10, 14), (0.42, 1, 1), (0.9, 5, 8)])
def test_doors_of_wardrobes_are_panelled_plain_or_boarded(tufting, at_least, at_most):
    style = replace(draw_style(np.random.default_rng(3)), fronts="flat", tufting=tufting)
    made = [part for part in front((0.0, 0.0), (0.6, 2.0), 0.3, 1, 1, "door", style) if part.role == "door"]
    assert at_least <= len(made) <= at_most
    deep = {round(float(part.mesh()[0][:, 2].max()), 3) for part in made}
    assert (len(deep) > 1) == (tufting != 0.42)  # light finds edges in them


def test_shades_have_bound_rims_that_do_not_glow():
    style = draw_style(np.random.default_rng(3))
    for kind, bound in (("drum", 2), ("cone", 2), ("dome", 0)):
        rims = [part for part in shade(kind, 0.0, 1.0, 0.0, 0.2, 0.15, 0.25, style) if part.material == "linen"]
        assert len(rims) == bound, kind
        assert all(np.ptp(part.mesh()[0][:, 1]) < 0.02 for part in rims)
