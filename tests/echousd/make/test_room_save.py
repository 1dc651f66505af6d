import hashlib
import os
import subprocess
import sys
from dataclasses import replace
from functools import cache

import pytest
from dying_process import killed
from pxr import Sdf, Usd, UsdGeom, UsdPhysics, UsdShade
from small_room import BARE, StandIn, small_graph
from stopped_disk import stopped_disk

import echousd
from echomodel.files import HOST
from echousd.layers.compose import room_files
from echousd.make.flat import save_flat
from echousd.make.save import write_preview
from echousd.naming import as_identifier
from echousd.pending import STAGING
from echousd.shapes.sources import whole


@cache
def make(seed=0, without=(), added=(), **more):
    """A room that several tests save, each into a folder of its own: the small one without and with some nodes."""
    graph = small_graph()
    for name in without:
        graph = graph.remove_node(name)
    for name, category in added:
        graph = graph.add_node(name, category)
    more = {"place": False, "shapes": "boxes", **more}
    return echousd.generate(graph, seed=seed, model=StandIn(0.5), **{**BARE, **more})


def opened(path):
    """A stage as another process would find it."""
    stage = Usd.Stage.Open(str(path))
    stage.Reload()
    return stage


def hashes(folder):
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file()
    }


def changed(before, after):
    return {path for path in before.keys() | after.keys() if before.get(path) != after.get(path)}


def test_same_room_gives_same_bytes(monkeypatch):
    monkeypatch.setattr(whole, "within_budget", whole.within_budget.__wrapped__)  # meshed anew each time
    others = ("wardrobe", "pendant", "nightstand_right", "nightstand_left", "bed")
    rooms = [make.__wrapped__(seed=4, without=others, shapes="sdf", faces=600) for _ in range(2)]
    first, second = (room_files(room) for room in rooms)
    assert first == second


def test_another_seed_keeps_the_assets_bytes(tmp_path):
    folder = tmp_path / "bedroom"
    make(seed=1).save(folder, preview=False)
    before = hashes(folder)
    make(seed=2).save(folder, preview=False)
    after = hashes(folder)
    assert {path for path in after if path.startswith("assets/")} <= after.keys() - changed(before, after)
    make(seed=1).save(folder, preview=False)
    assert hashes(folder) == before


def test_layout_alone_rewrites_its_layer_and_what_frames_it(tmp_path):
    folder = tmp_path / "bedroom"
    room = make(seed=1)
    room.save(folder, preview=False)
    before = hashes(folder)
    moved = replace(room.boxes, position=room.boxes.position + 0.1)
    replace(room, layouts=(moved,)).save(folder, preview=False)
    assert changed(before, hashes(folder)) == {"layers/layout.usda", "bedroom.usda", "bedroom.json"}


def test_artists_work_survives_byte_for_byte(tmp_path):
    folder = tmp_path / "bedroom"
    root = make(seed=1).save(folder, preview=False)
    mine = folder / "set_dressing.usda"
    stage = Usd.Stage.CreateNew(str(mine))
    stage.GetRootLayer().subLayerPaths = ["./bedroom.usda"]
    stage.GetPrimAtPath("/Room/Objects/bed").SetActive(False)
    UsdGeom.Cube.Define(stage, "/Room/Toy")
    stage.Save()
    (folder / "notes").mkdir()
    (folder / "notes/todo.txt").write_text("more plants")
    before = hashes(folder)
    make(seed=2).save(folder, preview=False)
    after = hashes(folder)
    assert after["set_dressing.usda"] == before["set_dressing.usda"]
    assert after["notes/todo.txt"] == before["notes/todo.txt"]
    fresh = Usd.Stage.Open(str(root))
    assert fresh.GetRootLayer().customLayerData["seed"] == 2
    composed = Usd.Stage.Open(str(mine))
    assert composed.GetPrimAtPath("/Room/Toy")
    assert not composed.GetPrimAtPath("/Room/Objects/bed").IsActive()


