"""Graphs of homes: words, files, edits, and what is wrong with them in one line."""

import json

import pytest
from homes import homes
from hypothesis import given, settings

from echousd.graph import GraphError
from echousd.home.files import load_home, save_home
from echousd.home.graph import HomeGraph, relation_of

TEXT = """home: {area: 60, entrance: hall, outline: [[0, 0], [10, 0], [10, 7], [0, 7]]}
rooms:
  hall: hallway
  living: {type: living_room, area: 24, objects: {sofa: sofa, lamp: floor_lamp}, relations: [lamp close by sofa]}
  bedroom_2: {ratio: 1.5}
relations:
  - hall door to living
  - [hall, door, bedroom_2]
  - living north of bedroom_2
"""


def test_words_make_a_home():
    home = HomeGraph.from_words("kitchen open_to living, hall door bedroom*2, hall door bathroom, balcony", area=75)
    names = ["kitchen", "living", "hall", "bedroom_1", "bedroom_2", "bathroom", "balcony"]
    assert [room.name for room in home.rooms] == names
    assert home.room("living").type == "living_room"
    assert [str(relation) for relation in home.relations] == [
        "kitchen open_to living", "hall door bedroom_1", "hall door bedroom_2", "hall door bathroom",
    ]  # fmt: skip
    assert home.entered_by == "hall"
    assert home.room("bedroom_2").graph.nodes


def test_every_room_gets_a_way_in():
    home = HomeGraph.from_words("kitchen open_to living, hall door bedroom, balcony").connected()
    assert [str(relation) for relation in home.relations[2:]] == ["hall door living", "hall door balcony"]


def test_one_file_holds_the_home_and_its_rooms(tmp_path):
    (tmp_path / "flat.yaml").write_text(TEXT)
    home = load_home(tmp_path / "flat.yaml")
    assert (home.area, home.entrance, home.outline[2]) == (60, "hall", (10, 7))
    assert home.room("living").graph.names == ("sofa", "lamp")
    assert home.room("bedroom_2").ratio == 1.5
    assert str(home.relations[2]) == "living north_of bedroom_2"
    for name in ("flat.json", "again.yaml", "flat.usda"):
        save_home(home, tmp_path / name)
        assert load_home(tmp_path / name) == home, name


def test_a_home_in_yaml_is_what_a_person_would_write(tmp_path):
    (tmp_path / "flat.yaml").write_text(TEXT)
    save_home(load_home(tmp_path / "flat.yaml"), tmp_path / "again.yaml")
    text = (tmp_path / "again.yaml").read_text()
    assert text.startswith("home: {area: 60.0, outline: [[0.0, 0.0], [10.0, 0.0], ")
    living = """  living:
    type: living_room
    area: 24.0
    objects:
      sofa: sofa
      lamp: floor_lamp
    relations:
      - lamp close_by sofa
  bedroom_2:
    type: bedroom
    ratio: 1.5
    objects:
"""
    assert living in text
    assert text.endswith("relations:\n  - hall door living\n  - hall door bedroom_2\n  - living north_of bedroom_2\n")


@settings(max_examples=15)
@given(homes())
def test_a_home_comes_back_from_text_and_stage(tmp_path_factory, home):
    folder = tmp_path_factory.mktemp("homes")
    for name in ("home.json", "home.yaml", "home.usda"):
        save_home(home, folder / name)
        assert load_home(folder / name) == home


def test_a_room_is_no_home(tmp_path):
    (tmp_path / "room.yaml").write_text("room: bedroom\nobjects: [bed]\n")
    assert load_home(tmp_path / "room.yaml") is None
    assert load_home(tmp_path / "none.txt") is None


def test_a_home_may_stand_on_one_line(tmp_path):
    (tmp_path / "flat.yaml").write_text(TEXT)
    home = load_home(tmp_path / "flat.yaml")
    (tmp_path / "flat.json").write_text(json.dumps(json.loads(home.to_json())))
    assert load_home(tmp_path / "flat.json") == home
    (tmp_path / "flat.yaml").write_text("{home: {area: 40}, rooms: {bedroom: bedroom, hall: hallway}}")
    assert [room.name for room in load_home(tmp_path / "flat.yaml").rooms] == ["bedroom", "hall"]
    (tmp_path / "room.yaml").write_text("room: bedroom\nobjects: {bed: {category: bed, attributes: {rooms: 3}}}\n")
    assert load_home(tmp_path / "room.yaml") is None


