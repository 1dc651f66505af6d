"""Wishes about a finished room: where things stand, how they are turned, what is locked; and those of a layer."""

import hashlib
import json
import math
import shutil
from dataclasses import replace

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom
from small_room import BARE, StandIn, saved_room, small_graph

import echousd
from echousd.graph import GraphError
from echousd.graph.changes import EditRequest
from echousd.make.reading import read_room
from echousd.make.wishes import wished


@pytest.fixture(autouse=True)
def model(monkeypatch):
    from echomodel.echo import EchoModel

    monkeypatch.setattr(EchoModel, "load", classmethod(lambda cls, path=None, **options: StandIn()))


@pytest.fixture
def root(tmp_path):
    return saved_room(tmp_path / "bedroom", seed=5, shapes="boxes")


def box(root, name):
    saved = read_room(root)
    row = saved.graph.names.index(name)
    return [np.asarray(v[row], float) for v in (saved.boxes.size, saved.boxes.position, saved.boxes.yaw)]


def files(folder):
    found = (p for p in folder.rglob("*") if p.is_file() and p.parent.name != ".redo")
    return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in found}


def test_move_turn_lock_and_restyle_at_once(root, echousd_command):
    before = files(root.parent)
    words = ("--move", "wardrobe:1.2,1.0", "--turn", "wardrobe:180", "--lock", "bed", "--restyle", "bed:oak")
    done = echousd_command("edit", root, "--shapes", "boxes", *words)
    assert done.code in (0, 1), done.err  # the wish may cost a relation
    _, position, yaw = box(root, "wardrobe")
    np.testing.assert_allclose(position, (1.2, 0.0, 1.0), atol=1e-3)
    assert abs(math.remainder(float(yaw) - math.pi, 2 * math.pi)) < 1e-3
    graph = echousd.read_graph(root)
    assert graph.node("bed").locked
    assert graph.node("bed").style == "oak"
    after = files(root.parent)
    assert after["wardrobe_geo.usdc"] == before["wardrobe_geo.usdc"]


def test_a_style_is_told_of_the_room(root):
    saved = read_room(root)
    assert wished(saved, EditRequest(restyle=("room:bohemian",))).room.style == "boho"
    assert wished(saved, EditRequest(restyle=("room:",))).room.style is None
    with pytest.raises(GraphError, match=r"unknown style 'gothick'.*allowed: scandinavian, japandi"):
        wished(saved, EditRequest(restyle=("room:gothick",)))


def test_another_category_keeps_its_place(root, echousd_command):
    _, position, yaw = box(root, "nightstand_right")
    done = echousd_command("edit", root, "--shapes", "boxes", "--relabel", "nightstand_right:table_lamp")
    assert done.code in (0, 1), done.err
    _, after, turned = box(root, "nightstand_right")
    np.testing.assert_allclose(after, position, atol=2e-3)
    assert float(turned) == pytest.approx(float(yaw), abs=1e-3)


def test_what_stands_at_a_wall_keeps_its_back_there_when_it_is_resized(root):
    saved = read_room(root)
    row, wall = saved.graph.names.index("wardrobe"), float(saved.graph.room.corners[:, 0].min())
    saved.boxes.yaw[row] = math.pi / 2  # its front looks along +X, and so its depth lies
    for gap, x in ((0.01, wall + 0.01 + 0.4), (0.5, wall + 0.5 + float(saved.boxes.size[row, 2]) / 2)):
        saved.boxes.position[row, 0] = wall + gap + float(saved.boxes.size[row, 2]) / 2
        graph = wished(saved, EditRequest(resize=("wardrobe:1.2,2.0,0.8",)))
        assert graph.node("wardrobe").position[0] == pytest.approx(x, abs=1e-3)
    graph = wished(saved, EditRequest(move=("wardrobe:0.5,0.5",), resize=("wardrobe:1.2,2.0,0.8",)))
    assert graph.node("wardrobe").position[::2] == (0.5, 0.5)


