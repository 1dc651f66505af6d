import json

import pytest
from PIL import Image
from pxr import Usd
from small_room import StandIn, small_graph

import echousd
from echousd.make import save


@pytest.fixture
def graph(tmp_path):
    path = tmp_path / "graph.usda"
    echousd.write_graph(small_graph(), path)
    return path


@pytest.fixture(autouse=True)
def model(monkeypatch):
    from echomodel.echo import EchoModel

    monkeypatch.setattr(EchoModel, "load", classmethod(lambda cls, path=None, **options: StandIn(0.3)))


def test_generate_render_and_export(graph, tmp_path, echousd_command):
    folder = tmp_path / "out" / "bedroom"
    done = echousd_command("generate", graph, "-o", folder, "--seed", 7, "--faces", 600)
    assert done.code == 0, done.err
    assert f"room     {folder / 'bedroom.usda'}" in done.out
    assert f"preview  {folder / 'bedroom.png'}" in done.out
    assert "6 objects, 4 of 4 measured relations kept" in done.out
    assert "Shaping the furniture" in done.err
    assert Image.open(folder / "bedroom.png").size == (save.PREVIEW, save.PREVIEW * 5 // 8)
    assert json.loads((folder / "bedroom.json").read_text())["seed"] == 7

    picture = tmp_path / "top.png"
    done = echousd_command("render", folder / "bedroom.usda", "-o", picture, "--view", "top", "--size", 64)
    assert done.code == 0, done.err
    assert Image.open(picture).size == (64, 64)
    done = echousd_command("export", folder / "bedroom.usda", "-o", tmp_path / "room.glb")
    assert done.code == 0, done.err
    assert (tmp_path / "room.glb").read_bytes()[:4] == b"glTF"


def test_flat_samples_z_up_and_boxes(graph, tmp_path, echousd_command):
    out = tmp_path / "room.usdc"
    words = ("--flat", "--layouts", 2, "--up-axis", "z", "--shapes", "boxes", "--no-place", "--walls")
    done = echousd_command("generate", graph, "-o", out, *words)
    assert done.code == 1, done.err  # a wardrobe is drawn into a wall, and nobody places it
    assert "collide  wardrobe and Wall_4 by" in done.out
    stage = Usd.Stage.Open(str(out))
    assert stage.GetPrimAtPath("/Room").GetVariantSet("layout").GetVariantNames() == ["layout_0", "layout_1"]
    assert stage.GetMetadata("upAxis") == "Z"
    assert stage.GetPrimAtPath("/Room/Shell/Wall_1")


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("-o", "{tmp}/graph.usda"), "the output is a folder; --flat writes one file"),
        (("-o", "{tmp}/graph.usda", "--flat"), "exists; choose another place or use --force"),
        (("-o", "{tmp}/room.obj", "--flat"), "with --flat the output is a file that ends in .usda or .usdc"),
        (("-o", "{tmp}"), "holds graph.usda and no room of EchoUSD; choose another folder or use --force"),
        (("-o", "{tmp}/room", "--up-axis", "x"), "up_axis is 'X', allowed: Y or Z"),
        (("-o", "{tmp}/room", "--shapes", "lego"), "shapes is 'lego', allowed: parts, sdf, boxes"),
        (("-o", "{tmp}/room", "--layouts", "0"), "layouts is 0, allowed: 1 to 1000"),
        (("-o", "{tmp}/room", "--palette", "neon"), "palette is 'neon', allowed: oak, walnut"),
    ],
)
def test_bad_command_lines(graph, tmp_path, echousd_command, words, text):
    done = echousd_command("generate", graph, *(word.format(tmp=tmp_path) for word in words))
    assert done.code == 2
    assert text in done.err
    assert done.err.count("\n") <= 2
    assert {path.name for path in tmp_path.iterdir()} == {"graph.usda"}


def test_bad_graphs_are_refused_before_anything_is_written(tmp_path, echousd_command):
    contradiction = tmp_path / "graph.yaml"
    contradiction.write_text("room: bedroom\nobjects: {a: stool, b: stool}\nrelations: [a left of b, b left of a]\n")
    unknown = tmp_path / "unknown.yaml"
    unknown.write_text("room: bedroom\nobjects: {a: stoool}\n")
    empty = tmp_path / "empty.yaml"
    empty.write_text("room: bedroom\nobjects: {}\n")
    for path, text in ((contradiction, "contradicts"), (unknown, "stool"), (empty, "empty")):
        done = echousd_command("generate", path, "-o", tmp_path / "room")
        assert done.code == 2
        assert text in done.err
        assert path.name in done.err
    assert not (tmp_path / "room").exists()


