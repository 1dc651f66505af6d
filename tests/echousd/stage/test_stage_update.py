"""Changing a graph where it stands: the result is the wanted graph, and nothing else on the stage has moved."""

from __future__ import annotations

import warnings

import pytest
from graph_strategies import graphs as scene_graphs
from hypothesis import given, settings
from pxr import Gf, Sdf, Usd, UsdGeom

from echousd.graph import Node, Relation, SceneGraph
from echousd.stage.encoding import StageError
from echousd.stage.graphs import save_layer, update_graph, write_graph
from echousd.stage.read import read_graph
from echousd.stage.write import graph_layer

SOME = settings(max_examples=20, deadline=None)

GRAPH = SceneGraph(
    "bedroom",
    (
        Node("bed", "double_bed", size=(1.6, 0.9, 2.1), attributes={"colour": "red"}),
        Node("stand", "nightstand", style="oak", locked=True),
        Node("closet", "wardrobe"),
    ),
    (Relation("stand", "left", "bed"), Relation("closet", "taller_than", "bed", 0.5)),
)


@given(first=scene_graphs(), second=scene_graphs())
@SOME
def test_any_graph_becomes_any_other(first, second):
    layer = graph_layer(first)
    write_graph(second, layer)
    assert read_graph(Usd.Stage.Open(layer)) == second
    assert len(layer.rootPrims) == 1


@given(first=scene_graphs(), second=scene_graphs())
@SOME
def test_in_a_stronger_layer_and_back(first, second):
    base = graph_layer(first)
    before = base.ExportToString()
    mine = Sdf.Layer.CreateAnonymous(".usda")
    mine.subLayerPaths.append(base.identifier)
    stage = Usd.Stage.Open(mine)
    update_graph(stage, second)
    assert read_graph(stage) == second
    update_graph(stage, first)
    assert read_graph(stage) == first
    assert base.ExportToString() == before


def test_what_two_layers_state_is_taken_away_by_the_stronger():
    base = graph_layer(GRAPH)
    mine = Sdf.Layer.CreateAnonymous(".usda")
    mine.subLayerPaths.append(base.identifier)
    stage = Usd.Stage.Open(mine)
    for fields in ({"style": "pine"}, {"style": None}, {"style": "ash"}, {"style": None}):
        wanted = GRAPH.update_node("stand", **fields)
        update_graph(stage, wanted)
        assert read_graph(stage) == wanted
    assert read_graph(Usd.Stage.Open(base)) == GRAPH


@pytest.mark.parametrize("layers", [(0,), (1,), (0, 1)])
def test_an_object_that_layers_switched_off_is_switched_on_over_them(layers):
    base = graph_layer(GRAPH)
    mine = Sdf.Layer.CreateAnonymous(".usda")
    mine.subLayerPaths.append(base.identifier)
    stage = Usd.Stage.Open(mine)
    closet = next(prim.GetPath() for prim in stage.Traverse() if prim.GetName() == "closet")
    for number in layers:
        Sdf.CreatePrimInLayer((base, mine)[number], closet).active = False
    assert "closet" not in read_graph(stage).names
    update_graph(stage, GRAPH)
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # of a relation that is stated twice
        assert read_graph(stage) == GRAPH
    assert mine.GetPrimAtPath(closet).HasInfo("active") == (0 in layers)


@given(first=scene_graphs(), second=scene_graphs())
@SOME
def test_over_a_reference(first, second):
    source = graph_layer(first)
    before = source.ExportToString()
    stage = Usd.Stage.CreateInMemory()
    stage.DefinePrim("/House/Bedroom").GetReferences().AddReference(source.identifier)
    write_graph(second, stage, room="/House/Bedroom")
    assert read_graph(stage) == second
    assert source.ExportToString() == before