def test_dry_run_says_what_would_happen_and_writes_nothing(root, echousd_command):
    before = files(root.parent)
    done = echousd_command("edit", root, "--add", "chair:stool", "--relate", "lamp left of bed", "--dry-run")
    assert done.code == 0, done.err
    assert "+ object chair (stool)" in done.out
    assert "new      chair" in done.out
    assert "moves    lamp" in done.out
    assert files(root.parent) == before


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--move", "bed:here"), "move: found 'bed:here', allowed: name:x,z or name:x,y,z, metres"),
        (("--resize", "bed:1,2"), "resize: found 'bed:1,2', allowed: name:x,y,z, metres"),
        (("--turn", "bed:east"), "object 'bed': yaw: found 'east', allowed: radians, or degrees as in 90 deg"),
        (("--lock", "sofa"), "no object 'sofa' in this graph"),
    ],
)
def test_wishes_that_cannot_be_read(root, echousd_command, words, said):
    done = echousd_command("edit", root, *words)
    assert done.code == 2
    assert said in done.err


def test_what_is_locked_turns_by_no_bit(root):
    saved = read_room(root)
    row = saved.graph.names.index("bed")
    for degrees in (-180.0, 180.0, 90.0, -33.33, 179.99, 0.01):
        yaw = saved.boxes.yaw.copy()
        yaw[row] = np.deg2rad(degrees)
        free = saved.graph.update_node("bed", position=None, yaw=None)
        there = replace(saved, graph=free, boxes=replace(saved.boxes, yaw=yaw))
        stated = wished(there, EditRequest(lock=("bed",))).node("bed").yaw
        assert round(float(np.degrees(np.float32(stated))), 4) == degrees


def test_unlocked_things_may_move_again(root):
    saved = read_room(root)
    locked = wished(saved, EditRequest(lock=("bed",)))
    assert locked.node("bed").position is not None
    free = locked.update_node("bed", locked=False, position=None, yaw=None)
    assert free == saved.graph


def test_titles_in_any_script_name_what_changes(tmp_path):
    graph = small_graph().update_node("bed", title="Große Liege").update_node("wardrobe", title="衣柜")
    root = echousd.generate(graph, seed=5, model=StandIn(), shapes="boxes", **BARE).save(
        tmp_path / "bedroom", preview=False
    )
    saved = read_room(root)
    by_title = EditRequest(
        lock=("Große Liege",), move=("衣柜:1.2,1.0",), turn=("衣柜:180",), resize=("Große Liege:1.6,0.5,2.0",),
        restyle=("Große Liege:oak",), add=("Größter Stuhl:stool",), relate=("Größter Stuhl close by 衣柜",),
    )  # fmt: skip
    by_name = EditRequest(
        lock=("bed",), move=("wardrobe:1.2,1.0",), turn=("wardrobe:180",), resize=("bed:1.6,0.5,2.0",),
        restyle=("bed:oak",), add=("Groesster_Stuhl:stool",), relate=("Groesster_Stuhl close by wardrobe",),
    )  # fmt: skip
    changed = wished(saved, by_title)
    assert changed.node("Groesster_Stuhl").title == "Größter Stuhl"
    assert changed.update_node("Groesster_Stuhl", title=None) == wished(saved, by_name)
    assert wished(saved, EditRequest(remove=("衣柜",))) == saved.graph.remove_node("wardrobe")
    assert wished(saved, EditRequest(relabel=("衣柜:desk",))) == wished(saved, EditRequest(relabel=("wardrobe:desk",)))
    assert not wished(saved, EditRequest(lock=("衣柜",), unlock=("衣柜",))).node("wardrobe").locked
    for twice in (saved, replace(saved, graph=saved.graph.update_node("lamp", title="Große Liege"))):
        with pytest.raises(GraphError, match="object 'Große Liege' is in this graph"):
            wished(twice, EditRequest(add=("Große Liege:single_bed",)))
    with pytest.raises(GraphError, match="object 'Große Liege' is in this graph"):
        wished(saved, EditRequest(add=("Große Liege:single_bed",)))


