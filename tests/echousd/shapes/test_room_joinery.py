"""Geometry from solids: closed and in its box, within the budget, with colliders, weight and bodies that move."""

import importlib.util
import warnings
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull
from shapely.geometry import MultiPoint, Point

from echomodel import dressing
from echomodel.data.shapeset import piece as styled
from echomodel.furniture import solids
from echomodel.furniture.bent import bent
from echomodel.furniture.carpentry import box as solid_box
from echomodel.furniture.cloth import cover
from echomodel.furniture.pads import Pad
from echomodel.furniture.style import WIDTH, piece_of
from echomodel.triangles import Mesh, box
from echomodel.vocabulary import vocabulary
from echousd.shapes import joinery
from echousd.shapes.colliders import collider as light_collider
from echousd.shapes.geometry import FRAME, Origin
from echousd.shapes.joinery import COLLIDERS, SLACK, assembled, convex_pieces, covering, level, within_budget

SIZE = np.array([0.9, 1.0, 0.45])
STANDING = {"lazy_sofa": 6, "shelf": 6}  # styles: bags on a point and shelves that lean on nothing are among them
BENCHMARK = Path(__file__).parents[3] / "benchmarks" / "parts_cost.py"


def piece(category: str, size: np.ndarray = SIZE, seed: int = 0, faces: int = 5000):
    parts = solids(category, *piece_of(np.random.default_rng(seed).uniform(-1, 1, WIDTH)), size)
    return assembled(parts, size, faces=faces, origin=Origin("parts"))


def test_colliders_of_mirrored_models_are_not_inside_out():
    seat = trimesh.creation.box((1.0, 0.8, 0.6))
    for faces in (seat.faces, seat.faces[:, ::-1]):
        made = light_collider(Mesh(np.asarray(seat.vertices), np.asarray(faces)), "sofa").mesh.trimesh
        assert made.volume == pytest.approx(0.48)


@pytest.mark.parametrize("category", ["dresser", "plant", "multi_seat_sofa", "bookshelf", "tv", "pendant_lamp"])
def test_a_piece_is_closed_fills_its_box_and_keeps_the_budget(category):
    for faces in (5000, 800, 100):
        made = piece(category, faces=faces)
        assert all(
            part.mesh.trimesh.is_watertight for part in made.parts
        )  # each solid: boards that touch share no vertices
        assert 0 < made.faces <= faces
        np.testing.assert_allclose(made.mesh.trimesh.extents, SIZE, atol=1e-6)
        assert sorted(np.concatenate(list(made.parts[0].slots.values()))) == list(range(len(made.parts[0].mesh.faces)))


def test_more_faces_are_finer_and_the_second_level_is_coarser():
    parts = solids("armchair", *piece_of(np.zeros(WIDTH)), SIZE)
    counts = [sum(len(p.faces) for p in within_budget(parts, SIZE, faces)) for faces in (400, 1500, 9000)]
    assert counts == sorted(counts)
    assert counts[0] < counts[-1]
    made = piece("armchair")
    assert sum(len(part.mesh.faces) for part in made.coarse) < made.faces
    assert [part.name for part in made.coarse] == [part.name for part in made.parts]
    assert all(set(one.slots) == set(two.slots) for one, two in zip(made.coarse, made.parts, strict=True))


def test_solids_that_the_budget_has_no_room_for_are_told_of():
    parts = solids("armchair", *piece_of(np.zeros(WIDTH)), SIZE)
    with pytest.warns(UserWarning, match=r"^100 faces are too few: \d+ small solids are left out$"):
        assert sum(len(p.faces) for p in within_budget(parts, SIZE, 100)) <= 100
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        within_budget(parts, SIZE, 9000)