def test_pictures_are_png(graph, tmp_path, echousd_command):
    done = echousd_command("render", graph, "-o", tmp_path / "picture.jpg")
    assert done.code == 2
    assert "pictures are written as .png, found '.jpg'" in done.err
    done = echousd_command("render", graph, "-o", tmp_path / "picture.png")
    assert done.code == 2
    assert "nothing to draw" in done.err


def test_older_crate_version_for_older_hosts(graph, tmp_path):
    """In a process of its own: USD reads the setting once."""
    import os
    import subprocess
    import sys

    code = (
        "import sys; from small_room import *; import echousd;"
        "room = echousd.generate(small_graph(), model=StandIn(), shapes='boxes', place=False, **BARE);"
        "room.save(sys.argv[1], preview=False)"
    )
    paths = os.pathsep.join(path for path in sys.path if path)
    environment = {**os.environ, "PYTHONPATH": paths, "USD_WRITE_NEW_USDC_FILES_AS_VERSION": "0.8.0"}
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "room")], check=True, env=environment)
    crates = list((tmp_path / "room").rglob("*.usdc"))
    assert crates
    for crate in crates:
        assert tuple(crate.read_bytes()[8:11]) == (0, 8, 0)
        assert Usd.Stage.Open(str(crate))


@pytest.mark.parametrize("words", [("edit", "--add", "plant:plant"), ("edit", "--undo"), ("update",)])
def test_what_is_no_room_is_named_not_the_folder_that_it_lies_in(tmp_path, echousd_command, words):
    (tmp_path / "graph.usda").write_text("#usda 1.0")
    outcome = echousd_command(words[0], tmp_path / "graph.usda", *words[1:])
    assert (outcome.code, "graph.usda: not a room made by `echousd generate`" in outcome.err) == (2, True), outcome.err
    outcome = echousd_command(words[0], tmp_path / "none.usda", *words[1:])
    assert (outcome.code, "none.usda: no such file" in outcome.err) == (2, True), outcome.err
    assert [path.name for path in tmp_path.iterdir()] == ["graph.usda"]


@pytest.mark.parametrize("asked", [(), ("--no-preview",)])
def test_edits_draw_pictures_of_rooms_that_have_one(graph, tmp_path, echousd_command, asked):
    folder = tmp_path / "bedroom"
    picture = folder / "bedroom.png"
    assert echousd_command("generate", graph, "-o", folder, "--shapes", "boxes", "--dress", "none", *asked).code == 0
    for words in (("edit", folder, "--remove", "wardrobe"), ("edit", folder, "--undo"), ("edit", folder, "--redo")):
        before = picture.read_bytes() if picture.is_file() else b""
        done = echousd_command(*words)
        assert done.code == 0, done.err
        assert picture.is_file() == (not asked)
        assert asked or picture.read_bytes() != before


def test_edits_through_a_stronger_layer_draw_the_picture_of_the_room(graph, tmp_path, echousd_command):
    folder = tmp_path / "bedroom"
    assert echousd_command("generate", graph, "-o", folder, "--shapes", "boxes", "--dress", "none").code == 0
    mine = folder / "mine.usda"
    mine.write_text('#usda 1.0\n(upAxis = "Y"\nmetersPerUnit = 1\nsubLayers = [@bedroom.usda@])\n')
    seen = {(folder / "bedroom.png").read_bytes()}
    for words in (("--remove", "wardrobe"), ("--undo",), ("--redo",)):
        done = echousd_command("edit", mine, *words)
        assert done.code == 0, done.err
        seen.add((folder / "bedroom.png").read_bytes())
    assert len(seen) == 2
    assert not (folder / "mine.png").exists()


def test_a_room_is_generated_again_from_its_folder(graph, tmp_path, echousd_command):
    plain = ("--shapes", "boxes", "--dress", "none", "--no-preview")
    assert echousd_command("generate", graph, "-o", tmp_path / "bedroom", *plain).code == 0
    done = echousd_command("generate", tmp_path / "bedroom", "-o", tmp_path / "again", *plain)
    assert done.code == 0, done.err
    assert echousd.read_graph(tmp_path / "again/again.usda").names == small_graph().names
    (tmp_path / "empty").mkdir()
    done = echousd_command("generate", tmp_path / "empty", "-o", tmp_path / "none", *plain)
    assert (done.code, "empty: no room in this folder" in done.err) == (2, True), done.err
    assert not (tmp_path / "none").exists()
