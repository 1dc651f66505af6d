"""The coarse table of a room's light, by place and side; light thrown at ceilings; coloured glass, leaves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from box_room import LAMP, box_room, level_sheet, with_sheet
from pxr import Usd, UsdGeom, UsdSemantics

from echousd.draw import tracing
from echousd.draw.indoors import Bounced
from echousd.draw.rays import Seen, World, embree
from echousd.draw.scenery import read_scenery
from echousd.draw.views import View, view_matrix

TABLE = Bounced.dark(np.zeros(3), np.array([4.0, 3.0, 2.0]))


def rows(*ways: tuple[float, float, float], origin: tuple[float, float, float] = (2.0, 1.5, 1.0)) -> np.ndarray:
    """Rows of surfaces that rays from the middle meet head on after 0.9 m."""
    way = np.array(ways, float)
    return TABLE.rows(np.array([origin] * len(way)).T, way.T, np.full(len(way), 0.9), np.abs(way).argmax(1))


def test_each_of_the_six_sides_of_a_place_has_a_row_of_its_own():
    axes = np.concatenate([s * np.eye(3) for s in (-1, 1)])
    place = TABLE.rows(np.full((3, 6), 1.1) - 0.05 * axes.T, axes.T, np.full(6, 0.1), np.tile(range(3), 2))
    assert len(set(place.tolist())) == 6
    assert len(set((place // 6).tolist())) == 1
    ways = np.array([(0, -1, 0), (0, 1, 0)]).T
    above, below = TABLE.rows(np.full((3, 2), 1.2), ways, np.full(2, 0.1), np.full(2, 1))
    assert above != below  # of a sheet the side counts that the ray comes from


def test_a_place_is_as_bright_as_what_was_found_there_and_others_as_their_side():
    far = rows((1, 0, 0), (1, 0, 0), (1, 0, 0), (0, 1, 0))
    far[1] = rows((1, 0, 0), origin=(0.2, 1.5, 1.0))[0]
    light = np.array([(1.0, 0.5, 0.0), (0.2, 0.2, 0.2), (3.0, 0.5, 0.0), (9.0, 9.0, 9.0)])
    lit = TABLE.lit(far, light.T).radiance.T
    np.testing.assert_allclose(lit[far[0]], [2.0, 0.5, 0.0], rtol=1e-6)
    np.testing.assert_allclose(lit[far[1]], 0.2, rtol=1e-6)
    unknown = rows((1, 0, 0), origin=(2.0, 0.2, 0.2))
    assert unknown[0] not in far
    np.testing.assert_allclose(lit[unknown[0]], light[:3].mean(0), rtol=1e-6)


def test_places_outside_of_a_room_are_those_at_its_border():
    assert np.isfinite(TABLE.radiance[:, rows((1, 0, 0), origin=(50.0, -9.0, 3.0))]).all()


def test_light_is_thrown_at_the_ceiling_and_at_nothing_below_it(monkeypatch):
    scenery, down = box_room(sky=0.0, **LAMP)
    up = replace(down, matrix=view_matrix(np.array([0.0, 0.2, 0.0]), np.array([0.0, 3.0, 0.01])))
    pictures = []
    for share in (0.0, tracing.THROWN):
        monkeypatch.setattr(tracing, "THROWN", np.float32(share))
        monkeypatch.setattr(tracing, "exposure", lambda *_: lambda color: color / 20)
        pictures.append([tracing.trace(scenery, view, 64, rays=2).mean() for view in (down, up)])
    (floor, dark), (same, bright) = pictures
    assert same == floor
    assert 1.02 < bright / dark < 1.6


def test_coloured_glass_shows_its_colour_and_clear_glass_what_is_behind_it():
    bare, down = box_room(sky=1.0, **LAMP)
    clear, blue = (
        with_sheet(bare, level_sheet(0.8, 0.8, 1.0), thin=np.ones(2), flat_colors=np.tile(color, (2, 1)))
        for color in ((0.9, 0.9, 0.9), (0.05, 0.2, 0.6))
    )
    red, same = (
        [tracing.trace(one, down, 32, rays=2)[8:12, 14:18, c].mean() for one in (bare, clear, blue)] for c in (0, 2)
    )
    assert abs(red[1] - red[0]) < 0.1
    assert red[2] / same[2] < 0.93 * red[1] / same[1]


@pytest.mark.parametrize(("category", "share"), [("floor_plant", 0.2), ("plant", 0.2), ("curtain", 0.22), ("box", 0.0)])
def test_light_comes_through_leaves_and_cloth_and_nothing_else(category, share):
    stage = Usd.Stage.CreateInMemory()
    mesh = UsdGeom.Mesh.Define(stage, "/Leaf")
    mesh.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (0, 1, 0)])
    mesh.CreateFaceVertexCountsAttr([3])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2])
    UsdSemantics.LabelsAPI.Apply(mesh.GetPrim(), "category").CreateLabelsAttr([category])
    assert read_scenery(stage).thin == pytest.approx(share)


def test_the_rougher_a_floor_the_softer_it_mirrors_the_edge_of_a_window():
    scenery, _ = box_room(sky=1.0, sun=None)
    keep = ~(scenery.triangles[..., 0] > 1.9).all(1)  # the wall, of which a half is put back
    names = ("triangles", "normals", "flat_colors", "emissive", "gloss", "thin", "st", "texture", "wall")
    scenery = replace(scenery, **{name: getattr(scenery, name)[keep] for name in names})
    scenery = with_sheet(scenery, np.array([(2, 0, -2), (2, 0, 0), (2, 3, 0), (2, 3, -2)]))
    view = View(view_matrix(np.array([-1.9, 0.6, 0.0]), np.array([0.0, 0.0, 0.0])), 0.9, False, inside=True)
    floor, z, none = int((scenery.triangles[..., 1] < 0.1).all(1).argmax()), np.linspace(-1, 1, 201), np.zeros(201)
    point, up = np.stack([none - 1, none + 0.002, z]).astype("f4"), np.array([[0], [1], [0]]) + none
    seen = Seen(np.full(201, floor), point, up.astype("f4"), np.zeros((2, 201), "f4"), 0 * point, none)
    wide = []
    for gloss in (0.28, 0.42):
        shiny = replace(scenery, gloss=np.full_like(scenery.gloss, gloss))
        world = World(embree(scenery.triangles), shiny, view, 48, np.zeros(4), Bounced.dark(*scenery.bounds), none[:3])
        squares = np.random.default_rng(0).random((300, 2, 1), np.float32)
        found = np.mean([tracing._mirrored(world, seen, np.broadcast_to(one, (2, 201))) for one in squares], 0)
        wide.append(((found > 0.2 * found.max()) & (found < 0.8 * found.max())).mean() * 2)
    assert wide[0] > 0.18 > 3 * wide[1]


def test_the_sun_has_soft_borders_inside_the_further_what_stands_in_its_way():
    up = np.array([(0.0, 1.0, 0.0), (1.0, 1.0, 1.0)], np.float32)
    pane, x = np.array([[(1.99, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.8, 0.0)]], np.float32), np.linspace(-0.1, 0.1, 201)
    point, normal = np.stack([x, 0 * x + 0.01, 0 * x]), np.stack([0 * x, 0 * x + 1, 0 * x])
    spots, wide = np.random.default_rng(0).random((400, 2, 1), np.float32), []
    for high in (0.5, 2.0):
        scenery, down = box_room(sky=0.0, sun=up)
        scenery = with_sheet(
            replace(scenery, panes=pane), np.array([(0, high, -1), (0, high, 1), (2, high, 1), (2, high, -1)])
        )
        shown = ~(scenery.triangles[..., 1] > 2.9).all(1)
        world = World(embree(scenery.triangles[shown]), scenery, down, 48, np.zeros(4), TABLE, np.ones(3, np.float32))
        shares = np.mean(
            [tracing._sunny(world, point.astype("f4"), normal, np.broadcast_to(one, (2, 201))) for one in spots], 0
        )
        wide.append(((shares > 0.05) & (shares < 0.95)).mean() * 0.2)
    assert 0.005 < wide[0] < 0.02 < wide[1] < 0.07
