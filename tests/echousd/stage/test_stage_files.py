"""Files that appear together or not at all."""

import tempfile
from pathlib import Path

import pytest
from pxr import Sdf

from echousd.stage import files
from echousd.stage.files import layer_bytes, write_all


def test_a_folder_in_the_way_is_found_before_anything_is_written(tmp_path):
    (tmp_path / "first.usda").write_text("mine")
    (tmp_path / "second.jpg").mkdir()
    files = {tmp_path / name: b"new" for name in ("first.usda", "textures/a.jpg", "second.jpg", "third.jpg")}
    with pytest.raises(
        ValueError, match=r"second\.jpg: cannot be written \(a folder has that name\); nothing was changed"
    ):
        write_all(files)
    assert (tmp_path / "first.usda").read_text() == "mine"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["first.usda", "second.jpg"]


def test_the_file_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "plain").write_text("no folder")
    files = {tmp_path / name: b"new" for name in ("first.usda", "plain/second.jpg", "third.jpg")}
    with pytest.raises(ValueError, match=r"plain(/second\.jpg)?: cannot be written .*; nothing was changed"):
        write_all(files)
    assert [path.name for path in tmp_path.iterdir()] == ["plain"]


def test_a_name_that_is_refused_is_told_by_itself(tmp_path, monkeypatch):
    """What fails when the files take their names, after all of them are on the disk, is the one that is named."""
    rename = Path.replace

    def refuse(path, target):
        if target.name == "first.usda":
            raise PermissionError(13, "Permission denied", str(path))
        return rename(path, target)

    monkeypatch.setattr(Path, "replace", refuse)
    with pytest.raises(ValueError, match=r"first\.usda: cannot be written \(Permission denied\); others .* may"):
        write_all({tmp_path / name: b"new" for name in ("first.usda", "second.jpg")})


def test_a_layer_has_the_same_bytes_where_files_are_not_kept_in_memory(tmp_path, monkeypatch):
    layer = Sdf.Layer.CreateAnonymous(".usdc")
    Sdf.CreatePrimInLayer(layer, "/Room/Table")
    found = layer_bytes(layer, ".usdc")
    monkeypatch.setattr(files, "MEMORY", tmp_path / "none")  # another system
    assert layer_bytes(layer, ".usdc") == found
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "none"))
    with pytest.raises(OSError, match="cannot write a layer to"):
        layer_bytes(layer, ".usdc")
