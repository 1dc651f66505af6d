"""The text forms: what a person may write, what is written back, and what a fault in a file says, with its line."""

from __future__ import annotations

import json
import os

import pytest

from echousd.graph import GraphError, Node, Relation, RoomSpec, SceneGraph, load_graph, save_graph
from echousd.graph.text import graph_from_text

FIVE_LINES = """\
room: bedroom
objects: {bed: double_bed, left_stand: nightstand, closet: wardrobe, lamp: {category: table_lamp, style: oak}}
relations:
  [left_stand left bed, left_stand close by bed, lamp standing on left_stand,
   closet in front of bed, closet taller than bed]
"""


def test_a_bedroom_fits_in_five_lines():
    assert len(FIVE_LINES.splitlines()) == 5
    graph = SceneGraph.from_yaml(FIVE_LINES)
    assert [(node.name, node.category) for node in graph.nodes] == [
        ("bed", "double_bed"),
        ("left_stand", "nightstand"),
        ("closet", "wardrobe"),
        ("lamp", "table_lamp"),
    ]
    assert [str(relation) for relation in graph.relations] == [
        "left_stand left bed",
        "left_stand close_by bed",
        "lamp standing_on left_stand",
        "closet front bed",
        "closet taller_than bed",
    ]
    assert graph.node("lamp").style == "oak"


def test_the_short_form_written():
    graph = SceneGraph(
        RoomSpec("bedroom", size=(4, 3.5)),
        (Node("bed", "bed"), Node("on", "lamp", style="1e5", attributes={"note": "yes: # no"}), Node("true", "desk")),
        (Relation("bed", "left", "on"), Relation("bed", "near", "true", 0.5)),
    )
    text = graph.to_yaml()
    assert text == (
        "room: {type: bedroom, size: [4.0, 3.5]}\n"
        "objects:\n"
        "  bed: double_bed\n"
        "  on: {category: table_lamp, style: '1e5', attributes: {note: 'yes: # no'}}\n"
        "  'true': desk\n"
        "relations:\n"
        "  - bed left on\n"
        "  - {subject: bed, predicate: close_by, object: 'true', confidence: 0.5}\n"
    )
    assert SceneGraph.from_yaml(text) == graph


def test_the_canonical_form_written():
    graph = SceneGraph("bedroom", (Node("bed", "bed"), Node("é".replace("é", "e"), "lamp", style="é")))
    assert graph.to_json() == (
        '{\n  "room": {"type": "bedroom"},\n  "nodes": [\n    {"name": "bed", "category": "double_bed"},\n'
        '    {"name": "e", "category": "table_lamp", "style": "é"}\n  ],\n  "relations": []\n}\n'
    )
    assert json.loads(graph.relate("bed", "near", "e").to_json())["relations"] == [
        {"subject": "bed", "predicate": "close_by", "object": "e"}
    ]


@pytest.mark.parametrize(
    ("objects", "names"),
    [
        ("[bed, wardrobe]", ["bed", "wardrobe"]),
        ("[night stand, nightstand]", ["night_stand", "nightstand"]),
        ("[chair, chair, desk]", ["chair_1", "chair_2", "desk"]),
        ("[chair, {name: chair, category: armchair}]", ["chair_1", "chair"]),
        ("[chair, chair, {name: chair_1, category: armchair}]", ["chair_2", "chair_3", "chair_1"]),
        ("{bed: , wardrobe: }", ["bed", "wardrobe"]),
    ],
)
def test_objects_may_be_listed_by_category_alone(objects, names):
    assert list(SceneGraph.from_yaml(f"room: bedroom\nobjects: {objects}").names) == names


@pytest.mark.parametrize(
    "relation",
    ["a left b", "a left of b", "a to the left of b", "[a, left, b]", "{subject: a, predicate: left, object: b}"],
)
def test_spellings_of_a_relation(relation):
    graph = SceneGraph.from_yaml(f"room: bedroom\nobjects: {{a: bed, b: lamp}}\nrelations:\n  - {relation}")
    assert graph.relations == (Relation("a", "left", "b"),)


def test_words_that_yaml_takes_for_values_stay_words():
    graph = SceneGraph.from_yaml("room: bedroom\nobjects: {on: bed, no: lamp, y: desk}\nrelations: [[no, on, y]]")
    assert graph.relations[0].triple == ("no", "standing_on", "y")
    node = SceneGraph.from_yaml("room: study\nobjects: {a: {category: bed, style: 2024-01-02, yaw: 1e-1}}").nodes[0]
    assert (node.style, node.yaw) == ("2024-01-02", 0.1)


