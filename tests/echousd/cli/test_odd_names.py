"""Names that mean something to a shell, a terminal, USD or rich: they work, or are refused before anything is made."""

from __future__ import annotations

import json

import pytest
from pxr import Sdf
from small_room import StandIn

from echousd.folder.folder import claim

GRAPH = """room: {type: bedroom, size: [4.0, 3.4]}
objects: {bed: {category: double_bed, style: STYLE}, pendant: pendant_lamp}
"""
WORK = ("room²", "[red]room", "room[0]", "ro#om", "ro@om", "ro'\"om", "ro%41m", "C:room", "größe")
REFUSED = ("room:SDF_FORMAT_ARGS:a=b", "ro\\om", "ro\tom", "ro\nom", "ro\x1b[31mom", "ro\u202eom")


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr("echousd.make.layouts.load_model", lambda *_, **__: StandIn())
    monkeypatch.setattr("echousd.make.save.PREVIEW", 16)


def make(echousd_command, folder, style="plain"):
    text = folder.parent / "graph.yaml"
    text.write_text(GRAPH.replace("STYLE", json.dumps(style)), "utf-8")
    return echousd_command(
        "generate", text, "-o", folder, "--shapes", "boxes", "--no-place", "--dress", "none", "--no-walls"
    )


def materials(folder):
    layer = Sdf.Layer.FindOrOpen(str(folder / "layers/materials.usda"))
    return {child.name for child in layer.GetPrimAtPath("/Room/Looks").nameChildren}


@pytest.mark.parametrize("name", WORK)
def test_folders_files_and_styles_that_work(echousd_command, tmp_path, name):
    assert make(echousd_command, tmp_path / name, style=name).code == 0
    (root,) = (tmp_path / name).glob("*.usda")
    packed = tmp_path / f"{name}.usdz"
    for words in (
        ("graph", root),
        ("edit", root, "--remove", "pendant"),
        ("export", root, "-o", packed),
        ("graph", packed),
    ):
        done = echousd_command(*words)
        assert done.code == 0, done.err


@pytest.mark.parametrize("name", REFUSED)
def test_folders_that_usd_would_not_find_are_refused_before_anything_is_made(echousd_command, tmp_path, name):
    done = make(echousd_command, tmp_path / name)
    assert done.code == 2
    assert "in a name" in done.err
    assert "allowed: another name" in done.err
    assert not set(done.err) & {"\x1b", "\t", "\u202e"}
    assert sorted(path.name for path in tmp_path.iterdir()) == ["graph.yaml"]
    with pytest.raises(ValueError, match="in a name"):
        claim(tmp_path / name, force=True)
    (tmp_path / f"{name}.usda").write_text("#usda 1.0\n")
    assert "in a name" in echousd_command("check", tmp_path / f"{name}.usda").err


@pytest.mark.parametrize("style", ["²", "a\tb\nc", "\\", ":SDF_FORMAT_ARGS:", "[red]", "\x1b[31m", "1st"])
def test_styles_become_names_of_materials(echousd_command, tmp_path, style):
    assert make(echousd_command, tmp_path / "room", style).code == 0
    assert all(Sdf.Path.IsValidIdentifier(name) for name in materials(tmp_path / "room"))
    graph = echousd_command("graph", tmp_path / "room/room.usda", "--json")
    (bed,) = (node for node in json.loads(graph.out)["nodes"] if node["name"] == "bed")
    assert bed["style"] == style


def test_styles_that_no_name_can_tell_apart_keep_their_own_materials(echousd_command, tmp_path):
    text = tmp_path / "graph.yaml"
    text.write_text("room: {type: bedroom, size: [4, 3]}\nobjects:\n  a: {category: nightstand, style: x²}\n"
                    "  b: {category: wardrobe, style: x³}\n", "utf-8")  # fmt: skip
    done = echousd_command("generate", text, "-o", tmp_path / "room", "--shapes", "boxes", "--no-place")
    assert done.code in (0, 1), done.err
    assert {"x__wood", "x__2_wood"} <= materials(tmp_path / "room")


@pytest.mark.parametrize("name", [*REFUSED, "room²", "[red]", "", " ", "1st", "a/b", "a.b"])
def test_names_of_objects_are_identifiers(echousd_command, tmp_path, name):
    (tmp_path / "graph.yaml").write_text(f"room: bedroom\nobjects: {{{json.dumps(name)}: double_bed}}\n")
    done = echousd_command("graph", tmp_path / "graph.yaml")
    assert done.code == 2
    assert "allowed: letters, digits and _" in done.err
    assert "graph.yaml:2" in done.err
    assert not set(done.err) & {"\x1b", "\t", "\u202e"}


@pytest.mark.parametrize(
    "text",
    [
        "room: [bedroom]\nobjects: {bed: double_bed}\n",
        "room: bedroom\nobjects: {bed: [double_bed]}\n",
        "room: bedroom\nobjects: {bed: {category: [double_bed]}}\n",
        "room: bedroom\nobjects: {bed: {category: double_bed, style: [a]}}\n",
        "room: bedroom\nobjects: {bed: double_bed}\nrelations: [[[bed], left, [bed]]]\n",
    ],
)
def test_names_given_as_lists(echousd_command, tmp_path, text):
    (tmp_path / "graph.yaml").write_text(text)
    done = echousd_command("graph", tmp_path / "graph.yaml")
    assert done.code == 2
    assert "graph.yaml:" in done.err


@pytest.mark.parametrize("name", ["a\nb", "a\u2028b", "a\x0bb"])
def test_a_fault_is_one_line_whatever_names_hold(echousd_command, tmp_path, name):
    graph = tmp_path / "graph.json"
    nodes = [{"name": name, "category": "double_bed"}, {"name": "lamp", "category": "table_lamp"}]
    relations = [{"subject": "lamp", "predicate": "close_by", "object": "bed"}] * 2
    graph.write_text(json.dumps({"room": {"type": "bedroom"}, "nodes": nodes, "relations": relations}))
    done = echousd_command("graph", graph)
    assert done.code == 2
    lines = done.err.strip().split("\n")
    assert all(line.startswith(f"error: {graph}") for line in lines), done.err


@pytest.mark.parametrize(
    "words", [("generate", "graph.yaml", "-o"), ("edit",), ("new", "--room", "bedroom"), ("check",)]
)
def test_a_path_of_thousands_of_folders_is_told(echousd_command, tmp_path, words):
    done = echousd_command(*words, f"{tmp_path}/{'a/' * 1900}room.usda")
    assert (done.code, "parts, allowed: 500" in done.err) == (2, True)
    assert not list(tmp_path.iterdir())
