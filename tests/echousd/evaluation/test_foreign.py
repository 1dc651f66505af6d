"""Rooms from elsewhere: read as they were written, wherever that was."""

import json
import math

import numpy as np
import pytest
import trimesh

from echomodel.data.roomset import pack_rooms
from echomodel.metrics.layouts import tasks_of
from echomodel.roomboxes import write_rooms
from echomodel.rooms.generator import generate_rooms
from echousd.evaluation import runs
from echousd.evaluation.runs import SuiteSettings, rooms_against, rooms_from, rooms_of
from echousd.evaluation.suite import evaluate
from echousd.evaluation.systems import System
from echousd.stage.boxes import write_stages


def same(a, b, digits=3):
    return (
        a.categories == b.categories
        and np.allclose(a.size, b.size, atol=10**-digits)
        and np.allclose(a.position, b.position, atol=10**-digits)
        and np.allclose(np.cos(a.yaw - b.yaw), 1, atol=10**-digits)
    )


@pytest.fixture(scope="module")
def rooms():
    return generate_rooms(3, 5)


def test_rooms_files_and_stages(rooms, tmp_path):
    write_rooms(tmp_path / "rooms.json", rooms)
    write_stages(rooms, tmp_path / "usd")
    (tmp_path / "single").mkdir()
    (tmp_path / "single" / "one.json").write_text(json.dumps(rooms[0].to_json()))
    for path, count in (("rooms.json", 3), ("usd", 3), ("single", 1)):
        found = sorted(rooms_from(tmp_path / path), key=lambda room: room.id)
        assert len(found) == count
        assert all(same(a, b) for a, b in zip(found, sorted(rooms, key=lambda room: room.id), strict=False))


def test_a_folder_is_read_whole_whatever_its_rooms_are_written_as(rooms, tmp_path):
    write_rooms(tmp_path / "rooms.json", rooms[:2])
    write_stages(rooms[2:], tmp_path)
    assert sorted(room.id for room in rooms_from(tmp_path)) == sorted(room.id for room in rooms)


def state(matrix, model="data.m1"):
    wall = {"id": 1, "roomId": "bedroom", "type": "Wall", "height": 2.5, "points": [[0, 0, 0], [4, 0, 0]], "holes": []}
    floor = {"id": 0, "roomId": "bedroom", "type": "Floor", "points": [[0, 0, 0], [4, 0, 0], [4, 6, 0], [0, 6, 0]]}
    thing = {"index": 0, "modelId": model, "transform": {"data": np.asarray(matrix, float).T.flatten().tolist()}}
    return {"format": "sceneState", "scene": {"arch": {"elements": [floor, wall]}, "object": [thing]}}


def test_sceneeval_tells_sizes_by_its_models(tmp_path):
    folder = tmp_path / "_data" / "set" / "m1"
    folder.mkdir(parents=True)
    box = trimesh.creation.box((1.0, 0.5, 2.0), trimesh.transformations.translation_matrix((0, 0.25, 0)))
    trimesh.Scene(box).export(folder / "m1.glb")
    (folder / "data.json").write_text(json.dumps({"annotations": {"category": "coffee table"}}))
    # upright by a quarter about x, then a quarter about z (up there), at (1, 2)
    upright = trimesh.transformations.rotation_matrix(math.pi / 2, [1, 0, 0])
    turn = trimesh.transformations.rotation_matrix(math.pi / 2, [0, 0, 1], [0, 0, 0])
    matrix = trimesh.transformations.translation_matrix((1, 2, 0)) @ turn @ upright
    (tmp_path / "scene_0.json").write_text(json.dumps(state(matrix)))
    (room,) = rooms_from(tmp_path)
    assert room.categories == ("coffee_table",)
    assert room.room_type == "bedroom"
    assert room.height == 2.5
    assert room.size[0] == pytest.approx([1.0, 0.5, 2.0])
    assert room.position[0] == pytest.approx([1.0, 0.0, -2.0], abs=1e-6)
    assert room.yaw[0] == pytest.approx(math.pi / 2)  # its front looks along +x
    assert room.floor_polygon.tolist() == [[0, 0], [4, 0], [4, -6], [0, -6]]
    (tmp_path / "scene_1.json").write_text(json.dumps(state(matrix, "data.gone")))
    with pytest.raises(ValueError, match=r"scene_1.json: model data.gone is not there, wanted: _data/<data set>/gone"):
        rooms_from(tmp_path)


def test_holodeck_is_mirrored_and_in_centimetres(tmp_path):
    sofa = {"id": "sofa-0 (living)", "object_name": "sofa-0", "roomId": "living", "rotation": {"x": 0, "y": 90, "z": 0},
            "position": {"x": 1.0, "y": 0.4, "z": 2.0},
            "vertices": [[45, 95], [155, 95], [155, 305], [45, 305]]}  # fmt: skip
    corners = [{"x": x, "y": 0, "z": z} for x, z in ((0, 0), (0, 4), (5, 4), (5, 0))]
    house = {"rooms": [{"id": "living", "roomType": "living room", "floorPolygon": corners}], "walls": [],
             "objects": [sofa], "wall_height": 2.7}  # fmt: skip
    (tmp_path / "house.json").write_text(json.dumps(house))
    (room,) = rooms_from(tmp_path / "house.json")
    assert room.size[0] == pytest.approx([2.0, 0.8, 1.0])
    assert room.position[0] == pytest.approx([-1.0, 0.0, 2.0])
    assert math.sin(room.yaw[0]) == pytest.approx(-1.0)  # +x there is -x here
    assert room.room_type == "living_room"
    assert room.floor_polygon[2].tolist() == [-5, 4]