def test_either_form_reads_as_json_and_as_yaml():
    canonical = '{"room": {"type": "bedroom"}, "nodes": [{"name": "a", "category": "bed"}], "relations": []}'
    short = '{"room": "bedroom", "objects": {"a": "bed"}}'
    expected = SceneGraph("bedroom", (Node("a", "bed"),))
    for text in (canonical, short):
        assert SceneGraph.from_json(text) == SceneGraph.from_yaml(text) == expected


GOOD = "room: bedroom\nobjects:\n  a: bed\n  b: lamp\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "x.yaml: found nothing, allowed: a mapping with room, objects, nodes, relations"),
        ("bedroom", "x.yaml: found 'bedroom', allowed: a mapping with room"),
        ("room: bedroom", "x.yaml: the graph is empty, allowed: at least one object"),
        ("objects: {a: bed}", "x.yaml: room is missing, allowed: one of bedroom, living_room,"),
        ("room: bedrom\nobjects: {a: bed}", "x.yaml:1: room: type: unknown room type 'bedrom': did you mean bedroom?"),
        ("room: 3\nobjects: {a: bed}", "x.yaml:1: room: found 3, allowed: a type or a mapping with type"),
        ("room: {size: [3, 4]}\nobjects: {a: bed}", "x.yaml:1: room: type is missing"),
        (GOOD + "relation: [a left b]", "x.yaml:5: unknown field 'relation': did you mean relations?"),
        (GOOD + "  a: desk", "x.yaml:5: key 'a' stands twice"),
        (GOOD + "  c: desc", "x.yaml:5: object 'c': category: unknown category 'desc': did you mean desk?"),
        (GOOD + "  2c: desk", "x.yaml:5: object '2c': name: '2c' is no identifier"),
        (GOOD + "  c:\n    categry: desk", "x.yaml:6: unknown field 'categry': did you mean category?"),
        (GOOD + "  c:\n    style: oak", "x.yaml:5: nodes.2 'c': category is missing"),
        (
            GOOD + "  c:\n    category: desk\n    size: [1, 2]",
            "x.yaml:7: object 'c': size: found [1, 2], allowed: three",
        ),
        (GOOD + "  c: {name: d, category: desk}", "x.yaml:5: object 'c': a second name, allowed: the key alone"),
        (GOOD + "  c: [desk]", "x.yaml:5: nodes.2: found ['desk'], allowed: a category or a mapping with category"),
        (GOOD + "nodes: []", "x.yaml:5: both objects and nodes are given, allowed: one of them"),
        (GOOD + "relations: a left b", "x.yaml:5: relations: found 'a left b', allowed: a list such as [bed left"),
        (GOOD + "relations:\n  - a left", "x.yaml:6: relation 'a left': allowed: subject predicate object, such as"),
        (GOOD + "relations:\n  - a lft b", "x.yaml:6: relation 'a lft b': predicate: unknown predicate 'lft': did you"),
        (GOOD + "relations:\n  - a left b\n  - a left c", "x.yaml:7: relation 'a left c': object 'c' is no object of"),
        (GOOD + "relations:\n  - a left b\n  - b near a\n  - b left a", "x.yaml:8: 'a left b' contradicts 'b left a'"),
        (GOOD + "relations:\n  - a left a", "x.yaml:6: relation 'a left a': an object cannot relate to itself"),
        (GOOD + "relations:\n  - {subject: a, object: b}", "x.yaml:6: relations.0 'a': predicate is missing"),
        ("room: bedroom\nobjects: [a\n", "x.yaml:3: not YAML: while parsing a flow sequence"),
        ("room: bedroom\n\tobjects: {}", "x.yaml:2: not YAML: while scanning"),
        ("room: &r bedroom\nobjects: {a: *r}", "x.yaml:1: YAML aliases (*name) are not read here, write the value out"),
        ("room: !!python/name:os.system", "x.yaml:1: YAML tag 'tag:yaml.org,2002:python/name:os.system' is not read"),
        ("room: bedroom\nobjects: {[1]: bed}", "x.yaml:2: a key that is a list or a mapping, allowed: text"),
        ("room: bedroom\n---\nroom: study", "x.yaml:2: not YAML: expected a single document in the stream"),
        ("room: bed\x07room", "x.yaml: not YAML: unacceptable character #x0007"),
        ("- " * 50_000, "x.yaml: nested too deeply for a scene graph"),
    ],
)
def test_faults_in_yaml_name_file_and_line(tmp_path, monkeypatch, text, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "x.yaml").write_text(text, "utf-8")
    with pytest.raises(GraphError) as error:
        load_graph("x.yaml")
    assert str(error.value).startswith(message)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"room": "bedroom",\n}', "x.json:2: not JSON: Expecting property name enclosed in double quotes"),
        ("[" * 100_000, "x.json: nested too deeply for a scene graph"),
        (
            '{"room": "bedroom",\n "nodes": [\n  {"name": "a", "category": "bedd"}]}',
            "x.json:3: object 'a': category: unknown category 'bedd': did you mean double_bed?",
        ),
        (
            '{"room": "bedroom", "nodes": [\n  {"name": "a", "category": "bed"},\n  {"name": "a", "category": "bed"}]}',
            "x.json:3: two objects are called 'a', allowed: a name of its own for each",
        ),
        ('{"room": "study",\n "room": "bedroom"}', "x.json:2: key 'room' stands twice"),
        ('{\t"room": "study",\t"room": "bedroom"}', "x.json:1: key 'room' stands twice"),
        (
            '{"room": "study", "nodes": [{"name": "a", "category": "bed", "yaw": NaN}]}',
            "x.json:1: object 'a': yaw: found nan, allowed: radians, or degrees as in 90 deg",
        ),
    ],
)
def test_faults_in_json_name_file_and_line(tmp_path, monkeypatch, text, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "x.json").write_text(text, "utf-8")
    with pytest.raises(GraphError) as error:
        load_graph("x.json")
    assert str(error.value).startswith(message)


