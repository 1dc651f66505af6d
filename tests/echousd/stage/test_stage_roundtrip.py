"""graph -> stage -> graph is equal: in both file formats, without the plugin, through every composition arc."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from graph_strategies import graphs as scene_graphs
from hypothesis import given, settings
from hypothesis import strategies as st
from pxr import Sdf, Usd, UsdGeom

from echousd.graph import GraphError, Node, Relation, RoomSpec, SceneGraph
from echousd.stage.graphs import save_layer, write_graph
from echousd.stage.read import read_graph, read_rooms
from echousd.stage.write import graph_layer

FEW = settings(max_examples=15, deadline=None)
FEWER = settings(max_examples=8, deadline=None)  # through files

BEDROOM = SceneGraph(
    RoomSpec("bedroom", floor_polygon=((0, 0), (4, 0), (4, 3.1), (0, 3)), height=2.6),
    (
        Node("bed", "double_bed", size=(1.6, 0.9, 2.1), attributes={"colour": "dark red", "pillows": 2, "new": True}),
        Node("stand", "nightstand", style="oak", locked=True, position=(0.1, 0, 0.7), yaw=0.3),
        Node("closet", "wardrobe"),
    ),
    (
        Relation("stand", "left", "bed"),
        Relation("stand", "shorter_than", "bed", 0.8),
        Relation("bed", "close_by", "stand"),
    ),
)


@given(graph=scene_graphs(), extension=st.sampled_from(["usda", "usdc"]))
@FEWER
def test_files(graph, extension, tmp_path_factory):
    path = tmp_path_factory.mktemp("stage") / f"room.{extension}"
    save_layer(graph_layer(graph), path)
    assert read_graph(path) == graph
    kinds = [[type(value) for _, value in sorted(node.attributes.items())] for node in graph.nodes]
    assert [[type(v) for _, v in sorted(node.attributes.items())] for node in read_graph(path).nodes] == kinds


@pytest.fixture(scope="module")
def bare_process():
    """A process that opened a stage before importing echousd: it never learns the schema."""
    environment = {key: text for key, text in os.environ.items() if key != "PXR_PLUGINPATH_NAME"}
    command = [sys.executable, str(Path(__file__).with_name("without_plugin.py"))]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, env=environment) as process:
        yield process
        process.stdin.close()


@given(first=scene_graphs(), second=scene_graphs(), extension=st.sampled_from(["usda", "usdc"]))
@FEWER
def test_without_the_plugin(first, second, extension, bare_process, tmp_path_factory):
    folder = tmp_path_factory.mktemp("bare")
    given, made = folder / f"given.{extension}", folder / f"made.{extension}"
    save_layer(graph_layer(first), given)
    task = {"graphs": [first.to_json(), second.to_json()], "given": str(given), "made": str(made)}
    bare_process.stdin.write(json.dumps(task) + "\n")
    bare_process.stdin.flush()
    assert json.loads(bare_process.stdout.readline()) == "agreed"
    assert read_graph(made) == first


@given(graph=scene_graphs(), instanceable=st.booleans())
@FEW
def test_through_a_reference_or_an_instance(graph, instanceable):
    layer = graph_layer(graph)
    stage = Usd.Stage.CreateInMemory()
    room = stage.DefinePrim("/House/Upstairs/Bedroom")
    room.GetReferences().AddReference(layer.identifier)
    room.SetInstanceable(instanceable)
    assert room.IsInstance() == instanceable
    assert read_graph(stage) == graph
    assert list(read_rooms(stage)) == ["/House/Upstairs/Bedroom"]


@given(first=scene_graphs(), second=scene_graphs())
@FEW
def test_variants(first, second):
    stage = Usd.Stage.CreateInMemory()
    room = stage.DefinePrim("/Room", "Xform")
    plans = room.GetVariantSets().AddVariantSet("plan")
    for name, graph in (("a", first), ("b", second)):
        plans.AddVariant(name)
        plans.SetVariantSelection(name)
        with plans.GetVariantEditContext():
            write_graph(graph, stage)
    for name, graph in (("a", first), ("b", second)):
        plans.SetVariantSelection(name)
        assert read_graph(stage) == graph
    assert not stage.GetRootLayer().GetPrimAtPath("/Room").nameChildren


@given(graph=scene_graphs(), data=st.data())
@FEW
def test_a_sublayer_takes_relations_and_objects_out(graph, data):
    base = graph_layer(graph)
    stronger = Sdf.Layer.CreateAnonymous(".usda")
    stronger.subLayerPaths.append(base.identifier)
    stage = Usd.Stage.Open(stronger)
    before = base.ExportToString()
    for relation in data.draw(st.lists(st.sampled_from(graph.relations), unique_by=id)) if graph.relations else []:
        name = f"{relation.subject}__{relation.predicate}__{relation.object}"
        stage.GetPrimAtPath(f"/Room/SceneGraph/{name}").SetActive(False)
        graph = graph.unrelate(*relation.triple)
    if len(graph.nodes) > 1:
        gone = data.draw(st.sampled_from(graph.names))
        stage.GetPrimAtPath(f"/Room/Objects/{gone}").SetActive(False)
        graph = graph.remove_node(gone)
    assert read_graph(stage) == graph
    assert base.ExportToString() == before


@given(graph=scene_graphs(), data=st.data(), referenced=st.booleans())
@FEW
def test_namespace_editor_renames(graph, data, referenced):
    layer = graph_layer(graph)
    root = "/Room"
    if referenced:
        stage = Usd.Stage.CreateInMemory()
        root = "/House"
        stage.DefinePrim(root).GetReferences().AddReference(layer.identifier)
    else:
        stage = Usd.Stage.Open(layer)
    old = data.draw(st.sampled_from(graph.names))
    editor = Usd.NamespaceEditor(stage)
    editor.RenamePrim(stage.GetPrimAtPath(f"{root}/Objects/{old}"), "renamed_object")
    assert editor.ApplyEdits()
    expected = graph.update_node(old, name="renamed_object")
    found = read_graph(stage)
    if referenced:  # a relocated prim comes last among its siblings
        assert {node.name: node for node in found.nodes} == {node.name: node for node in expected.nodes}
        assert (found.room, found.relations) == (expected.room, expected.relations)
    else:
        assert found == expected


def test_renaming_the_room_keeps_its_graph():
    stage = Usd.Stage.Open(graph_layer(BEDROOM))
    editor = Usd.NamespaceEditor(stage)
    editor.RenamePrim(stage.GetPrimAtPath("/Room"), "MasterBedroom")
    assert editor.ApplyEdits()
    assert read_rooms(stage) == {"/MasterBedroom": BEDROOM}


@given(graphs=st.lists(scene_graphs(), min_size=2, max_size=4))
@FEW
def test_several_rooms_on_one_stage(graphs):
    stage = Usd.Stage.CreateInMemory()
    stage.DefinePrim("/House", "Xform")
    for number, graph in enumerate(graphs):
        write_graph(graph, stage, room=f"/House/Room{number}")
    assert read_rooms(stage) == {f"/House/Room{number}": graph for number, graph in enumerate(graphs)}
    assert read_graph(stage, room="/House/Room1") == graphs[1]
    with pytest.raises(ValueError, match=r"rooms, say which one of /House/Room0, /House/Room1"):
        read_graph(stage)
    with pytest.raises(ValueError, match=r"no room '/House/Attic', allowed: /House/Room0, /House/Room1"):
        read_graph(stage, room="/House/Attic")


def test_a_room_within_a_room_keeps_its_own_objects():
    stage = Usd.Stage.CreateInMemory()
    alcove = SceneGraph("study", (Node("desk", "desk"),))
    write_graph(BEDROOM, stage)
    write_graph(alcove, stage, room="/Room/Alcove")
    assert read_rooms(stage) == {"/Room": BEDROOM, "/Room/Alcove": alcove}


def test_relations_added_by_hand_in_a_stronger_layer(tmp_path):
    save_layer(graph_layer(BEDROOM), tmp_path / "bedroom.usda")
    (tmp_path / "mine.usda").write_text("""#usda 1.0