def test_a_stronger_layers_transform_is_the_artists_wish(root, echousd_command):
    path = root.with_name("mine.usda")
    layer = Sdf.Layer.CreateNew(str(path))
    layer.subLayerPaths = [f"./{root.name}"]
    stage = Usd.Stage.Open(layer)
    place = stage.GetPrimAtPath("/Room/Objects/wardrobe").GetAttribute("xformOp:translate")
    place.Set((1.0, 0.0, 1.1))
    layer.Save()
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    done = echousd_command("update", path, "--dry-run")
    assert done.code == 0, done.err
    assert "locked   wardrobe, where mine.usda puts it" in done.out
    done = echousd_command("update", root.parent)  # the one layer there over its room
    assert done.code in (0, 1), done.err
    node = echousd.read_graph(root).node("wardrobe")
    assert node.locked
    np.testing.assert_allclose(node.position, (1.0, 0.0, 1.1), atol=1e-4)
    np.testing.assert_allclose(box(root, "wardrobe")[1], (1.0, 0.0, 1.1), atol=1e-3)
    done = echousd_command("update", path)
    assert done.code == 2
    assert "mine.usda: changes nothing about the room" in done.err
    done = echousd_command("update", root)
    assert done.code == 2
    assert "the room's own root layer; name the stronger layer" in done.err
    path.rename(root.parent.parent / path.name)
    done = echousd_command("update", root.parent)
    assert done.code == 2
    assert "layers over bedroom.usda in this folder: none; name the one that changes it" in done.err


def test_a_scale_of_a_stronger_layer_is_said_for_boxes_do_not_follow(root):
    layer = Sdf.Layer.CreateNew(str(root.with_name("larger.usda")))
    layer.subLayerPaths = [f"./{root.name}"]
    stage = Usd.Stage.Open(layer)
    UsdGeom.Xformable(stage.GetPrimAtPath("/Room/Objects/wardrobe")).AddScaleOp().Set((1.3, 1.0, 1.0))
    layer.Save()
    with pytest.warns(UserWarning, match=r"</Room/Objects/wardrobe> is scaled by 1.30 x 1.00 x 1.00: .* --resize does"):
        read_room(layer.realPath)


def test_python_edits_in_the_words_of_the_command_line(root, tmp_path, echousd_command):
    other = tmp_path / "other"
    shutil.copytree(root.parent, other)
    words = ("--add", "chair:nightstand", "--relate", "chair close by wardrobe", "--lock", "bed")
    assert echousd_command("edit", root, "--shapes", "boxes", *words).code in (0, 1)
    wishes = {"add": ["chair:nightstand"], "relate": "chair close by wardrobe", "lock": ["bed"]}
    made = echousd.edit(other, **wishes, shapes="boxes").save(other, preview=False)
    assert made.read_bytes() == root.read_bytes()
    assert echousd.read_graph(other) == echousd.read_graph(root)  # a folder stands for its room
    one_of = r"takes either a graph or wishes \(remove, unrelate, relabel, add"
    with pytest.raises(ValueError, match=one_of):
        echousd.edit(other)
    with pytest.raises(ValueError, match=one_of):
        echousd.edit(other, echousd.read_graph(other), lock="bed")
    with pytest.raises(ValueError, match="paint is no option of an edit, allowed: remove, unrelate"):
        echousd.edit(other, paint="red")


def test_python_takes_edits_back_and_makes_them_again(root):
    before = told(root.parent)
    echousd.edit(root, remove=["wardrobe"]).save(root.parent, preview=False)
    after = told(root.parent)
    assert "- object wardrobe (wardrobe)" in echousd.undo(root.parent)
    assert told(root.parent) == without_pictures(before)
    assert "- object wardrobe (wardrobe)" in echousd.redo(root)
    assert told(root.parent) == without_pictures(after)
    with pytest.raises(ValueError, match="no edit that was taken back can be made again"):
        echousd.redo(root.parent)


