"""Stages that others authored: labels and bounds become nodes with boxes, boxes become relations."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSemantics

from echousd.graph import Node, Relation, SceneGraph
from echousd.stage.boxes import relations_from_boxes, room_boxes
from echousd.stage.encoding import StageError
from echousd.stage.foreign import SkippedPrims, boxed_graph, foreign_graph, foreign_pieces
from echousd.stage.forms import forms
from echousd.stage.graphs import update_graph
from echousd.stage.read import read_graph, the_room
from echousd.stage.values import NOW
from echousd.stage.write import graph_layer

CORNERS = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)


def stage_of(up: str, metres: float) -> Usd.Stage:
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, up)
    UsdGeom.SetStageMetersPerUnit(stage, metres)
    UsdGeom.Xform.Define(stage, "/World")
    stage.SetDefaultPrim(stage.GetPrimAtPath("/World"))
    return stage


def box_mesh(stage: Usd.Stage, path: str, low, high) -> UsdGeom.Mesh:
    """A box from `low` to `high` in the prim's own axes."""
    mesh = UsdGeom.Mesh.Define(stage, path)
    points = np.asarray(low) + CORNERS * (np.asarray(high, float) - np.asarray(low))
    mesh.CreatePointsAttr([Gf.Vec3f(*map(float, point)) for point in points])
    mesh.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(mesh.GetPointsAttr().Get()))
    return mesh


def label(prim, *words: str, taxonomy: str = "category") -> None:
    UsdSemantics.LabelsAPI.Apply(prim, taxonomy).CreateLabelsAttr(list(words))


def close(node: Node, size, position, yaw) -> None:
    assert node.size == pytest.approx(size, abs=1e-5)
    assert node.position == pytest.approx(position, abs=1e-5)
    assert math.remainder(node.yaw - yaw, 2 * math.pi) == pytest.approx(0, abs=1e-5)


@pytest.mark.parametrize("metres", [1.0, 0.01, 0.0254])
@pytest.mark.parametrize("yaw", [0.0, 0.5, -2.0, math.pi])
def test_y_up(metres, yaw):
    stage = stage_of("Y", metres)
    bed = UsdGeom.Xform.Define(stage, "/World/Bed_01")
    bed.AddTranslateOp().Set(Gf.Vec3d(2, 0.25, -1) / metres)
    bed.AddRotateYOp().Set(math.degrees(yaw))
    box_mesh(stage, "/World/Bed_01/mesh", np.array([-0.8, 0, -1]) / metres, np.array([0.8, 0.9, 1]) / metres)
    label(bed.GetPrim(), "double_bed")
    graph = read_graph(stage)
    assert [(node.name, node.category) for node in graph.nodes] == [("Bed_01", "double_bed")]
    close(graph.nodes[0], (1.6, 0.9, 2.0), (2, 0.25, -1), yaw)
    assert all(len(repr(number)) < 10 for number in (*graph.nodes[0].size, *graph.nodes[0].position))
    assert graph.room.type == "bedroom"


def test_what_is_hidden_is_not_there():
    stage = stage_of("Y", 1.0)
    UsdGeom.Xform.Define(stage, "/World/hidden_group").MakeInvisible()
    for name in ("bed", "hidden_bed", "hidden_blob", "hidden_group/bed"):
        thing = UsdGeom.Xform.Define(stage, f"/World/{name}")
        label(thing.GetPrim(), "bed" if name.endswith("bed") else "blob")
        box_mesh(stage, f"/World/{name}/mesh", (0, 0, 0), (1, 1, 1))
        if name in ("hidden_bed", "hidden_blob"):
            thing.MakeInvisible()
    with pytest.warns(SkippedPrims, match=r"labelled prims that became no node: hidden \(2\)$"):
        graph = read_graph(stage)
    assert graph.names == ("bed",)