@given(graph=scene_graphs())
@SOME
def test_the_same_graph_authors_nothing(graph):
    layer = graph_layer(graph)
    before = layer.ExportToString()
    update_graph(layer, graph)
    assert layer.ExportToString() == before
    mine = Sdf.Layer.CreateAnonymous(".usda")
    mine.subLayerPaths.append(layer.identifier)
    untouched = mine.ExportToString()
    update_graph(Usd.Stage.Open(mine), graph)
    assert mine.ExportToString() == untouched


def furnished() -> Sdf.Layer:
    """A room on whose prims somebody else has worked, too."""
    layer = graph_layer(GRAPH)
    stage = Usd.Stage.Open(layer)
    bed = UsdGeom.Xform.Get(stage, "/Room/Objects/bed")
    bed.AddTranslateOp().Set(Gf.Vec3d(1, 0, 2))
    mesh = UsdGeom.Mesh.Define(stage, "/Room/Objects/bed/mesh")
    mesh.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (0, 1, 0)])
    closet = stage.GetPrimAtPath("/Room/Objects/closet")
    closet.GetReferences().AddReference("./closet.usda")
    closet.SetCustomDataByKey("studio:asset", 42)
    lamp = UsdGeom.Xform.Define(stage, "/Room/Lights/lamp")
    lamp.GetPrim().CreateRelationship("studio:aims").SetTargets(["/Room/Objects/bed"])
    stage.OverridePrim("/Room/SceneGraph/stand__left__bed").CreateAttribute(
        "studio:note", Sdf.ValueTypeNames.String
    ).Set("checked by Kim")
    return layer


def specs(layer: Sdf.Layer) -> dict[str, str]:
    """The text of every property and the metadata of every prim, by path."""
    found: dict[str, str] = {}

    def visit(path: Sdf.Path) -> None:
        spec = layer.GetObjectAtPath(path)
        if isinstance(spec, Sdf.PropertySpec):
            keys = {key: str(spec.GetInfo(key)) for key in sorted(spec.ListInfoKeys())}
            targets = str(spec.targetPathList) if isinstance(spec, Sdf.RelationshipSpec) else ""
            found[str(path)] = f"{keys} {targets}"
        elif isinstance(spec, Sdf.PrimSpec):
            found[str(path)] = str({key: str(spec.GetInfo(key)) for key in sorted(spec.ListInfoKeys())})

    layer.Traverse(Sdf.Path.absoluteRootPath, visit)
    return found


EDITS = {
    "lock": (lambda g: g.lock("bed"), {"/Room/Objects/bed.echo:locked"}),
    "unlock": (lambda g: g.lock("stand", False), {"/Room/Objects/stand.echo:locked"}),
    "relabel": (
        lambda g: g.update_node("bed", category="single_bed"),
        {"/Room/Objects/bed.echo:category", "/Room/Objects/bed.semantics:labels:category"},
    ),
    "attribute": (
        lambda g: g.update_node("bed", attributes={"colour": "blue", "pillows": 2}),
        {"/Room/Objects/bed.echo:attributes:colour", "/Room/Objects/bed.echo:attributes:pillows"},
    ),
    "unrelate a relation with a foreign note": (
        lambda g: g.unrelate("stand", "left", "bed"),
        {"/Room/SceneGraph/stand__left__bed"},
    ),
    "unrelate": (
        lambda g: g.unrelate("closet", "taller_than", "bed"),
        {
            "/Room/SceneGraph/closet__taller_than__bed" + part
            for part in ("", ".echo:subject", ".echo:object", ".echo:predicate", ".echo:confidence")
        },
    ),
    "confidence": (
        lambda g: g.unrelate("closet", "taller_than", "bed").relate("closet", "taller_than", "bed", 0.25),
        {"/Room/SceneGraph/closet__taller_than__bed.echo:confidence"},
    ),
    "remove an object with foreign content": (
        lambda g: g.remove_node("bed"),
        {"/Room/Objects/bed"}
        | {"/Room/SceneGraph/stand__left__bed"}
        | {
            "/Room/SceneGraph/closet__taller_than__bed" + part
            for part in ("", ".echo:subject", ".echo:object", ".echo:predicate", ".echo:confidence")
        },
    ),
    "room type": (
        lambda g: SceneGraph("study", g.nodes, g.relations),
        {"/Room/SceneGraph.echo:roomType"},
    ),
}


