"""Placements and names of any script in the texts that people write."""

from __future__ import annotations

import unicodedata

import pytest

from echousd.graph import GraphError, Node, SceneGraph
from echousd.graph.text import stating, without

ROOM = """room: living_room
objects: {sofa: sofa, armchair: armchair, table: side_table, plant: plant}
relations:
"""


def read(*relations: str) -> SceneGraph:
    return SceneGraph.from_yaml(ROOM + "".join(f"  - {relation}\n" for relation in relations))


@pytest.mark.parametrize(
    "words",
    ["plant in corner", "plant in the corner", "plant In A Corner", "[plant, in corner]", "[plant, in, corner]"],
)
def test_in_a_corner(words):
    assert read(words).node("plant").place == "in_corner"


def test_at_a_thing_is_near_it_and_at_a_wall_against_it():
    found = read("armchair at table", "sofa at wall")
    assert [str(relation) for relation in found.relations] == ["armchair close_by table"]
    assert found.node("sofa").place == "against_wall"


@pytest.mark.parametrize(
    "words",
    [
        "table between sofa and armchair",
        "table in between sofa and armchair",
        "table between sofa, armchair",
        "[table, between, sofa, armchair]",
        "[table, between, sofa, and, armchair]",
    ],
)
def test_between_two_others(words):
    graph = read("sofa against wall", words, "plant close by sofa")
    assert graph.node("table").between == ("sofa", "armchair")
    assert [str(one) for one in graph.placements] == ["sofa against_wall", "table between sofa and armchair"]
    assert len(graph.relations) == 1
    assert SceneGraph.from_yaml(graph.to_yaml()) == graph == SceneGraph.from_json(graph.to_json())


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("table between sofa", "line 4: 'table between sofa': found one other object, allowed: two"),
        ("table between sofa and sofa", "line 4: .*allowed: the names of two other objects"),
        ("table between table and sofa", "line 4: .*between names the object itself"),
        ("lamp in corner", "line 4: 'lamp in_corner': subject 'lamp' is no object of this graph, allowed: armchair, "),
        ("plant agaist wall", "line 4: relation 'plant agaist wall': did you mean against wall"),
        ("plant in a cornr", "line 4: relation 'plant in a cornr': did you mean in corner"),
        ("table betwen sofa and plant", "line 4: .*did you mean between"),
        ("table between sofa and lamp", "object 'table': between: 'lamp' is no object of this graph"),
    ],
)
def test_a_wrong_placement_is_told_with_its_line(words, message):
    with pytest.raises(GraphError, match=message):
        read(words)


def test_two_places_of_one_object_contradict_each_other():
    with pytest.raises(GraphError, match="line 5: 'plant against_wall': plant in_corner is stated already"):
        read("plant in corner", "plant against wall")


def test_lines_of_relations_after_a_placement_are_right():
    with pytest.raises(GraphError, match="line 6: 'sofa left armchair' contradicts 'armchair left sofa'"):
        read("plant in corner", "sofa left of armchair", "armchair left of sofa")


def test_between_two_others_told_twice_in_either_order_is_no_contradiction():
    graph = read("table between sofa and armchair", "table between armchair and sofa", "plant in corner")
    assert set(graph.node("table").between) == {"sofa", "armchair"}
    with pytest.raises(GraphError, match="table between sofa and armchair is stated already"):
        read("table between sofa and armchair", "table between plant and sofa")


def test_what_an_object_stands_between_goes_and_is_renamed_with_it():
    graph = read("table between sofa and armchair")
    assert graph.update_node("sofa", name="couch").node("table").between == ("couch", "armchair")
    assert graph.remove_node("armchair").node("table").between is None


def test_sentences_are_stated_and_taken_back():
    graph = stating(read(), "table between sofa and armchair")
    assert graph.node("table").between == ("sofa", "armchair")
    assert without(graph, "table between armchair and sofa") == read()
    with pytest.raises(GraphError, match="'plant in_corner' is not stated in this graph"):
        without(graph, "plant in corner")


TITLED = """room: bedroom
objects: {Großes Bett: double_bed, Bücherregal: bookshelf, 沙发: sofa, Табурет: stool, lamp: floor_lamp}
relations:
  - Bücherregal left of Großes Bett
  - [Табурет, close by, 沙发]
  - {subject: lamp, predicate: close_by, object: 沙发}
  - lamp between Großes Bett and Bücherregal
"""


def test_names_of_any_script_become_prims_and_stay_titles():
    graph = SceneGraph.from_yaml(TITLED)
    assert graph.names == ("Grosses_Bett", "Buecherregal", "sofa", "stool", "lamp")
    assert graph.titles == {
        "Großes Bett": "Grosses_Bett",
        "Bücherregal": "Buecherregal",
        "沙发": "sofa",
        "Табурет": "stool",
    }
    assert [str(r) for r in graph.relations] == [
        "Buecherregal left Grosses_Bett", "stool close_by sofa", "lamp close_by sofa"
    ]  # fmt: skip
    assert graph.node("lamp").between == ("Grosses_Bett", "Buecherregal")
    assert SceneGraph.from_yaml(graph.to_yaml()) == graph == SceneGraph.from_json(graph.to_json())


def test_one_name_written_in_two_ways_of_unicode_is_one():
    mixed = TITLED.replace("- Bücherregal", "- " + unicodedata.normalize("NFD", "Bücherregal"))
    assert mixed != TITLED
    assert SceneGraph.from_yaml(mixed) == SceneGraph.from_yaml(TITLED)


def test_names_that_meet_are_numbered():
    graph = SceneGraph.from_yaml("room: study\nobjects: {椅子一: chair, 椅子二: chair, chair: chair}\n")
    assert len(set(graph.names)) == 3
    assert all(Node(name, "desk").name == name for name in graph.names)


def test_a_name_means_its_own_object_and_a_title_of_two_means_none():
    graph = SceneGraph(
        "study", (Node("desk", "desk", title="chair"), Node("chair", "chair"), Node("lamp", "floor_lamp"))
    )
    assert graph.titles == {}
    assert str(stating(graph, "lamp left of chair").relations[0]) == "lamp left chair"
    graph = graph.update_node("desk", title="Möbel").update_node("chair", title=unicodedata.normalize("NFD", "Möbel"))
    with pytest.raises(GraphError, match="object: 'Möbel' is no identifier"):
        stating(graph, "lamp left of Möbel")
    assert stating(graph.update_node("chair", title="Stühle"), "lamp left of Möbel").relations[0].object == "desk"


def test_a_title_must_be_shown_on_one_line():
    with pytest.raises(GraphError, match=r"object 'bed': title: found 'a.nb', allowed: a text of"):
        Node("bed", "double_bed", title="a\nb")


def test_all_contradictions_are_told_at_once_with_their_lines():
    with pytest.raises(GraphError) as caught:
        read(
            "sofa left of plant", "plant left of sofa", "sofa taller than table", "plant near plant",
            "table taller than sofa", "sofa left of plant", "plant in corner", "plant against wall",
        )  # fmt: skip
    assert str(caught.value).startswith("line 11: 'plant against_wall': plant in_corner is stated already")
    with pytest.raises(GraphError) as caught:
        read("sofa left of plant", "plant in corner", "plant left of sofa", "plant near plant", "sofa left of plant")
    lines = str(caught.value).splitlines()
    assert [line.split(":")[0] for line in lines] == ["line 7", "line 8", "line 6"]
    assert "cannot relate to itself" in lines[0]
    assert "stated twice" in lines[1]
    assert "(left-right order)" in lines[2]
