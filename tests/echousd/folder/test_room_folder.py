import errno
import json
import os
from contextlib import nullcontext
from pathlib import Path

import pytest
from dying_process import killed
from pydantic import ValidationError
from stopped_disk import stopped_disk

from echousd.folder import journal
from echousd.folder.folder import check_output, check_writable, claim, recover, write_together
from echousd.folder.found import room_at, rooms_at
from echousd.folder.interrupted import read_journal
from echousd.folder.lock import LOCK
from echousd.folder.manifest import Manifest
from echousd.pending import JOURNAL, STAGING

OLD = {"assets/a.usda": b"a old", "layers/one.usda": b"one old", "room.usda": b"root old"}
NEW = {"assets/a.usda": b"a new", "assets/b.usda": b"b new", "layers/one.usda": b"one new", "room.usda": b"root new"}


def manifest(files):
    return {"room.json": json.dumps({"echousd_room": 1, "name": "room", "files": dict.fromkeys(files, "")}).encode()}


def written(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and STAGING not in path.parts and path.name != LOCK
    }


def save(folder, files, remove=()):
    return write_together(folder, {**files, **manifest(files)}, last=["room.usda", "room.json"], remove=remove)


def test_writes_changes_only_and_leaves_other_files(tmp_path):
    save(tmp_path, OLD)
    (tmp_path / "notes.txt").write_text("mine")
    untouched = (tmp_path / "assets/a.usda").stat().st_mtime_ns
    changed = save(tmp_path, {**NEW, "assets/a.usda": OLD["assets/a.usda"]}, remove=["layers/gone.usda"])
    assert changed == ["assets/b.usda", "layers/one.usda", "room.usda", "room.json"]
    assert (tmp_path / "assets/a.usda").stat().st_mtime_ns == untouched
    assert (tmp_path / "notes.txt").read_text() == "mine"
    assert not (tmp_path / STAGING).exists()


def test_a_journal_is_on_the_disk_after_all_that_it_names(tmp_path, monkeypatch):
    flushed = []
    monkeypatch.setattr(journal, "flush", lambda path: flushed.append((path.name, (tmp_path / JOURNAL).exists())))
    entry = journal.Move(staged="0", to="room.usda", digest="")
    journal.write_journal(tmp_path, journal.Journal(move=[entry], remove=[]))
    assert flushed == [("0", False), ("journal.new", False), (tmp_path.name, True)]


@pytest.mark.parametrize("entry", ["move", "remove"])
def test_a_journal_names_no_file_of_the_runs_themselves(tmp_path, entry):
    (tmp_path / STAGING).mkdir()
    own = f"{STAGING}/0"
    told = {"move": [{"staged": "0", "to": own, "digest": ""}], "remove": [{"path": own, "digest": ""}]}
    left = journal.Journal.model_validate({"move": [], "remove": [], entry: told[entry]})
    (tmp_path / STAGING / JOURNAL).write_text(left.model_dump_json())
    with pytest.raises(ValueError, match=rf"{entry}\[0\] names .*, where runs keep their own files"):
        read_journal(tmp_path)


@pytest.mark.parametrize(("field", "most"), [("restores", 4096), ("store", 4096), ("name", 255)])
def test_paths_of_a_manifest_are_no_longer_than_paths_are(field, most):
    told = {"echousd_room": 1, "name": "room", "files": {}}
    for length, taken in ((most, True), (most + 1, False)):
        step = {"number": 1, "steps": [], "restores": "a" * length, "adds": []}
        more = {"history": [step]} if field == "restores" else {field: "a" * length}
        with nullcontext() if taken else pytest.raises(ValidationError):
            Manifest.model_validate(told | more)


def test_removes_what_no_longer_belongs_and_empty_folders(tmp_path):
    save(tmp_path, OLD)
    save(tmp_path, {"room.usda": b"root"}, remove=["assets/a.usda", "layers/one.usda"])
    assert set(written(tmp_path)) == {"room.usda", "room.json"}
    assert not (tmp_path / "assets").exists()


class Killed(Exception):
    """Stands for the process being gone."""


@pytest.mark.parametrize("moment", range(30))
def test_killed_at_any_step_leaves_the_old_or_the_new_room(tmp_path, monkeypatch, moment):
    """Every operation on the disk is a moment; after it nothing more happens, not even cleaning up."""
    save(tmp_path, OLD)
    with stopped_disk(monkeypatch, moment, Killed):
        save(tmp_path, NEW, remove=["layers/gone.usda"])
    found = written(tmp_path)
    assert found["room.usda"] in (b"root old", b"root new")
    if found["room.usda"] == b"root new":  # what the root refers to is there before the root
        assert all(found[path] == NEW[path] for path in NEW)
    recover(tmp_path)
    found = written(tmp_path)
    found.pop("room.json")
    assert found in (OLD, NEW)


