"""Small things as nodes of the graph: as many, where they are, in their own layer; readers of graphs pass over them."""

import json
from dataclasses import replace

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom

import echousd
from echomodel.dressing import KINDS
from echousd.batches.options import BatchOptions
from echousd.checks import check
from echousd.dressing.dress import dress, setting_of
from echousd.layers.compose import room_files
from echousd.make.flat import save_flat
from echousd.options import RoomOptions
from echousd.stage.encoding import StageError
from echousd.stage.read import read_graph

DRESSED = RoomOptions(walls=True, dress="full", dress_graph=True)


@pytest.fixture(scope="module")
def room():
    made = echousd.generate("samples/living_room.usda", seed=4, shapes="boxes", layouts=2, options=DRESSED)
    assert len(made.layouts) == 2
    return made


@pytest.fixture(scope="module")
def root(room, tmp_path_factory):
    return room.save(tmp_path_factory.mktemp("rooms") / "living_room", preview=False)


def copied(root, over):
    """A stage over a room, with more in its session: `over(stage)`."""
    stage = Usd.Stage.Open(str(root))
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        over(stage)
    return stage


def test_only_the_layer_of_the_dressing_knows(room):
    plain = room_files(replace(room, options=DRESSED.replaced(dress_graph=False)))
    told = room_files(room)
    assert [path for path in told if told[path] != plain.get(path)] == ["layers/dressing.usda"]
    assert set(plain) == set(told)


@pytest.mark.parametrize("number", [0, 1])
def test_nodes_are_the_things_that_the_stage_shows(root, room, number):
    def choose(stage):
        stage.GetPrimAtPath("/Room").GetVariantSet("layout").SetVariantSelection(f"layout_{number}")

    stage = copied(root, choose)
    things, found = dress(room).layouts[number], echousd.read_dressing(stage)
    assert [node.name for node in found.nodes] == list(things)
    assert len(things) >= 30
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default", "render"])
    for node in found.nodes:
        prim = stage.GetPrimAtPath(f"/Room/Dressing/{node.name}")
        thing = things[node.name]
        assert node.category == KINDS[thing.kind].name == prim.GetAttribute("semantics:labels:category").Get()[0]
        np.testing.assert_allclose(node.position, UsdGeom.XformCommonAPI(prim).GetXformVectors(0)[0], atol=1e-5)
        assert np.degrees(node.yaw) == pytest.approx(prim.GetAttribute("xformOp:rotateY").Get(), abs=1e-2)
        shown = cache.ComputeUntransformedBound(prim).ComputeAlignedRange()
        np.testing.assert_allclose(node.size, shown.GetSize(), atol=0.005)
        assert (node.place == "against_wall") <= KINDS[thing.kind].fixed
    assert {node.category for node in found.nodes if node.place} >= {"picture", "curtain"}


def test_relations_are_true(root, room):
    found, setting = echousd.read_dressing(root), setting_of(room)
    nodes = {node.name: node for node in found.nodes}
    assert {relation.predicate for relation in found.relations} >= {"standing_on", "above", "close_by"}
    subjects = [relation.subject for relation in found.relations]
    assert len(subjects) == len(set(subjects))
    for relation in found.relations:
        one = nodes[relation.subject]
        if relation.object in nodes:
            host = nodes[relation.object]
            assert host.category in ("wall_shelf", "window_sill")
            levels = [host.position[1] + host.size[1]]
        else:
            host = setting.objects[relation.object]
            levels = np.concatenate(host.pieces)[..., 1].ravel()
        if relation.predicate == "standing_on":
            away = np.hypot(one.position[0] - host.position[0], one.position[2] - host.position[2])
            assert away <= np.hypot(host.size[0], host.size[2]) / 2, relation
            cloth = one.category in ("throw", "cushion", "folded_blanket")
            assert cloth or np.min(np.abs(np.array(levels) - one.position[1])) < 0.01, relation
        elif relation.predicate == "above":
            assert one.position[1] >= host.top