@pytest.mark.parametrize("wide", [0.6, 2.4, 3.6])
def test_a_wide_window_has_the_cloth_of_its_blind(wide):
    size, made = np.array([wide, 0.4, 0.016]), dressing.KINDS["roman_blind"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        within_budget(dressing.thing("roman_blind", size, np.random.default_rng(0)), size, made.faces)


@pytest.mark.parametrize("category", [row.name for row in vocabulary().categories if row.support in ("floor", "table")])
def test_what_stands_stands_flat(category):
    for style in range(STANDING.get(category, 2)):
        _, size, parts = styled(5, style, category)
        made = assembled(parts, size, faces=1500, origin=Origin("parts"), round=vocabulary().category(category).round)
        corners = np.concatenate([collider.mesh.vertices for collider in made.colliders])
        feet = MultiPoint(corners[corners[:, 1] < corners[:, 1].min() + 0.004][:, [0, 2]]).convex_hull
        assert feet.contains(Point(made.mass.centre[[0, 2]])), (category, style)


def test_colliders_are_convex_and_hold_the_geometry():
    for category in ("dining_table", "bookshelf", "office_chair"):
        made = piece(category)
        for collider in made.colliders:
            assert collider.approximation == "convexHull"
            hull = collider.mesh.trimesh.convex_hull
            assert abs(hull.volume - collider.mesh.trimesh.volume) <= 1e-6 + 1e-3 * hull.volume
        low = np.min([c.mesh.bounds[0] for c in made.colliders], axis=0)
        high = np.max([c.mesh.bounds[1] for c in made.colliders], axis=0)
        np.testing.assert_allclose(high - low, SIZE, atol=0.03)
    table = piece("dining_table", np.array([1.6, 0.75, 0.9]))
    assert len(table.colliders) > 2  # a chair fits below


@pytest.mark.parametrize(
    "category", ["coffee_table", "round_end_table", "dining_chair", "sofa", "bathtub", "lazy_sofa"]
)
def test_no_mesh_reaches_out_of_its_colliders(category):
    for style in range(4):  # round tops are among them
        _, size, parts = styled(5, style, category)
        made = assembled(parts, size, faces=2500, origin=Origin("parts"), round=vocabulary().category(category).round)
        planes = [ConvexHull(collider.mesh.vertices).equations for collider in made.colliders]
        for part in made.parts:  # but a seat, which gives way under what lies on it
            beyond = [(part.mesh.vertices @ each[:, :3].T + each[:, 3]).max(1) for each in planes]
            gives = Pad().gives[0] if part.name == "seat" and "fabric" in part.slots else 0.0
            assert np.min(beyond, axis=0).max() <= SLACK + gives + 1e-9, (category, style)


def test_what_lies_on_a_cover_neither_hovers_over_its_folds_nor_sinks_out_of_sight():
    for seed in range(4):
        cloth = cover((-0.8, 0.4, -1.0), (0.8, 0.62, 1.0), "linen", 0.1, 0.045, np.random.default_rng(seed))
        corners, _ = cloth.mesh()
        top = level(cloth, corners)[:, 1].max()
        inner = corners[(np.abs(corners[:, 0]) < 0.6) & (np.abs(corners[:, 2]) < 0.8) & (corners[:, 1] > 0.5), 1]
        assert np.quantile(np.abs(inner - top), 0.95) < 0.024, seed
        assert inner.max() > top + 0.01, seed


@pytest.mark.parametrize("seed", [7, 9])
def test_a_body_of_many_solids_has_no_more_hulls_than_it_may_and_free_shelves(seed):
    size = np.array([0.9, 1.9, 0.3])
    parts = solids("bookshelf", *piece_of(np.random.default_rng(seed).uniform(-1, 1, WIDTH)), size)
    apart = [solid.vertices for solid in within_budget(parts, size, 5000)]
    assert len(apart) > COLLIDERS
    joined = convex_pieces(apart, float(size.prod()))
    assert len(joined) <= COLLIDERS
    # what books and boards take; where they were joined across a compartment, things stood inside
    alone = sum(trimesh.convex.convex_hull(points).volume for points in apart)
    assert sum(hull.trimesh.volume for hull in joined) < 1.1 * alone


def test_drawers_are_bodies_of_a_dresser():
    made = next(m for m in (piece("dresser", seed=seed) for seed in range(5)) if m.joints)
    bodies = {part.body for part in made.parts}
    assert bodies == {FRAME} | {joint.body for joint in made.joints} == set(made.masses)
    assert {collider.body for collider in made.colliders} == bodies
    assert made.mass is not None
    assert sum(mass.mass for mass in made.masses.values()) == pytest.approx(made.mass.mass, rel=1e-6)
    assert 5 < made.mass.mass < 150
    assert (made.mass.inertia > 0).all()
    assert (np.abs(made.mass.centre[[0, 2]]) < SIZE[[0, 2]] / 2).all()


def test_what_needs_more_boxes_than_the_budget_leaves_the_smallest_out():
    made = piece("bookshelf", np.array([2.0, 2.2, 0.35]), faces=100)
    assert made.faces <= 100
    np.testing.assert_allclose(made.mesh.trimesh.extents, [2.0, 2.2, 0.35], atol=1e-6)


SIZES = [(0.01, 0.01, 0.01), (40.0, 2.2, 0.6), (5.0, 0.01, 5.0), (0.3, 10.0, 0.3), (1.0, 1.0, 0.001)]
KINDS = ["wardrobe", "bookshelf", "floor_lamp", "plant", "kids_bed", "office_chair"]


@pytest.mark.parametrize(("size", "category"), [*zip(SIZES, KINDS, strict=False), *zip(SIZES, KINDS[1:], strict=True)])
def test_boxes_of_any_size_are_filled(category, size):
    made = piece(category, np.array(size))
    assert 0 < made.faces <= 5000
    assert made.watertight
    np.testing.assert_allclose(made.mesh.trimesh.extents, size, atol=1e-6)
    assert all(np.isfinite(collider.mesh.vertices).all() for collider in made.colliders)


def test_sizes_that_are_none_are_refused():
    for size in ((0.0, 1.0, 1.0), (float("nan"), 1.0, 1.0), (-1.0, 1.0, 1.0)):
        with pytest.raises(ValueError, match=r"size of chair is \[.*\], need three positive numbers in metres"):
            piece("chair", np.array(size))


def test_an_asset_has_joints_and_levels_of_detail_in_variants(tmp_path):
    from pxr import Usd, UsdGeom, UsdPhysics

    import echousd
    from echousd.checks.mesh_rules import extents
    from echousd.checks.reading import Reading, applied
    from echousd.graph import Node, RoomSpec, SceneGraph

    graph = SceneGraph(RoomSpec("bedroom", size=(4.0, 4.0)), (Node("chest", "dresser", size=(0.9, 1.0, 0.45)),), ())
    room = echousd.generate(graph, seed=1)
    assert room.provenance.shapes == "parts"
    stage = Usd.Stage.Open(str(room.save(tmp_path / "bedroom", preview=False)))
    chest = stage.GetPrimAtPath("/Room/Objects/chest")
    assert chest.HasAPI(UsdPhysics.RigidBodyAPI)
    assert not [prim for prim in Usd.PrimRange(chest) if prim.IsA(UsdPhysics.Joint)]

    def faces() -> int:
        meshes = (UsdGeom.Mesh(prim) for prim in Usd.PrimRange(chest) if prim.IsA(UsdGeom.Mesh))
        return sum(len(mesh.GetFaceVertexCountsAttr().Get()) for mesh in meshes)

    fine = faces()
    chest.GetVariantSet("LOD").SetVariantSelection("low")
    assert faces() < fine
    chest.GetVariantSet("articulation").SetVariantSelection("articulated")
    assert not chest.HasAPI(UsdPhysics.RigidBodyAPI)
    joints = [UsdPhysics.Joint(prim) for prim in Usd.PrimRange(chest) if prim.IsA(UsdPhysics.Joint)]
    assert len(joints) >= 2
    for joint in joints:
        ends = [rel.GetTargets()[0] for rel in (joint.GetBody0Rel(), joint.GetBody1Rel())]
        assert all(stage.GetPrimAtPath(end).HasAPI(UsdPhysics.RigidBodyAPI) for end in ends)
        assert str(ends[0]).endswith("_frame")
        slide = UsdPhysics.PrismaticJoint(joint)
        assert 0 == slide.GetLowerLimitAttr().Get() < slide.GetUpperLimitAttr().Get() < 0.45
        # what leans a little stays shut, and a hand opens it
        weight = 9.81 * UsdPhysics.MassAPI(stage.GetPrimAtPath(ends[1])).GetMassAttr().Get()
        friction = slide.GetPrim().GetAttribute("newton:friction").Get()
        assert 0.02 * weight < friction < 0.1 * weight
        assert UsdPhysics.DriveAPI(slide, "linear").GetMaxForceAttr().Get() == friction
        assert "NewtonJointAPI" in applied(slide.GetPrim())
    drawer = UsdGeom.Xformable(stage.GetPrimAtPath(joints[0].GetBody1Rel().GetTargets()[0]))
    drawer.AddTranslateOp().Set((0.0, 0.0, 0.4))
    for state in ("articulated", "static"):  # pulled out, it is as good
        chest.GetVariantSet("articulation").SetVariantSelection(state)
        assert [str(found.path) for found in extents(Reading(stage))] == []


def test_the_benchmark_weighs_what_a_room_writes(tmp_path):
    import echousd
    from echousd.graph import Node, RoomSpec, SceneGraph

    graph = SceneGraph(RoomSpec("bedroom", size=(4.0, 4.0)), (Node("one", "dresser", size=(0.9, 1.0, 0.45)),), ())
    room = echousd.generate(graph, seed=1)
    spec = importlib.util.spec_from_file_location("parts_cost", BENCHMARK)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    (name,) = room.asset_users
    weighed = module.on_disk(room.geometry["one"], "dresser")
    files = room.save(tmp_path / "room", preview=False).parent.glob(f"assets/{name}/*")
    assert weighed == pytest.approx(sum(path.stat().st_size for path in files), rel=0.05)


def test_nothing_collides_above_the_free_half_of_a_dressing_table():
    """What stands at the rear of a top does not raise the hull of all of it: small things would stand in that."""
    size = np.array([1.1, 1.3, 0.45])
    places = np.array([(x, 3.0, z) for x in (-0.3, 0.0, 0.3) for z in (0.02, 0.12)])
    for seed in (*range(8), 23, 79):  # the last two have a panel at the rear, of drawers and of cupboards
        made = piece("dressing_table", size, seed)
        met = []
        for meshes in ([made.mesh], [collider.mesh for collider in made.colliders]):
            points = [mesh.trimesh.ray.intersects_location(places, np.full((6, 3), [0, -1.0, 0]))[0] for mesh in meshes]
            met.append(max(found[:, 1].max() for found in points if len(found)))
        assert met[1] - met[0] < 0.002, seed


def test_nothing_collides_over_the_seat_within_a_bent_wall():
    """One hull of the wall would fill a tub chair: nobody could sit in it, and no cushion would lie there."""
    wall = bent((0, 0.1, 0.3), (0.4, 0.7), 0.1, 0.7, 0.5)
    made = assembled([wall, solid_box((-0.3, 0.1, -0.3), (0.3, 0.4, 0.3))], SIZE, faces=2000, origin=Origin("parts"))
    inside = np.array([(x, 0.6, z) for x in (-0.15, 0.0, 0.15) for z in (-0.05, 0.05)])
    assert not any(collider.mesh.trimesh.contains(inside).any() for collider in made.colliders)


def test_a_corner_that_the_hull_does_not_take_is_asked_for_once(monkeypatch):
    plain = box((-0.5, 0.0, -0.5), (0.5, 1.0, 0.5)).vertices
    shown = np.concatenate([plain, [(0.0, 1.1, 0.0)]])
    assert covering(plain, shown).tolist() == shown.tolist()
    hull = joinery.hull_of(plain)
    monkeypatch.setattr(joinery, "hull_of", lambda points: hull)  # as of slivers, whose normals point anywhere
    assert covering(plain, shown).tolist() == shown.tolist()
