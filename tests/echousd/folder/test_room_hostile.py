"""A room folder that somebody sent: nothing in it makes us read, write or delete anything outside of it."""

import json
import shutil
import warnings

import pytest
from pxr import Sdf
from small_room import BARE, StandIn, small_graph

import echousd
from echousd.folder.folder import claim, recover
from echousd.folder.found import layer_over, manifest_of
from echousd.folder.manifest import find_manifest
from echousd.folder.merging import loses_text
from echousd.folder.stored import unit_of
from echousd.folder.within import check_links, inside
from echousd.make.reading import read_room
from echousd.pending import STAGING

OUTSIDE = "precious"


def make(seed=0, graph=None):
    return echousd.generate(graph or small_graph(), seed=seed, model=StandIn(0.5), shapes="boxes", place=False, **BARE)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return make().save(tmp_path_factory.mktemp("made") / "bedroom", preview=False).parent


@pytest.fixture
def folder(made, tmp_path):
    shutil.copytree(made, tmp_path / "bedroom")
    (tmp_path / "data.json").write_text(OUTSIDE)
    (tmp_path / "outside").mkdir()
    (tmp_path / "outside/data.json").write_text(OUTSIDE)
    return tmp_path / "bedroom"


def outside(folder):
    """Everything outside of the folder, which no test may change."""
    top = folder.parent
    return {str(p.relative_to(top)): p.read_text() for p in top.rglob("*") if p.is_file() and folder not in p.parents}


def journal(folder, move=(), remove=()):
    staging = folder / STAGING
    staging.mkdir()
    (staging / "0").write_text("evil")
    digest = "be0efd8e6d22db1eea3b9d2c5b6e2a3e"
    moves = [{"staged": s, "to": t, "digest": digest, "over": ""} for s, t in move]
    gone = [{"path": path, "digest": ""} for path in remove]
    (staging / "journal.json").write_text(json.dumps({"echousd_journal": 2, "move": moves, "remove": gone}))


@pytest.mark.parametrize(
    ("move", "remove", "said"),
    [
        ([("0", "/{top}/data.json")], [], r"move\[0\] names '/.*/data.json', outside of .*bedroom"),
        (
            [("0", "../data.json")],
            [],
            r"move\[0\] names '../data.json', outside of .*bedroom; allowed: a relative path",
        ),
        ([("0", "layers/../../data.json")], [], r"move\[0\] names 'layers/../../data.json', outside"),
        ([("0", "..\\data.json")], [], r"move\[0\] names '..*data.json', outside"),
        ([("0", "")], [], r"move\[0\] is '', allowed: a relative path inside the folder"),
        ([("../../data.json", "stolen.json")], [], r"move.0.staged is '../../data.json'"),
        ([("0", ".echousd/journal.json")], [], r"move\[0\] names .*journal.json, where runs keep their own files"),
        ([], ["{top}/data.json"], r"remove\[0\] names '/.*/data.json', outside of .*bedroom"),
        ([], ["a.usda", "../outside/data.json"], r"remove\[1\] names '../outside/data.json', outside of .*bedroom"),
    ],
)
def test_journal_that_names_files_elsewhere_is_refused(folder, move, remove, said):
    top = str(folder.parent)
    journal(folder, [(a, b.replace("/{top}", top)) for a, b in move], [r.replace("{top}", top) for r in remove])
    before = outside(folder)
    for act in (
        lambda: recover(folder),
        lambda: claim(folder, force=True),
        lambda: make(1).save(folder, preview=False),
        lambda: read_room(folder / "bedroom.usda"),
    ):
        with pytest.raises(ValueError, match=said) as error:
            act()
        assert "journal.json" in str(error.value)
        assert outside(folder) == before


