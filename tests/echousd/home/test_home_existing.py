"""Stages of several rooms: floors that stand side by side are a plan, a door between two of them is one door."""

import numpy as np
import pytest
from homes import QUICK, inline
from pxr import Gf, Sdf, Usd, UsdGeom
from small_room import BARE, StandIn, small_graph

import echousd
from echomodel.openings import Opening
from echousd.graph import Node, SceneGraph
from echousd.home.existing import plan_there
from echousd.home.files import load_home
from echousd.home.plan import INNER, OUTER, plan_home, ways
from echousd.stage.graphs import write_graph


@pytest.fixture(autouse=True)
def here(monkeypatch):
    inline(monkeypatch)


def stage_of(path, rooms):
    layer = Sdf.Layer.CreateNew(str(path))
    house = Sdf.CreatePrimInLayer(layer, "/House")
    house.specifier, house.typeName = Sdf.SpecifierDef, "Xform"
    for name, graph in rooms.items():
        write_graph(graph, layer, f"/House/{name}")
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, "Y")
    layer.Save()
    return stage


@pytest.fixture
def file(tmp_path):
    """Two bedrooms, the second one 6 m to the front and turned by a quarter."""
    stage = stage_of(tmp_path / "house.usda", {"West": small_graph(), "East": small_graph()})
    east = UsdGeom.Xformable(stage.GetPrimAtPath("/House/East"))
    east.AddTranslateOp().Set(Gf.Vec3d(6, 0, 0))
    east.AddRotateYOp().Set(90)
    stage.Save()
    return tmp_path / "house.usda"


def three(tmp_path, doors):
    """Three rooms whose floors meet, in one frame: A and B share x = 4, B and C share x = 8."""
    rooms = {}
    for number, name in enumerate("ABC"):
        low, high = 4.0 * number, 4.0 * number + 4
        spec = echousd.RoomSpec("bedroom", floor_polygon=((low, 0), (high, 0), (high, 3), (low, 3)))
        spec = spec.replaced(openings=doors.get(name, ()))
        rooms[name] = SceneGraph(spec, (Node("bed", "single_bed"),))
    stage_of(tmp_path / "row.usda", rooms)
    return plan_there(tmp_path / "row.usda", load_home(tmp_path / "row.usda"))


def test_floors_that_meet_stay_where_they_are(tmp_path):
    plan = three(tmp_path, {})
    assert [floor[:, 0].min() for floor in plan.floors.values()] == [0.0, 4.0 + INNER / 2, 8.0 + INNER / 2]
    assert plan.walls["B"] == (OUTER, INNER / 2, OUTER, INNER / 2)
    assert {frozenset(pair) for pair, _ in ways(plan)} == {frozenset("AB"), frozenset("BC")}


def test_a_door_between_two_rooms_is_one_door(tmp_path):
    opening = (Opening("door", "door", 1, 1.0, 0.9, 2.0),)
    plan = three(tmp_path, {"A": opening})
    ((pair, found),) = ways(plan)
    assert (pair, found.kind) == (("A", "B"), "door")
    (hole,) = plan.openings["B"]
    assert (hole.kind, hole.edge, hole.width) == ("passage", 3, 0.9)
    assert hole.offset == pytest.approx(3 - 1.9)
    both = three(tmp_path, {"A": opening, "B": (Opening("door", "door", 3, 1.1, 0.9, 2.0),)})
    assert [opening.kind for name in "AB" for opening in both.openings[name]] == ["door", "passage"]


def test_rooms_are_made_where_they_stand(file, tmp_path, echousd_command):
    done = echousd_command("generate", file, "-o", tmp_path / "out", *QUICK)
    assert done.code in (0, 1), done.err
    stage = Usd.Stage.Open(str(tmp_path / "out" / "home.usda"))
    east = UsdGeom.Xformable(stage.GetPrimAtPath("/House/Rooms/East")).ComputeLocalToWorldTransform(0)
    np.testing.assert_allclose(east.ExtractTranslation(), (6, 0, 0), atol=1e-6)
    assert east.TransformDir(Gf.Vec3d(1, 0, 0))[2] == pytest.approx(-1)
    done = echousd_command("edit", tmp_path / "out/home.usda", "--lock", "bed")
    assert done.code == 2
    assert "home.usda: a home, which composes rooms; name one of them: rooms/East/East.usda" in done.err


def test_rooms_in_one_place_get_a_plan(tmp_path):
    stage_of(tmp_path / "house.usda", {"West": small_graph(), "East": small_graph()})
    assert plan_there(tmp_path / "house.usda") is None
    plan = plan_home(load_home(tmp_path / "house.usda"))
    assert [pair for pair, _ in ways(plan)] in ([("West", "East")], [("East", "West")])


def test_a_floor_of_a_text_is_a_plan(tmp_path):
    (tmp_path / "row.yaml").write_text(
        "rooms:\n"
        "  hall: {type: hallway, floor_polygon: [[0, 0], [2, 0], [2, 4], [0, 4]]}\n"
        "  bedroom: {floor_polygon: [[2, 0], [6, 0], [6, 4], [2, 4]]}\n"
    )
    plan = plan_there(tmp_path / "row.yaml", load_home(tmp_path / "row.yaml"))
    assert plan.floors["bedroom"][:, 0].min() == 2 + INNER / 2


def test_one_of_them(file, tmp_path, echousd_command):
    done = echousd_command("generate", file, "-o", tmp_path / "north", "--room", "/House/North")
    assert done.code == 2
    assert "no room '/House/North', allowed: /House/West, /House/East" in done.err
    assert len(echousd.generate(file, room="/House/West", model=StandIn(), shapes="boxes", **BARE).names) == 6
    with pytest.raises(ValueError, match=r"2 rooms, say which one of /House/West, /House/East"):
        echousd.generate(file, model=StandIn(), shapes="boxes", **BARE)