def test_what_is_told_by_time_stands_where_it_is_first():
    stage = stage_of("Y", 1.0)
    for name in ("bed", "desk"):
        box_mesh(stage, f"/World/{name}", (-0.5, 0, -1), (0.5, 0.6, 1))
        label(stage.GetPrimAtPath(f"/World/{name}"), name)
    place = UsdGeom.Xformable(stage.GetPrimAtPath("/World/bed")).AddTranslateOp()
    place.Set(Gf.Vec3d(2, 0, 1), 1001)
    place.Set(Gf.Vec3d(3, 0, 1), 1024)
    seen = UsdGeom.Imageable(stage.GetPrimAtPath("/World/desk")).CreateVisibilityAttr()
    seen.Set(UsdGeom.Tokens.invisible, 1001)
    with pytest.warns(SkippedPrims, match="hidden \\(1\\)$"):
        bed = read_graph(stage).nodes[0]
    close(bed, (1, 0.6, 2), (2, 0, 1), 0)
    (form,) = forms(stage.GetPseudoRoot(), UsdGeom.XformCache(NOW))
    assert form.path == "/World/bed"
    assert form.world[:3, 3] == pytest.approx((2, 0, 1))


@pytest.mark.parametrize("names", [False, True])
def test_what_an_instancer_places_is_told_instead_of_where_its_prototype_is(names):
    stage = stage_of("Y", 1.0)
    for path in ("/World/bed", "/World/Many/Prototypes/stool"):
        box_mesh(stage, path, (0, 0, 0), (1, 0.5, 1))
        if not names:
            label(stage.GetPrimAtPath(path), path.rpartition("/")[2])
    many = UsdGeom.PointInstancer.Define(stage, "/World/Many")
    many.CreatePrototypesRel().AddTarget("/World/Many/Prototypes/stool")
    many.CreatePositionsAttr([Gf.Vec3f(3, 0, 0), Gf.Vec3f(3, 0, 2)])
    many.CreateProtoIndicesAttr([0, 0])
    with pytest.warns(SkippedPrims, match="became no node: of an instancer \\(1\\)$"):
        assert foreign_graph(stage, names=names).names == ("bed",)
    label(many.GetPrim(), "stool")  # all that it places is one thing
    assert foreign_graph(stage, names=names).node("Many").size == pytest.approx((1, 0.5, 3))


@pytest.mark.parametrize("metres", [1.0, 0.01])
@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.5])
def test_z_up(metres, yaw):
    """(x, y, z) of a Z-up stage is (x, z, -y) of the room, so a front along -Y is a front along +Z."""
    stage = stage_of("Z", metres)
    sofa = UsdGeom.Xform.Define(stage, "/World/sofa")
    sofa.AddTranslateOp().Set(Gf.Vec3d(1, 2, 0.5) / metres)
    sofa.AddRotateZOp().Set(math.degrees(yaw))
    box_mesh(stage, "/World/sofa/mesh", np.array([-1, -0.4, 0]) / metres, np.array([1, 0.4, 0.8]) / metres)
    label(sofa.GetPrim(), "sofa")
    close(read_graph(stage).node("sofa"), (2, 0.8, 0.8), (1, 0.5, -2), yaw)


def test_a_y_up_asset_stood_up_in_a_z_up_stage():
    stage = stage_of("Z", 1.0)
    chair = UsdGeom.Xform.Define(stage, "/World/chair")
    chair.AddTranslateOp().Set(Gf.Vec3d(1, 2, 0))
    chair.AddRotateZOp().Set(30)
    chair.AddRotateXOp().Set(90)
    box_mesh(stage, "/World/chair/mesh", (-0.2, 0, -0.3), (0.2, 1, 0.3))
    label(chair.GetPrim(), "chair")
    close(read_graph(stage).node("chair"), (0.4, 1.0, 0.6), (1, 0, -2), math.radians(30))


def test_a_z_up_asset_laid_down_in_a_y_up_stage():
    stage = stage_of("Y", 0.01)
    chair = UsdGeom.Xform.Define(stage, "/World/chair")
    chair.AddRotateYOp().Set(30)
    chair.AddRotateXOp().Set(-90)
    chair.AddScaleOp().Set(Gf.Vec3f(100, 100, 100))
    box_mesh(stage, "/World/chair/mesh", (-0.2, -0.3, 0), (0.2, 0.3, 1))
    label(chair.GetPrim(), "chair")
    close(read_graph(stage).node("chair"), (0.4, 1.0, 0.6), (0, 0, 0), math.radians(30))


