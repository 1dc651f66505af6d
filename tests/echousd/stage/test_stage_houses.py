"""Stages of others: without labels, with several rooms, with materials that cannot be read."""

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdPhysics, UsdSemantics

import echousd
from echomodel.boxes2d import turned
from echousd.checks import check
from echousd.graph import Node, SceneGraph
from echousd.options import RoomOptions
from echousd.stage import foreign
from echousd.stage.boxes import relations_from_boxes
from echousd.stage.encoding import StageError
from echousd.stage.files import MissingMaterials, open_stage
from echousd.stage.foreign import Box, SkippedPrims, foreign_graph, foreign_rooms
from echousd.stage.labels import spaced
from echousd.stage.read import read_graph


def house(path, *, labelled=True, rooms=("Bedroom", "LivingRoom_01")):
    """Two rooms of furniture below prims with the given names, a floor each; prim path -> box (low, high)."""
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, "Y")
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/House").GetPrim())
    things = {
        f"/House/{rooms[0]}/Floor": ("floor", (0, -0.1, 0), (4, 0, 4)),
        f"/House/{rooms[0]}/SM_Bed_03": ("double_bed", (1, 0, 1), (2.6, 0.6, 3)),
        f"/House/{rooms[0]}/Nightstand": ("nightstand", (0.5, 0, 1), (0.9, 0.5, 1.4)),
        f"/House/{rooms[1]}/Floor": ("floor", (5, -0.1, 0), (10, 0, 4)),
        f"/House/{rooms[1]}/bigSofa": ("sofa", (6, 0, 1), (8, 0.8, 1.9)),
        f"/House/{rooms[1]}/CoffeeTable": ("coffee_table", (6.5, 0, 2.2), (7.5, 0.4, 2.8)),
    }
    for where, (word, low, high) in things.items():
        cube = UsdGeom.Cube.Define(stage, where)
        cube.CreateSizeAttr(1.0)
        cube.CreateExtentAttr([(-0.5, -0.5, -0.5), (0.5, 0.5, 0.5)])
        cube.AddTranslateOp().Set(tuple((a + b) / 2 for a, b in zip(low, high, strict=True)))
        cube.AddScaleOp().Set(tuple(b - a for a, b in zip(low, high, strict=True)))
        if labelled:
            UsdSemantics.LabelsAPI.Apply(cube.GetPrim(), "category").CreateLabelsAttr([word])
    stage.GetRootLayer().Save()
    return stage


@pytest.mark.parametrize("labelled", [True, False])
def test_a_house_is_split_by_the_names_of_its_rooms(tmp_path, labelled):
    stage = house(tmp_path / "house.usda", labelled=labelled)
    rooms = foreign_rooms(stage, names=not labelled)
    assert {path: (graph.room.type, graph.names) for path, graph in rooms.items()} == {
        "/House/Bedroom": ("bedroom", ("SM_Bed_03", "Nightstand")),
        "/House/LivingRoom_01": ("living_room", ("bigSofa", "CoffeeTable")),
    }
    assert sorted(rooms["/House/Bedroom"].room.floor_polygon)[0] == pytest.approx((0, 0))
    assert [node.category for node in rooms["/House/LivingRoom_01"].nodes] == ["sofa", "coffee_table"]


def test_a_house_is_split_by_its_floors_where_no_names_tell(tmp_path):
    stage = house(tmp_path / "house.usda", rooms=("East", "West"))
    rooms = foreign_rooms(stage)
    assert [(path, graph.names) for path, graph in rooms.items()] == [
        ("/House/East/Floor", ("SM_Bed_03", "Nightstand")), ("/House/West/Floor", ("bigSofa", "CoffeeTable")),
    ]  # fmt: skip
    assert len(foreign_graph(stage).nodes) == 4
    assert read_graph(stage, "/House/West/Floor") == rooms["/House/West/Floor"]


@pytest.mark.parametrize(
    ("place", "held"),
    [((1.9, 0.0, 0.0), True), ((2.1, 0.0, 0.0), False), ((0.0, 0.0, 0.9), True), ((0.0, 0.0, 1.1), False),
     ((0.0, -0.3, 0.0), True), ((0.0, -1.0, 0.0), False), ((0.0, 2.0, 0.0), True), ((0.0, 3.2, 0.0), False)],
)  # fmt: skip
@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_a_floor_holds_what_is_over_it_in_its_storey(place, held, turn):
    floor = Box((4.0, 0.1, 2.0), (5.0, 0.0, 3.0), turn)
    x, z = turned(np.array(place)[[0, 2]], np.float64(turn))
    node = Node("it", "stool", position=(5.0 + x, place[1], 3.0 + z))
    assert foreign._over(node, floor) == held


def test_names_count_only_when_asked_and_the_error_says_so(tmp_path):
    stage = house(tmp_path / "house.usda", labelled=False)
    with pytest.raises(StageError, match=r"semantics labels and bounds to make one of; --names takes"):
        foreign_graph(stage)
    assert len(foreign_graph(stage, names=True).nodes) == 4


def test_a_group_of_chairs_is_no_chair():
    stage = Usd.Stage.CreateInMemory()
    for number in (1, 2):
        UsdGeom.Cube.Define(stage, f"/Chairs/Chair_{number}").CreateExtentAttr([(-1, -1, -1), (1, 1, 1)])
    UsdGeom.Cube.Define(stage, "/Wall_bed").CreateExtentAttr([(-1, -1, -1), (1, 1, 1)])
    assert foreign_graph(stage, names=True).names == ("Chair_1", "Chair_2")


