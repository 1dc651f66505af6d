"""Libraries that somebody sent: pipes, bombs and odd tables end in a line, and no file outside is read for one."""

from __future__ import annotations

import gzip
import math
import os
import shutil
import struct
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest
import trimesh

from echousd.assets import catalogues, table
from echousd.assets.index import index
from echousd.assets.licences import licence_beside
from echousd.assets.table import read_library, write_library

CATALOGUE = "PluginFurnitureCatalog.properties"
ROW = "name#1=Chair\nmodel#1=/a.obj\nwidth#1={}\nheight#1=90\ndepth#1=50\ncategory#1=Chairs\n"
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\n"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "models").mkdir()
    trimesh.creation.box((0.5, 0.9, 0.5)).export(tmp_path / "models/chair.glb")
    return tmp_path / "models"


def indexed(folder):
    return index([folder], folder.parent / "lib.parquet")


@pytest.mark.parametrize(
    "name", ["t.csv", "semantics/o.csv", "b.glb", "b.usda", "b.sh3f", "LICENSE", "README.md", "annotations.json"]
)
@pytest.mark.parametrize("make", [os.mkfifo, lambda path: path.symlink_to("/dev/zero")], ids=["pipe", "device"])
def test_pipes_and_devices_are_left_alone(folder, name, make):
    (folder / name).parent.mkdir(exist_ok=True)
    make(folder / name)
    assert indexed(folder).usable == 1


def test_tables_that_are_pipes_are_told(folder, echousd_command):
    for name in ("3dmodels.csv", "listings_1.json"):
        os.mkfifo(folder / name)
        with pytest.raises(ValueError, match=r"not a regular file|holds no models"):
            indexed(folder)
        (folder / name).unlink()
        (folder / "3dmodels.csv").write_text("3dmodel_id,path\na,x.glb\n")
    (folder / "3dmodels.csv").unlink()
    (folder / "u.usda").write_text('#usda 1.0\n(defaultPrim="A")\ndef Xform "A" (references=@./f.usda@){}\n')
    os.mkfifo(folder / "f.usda")
    done = indexed(folder)
    assert "f.usda', not a regular file, allowed: layers" in done.faults[0]
    os.mkfifo(folder.parent / "lib.csv")
    done = echousd_command("assets", "index", folder, "-o", folder.parent / "lib.parquet")
    assert (done.code, "lib.csv: not a regular file" in done.err) == (2, True)


def test_rows_lead_nowhere_else(folder):
    outside = folder.parent / "outside"
    shutil.copytree(folder, outside)
    (folder / "metadata").mkdir()
    (folder / "metadata/3dmodels.csv").write_text(
        f"3dmodel_id,path\na,{outside / 'chair.glb'}\nb,../../outside/chair.glb\n,chair.glb\n"
    )
    (folder / "original").mkdir()
    with pytest.raises(ValueError, match=r"holds no models.*3 of 3 models are not below"):
        indexed(folder)
    (folder / "metadata/3dmodels.csv").write_text("path\nchair.glb\n")
    shutil.copy(folder / "chair.glb", folder / "original/chair.glb")
    with pytest.raises(ValueError, match="holds no models"):
        indexed(folder)