def test_what_an_artist_adds_to_the_root_layer_stays(tmp_path):
    folder = tmp_path / "bedroom"
    root = make(seed=1).save(folder, preview=False)
    text = root.read_text().replace("subLayers = [", "subLayers = [\n        @./mine.usda@,").rstrip()
    assert text.endswith("}")
    root.write_text(text[:-1] + '\n    def Cube "Toy"\n    {\n    }\n}\n')
    (folder / "mine.usda").write_text('#usda 1.0\nover "Room" {}\n')
    make(seed=2).save(folder, preview=False)
    layer = Sdf.Layer.OpenAsAnonymous(str(root))
    assert layer.subLayerPaths[0] == "./mine.usda"
    assert len(layer.subLayerPaths) == 7
    assert layer.GetPrimAtPath("/Room/Toy")
    assert layer.customLayerData["seed"] == 2


def test_edited_layer_of_ours_is_kept_beside_the_new_one(tmp_path):
    folder = tmp_path / "bedroom"
    make(seed=1).save(folder, preview=False)
    layer = folder / "layers/layout.usda"
    layer.write_text(layer.read_text() + "# moved the bed\n")
    edited = layer.read_bytes()
    make(seed=2).save(folder, preview=False)
    assert (folder / "layers/layout.edited.usda").read_bytes() == edited
    assert b"moved the bed" not in layer.read_bytes()


def test_asset_of_an_object_that_is_gone_is_removed_unless_edited(tmp_path):
    folder = tmp_path / "bedroom"
    make(seed=1).save(folder, preview=False)
    touched = folder / "assets/wardrobe/wardrobe.usda"
    touched.write_text(touched.read_text() + "# mine\n")
    root = make(seed=1, without=("pendant", "wardrobe")).save(folder, preview=False)
    assert not (folder / "assets/pendant").exists()
    assert touched.exists()
    stage = Usd.Stage.Open(str(root))
    assert not stage.GetPrimAtPath("/Room/Objects/pendant")


def test_killed_while_saving_leaves_a_room_that_opens(tmp_path):
    """SIGKILL at several moments of a run that saves one room after the other into the same folder."""
    folder, rooms = tmp_path / "bedroom", [make(seed=1), make(seed=2)]
    rooms[0].save(folder, preview=False)
    for delay in (0.03, 0.21):
        killed(lambda number: rooms[number % 2].save(folder, preview=False), delay)
        stage = opened(folder / "bedroom.usda")
        assert stage.GetCompositionErrors() == []
        assert stage.GetPrimAtPath("/Room/Objects/bed/geo/bed_mesh").IsA(UsdGeom.Mesh)
    make(seed=1).save(folder, preview=False)
    assert not (folder / STAGING).exists()


@cache
def composed(seed):
    """Files of the rooms of the next test, the same at every moment."""
    other = {"without": ("pendant",), "added": (("second_bed", "double_bed"),)}
    return room_files(make(seed=seed, **(other if seed == 2 else {})))


@pytest.mark.parametrize("moment", range(0, 40, 3))
def test_room_opens_after_every_step_of_a_regeneration(tmp_path, monkeypatch, moment):
    """Another graph is saved over a room and after some operation on the disk nothing happens, no tidying either."""

    from echousd.folder.manifest import find_manifest

    folder = tmp_path / "bedroom"
    root = make(seed=1).save(folder, preview=False)
    other = make(seed=2, without=("pendant",), added=(("second_bed", "double_bed"),))
    monkeypatch.setattr("echousd.make.save.room_files", lambda room, shelf, folder: composed(room.provenance.seed))
    files = len(composed(2))  # each is written to the staging folder before
    with stopped_disk(monkeypatch, files + moment, KeyboardInterrupt):
        other.save(folder, preview=False)
    layers = [path for path in folder.rglob("*.usd*") if STAGING not in path.parts]
    for path in layers:
        layer = Sdf.Layer.Find(str(path))
        if layer:
            layer.Reload(True)
    stage = opened(root)
    assert stage.GetCompositionErrors() == []
    for prim in stage.GetPrimAtPath("/Room/Objects").GetChildren():
        assert any(below.IsA(UsdGeom.Mesh) for below in Usd.PrimRange(prim)) or prim.GetName() in (
            "pendant",
            "second_bed",
        )
    other.save(folder, preview=False)
    assert not (folder / STAGING).exists()
    assert set(find_manifest(folder)["assets"]) == set(other.names)
    assert not (folder / "assets/pendant").exists()