def test_a_tilted_object_gets_the_box_around_it():
    stage = stage_of("Y", 1.0)
    chair = UsdGeom.Xform.Define(stage, "/World/chair")
    chair.AddTranslateOp().Set(Gf.Vec3d(0, 5, 0))
    chair.AddRotateZOp().Set(45)
    box_mesh(stage, "/World/chair/mesh", (-1, -1, -1), (1, 1, 1))
    label(chair.GetPrim(), "chair")
    wide = 2 * math.sqrt(2)
    close(read_graph(stage).node("chair"), (wide, wide, 2), (0, 5 - wide / 2, 0), 0.0)


def test_any_box_keeps_its_corners():
    """The slow twin: whatever the stage's frame, the node's box has the corners of the mesh."""
    rng = np.random.default_rng(3)
    for up in ("Y", "Z"):
        for _ in range(20):
            metres, yaw = float(rng.choice([1, 0.01])), float(rng.uniform(-3, 3))
            stage = stage_of(up, metres)
            group = UsdGeom.Xform.Define(stage, "/World/group")
            turn = group.AddRotateYOp() if up == "Y" else group.AddRotateZOp()
            turn.Set(math.degrees(yaw))
            group.AddTranslateOp().Set(Gf.Vec3d(*rng.uniform(-3, 3, 3)) / metres)
            group.AddScaleOp().Set(Gf.Vec3f(2, 2, 2))
            low = rng.uniform(-1, 0, 3) / metres
            mesh = box_mesh(stage, "/World/group/table", low, low + rng.uniform(0.2, 1, 3) / metres)
            label(mesh.GetPrim(), "table")
            matrix = np.array(UsdGeom.Imageable(mesh).ComputeLocalToWorldTransform(Usd.TimeCode.Default()))
            points = np.c_[np.array(mesh.GetPointsAttr().Get()), np.ones(8)] @ matrix[:, :3] * metres
            if up == "Z":
                points = np.c_[points[:, 0], points[:, 2], -points[:, 1]]
            node = read_graph(stage).node("table")
            cos, sin = math.cos(node.yaw), math.sin(node.yaw)
            local = (CORNERS - (0.5, 0, 0.5)) * node.size
            turned = np.c_[local[:, 0] * cos + local[:, 2] * sin, local[:, 1], local[:, 2] * cos - local[:, 0] * sin]
            ours = turned + node.position
            gaps = np.linalg.norm(ours[:, None] - points[None], axis=-1)
            assert gaps.min(0).max() < 1e-4
            assert gaps.min(1).max() < 1e-4


def test_any_taxonomy_any_word_the_vocabulary_knows():
    stage = stage_of("Y", 1.0)
    for name, taxonomy, words in (
        ("a", "wikidata_qcode", ("Q42177", "king size bed")),
        ("b", "class", ("Couch",)),
        ("c", "category", ("night stand",)),
    ):
        mesh = box_mesh(stage, f"/World/{name}", (0, 0, 0), (1, 1, 1))
        label(mesh.GetPrim(), *words, taxonomy=taxonomy)
    mesh = stage.GetPrimAtPath("/World/c")
    label(mesh, "table", taxonomy="another")  # the taxonomy `category` is asked first
    found = {node.name: node.category for node in read_graph(stage).nodes}
    assert found == {"a": "double_bed", "b": "sofa", "c": "nightstand"}


def test_omniverse_semantics_before_usd_semantics():
    stage = stage_of("Z", 0.01)
    prim = box_mesh(stage, "/World/desk", (0, 0, 0), (120, 60, 75)).GetPrim()
    prim.AddAppliedSchema("SemanticsAPI:Semantics_x")
    prim.CreateAttribute("semantic:Semantics_x:params:semanticType", Sdf.ValueTypeNames.String).Set("class")
    prim.CreateAttribute("semantic:Semantics_x:params:semanticData", Sdf.ValueTypeNames.String).Set("desk")
    graph = read_graph(stage)
    close(graph.node("desk"), (1.2, 0.75, 0.6), (0.6, 0, -0.3), 0.0)
    assert graph.room.type == "study"