@pytest.mark.parametrize(("depth", "told"), [(64, "allowed: a mapping"), (65, "nested too deeply")])
def test_yaml_is_nested_in_64_levels_at_most(depth, told):
    with pytest.raises(GraphError, match=told):
        graph_from_text(SceneGraph, "[" * depth + "]" * depth, "yaml")


def test_faults_in_a_text_without_a_file():
    with pytest.raises(GraphError, match=r"^line 2: object 'a': category: unknown category 'bedd'"):
        SceneGraph.from_yaml("room: bedroom\nobjects: {a: bedd}")


def test_files_come_back(tmp_path):
    graph = SceneGraph.from_yaml(FIVE_LINES)
    for name in ("g.yaml", "g.yml", "g.json", "g.usda", "g.usdc", "G.JSON"):
        save_graph(graph, tmp_path / name)
        assert load_graph(tmp_path / name) == graph
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "G.JSON",
        "g.json",
        "g.usda",
        "g.usdc",
        "g.yaml",
        "g.yml",
    ]


def test_text_with_a_byte_order_mark_and_windows_line_ends(tmp_path):
    path = tmp_path / "g.yaml"
    path.write_bytes(b"\xef\xbb\xbf" + FIVE_LINES.replace("\n", "\r\n").encode())
    assert load_graph(path) == SceneGraph.from_yaml(FIVE_LINES)


def test_files_that_cannot_be_read(tmp_path):
    (tmp_path / "latin.yaml").write_bytes("room: bedroom # caf\xe9".encode("latin-1"))
    (tmp_path / "folder.yaml").mkdir()
    big = tmp_path / "big.json"
    with big.open("wb") as file:
        file.truncate(65 * 2**20)
    for name, text in {
        "gone.yaml": "gone.yaml: no such file or directory",
        "graph.txt": "graph.txt: extension '.txt', allowed: .yaml, .yml, .json, .usda, .usdc, .usd, .usdz",
        "latin.yaml": "latin.yaml: no text in UTF-8 (byte 19)",
        "folder.yaml": "folder.yaml: is a directory, allowed: a .yaml, .yml, .json, .usda, .usdc, .usd, .usdz file",
        "big.json": "big.json: 65 MiB, allowed: 8 MiB for a scene graph",
    }.items():
        with pytest.raises(GraphError) as error:
            load_graph(tmp_path / name)
        assert str(error.value) == f"{tmp_path}{os.sep}{text}"


def test_files_that_cannot_be_written(tmp_path):
    graph = SceneGraph.from_yaml(FIVE_LINES)
    with pytest.raises(GraphError, match=r"gone/g\.yaml: cannot be written \(no such file or directory\)"):
        save_graph(graph, tmp_path / "gone" / "g.yaml")
    with pytest.raises(GraphError, match=r"g\.glb: extension '\.glb', allowed: \.yaml, \.yml, \.json, \.usda"):
        save_graph(graph, tmp_path / "g.glb")
    (tmp_path / "g.yaml").mkdir()
    with pytest.raises(GraphError, match=r"g\.yaml: cannot be written \(is a directory\)"):
        save_graph(graph, tmp_path / "g.yaml")
    assert [path.name for path in tmp_path.iterdir()] == ["g.yaml"]


