"""Levels of furniture that carry small things."""

import warnings

import numpy as np
import pytest
import shapely
import trimesh

from echomodel.dressing import KINDS
from echomodel.furniture import draw_choices, draw_style, solids
from echomodel.furniture.carpentry import box
from echousd.dressing.setting import geometry_of, standing
from echousd.dressing.tabletops import surfaces
from echousd.shapes.geometry import Collider, Geometry, Origin, Part
from echousd.shapes.joinery import assembled


def test_levels_of_a_shelf_have_air_and_what_stands_there_is_left_alone():
    size = np.array([1.0, 1.9, 0.35])
    rng = np.random.default_rng(5)
    parts = solids("bookshelf", draw_style(rng), draw_choices(rng), size)
    host = standing(
        "shelf", "bookshelf", size, np.zeros(3), 0.0, assembled(parts, size, faces=5000, origin=Origin("x"))
    )
    levels = surfaces(host)
    assert len(levels) >= 3
    for level in levels:
        assert level.air >= 0.06
        assert shapely.box(-0.51, -0.18, 0.51, 0.18).contains(level.area)


def test_a_round_top_is_one_level_without_cracks():
    """Its triangles meet in its middle: brought to a grid they stood apart, and nothing found room there."""
    mesh = trimesh.creation.cylinder(0.375, 0.03, sections=27)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (1, 0, 0)))
    mesh.apply_scale((0.84, 1.0, 1.0))
    mesh.apply_translation((-0.12251, 0.0, 0.00004))
    part = Part("mesh", mesh, {"wood": np.arange(len(mesh.faces))})
    made = Geometry((part,), (Collider("collider", mesh, "convexHull"),), Origin("parts"))
    top = surfaces(standing("table", "coffee_table", np.array([0.75, 0.03, 0.75]), np.zeros(3), 0.0, made))[0]
    assert top.area.geom_type == "Polygon"
    assert top.area.contains(shapely.box(-0.22, -0.1, -0.02, 0.1))


@pytest.mark.parametrize(("thick", "front", "closed"), [(0.02, False, False), (0.09, False, False), (0.02, True, True)])
def test_a_thick_board_above_closes_no_shelf_and_a_front_does(thick, front, closed):
    size = np.array([0.8, 0.6, 0.4])
    parts = [box((-0.4, 0, -0.2), (0.4, 0.02, 0.2), "wood"), box((-0.4, 0.6 - thick, -0.2), (0.4, 0.6, 0.2), "wood")]
    parts += [box((x, 0, -0.2), (x + 0.02, 0.6, 0.2), "wood") for x in (-0.4, 0.38)]
    parts += [box((-0.36, 0.1, 0.19), (0.36, 0.5, 0.2), "wood")] * front
    host = standing("shelf", "bookshelf", size, np.zeros(3), 0.0, assembled(parts, size, faces=500, origin=Origin("x")))
    level = min((one for one in surfaces(host) if one.area.area > 0.1), key=lambda one: one.y)
    assert level.closed == closed
    assert level.air == pytest.approx(0.58 - max(thick, 0.04), abs=0.006)


@pytest.mark.parametrize("kind", ["pot_plant", "small_plant"])
def test_plants_keep_all_their_leaves_and_nobody_is_warned(kind):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for variant in range(12):
            assert geometry_of(kind, KINDS[kind].high, variant).parts