def test_full_disk_says_so_and_changes_nothing(tmp_path, monkeypatch):
    from pathlib import Path

    folder = tmp_path / "bedroom"
    make(seed=1).save(folder, preview=False)
    before = hashes(folder)
    real = Path.write_bytes

    def full(self, data):
        if STAGING in self.parts:
            raise OSError(28, "No space left on device")
        return real(self, data)

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(
        ValueError, match=r"bedroom: cannot be written \(No space left on device\); nothing was changed"
    ):
        make(seed=2).save(folder, preview=False)
    assert hashes(folder) == before


def test_disk_that_is_full_at_the_preview_leaves_the_room(tmp_path, monkeypatch):
    from pathlib import Path

    pytest.importorskip("embreex")
    folder = tmp_path / "bedroom"
    make(seed=1).save(folder, preview=False)
    before = hashes(folder)
    real = Path.write_bytes

    def full(self, data):
        if ".png" in self.name:
            real(self, data[:100])
            raise OSError(28, "No space left on device")
        return real(self, data)

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(
        ValueError, match=r"bedroom.png: cannot be written \(No space left on device\); the room itself is complete"
    ):
        write_preview(folder / "bedroom.usda")
    assert hashes(folder) == before


def test_preview_that_a_killed_run_left_half_written_goes(tmp_path):
    pytest.importorskip("embreex")
    folder = tmp_path / "bedroom"
    make(seed=1).save(folder, preview=False)
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    left = [folder / f".{name}.{HOST}_{gone.pid}.partial" for name in ("bedroom.png", "bedroom_layouts.png")]
    mine = [
        folder / f".notes.{words}" for words in (f"{HOST}_{os.getpid()}.png", f"00000000_{gone.pid}.png", "partial")
    ]
    for path in (*left, *mine):
        path.write_bytes(b"half")
    make(seed=2).save(folder)
    assert not any(path.exists() for path in left)
    assert all(path.exists() for path in mine)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"up_axis": "Z"}, "edited by hand, upAxis Y; a room with Z needs another folder"),
        ({"meters_per_unit": 0.01}, r"edited by hand, metersPerUnit 1.0; a room with 0.01 needs another folder"),
        ({"room_path": "/Flat/Living"}, "edited by hand, defaultPrim Room; a room with Flat needs another folder"),
    ],
)
def test_other_conventions_over_an_edited_root_are_refused(tmp_path, options, said):
    folder = tmp_path / "bedroom"
    root = make(seed=1).save(folder, preview=False)
    root.write_text(root.read_text().replace("customLayerData = {", "customLayerData = {\n        bool mine = 1", 1))
    with pytest.raises(ValueError, match=said):
        make(seed=1, **options).save(folder, preview=False)


def test_samples_are_one_variant_set_of_the_same_furniture(tmp_path):
    room = make(seed=1, layouts=3)
    root = room.save(tmp_path / "bedroom", preview=False)
    stage = Usd.Stage.Open(str(root))
    variants = stage.GetPrimAtPath("/Room").GetVariantSet("layout")
    assert variants.GetVariantNames() == ["layout_0", "layout_1", "layout_2"]
    seen = []
    for number, name in enumerate(variants.GetVariantNames()):
        variants.SetVariantSelection(name)
        bed = UsdGeom.Xformable(stage.GetPrimAtPath("/Room/Objects/bed")).ComputeLocalToWorldTransform(0)
        seen.append(bed.ExtractTranslation()[0])
        assert seen[-1] == pytest.approx(float(room.layouts[number].position[0, 0]), abs=1e-4)
    assert len(set(seen)) == 3
    alone = make(seed=1, layouts=1)
    assert (alone.boxes.position == room.boxes.position).all()  # more samples do not change the first


