"""Furniture as packages for SimReady hosts; `make clients` asks SimReady's own validator."""

import pytest
from pxr import Usd, UsdGeom, UsdPhysics
from small_room import BARE, StandIn, small_graph

import echousd
from echousd.layers import simready
from echousd.layers.simready import FURNITURE, pack
from echousd.stage.paths import asset_file


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    pytest.importorskip("embreex")
    made = echousd.generate(small_graph(), seed=3, model=StandIn(), place=False, shapes="boxes", **BARE)
    return made.save(tmp_path_factory.mktemp("room") / "bedroom", preview=False)


def test_packages_hold_everything_that_simready_asks_for(room, tmp_path):
    layers, left, hangs = pack(room, tmp_path, author="A Person")
    assert {path.stem for path in layers} == {"bed", "nightstand", "lamp", "pendant", "wardrobe"}
    assert [sentence.partition(":")[0] for sentence in hangs] == ["pendant"]
    assert left == []
    for path in layers:
        assert path == tmp_path / path.stem / "usd" / f"{path.stem}.usda"
        assert {file.name for file in path.parent.iterdir()} == {".thumbs", f"{path.stem}.usda", "payload"}
        assert (path.parent / f".thumbs/256x256/{path.name}.png").read_bytes()[:4] == b"\x89PNG"
    stage = Usd.Stage.Open(str(tmp_path / "bed/usd/bed.usda"))
    layers = [layer for layer in stage.GetUsedLayers() if not layer.anonymous]
    assert {layer.pseudoRoot.GetInfo("upAxis") for layer in layers} == {"Z"}
    told = stage.GetRootLayer().customLayerData["SimReady_Metadata"]
    bed = stage.GetDefaultPrim()
    size = UsdGeom.BBoxCache(0, ["default"]).ComputeWorldBound(bed).ComputeAlignedRange().GetSize()
    assert tuple(told["asset_extents"]) == pytest.approx(tuple(size), abs=1e-5)
    assert told["mass"] == pytest.approx(UsdPhysics.MassAPI(bed).GetMassAttr().Get())
    assert (told["author"], told["qcode"], told["rigid_body_count"]) == ("A Person", FURNITURE, 1)
    meshes = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    assert meshes


def test_wrong_names_and_packages_in_the_way_are_told(room, tmp_path, echousd_command, monkeypatch):
    done = echousd_command("assets", "pack", room, "-o", tmp_path, "--asset", "sofa")
    assert (done.code, f"{room}: no asset 'sofa', allowed: bed, lamp" in done.err) == (2, True), done.err
    assert echousd_command("assets", "pack", room.parent, "-o", tmp_path, "--asset", "bed").code == 0
    done = echousd_command("assets", "pack", room.parent, "-o", tmp_path, "--asset", "bed")
    assert done.code == 2
    assert "bed/usd: exists; choose another place or use --force" in done.err
    drawn = []
    monkeypatch.setattr("echousd.layers.simready.picture", lambda path: drawn.append(path) or b"")
    with pytest.raises(ValueError, match="bed/usd: exists"):
        pack(room, tmp_path, names=["wardrobe", "lamp", "bed"])
    assert not drawn  # refused before any work
    assert not (tmp_path / "lamp").exists()
    monkeypatch.undo()
    stage = Usd.Stage.CreateNew(str(tmp_path / "other.usda"))
    stage.Save()
    done = echousd_command("assets", "pack", tmp_path / "other.usda", "-o", tmp_path / "out")
    assert done.code == 2
    assert "not a room made by `echousd generate`" in done.err


def test_a_room_that_is_half_written_is_not_packed(room, tmp_path, monkeypatch):
    monkeypatch.setattr("echousd.pending.half_written", lambda folder: folder == room.parent)
    with pytest.raises(ValueError, match="bedroom: half-written, by a run that was interrupted or has not ended"):
        pack(room, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_models_that_are_anothers_wholly_or_in_part_are_left_out(room, tmp_path, monkeypatch):
    def files(root, manifest, name):
        found = read(root, manifest, name)
        if name == "bed":
            return {**found, "assets/bed/original/bed.png": b"picture"}
        return {path: held for path, held in found.items() if name != "lamp" or path != asset_file("lamp", "geo")}

    read = simready._files
    monkeypatch.setattr(simready, "_files", files)
    layers, left, _ = pack(room, tmp_path, names=["bed", "lamp", "wardrobe"])
    assert [path.stem for path in layers] == ["wardrobe"]
    assert [sentence.partition(":")[0] for sentence in left] == ["bed", "lamp"]