(
    subLayers = [@./bedroom.usda@]
)
over "Room" {
    over "SceneGraph" {
        def EchoRelation "mine" {
            rel echo:subject = </Room/Objects/closet>
            token echo:predicate = "taller than"
            rel echo:object = </Room/Objects/bed>
            float echo:confidence = 0.5
        }
    }
}
""")
    assert read_graph(tmp_path / "mine.usda") == BEDROOM.relate("closet", "taller_than", "bed", 0.5)


def test_names_with_double_underscores_never_meet():
    nodes = tuple(Node(name, "chair") for name in ("a", "a__left__b", "c", "b__left__c"))
    graph = SceneGraph("study", nodes, (Relation("a", "left", "b__left__c"), Relation("a__left__b", "left", "c")))
    layer = graph_layer(graph)
    assert read_graph(Usd.Stage.Open(layer)) == graph
    assert {spec.name for spec in layer.GetPrimAtPath("/Room/SceneGraph").nameChildren} == {
        "a__left__b__left__c",
        "a__left__b__left__c_2",
    }


def test_the_text_that_a_person_opens():
    lines = graph_layer(BEDROOM).ExportToString().splitlines()
    prims = [line.strip() for line in lines if line.strip().startswith("def ")]
    assert prims == [
        'def Xform "Room" (',
        'def EchoSceneGraph "SceneGraph"',
        'def EchoRelation "stand__left__bed"',
        'def EchoRelation "stand__shorter_than__bed"',
        'def EchoRelation "bed__close_by__stand"',
        'def Xform "Objects" (',
        'def Xform "bed" (',
        'def Xform "stand" (',
        'def Xform "closet" (',
    ]
    closet = lines[lines.index('        def Xform "closet" (') :]
    assert [line.strip() for line in closet[:7]] == [
        'def Xform "closet" (',
        'prepend apiSchemas = ["EchoNodeAPI", "SemanticsLabelsAPI:category"]',
        ")",
        "{",
        'uniform token echo:category = "wardrobe"',
        'token[] semantics:labels:category = ["wardrobe"]',
        "}",
    ]
    assert 'defaultPrim = "Room"' in lines[2]
    assert "customData" not in "".join(lines)


def test_every_client_can_ask_the_schema():
    stage = Usd.Stage.Open(graph_layer(BEDROOM))
    relation = stage.GetPrimAtPath("/Room/SceneGraph/stand__left__bed")
    assert relation.IsA("EchoRelation")
    assert relation.GetAttribute("echo:confidence").Get() == 1.0
    assert stage.GetPrimAtPath("/Room/Objects/bed").HasAPI("EchoNodeAPI")
    assert stage.GetPrimAtPath("/Room/Objects/bed").GetAttribute("echo:locked").Get() is False


def test_the_graph_may_lie_beside_its_room():
    stage = Usd.Stage.CreateInMemory()
    bed = stage.DefinePrim("/World/Furniture/bed", "Xform")
    bed.ApplyAPI("EchoNodeAPI")
    bed.CreateAttribute("semantics:labels:category", Sdf.ValueTypeNames.TokenArray).Set(["king size bed"])
    graph = stage.DefinePrim("/Graphs/bedroom", "EchoSceneGraph")
    graph.GetAttribute("echo:roomType").Set("bedroom")
    graph.GetRelationship("echo:room").SetTargets(["/World"])
    found = read_rooms(stage)
    assert found == {"/World": SceneGraph("bedroom", (Node("bed", "double_bed"),))}
    wanted = found["/World"].add_node("stand", "nightstand").relate("stand", "left", "bed")
    write_graph(wanted, stage, room="/World")
    assert read_rooms(stage) == {"/World": wanted}
    assert stage.GetPrimAtPath("/World/Furniture/stand")
    assert stage.GetPrimAtPath("/Graphs/bedroom/stand__left__bed")


def test_writing_into_a_stage_keeps_what_is_there():
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, "Z")
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    stage.SetDefaultPrim(stage.DefinePrim("/World", "Scope"))
    stage.DefinePrim("/Room/Objects/bed", "Cube").SetDocumentation("mine")
    write_graph(BEDROOM, stage)
    assert read_graph(stage) == BEDROOM  # lengths are metres in the room's frame, whatever the stage counts in
    assert (UsdGeom.GetStageUpAxis(stage), UsdGeom.GetStageMetersPerUnit(stage)) == ("Z", 0.01)
    assert stage.GetDefaultPrim().GetPath() == "/World"
    bed = stage.GetPrimAtPath("/Room/Objects/bed")
    assert (bed.GetTypeName(), bed.GetDocumentation()) == ("Cube", "mine")


def test_an_edit_target_behind_a_reference():
    source = Sdf.Layer.CreateAnonymous(".usda")
    Sdf.CreatePrimInLayer(source, "/Asset")
    source.defaultPrim = "Asset"
    stage = Usd.Stage.CreateInMemory()
    prim = stage.DefinePrim("/House/Bedroom")
    prim.GetReferences().AddReference(source.identifier)
    node = prim.GetPrimIndex().rootNode.children[0]
    stage.SetEditTarget(Usd.EditTarget(source, node))
    write_graph(BEDROOM, stage, room="/House/Bedroom")
    assert read_rooms(stage) == {"/House/Bedroom": BEDROOM}
    assert read_rooms(Usd.Stage.Open(source)) == {"/Asset": BEDROOM}


def test_a_text_is_read_where_a_stage_is(tmp_path):
    text = tmp_path / "room.yaml"
    text.write_text("room: study\nobjects: {desk: desk, chair: chair}\nrelations: [chair close by desk]\n")
    write_graph(read_graph(text), tmp_path / "room.usda")
    assert read_graph(tmp_path / "room.usda") == read_graph(str(text))
    assert len(read_graph(text).relations) == 1
    text.write_text("room: study\nobjects: {desk: dusk}\n")
    with pytest.raises(GraphError, match=r"room\.yaml:2: .*'dusk'"):
        read_graph(text)
