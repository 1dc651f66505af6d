"""Small files that unpack to gigabytes: each is told in a line by a process that may hold one gigabyte."""

from __future__ import annotations

import gzip
import json
import re
import subprocess
import sys
import zipfile

import numpy as np
import pytest
from PIL import Image

from echomodel import files

ROW = "name#1=Chair\nmodel#1=/a.obj\nwidth#1=50\nheight#1=90\ndepth#1=50\ncategory#1=Chairs\n"
CHILD = """
import itertools, json, resource, sys
from pathlib import Path
from echousd.assets.index import index
from echousd.assets.table import read_library
from echousd.batches.sources import find_graphs
from echousd.textures import read_image

def held():  # ru_maxrss would be that of the process that began this one
    words = Path("/proc/self/status").read_text().split()
    return int(words[words.index("VmHWM:") + 1]) // 1024


top = Path(sys.argv[1])
resource.setrlimit(resource.RLIMIT_DATA, (2**30, 2**30))
reads = {
    "archive": lambda: index([top / "sh3f"], top / "a.parquet").faults[0],
    "table": lambda: index([top / "annotated"], top / "b.parquet"),
    "index": lambda: read_library(top / "index.parquet"),
    "graphs": lambda: max(found.error for found in itertools.islice(find_graphs([str(top / "graphs.parquet")]), 900)),
    "image": lambda: str(read_image(str(top / "image.png")).shape),
}
for name, read in reads.items():
    try:
        told = read()
    except ValueError as error:
        told = str(error)
    print(json.dumps([name, told, held()]))
"""


def in_a_new_process(imports, *calls):
    """What each call raises where a file may take little beside its bytes; a worker of tests has memory to spare."""
    lines = ["import json", "from echomodel import files", imports, "files.HELD, told = 0, []"]
    for call in calls:
        lines += ["try:", f"    told.append({call} and 'read')"]
        lines += ["except ValueError as error:", "    told.append(str(error))"]
    code = "\n".join([*lines, "print(json.dumps(told))"])
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.skipif(sys.platform != "linux", reason="no other system counts what a process holds")
def test_a_gigabyte_is_enough_for_what_somebody_packed(tmp_path):
    pyarrow = pytest.importorskip("pyarrow")
    import pyarrow.parquet as parquet

    from echousd.assets.record import AssetRecord
    from echousd.assets.table import write_library

    (tmp_path / "sh3f").mkdir()
    with zipfile.ZipFile(tmp_path / "sh3f/x.sh3f", "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("PluginFurnitureCatalog.properties", ROW)
        archive.writestr("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n" * 7_000_000)  # 220 MB
    (tmp_path / "annotated").mkdir()
    (tmp_path / "annotated/x.glb").touch()
    (tmp_path / "annotated/annotations.json.gz").write_bytes(gzip.compress(b"[" + b"[]," * 2**25 + b"[]]", 1))
    write_library(tmp_path / "index.parquet", [AssetRecord("a", "a.obj", dims=(1.0, 1.0, 1.0), category="chair")])
    rows = parquet.read_table(tmp_path / "index.parquet").take(pyarrow.array(np.zeros(250_000, int)))
    parquet.write_table(rows, tmp_path / "index.parquet", compression="zstd")
    once = pyarrow.array(['{"nodes": [' + " " * 4000])
    column = pyarrow.DictionaryArray.from_arrays(pyarrow.array(np.zeros(1_000_000, np.int32)), once)
    parquet.write_table(pyarrow.table({"graph": column}), tmp_path / "graphs.parquet", compression="zstd")
    Image.new("P", (8192, 8192)).save(tmp_path / "image.png")
    assert max(path.stat().st_size for path in tmp_path.rglob("*") if path.is_file()) < 2**21

    done = subprocess.run(
        [sys.executable, "-c", CHILD, str(tmp_path)], capture_output=True, text=True, check=False, timeout=300
    )
    assert done.returncode == 0, done.stderr[-2000:]
    found = {name: (told, held) for name, told, held in map(json.loads, done.stdout.splitlines())}
    for name, file in (("archive", "x.sh3f!a.obj"), ("table", "annotations.json.gz"), ("index", "index.parquet")):
        assert f"{file}: takes more memory to read than 5" in found[name][0]
    assert "graphs.parquet:1: " in found["graphs"][0] or "graphs.parquet:9" in found["graphs"][0]
    assert found["image"][0] == "(8192, 8192, 3)"  # what is allowed can be read
    assert max(held for _, held in found.values()) < 1000


@pytest.mark.skipif(sys.platform != "linux", reason="no other system counts what a process holds")
def test_graphs_and_images_are_read_within_the_limit(tmp_path):
    for name, many in (("g.yaml", "[]," * 39_999), ("g.json", "{}," * 599_999)):
        (tmp_path / name).write_text('{"room": "bedroom", "nodes": [' + many + "{}]}")
    Image.new("RGB", (4096, 4096)).save(tmp_path / "image.png")
    told = in_a_new_process(
        "from echousd.graph import load_graph; from echousd.textures import read_image",
        *(f"load_graph({str(tmp_path / name)!r})" for name in ("g.yaml", "g.json")),
        f"read_image({str(tmp_path / 'image.png')!r})",
    )
    for name, text in zip(("g.yaml", "g.json", "image.png"), told, strict=True):
        assert re.search(rf"{name}: takes more memory to read than \d+ MiB", text), text


@pytest.mark.skipif(sys.platform != "linux", reason="no other system counts what a process holds")
def test_an_archive_of_undo_is_read_within_the_limit(tmp_path):
    (tmp_path / "history").mkdir()
    with zipfile.ZipFile(tmp_path / "history/1.zip", "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("room.usda", b" " * 2**26)
    (text,) = in_a_new_process(
        "from pathlib import Path; from echousd.folder import history",
        f"history._read_archive(Path({str(tmp_path)!r}), 'history/1.zip')",
    )
    assert re.search(r"history/1.zip: .*takes more memory to read than \d MiB", text), text


@pytest.mark.skipif(sys.platform != "linux", reason="no other system counts what a process holds")
def test_the_limit_ends_with_the_block(tmp_path):
    import resource

    before = resource.getrlimit(resource.RLIMIT_DATA)
    (tmp_path / "file").write_bytes(b"x" * 1000)
    told = r"file: takes more memory to read than 512 MiB, .* for 1000 bytes"
    with pytest.raises(ValueError, match=told), files.within_memory(tmp_path / "file"):
        bytearray(2**30)
    with files.within_memory(tmp_path / "file"):
        assert len(bytearray(2**28)) == 2**28
        with pytest.raises(ValueError, match="other: "), files.within_memory(tmp_path, "other", size=2**40):
            bytearray(2**30)  # an outer limit holds inside
    assert resource.getrlimit(resource.RLIMIT_DATA) == before
    assert len(bytearray(2**30)) == 2**30
