"""Masses, inertia and colliders of single pieces."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from pxr import Usd, UsdGeom, UsdPhysics
from solid_boxes import box_mesh

from echomodel.dressing import KINDS
from echomodel.dressing import thing as solids_of
from echomodel.furniture.solids import Joint, Solid
from echomodel.triangles import Mesh
from echomodel.vocabulary import vocabulary
from echousd.graph.nodes import OBSTACLE
from echousd.layers.assets import coarse_layer, component_layer, geometry_layer
from echousd.layers.compose import _forms
from echousd.layers.physics import CONTACT, WOODEN, collides, movable, write_asset_physics
from echousd.shapes.colliders import collider, colliders_of
from echousd.shapes.geometry import Collider, Geometry, Mass, Origin, Part
from echousd.shapes.hulls import convex_hull, hull_volume, standing_hull
from echousd.shapes.joinery import level, part_of, within_budget
from echousd.shapes.matter import ballasted, mass_of, read_mass
from echousd.shapes.sources.whole import solid_geometry
from echousd.stage.pen import Pen

SIZE = np.array([1.6, 2.2, 0.6])


def tensor(mass: Mass) -> np.ndarray:
    return mass.axes @ np.diag(mass.inertia) @ mass.axes.T


@pytest.mark.parametrize(
    ("word", "moves"),
    [("chair", True), ("table_lamp", True), ("pendant_lamp", False), ("vase", True), ("books", True),
     ("picture", False), ("curtain", False), (OBSTACLE, False)],
)  # fmt: skip
def test_what_stands_is_a_body_and_what_hangs_or_is_built_in_is_none(word, moves):
    assert movable(word) is moves
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.Xform.Define(stage, "/it")
    if word != OBSTACLE:
        block = solid_geometry(box_mesh((0.3, 0.2, 0.1)), "chair", Origin("boxes"))
        geometry = replace(block, mass=mass_of(block, "chair"))
        write_asset_physics(Pen(stage.GetRootLayer()), "it", word, geometry, ["wood"])
        assert stage.GetPrimAtPath("/it").HasAPI(UsdPhysics.RigidBodyAPI) == moves


def test_a_piece_has_few_faces_where_that_is_asked_for(tmp_path):
    fine, few = (Mesh.of(trimesh.creation.icosphere(subdivisions=count, radius=0.3)) for count in (3, 1))
    parts = [(Part("mesh", mesh, {"wood": np.arange(len(mesh.faces))}),) for mesh in (fine, few)]
    hull = Collider("collider", few, "convexHull")
    geometry = replace(solid_geometry(box_mesh(SIZE), "chair", Origin("boxes")), parts=parts[0], coarse=parts[1],
                       colliders=(hull,))  # fmt: skip
    forms = [_forms("ball", each) for each in parts]
    payload = geometry_layer("ball", forms[0], geometry, {})
    for name, layer in (("ball", component_layer("ball", "chair", fine.bounds, geometry, {})),
                        ("ball_geo", payload), ("ball_low", coarse_layer("ball", forms[1], {}))):  # fmt: skip
        layer.Export(str(tmp_path / f"{name}.{'usda' if name == 'ball' else 'usdc'}"))
    stage = Usd.Stage.Open(str(tmp_path / "ball.usda"))
    levels = stage.GetDefaultPrim().GetVariantSet("LOD")
    assert (levels.GetVariantNames(), levels.GetVariantSelection()) == (["high", "low", "proxy"], "high")
    seen = {}
    for detail in levels.GetVariantNames():
        levels.SetVariantSelection(detail)
        shown = [
            prim for prim in stage.Traverse()
            if prim.IsA(UsdGeom.Mesh) and UsdGeom.Imageable(prim).ComputeVisibility() != "invisible"
            and UsdGeom.Imageable(prim).ComputePurpose() == "default"
        ]  # fmt: skip
        seen[detail] = [(prim.GetName(), len(UsdGeom.Mesh(prim).GetFaceVertexCountsAttr().Get())) for prim in shown]
    assert seen == {"high": [("ball_mesh", 1280)], "low": [("ball_mesh", 80)], "proxy": [("ball_collider", 80)]}


def test_mass_of_a_box_is_that_of_the_textbook():
    mass = mass_of(solid_geometry(box_mesh(SIZE), "wardrobe", Origin("boxes")), "wardrobe")
    x, y, z = SIZE
    assert mass.mass == pytest.approx(x * y * z * vocabulary().category("wardrobe").density, abs=0.01)
    np.testing.assert_allclose(mass.centre, (0, y / 2, 0), atol=1e-6)
    wanted = mass.mass / 12 * np.array([y * y + z * z, x * x + z * z, x * x + y * y])
    np.testing.assert_allclose(tensor(mass), np.diag(wanted), atol=1e-6 * wanted.max())


@pytest.mark.parametrize("seed", range(5))
def test_written_masses_are_read_back(seed):
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]  # half of these are reflections
    told = Mass(7.25, rng.normal(size=3), np.sort(rng.random(3)) + 1.0, turn)
    mesh = Mesh.of(box_mesh(SIZE))
    part = Part("mesh", mesh, {"wood": np.arange(len(mesh.faces))})
    geometry = Geometry((part,), (Collider("collider", mesh, "convexHull"),), Origin("boxes"), mass=told)
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.Xform.Define(stage, "/chair")
    write_asset_physics(Pen(stage.GetRootLayer()), "chair", "chair", geometry, ["fabric"])
    found = read_mass(stage.GetPrimAtPath("/chair"))
    assert found.mass == pytest.approx(7.25)
    np.testing.assert_allclose(found.centre, told.centre, atol=1e-4)
    np.testing.assert_allclose(tensor(found), tensor(told), atol=1e-4)


@pytest.mark.parametrize("joints", [(), (Joint("door", "revolute", (0, 1, 0), (0.8, 0, 0.3), 1.5),)])
def test_a_piece_with_joints_weighs_as_a_whole_only_where_it_stands_still(joints):
    geometry = replace(solid_geometry(box_mesh(SIZE), "wardrobe", Origin("boxes")), joints=joints)
    stage = Usd.Stage.CreateInMemory()
    prim = UsdGeom.Xform.Define(stage, "/wardrobe").GetPrim()
    write_asset_physics(Pen(stage.GetRootLayer()), "wardrobe", "wardrobe", geometry, ["wood"])
    articulation, weighs = prim.GetVariantSet("articulation"), {}
    for name in articulation.GetVariantNames() or [""]:
        articulation.SetVariantSelection(name)
        weighs[name] = read_mass(prim) is not None
    assert weighs == ({"articulated": False, "static": True} if joints else {"": True})


def test_a_prim_without_a_whole_mass_has_none():
    stage = Usd.Stage.CreateInMemory()
    assert read_mass(UsdGeom.Xform.Define(stage, "/chair").GetPrim()) is None


@pytest.mark.parametrize("category", ["wardrobe", "chair"])
def test_colliders_stand_on_planes_that_end_where_the_mesh_does(category):
    mesh = trimesh.creation.icosphere(4, 0.5)
    mesh.vertices *= (1.0, 2.0, 0.7)
    light = collider(Mesh.of(mesh), category).mesh
    np.testing.assert_allclose(light.bounds, mesh.bounds, atol=1e-6)
    for height in light.bounds[:, 1]:
        assert (np.abs(light.vertices[:, 1] - height) < 1e-9).sum() >= 3


@pytest.mark.parametrize("number", range(6))
@pytest.mark.parametrize("kind", ["cup", "candles", "pens"])
def test_hulls_of_small_things_are_closed_as_they_are_written(kind, number):
    size = (0.06, 0.12, 0.06)
    solids = solids_of(kind, size, np.random.default_rng(number))
    hull = standing_hull(part_of("mesh", within_budget(solids, size, KINDS[kind].faces)).mesh).mesh
    _, corners = np.unique(hull.vertices.round(6), axis=0, return_inverse=True)
    written = trimesh.Trimesh(hull.vertices.round(6), hull.faces, process=True)
    assert len(written.vertices) == len(hull.vertices) == corners.max() + 1
    assert written.is_watertight
    assert written.is_winding_consistent
    assert written.area_faces.min() > 1e-12


def test_the_hull_of_what_is_thin_is_as_thick_as_it() -> None:
    book = trimesh.creation.box((0.015, 0.185, 0.121))
    assert standing_hull(Mesh.of(book)).mesh.trimesh.volume == pytest.approx(book.volume, rel=0.01)


def test_a_rounded_foot_has_a_corner_for_each_of_its_own():
    """An engine takes four corners of a base, which shall not be two and two that are next to each other."""
    turn = np.linspace(0, np.pi / 2, 5)
    arc = 0.008 * np.stack([np.cos(turn), np.sin(turn)], 1) + (0.292, 0.092)
    outline = np.concatenate([arc * sign for sign in ((1, 1), (-1, 1), (-1, -1), (1, -1))])
    points = np.concatenate([np.insert(outline, 1, height, axis=1) for height in (0.0, 0.5)])
    made = standing_hull(convex_hull(points)).mesh.vertices
    base = made[made[:, 1] == 0.0][:, [0, 2]]
    assert len(base) == 4
    np.testing.assert_allclose(np.abs(base), [(0.3, 0.1)] * 4, atol=0.009)


def test_what_gives_way_stands_on_more_of_it():
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.2)
    ball.apply_translation((0, 0.2, 0))
    wide = [np.ptp(of[of[:, 1] < 1e-9][:, 0]) for of in (
        standing_hull(Mesh.of(ball), gives).mesh.vertices for gives in (0.012, 0.035))]  # fmt: skip
    assert wide[0] == pytest.approx(2 * np.sqrt(0.2**2 - 0.188**2), abs=0.03)
    assert wide[1] == pytest.approx(2 * np.sqrt(0.2**2 - 0.165**2), abs=0.03)


@pytest.mark.parametrize(
    ("role", "material", "top"), [("seat", "fabric", 0.405), ("seat", "wood", 0.42), ("cover", "linen", 0.405)]
)
def test_soft_seats_and_covers_are_level_for_what_lies_on_them(role, material, top):
    corners = np.array([(x, y, z) for x in (-0.3, 0.3) for z in (-0.3, 0.3) for y in (0.2, 0.4)] + [(0, 0.42, 0)])
    found = level(Solid(role=role, material=material), corners)
    assert found[:, 1].max() == pytest.approx(top)
    assert (found[:, 1] > top - 1e-9).sum() == (5 if role == "cover" else 1)
    assert found[:, 1].min() == 0.2


def test_a_convex_piece_as_thin_as_a_table_top_keeps_its_thickness(monkeypatch):
    top, legs = trimesh.creation.box((1.2, 0.01, 0.8)), trimesh.creation.box((0.1, 0.74, 0.1))
    top.apply_translation((0, 0.745, 0))
    legs.apply_translation((0, 0.37, 0))
    monkeypatch.setattr("echousd.shapes.colliders.find_spec", lambda name: name)
    monkeypatch.setattr("echousd.shapes.colliders.convex_pieces", lambda mesh: [Mesh.of(top), Mesh.of(legs)])
    plate, post = colliders_of(Mesh.of(trimesh.util.concatenate([top, legs])), "dining_table")
    np.testing.assert_allclose(plate.mesh.bounds[:, 1], (0.74, 0.75), atol=1e-4)
    np.testing.assert_allclose(post.mesh.bounds[0, 1], 0.0, atol=1e-4)


def test_what_would_topple_has_ballast_in_its_base():
    foot, arm = trimesh.creation.box((0.3, 0.02, 0.3)), trimesh.creation.box((1.0, 0.02, 0.02))
    foot.apply_translation((0, 0.01, 0))
    arm.apply_translation((0.5, 1.8, 0))
    solids = [foot.vertices, arm.vertices]
    light = Mass(4.0, np.array([0.4, 1.2, 0.0]), np.array([0.1, 0.2, 0.3]), np.eye(3))
    found = ballasted(light, solids)
    assert found.centre[0] == pytest.approx(0.75 * 0.15)
    assert found.mass * found.centre[0] == pytest.approx(4.0 * 0.4)  # what is added stands in the middle
    added = found.mass - 4.0
    level = np.diag([0.1, 0.2, 0.3]) + 4.0 * added / found.mass * sum(
        float(r @ r) * np.eye(3) - np.outer(r, r) for r in [np.array([0.4, 1.2, 0.0])]
    )
    np.testing.assert_allclose(tensor(found), level, atol=1e-9)
    assert ballasted(found, solids) is found
    steady = Mass(4.0, np.array([0.05, 0.3, 0.0]), light.inertia, light.axes)
    assert ballasted(steady, solids) is steady


def test_what_is_hollow_collides_by_convex_pieces():
    pytest.importorskip("coacd")
    legs = [trimesh.creation.box((0.05, 0.7, 0.05)) for _ in range(4)]
    for leg, (x, z) in zip(legs, ((-0.4, -0.3), (0.4, -0.3), (-0.4, 0.3), (0.4, 0.3)), strict=True):
        leg.apply_translation((x, 0.35, z))
    top = trimesh.creation.box((0.9, 0.05, 0.7))
    top.apply_translation((0, 0.71, 0))
    table = trimesh.boolean.union([top, *legs], engine="manifold")
    found = colliders_of(Mesh.of(table), "dining_table")
    assert len(found) >= 5
    assert {piece.approximation for piece in found} == {"convexHull"}
    assert len({piece.name for piece in found}) == len(found)
    assert all(piece.mesh.trimesh.is_convex and piece.mesh.trimesh.is_watertight for piece in found)
    corners = np.concatenate([piece.mesh.vertices for piece in found])
    np.testing.assert_allclose([corners.min(0), corners.max(0)], table.bounds, atol=1e-6)
    assert sum(piece.mesh.trimesh.volume for piece in found) == pytest.approx(
        table.volume, rel=0.3
    )  # its hull: ten times
    again = colliders_of(Mesh.of(table), "dining_table")
    assert all((a.mesh.vertices == b.mesh.vertices).all() for a, b in zip(found, again, strict=True))
    assert [piece.name for piece in colliders_of(Mesh.of(top), "dining_table")] == ["collider"]


@pytest.mark.parametrize("material", [*CONTACT, "wood"])
def test_what_slides_is_held_less_than_what_rests_and_nothing_sticks(material):
    static, dynamic, bounce = CONTACT.get(material, WOODEN)
    assert 0.3 <= dynamic < static <= 1
    assert 0 <= bounce < 0.5


def test_volume_of_a_hull():
    points = np.random.default_rng(3).normal(size=(40, 3))
    assert hull_volume(points) == pytest.approx(trimesh.convex.convex_hull(points).volume)
    assert hull_volume(points * [1, 0, 1]) == 0.0
    assert np.ptp(convex_hull(points[[0, 0, 0, 0]]).vertices, axis=0) == pytest.approx(1e-4)


def test_a_hull_that_is_kept_keeps_nothing_of_manifold3d():
    """It tells of leaks at the end of a program where anything still views its meshes."""
    hull = convex_hull(np.random.default_rng(3).normal(size=(40, 3)))
    assert hull.vertices.base is None
    assert hull.faces.base is None


def test_no_hull_loses_corners_in_newton():
    """Newton keeps 64 corners of a hull where nobody says otherwise: a bed was 12 cm lower there."""
    stage = Usd.Stage.CreateInMemory()
    for name, form in (("turns", "convexHull"), ("stays", "none")):
        UsdGeom.Mesh.Define(stage, f"/{name}")
        collides(Pen(stage.GetRootLayer()), f"/{name}", form)
    turns, stays = (stage.GetPrimAtPath(path) for path in ("/turns", "/stays"))
    assert turns.GetAttribute("newton:maxHullVertices").Get() == -1
    assert "NewtonMeshCollisionAPI" in turns.GetPrimTypeInfo().GetAppliedAPISchemas()
    assert not stays.HasAttribute("newton:maxHullVertices")