def test_journal_is_refused_by_every_command_that_writes(folder, echousd_command):
    journal(folder, remove=["../data.json"])
    for words in (
        ("edit", folder / "bedroom.usda", "--remove", "pendant"),
        ("generate", "samples/bedroom.usda", "-o", folder, "--shapes", "boxes", "--force"),
    ):
        done = echousd_command(*words)
        assert done.code == 2
        assert "remove[0] names '../data.json', outside of" in done.err
        assert (folder.parent / "data.json").read_text() == OUTSIDE


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe", b"[" * 100_000, b"\0" * 500])
def test_journal_that_was_emptied_gives_the_run_up(folder, content):
    journal(folder)
    (folder / STAGING / "journal.json").write_bytes(content)
    with pytest.warns(UserWarning, match=r"journal.json: cannot be read; the interrupted run is given up"):
        recover(folder)
    assert not (folder / STAGING).exists()
    make(1).save(folder, preview=False)
    assert find_manifest(folder)["seed"] == 1


@pytest.mark.parametrize("change", [{"echousd_journal": 3}, {"move": [["0", "a"]]}, {"more": 1}, {"remove": None}])
def test_journal_of_another_shape_is_refused(folder, change):
    journal(folder)
    path = folder / STAGING / "journal.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **change}))
    with pytest.raises(ValueError, match=r"journal.json: \S+ is .*; delete .*\.echousd to give the interrupted run up"):
        recover(folder)
    path.write_text("[]")
    with pytest.raises(ValueError, match=r"journal.json: .* is \[\]"):
        recover(folder)


def test_damaged_staged_file_gives_the_run_up(folder):
    journal(folder, [("0", "layers/layout.usda")])
    with pytest.warns(UserWarning, match=r"\.echousd/0: damaged; the interrupted run is given up"):
        recover(folder)
    assert "evil" not in (folder / "layers/layout.usda").read_text()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"name": "../outside/data"}, r"bedroom.json: name is '../outside/data', allowed: a name of letters"),
        ({"name": ["a"]}, r"bedroom.json: name is \['a'\], allowed: a valid string"),
        ({"files": {"../outside/data.json": ""}}, r"bedroom.json: files names '../outside/data.json', outside of"),
        ({"files": {"/etc/passwd": ""}}, r"bedroom.json: files names '/etc/passwd', outside of"),
        ({"files": {"a.usda": 3}}, r"bedroom.json: files.a.usda is 3, allowed: a valid string"),
        ({"assets": {"bed": "../../outside/bed"}}, r"bedroom.json: assets.bed is '../../outside/bed', allowed: a name"),
        ({"seed": 2**63}, r"bedroom.json: seed is 9223372036854775808, allowed"),
        ({"up_axis": "X"}, r"bedroom.json: up_axis is 'X', allowed: Y or Z"),
    ],
)
def test_manifest_that_names_files_elsewhere_is_refused(folder, change, said):
    path = folder / "bedroom.json"
    manifest = json.loads(path.read_text())
    path.write_text(json.dumps({**manifest, **change}))
    before = outside(folder)
    for act in (lambda: make(1).save(folder, preview=False), lambda: read_room(folder / "bedroom.usda")):
        with pytest.raises(ValueError, match=said):
            act()
    assert outside(folder) == before


@pytest.mark.parametrize("link", ["layers", "assets", "assets/bed", "layers/layout.usda", "assets/bed/bed_geo.usdc"])
def test_links_are_not_followed_out_of_the_folder(folder, link):
    away = folder.parent / "outside/away"
    (folder / link).rename(away)
    (folder / link).symlink_to(away)
    before = {p: p.read_bytes() for p in sorted(folder.parent.joinpath("outside").rglob("*")) if p.is_file()}
    with pytest.raises(ValueError, match=r"is a link to .*outside/away, outside of .*bedroom; allowed: files of the"):
        make(1, small_graph().remove_node("pendant")).save(folder, preview=False)
    assert {p: p.read_bytes() for p in sorted(folder.parent.joinpath("outside").rglob("*")) if p.is_file()} == before
    if "bed" in link:
        manifest = json.loads((folder / "bedroom.json").read_text())
        for files, entry in ((manifest["files"], "bedroom.json: files"), ({}, "asset 'bed'")):
            (folder / "bedroom.json").write_text(json.dumps({**manifest, "files": files}))
            with pytest.raises(ValueError, match=f"{entry} names 'assets/bed/.*is a link to .*outside/away"):
                read_room(folder / "bedroom.usda")


@pytest.mark.parametrize("name", ["notes.txt", "layers/notes.txt"])
def test_a_file_that_is_a_link_out_of_the_folder_is_none_of_its_files(tmp_path, name):
    (tmp_path / "room/layers").mkdir(parents=True)
    (tmp_path / "notes.txt").touch()
    (tmp_path / "room" / name).symlink_to(tmp_path / "notes.txt")
    with pytest.raises(ValueError, match=r"room.json: files names .*notes.txt is a link to .*, outside of"):
        inside(tmp_path / "room", name, "room.json: files")