@pytest.mark.parametrize("ending", [".usda", ".usdc"])
def test_flat_room_is_one_file_that_stands_alone(tmp_path, ending):
    room = make(seed=1, layouts=2)
    path = save_flat(room, tmp_path / f"room{ending}")
    stage = Usd.Stage.Open(str(path))
    assert stage.GetCompositionErrors() == []
    assert [layer.realPath for layer in stage.GetUsedLayers() if layer.realPath] == [str(path)]
    assert stage.GetPrimAtPath("/Room").GetVariantSet("layout").GetVariantNames() == ["layout_0", "layout_1"]
    assert stage.GetPrimAtPath("/Room/Objects/bed/geo/bed_mesh").IsA(UsdGeom.Mesh)
    assert echousd.read_graph(stage) == room.graph
    text = stage.GetRootLayer().ExportToString()
    assert str(tmp_path) not in text
    assert "/tmp/" not in text
    with pytest.raises(ValueError, match="exists; choose another place or use --force"):
        save_flat(room, path)
    with pytest.raises(ValueError, match=r"a flat room ends in .usda or .usdc, found '.obj'"):
        save_flat(room, tmp_path / "room.obj")


def shown(stage, layout, room="/Room"):
    """What a stage shows in a layout: path -> place, path of a mesh -> its material."""
    stage.GetPrimAtPath(room).GetVariantSet("layout").SetVariantSelection(layout)
    cache, places, looks = UsdGeom.XformCache(), {}, {}
    for prim in stage.Traverse():
        if UsdGeom.Xformable(prim) and prim.GetTypeName() != "Camera":
            at = cache.GetLocalToWorldTransform(prim).ExtractTranslation()
            places[str(prim.GetPath())] = [round(v, 3) + 0.0 for v in at]
        if prim.IsA(UsdGeom.Mesh) and not prim.HasAPI(UsdPhysics.CollisionAPI):
            looks[str(prim.GetPath())] = str(UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0].GetPath())
    return places, looks


@pytest.mark.parametrize("dress", ["none", "some"])
def test_layouts_of_a_flat_room_look_as_those_of_its_folder(tmp_path, dress):
    theirs = {"up_axis": "Z", "meters_per_unit": 0.01, "room_path": "/Flat/Living"}
    room = make(seed=1, layouts=2, walls=True, dress=dress, **theirs)
    stages = [opened(room.save(tmp_path / "room", preview=False)), opened(save_flat(room, tmp_path / "flat.usda"))]
    found = [[shown(stage, layout, "/Flat/Living") for layout in ("layout_0", "layout_1")] for stage in stages]
    assert found[0] == found[1]
    (first, _), (second, _) = found[1]
    assert first["/Flat/Living/Lights/lamp_lamp"] != second["/Flat/Living/Lights/lamp_lamp"]
    assert any(path.startswith("/Flat/Living/Dressing/") for path in second) is (dress == "some")


def test_room_is_shown_in_notebooks():
    room = make(seed=1)
    assert repr(room) == "Room('bedroom', 6 objects, 5 relations, seed 1)"
    assert "<td>nightstand_left</td>" in room._repr_html_()
    assert room.stage.GetPrimAtPath("/Room/Objects/bed/geo/bed_mesh")
    assert len(room.scene().geometry) == 5
    assert room.scene().bounds[1][1] == pytest.approx(2.8)


@pytest.mark.parametrize(
    ("word", "name"),
    [
        ("out", "out"),
        ("my room", "my_room"),
        ("7", "_7"),
        ("Küche", "Kueche"),
        ("ré☃", "re"),
        ("部屋", "room"),
        ("Спальня Ани", "room"),
    ],
)
def test_names_of_rooms_are_identifiers(word, name):
    assert as_identifier(word) == name
    assert Sdf.Path.IsValidIdentifier(name)
