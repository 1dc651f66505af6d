"""A room that a run left half-written: readers say so, writers finish it, and nothing of the run stays."""

import json
import shutil
import warnings
from contextlib import contextmanager, suppress
from itertools import pairwise

import pytest
from PIL import Image
from small_room import BARE, StandIn, small_graph

import echousd
from echousd.folder import folder as folders
from echousd.folder.history import undo
from echousd.make.edit import edit as change
from echousd.make.reading import read_room
from echousd.make.save import write_preview
from echousd.pending import JOURNAL, STAGING


class Killed(BaseException):
    """Stands for the process being gone."""


@pytest.fixture(autouse=True)
def model(monkeypatch):
    from echomodel.echo import EchoModel

    monkeypatch.setattr(EchoModel, "load", classmethod(lambda cls, path=None, **options: StandIn()))
    monkeypatch.setattr("echousd.make.save.PREVIEW", 32)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    room = echousd.generate(small_graph(), seed=5, model=StandIn(), shapes="boxes", **BARE)
    root = room.save(tmp_path_factory.mktemp("made") / "bedroom", preview=False)
    write_preview(root)  # edits draw pictures of rooms that have one
    return root


@pytest.fixture
def root(made, tmp_path):
    shutil.copytree(made.parent, tmp_path / "bedroom")
    return tmp_path / "bedroom" / made.name


@contextmanager
def killed(monkeypatch, moved):
    """A process that dies when so many of a run's files are in place; None = before it draws its picture."""

    def dies(*_, **__):
        raise Killed

    def some(folder, journal, real=folders._finish):
        real(folder, journal.model_copy(update={"move": journal.move[:moved], "remove": []}))
        dies()

    with monkeypatch.context() as patch, suppress(Killed):
        if moved is None:
            patch.setattr("echousd.make.save.write_preview", dies)
        else:
            patch.setattr(folders, "_finish", some)
        patch.setattr(folders, "_discard", lambda staging: None)
        yield
        pytest.fail("nobody died")


def edit(command, root, *words):
    return command("edit", root, "--shapes", "boxes", *words)


def content(folder):
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def nothing_left(folder):
    assert not (folder / STAGING).exists()
    assert [path.name for path in (*folder.rglob(".*"), *folder.parent.glob(".*")) if path.name != ".redo"] == []


@pytest.fixture
def half(root, echousd_command, monkeypatch):
    """The root layer of a room that an edit left half-written."""
    with killed(monkeypatch, 2):
        edit(echousd_command, root, "--remove", "lamp")
    assert (root.parent / STAGING / JOURNAL).is_file()
    return root


READERS = {
    "check": (),
    "graph": (),
    "render": ("-o", "out.png"),
    "export": ("-o", "out.usdz"),
    "texture export": ("-o", "job", "--for", "generic"),
    "assets pack": ("-o", "packed"),
    "generate": ("-o", "other"),
    "adopt": ("-o", "other"),
}