def packed(folder, **members):
    with zipfile.ZipFile(folder / "x.sh3f", "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in {CATALOGUE: ROW.format(50), "a.obj": OBJ * 200, **members}.items():
            archive.writestr(name, text)
    return folder / "x.sh3f"


def changed(path, where, what):
    """Every header of an archive with other bytes: `where` from the local one, 2 further on in the central one."""
    content = bytearray(path.read_bytes())
    for mark, shift in ((b"PK\x03\x04", 0), (b"PK\x01\x02", 2)):
        at = -1
        while (at := content.find(mark, at + 1)) >= 0:
            struct.pack_into("<H", content, at + where + shift, what)
    path.write_bytes(bytes(content))


@pytest.mark.parametrize("width", ["nan", "inf", "-5", "x", "1e9"])
def test_sizes_of_no_thing_are_left_out(folder, width):
    packed(folder, **{CATALOGUE: ROW.format(width)})
    with pytest.raises(ValueError, match="holds no models"):
        indexed(folder)


@pytest.mark.parametrize("fault", ["damaged", "encrypted", "method"])
def test_archives_that_cannot_be_unpacked_are_told(folder, fault):
    path = packed(folder)
    if fault == "damaged":
        content = bytearray(path.read_bytes())
        start = content.index(b".properties") + 20
        content[start : start + 30] = bytes(range(200, 230))
        path.write_bytes(bytes(content))
    else:
        changed(path, *((6, 1) if fault == "encrypted" else (8, 99)))
    with pytest.raises(ValueError, match=r"x.sh3f: cannot be read"):
        indexed(folder)


def test_damaged_members_are_faults(folder):
    path = packed(folder)
    content = bytearray(path.read_bytes())
    start = content.index(b"a.obj") + 10
    content[start : start + 30] = bytes(range(200, 230))
    path.write_bytes(bytes(content))
    (fault,) = indexed(folder).faults
    assert "x.sh3f!a.obj: cannot be read" in fault


def test_bombs_are_not_unpacked(folder, monkeypatch):
    monkeypatch.setattr("echousd.assets.catalogues.UNPACKED", 2**16)
    packed(folder, **{CATALOGUE: "#" * 2**17})
    with pytest.raises(ValueError, match=rf"{CATALOGUE} of 131072 bytes, allowed: 65536"):
        indexed(folder)
    (folder / "x.sh3f").unlink()
    monkeypatch.setattr(catalogues, "MAX_TEXT", 2**16)
    (folder / "annotations.json.gz").write_bytes(gzip.compress(b" " * 2**17))
    with pytest.raises(ValueError, match="more than 65536 bytes, allowed for a table"):
        indexed(folder)
    (folder / "annotations.json.gz").unlink()
    with (folder / "README.md").open("wb") as file:
        file.truncate(20 << 30)
    licence_beside.cache_clear()
    assert indexed(folder).usable == 1
    with (folder / "chair2.obj").open("wb") as file:
        file.truncate(1 << 30)
    assert "1073741824 bytes, allowed for a model: 1 to 268435456" in indexed(folder).faults[0]


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"dims": ()}, r"row 1: dims is \(\), allowed: 3 finite numbers"),
        ({"low": (math.nan,) * 3}, "low is .*allowed: 3 finite numbers"),
        ({"turn": (1.0,) * 4}, "turn is .*allowed: 9 finite numbers"),
        ({"category": "\0"}, "category is .*allowed: text without a zero byte"),
        ({"low": (None, 1.0, 2.0)}, "row 1 has no low"),
        ({"tags": (None,)}, "row 1 has no tags"),
        ({"descriptor": (None,)}, "row 1 has no descriptor"),
        ({"descriptor": (math.inf,)}, "descriptor is .*allowed: finite numbers"),
        ({"dims": (0.0, -1.0, 1.0)}, "dims is .*allowed: metres above 0"),
        ({"confidence": math.nan}, "confidence is nan, allowed: 0 to 1"),
        ({"uri": "chair\0.glb"}, r"row 1: uri is 'chair\\x00.glb', allowed: text without a zero byte"),
        ({"front_confidence": 7.0}, "front_confidence is 7.0, allowed: 0 to 1"),
    ],
)
def test_an_index_is_read_with_doubt(folder, change, told):
    indexed(folder)
    file = folder.parent / "lib.parquet"
    write_library(file, [replace(record, **change) for record in read_library(file).records.values()])
    table._read.cache_clear()
    with pytest.raises(ValueError, match=told):
        read_library(file)


def test_an_index_that_claims_everything_gets_the_models_own_folder(folder):
    indexed(folder)
    library = read_library(folder.parent / "lib.parquet")
    (record,) = library.records.values()
    assert library.root(record) == Path(os.path.realpath(folder))
    for root in (os.path.relpath("/", folder.parent), os.path.relpath(Path.home(), folder.parent)):
        assert library.root(replace(record, root=root)).resolve() == folder.resolve()
