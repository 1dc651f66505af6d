"""`check` on several rooms, folders and patterns."""

import json
from functools import cache

import numpy as np
import pytest
from pxr import Usd, UsdGeom
from small_room import BARE, StandIn, small_graph

import echousd
from echomodel.boxes import Boxes


@cache
def room():
    graph = small_graph()
    for name in ("nightstand_left", "nightstand_right", "lamp"):
        graph = graph.remove_node(name)
    return echousd.generate(graph, seed=5, model=StandIn(), shapes="boxes", **BARE)


@pytest.fixture
def rooms(tmp_path):
    for name in ("a", "b"):
        room().save(tmp_path / name, preview=False)
    return tmp_path


def test_a_folder_and_a_pattern_of_rooms(rooms, echousd_command):
    done = echousd_command("check", rooms)
    assert [line.split()[:2] for line in done.out.splitlines()[:2]] == [
        ["ok" if done.code == 0 else line.split()[0], str(rooms / name / f"{name}.usda")]
        for name, line in zip("ab", done.out.splitlines(), strict=False)
    ]
    assert done.out.splitlines()[-1].endswith("of 2 rooms are good")
    found = json.loads(echousd_command("check", rooms / "*" / "*.usda", "--json").out)
    assert [entry["room"] for entry in found] == [str(rooms / n / f"{n}.usda") for n in "ab"]
    assert "ok" in json.loads(echousd_command("check", rooms / "a", "--json").out)


@pytest.mark.parametrize("flat", [False, True])
def test_a_stage_that_refers_to_rooms_side_by_side_is_checked_as_it_stands_there(rooms, echousd_command, flat):
    stage = Usd.Stage.CreateNew(str(rooms / "house.usda"))
    UsdGeom.SetStageUpAxis(stage, "Y")
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/House").GetPrim())
    for number, name in enumerate("ab"):
        prim = UsdGeom.Xform.Define(stage, f"/House/{name}")
        prim.GetPrim().GetReferences().AddReference(f"./{name}/{name}.usda")
        prim.AddTranslateOp().Set((10.0 * number, 0.0, 0.0))
    stage.Save()
    file = echousd.export(rooms / "house.usda", rooms / "flat.usdc") if flat else rooms / "house.usda"
    report = echousd.check(file)
    assert report.rooms == ("/House/a", "/House/b")
    assert json.loads(echousd_command("check", file, "--json").out) == report.to_json()


@pytest.mark.parametrize("pattern", ["*", "**", "**/*.usda", "?"])
def test_what_matches_a_pattern_and_is_no_room_is_left_out(rooms, echousd_command, pattern):
    (rooms / "manifest.json").write_text("{}")
    (rooms / "pictures").mkdir()
    found = json.loads(echousd_command("check", rooms / pattern, "--json").out)
    at = [entry["room"] for entry in found]
    if pattern == "**/*.usda":  # says itself that it means layers, too
        assert str(rooms / "a/layers/layout.usda") in at
        at = [path for path in at if not {"layers", "assets"} & set(path.split("/"))]
    assert at == [str(rooms / n / f"{n}.usda") for n in "ab"]
    done = echousd_command("check", rooms / "m*")
    assert (done.code, "matches no room" in done.err) == (2, True)


def test_a_room_that_cannot_be_read_costs_no_other_its_report(rooms, echousd_command):
    good = json.loads(echousd_command("check", rooms / "b", "--json").out)
    broken = rooms / "a" / "a.usda"
    broken.write_text("#usda 1.0\ndef (")
    done = echousd_command("check", rooms)
    lines = done.out.splitlines()
    assert done.code == 2
    assert lines[0].startswith(f"no  {broken}  not a USD file that can be read (")
    assert lines[1].startswith(f"ok  {rooms / 'b' / 'b.usda'}") == good["ok"]
    assert lines[2] == f"{int(good['ok'])} of 2 rooms are good, 1 cannot be read"
    done = echousd_command("check", rooms, rooms / "gone.usda", "--json")
    first, second, third = json.loads(done.out)
    assert done.code == 2
    assert (first["room"], first["ok"]) == (str(broken), False)
    assert first["error"].startswith("not a USD file that can be read (")
    assert second == {"room": str(rooms / "b" / "b.usda"), **good}
    done = echousd_command("check", rooms, "--rules", "lax")
    assert (done.code, done.out) == (2, "")
    assert third == {"room": str(rooms / "gone.usda"), "ok": False, "error": "no such file"}


def test_commands_of_one_room_take_its_folder(rooms, echousd_command):
    done = echousd_command("render", rooms / "a", "-o", rooms / "a.png", "--size", "32")
    assert done.code == 0, done.err
    done = echousd_command("export", rooms / "a", "-o", rooms / "a.usdz")
    assert done.code == 0, done.err
    done = echousd_command("edit", rooms / "a", "--lock", "bed", "--dry-run")
    assert (done.code, done.err) == (0, "")
    done = echousd_command("edit", rooms, "--lock", "bed")
    assert done.code == 2
    assert f"{rooms}: a folder of 2 rooms, name one file: a/a.usda, b/b.usda" in done.err
    done = echousd_command("edit", rooms / "a", "--lock", "bed", "--shapes", "boxes")
    assert done.code in (0, 1), done.err
    assert echousd.read_graph(rooms / "a" / "a.usda").node("bed").locked


def test_a_folder_without_rooms(tmp_path, echousd_command):
    done = echousd_command("check", tmp_path)
    assert (done.code, done.err) == (2, f"error: {tmp_path}: no room in this folder\n")
    assert echousd_command("render", tmp_path, "-o", tmp_path / "a.png").err == done.err
    assert "matches nothing" in echousd_command("check", tmp_path / "*.usda").err


def test_a_layout_of_ones_own():
    graph = small_graph()
    drawn = echousd.generate(graph, seed=5, model=StandIn(), shapes="boxes", **BARE).boxes
    moved = Boxes(drawn.size, drawn.position + np.float32([0.05, 0.0, 0.0]), drawn.yaw)
    room = echousd.generate(graph, model=StandIn(), shapes="boxes", boxes=moved, **BARE)
    np.testing.assert_allclose(room.boxes.position[:, [0, 2]], moved.position[:, [0, 2]], atol=2e-3)
    np.testing.assert_allclose(room.boxes.size, moved.size, atol=2e-3)
    with pytest.raises(ValueError, match="boxes: 1 for a graph of"):
        echousd.generate(graph, model=StandIn(), boxes=Boxes(drawn.size[:1], drawn.position[:1], drawn.yaw[:1]), **BARE)


def test_a_piece_of_ones_own(tmp_path):
    import trimesh

    file = tmp_path / "bed.obj"
    trimesh.creation.box((1.6, 0.6, 2.0)).export(file)
    room = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", meshes={"bed": file}, **BARE)
    assert room.geometry["bed"].origin.shapes == "own"
    with pytest.raises(ValueError, match=r"meshes: object 'bed': .*gone.glb: no such file"):
        echousd.generate(small_graph(), model=StandIn(), meshes={"bed": tmp_path / "gone.glb"}, **BARE)
