"""Rooms on a file system of fsspec are those of a folder: whole, gone on with, verified, shown beside their sheet."""

import json

import fsspec
import pytest
from inline_batches import QUICK, Inline, digests
from pxr import Usd

from echousd.batches.batch import batch
from echousd.batches.remote import Remote, fetched
from echousd.batches.verify import finish, verify

URL = "memory://bucket/night"


@pytest.fixture
def bucket():
    """The memory's file system, empty."""
    files = fsspec.filesystem("memory")
    files.store.clear()
    return files


@pytest.fixture
def graphs(tmp_path):
    """Two graphs of two objects."""
    path, lines = tmp_path / "graphs.jsonl", []
    for things in (("double_bed", "wardrobe"), ("desk", "wardrobe")):
        nodes = [{"name": thing, "category": thing} for thing in things]
        lines.append(json.dumps({"room": {"type": "bedroom"}, "nodes": nodes}))
    path.write_text("".join(f"{line}\n" for line in lines))
    return path


def test_rooms_go_to_a_bucket_and_are_those_of_a_folder(bucket, graphs, tmp_path):
    here, out = tmp_path / "here", tmp_path / "there"
    batch(graphs, here, executor=Inline(), **QUICK)
    assert batch(graphs, out, executor=Inline(), to=URL, **QUICK).complete
    assert sorted(path.name for path in out.iterdir()) == [".batch"]
    assert list(verify(out, check=True, to=URL)) == list(verify(here, check=True))
    held = Remote(URL).sizes()
    assert {path for path in held if path.startswith("store/")} == {
        path.relative_to(here).as_posix() for path in (here / "store").rglob("*") if path.is_file()
    }
    for room, digest in digests(here).items():
        with fetched(URL, f"rooms/0000/{room}") as copy:
            assert digests(copy) == {room: digest}
            assert Usd.Stage.Open(str(copy / "rooms" / "0000" / room / f"{room}.usda")).GetPrimAtPath("/Room/Objects")
    finish(here)
    finish(out)
    for name in ("manifest.jsonl", "index.html", "index.usda"):
        assert bucket.cat(f"/bucket/night/{name}") == (out / name).read_bytes()
    assert (out / "index.usda").read_bytes() == (here / "index.usda").read_bytes()

    # what is cut short or changed is told, and made again
    bucket.rm("/bucket/night/rooms/0000/graphs_000001/graphs_000001.json")
    bucket.pipe_file("/bucket/night/rooms/0000/graphs_000000/layers/graph.usda", b"#usda 1.0\n")
    assert {wrong.room for wrong in verify(out, to=URL)} == {"graphs_000000", "graphs_000001"}
    again = Inline()
    assert batch(graphs, out, executor=again, to=URL, resume=True, **QUICK).complete
    assert sorted(again.calls) == ["graphs_000000", "graphs_000001"]
    assert list(verify(out, to=URL)) == []
    lost = next(path for path in bucket.find("/bucket/night/store") if path.endswith(".usdc"))
    bucket.rm(lost)
    assert {"missing in the store" in wrong.problem for wrong in verify(out, to=URL)} == {True}
    assert batch(graphs, out, executor=Inline(), to=URL, resume=True, **QUICK).complete
    assert bucket.exists(lost)
    assert list(verify(out, to=URL)) == []
    assert batch(graphs, out, executor=(idle := Inline()), to=URL, resume=True, **QUICK).complete
    assert idle.calls == []
    with pytest.raises(ValueError, match=r'another plan \(to was "memory://bucket/night", now null\)'):
        batch(graphs, out, executor=Inline(), resume=True, **QUICK)


def test_a_bucket_that_is_not_there_is_told_before_the_first_room(graphs, tmp_path):
    for to, said in (
        ("nothing://bucket", "nothing://bucket: no file system that fsspec can reach"),
        ("bucket/night", "bucket/night: allowed: -o a folder on a disk, --to a URL"),
    ):
        with pytest.raises(ValueError, match=said):
            batch(graphs, tmp_path / "run", executor=Inline(), to=to, **QUICK)
    with pytest.raises(ValueError, match="allowed: -o a folder on a disk, --to a URL"):
        batch(graphs, "s3://bucket/night", executor=Inline(), **QUICK)
    assert not (tmp_path / "run").exists()


def test_what_cannot_be_written_there_fails_a_room_with_its_cause(bucket, graphs, tmp_path, monkeypatch):
    def full(self, *_, **__):
        raise OSError("the bucket is gone")

    with monkeypatch.context() as patch:
        patch.setattr(type(bucket), "put_file", full)
        result = batch(graphs, tmp_path / "run", executor=Inline(), to=URL, **QUICK)
    assert (result.done, result.failed) == (0, 2)
    assert [wrong.problem for wrong in verify(tmp_path / "run", to=URL)] == [
        f"failed: {URL}: cannot be written (the bucket is gone)"
    ] * 2
    assert batch(graphs, tmp_path / "run", executor=Inline(), to=URL, resume=True, **QUICK).complete
