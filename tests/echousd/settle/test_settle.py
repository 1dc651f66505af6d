"""Rooms are simulated: what rests, what does not, and why."""

import json
import sys

import numpy as np
import pytest
import shapely
import trimesh
from pxr import Gf, Usd, UsdGeom, UsdPhysics
from small_room import BARE, StandIn, small_graph

import echousd
from echousd.options import RoomOptions
from echousd.settle.settle import SettleUnavailable, convex_parts, read_world, settle

simulated = pytest.mark.skipif("not __import__('importlib.util').util.find_spec('mujoco')", reason="extra sim")


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    room = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False, **BARE)
    return room.save(tmp_path_factory.mktemp("rooms") / "bedroom", preview=False)


def moved(stage, name, by):
    place = stage.GetPrimAtPath(f"/Room/Objects/{name}").GetAttribute("xformOp:translate")
    place.Set(place.Get() + Gf.Vec3d(*by))
    return {motion.name: motion for motion in settle(stage).motions}


@simulated
@pytest.mark.parametrize(
    "options",
    [
        RoomOptions(walls=False, dress="none"),
        RoomOptions(walls=True, dress="none"),
        RoomOptions(up_axis="Z", walls=False, dress="none"),
    ],
)
def test_a_room_that_stands_rests(options, tmp_path):
    room = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False, options=options)
    report = settle(room.save(tmp_path / "bedroom", preview=False))
    assert report.ok, report.restless
    assert {motion.name for motion in report.motions} == set(room.names) - {"pendant"}
    assert 0 < max(motion.shift for motion in report.motions) < 0.002  # it was simulated: weight makes things yield


@simulated
def test_what_stands_on_nothing_falls(root):
    motions = moved(Usd.Stage.Open(str(root)), "lamp", (0, 0, 0.8))
    assert motions["lamp"].shift > 0.4
    assert motions["lamp"].why.startswith("falls 0.")
    assert motions["bed"].rests


@simulated
def test_what_stands_in_something_is_named_with_the_depth(root):
    wardrobe = moved(Usd.Stage.Open(str(root)), "wardrobe", (0, -0.04, 0))["wardrobe"]
    assert not wardrobe.rests
    assert wardrobe.why == "stands 40 mm deep in Floor"


@simulated
def test_what_stands_over_the_edge_of_the_floor_topples(root):
    wardrobe = moved(Usd.Stage.Open(str(root)), "wardrobe", (-0.8, 0, 0))["wardrobe"]
    assert not wardrobe.rests
    assert wardrobe.why.split()[0] in ("topples", "falls")


@simulated
def test_the_command_says_what_does_not_rest(root, tmp_path, echousd_command):
    said = echousd_command("check", str(root), "--settle", "--json")
    assert json.loads(said.out)["settle"] == [{"layout": "", "seconds": 2.0, "pieces": 5, "restless": []}]
    over = Usd.Stage.CreateNew(str(tmp_path / "over.usda"))
    over.GetRootLayer().subLayerPaths = [str(root)]
    over.GetPrimAtPath("/Room/Objects/lamp").GetAttribute("xformOp:translate").Set(Gf.Vec3d(0, 1.8, 1.2))
    over.GetRootLayer().Save()
    said = echousd_command("check", str(tmp_path / "over.usda"), "--settle")
    assert said.code == 1
    assert "4 of 5 pieces rest for 2 s" in said.out
    assert "lamp moves" in said.out


def test_the_missing_extra_is_named(root, monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(SettleUnavailable, match=r"MuJoCo is not installed: pip install 'echousd\[sim\]'"):
        settle(root)


def test_nothing_to_simulate_is_an_error():
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.Xform.Define(stage, "/Room")
    with pytest.raises(ValueError, match="no rigid body with a collider, nothing to simulate"):
        settle(stage)


def test_the_world_is_in_metres_and_leaves_out_what_is_switched_off():
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    UsdGeom.SetStageUpAxis(stage, "Z")
    for name, at in (("one", 0.0), ("two", 300.0), ("off", 600.0)):
        body = UsdGeom.Xform.Define(stage, f"/{name}")
        body.AddTranslateOp().Set(Gf.Vec3d(at, 0, 0))
        UsdPhysics.RigidBodyAPI.Apply(body.GetPrim())
        cube = UsdGeom.Cube.Define(stage, f"/{name}/cube")
        cube.CreateSizeAttr(20.0)
        UsdPhysics.CollisionAPI.Apply(cube.GetPrim())
    UsdPhysics.CollisionAPI(stage.GetPrimAtPath("/off/cube")).CreateCollisionEnabledAttr(False)
    weighed = UsdPhysics.MassAPI.Apply(stage.GetPrimAtPath("/two"))
    weighed.CreateMassAttr(8.0)
    weighed.CreateCenterOfMassAttr(Gf.Vec3f(0, 0, -5))
    weighed.CreateDiagonalInertiaAttr(Gf.Vec3f(100, 200, 300))
    weighed.CreatePrincipalAxesAttr(Gf.Quatf(1))
    world = read_world(stage)
    assert [body.name for body in world.bodies] == ["one", "two"]
    np.testing.assert_allclose(world.bodies[1].place[:3, 3], (3, 0, 0))
    points = world.bodies[1].solids[0].points
    np.testing.assert_allclose([points.min(0), points.max(0)], [(2.9, -0.1, -0.1), (3.1, 0.1, 0.1)], atol=1e-6)
    mass = world.bodies[1].mass
    assert world.bodies[0].mass is None
    assert mass.mass == 8.0
    np.testing.assert_allclose([mass.centre, mass.inertia], [(0, 0, -0.05), (0.01, 0.02, 0.03)], atol=1e-7)
    np.testing.assert_allclose(mass.axes, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(world.gravity, (0, 0, -9.81), atol=1e-3)


def test_no_piece_of_a_board_comes_out_behind_it():
    board = trimesh.creation.box((2.0, 0.08, 0.012))
    (whole,) = convex_parts(board)
    assert len(whole) == 8
    frame = trimesh.creation.extrude_polygon(shapely.box(0, 0, 2, 1).difference(shapely.box(0.5, 0.2, 1, 0.8)), 0.012)
    pieces = np.concatenate(list(convex_parts(frame)))
    assert pieces[:, 2].min() >= -1e-6
    assert pieces[:, 2].max() <= 0.012 + 1e-6
