"""Every way a stage can fail to hold a graph, and what the error says."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
from pxr import Sdf, Usd

from echousd.graph import Node, Relation, SceneGraph
from echousd.stage.encoding import StageError
from echousd.stage.files import open_stage
from echousd.stage.graphs import save_layer, write_graph
from echousd.stage.read import read_graph, read_rooms
from echousd.stage.write import graph_layer

GRAPH = SceneGraph(
    "bedroom",
    (Node("bed", "double_bed"), Node("stand", "nightstand")),
    (Relation("stand", "left", "bed"),),
)
EDGE = "/Room/SceneGraph/stand__left__bed"


def complaint(what) -> str:
    with pytest.raises(StageError) as caught:
        read_graph(what)
    message = str(caught.value)
    assert "\n" not in message
    assert len(message) < 600
    return message


def changed(edit) -> Usd.Stage:
    stage = Usd.Stage.Open(graph_layer(GRAPH))
    edit(stage)
    return stage


def test_a_path_that_does_not_exist(tmp_path):
    assert complaint(tmp_path / "none.usda") == f"{tmp_path}/none.usda: no such file"


def test_a_folder(tmp_path):
    with pytest.raises(ValueError, match=f"^{re.escape(str(tmp_path))}: no room in this folder$"):
        read_graph(tmp_path)


@pytest.mark.parametrize("name", ["room.usda", "room.usdc", "room.usd", "room.usdz"])
@pytest.mark.parametrize("content", [b"", b"hello\n", b"\x89PNG\r\n\x1a\n" + bytes(64)])
def test_a_file_that_is_not_usd(tmp_path, name, content, capfd):
    path = tmp_path / name
    path.write_bytes(content)
    assert complaint(path).startswith(f"{path}: not a USD file that can be read (")
    assert capfd.readouterr() == ("", "")


def test_another_kind_of_file(tmp_path):
    (tmp_path / "room.png").write_bytes(b"")
    assert complaint(tmp_path / "room.png") == (
        f"{tmp_path}/room.png: not a USD file (extension '.png'), allowed: .usda, .usdc, .usd, .usdz"
    )


@pytest.mark.parametrize("share", [0.01, 0.3, 0.6, 0.99])
def test_a_truncated_usdc(tmp_path, share):
    path = tmp_path / "room.usdc"
    save_layer(graph_layer(GRAPH), path)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(len(whole) * share)])
    assert complaint(path).startswith(f"{path}: not a USD file that can be read (")


def test_a_prim_name_that_is_no_identifier(tmp_path):
    path = tmp_path / "room.usda"
    text = graph_layer(GRAPH).ExportToString().replace('"bed"', '"king size bed"')
    path.write_text(text)
    message = complaint(path)
    assert re.search(r"room.usda:\d+:\d+: 'king size bed' is not a valid prim name", message)


def test_a_name_that_usd_allows_and_the_graph_does_not():
    name = "Stuhl_für_Gäste" * 9
    stage = changed(lambda stage: stage.DefinePrim(f"/Room/Objects/{name}", "Xform"))
    prim = stage.GetPrimAtPath(f"/Room/Objects/{name}")
    prim.ApplyAPI("EchoNodeAPI")
    prim.CreateAttribute("echo:category", Sdf.ValueTypeNames.Token).Set("chair")
    message = complaint(stage)
    assert f"</Room/Objects/{name}>" in message
    assert "name" in message
    assert "allowed: " in message


def test_cyclic_sublayers(tmp_path, capfd):
    for one, other in (("a", "b"), ("b", "a")):
        (tmp_path / f"{one}.usda").write_text(f"#usda 1.0\n(\n    subLayers = [@./{other}.usda@]\n)\n")
    message = complaint(tmp_path / "a.usda")
    assert message.startswith(f"{tmp_path}/a.usda: does not compose: Sublayer hierarchy")
    assert "has cycles" in message
    assert capfd.readouterr().err == ""


def test_a_sublayer_that_is_missing(tmp_path):
    (tmp_path / "a.usda").write_text("#usda 1.0\n(\n    subLayers = [@./gone.usda@]\n)\n")
    message = complaint(tmp_path / "a.usda")
    assert "does not compose: Could not load sublayer" in message
    assert "gone.usda" in message


def test_a_stage_without_a_graph():
    stage = Usd.Stage.CreateInMemory()
    stage.DefinePrim("/Room", "Xform")
    name = stage.GetRootLayer().identifier
    assert complaint(stage) == (
        f"{name}: no scene graph (no EchoSceneGraph prim) and no prims with semantics labels and bounds to make one "
        "of; --names takes the names of prims for labels"
    )
    assert read_rooms(stage) == {}
    with pytest.raises(StageError, match="no scene graph"):
        read_graph(stage, room="/Room")


def test_a_graph_without_objects():
    stage = changed(lambda stage: stage.RemovePrim("/Room/Objects"))
    stage.RemovePrim("/Room/SceneGraph/stand__left__bed")
    assert complaint(stage).endswith("</Room/SceneGraph>: the graph is empty, allowed: at least one object")


def test_an_absent_default_prim():
    stage = changed(lambda stage: stage.ClearDefaultPrim())
    assert read_graph(stage) == GRAPH  # found by its type, wherever it is
    other = Usd.Stage.CreateInMemory()
    other.DefinePrim("/Here").GetReferences().AddReference(stage.GetRootLayer().identifier)
    errors = [str(error) for error in other.GetCompositionErrors()]
    assert len(errors) == 1
    assert "defaultPrim" in errors[0] or "default prim" in errors[0]
    assert "no scene graph" in complaint(other)


def test_a_reference_to_a_file_without_default_prim(tmp_path):
    layer = graph_layer(GRAPH)
    layer.ClearDefaultPrim()
    save_layer(layer, tmp_path / "room.usda")
    (tmp_path / "house.usda").write_text('#usda 1.0\ndef "House" (\n    references = @./room.usda@\n)\n{\n}\n')
    message = complaint(tmp_path / "house.usda")
    assert message.startswith(f"{tmp_path}/house.usda: does not compose: ")
    assert "room.usda" in message
    assert "default" in message


def test_a_dangling_target():
    stage = changed(lambda s: s.GetRelationshipAtPath(f"{EDGE}.echo:object").SetTargets(["/Room/Objects/sofa"]))
    assert complaint(stage).endswith(
        f"<{EDGE}>: echo:object points to </Room/Objects/sofa>, where no prim is, allowed: a node of the room"
    )


def test_a_target_that_is_no_node():
    stage = changed(lambda s: s.GetRelationshipAtPath(f"{EDGE}.echo:object").SetTargets(["/Room/Objects"]))
    assert complaint(stage).endswith(
        f"<{EDGE}>: echo:object points to </Room/Objects>, which is no node of this room (no EchoNodeAPI), "
        "allowed: a node of the room"
    )


def test_a_target_that_the_namespace_editor_deleted():
    stage = changed(lambda stage: None)
    editor = Usd.NamespaceEditor(stage)
    editor.DeletePrimAtPath("/Room/Objects/bed")
    assert editor.ApplyEdits()
    assert complaint(stage).endswith(f"<{EDGE}>: echo:object has 0 targets, allowed: exactly one")


def test_two_targets():
    both = ["/Room/Objects/bed", "/Room/Objects/stand"]
    stage = changed(lambda stage: stage.GetRelationshipAtPath(f"{EDGE}.echo:subject").SetTargets(both))
    assert complaint(stage).endswith(
        f"<{EDGE}>: echo:subject has 2 targets (/Room/Objects/bed, /Room/Objects/stand), allowed: exactly one"
    )


def test_no_subject_at_all():
    stage = changed(lambda stage: stage.GetPrimAtPath(EDGE).RemoveProperty("echo:subject"))
    assert complaint(stage).endswith(f"<{EDGE}>: echo:subject has 0 targets, allowed: exactly one")


def test_an_unknown_predicate():
    stage = changed(lambda stage: stage.GetAttributeAtPath(f"{EDGE}.echo:predicate").Set("lefft"))
    message = complaint(stage)
    assert f"<{EDGE}>: relation 'stand lefft bed': " in message
    assert "unknown predicate 'lefft': did you mean left?" in message


def test_no_predicate():
    stage = changed(lambda stage: stage.GetPrimAtPath(EDGE).RemoveProperty("echo:predicate"))
    assert complaint(stage).endswith(f"<{EDGE}>: echo:predicate has no value, allowed: one predicate")


def test_a_predicate_of_another_type():
    def edit(stage):
        prim = stage.GetPrimAtPath(EDGE)
        prim.RemoveProperty("echo:predicate")
        spec = stage.GetRootLayer().GetPrimAtPath(EDGE)
        Sdf.AttributeSpec(spec, "echo:predicate", Sdf.ValueTypeNames.Double3).default = (1, 2, 3)

    message = complaint(changed(edit))
    assert f"<{EDGE}>" in message
    assert "predicate" in message


def test_an_unknown_category():
    stage = changed(lambda stage: stage.GetAttributeAtPath("/Room/Objects/bed.echo:category").Set("bedd"))
    message = complaint(stage)
    assert "</Room/Objects/bed>: object 'bed': category: unknown category 'bedd': did you mean" in message


def test_a_node_without_category():
    def edit(stage):
        for name in ("echo:category", "semantics:labels:category"):
            stage.GetPrimAtPath("/Room/Objects/bed").RemoveProperty(name)

    assert complaint(changed(edit)).endswith(
        "</Room/Objects/bed>: no category, allowed: echo:category or semantics:labels:category with one word"
    )


def test_an_unknown_vocabulary():
    stage = changed(lambda stage: stage.GetAttributeAtPath("/Room/SceneGraph.echo:vocabulary").Set("echo-9"))
    assert complaint(stage).endswith("</Room/SceneGraph>: echo:vocabulary is 'echo-9', allowed: echo-1")


def test_contradictory_relations():
    def edit(stage):
        prim = stage.DefinePrim("/Room/SceneGraph/mine", "EchoRelation")
        prim.CreateRelationship("echo:subject").SetTargets(["/Room/Objects/bed"])
        prim.CreateRelationship("echo:object").SetTargets(["/Room/Objects/stand"])
        prim.CreateAttribute("echo:predicate", Sdf.ValueTypeNames.Token).Set("left")

    message = complaint(changed(edit))
    assert "</Room/SceneGraph>: " in message
    assert "'stand left bed'" in message
    assert "'bed left stand'" in message
    assert "contradict" in message


def test_two_nodes_of_one_name():
    def edit(stage):
        prim = stage.DefinePrim("/Room/Objects/bed/stand", "Xform")
        prim.ApplyAPI("EchoNodeAPI")
        prim.CreateAttribute("echo:category", Sdf.ValueTypeNames.Token).Set("chair")

    message = complaint(changed(edit))
    assert "two nodes are called 'stand': </Room/Objects/bed/stand> and </Room/Objects/stand>" in message


def test_two_graphs_of_one_room():
    stage = changed(lambda stage: stage.DefinePrim("/Room/Other", "EchoSceneGraph"))
    assert complaint(stage).endswith("two EchoSceneGraph prims describe the same room, allowed: one per room")


@pytest.mark.parametrize(
    "attribute", ["echo:attributes:note", "echo:style", "echo:category", "semantics:labels:category"]
)
def test_ten_megabytes_of_text(attribute, tmp_path):
    layer = graph_layer(GRAPH)
    spec = layer.GetPrimAtPath("/Room/Objects/bed")
    huge = "x" * 10_000_000
    if attribute.startswith("semantics"):
        spec.properties["echo:category"].default = Sdf.ValueBlock()
        spec.properties[attribute].default = [huge]
    elif attribute in spec.properties:
        spec.properties[attribute].default = huge
    else:
        Sdf.AttributeSpec(spec, attribute, Sdf.ValueTypeNames.String).default = huge
    save_layer(layer, tmp_path / "room.usdc")
    message = complaint(tmp_path / "room.usdc")
    assert "</Room/Objects/bed>" in message
    assert "a text of 10000000 characters, allowed: 65536" in message


def test_a_confidence_out_of_range():
    stage = changed(lambda stage: stage.GetPrimAtPath(EDGE).GetAttribute("echo:confidence").Set(1.5))
    assert complaint(stage).endswith(
        f"<{EDGE}>: relation 'stand left bed': confidence: found 1.5, allowed: a number from 0 to 1"
    )


def test_a_size_of_another_type():
    def edit(stage):
        spec = stage.GetRootLayer().GetPrimAtPath("/Room/Objects/bed")
        Sdf.AttributeSpec(spec, "echo:size", Sdf.ValueTypeNames.Double2).default = (1, 2)

    message = complaint(changed(edit))
    assert "</Room/Objects/bed>: object 'bed': size: found" in message
    assert "allowed: three positive numbers" in message


# -- writing ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("root", ["Room", "/Room/", "/my room", "", "/", "/Room.attribute", "/1st"])
def test_a_root_that_is_no_prim_path(root):
    layer = Sdf.Layer.CreateAnonymous()
    with pytest.raises(StageError, match=r"is no prim path, allowed: an absolute path of identifiers such as /Room$"):
        write_graph(GRAPH, layer, room=root)
    assert layer.empty


def test_a_folder_that_is_missing(tmp_path):
    with pytest.raises(StageError, match=r"nowhere/room.usda: the folder .*nowhere does not exist$"):
        save_layer(graph_layer(GRAPH), tmp_path / "nowhere" / "room.usda")
    assert list(tmp_path.iterdir()) == []


def test_no_graph_replaces_a_layer_over_others(tmp_path):
    """Such as the root of a room: `read_graph` reads it, and to write it back would leave nothing but the graph."""
    root = Sdf.Layer.CreateNew(str(tmp_path / "room.usda"))
    root.subLayerPaths.append("layers/graph.usda")
    root.Save()
    before = (tmp_path / "room.usda").read_bytes()
    with pytest.raises(StageError, match=r"room\.usda: has sublayers, which a new file would lose; allowed: another"):
        write_graph(GRAPH, tmp_path / "room.usda")
    assert (tmp_path / "room.usda").read_bytes() == before


def test_an_extension_that_cannot_be_written(tmp_path):
    with pytest.raises(StageError, match=r"room.usdz: extension '.usdz', allowed: .usda, .usdc, .usd$"):
        save_layer(graph_layer(GRAPH), tmp_path / "room.usdz")


def test_a_target_that_is_a_folder(tmp_path):
    (tmp_path / "room.usda").mkdir()
    with pytest.raises(StageError, match=r"room.usda: cannot be written \(Is a directory\)$"):
        save_layer(graph_layer(GRAPH), tmp_path / "room.usda")
    assert [path.name for path in tmp_path.iterdir()] == ["room.usda"]


def test_a_folder_that_cannot_be_written():
    locked = next((Path(name) for name in ("/proc", "/sys") if Path(name).is_dir()), None)
    if locked is None:
        pytest.skip("no folder here that nobody can write to")
    with pytest.raises(StageError, match=r"/room.usda: cannot be written \("):
        save_layer(graph_layer(GRAPH), locked / "room.usda")


def test_a_write_that_breaks_off_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "room.usda"
    save_layer(graph_layer(GRAPH), path)
    before = path.read_bytes()
    monkeypatch.setattr(Path, "replace", lambda self, target: (_ for _ in ()).throw(OSError(28, os.strerror(28))))
    with pytest.raises(StageError, match=r"room.usda: cannot be written \(No space left on device\)$"):
        save_layer(graph_layer(GRAPH.lock("bed")), path)
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["room.usda"]


def test_what_was_read_once_is_read_again_from_disk(tmp_path):
    path = tmp_path / "room.usda"
    save_layer(graph_layer(GRAPH), path)
    stage = open_stage(path)
    assert read_graph(stage) == GRAPH
    save_layer(graph_layer(GRAPH.lock("bed")), path)
    assert read_graph(path) == GRAPH.lock("bed")