def test_the_topmost_labelled_prim_is_the_object():
    stage = stage_of("Y", 1.0)
    table = UsdGeom.Xform.Define(stage, "/World/table")
    label(table.GetPrim(), "dining_table")
    for leg in range(4):
        label(box_mesh(stage, f"/World/table/leg{leg}", (leg, 0, 0), (leg + 0.1, 1, 0.1)).GetPrim(), "table")
    assert [node.name for node in read_graph(stage).nodes] == ["table"]


def test_names_become_identifiers_of_their_own():
    stage = stage_of("Y", 1.0)
    for parent in ("a", "b"):
        label(box_mesh(stage, f"/World/{parent}/Stühle", (0, 0, 0), (1, 1, 1)).GetPrim(), "chair")
    label(box_mesh(stage, "/World/椅子", (0, 0, 0), (1, 1, 1)).GetPrim(), "chair")
    nodes = read_graph(stage).nodes
    assert [node.name for node in nodes] == ["Stuehle", "Stuehle_2", "chair"]
    assert [node.title for node in nodes] == ["Stühle", "Stühle", "椅子"]


def test_instances_are_read():
    source = stage_of("Y", 1.0)
    mesh = box_mesh(source, "/World/mesh", (0, 0, 0), (1, 1, 1))
    label(source.GetPrimAtPath("/World"), "armchair")
    assert mesh
    stage = stage_of("Y", 1.0)
    for name in ("one", "two"):
        prim = stage.DefinePrim(f"/World/{name}")
        prim.GetReferences().AddReference(source.GetRootLayer().identifier)
        prim.SetInstanceable(True)
    assert [node.name for node in read_graph(stage).nodes] == ["one", "two"]


def test_floor_and_room_type():
    stage = stage_of("Y", 1.0)
    label(stage.GetPrimAtPath("/World"), "Dining Room")
    label(box_mesh(stage, "/World/ground", (-2, -0.1, -1), (3, 0, 4)).GetPrim(), "floor")
    label(box_mesh(stage, "/World/wall", (-2, 0, -1), (3, 2, -1.1)).GetPrim(), "wall")
    label(box_mesh(stage, "/World/bed", (0, 0, 0), (1, 1, 1)).GetPrim(), "single_bed")
    graph = read_graph(stage)
    assert graph.room.type == "dining_room"
    assert sorted(graph.room.floor_polygon) == [(-2, -1), (-2, 4), (3, -1), (3, 4)]
    assert graph.names == ("bed",)
    assert foreign_graph(stage, room_type="study").room.type == "study"


def test_what_is_left_out_is_told():
    stage = stage_of("Y", 1.0)
    label(box_mesh(stage, "/World/bed", (0, 0, 0), (1, 1, 1)).GetPrim(), "bed")
    label(box_mesh(stage, "/World/piano", (0, 0, 0), (1, 1, 1)).GetPrim(), "grand piano")
    label(UsdGeom.Xform.Define(stage, "/World/ghost").GetPrim(), "chair")
    told = r"became no node: no bounds \(1\); unknown labels, fixed obstacles: 'grand piano' \(1\)"
    with pytest.warns(SkippedPrims, match=told):
        graph = read_graph(stage)
    assert graph.names == ("bed", "piano")
    assert graph.node("piano").locked
    assert graph.node("piano").attributes == {"obstacle": "grand piano"}
    assert (graph.node("piano").obstacle, graph.node("bed").obstacle) == ("grand piano", "")


def test_labels_without_bounds_are_no_graph():
    stage = stage_of("Y", 1.0)
    label(UsdGeom.Xform.Define(stage, "/World/ghost").GetPrim(), "chair")
    with (
        pytest.warns(SkippedPrims),
        pytest.raises(StageError, match=r"no prims with semantics labels and bounds to make one of; "),
    ):
        read_graph(stage)