def test_killed_process_leaves_a_room(tmp_path):
    """The real thing: SIGKILL while rooms are written over and over."""

    def act(number):
        files = {f"assets/{i}.usda": b"%d" % number for i in range(20)} | {"room.usda": b"%d" % number}
        claim(tmp_path, force=True)
        write_together(tmp_path, files, last=["room.usda"], remove=[])

    for delay in (0.01, 0.03, 0.08):
        killed(act, delay)
        recover(tmp_path)
        values = set(written(tmp_path).values())
        assert len(values) <= 1, f"a mixture of runs: {values}"


@pytest.mark.parametrize("failing", ["write_bytes", "write_text", "mkdir"])
def test_full_disk_leaves_nothing_half_written(tmp_path, monkeypatch, failing):
    save(tmp_path / "room", OLD)
    before = written(tmp_path / "room")
    real = getattr(Path, failing)

    def full(self, *args, **kwargs):
        if STAGING in self.parts or "fresh" in self.parts:
            raise OSError(errno.ENOSPC, "No space left on device")
        return real(self, *args, **kwargs)

    monkeypatch.setattr(Path, failing, full)
    with pytest.raises(ValueError, match=r"room: cannot be written \(No space left on device\); nothing was changed"):
        save(tmp_path / "room", NEW)
    assert written(tmp_path / "room") == before
    assert not (tmp_path / "room" / STAGING).exists()
    with pytest.raises(ValueError, match="nothing was changed"):
        save(tmp_path / "fresh", NEW)
    assert not (tmp_path / "fresh").exists()


def test_folders_that_are_not_ours_are_refused(tmp_path):
    (tmp_path / "thesis.tex").write_text("")
    with pytest.raises(
        ValueError, match=r"holds thesis.tex and no room of EchoUSD; choose another folder or use --force"
    ):
        claim(tmp_path, force=False)
    assert claim(tmp_path, force=True) == {}
    (tmp_path / "data.json").write_text('{"files": {}}')
    with pytest.raises(ValueError, match="no room of EchoUSD"):
        claim(tmp_path, force=False)
    save(tmp_path, OLD)
    assert claim(tmp_path, force=False)["name"] == "room"


def test_places_where_nothing_can_be_written(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match="file: is a file, the output must be a folder"):
        check_writable(tmp_path / "file")
    with pytest.raises(ValueError, match="file is a file, not a folder"):
        check_writable(tmp_path / "file" / "room")
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # root may write anywhere
    with pytest.raises(ValueError, match="is not writable"):
        check_writable(tmp_path / "room")


def test_an_output_that_cannot_be_is_refused_before_the_work(tmp_path):
    (tmp_path / "there.usda").write_text("mine")
    (tmp_path / "word").write_text("mine")
    (tmp_path / "folder").mkdir()
    refused = [
        ("there.usda", True, False, "exists; choose another place or use --force$"),
        ("room.usdz", True, True, r"with --flat the output is a file that ends in .usda or .usdc$"),
        ("room.usdc", False, True, "the output is a folder; --flat writes one file$"),
        ("word", False, True, "is a file, the output must be a folder$"),
    ]
    for name, flat, force, text in refused:
        with pytest.raises(ValueError, match=f"{name}: {text}"):
            check_output(tmp_path / name, flat=flat, force=force)
    for name, flat, force in (("there.usda", True, True), ("new.usdc", True, False), ("new", False, False)):
        check_output(tmp_path / name, flat=flat, force=force)
    assert (tmp_path / "there.usda").read_text() == "mine"


@pytest.mark.parametrize(("count", "more"), [(2, False), (8, False), (9, True)])
def test_a_folder_of_several_rooms_names_the_first_eight(tmp_path, count, more):
    for number in range(count):
        save(tmp_path / f"home/room_{number}", {"room.usda": b"#usda 1.0\n"})
    with pytest.raises(ValueError, match=f"home: a folder of {count} rooms, name one file: room_0/room.usda, ") as told:
        room_at(tmp_path / "home")
    assert str(told.value).endswith(", ...") == more
    assert str(told.value).count(".usda") == min(count, 8)
    assert room_at(tmp_path / "home/room_1") == tmp_path / "home/room_1/room.usda"


def test_a_pattern_finds_rooms_and_stages_each_once_or_says_what_it_matched(tmp_path):
    for name in ("b", "a"):
        files = manifest([]) | {"room.usda": b"#usda 1.0\n"}
        (tmp_path / name).mkdir()
        for path, content in files.items():
            (tmp_path / name / path).write_bytes(content)
    (tmp_path / "alone.usda").write_text("#usda 1.0\n")
    rooms = [tmp_path / "a/room.usda", tmp_path / "alone.usda", tmp_path / "b/room.usda"]
    assert rooms_at(tmp_path / "**") == rooms
    assert rooms_at(tmp_path / "[ab]") == [rooms[0], rooms[2]]
    (tmp_path / "notes.txt").write_text("no room")
    with pytest.raises(ValueError, match=r"\*\.txt: matches no room$"):
        rooms_at(tmp_path / "*.txt")
    with pytest.raises(ValueError, match=r"\*\.abc: matches nothing$"):
        rooms_at(tmp_path / "*.abc")