@pytest.mark.parametrize("name", EDITS)
def test_only_the_prims_concerned_change(name):
    edit, touched = EDITS[name]
    layer = furnished()
    before = specs(layer)
    wanted = edit(GRAPH)
    update_graph(layer, wanted)
    after = specs(layer)
    assert {path for path in before.keys() | after.keys() if before.get(path) != after.get(path)} == touched
    stage = Usd.Stage.Open(layer)
    assert read_graph(stage) == wanted
    assert stage.GetAttributeAtPath("/Room/Objects/bed.xformOp:translate") or name.startswith("remove an object")


def test_an_object_taken_out_comes_back_with_what_was_on_it():
    layer = furnished()
    before = layer.ExportToString()
    update_graph(layer, GRAPH.remove_node("bed"))
    stage = Usd.Stage.Open(layer)
    assert not stage.GetPrimAtPath("/Room/Objects/bed").IsActive()
    assert layer.GetPrimAtPath("/Room/Objects/bed/mesh")
    update_graph(layer, GRAPH)
    assert read_graph(stage) == GRAPH
    assert not stage.GetPrimAtPath("/Room/Objects/bed").HasAuthoredActive()
    assert sorted(before.split()) == sorted(
        word for line in layer.ExportToString().splitlines() if "reorder" not in line for word in line.split()
    )


def test_another_predicate_renames_the_prim_in_place():
    layer = graph_layer(GRAPH)
    update_graph(layer, GRAPH.unrelate("stand", "left", "bed").relate("stand", "right", "bed"))
    names = [spec.name for spec in layer.GetPrimAtPath("/Room/SceneGraph").nameChildren]
    assert names == ["stand__right__bed", "closet__taller_than__bed"]


def test_another_word_for_an_obstacle_is_its_label_as_well():
    harp = SceneGraph("study", (Node("thing", "cabinet", attributes={"obstacle": "harp"}), Node("desk", "desk")))
    layer = graph_layer(harp)
    for word in ("cello", None):
        attributes = {"obstacle": word} if word else {}
        write_graph(harp.update_node("thing", attributes=attributes), layer)
        labels = layer.GetAttributeAtPath("/Room/Objects/thing.semantics:labels:category")
        assert list(labels.default) == [word or "cabinet"]


@pytest.mark.parametrize("name", ["two\nlines", "long " * 30, "  "])
def test_display_names_of_other_hosts_are_no_titles_where_they_do_not_fit(name):
    layer = graph_layer(GRAPH)
    layer.GetPrimAtPath("/Room/Objects/bed").SetInfo("displayName", name)
    graph = read_graph(Usd.Stage.Open(layer))
    assert graph == GRAPH
    write_graph(graph.update_node("bed", style="oak"), layer)
    assert layer.GetPrimAtPath("/Room/Objects/bed").GetInfo("displayName") == name


def test_a_room_in_an_instance_is_refused():
    source = graph_layer(GRAPH)
    stage = Usd.Stage.CreateInMemory()
    room = stage.DefinePrim("/House/Bedroom")
    room.GetReferences().AddReference(source.identifier)
    room.SetInstanceable(True)
    before = stage.GetRootLayer().ExportToString()
    with pytest.raises(StageError, match=r"the room is an instance, allowed: rooms with instanceable = false"):
        update_graph(stage, GRAPH.lock("bed"))
    assert stage.GetRootLayer().ExportToString() == before


def test_a_usdc_on_disk(tmp_path):
    path = tmp_path / "room.usdc"
    save_layer(graph_layer(GRAPH), path)
    stage = Usd.Stage.Open(str(path))
    update_graph(stage, GRAPH.lock("closet"))
    stage.Save()
    assert read_graph(path) == GRAPH.lock("closet")