def test_the_json_schema_offers_words_and_lets_aliases_pass():
    schema = SceneGraph.model_json_schema()
    node = schema["$defs"]["Node"]["properties"]
    assert node["category"]["anyOf"][0]["enum"][0] == "armchair"
    assert node["category"]["anyOf"][1]["type"] == "string"
    assert schema["$defs"]["Relation"]["required"] == ["subject", "predicate", "object"]
    assert schema["$defs"]["Relation"]["additionalProperties"] is False
    assert node["size"]["anyOf"][0]["minItems"] == node["size"]["anyOf"][0]["maxItems"] == 3
    json.dumps(schema)


@pytest.mark.parametrize(
    ("written", "radians"),
    [("yaw: 90 deg", 1.5707963), ("yaw: -45°", -0.7853982), ("yaw_degrees: 180", 3.1415927), ("yaw: 1.5 rad", 1.5)],
)
def test_angles_may_be_degrees(written, radians):
    graph = SceneGraph.from_yaml(f"room: bedroom\nobjects: {{bed: {{category: bed, {written}}}}}\n")
    assert graph.node("bed").yaw == pytest.approx(radians)
    assert SceneGraph.from_yaml(graph.to_yaml()) == graph


@pytest.mark.parametrize(
    ("written", "said"),
    [
        (
            "yaw: 90",
            "line 2: object 'bed': yaw: found 90, allowed: -2 pi to 2 pi radians; 90 degrees are written 90 deg",
        ),
        ("yaw: 90 grad", "line 2: object 'bed': yaw: found '90 grad', allowed: radians, or degrees as in 90 deg"),
        ("yaw: 1, yaw_degrees: 2", "line 2: both yaw and yaw_degrees are given, allowed: one of them"),
        ("yaw_degrees: 400", "line 2: yaw_degrees: found 400, allowed: -360 to 360"),
    ],
)
def test_angles_that_cannot_be_meant(written, said):
    with pytest.raises(GraphError) as caught:
        SceneGraph.from_yaml(f"room: bedroom\nobjects: {{bed: {{category: bed, {written}}}}}\n")
    assert str(caught.value) == said


def test_all_faults_of_a_file_are_told_at_once(tmp_path, echousd_command):
    path = tmp_path / "x.yaml"
    path.write_text(
        "room: garage\nobjects:\n  a: bedd\n  b: desk\nrelations:\n  - a left b\n  - a lefft b\n  - a left c\n"
    )
    done = echousd_command("new", tmp_path / "out.usda", "--from", path)
    assert done.code == 2
    told = [line.removeprefix(f"error: {path}:") for line in done.err.splitlines()]
    assert [line.split(":")[0] for line in told] == ["1", "3", "7", "8"]
    assert told[3] == "8: relation 'a left c': object 'c' is no object of this graph, allowed: a, b"
    assert not (tmp_path / "out.usda").exists()
    path.write_text("room: study\nobjects: {a: bed, b: desk}\nrelations: [a left c, b left d, a left b]\n")
    with pytest.raises(GraphError) as caught:
        load_graph(path)
    assert len(str(caught.value).splitlines()) == 2


def test_words_for_the_other_way_round():
    graph = SceneGraph.from_yaml(
        "room: study\nobjects: {desk: desk, lamp: pendant_lamp, cup: plant}\n"
        "relations: [desk under lamp, desk carries cup]\n"
    )
    assert [str(relation) for relation in graph.relations] == ["lamp above desk", "cup standing_on desk"]


def test_names_that_stand_twice_are_told_with_everything_else(tmp_path):
    path = tmp_path / "x.yaml"
    path.write_text(
        "room: bedroom\nobjects:\n  bed: double_bed\n  bed: single_bed\n  lamp: table_lamp\n  lamp: plant\n"
        "relations:\n  - bed left wardrobe\n"
    )
    with pytest.raises(GraphError) as told:
        load_graph(path)
    assert [line.split("x.yaml:")[1] for line in str(told.value).splitlines()] == [
        "4: key 'bed' stands twice",
        "6: key 'lamp' stands twice",
        "8: relation 'bed left wardrobe': object 'wardrobe' is no object of this graph, allowed: bed, lamp",
    ]
    path.write_text(
        "room: bedroom\nobjects:\n  - {name: bed, category: bed}\n  - {name: bed, category: sofa}\n"
        "  - {name: lamp, category: table_lamp, between: [bed, sofa]}\n  - {name: lamp, category: plant}\n"
        "relations: [bed left sofa]\n"
    )
    with pytest.raises(GraphError) as told:
        load_graph(path)
    assert [line.split("x.yaml:")[1].split(",")[0] for line in str(told.value).splitlines()] == [
        "4: two objects are called 'bed'",
        "5: object 'lamp': between: 'sofa' is no object of this graph",
        "6: two objects are called 'lamp'",
        "7: relation 'bed left sofa': object 'sofa' is no object of this graph",
    ]