def test_readers_of_graphs_pass_over_them(root, room):
    assert read_graph(root) == room.graph
    assert echousd.read_rooms(root) == {"/Room": room.graph}
    assert json.loads(root.with_suffix(".json").read_text("utf-8"))["graph"] == json.loads(room.graph.to_json())
    report = check(root)
    assert report.ok
    assert len(report.layouts[0].relations) == len(room.graph.relations)


def test_muted_things_and_nodes_are_gone(root, room):
    stage = Usd.Stage.Open(str(root))
    paths = [str(prim.GetPath()) for prim in stage.GetPrimAtPath("/Room/SceneGraph").GetChildren()]
    stage.MuteLayer(str(root.parent / "layers/dressing.usda"))
    left = [str(prim.GetPath()) for prim in stage.GetPrimAtPath("/Room/SceneGraph").GetChildren()]
    assert len(left) < len(paths)
    assert not stage.GetPrimAtPath("/Room/Dressing")
    found = echousd.read_dressing(stage)
    assert (found.nodes, found.relations) == ((), ())
    assert read_graph(stage) == room.graph


def test_switched_off_things_take_their_relations_along(root, room):
    stage = copied(root, lambda stage: stage.GetPrimAtPath("/Room/Dressing").SetActive(False))
    found = echousd.read_dressing(stage)
    assert (found.nodes, found.relations) == ((), ())
    assert read_graph(stage) == room.graph


@pytest.mark.parametrize("word", ["double_bed", "dragon", "x" * 9000])
def test_a_category_that_no_small_thing_has_is_said(root, word):
    def rename(stage):
        stage.GetPrimAtPath("/Room/Dressing/sofa_rug").GetAttribute("echo:category").Set(word)

    stage = copied(root, rename)
    with pytest.raises(StageError, match=r"</Room/Dressing/sofa_rug>: .*allowed") as error:
        echousd.read_dressing(stage)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 1000


def test_furniture_that_calls_itself_dressing_is_a_fault(root, tmp_path):
    layer = Sdf.Layer.CreateNew(str(tmp_path / "over.usda"))
    layer.subLayerPaths.append(str(root))
    sofa = Sdf.CreatePrimInLayer(layer, "/Room/Objects/sofa")
    Sdf.AttributeSpec(sofa, "echo:shapes", Sdf.ValueTypeNames.Token).default = "dressing"
    layer.Save()
    told = [f"{found}" for found in check(tmp_path / "over.usda").errors]
    assert any(
        "/Room/Objects/sofa" in one and "sofa" in one and "allowed of a small thing: backpack" in one for one in told
    )


def test_an_edited_room_goes_on_with_it(root, room, tmp_path):
    edited = echousd.edit(root, room.graph.remove_node("side_table"))
    assert edited.options.dress_graph
    again = edited.save(tmp_path / "edited", preview=False)
    assert read_graph(again) == room.graph.remove_node("side_table")
    found = echousd.read_dressing(again)
    assert found.nodes
    assert "side_table" not in {relation.object for relation in found.relations}
    assert check(again).ok


def test_flat_rooms_have_the_nodes_of_each_layout(room, tmp_path):
    there = save_flat(replace(room, options=DRESSED.replaced(up_axis="Z")), tmp_path / "flat.usda")
    assert read_graph(there) == room.graph
    stage = Usd.Stage.Open(str(there))
    for number, things in enumerate(dress(room).layouts):
        stage.GetPrimAtPath("/Room").GetVariantSet("layout").SetVariantSelection(f"layout_{number}")
        found = echousd.read_dressing(stage)
        assert [node.name for node in found.nodes] == list(things)
        assert {r.subject for r in found.relations} == {r.subject for r in dress(room).graphs[number].relations}


def test_nothing_to_write_is_an_error():
    with pytest.raises(ValueError, match=r"^dress_graph writes .*dress is 'none', allowed: some, full$"):
        RoomOptions(dress_graph=True, walls=False, dress="none")
    with pytest.raises(ValueError, match="dress is 'none'"):
        BatchOptions(dress="none", dress_graph=True)
    assert BatchOptions(dress_graph=True).dress_graph