@pytest.mark.parametrize(("specifier", "kind"), [("over", "Xform"), ("over", ""), ("def", "")])
def test_a_prim_that_is_no_xform_yet_becomes_one_with_what_it_holds(specifier, kind):
    layer = graph_layer(GRAPH.remove_node("bed"))
    prim = Sdf.CreatePrimInLayer(layer, "/Room/Objects/bed")
    prim.specifier = Sdf.SpecifierDef if specifier == "def" else Sdf.SpecifierOver
    if kind:
        prim.typeName = kind
    Sdf.AttributeSpec(prim, "mine", Sdf.ValueTypeNames.Int).default = 3
    stage = Usd.Stage.Open(layer)
    update_graph(stage, GRAPH)
    bed = stage.GetPrimAtPath("/Room/Objects/bed")
    assert (bed.IsDefined(), bed.GetTypeName(), bed.GetAttribute("mine").Get()) == (True, "Xform", 3)
    assert set(read_graph(stage).names) == set(GRAPH.names)


def test_new_objects_come_to_those_that_are_there():
    stage = Usd.Stage.CreateInMemory()
    write_graph(GRAPH, stage, room="/Room")
    layer = stage.GetRootLayer()
    moves = Sdf.BatchNamespaceEdit()
    moves.Add("/Room/Objects", "/Room/Furniture")
    assert layer.Apply(moves)
    for prim in layer.GetPrimAtPath("/Room/SceneGraph").nameChildren:
        for end in prim.relationships:
            end.targetPathList.explicitItems = [
                path.ReplacePrefix("/Room/Objects", "/Room/Furniture") for path in end.targetPathList.explicitItems
            ]
    update_graph(stage, GRAPH.add_node("plant", "plant"))
    assert stage.GetPrimAtPath("/Room/Furniture/plant")
    assert not stage.GetPrimAtPath("/Room/Objects")


def test_the_first_objects_of_a_graph_get_a_place():
    layer = graph_layer(GRAPH)
    del layer.GetPrimAtPath("/Room").nameChildren["Objects"]
    for prim in list(layer.GetPrimAtPath("/Room/SceneGraph").nameChildren):
        del layer.GetPrimAtPath("/Room/SceneGraph").nameChildren[prim.name]
    update_graph(layer, GRAPH)
    assert read_graph(Usd.Stage.Open(layer)) == GRAPH


def test_prims_named_in_any_script_are_nodes_and_keep_their_names():
    stage = Usd.Stage.CreateInMemory()
    write_graph(GRAPH, stage)
    editor = Usd.NamespaceEditor(stage)
    for old, new in (("stand", "Nachttisch_groß"), ("closet", "衣柜")):
        assert editor.MovePrimAtPath(f"/Room/Objects/{old}", f"/Room/Objects/{new}")
        assert editor.ApplyEdits()
    graph = read_graph(stage)
    assert graph.names == ("bed", "Nachttisch_gross", "wardrobe")
    assert [node.title for node in graph.nodes] == [None, "Nachttisch_groß", "衣柜"]
    assert [str(relation) for relation in graph.relations] == [
        "Nachttisch_gross left bed", "wardrobe taller_than bed"
    ]  # fmt: skip
    update_graph(stage, graph.unrelate("wardrobe", "taller_than", "bed").relate("wardrobe", "front", "bed").lock("bed"))
    names = [prim.GetName() for prim in stage.GetPrimAtPath("/Room/Objects").GetChildren()]
    assert names == ["bed", "Nachttisch_groß", "衣柜"]
    assert "wardrobe front bed" in map(str, read_graph(stage).relations)
    update_graph(stage, read_graph(stage).remove_node("wardrobe"))
    assert [str(path) for path in (p.GetPath() for p in stage.GetPrimAtPath("/Room/Objects").GetChildren())] == [
        "/Room/Objects/bed", "/Room/Objects/Nachttisch_groß"
    ]  # fmt: skip
