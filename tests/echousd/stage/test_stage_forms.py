"""Solids, instancers and subdivision surfaces are seen by pictures, glb and check as what they are."""

import numpy as np
import pytest
import trimesh
from pxr import Gf, Usd, UsdGeom
from small_room import BARE, StandIn, small_graph

import echousd
from echousd.draw.drawables import read_drawables
from echousd.stage.contents import read_contents, shape_of
from echousd.stage.encoding import StageError
from echousd.stage.forms import SkippedForms, polygons
from echousd.stage.read import find_rooms
from echousd.stage.showing import each_layout, showing_variant
from echousd.stage.subdivision import refined, solid


def empty():
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, "Y")
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    return stage


def drawn(stage):
    """All triangles in the world, as one mesh."""
    parts = [(d.triangles @ d.world[:3, :3].T + d.world[:3, 3]).reshape(-1, 3) for d in read_drawables(stage)]
    points = np.concatenate(parts)
    return trimesh.Trimesh(points, np.arange(len(points)).reshape(-1, 3), process=True)


@pytest.mark.parametrize(
    ("kind", "values", "volume", "extent"),
    [
        ("Cube", {"size": 2.0}, 8.0, (2, 2, 2)),
        ("Sphere", {"radius": 1.0}, 4.19, (2, 2, 2)),
        ("Cylinder", {"radius": 1.0, "height": 3.0, "axis": "Y"}, 9.42, (2, 3, 2)),
        ("Cone", {"radius": 1.0, "height": 3.0, "axis": "X"}, 3.14, (3, 2, 2)),
        ("Capsule", {"radius": 0.5, "height": 1.0, "axis": "Z"}, 1.309, (1, 1, 2)),
    ],
)
def test_solids_are_drawn_as_they_are(kind, values, volume, extent):
    stage = empty()
    prim = getattr(UsdGeom, kind).Define(stage, "/Thing").GetPrim()
    for name, value in values.items():
        prim.GetAttribute(name).Set(value)
    mesh = drawn(stage)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(volume, rel=0.04)
    np.testing.assert_allclose(mesh.extents, extent, rtol=0.02)
    np.testing.assert_allclose(mesh.bounds.mean(0), 0, atol=0.01)


@pytest.mark.parametrize(("lean", "size"), [(0.0, (1.0, 2.0, 3.0)), (-90.0, (1.0, 3.0, 2.0))])
def test_a_piece_looks_where_its_front_does_and_where_its_width_says_if_that_looks_up(lean, size):
    stage = empty()
    thing = UsdGeom.Xform.Define(stage, "/Room/thing")
    thing.AddRotateYOp().Set(30.0)
    thing.AddRotateXOp().Set(lean)
    UsdGeom.Xformable(UsdGeom.Cube.Define(stage, "/Room/thing/box")).AddScaleOp().Set((0.5, 1.0, 1.5))
    shape = shape_of(thing.GetPrim(), UsdGeom.XformCache(), np.eye(4))
    assert np.degrees(shape.yaw) == pytest.approx(30.0)
    np.testing.assert_allclose(shape.size, size, atol=1e-6)
    np.testing.assert_allclose(shape.position, (0.0, -size[1] / 2, 0.0), atol=1e-6)


def test_layouts_are_shown_one_after_the_other_and_an_only_one_has_no_name():
    stage = empty()
    room = UsdGeom.Xform.Define(stage, "/Room").GetPrim()
    assert list(each_layout(stage)) == list(each_layout(stage, 0)) == [""]
    variants = room.GetVariantSets().AddVariantSet("layout")
    for number in (0, 2, 10):
        variants.AddVariant(f"layout_{number}")
    variants.SetVariantSelection("layout_2")
    shown = [(name, variants.GetVariantSelection()) for name in each_layout(stage)]
    assert shown == [(f"layout_{number}",) * 2 for number in (0, 2, 10)]
    assert list(each_layout(stage, 10)) == ["layout_10"]
    with pytest.raises(StageError, match="no layout 7, allowed: layout_0, layout_2, layout_10"):
        list(each_layout(stage, 7))
    assert variants.GetVariantSelection() == "layout_2"