def test_python_brings_a_room_up_to_date_with_a_layer_over_it(root):
    path = root.with_name("mine.usda")
    layer = Sdf.Layer.CreateNew(str(path))
    layer.subLayerPaths = [f"./{root.name}"]
    stage = Usd.Stage.Open(layer)
    stage.GetPrimAtPath("/Room/Objects/wardrobe").GetAttribute("xformOp:translate").Set((1.0, 0.0, 1.1))
    layer.Save()
    made = echousd.update(root.parent)
    assert made.graph.node("wardrobe").locked
    np.testing.assert_allclose(made.boxes.position[made.names.index("wardrobe")], (1.0, 0.0, 1.1), atol=1e-3)
    made.save(root.parent, preview=False)
    with pytest.raises(ValueError, match=r"mine\.usda: changes nothing about the room"):
        echousd.update(path)


@pytest.mark.parametrize(("change", "says"), [
    (lambda stage: UsdGeom.Xformable(stage.GetPrimAtPath("/Room/Objects/wardrobe")).AddTranslateOp(
        opSuffix="edit").Set((0.0, 0.0, 0.3)),
     r"moves wardrobe from wherever the room puts it, allowed: other values of its own xformOp:translate and xformOp:"),
    (lambda stage: UsdGeom.Xformable(stage.GetPrimAtPath("/Room/Objects")).AddTranslateOp().Set((0.0, 0.0, 0.3)),
     r"moves bed from wherever the room puts it, allowed: other values of its own xformOp:translate"),
    (lambda stage: stage.GetPrimAtPath("/Room/SceneGraph").SetActive(False),
     r"mine\.usda: no scene graph \(no EchoSceneGraph prim\)"),
])  # fmt: skip
def test_what_would_be_done_twice_or_takes_the_graph_away_is_no_update(root, change, says):
    layer = Sdf.Layer.CreateNew(str(root.with_name("mine.usda")))
    layer.subLayerPaths = [f"./{root.name}"]
    change(Usd.Stage.Open(layer))
    layer.Save()
    before = files(root.parent)
    with pytest.raises(ValueError, match=says):
        echousd.update(layer.realPath)
    assert files(root.parent) == before


def test_a_piece_that_a_stronger_layer_copies_stays_where_it_was_put_and_is_one(root, echousd_command):
    path = root.with_name("mine.usda")
    layer = Sdf.Layer.CreateNew(str(path))
    layer.subLayerPaths = [f"./{root.name}"]
    stage = Usd.Stage.Open(layer)
    for name, at in (("wardrobe_2", (1.0, 0.0, 1.1)), ("wardrobe_3", None)):  # the third lies where the first stands
        copy = stage.DefinePrim(f"/Room/Objects/{name}")
        copy.GetReferences().AddInternalReference("/Room/Objects/wardrobe")
        if at:
            copy.GetAttribute("xformOp:translate").Set(at)
    layer.Save()
    before = box(root, "wardrobe")
    done = echousd_command("update", path, "--shapes", "boxes")
    assert done.code in (0, 1), done.err
    assert "locked   wardrobe_2, where mine.usda puts it" in done.out
    assert "wardrobe_3, where" not in done.out
    saved = read_room(root)
    assert saved.assets["wardrobe_2"] == saved.assets["wardrobe_3"] == saved.assets["wardrobe"]
    size, position, yaw = box(path, "wardrobe_2")
    np.testing.assert_allclose(position, (1.0, 0.0, 1.1), atol=1e-3)
    np.testing.assert_allclose(size, before[0], atol=1e-3)
    assert math.isclose(yaw, before[2], abs_tol=1e-3)
    assert np.linalg.norm(box(path, "wardrobe_3")[1] - before[1]) > 0.1
    stage = Usd.Stage.Open(str(path))
    wardrobes = [stage.GetPrimAtPath(f"/Room/Objects/wardrobe{number}/geo") for number in ("", "_2", "_3")]
    pieces = [len(prim.GetChildren()) for prim in wardrobes]
    assert pieces == [pieces[0]] * 3


