import os

import numpy as np
import pytest
from small_models import chest, seat, small_library, write_glb, write_obj, write_usd

from echousd.assets import table
from echousd.assets.index import index
from echousd.assets.table import read_library


def records(tmp_path, *folders, **options):
    done = index(list(folders), tmp_path / "lib.parquet", **options)
    return done, read_library(done.file).records


def test_models_of_all_kinds_become_rows(tmp_path):
    done, found = records(tmp_path, small_library(tmp_path / "models"))
    assert (done.models, done.usable, done.read, done.faults) == (6, 6, 6, ())
    assert {key: record.category for key, record in found.items()} == {
        "chairs/dining_chair.obj": "dining_chair",
        "beds/double_bed.usda": "double_bed",
        "storage/nightstand.glb": "nightstand",
        "storage/thing_17.usda": "wardrobe",
        "lamps/table_lamp.obj": "table_lamp",
        "lamps/pendant_lamp.obj": "pendant_lamp",
    }
    bed, wardrobe = found["beds/double_bed.usda"], found["storage/thing_17.usda"]
    assert bed.dims == pytest.approx((1.8, 1.0, 2.1), abs=1e-3)
    assert (bed.turn[3:6], bed.turn[6:]) == ((0, 0, 1), (0, -1, 0))  # Z-up: its front, +Z of ours, is its -Y
    assert (bed.uri, bed.licence, bed.prim) == ("models/beds/double_bed.usda", "CC0-1.0", "/piece")
    assert (wardrobe.licence, wardrobe.author, wardrobe.confidence) == ("CC0-1.0", "A. Joiner", pytest.approx(0.97))
    assert found["lamps/pendant_lamp.obj"].placement == "ceiling"
    assert found["storage/nightstand.glb"].thumbnail.startswith(b"\x89PNG")
    assert len(found["chairs/dining_chair.obj"].sha256) == 64


def test_a_pose_brings_a_model_into_the_object_frame(tmp_path):
    _, found = records(tmp_path, small_library(tmp_path / "models"))
    for size in (None, (2.0, 1.1, 2.2)):
        record = found["beds/double_bed.usda"]
        pose = record.pose(size)
        mesh = seat(1.8, 1.0, 2.1)
        own = np.stack([mesh.vertices[:, 0], -mesh.vertices[:, 2], mesh.vertices[:, 1]], 1) * 100
        moved = own @ pose[:3, :3].T + pose[:3, 3]
        want = mesh.vertices * (np.ones(3) if size is None else np.array(size) / (1.8, 1.0, 2.1))
        np.testing.assert_allclose(moved, want - [0, want[:, 1].min(), 0], atol=1e-4)


def test_only_what_changed_is_read_again(tmp_path):
    folder = small_library(tmp_path / "models")
    _, first = records(tmp_path, folder)
    done, second = records(tmp_path, folder)
    assert (done.read, second) == (0, first)
    write_glb(folder / "storage", "nightstand", chest(0.6, 0.5, 0.4))
    (folder / "lamps/pendant_lamp.obj").unlink()
    done, third = records(tmp_path, folder)
    assert (done.read, done.models) == (1, 5)
    assert third["storage/nightstand.glb"].dims[0] == pytest.approx(0.6)


def test_workers_find_what_one_process_finds(tmp_path, monkeypatch):
    monkeypatch.setattr("echousd.assets.index.FEW", 0)
    monkeypatch.setattr("echousd.assets.index.PACK", 2)
    folder = small_library(tmp_path / "models")
    _, alone = records(tmp_path, folder)
    (tmp_path / "lib.parquet").unlink()
    done, together = records(tmp_path, folder, workers=2)
    assert (done.read, together) == (6, alone)