def test_another_way_replaces_the_one_before():
    home = HomeGraph.from_words("kitchen door living, hall door living").relate("kitchen open to living")
    assert [str(relation) for relation in home.relations] == ["hall door living", "kitchen open_to living"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("rooms: {hall: hallway}\nrelations: [hall door attic]\n", ":2: 'hall door attic': 'attic' is no room of"),
        (
            "rooms: {hall: hallway}\nrelations: [hall dor hall]\n",
            "unknown relation of rooms 'dor': did you mean door?",
        ),
        ("rooms: {hall: hallway}\nrelations: [hall door hall]\n", ":2: 'hall door hall': a room and itself"),
        ("rooms: {hall: hallway, den: cellarium}\n", "unknown room type 'cellarium'"),
        ("rooms: {hall: {type: hallway, aria: 3}}\n", "unknown field 'aria': did you mean area?"),
        ("rooms: [hall]\n", "rooms: allowed: a mapping of names"),
        ("rooms: {hall: hallway}\nhome: {entrance: attic}\n", ":2: entrance 'attic' is no room, allowed: hall"),
        ("rooms: {hall: hallway}\nhome: {outline: [[0, 0], [1, 1], [1, 0], [0, 1]]}\n", "does not cross itself"),
        ("rooms: {hall: {area: -3}}\n", "area: found -3, allowed: greater than 0.5"),
        ("rooms: {}\n", "0 rooms, allowed: 1 to 40"),
        (
            "rooms: {hall: hallway}\nrelations: hall door hall\n",
            ":2: relations: found 'hall door hall', allowed: a",
        ),
        ("rooms: {hall: hallway}\nhome: 5\n", ":2: home: found 5, allowed: a mapping with area, outline, entrance"),
        ("rooms: {hall: {type: 5}}\n", "room 'hall': "),
        ("rooms: {den: {type: bedroom, relations: [bed left of desk]}}\n", "room 'den': the graph is empty"),
        ("rooms: {hall: {objects: [bad]}}\n", "room 'hall': "),
    ],
)
def test_what_is_wrong_is_told_in_one_line(tmp_path, text, said):
    (tmp_path / "flat.yaml").write_text(text)
    with pytest.raises(ValueError, match=r"^.*flat\.yaml") as told:
        load_home(tmp_path / "flat.yaml")
    assert said in str(told.value)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("text", ["kitchen living", "kitchen*0 door hall", "kitchen door dungeon"])
def test_words_that_say_no_home(text):
    with pytest.raises(ValueError, match=r"rooms: |unknown room type"):
        HomeGraph.from_words(text)


def test_relations_in_other_words():
    assert str(relation_of("kitchen next to hall")) == "kitchen adjacent hall"
    with pytest.raises(GraphError, match="allowed: room predicate room"):
        relation_of("kitchen")


def test_new_writes_a_home(tmp_path, echousd_command):
    words = "kitchen open_to living, hall door bedroom*2"
    done = echousd_command(
        "new", tmp_path / "flat.usda", "--rooms", words, "--area", 60, "--relate", "hall door kitchen"
    )
    assert done.code == 0, done.err
    assert "a home of 5 rooms on 60 m², 4 relations between them" in done.out
    assert isinstance(load_home(tmp_path / "flat.usda"), HomeGraph)
    done = echousd_command("new", tmp_path / "flat.yaml", "--from", tmp_path / "flat.usda", "--size", 9, 8)
    assert done.code == 0, done.err
    text = (tmp_path / "flat.yaml").read_text()
    assert "outline: [[0.0, 0.0], [9.0, 0.0], [9.0, 8.0], [0.0, 8.0]]" in text.splitlines()[0]
    assert echousd_command("graph", tmp_path / "flat.yaml").out == text
    assert echousd_command("graph", tmp_path / "flat.yaml", "--room", "hall").out.startswith("# hallway, ")
    done = echousd_command("graph", tmp_path / "flat.yaml", "-o", tmp_path / "flat.png")
    assert done.err.endswith("5 rooms, say which one of kitchen, living, hall, bedroom_1, bedroom_2 (--room)\n")
    asked = json.loads(echousd_command("graph", tmp_path / "flat.yaml", "--json").out)
    assert asked["relations"][0] == "kitchen open_to living"
    done = echousd_command("new", tmp_path / "other.usda", "--room", "bedroom", "--area", 60)
    assert (done.code, "--area goes with --rooms" in done.err) == (2, True)


def test_rooms_of_a_large_home_hold_more():
    """Its floors are shared as rooms of their types usually are."""
    words = "hall door living_room, hall door bedroom"
    small, large = (HomeGraph.from_words(words, area=area) for area in (40, 120))
    outlined = HomeGraph.from_words(words, outline=((0, 0), (12, 0), (12, 10), (0, 10)))
    counts = [{room.name: len(room.graph.nodes) for room in home.rooms} for home in (small, large, outlined)]
    assert all(counts[0][name] < counts[1][name] for name in ("living_room", "bedroom"))
    assert counts[1] == counts[2]