@pytest.mark.parametrize("call", [
    lambda room, out: echousd.check(room).layouts[0].relations,
    lambda room, out: echousd.read_dressing(room),
    lambda room, out: echousd.read_rooms(room),
    lambda room, out: echousd.render(room, size=16, rays=1).tobytes(),
    lambda room, out: echousd.export(room, out / "room.glb", force=True).read_bytes(),
    lambda room, out: echousd.generate(room, shapes="boxes", dress="none", preview=False).graph,
    lambda room, out: sorted(one.name for one in echousd.export_texture_job(room, out, "generic", force=True).objects),
])  # fmt: skip
def test_a_folder_stands_for_its_room(root, tmp_path, call):
    assert call(root.parent, tmp_path / "out") == call(root, tmp_path / "out")
    with pytest.raises(ValueError, match=r"layers: no room in this folder$"):
        call(root.parent / "layers", tmp_path / "out")


def test_an_object_that_was_written_by_hand_is_named_with_the_remedy(root):
    layer = Sdf.Layer.FindOrOpen(str(root.parent / "layers" / "graph.usda"))
    stage = Usd.Stage.Open(layer)
    prim = stage.DefinePrim("/Room/Objects/rocker", "Xform")
    prim.AddAppliedSchema("EchoNodeAPI")
    prim.CreateAttribute("echo:category", Sdf.ValueTypeNames.Token).Set("armchair")
    layer.Save()
    with pytest.raises(ValueError, match=r"'rocker' has no mesh that echousd made; .* `edit --add rocker:armchair`"):
        read_room(root)


def test_a_model_of_ones_own_takes_the_place_of_a_piece(root, tmp_path, echousd_command):
    stage = Usd.Stage.CreateNew(str(tmp_path / "models.usda"))
    stage.SetDefaultPrim(UsdGeom.Cube.Define(stage, "/Own").GetPrim())
    UsdGeom.SetStageMetersPerUnit(stage, 0.5)
    stage.Save()
    before = files(root.parent)
    done = echousd_command("edit", root, "--reshape", f"wardrobe: {tmp_path / 'models.usda'}")
    assert done.code in (0, 1), done.err
    np.testing.assert_allclose(box(root, "wardrobe")[0], (1.0, 1.0, 1.0), atol=1e-3)
    assert echousd.read_graph(root).node("wardrobe").asset == "../models.usda"
    assert files(root.parent)["bed_geo.usdc"] == before["bed_geo.usdc"]
    done = echousd_command("edit", root, "--reshape", "wardrobe:gone.usda")
    assert (done.code, "object 'wardrobe': gone.usda: no such file" in done.err) == (2, True)


@pytest.mark.parametrize("copied", [False, True])
def test_a_piece_that_was_renamed_or_copied_in_the_layers_is_edited_like_others(root, echousd_command, copied):
    before, was = files(root.parent), box(root, "wardrobe")
    old, new = "/Room/Objects/wardrobe", "/Room/Objects/closet"
    if copied:
        for name in ("graph", "geometry", "layout"):
            layer = Sdf.Layer.FindOrOpen(str(root.parent / "layers" / f"{name}.usda"))
            assert Sdf.CopySpec(layer, old, layer, new)
            layer.Save()
    else:
        stage = Usd.Stage.Open(str(root))
        editor = Usd.NamespaceEditor(stage)
        assert editor.MovePrimAtPath(old, new)
        assert editor.ApplyEdits()
        for layer in stage.GetLayerStack(includeSessionLayers=False):
            layer.Save()
    done = echousd_command("edit", root, "--shapes", "boxes", "--add", "chair:nightstand", "--lock", "closet")
    assert done.code in (0, 1), done.err
    saved = read_room(root)
    assert saved.graph.names.count("closet") == 1
    assert ("wardrobe" in saved.graph.names) == copied
    assert saved.assets["closet"] == "wardrobe"
    for value, expected in zip(box(root, "closet"), was, strict=True):
        np.testing.assert_allclose(value, expected, atol=1e-3)
    assert files(root.parent)["wardrobe_geo.usdc"] == before["wardrobe_geo.usdc"]


