"""Files at which OpenUSD itself ends: another process reads them first, and its end is a line with their name."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys

import pytest
import trimesh
from inline_batches import QUICK, Inline, batch
from pxr import Sdf
from small_room import BARE, StandIn, small_graph

import echousd
from echousd.assets.index import index
from echousd.batches.plan import room_digest
from echousd.batches.verify import verify
from echousd.draw import rendering
from echousd.stage import apart, harmless
from echousd.stage.apart import check_apart, fatal
from echousd.stage.encoding import StageError
from echousd.stage.files import open_stage

DEEP = "#usda 1.0\n" + 'def "a" {\n' * 20_000 + "}\n" * 20_000  # deeper than OpenUSD's own stack


def content(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def deadly(tmp_path):
    path = tmp_path / "deep.usda"
    path.write_text(DEEP)
    return path


def test_openusd_ends_at_it_and_not_at_what_is_flatter(deadly):
    """The day on which this fails, the file is no example any more, or `NESTED` too many."""
    code = "from echousd.stage import files, harmless; harmless._harmless = lambda path: True; files.open_stage({!r})"
    words = [sys.executable, "-c", code.format(str(deadly))]
    assert subprocess.run(words, capture_output=True, check=False).returncode < 0
    for begin, end in (('def "a" {\n', "}\n"), ('def "a" ( customData = {\n', "}) {}\n"), ("int[] a = [", "]")):
        deadly.write_text("#usda 1.0\n" + begin * harmless.NESTED + end * harmless.NESTED)
        assert subprocess.run(words, capture_output=True, check=False).returncode in (0, 1)


def test_the_file_that_ends_the_reader_is_named(deadly, tmp_path, monkeypatch):
    monkeypatch.setattr(apart, "subprocess", subprocess)  # no fork of `forked_reader`
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
    monkeypatch.setattr(apart, "_read", lambda paths: calls.append(paths) or (None, "", []))
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


COMMANDS = (
    ("render", "{root}", "-o", "{out}.png", "--view", "top"),
    ("edit", "{root}", "--remove", "lamp", "--shapes", "boxes"),
    ("export", "{root}", "-o", "{out}.glb"),
    ("texture", "export", "{root}", "-o", "{out}", "--for", "generic"),
    ("assets", "pack", "{root}", "-o", "{out}"),
    ("graph", "{root}"),
    ("graph", "{root}", "--json"),
    ("new", "{out}.yaml", "--from", "{root}"),
    ("generate", "{root}", "-o", "{out}", "--shapes", "boxes"),
)


@pytest.fixture(scope="module")
def rooms(tmp_path_factory):
    """Rooms as they are written: with layers of text, of crates, and beside a store."""
    top = tmp_path_factory.mktemp("rooms")
    for name, more, store in (("text", {}, None), ("crates", {"crate": True}, None), ("stored", {}, top / "store")):
        made = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False, **{**BARE, **more})
        made.save(top / name, preview=False, store=store)
    return top


@pytest.fixture
def stand_in(monkeypatch):
    monkeypatch.setattr("echousd.make.layouts.load_model", lambda *_, **__: StandIn())
    monkeypatch.setattr("echomodel.echo.EchoModel.load", classmethod(lambda cls, path=None, **options: StandIn()))
    monkeypatch.setattr("echousd.make.save.PREVIEW", 16)
    monkeypatch.setitem(rendering.QUALITIES, "fast", (16, 1))


@pytest.mark.parametrize("words", COMMANDS, ids=lambda words: " ".join(words[:2]).replace(" {root}", ""))
@pytest.mark.parametrize("where", ["text.usda", "assets/bed/bed.usda"])
def test_no_command_ends_at_a_layer_of_a_room(rooms, words, where, deadly, tmp_path, echousd_command, stand_in):
    folder = shutil.copytree(rooms / "text", tmp_path / "text")
    shutil.copy(deadly, folder / where)
    before = content(folder)
    names = {"root": folder / "text.usda", "out": tmp_path / "out"}
    done = echousd_command(*(word.format(**names) for word in words))
    if where == "text.usda" and "pack" in words:  # which asks for assets alone
        assert done.code == 0
        return
    assert done.code == 2
    assert f"{folder / where}: reading it ends the program (signal " in done.err
    assert content(folder) == before


@pytest.mark.parametrize("where", ["text.usda", "shot.usda", "shots/shot.usda"])
def test_nothing_is_written_over_a_room_with_such_a_layer(rooms, deadly, tmp_path, where):
    """The root would be merged, and any other might name an asset that the new room lacks."""
    folder = shutil.copytree(rooms / "text", tmp_path / "text")
    (folder / where).parent.mkdir(exist_ok=True)
    deadly.rename(folder / where)
    before = content(folder)
    made = echousd.generate(small_graph().remove_node("wardrobe"), model=StandIn(), shapes="boxes", place=False, **BARE)
    with pytest.raises(StageError, match=rf"{folder / where}: reading it ends the program \(signal "):
        made.save(folder, preview=False)
    assert content(folder) == before


ONCE = [("text", COMMANDS[:5]), ("crates", COMMANDS[5:6]), ("stored", COMMANDS[1:3])]


@pytest.mark.parametrize(("name", "commands"), ONCE)
def test_rooms_of_ours_are_read_once(rooms, name, commands, tmp_path, monkeypatch, echousd_command, stand_in):
    for number, words in enumerate(commands):
        top = shutil.copytree(rooms, tmp_path / str(number))
        names = {"root": top / name / f"{name}.usda", "out": top / "out"}
        monkeypatch.setattr(apart, "_read", lambda paths: pytest.fail(f"{paths} read apart"))
        assert echousd_command(*(word.format(**names) for word in words)).code in (0, 1)


def test_a_crate_that_was_changed_is_read_apart(rooms, tmp_path, monkeypatch):
    folder, calls = shutil.copytree(rooms / "text", tmp_path / "text"), []
    monkeypatch.setattr(apart, "_read", lambda paths, real=apart._read: calls.append(paths) or real(paths))
    file = folder / "assets/bed/bed_geo.usdc"
    file.write_bytes(file.read_bytes() + b"!")
    open_stage(folder / "text.usda")
    open_stage(folder / "text.usda")
    assert calls == [[folder / "text.usda"]]
    unlisted = shutil.copy(rooms / "text/assets/bed/bed_geo.usdc", tmp_path / "bed.usdc")
    open_stage(unlisted)
    assert calls == [[folder / "text.usda"], [unlisted]]


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
    ((_, problem),) = verify(tmp_path / "run", check=True)
    assert "reading it ends the program" in problem