@pytest.mark.parametrize(
    ("name", "words"),
    [("SM_DiningChair_03", "sm_dining_chair"), ("dining-chair.12", "dining_chair"), ("TVStand", "tvstand")],
)
def test_names_are_taken_apart(name, words):
    assert spaced(name) == words


def test_small_things_of_unknown_labels_are_no_obstacles():
    stage = Usd.Stage.CreateInMemory()
    for name, word, half in (("bed", "bed", 1.0), ("harp", "harp", 0.5), ("mug", "mug", 0.05)):
        cube = UsdGeom.Cube.Define(stage, f"/{name}")
        cube.CreateSizeAttr(2 * half)
        cube.CreateExtentAttr([(-half,) * 3, (half,) * 3])
        UsdSemantics.LabelsAPI.Apply(cube.GetPrim(), "class").CreateLabelsAttr([word])
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    told = r"unknown label 'mug' \(1\); unknown labels, fixed obstacles: 'harp' \(1\)"
    with pytest.warns(SkippedPrims, match=told):
        graph = foreign_graph(stage)
    assert graph.names == ("bed", "harp")
    assert graph.node("harp").locked


def test_materials_that_cannot_be_read_are_left_out_and_told(tmp_path):
    stage = house(tmp_path / "house.usda")
    looks = stage.DefinePrim("/House/Looks", "Scope")
    looks.GetReferences().AddReference("./looks.mtlx", "/MaterialX")
    stage.GetRootLayer().Save()
    del stage, looks
    with pytest.warns(
        MissingMaterials, match=r"house.usda: materials that cannot be read here are left out: looks.mtlx$"
    ):
        assert len(foreign_graph(open_stage(tmp_path / "house.usda")).nodes) == 4
    layer = Sdf.Layer.FindOrOpen(str(tmp_path / "house.usda"))
    layer.subLayerPaths.append("./gone.usda")
    layer.Save()
    with pytest.raises(StageError, match=r"does not compose: .*gone.usda"):
        open_stage(tmp_path / "house.usda")


def test_few_relations_are_those_of_near_pairs(tmp_path):
    graph = foreign_graph(house(tmp_path / "house.usda"))
    every, few = relations_from_boxes(graph), relations_from_boxes(graph, per_object=1.0)
    assert len(few.relations) == 4 < len(every.relations)
    assert {r.triple for r in few.relations} <= {r.triple for r in every.relations}
    pairs = [frozenset((r.subject, r.object)) for r in few.relations]
    assert {frozenset(("SM_Bed_03", "Nightstand")), frozenset(("bigSofa", "CoffeeTable"))} <= set(pairs)
    assert relations_from_boxes(graph, per_object=0).relations == ()


def test_the_command_offers_names_relations_and_rooms(tmp_path, echousd_command):
    house(tmp_path / "house.usda", labelled=False)
    shown = echousd_command("graph", tmp_path / "house.usda", "--names")
    assert shown.code == 0
    assert "/House/Bedroom bedroom, 2 objects" in shown.out
    assert "/House/LivingRoom_01 living room, 2 objects" in shown.out
    one = echousd_command(
        "graph", tmp_path / "house.usda", "--names", "--room", "/House/Bedroom", "--relations", "1", "--json"
    )
    assert len(SceneGraph.from_json(one.out).relations) == 2
    both = echousd_command("graph", tmp_path / "house.usda", "--names", "--json")
    assert both.code == 2
    assert "2 rooms, say which one of /House/Bedroom, /House/LivingRoom_01 (--room)" in both.err
    none = echousd_command("graph", tmp_path / "house.usda", "--names", "--room", "/House/Attic")
    assert none.code == 2
    assert "no room '/House/Attic', allowed: /House/Bedroom, /House/LivingRoom_01" in none.err


def test_an_obstacle_is_a_fixed_box_under_its_own_word(tmp_path):
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, "Y")
    for name, word, at in (("stool", "stool", (1.0, 0.5, 0)), ("harp", "concert harp", (-1.0, 1.5, 0))):
        cube = UsdGeom.Cube.Define(stage, f"/{name}")
        cube.CreateSizeAttr(1.0)
        cube.AddTranslateOp().Set(at)
        UsdSemantics.LabelsAPI.Apply(cube.GetPrim(), "class").CreateLabelsAttr([word])
    with pytest.warns(SkippedPrims, match="fixed obstacles: 'concert harp'"):
        graph = foreign_graph(stage)
    assert (graph.node("harp").shapes, graph.node("stool").shapes) == ("boxes", None)
    options = RoomOptions(walls=False, dress="none")
    room = echousd.generate(graph, shapes="boxes", drafts=1, options=options)
    root = room.save(tmp_path / "room", preview=False)
    made = Usd.Stage.Open(str(root))
    for name, body, label, ade20k in (("harp", False, "concert harp", "box"), ("stool", True, "stool", "stool")):
        prim = made.GetPrimAtPath(f"/Room/Objects/{name}")
        assert prim.HasAPI(UsdPhysics.RigidBodyAPI) is body
        assert any(below.HasAPI(UsdPhysics.CollisionAPI) for below in Usd.PrimRange(prim))
        assert list(prim.GetAttribute("semantics:labels:category").Get()) == [label]
        assert list(prim.GetAttribute("semantics:labels:ade20k").Get()) == [ade20k]
    assert room.boxes.position[graph.names.index("harp")].tolist() == [-1.0, 1.0, 0.0]  # it may hang there
    assert echousd.read_graph(root).node("harp") == graph.node("harp")
    report = check(root)
    assert [wrong for layout in report.layouts for wrong in layout.placement] == []
    assert [fault for fault in report.errors if fault.rule == "echo:OneLabel"] == []