def test_edits_are_taken_back_byte_for_byte(root, echousd_command):
    states = [files(root.parent)]
    assert echousd_command("edit", root, "--undo").err == f"error: {root}: no edit to take back\n"
    for words in (("--add", "chair:nightstand"), ("--remove", "wardrobe", "--move", "chair:1.2,1.1")):
        done = echousd_command("edit", root, "--shapes", "boxes", *words)
        assert done.code in (0, 1), done.err
        states.append(files(root.parent))
    history = json.loads(root.with_suffix(".json").read_text())["history"]
    assert [entry["number"] for entry in history] == [1, 2]
    assert "+ object chair (nightstand)" in history[0]["steps"]
    done = echousd_command("edit", root, "--undo")
    assert done.code == 0, done.err
    assert "undone   - object wardrobe (wardrobe)" in done.out
    assert told(root.parent) == without_pictures(states[1])
    read_room(root)
    assert echousd_command("edit", root, "--undo").code == 0
    assert told(root.parent) == without_pictures(states[0])
    assert not (root.parent / "history").exists()
    for state in states[1:]:
        done = echousd_command("edit", root, "--redo")
        assert done.code == 0, done.err
        assert told(root.parent) == without_pictures(state)
        read_room(root)
    assert "redone   - object wardrobe (wardrobe)" in done.out
    assert not (root.parent / ".redo").exists()
    nothing = f"error: {root}: no edit that was taken back can be made again\n"
    assert echousd_command("edit", root, "--redo").err == nothing
    assert echousd_command("edit", root, "--undo").code == 0
    assert told(root.parent) == without_pictures(states[1])
    assert echousd_command("edit", root, "--shapes", "boxes", "--lock", "bed").code in (0, 1)
    assert echousd_command("edit", root, "--redo").err == nothing  # another edit was made in its place
    assert not (root.parent / ".redo").exists()


def test_a_damaged_archive_of_what_was_taken_back_changes_nothing(root, echousd_command):
    assert echousd_command("edit", root, "--shapes", "boxes", "--add", "chair:nightstand").code in (0, 1)
    assert echousd_command("edit", root, "--undo").code == 0
    before, (archive,) = files(root.parent), (root.parent / ".redo").iterdir()
    whole = archive.read_bytes()
    for damaged in (whole[:200], whole[:-26], whole[-60:]):
        archive.write_bytes(damaged)
        done = echousd_command("edit", root, "--redo")
        assert done.code == 2
        assert "1.zip: cannot be read" in done.err
    archive.write_bytes(whole)
    (archive.with_name("0.zip")).write_bytes(b"nothing")  # another one, which is not needed
    assert echousd_command("edit", root, "--redo").code == 0
    assert echousd_command("edit", root, "--undo").code == 0
    before = files(root.parent)
    archive.unlink()
    assert "0.zip: cannot be read" in echousd_command("edit", root, "--redo").err
    archive.with_name("0.zip").unlink(missing_ok=True)
    assert echousd_command("edit", root, "--redo").code == 2
    assert files(root.parent) == before
    done = echousd_command("edit", root, "--redo", "--lock", "bed")
    assert "--redo makes it again and does nothing else" in done.err


def without_pictures(found):
    return {name: value for name, value in found.items() if not name.endswith(".png") or "bedroom" not in name}


def told(folder):
    return without_pictures(files(folder))


def test_an_edit_is_not_taken_back_over_somebody_elses_work(root, echousd_command):
    assert echousd_command("edit", root, "--shapes", "boxes", "--add", "chair:nightstand").code in (0, 1)
    layer = Sdf.Layer.FindOrOpen(str(root.parent / "layers" / "materials.usda"))
    layer.comment = "mine"
    layer.Save()
    before = files(root.parent)
    done = echousd_command("edit", root, "--undo")
    assert done.code == 2
    assert "materials.usda: was changed since" in done.err
    assert files(root.parent) == before
    done = echousd_command("edit", root, "--undo", "--lock", "bed")
    assert done.code == 2
    assert "--undo takes the last edit back and does nothing else" in done.err