@pytest.mark.parametrize("reader", READERS)
def test_every_reader_says_that_a_room_is_half_written(half, reader, echousd_command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = content(half.parent)
    done = echousd_command(*reader.split(), half, *READERS[reader])
    told = f"{half.parent}: half-written, by a run that was interrupted or has not ended; finish it with"
    assert (done.code, done.out) == (2, "")
    assert f"error: {told} `echousd edit {half.parent} --recover` or whatever writes it\n" in done.err
    assert content(half.parent) == before
    assert not any((tmp_path / name).exists() for name in ("out.png", "out.usdz", "job/job.json", "packed", "other"))
    over = tmp_path / "mine.usda"
    over.write_text("#usda 1.0\n(\n    subLayers = [@./bedroom/bedroom.usda@]\n)\n")
    if reader in ("check", "graph", "render", "export"):
        assert told in echousd_command(*reader.split(), over, *READERS[reader]).err
        assert told in echousd_command(*reader.split(), half.parent, *READERS[reader]).err or reader == "graph"


def test_several_rooms_of_which_one_is_half_written_are_checked(half, made, echousd_command):
    shutil.copytree(made.parent, half.parent.parent / "other")
    done = echousd_command("check", half.parent.parent)
    assert done.code == 2
    assert "1 cannot be read" in done.out
    assert "half-written" in done.out


def test_a_first_room_that_is_half_written_is_one(tmp_path, echousd_command, monkeypatch):
    room = echousd.generate(small_graph(), seed=5, model=StandIn(), shapes="boxes", **BARE)
    with killed(monkeypatch, 2):
        room.save(tmp_path / "bedroom", preview=False)
    for place in (tmp_path, tmp_path / "bedroom"):
        assert "bedroom: half-written" in echousd_command("check", place).err
        assert "bedroom: half-written" in echousd_command("export", place, "-o", tmp_path / "a.usdz").err
    with pytest.warns(UserWarning, match="bedroom: the run that was interrupted is finished now"):
        assert echousd_command("edit", tmp_path / "bedroom", "--recover").code == 0
    assert read_room(tmp_path / "bedroom/bedroom.usda").graph.names == small_graph().names
    nothing_left(tmp_path / "bedroom")


@pytest.mark.parametrize("moved", [0, 2, 1000, None])
def test_an_edit_that_was_killed_is_finished_by_its_rerun(root, moved, echousd_command, monkeypatch):
    whole = root.parent.parent / "whole/bedroom"
    shutil.copytree(root.parent, whole)
    assert edit(echousd_command, whole / root.name, "--remove", "lamp").code == 0
    with killed(monkeypatch, moved):
        edit(echousd_command, root, "--remove", "lamp")
    done = edit(echousd_command, root, "--remove", "lamp")
    assert done.code == 0, done.err
    assert "finished - object lamp (table_lamp)" in done.out
    assert content(root.parent) == content(whole)
    nothing_left(root.parent)
    done = edit(echousd_command, root, "--remove", "lamp")
    assert (done.code, "no object 'lamp'" in done.err) == (2, True)


def test_another_edit_finishes_the_one_before_and_is_made(half, echousd_command):
    with pytest.warns(UserWarning, match="bedroom: the edit that was interrupted is finished now"):
        done = edit(echousd_command, half, "--remove", "lamp", "--remove", "pendant")
    assert done.code == 2
    assert "no object 'lamp'" in done.err
    assert read_room(half).graph.names == small_graph().remove_node("lamp").names
    done = edit(echousd_command, half, "--remove", "pendant")
    assert done.code == 0
    assert "pendant" not in read_room(half).graph.names
    nothing_left(half.parent)


@pytest.fixture(scope="module")
def stepped(made, tmp_path_factory):
    """Folders of a room after two edits, after one was taken back, and after both were."""
    places = [tmp_path_factory.mktemp("stepped") / "bedroom" for _ in range(3)]
    shutil.copytree(made.parent, places[0])
    root = places[0] / made.name
    for graph in (small_graph().remove_node("lamp"), small_graph().remove_node("lamp").remove_node("pendant")):
        change(root, graph, model=StandIn(), shapes="boxes").save(root.parent, preview=False)
    for before, place in pairwise(places):
        shutil.copytree(before, place)
        undo(place / made.name)
    for place in places:
        write_preview(place / made.name)
    return places


@pytest.mark.parametrize("moved", [0, 1, None])
@pytest.mark.parametrize("step", ["undo", "redo"])
def test_a_step_that_was_killed_is_made_once(stepped, tmp_path, step, moved, echousd_command, monkeypatch):
    first, last = (0, 1) if step == "undo" else (2, 1)
    shutil.copytree(stepped[first], tmp_path / "bedroom")
    root = tmp_path / "bedroom/bedroom.usda"
    with killed(monkeypatch, moved):
        edit(echousd_command, root, f"--{step}")
    done = edit(echousd_command, root, f"--{step}")
    assert done.code == 0, done.err
    word, name = {"undo": ("undone", "pendant (pendant_lamp)"), "redo": ("redone", "lamp (table_lamp)")}[step]
    assert f"{word}   - object {name}" in done.out
    assert content(root.parent) == content(stepped[last]) | {"bedroom.png": root.with_suffix(".png").read_bytes()}
    nothing_left(root.parent)


def test_recover_does_nothing_else(half, echousd_command):
    done = echousd_command("edit", half, "--recover", "--lock", "bed")
    assert (done.code, "--recover finishes what was interrupted and does nothing else" in done.err) == (2, True)
    done = echousd_command("edit", half, "--recover", "--json")
    told = json.loads(done.out)
    assert told["finished"][0] == "- object lamp (table_lamp)"
    assert told["written"][0] == str(half)
    nothing_left(half.parent)
    assert echousd_command("check", half).code == 0
    assert echousd_command("edit", half, "--recover").out == f"room     {half}\n"


def test_the_picture_is_of_the_state_or_is_not_there(root, echousd_command, monkeypatch):
    picture = root.with_suffix(".png")
    pytest.importorskip("embreex")
    write_preview(root)
    before = picture.read_bytes()
    with killed(monkeypatch, None):
        edit(echousd_command, root, "--remove", "wardrobe")
    assert not picture.exists()
    assert edit(echousd_command, root, "--remove", "wardrobe").code == 0
    after = picture.read_bytes()
    assert after != before
    with killed(monkeypatch, None):
        edit(echousd_command, root, "--undo")
    assert not picture.exists()
    assert edit(echousd_command, root, "--undo").code == 0
    assert picture.read_bytes() == before
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        echousd.generate(small_graph(), seed=5, model=StandIn(), shapes="boxes", **BARE).save(
            root.parent, preview=False
        )
    assert picture.read_bytes() == before  # nothing changed
    Image.new("RGB", (4, 4), "red").save(picture)  # somebody's
    mine = picture.read_bytes()
    with killed(monkeypatch, None):
        edit(echousd_command, root, "--remove", "wardrobe")
    assert picture.read_bytes() == mine


def test_a_scratch_folder_that_a_killed_run_left_goes(root, echousd_command):
    left, mine = (root.parent.parent / f".bedroom.{word}" for word in ("echousd-1234", "backup"))
    for place in (left, mine):
        (place / "layers").mkdir(parents=True)
    looks = root.parent / "looks"
    looks.mkdir()
    (looks / "mine.usda").write_text("#usda 1.0\n")
    root.write_text(root.read_text().replace("subLayers = [", "subLayers = [\n        @./looks/mine.usda@,", 1))
    assert edit(echousd_command, root, "--remove", "lamp").code == 0
    assert not left.exists()
    assert mine.exists()
    assert [path.name for path in looks.iterdir()] == ["mine.usda"]
