"""`echousd new` and `echousd graph` on files."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from PIL import Image

from echousd.graph import SceneGraph, load_graph

SAMPLES = Path(__file__).parents[3] / "samples"


@pytest.mark.parametrize("name", ["room.usda", "room.usdc", "room.usd", "room.yaml", "room.json", "deep/er/room.usda"])
def test_new_from_a_text(echousd_command, tmp_path, name):
    outcome = echousd_command("new", tmp_path / name, "--from", SAMPLES / "bedroom.yaml")
    assert outcome.code == 0
    assert outcome.out == f"wrote {tmp_path / name}: bedroom, 6 objects, 9 relations\n"
    assert load_graph(tmp_path / name) == load_graph(SAMPLES / "bedroom.yaml")


def test_new_from_a_stage(echousd_command, tmp_path):
    assert echousd_command("new", tmp_path / "a.json", "--from", SAMPLES / "study.usda").code == 0
    assert load_graph(tmp_path / "a.json") == load_graph(SAMPLES / "study.yaml")


def test_new_from_a_room_type(echousd_command, tmp_path):
    out = tmp_path / "a.usda"
    words = ["--room", "bedroom", "--count", "night stand=1", "--count", "desk=1", "--count", "pendant_lamp=0"]
    words += ["--size", "4", "3.5", "--height", "2.6", "--relate", "desk left of nightstand"]
    assert echousd_command("new", out, *words).code == 0
    graph = load_graph(out)
    assert graph.names == ("double_bed", "nightstand", "wardrobe", "desk")
    assert (graph.room.size, graph.room.height) == ((4.0, 3.5), 2.6)
    stated = [str(relation) for relation in graph.relations]
    assert stated[-1] == "desk left nightstand"
    assert "nightstand left double_bed" in stated
    assert "desk right double_bed" not in stated  # usual, but it contradicts


def test_new_with_doors_and_windows(echousd_command, tmp_path):
    out = tmp_path / "a.usda"
    words = ["--room", "bedroom", "--size", "4", "3.5", "--window", "north 1.2 1.6", "--door"]
    assert echousd_command("new", out, *words, "south 0.3 hinge=right").code == 0
    door, window = load_graph(out).room.openings
    assert (door.edge, door.offset, door.hinge) == (3, 0.3, "right")
    assert (window.edge, window.offset, window.width) == (1, 1.2, 1.6)
    shown = echousd_command("graph", out).out
    assert SceneGraph.from_yaml(shown).room.openings == (door, window)
    outcome = echousd_command("new", tmp_path / "b.usda", *words, "south 3.3")
    assert outcome.code == 2
    assert "reaches from 3.30 to 4.20 m along wall 3, which is 3.50 m long" in outcome.err
    assert not (tmp_path / "b.usda").exists()


def test_new_does_not_overwrite_unless_told(echousd_command, tmp_path):
    out = tmp_path / "a.usda"
    out.write_text("mine")
    outcome = echousd_command("new", out, "--room", "study")
    assert outcome.code == 2
    assert outcome.err == f"error: {out}: exists; choose another place or use --force\n"
    assert out.read_text() == "mine"
    assert echousd_command("new", out, "--room", "study", "--force").code == 0
    assert load_graph(out).room.type == "study"


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ([], "say where the graph comes from: either --from GRAPH, --room TYPE or --rooms ROOMS"),
        (["--room", "study", "--from", "x.yaml"], "say where the graph comes from"),
        (["--from", "x.yaml", "--count", "desk=1"], "--count goes with --room"),
        (["--from", "gone.yaml"], "gone.yaml: no such file or directory"),
        (["--from", "gone.usda"], "gone.usda: no such file"),
        (["--room", "spaceship"], "room: type: unknown room type 'spaceship': allowed: bedroom, living_room"),
        (
            ["--room", "study", "--count", "desk"],
            "--count desk: allowed: a category and a number, such as nightstand=2",
        ),
        (["--room", "study", "--count", "desc=1"], "unknown category 'desc': did you mean desk?"),
        (["--room", "study", "--size", "0", "3"], "room: size: found (0.0, 3.0), allowed: two positive numbers"),
        (["--room", "study", "--height", "nan"], "--height is nan, allowed: a finite number"),
        (["--room", "study", "--relate", "desk left"], "relation 'desk left': allowed: subject predicate object"),
        (["--room", "study", "--relate", "desk left sofa"], "object 'sofa' is no object of this graph, allowed: book"),
        (["--room", "study", "--relate", "desk left books"], "object 'books' is no object of this graph"),
    ],
)
def test_new_with_bad_input_writes_nothing(echousd_command, tmp_path, monkeypatch, words, text):
    monkeypatch.chdir(tmp_path)
    outcome = echousd_command("new", "out/a.usda", *words)
    assert outcome.code == 2
    assert text in outcome.err
    assert outcome.err.startswith("error: ")
    assert outcome.err.count("\n") == 1
    assert list(tmp_path.rglob("*.usda")) == []


def test_new_where_nothing_can_be_written(echousd_command, tmp_path):
    (tmp_path / "file").write_text("")
    outcome = echousd_command("new", tmp_path / "file" / "a.usda", "--room", "study")
    assert outcome.code == 2
    assert re.search(r"file: cannot be made \(.*\)\n$", outcome.err)
    outcome = echousd_command("new", tmp_path / "a.glb", "--room", "study")
    assert "a.glb: extension '.glb', allowed: .yaml, .yml, .json, .usda, .usdc, .usd\n" in outcome.err
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("form", ["usda", "yaml"])
def test_graph_prints_what_a_person_writes(echousd_command, form):
    graph, found = load_graph(SAMPLES / "study.yaml"), echousd_command("graph", SAMPLES / f"study.{form}").out
    assert found == f"# study, 7 objects, 10 relations\n{graph.to_yaml()}"
    assert SceneGraph.from_yaml(found) == graph
    assert echousd_command("graph", SAMPLES / f"study.{form}", "--json").out == graph.to_json()


def test_graph_draws_pictures(echousd_command, tmp_path):
    png, svg = tmp_path / "g.png", tmp_path / "g.svg"
    for picture in (png, svg):
        outcome = echousd_command("graph", SAMPLES / "study.yaml", "-o", picture)
        assert (outcome.code, outcome.out) == (0, "")
        assert outcome.err == f"wrote {picture}: study, 7 objects, 10 relations\n"
    with Image.open(png) as image:
        assert min(image.size) > 400
    assert svg.read_text().startswith("<?xml")


def test_graph_prints_the_schema(echousd_command):
    schema = json.loads(echousd_command("graph", "--schema").out)
    assert set(schema["properties"]) == {"room", "nodes", "relations"}


def test_graph_shows_what_a_stronger_layer_adds(echousd_command, tmp_path):
    from pxr import Sdf, Usd

    weaker, stronger = tmp_path / "weak.usda", tmp_path / "strong.usda"
    echousd_command("new", weaker, "--from", SAMPLES / "bedroom.yaml")
    layer = Sdf.Layer.CreateNew(str(stronger))
    layer.subLayerPaths.append("./weak.usda")
    layer.defaultPrim = "Room"
    stage = Usd.Stage.Open(layer)
    edge = stage.DefinePrim("/Room/SceneGraph/mine", "EchoRelation")
    edge.CreateRelationship("echo:subject").SetTargets(["/Room/Objects/wardrobe"])
    edge.CreateRelationship("echo:object").SetTargets(["/Room/Objects/nightstand_left"])
    edge.CreateAttribute("echo:predicate", Sdf.ValueTypeNames.Token).Set("bigger_than")
    layer.Save()
    assert "wardrobe bigger_than nightstand_left" in echousd_command("graph", stronger).out
    assert "bigger_than" not in echousd_command("graph", weaker).out


def test_graph_of_a_room_by_its_folder(echousd_command, tmp_path):
    from small_room import saved_room

    root = saved_room(tmp_path / "bedroom", seed=5)
    by_folder, by_file = echousd_command("graph", root.parent), echousd_command("graph", root)
    assert by_folder.code == 0, by_folder.err
    assert by_folder.out == by_file.out
    assert echousd_command("graph", tmp_path / "bedroom" / "layers").err.endswith("layers: no room in this folder\n")


def test_graph_of_several_rooms(echousd_command, tmp_path):
    from pxr import Sdf

    from echousd.stage.graphs import write_graph

    layer = Sdf.Layer.CreateNew(str(tmp_path / "house.usda"))
    Sdf.PrimSpec(layer, "House", Sdf.SpecifierDef, "Xform")
    layer.defaultPrim = "House"
    for name in ("bedroom", "study"):
        write_graph(load_graph(SAMPLES / f"{name}.yaml"), layer, room=f"/House/{name.title()}")
    layer.Save()
    house = tmp_path / "house.usda"
    out = echousd_command("graph", house).out
    first, second = out.split("---\n")
    assert first.startswith("# /House/Bedroom bedroom, 6 objects")
    assert second.startswith("# /House/Study study, 7 objects")
    assert SceneGraph.from_yaml(second) == load_graph(SAMPLES / "study.yaml")
    assert (
        echousd_command("graph", house, "--room", "/House/Study", "--json").out
        == load_graph(SAMPLES / "study.yaml").to_json()
    )
    outcome = echousd_command("graph", house, "--json")
    assert outcome.code == 2
    assert "2 rooms, say which one of /House/Bedroom, /House/Study" in outcome.err


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ([], "GRAPH is missing, allowed: a stage, a YAML or a JSON file, or a room's folder"),
        (["gone.usda"], "gone.usda: no such file"),
        (["gone.json"], "gone.json: no such file or directory"),
        (["notes.txt"], "notes.txt: extension '.txt', allowed: .yaml"),
        ([SAMPLES / "study.yaml", "--json", "--schema"], "--json and --schema exclude each other"),
        ([SAMPLES / "study.yaml", "-o", "x.jpg"], "x.jpg: extension '.jpg', allowed: .png"),
        ([SAMPLES / "study.yaml", "-o", "gone/x.png"], "gone/x.png: No such file or directory"),
    ],
)
def test_graph_with_bad_input(echousd_command, tmp_path, monkeypatch, words, text):
    monkeypatch.chdir(tmp_path)
    outcome = echousd_command("graph", *words)
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err.startswith(f"error: {text}")
    assert outcome.err.count("\n") == 1