def test_faults_are_listed_and_not_fatal(tmp_path):
    folder = tmp_path / "models"
    write_obj(folder, "chair", seat())
    write_obj(folder, "gizmo", chest())
    (folder / "desk.glb").write_bytes(b"no glb")
    (folder / "sofa.usda").write_text("#usda 1.0\n(\n")
    (folder / "table.obj").write_text("v 0 0 0\nf 1 1 1\n")
    (folder / "shelf.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n")
    write_obj(folder, "wardrobe", chest(1.6, 2.2, 0.6), scale=7.3)  # of no unit that there is
    done, found = records(tmp_path, folder)
    assert (done.models, done.usable, len(done.faults)) == (7, 1, 6)
    said = {key: record.fault for key, record in found.items()}
    assert said["chair.obj"] == ""
    assert "'gizmo' is of no known category; set `category` in the table" in said["gizmo.obj"]
    assert "desk.glb: cannot be read" in said["desk.glb"]
    assert "sofa.usda: not a USD file that can be read" in said["sofa.usda"]
    assert "table.obj: all points of its triangles are one" in said["table.obj"]
    assert "shelf.obj: cannot be read (IndexError: index 8 is out of bounds" in said["shelf.obj"]
    assert "says no unit, and its size tells none; set `metres` in the table" in said["wardrobe.obj"]


@pytest.mark.parametrize(("scale", "unit"), [(1, 1), (100, 0.01), (1000, 0.001), (39.37, 0.0254)])
def test_the_unit_of_a_model_that_tells_none_is_the_likely_one(tmp_path, scale, unit):
    write_obj(tmp_path / "models", "dining_chair", seat(), scale=scale)
    _, found = records(tmp_path, tmp_path / "models")
    assert found["dining_chair.obj"].dims == pytest.approx((0.5, 0.9, 0.5), rel=0.01)


def test_textures_that_are_not_there_are_told(tmp_path):
    folder = tmp_path / "models"
    write_obj(folder, "chair", seat(), texture="missing/oak.png")
    write_obj(folder, "stool", seat(), texture="missing/ash.png")
    (folder / "stool.mtl").write_text((folder / "stool.mtl").read_text().lower())  # some programs write it so
    write_usd(folder / "desk.usda", chest(), texture="./missing/oak.png")
    _, found = records(tmp_path, folder)
    assert found["chair.obj"].missing == ("missing/oak.png",)
    assert found["stool.obj"].missing == ("missing/ash.png",)
    assert found["desk.usda"].missing == ("oak.png",)
    assert found["chair.obj"].usable
    assert found["desk.usda"].usable


def test_the_transform_of_a_root_prim_counts(tmp_path):
    turn = np.eye(4)
    turn[:3, :3] = [[0, 0, 2], [0, 2, 0], [-2, 0, 0]]
    turn[:3, 3] = (5, 1, 3)
    write_usd(tmp_path / "models/dresser.usda", chest(), own_transform=turn)
    _, found = records(tmp_path, tmp_path / "models")
    record = found["dresser.usda"]
    assert record.dims == pytest.approx((2.4, 1.6, 0.9), abs=1e-3)  # twice as large, its front found at +X
    assert record.turn[6:] == pytest.approx((1, 0, 0), abs=1e-9)


def test_what_is_no_index_is_said(tmp_path, monkeypatch):
    with pytest.raises(ValueError, match=r"nowhere: no such file or folder"):
        index([tmp_path / "nowhere"], tmp_path / "lib.parquet")
    (tmp_path / "empty").mkdir()
    with pytest.raises(ValueError, match="holds no models; allowed: usd, usda, usdc, usdz, glb, gltf, obj"):
        index([tmp_path / "empty"], tmp_path / "lib.parquet")
    with pytest.raises(ValueError, match=r"lib.parquet: no such file, allowed: an index, made by `echousd assets"):
        read_library(tmp_path / "lib.parquet")
    (tmp_path / "lib.parquet").write_bytes(b"PAR1 no")
    with pytest.raises(ValueError, match=r"lib.parquet: cannot be read as an index"):
        read_library(tmp_path / "lib.parquet")
    os.mkfifo(tmp_path / "pipe.parquet")
    with pytest.raises(ValueError, match=r"pipe.parquet: not a regular file, allowed: an index"):
        read_library(tmp_path / "pipe.parquet")
    table.write_library(tmp_path / "big.parquet", [])
    monkeypatch.setattr(table, "LARGEST", -1)
    with pytest.raises(ValueError, match=r"big.parquet: .* bytes when unpacked, allowed: -1"):
        read_library(tmp_path / "big.parquet")


def test_pyarrow_is_asked_for_by_name(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    with pytest.raises(ImportError, match=r"libraries of assets need pyarrow: pip install 'echousd\[assets\]'"):
        index([tmp_path], tmp_path / "lib.parquet")