def boxed() -> SceneGraph:
    return SceneGraph(
        "bedroom",
        (
            Node("bed", "double_bed", size=(1.8, 0.5, 2.0), position=(0, 0, 0), yaw=0.0),
            Node("stand", "nightstand", size=(0.4, 0.5, 0.4), position=(0.6, 0, -1.2), yaw=0.0),
            Node("closet", "wardrobe", size=(1.2, 2.2, 0.6), position=(-1.8, 0, 0), yaw=math.pi / 2),
        ),
    )


def test_boxes_become_relations():
    graph = relations_from_boxes(boxed())
    said = {str(relation) for relation in graph.relations}
    assert {"stand left bed", "bed right stand", "closet behind bed", "closet taller_than bed"} <= said
    assert {"bed bigger_than stand", "stand smaller_than bed", "stand close_by bed"} <= said
    assert not said & {"stand right bed", "closet front bed", "bed taller_than closet"}
    assert read_graph(Usd.Stage.Open(graph_layer(graph))) == graph


def test_what_is_stated_stays():
    said = Relation("stand", "close_by", "bed", 0.5)
    graph = relations_from_boxes(SceneGraph("bedroom", boxed().nodes, (said,)))
    assert graph.relations[0] == said
    assert [r for r in graph.relations if {r.subject, r.object} == {"stand", "bed"}] == [said]


@pytest.mark.parametrize("rules", ["strict", "sgfront"])
def test_relations_of_random_boxes_never_contradict(rules):
    rng = np.random.default_rng(1)
    for _ in range(10):
        nodes = tuple(
            Node(
                f"n{i}",
                "chair",
                size=tuple(rng.uniform(0.2, 1.5, 3)),
                position=(*rng.uniform(-2, 2, 1), 0, *rng.uniform(-2, 2, 1)),
                yaw=float(rng.uniform(-3, 3)),
            )
            for i in range(8)
        )
        assert relations_from_boxes(SceneGraph("study", nodes), rules=rules).relations


def test_a_node_without_a_box_is_named():
    graph = boxed().add_node("lamp", "pendant_lamp")
    with pytest.raises(StageError, match=r"object 'lamp' has no size, position and yaw, allowed: a box for every"):
        room_boxes(graph)


@pytest.mark.parametrize(
    ("name", "size", "stands"),
    [
        ("pillar", (0.3, 2.5, 0.3), True),
        ("pillar", (0.11, 1.21, 1.19), True),
        ("pillar", (0.3, 1.1, 0.3), False),  # low
        ("pillar", (0.05, 2.5, 0.3), False),  # a pipe
        ("pillar", (0.3, 2.5, 1.3), False),  # a wall by its plan
        ("wall_3", (0.3, 2.5, 0.3), False),  # a wall by its name
    ],
)
def test_what_is_high_and_no_wall_is_in_the_way_without_a_label(name, size, stands):
    stage = stage_of("Y", 1.0)
    label(box_mesh(stage, "/World/bed", (0, 0, 0), (1.6, 0.5, 2)).GetPrim(), "bed")
    box_mesh(stage, f"/World/{name}", (4, 0, 4), np.add((4, 0, 4), size))
    graph, paths = foreign_pieces(stage)
    assert (name in graph.names) == stands
    if stands:
        node = graph.node(name)
        assert (node.locked, node.attributes) == (True, {"obstacle": "pillar"})
        assert paths[name] == "/World/pillar"


@pytest.mark.parametrize(
    ("size", "stands"), [((0.3, 0.3, 0.02), True), ((0.3, 0.29, 0.02), False), ((0.0, 2.0, 2.0), False)]
)
def test_an_unknown_label_is_in_the_way_where_two_sides_are_long(size, stands):
    stage = stage_of("Y", 1.0)
    label(box_mesh(stage, "/World/bed", (0, 0, 0), (1.6, 0.5, 2)).GetPrim(), "bed")
    label(box_mesh(stage, "/World/thing", (4, 0, 4), np.add((4, 0, 4), size)).GetPrim(), "astrolabe")
    with pytest.warns(SkippedPrims, match="fixed obstacles: 'astrolabe'" if stands else "unknown label 'astrolabe'"):
        graph = foreign_graph(stage)
    assert ("thing" in graph.names) == stands