def test_of_the_layers_in_a_folder_the_one_over_its_room_is_found(folder):
    (folder / "other.usda").write_text("#usda 1.0\n")
    (folder / "damaged.usda").write_text("#usda 1.0\ndef {")
    with pytest.raises(ValueError, match=r"layers over bedroom.usda in this folder: none"):
        layer_over(folder)
    (folder / "mine.usda").write_text("#usda 1.0\n(subLayers = [@./bedroom.usda@])\n")
    assert layer_over(folder) == folder / "mine.usda"


def test_a_layer_as_usd_writes_it_loses_nothing_and_one_with_remarks_does():
    written = Sdf.Layer.CreateAnonymous(".usda").ExportToString().encode()
    assert not loses_text(written)
    assert loses_text(written + b"# my room\n")


def test_links_within_the_folder_work(folder):
    (folder / "layers").rename(folder / "my_layers")
    (folder / "layers").symlink_to("my_layers")
    root = make(1).save(folder, preview=False)
    assert len(read_room(root).graph.names) == 6


def test_staging_folder_that_is_a_link_is_refused(folder):
    (folder / STAGING).symlink_to(folder.parent / "outside")
    for act in (lambda: recover(folder), lambda: make(1).save(folder, preview=False)):
        with pytest.raises(ValueError, match=r"\.echousd is a link to .*outside"):
            act()
    assert (folder.parent / "outside/data.json").read_text() == OUTSIDE


def test_copies_of_a_manifest_are_nobodys(folder):
    manifest = json.loads((folder / "bedroom.json").read_text())
    old = {**manifest, "files": dict.fromkeys(manifest["files"], "00")}
    (folder / "backup.json").write_text(json.dumps(old))
    (folder / "a_list.json").write_text("[1]")
    (folder / "deep.json").write_text("[" * 100_000)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        make(1).save(folder, preview=False)
    assert not list(folder.rglob("*.edited*"))
    assert find_manifest(folder)["seed"] == 1


@pytest.mark.parametrize("name", ["layers/a.usda", "a", "ä/b c.usda", "./a"])
def test_paths_inside(tmp_path, name):
    assert inside(tmp_path, name, "entry") == tmp_path / name


@pytest.mark.parametrize("name", ["/a", "..", "a/../../b", "C:/a", "C:a", "\\\\host\\share", ".", "a\0b", 3, None])
def test_paths_outside(tmp_path, name):
    with pytest.raises(ValueError, match=r"^room.json: files (names|is) .*allowed: a relative path inside the folder"):
        inside(tmp_path, name, "room.json: files")


@pytest.mark.parametrize("way", ["../b", "a/../../b", "..", "a/b/../../../c"])
def test_ways_that_go_up_are_ways_out_where_no_link_is(tmp_path, way):
    (tmp_path / "room/a/b").mkdir(parents=True)
    with pytest.raises(ValueError, match="entry"):
        check_links(tmp_path / "room", tmp_path / "room" / way, "entry")
    check_links(tmp_path / "room", tmp_path / "room/a/../a/b", "entry")


def test_what_is_no_room_and_what_is_not_there_are_told_apart(tmp_path):
    (tmp_path / "other.usda").write_text("#usda 1.0\n")
    with pytest.raises(
        ValueError, match=r"other.usda: not a room made by `echousd generate` \(no manifest beside it\)$"
    ):
        manifest_of(tmp_path / "other.usda")
    with pytest.raises(ValueError, match=r"none.usda: no such file$"):
        manifest_of(tmp_path / "none.usda")


@pytest.mark.parametrize(
    ("path", "unit"),
    [
        ("assets/bed/bed.usda", "assets/bed"), ("assets/bed/original/a/b.png", "assets/bed"),
        ("assets/bed", "assets/bed"), ("textures/wood.jpg", "textures/wood.jpg"),
        ("assets", ""), ("textures", ""), ("layers/graph.usda", ""),
        ("bedroom.usda", ""), ("my/assets/bed.usda", ""),
    ],
)  # fmt: skip
def test_what_of_a_room_lies_in_a_store_together(path, unit):
    assert unit_of(path) == unit
