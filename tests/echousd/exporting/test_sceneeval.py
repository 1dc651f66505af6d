"""A room for SceneEval: the fields that its reader asks for, models that stand where they stood, and back again."""

import json

import numpy as np
import pytest
import trimesh

import echousd
from echomodel.roomboxes import RoomBoxes
from echousd.cli.main import run
from echousd.evaluation.runs import rooms_from
from echousd.graph import SceneGraph

GRAPH = """
room: {type: bedroom, size: [4.0, 3.6]}
doors: [{wall: south, offset: 0.3}]
windows: [north 1.2 1.6]
objects: {bed: double_bed, stand: nightstand, wardrobe: wardrobe}
relations: [stand left of bed]
"""
# what SceneEval's readers take (scenes/scene_state.py, architecture.py, obj.py), and of which type
SCENE = {
    "version": str,
    "id": str,
    "up": list,
    "front": list,
    "unit": float,
    "assetSource": list,
    "arch": dict,
    "object": list,
}
ARCH = {"version": str, "id": str, "up": list, "front": list, "coords2d": list, "scaleToMeters": int, "elements": list}
OBJECT = {"id": str, "index": int, "modelId": str, "parentId": str, "parentIndex": int, "transform": dict}


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    folder = tmp_path_factory.mktemp("room")
    room = echousd.generate(SceneGraph.from_yaml(GRAPH), seed=3, dress="none")
    room.save(folder / "bedroom", preview=False)
    assert run(["export", str(folder / "bedroom"), "--for", "sceneeval", "-o", str(folder / "out")]) == 0
    return room, folder / "out"


def test_the_state_has_what_its_readers_ask_for(exported):
    room, out = exported
    state = json.loads((out / "input" / "EchoUSD" / "scene_0.json").read_text("utf-8"))
    assert state["format"] == "sceneState"
    scene = state["scene"]
    assert (scene["version"], scene["arch"]["version"]) == ("scene@1.0.2", "arch@1.0.2")
    for fields, found in ((SCENE, scene), (ARCH, scene["arch"]), *((OBJECT, one) for one in scene["object"])):
        assert all(type(found[name]) is kind for name, kind in fields.items())
    elements = scene["arch"]["elements"]
    assert {e["type"] for e in elements} == {"Floor", "Wall"}
    holes = [hole for e in elements for hole in e.get("holes", ())]
    assert sorted(hole["type"] for hole in holes) == ["Door", "Window"]
    assert all(hole["box"]["max"][k] > hole["box"]["min"][k] >= 0 for hole in holes for k in (0, 1))
    assert [one["modelId"] for one in scene["object"]] == [f"layoutvlm-objaverse.echousd_{name}" for name in room.names]
    assert all(len(one["transform"]["data"]) == 16 for one in scene["object"])


def test_models_stand_where_they_stood_with_z_up(exported):
    room, out = exported
    state = json.loads((out / "input" / "EchoUSD" / "scene_0.json").read_text("utf-8"))
    for k, entry in enumerate(state["scene"]["object"]):
        number = entry["modelId"].partition(".")[2]
        folder = out / "_data" / "layoutvlm-objathor" / number
        told = json.loads((folder / "data.json").read_text("utf-8"))["annotations"]
        assert set(told) == {"category", "description", "materials"}
        matrix = np.array(entry["transform"]["data"]).reshape(4, 4).T
        scene = trimesh.load_scene(folder / f"{number}.glb").apply_transform(matrix)
        low, high = scene.bounds
        box = room.boxes
        assert low[2] == pytest.approx(float(box.position[k, 1]), abs=2e-3)
        assert high[2] - low[2] == pytest.approx(float(box.size[k, 1]), abs=4e-3)
        middle = (low + high) / 2
        assert middle[:2] == pytest.approx([float(box.position[k, 0]), -float(box.position[k, 2])], abs=4e-3)


def test_what_was_exported_is_read_as_it_was(exported):
    room, out = exported
    (found,) = rooms_from(out / "input" / "EchoUSD")
    assert isinstance(found, RoomBoxes)
    assert found.categories == tuple(node.category for node in room.graph.nodes)
    assert np.allclose(found.position, room.boxes.position, atol=4e-3)
    assert np.allclose(np.sin(found.yaw), np.sin(room.boxes.yaw), atol=1e-3)
    assert found.room_type == "bedroom"


def test_other_names_are_refused(exported, tmp_path, capsys):
    assert run(["export", str(exported[1]), "--for", "unity", "-o", str(tmp_path)]) == 2
    capsys.readouterr()
