"""Files at which OpenUSD itself ends: another process reads them first, and its end is a line with their name."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys

import pytest
import trimesh
from inline_batches import QUICK, Inline
from pxr import Sdf

from echousd.assets.index import index
from echousd.batches.batch import batch
from echousd.batches.journal import room_digest
from echousd.batches.verify import verify
from echousd.stage import apart
from echousd.stage.apart import check_apart, fatal
from echousd.stage.encoding import StageError

DEEP = "#usda 1.0\n" + 'def "a" {\n' * 20_000 + "}\n" * 20_000  # deeper than OpenUSD's own stack


@pytest.fixture
def deadly(tmp_path):
    path = tmp_path / "deep.usda"
    path.write_text(DEEP)
    return path


def test_openusd_ends_at_it(deadly):
    """The day on which this fails, the file is no example any more."""
    code = f"from echousd.stage.files import open_stage; open_stage({str(deadly)!r})"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, check=False).returncode < 0


def test_the_file_that_ends_the_reader_is_named(deadly, tmp_path):
    (tmp_path / "good.usda").write_text('#usda 1.0\ndef "a" {}\n')
    (tmp_path / "broken.usda").write_text("#usda 1.0\ndef {")
    (tmp_path / "root.usda").write_text('#usda 1.0\n(subLayers = [@./good.usda@, @./deep.usda@])\ndef "a" {}\n')
    os.mkfifo(tmp_path / "pipe.usda")
    (tmp_path / "piped.usda").write_text("#usda 1.0\n(subLayers = [@./pipe.usda@])\n")
    names = ("good.usda", "deep.usda", "broken.usda", "root.usda", "pipe.usda", "piped.usda", "none.usda")
    found = fatal(tmp_path / name for name in names)
    assert {path.name for path in found} == {"deep.usda", "root.usda"}
    assert all(told.startswith(f"{deadly}: reading it ends the program (signal ") for told in found.values())
    with pytest.raises(StageError, match=r"deep.usda: reading it ends the program"):
        check_apart(tmp_path / "root.usda")


@pytest.mark.skipif(sys.platform != "linux", reason="no other system counts what a process holds")
def test_a_small_file_that_composes_to_gigabytes_is_one_of_them(tmp_path, monkeypatch):
    monkeypatch.setattr("echomodel.files.HELD", 16 * 2**20)
    layer = Sdf.Layer.CreateNew(str(tmp_path / "many.usda"))
    for number in range(12):
        for child in range(8):
            prim = Sdf.CreatePrimInLayer(layer, f"/level_{number}/child_{child}")
            prim.referenceList.Prepend(Sdf.Reference("", f"/level_{number + 1}"))
    layer.Save()
    assert list(fatal([tmp_path / "many.usda"])) == [tmp_path / "many.usda"]


def test_a_file_that_stays_is_read_once(deadly, tmp_path, monkeypatch):
    (tmp_path / "good.usda").write_text('#usda 1.0\ndef "a" {}\n')
    files, calls = [deadly, tmp_path / "good.usda"], []
    first = fatal(files)
    monkeypatch.setattr(apart, "_read", lambda paths: calls.append(paths) or (None, ""))
    assert fatal(files) == first
    assert not calls
    deadly.write_text("#usda 1.0\n")
    assert fatal(files) == {}
    assert calls == [[deadly]]


def test_commands_tell_it(deadly, tmp_path, echousd_command):
    for words in (("check", deadly), ("adopt", deadly, "-o", tmp_path / "out")):
        done = echousd_command(*words)
        assert done.code == 2
        assert f"{deadly}: reading it ends the program (signal " in done.err
    assert not (tmp_path / "out").exists()
    done = echousd_command("check", deadly, deadly, "--json")
    assert (done.code, "ends the program" in json.loads(done.out)[0]["error"]) == (2, True)


def test_an_index_leaves_it_out(deadly, tmp_path):
    (tmp_path / "models").mkdir()
    shutil.copy(deadly, tmp_path / "models/chair.usda")
    trimesh.creation.box((0.5, 0.9, 0.5)).export(tmp_path / "models/stool.glb")
    done = index([tmp_path / "models"], tmp_path / "lib.parquet")
    assert (done.models, done.usable) == (2, 1)
    assert "chair.usda: reading it ends the program" in done.faults[0]


def test_a_run_that_was_sent_is_verified(deadly, tmp_path):
    graph = {"room": {"type": "bedroom"}, "nodes": [{"name": "desk", "category": "desk"}]}
    (tmp_path / "graphs.jsonl").write_text(json.dumps(graph) + "\n")
    assert batch(tmp_path / "graphs.jsonl", tmp_path / "run", executor=Inline(), **QUICK).complete
    (room,) = (tmp_path / "run/rooms/0000").iterdir()
    shutil.copy(deadly, room / f"{room.name}.usda")
    journal = tmp_path / "run/.batch/shard_0_of_1/journal.jsonl"
    row = json.loads(journal.read_text().splitlines()[-1])
    journal.write_text(json.dumps({**row, "sha256": room_digest(room)}) + "\n")
    (wrong,) = verify(tmp_path / "run", check=True)
    assert "reading it ends the program" in wrong.problem