@pytest.mark.parametrize(
    ("metres", "told"),
    [(0.01, r"0.02 m long: does metersPerUnit, 0.01 \(not stated\), fit"), (100.0, "200 m long"), (1.0, "")],
)
def test_a_unit_that_makes_dolls_or_giants_is_doubted(metres, told, recwarn):
    stage = Usd.Stage.CreateInMemory()
    label(box_mesh(stage, "/World/bed", (0, 0, 0), (1.6, 0.5, 2)).GetPrim(), "bed")
    if metres != UsdGeom.GetStageMetersPerUnit(stage):
        UsdGeom.SetStageMetersPerUnit(stage, metres)
    foreign_graph(stage)
    found = [str(one.message) for one in recwarn]
    assert bool(found) == bool(told)
    assert not told or re.search(told, found[0])


@pytest.mark.parametrize("untold", ["size", "position", "yaw"])
def test_nodes_get_the_boxes_of_their_prims_where_one_number_is_not_told(untold):
    told = {"size": (1.0, 1.0, 1.0), "position": (5.0, 0.0, 5.0), "yaw": 1.0}
    boxes = {name: None if name == untold else value for name, value in told.items()}
    stage = Usd.Stage.Open(graph_layer(SceneGraph("bedroom", (Node("bed", "bed", **boxes),))))
    prims = the_room(stage, None)
    with pytest.raises(StageError, match="/Room/Objects/bed: has no bounds, allowed: a box or geometry"):
        boxed_graph(prims)
    box_mesh(stage, "/Room/Objects/bed/mesh", (-0.8, 0, -1), (0.8, 0.5, 1))
    (node,) = boxed_graph(prims).nodes
    assert node.size == pytest.approx((1.6, 0.5, 2.0))
    update_graph(stage, SceneGraph("bedroom", (Node("bed", "bed", **told),)))
    assert boxed_graph(the_room(stage, None)).nodes[0].size == (1.0, 1.0, 1.0)


@pytest.mark.parametrize(("deep", "known"), [(4.0, True), (1e-7, False)])
def test_a_floor_without_an_area_bounds_no_room(deep, known):
    stage = stage_of("Y", 1.0)
    label(box_mesh(stage, "/World/bed", (0, 0, 0), (1.6, 0.5, 2)).GetPrim(), "bed")
    label(box_mesh(stage, "/World/ground", (0, -0.1, 0), (3, 0, deep)).GetPrim(), "floor")
    corners = foreign_graph(stage).room.floor_polygon
    assert (corners is not None) == known
    if known:
        assert sorted(np.round(corners, 3).tolist()) == [[0, 0], [0, 4], [3, 0], [3, 4]]


@pytest.mark.parametrize(("up", "metres"), [("Y", 1.0), ("Z", 0.01), ("Z", 1.0)])
def test_boxes_of_a_room_that_stands_elsewhere_are_those_of_its_own_frame(up, metres):
    room = Usd.Stage.Open(graph_layer(SceneGraph("bedroom", (Node("bed", "bed"),))))
    UsdGeom.Xformable(room.GetPrimAtPath("/Room/Objects/bed")).AddTranslateOp().Set(Gf.Vec3d(1, 0, -0.5))
    box_mesh(room, "/Room/Objects/bed/mesh", (-0.8, 0, -1), (0.8, 0.5, 1))
    stage = stage_of(up, metres)
    there = UsdGeom.Xform.Define(stage, "/World/flat/bedroom")
    there.GetPrim().GetReferences().AddReference(room.GetRootLayer().identifier)
    there.AddTranslateOp().Set(Gf.Vec3d(3, 4, 5) / metres)
    there.AddRotateXYZOp().Set(Gf.Vec3f(90, 0, 30) if up == "Z" else Gf.Vec3f(0, 30, 0))
    there.AddScaleOp().Set(Gf.Vec3f(1 / metres))
    (node,) = boxed_graph(the_room(stage, None)).nodes
    close(node, (1.6, 0.5, 2.0), (1.0, 0.0, -0.5), 0.0)