def test_a_variant_is_shown_for_a_while_and_whether_another_was_seen_is_said():
    stage = empty()
    sets = []
    for name in ("a", "b"):
        times = UsdGeom.Xform.Define(stage, f"/{name}").GetPrim().GetVariantSets().AddVariantSet("light")
        for word in ("day", "night"):
            times.AddVariant(word)
        times.SetVariantSelection("day")
        sets.append(times)
    with showing_variant(stage, "light", "day") as other:
        assert other is False
    with showing_variant(stage, "light", "night") as other:
        assert other is True
        assert [times.GetVariantSelection() for times in sets] == ["night"] * 2
    assert [times.GetVariantSelection() for times in sets] == ["day"] * 2
    with showing_variant(stage, "season", "summer") as other:
        assert other is False


def test_layouts_of_a_room_deep_in_a_stage_are_found():
    stage = empty()
    variants = stage.DefinePrim("/World/Flat/Living", "Xform").GetVariantSets().AddVariantSet("layout")
    for name in ("layout_0", "layout_1"):
        variants.AddVariant(name)
    assert list(each_layout(stage)) == ["layout_0", "layout_1"]


def test_cone_points_along_its_axis():
    stage = empty()
    UsdGeom.Cone.Define(stage, "/Thing").CreateAxisAttr("Y")
    points = drawn(stage).vertices
    (tip,) = points[points[:, 1] > 0.99]
    np.testing.assert_allclose(tip, (0, 1, 0), atol=1e-6)


def cube(stage, path, scheme):
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32))
    mesh.CreateFaceVertexCountsAttr([4] * 6)
    mesh.CreateFaceVertexIndicesAttr(np.ravel(quads).tolist())
    if scheme:
        mesh.CreateSubdivisionSchemeAttr(scheme)
    return mesh


def test_subdivision_surfaces_are_round_and_others_keep_their_edges():
    for scheme, extent in (("catmullClark", 1.7), ("none", 2.0), ("", 2.0)):
        stage = empty()
        prim = cube(stage, "/Thing", scheme).GetPrim()
        mesh = drawn(stage)
        assert mesh.is_watertight
        assert mesh.extents[0] == pytest.approx(extent, abs=0.1), scheme
        assert len(polygons(prim).counts) == (96 if scheme == "catmullClark" else 6)


def test_one_level_of_a_cube_has_the_points_of_catmull_and_clark():
    stage = empty()
    mesh = cube(stage, "/Thing", "catmullClark")
    faces = np.array(mesh.GetFaceVertexCountsAttr().Get()), np.array(mesh.GetFaceVertexIndicesAttr().Get())
    points, counts, _, face = refined(np.array(mesh.GetPointsAttr().Get(), float), *faces, 1)
    found = {tuple(sorted(np.abs(point).round(6).tolist())) for point in points}
    assert found == {(round(5 / 9, 6),) * 3, (0.0, 0.75, 0.75), (0.0, 0.0, 1.0)}  # of corners, edges and faces
    assert len(points) == 8 + 12 + 6
    assert counts.tolist() == [4] * 24
    assert np.bincount(face).tolist() == [4] * 6


