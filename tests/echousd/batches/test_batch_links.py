"""A run that somebody sent: it is gone on with, packed and verified without a byte read or written outside of it."""

from __future__ import annotations

import json
import os
import shutil
import tarfile
from pathlib import Path

import pytest
from inline_batches import QUICK, Inline, batch

from echomodel.files import HOST
from echousd.batches.plan import room_digest
from echousd.batches.verify import finish, verify
from echousd.store import KEY

SECRET = b"precious"


@pytest.fixture(scope="module")
def sent(tmp_path_factory):
    """The graphs and the folder of a run with one room."""
    top = tmp_path_factory.mktemp("sent")
    nodes = [{"name": "desk", "category": "desk"}]
    (top / "graphs.jsonl").write_text(json.dumps({"room": {"type": "bedroom"}, "nodes": nodes}) + "\n")
    assert batch(top / "graphs.jsonl", top / "run", executor=Inline(), **QUICK).complete
    return top


@pytest.fixture
def run(sent, tmp_path):
    shutil.copytree(sent / "run", tmp_path / "run")
    (tmp_path / "outside").mkdir()
    (tmp_path / "outside/secret").write_bytes(SECRET)
    return tmp_path / "run"


def outside(run):
    top = run.parent / "outside"
    return {path.relative_to(top): path.read_bytes() if path.is_file() else b"" for path in sorted(top.rglob("*"))}


def linked(path: Path, target: Path, *, keep: bool) -> None:
    """A link in the place of a file or folder, which moves to where the link leads or is gone."""
    if keep:
        path.rename(target)
    elif path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink()
    path.symlink_to(target)


@pytest.mark.parametrize("keep", [True, False], ids=["there", "dangling"])
@pytest.mark.parametrize(
    "name", [".batch", ".batch/shard_0_of_1", ".batch/shard_0_of_1/journal.jsonl", "store", "rooms/0000"]
)
def test_no_link_takes_a_resumed_run_outside(sent, run, name, keep):
    linked(run / name, run.parent / "outside/taken", keep=keep)
    if name == "store" and keep:  # what would be thrown away as damaged
        place = next(path for path in (run.parent / "outside/taken").glob("*/*") if KEY.fullmatch(path.name))
        file = next(path for path in place.rglob("*") if path.is_file())
        file.chmod(0o644)
        file.write_bytes(SECRET)
    before = outside(run)
    with pytest.raises(ValueError, match=rf"{Path(name).name} is a link to .*outside/taken, outside of"):
        batch(sent / "graphs.jsonl", run, executor=Inline(), resume=True, **QUICK)
    assert outside(run) == before


def test_a_link_that_waits_for_a_file_is_replaced(run, monkeypatch):
    """The name under which a file is written is known beforehand, but for the number of the process."""
    for name in ("manifest.jsonl", "summary.json", "index.html", "index.usda"):
        (run / f".{name}.{HOST}_{os.getpid()}.partial").symlink_to(run.parent / "outside/new")
        (run / name).symlink_to(run.parent / "outside/secret")
    before = outside(run)
    finish(run)
    assert outside(run) == before
    assert not any(path.is_symlink() for path in run.iterdir())


@pytest.mark.parametrize("ending", [".png", ".json"])
def test_tars_hold_nothing_from_outside(run, ending):
    (room,) = (run / "rooms/0000").iterdir()
    (room / f"{room.name}{ending}").unlink(missing_ok=True)
    (room / f"{room.name}{ending}").symlink_to(run.parent / "outside/secret")
    with pytest.raises(ValueError, match=rf"{room.name}{ending}.* is a link to .*outside/secret, outside of"):
        finish(run, webdataset=True)
    assert not any(SECRET in path.read_bytes() for path in run.rglob("*.tar"))


def test_a_room_with_a_link_is_another_room(run):
    (room,) = (run / "rooms/0000").iterdir()
    before = room_digest(room)
    assert list(verify(run)) == []
    (room / "note.txt").symlink_to("/dev/zero" if os.path.exists("/dev/zero") else run)  # noqa: PTH110
    assert room_digest(room) != before
    (room / "note.txt").unlink()
    graph = room / "layers/graph.usdc"
    graph.rename(run.parent / "graph.usdc")
    graph.symlink_to(run.parent / "graph.usdc")  # the same bytes, elsewhere
    assert [problem for _, problem in verify(run)] == ["changed since it was made"]


@pytest.mark.parametrize("url", ["s3://bucket/night", "file:///etc"])
def test_a_run_s_folder_is_on_a_disk(sent, url, echousd_command):
    done = echousd_command("batch", sent / "graphs.jsonl", "-o", url)
    assert (done.code, "allowed: a folder on a disk" in done.err) == (2, True)


@pytest.mark.skipif(os.name != "posix", reason="names of files are bytes")
def test_a_file_name_that_is_no_text_is_told_and_gone_on_with(tmp_path):
    (tmp_path / "graphs").mkdir()
    (Path(os.fsdecode(bytes(tmp_path / "graphs") + b"/b\xff.json"))).write_text("{}")
    for resume in (False, True):
        assert batch(tmp_path / "graphs", tmp_path / "run", executor=Inline(), resume=resume, **QUICK).failed == 1
    assert finish(tmp_path / "run")["failed"] == 1
    assert "b?.json" in (tmp_path / "run/manifest.jsonl").read_text()


def test_a_tar_holds_the_rooms(run):
    finish(run, webdataset=True)
    with tarfile.open(run / "webdataset/rooms-000000.tar") as tar:
        assert [name.rpartition(".")[2] for name in tar.getnames()] == ["json"]
