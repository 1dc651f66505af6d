"""Archives that somebody damaged, packed in every way there is: a line that names them, whichever reader meets them.

The gate draws a few damages of each; `ECHOUSD_MUTATIONS=600` draws so many.
"""

import os
import random
import zipfile

import pytest

from echousd.assets.catalogues import read_library
from echousd.assets.measure import measure
from echousd.assets.model_file import Beside, ModelFile
from echousd.folder.history import _read_archive
from echousd.store import Store

MANY = int(os.environ.get("ECHOUSD_MUTATIONS", "0").replace("all", "600")) or 40
PACKED = ["stored", "deflated", "bzip2", "lzma"]
CATALOGUE = "name#1=Chair\nmodel#1=/a.obj\nwidth#1=50\nheight#1=90\ndepth#1=50\ncategory#1=Chairs\n"
OBJ = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\n"


def model(path):
    with ModelFile(path, path.parent, "a.obj").opened() as file:
        file.read()


def beside(path):
    Beside(ModelFile(path, path.parent, "a.obj")).get("a.mtl")


def library(path):
    for told in read_library(path):
        measure(ModelFile(path, path.parent, told["member"]))


def history(path):
    _read_archive(path.parent, path.name)


def store(path):
    Store.create(path.parent / "store").collect([path.parent], grace=0)


@pytest.mark.parametrize("reader", [model, beside, library, history, store])
@pytest.mark.parametrize("how", PACKED)
def test_each_reader_names_it(tmp_path, how, reader):
    path = tmp_path / "a.sh3f"
    if reader is store:
        path = tmp_path / "history/1.zip"
        path.parent.mkdir()
    with zipfile.ZipFile(path, "w", getattr(zipfile, f"ZIP_{how.upper()}")) as archive:
        archive.writestr("PluginFurnitureCatalog.properties", CATALOGUE)
        archive.writestr("a.obj", OBJ * 9)
        archive.writestr("a.mtl", "newmtl a")
    reader(path)
    whole, told = path.read_bytes(), []
    for number in range(MANY):
        draw = random.Random(f"{how} {number}")
        content = bytearray(whole)
        for _ in range(draw.choice((1, 1, 4))):
            content[draw.randrange(len(content))] = draw.randrange(256)
        path.write_bytes(content[: draw.choice((None, None, draw.randrange(len(content))))])
        os.utime(path, ns=(number, number))  # another file than before
        try:
            reader(path)
        except ValueError as error:
            told.append(str(error))
    assert all(str(path) in line for line in told)
    assert told or reader is store