def test_borders_are_splines_and_corners_of_three_pieces_stay():
    square = np.array([(0.0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    points, *_ = refined(square, np.array([4]), np.arange(4), 1)
    assert points[0].tolist() == [0.125, 0.125, 0]  # (two halves of edges, 0.5 each, and twice itself) / 4
    assert points[2].tolist() == [0.875, 0.875, 0]
    assert sorted(points[4:8].tolist()) == [[0, 0.5, 0], [0.5, 0, 0], [0.5, 1, 0], [1, 0.5, 0]]
    assert points[8].tolist() == [0.5, 0.5, 0]
    lone = np.concatenate([square, [(5.0, 5, 5)]])  # a point of no face
    assert refined(lone, np.array([4]), np.arange(4), 1)[0][4].tolist() == [5, 5, 5]


@pytest.mark.parametrize(
    ("kind", "said", "extents"),
    [
        ("Cube", {}, (2, 2, 2)), ("Cube", {"size": 0.5}, (0.5, 0.5, 0.5)),
        ("Sphere", {}, (2, 2, 2)), ("Sphere", {"radius": 0.3}, (0.6, 0.6, 0.6)),
        ("Cylinder", {}, (2, 2, 2)), ("Cylinder", {"radius": 0.2, "height": 3.0, "axis": "X"}, (3, 0.4, 0.4)),
        ("Cone", {"radius": 0.5, "height": 2.0, "axis": "Y"}, (1, 2, 1)),
        ("Capsule", {}, (1, 1, 2)), ("Capsule", {"radius": 0.1, "height": 1.0}, (0.2, 0.2, 1.2)),
        ("Plane", {"width": 3.0, "length": 0.5}, (3, 0.5, 0)),
        ("Plane", {"width": 3.0, "length": 0.5, "axis": "Y"}, (3, 0, 0.5)),
        ("Plane", {"width": 3.0, "length": 0.5, "axis": "X"}, (0, 0.5, 3)),
    ],
)  # fmt: skip
def test_solids_have_the_size_that_usd_gives_them(kind, said, extents):
    stage = Usd.Stage.CreateInMemory()
    prim = stage.DefinePrim("/Thing", kind)
    for name, value in said.items():
        prim.GetAttribute(name).Set(value)
    box = UsdGeom.BBoxCache(0, ["default"]).ComputeLocalBound(prim).ComputeAlignedRange()
    np.testing.assert_allclose(solid(prim).bounds, [box.GetMin(), box.GetMax()], atol=0.01)
    np.testing.assert_allclose(solid(prim).extents, extents, atol=0.01)


def test_catmull_clark_on_a_flat_sheet_keeps_it_flat_and_its_border():
    grid = np.array([(x, 0.0, z) for z in range(4) for x in range(4)])
    quads = [(i, i + 1, i + 5, i + 4) for r in range(3) for i in range(4 * r, 4 * r + 3)]
    points, counts, indices, face = refined(grid, np.full(9, 4), np.ravel(quads), 2)
    np.testing.assert_allclose(points[:, 1], 0)
    assert len(counts) == 9 * 16
    assert np.bincount(face).tolist() == [16] * 9
    assert np.ptp(points[indices, 0]) == pytest.approx(3.0, abs=0.2)


def test_instancers_place_their_prototypes():
    stage = empty()
    instancer = UsdGeom.PointInstancer.Define(stage, "/Many")
    UsdGeom.Cube.Define(stage, "/Many/Prototypes/Small").CreateSizeAttr(0.5)
    instancer.CreatePrototypesRel().SetTargets(["/Many/Prototypes/Small"])
    instancer.CreateProtoIndicesAttr([0, 0, 0])
    instancer.CreatePositionsAttr([Gf.Vec3f(0, 0, 0), Gf.Vec3f(2, 0, 0), Gf.Vec3f(4, 0, 0)])
    instancer.InvisId(1, Usd.TimeCode.Default())
    assert len(list(read_drawables(stage))) == 2
    np.testing.assert_allclose(drawn(stage).extents, (4.5, 0.5, 0.5))
    instancer.GetProtoIndicesAttr().Set([0, 1, 0])
    with pytest.raises(ValueError, match="</Many>: protoIndices reach from 0 to 1, allowed: 0 to 0"):
        list(read_drawables(stage))


def test_what_has_no_polygons_is_named():
    stage = empty()
    UsdGeom.Cube.Define(stage, "/Cube")
    UsdGeom.BasisCurves.Define(stage, "/Cable")
    with pytest.warns(SkippedForms, match="left out, as they have no polygons: 1 BasisCurves .such as </Cable>"):
        assert len(list(read_drawables(stage))) == 1


def test_check_measures_solids_in_the_place_of_meshes(tmp_path):
    echousd.write_graph(small_graph(), tmp_path / "graph.usda")
    stage = Usd.Stage.Open(str(tmp_path / "graph.usda"))
    ball = UsdGeom.Sphere.Define(stage, "/Room/Objects/wardrobe/Ball")
    ball.CreateRadiusAttr(0.5)
    ball.AddTranslateOp().Set((1.0, 0.5, 2.0))
    (room,) = (read_contents(prims) for prims in find_rooms(stage))
    (thing,) = room.objects
    np.testing.assert_allclose(thing.size, (1, 1, 1), atol=0.02)
    np.testing.assert_allclose(thing.position, (1, 0, 2), atol=0.02)
    assert len(thing.faces) > 100  # no box


def test_rooms_of_ours_look_as_before(tmp_path):
    room = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False, **BARE)
    names = [d.path for d in read_drawables(room.stage)]
    assert "/Room/Objects/bed/geo/bed_mesh" in names
    assert len(names) == len(set(names))