def test_scenesmith_has_boxes_and_quaternions(tmp_path):
    half = math.sqrt(0.5)
    bed = {"object_type": "furniture", "name": "double bed", "bbox_min": [-0.8, -1.0, 0.0], "bbox_max": [0.8, 1.0, 0.6],
           "transform": {"translation": [1.0, 2.0, 0.0], "rotation_wxyz": [half, 0, 0, half]}}  # fmt: skip
    wall = bed | {"object_type": "wall"}
    raw = {
        "room_type": "bedroom",
        "objects": {"bed_0": bed, "wall_0": wall},
        "room_geometry": {"length": 4, "width": 5},
    }
    (tmp_path / "state.json").write_text(json.dumps(raw))
    (room,) = rooms_from(tmp_path)
    assert room.categories == ("double_bed",)
    assert room.size[0] == pytest.approx([1.6, 0.6, 2.0])
    assert room.position[0] == pytest.approx([1.0, 0.0, -2.0])
    # its front, +y turned to -x
    assert (math.sin(room.yaw[0]), math.cos(room.yaw[0])) == pytest.approx((-1.0, 0.0), abs=1e-9)
    assert np.ptp(room.floor_polygon, axis=0).tolist() == [4.0, 5.0]


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("a.json", '{"format": "sceneState", "scene": {}}', "a.json: not a room as it says (KeyError 'arch')"),
        ("a.json", '{"rooms": [{"id": 1}], "objects": [5], "walls": []}', "a.json: not a room as it says (Attr"),
        ("b.json", "{", "b.json: neither a stage (.usda, .usdc, .usd, .usdz), a set (.npz) nor JSON (Expecting"),
        ("bad.txt", "hello", "bad.txt: neither a stage (.usda, .usdc, .usd, .usdz), a set (.npz) nor JSON (Expecting"),
        ("c.json", "{}", "no rooms, a state of SceneEval, Holodeck's or SceneSmith's JSON"),
    ],
)
def test_bad_files_are_named(name, text, told, tmp_path):
    (tmp_path / name).write_text(text)
    with pytest.raises(ValueError) as error:  # noqa: PT011
        rooms_from(tmp_path / name)
    assert told in str(error.value)
    (tmp_path / "empty").mkdir()
    with pytest.raises(ValueError, match="empty: no room in this folder, allowed: rooms of ours, USD, rooms or scene"):
        rooms_from(tmp_path / "empty")


def test_they_stand_in_the_tables_with_what_was_left_out(rooms, tmp_path, monkeypatch):
    monkeypatch.setattr(runs, "HONEST", ("random", "real"))
    monkeypatch.setattr("echousd.evaluation.suite.HONEST", ("random", "real"))
    monkeypatch.setattr("echomodel.metrics.sets.TREES", 8)
    raw = [room.to_json() for room in rooms]
    raw[0]["objects"][0]["category"] = "sculpture"
    raw[1]["floor_polygon"] = []
    (tmp_path / "theirs.json").write_text(json.dumps({"convention": "", "rooms": raw}))
    name = str(tmp_path / "theirs.json")
    found, run = evaluate(SuiteSettings((name,), count=4, only=("faults", "realism")))
    assert len(run.made[name]) == 3
    told = " ".join(found["missing"])
    assert "objects that the vocabulary does not hold are left out: sculpture" in told
    assert "1 of 3 rooms have no floor" in told
    rows = found["tables"][0].rows
    assert rows[name]["told"].value is None  # nobody told anything
    assert rows[name]["faults"].value is not None
    assert rows["random"]["faults"].p is None  # other rooms: not paired
    (tmp_path / "one.json").write_text(json.dumps({"convention": "", "rooms": raw[2:]}))
    with pytest.raises(ValueError, match="1 rooms with known objects, 2 or more are needed for an interval"):
        rooms_of(System.parse(str(tmp_path / "one.json")), SuiteSettings())
    assert len(tasks_of(rooms, 0)) == 3


def test_systems_are_asked_rooms_of_any_source_and_of_sets_those_held_out(tmp_path):
    rooms = [room for room in generate_rooms(60, 5) if len(room) > 1][:24]
    write_stages(rooms[:4], tmp_path / "usd")
    write_rooms(tmp_path / "rooms.json", rooms[:6])
    pack_rooms(tmp_path / "set.npz", rooms, [k % 4 == 3 for k in range(24)], {})
    for name, count in (("usd", 4), ("rooms.json", 6), ("set.npz", 6)):
        asked, beside = rooms_against(SuiteSettings(against=str(tmp_path / name), count=8))
        assert len(asked) + len(beside) == count
    pack_rooms(tmp_path / "small.npz", rooms[:8], [False] * 8, {})
    with pytest.raises(ValueError, match=r"small.npz: 0 rooms .* 4 are needed \(of a set among those held out, every"):
        rooms_against(SuiteSettings(against=str(tmp_path / "small.npz")))
