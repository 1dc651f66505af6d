"""`echousd data` end to end on small sets."""

from dataclasses import replace

import numpy as np
import pytest
from small_room import small_room

from echomodel.data.roomset import RoomSet
from echomodel.roomboxes import RoomBoxes, read_rooms, write_rooms
from echomodel.rooms.generator import generate_rooms
from echomodel.rules import label_relations
from echomodel.training.rooms import PackedRooms
from echousd.cli.main import run
from echousd.stage.boxes import graph_of, room_of


@pytest.fixture(scope="module")
def rooms_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("rooms") / "rooms.json"
    assert run(["data", "rooms", "--count", "8", "--seed", "4", "-o", str(path)]) == 0
    return path


def same(a: RoomBoxes, b: RoomBoxes, digits: int = 4) -> bool:
    return (
        a.categories == b.categories
        and a.models == b.models
        and a.styles == b.styles
        and np.allclose(a.size, b.size, atol=10**-digits)
        and np.allclose(a.position, b.position, atol=10**-digits)
        and np.allclose(a.yaw, b.yaw, atol=10**-digits)
        and np.allclose(a.floor_polygon, b.floor_polygon, atol=10**-digits)
    )


def test_rooms_are_written_and_seeded(rooms_file, tmp_path):
    assert len(read_rooms(rooms_file)) == 8
    run(["data", "rooms", "--count", "8", "--seed", "4", "-o", str(tmp_path / "again.json")])
    assert (tmp_path / "again.json").read_bytes() == rooms_file.read_bytes()
    run(["data", "rooms", "--count", "3", "--room", "lounge", "-o", str(tmp_path / "living.json")])
    assert {room.room_type for room in read_rooms(tmp_path / "living.json")} == {"living_room"}


def test_a_set_of_generated_rooms_is_one_to_train_on(tmp_path, capsys):
    assert run(["data", "rooms", "--count", "1", "--seed", "4", "-o", str(tmp_path / "set.npz")]) == 0
    told = "".join(capsys.readouterr().err.split())  # lines of a long path break in its words
    assert "set.npz:1room;objectsofunknownwordsleftout:0" in told
    assert len(RoomSet(tmp_path / "set.npz")) == 1
    assert run(["data", "import", str(tmp_path / "set.npz"), "-o", str(tmp_path / "one.json")]) == 0
    assert "one.json:1room" in "".join(capsys.readouterr().err.split())


def test_rooms_to_usd_and_back(rooms_file, tmp_path):
    assert run(["data", "to-usd", str(rooms_file), "-o", str(tmp_path / "usd")]) == 0
    assert run(["data", "import", str(tmp_path / "usd"), "-o", str(tmp_path / "back.json")]) == 0
    true, back = read_rooms(rooms_file), read_rooms(tmp_path / "back.json")
    assert [room.id for room in back] == sorted(room.id for room in true)
    found = {room.id: room for room in back}
    for room in true:
        assert same(room, found[room.id])
        assert sorted(map(tuple, found[room.id].relations)) == sorted(map(tuple, label_relations(room)))


def test_rooms_of_all_sources_make_a_set_to_train_on(rooms_file, tmp_path, capsys):
    odd = replace(read_rooms(rooms_file)[0], categories=("sculpture", *read_rooms(rooms_file)[0].categories[1:]))
    write_rooms(tmp_path / "odd.json", [odd])
    run(["data", "to-usd", str(rooms_file), "-o", str(tmp_path / "usd"), "--limit", "3"])
    run(["data", "to-sgfront", str(rooms_file), "-o", str(tmp_path / "sg")])
    sources = [str(rooms_file), *(str(tmp_path / name) for name in ("usd", "sg", "odd.json"))]
    out = tmp_path / "mine.npz"
    capsys.readouterr()
    assert run(["data", "import", *sources, "-o", str(out)]) == 0
    told = "".join(capsys.readouterr().err.split())  # a terminal breaks lines where a path is long
    assert "20rooms;objectsofunknownwordsleftout:1" in told
    made = RoomSet(out)
    assert made.held_out.nonzero()[0].tolist() == [19]
    assert made.room(0).categories == read_rooms(rooms_file)[0].categories
    packed = PackedRooms.from_set(made, ("strict",), held=False)
    assert len(packed) == 19
    assert run(["data", "import", str(rooms_file), "-o", str(tmp_path / "x.bin")]) == 2
    assert "allowed are a set to train on (.npz) and a rooms file (.json)" in capsys.readouterr().err


def test_graph_keeps_relations_and_names_twins():
    room = generate_rooms(1, 8, room_type="dining_room")[0]
    some = RoomBoxes(**{**vars(room), "relations": label_relations(room)[::7]})
    graph = graph_of(some)
    assert len(set(graph.names)) == len(room)
    back = room_of(graph, room.id)
    assert same(room, back, 9)
    assert np.array_equal(np.sort(back.relations, 0), np.sort(some.relations, 0))
    assert len(graph_of(room, None).relations) == 0


def test_unknown_objects_are_left_out_or_told(tmp_path, capsys):
    room = RoomBoxes(
        "r", "living", np.array([[-2, -2], [2, -2], [2, 2], [-2, 2.0]]), 2.6, ("sculpture", "sofa_3", "stool"),
        np.ones((3, 3)), np.array([[0, 0, 0], [1, 0, 1], [-1, 0, 1.0]]), np.zeros(3),
    )  # fmt: skip
    path = tmp_path / "r.json"
    write_rooms(path, [room])
    assert run(["data", "to-usd", str(path), "-o", str(tmp_path / "usd")]) == 0
    assert run(["data", "import", str(tmp_path / "usd" / "r.usda"), "-o", str(tmp_path / "b.json")]) == 0
    assert read_rooms(tmp_path / "b.json")[0].categories == ("multi_seat_sofa", "stool")
    assert run(["data", "to-usd", str(path), "--no-known", "-o", str(tmp_path / "none")]) == 2
    assert "unknown category 'sculpture'" in capsys.readouterr().err


def test_sgfront_files_and_back(rooms_file, tmp_path):
    assert run(["data", "to-sgfront", str(rooms_file), "-o", str(tmp_path)]) == 0
    assert run(["data", "import", str(tmp_path), "-o", str(tmp_path / "back.json")]) == 0
    back = read_rooms(tmp_path / "back.json")
    assert len(back) == 8
    assert all(len(room.relations) > 0 for room in back)


def test_plot(rooms_file, tmp_path):
    assert run(["data", "plot", str(rooms_file), "-o", str(tmp_path / "rooms.png"), "--columns", "4"]) == 0
    assert (tmp_path / "rooms.png").read_bytes()[:4] == b"\x89PNG"


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["data", "plot", "missing.json", "-o", "x.png"], "missing.json: no such file or folder"),
        (["data", "build", "--recipe", "huge", "-o", "x"], "unknown recipe 'huge': allowed are smoke, packed, full"),
        (["data", "rooms", "--room", "garage", "-o", "x.json"], "unknown room type 'garage'"),
        (["data", "rooms", "-o", "x.yaml"], "x.yaml: allowed are a set to train on (.npz) and a rooms file (.json)"),
        (["data", "import", "nowhere", "-o", "x.npz"], "nowhere: no such file or folder"),
    ],
)
def test_errors_are_one_line(arguments, text, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(arguments) == 2
    error = capsys.readouterr().err
    assert text in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "command",
    [
        "data rooms --count 1 -o {tmp}/mine.json",
        "data import {rooms} -o {tmp}/mine.json",
        "data import {rooms} -o {tmp}/mine.npz",
        "data plot {rooms} -o {tmp}/mine.png",
        "data to-usd {rooms} -o {tmp}",
        "data to-sgfront {rooms} -o {tmp}",
        "eval suite random --against {rooms} -o {tmp}/mine",
        "eval study random real --against {rooms} -o {tmp}/mine",
    ],
)
def test_no_command_replaces_a_file_unless_it_is_told(rooms_file, tmp_path, capsys, command):
    mine = [tmp_path / name for name in ("mine", "mine.json", "mine.npz", "mine.png", "mine.html")]
    for path in mine:
        path.write_text("mine")
    assert run(command.format(tmp=tmp_path, rooms=rooms_file).split()) == 2
    assert "exists; choose another place or use --force" in " ".join(capsys.readouterr().err.split()).replace(" :", ":")
    assert {path.read_text() for path in tmp_path.iterdir()} == {"mine"}


def test_force_replaces(rooms_file, tmp_path):
    (tmp_path / "mine.json").write_text("mine")
    assert run(["data", "import", str(rooms_file), "-o", str(tmp_path / "mine.json"), "--force"]) == 0
    assert len(read_rooms(tmp_path / "mine.json")) == 8


def test_rooms_that_were_made_are_imported_as_they_stand(tmp_path, capsys):
    room = small_room(shapes="boxes", place=False)
    for name in ("one", "two"):
        room.save(tmp_path / "made" / name, preview=False)
    assert run(["data", "import", str(tmp_path / "made"), "-o", str(tmp_path / "rooms.json")]) == 0
    found = read_rooms(tmp_path / "rooms.json")
    assert [one.id for one in found] == ["one", "two"]
    assert found[0].categories == tuple(node.category for node in room.graph.nodes)
    assert np.allclose(found[0].position, room.boxes.position, atol=1e-3)
    assert np.allclose(found[0].floor_polygon, room.graph.room.corners, atol=1e-3)
    assert len(found[0].openings) == len(room.graph.room.openings)
    (tmp_path / "bare.yaml").write_text("room: bedroom\nobjects: {bed: double_bed}")
    assert run(["new", str(tmp_path / "bare.usda"), "--from", str(tmp_path / "bare.yaml")]) == 0
    assert run(["data", "import", str(tmp_path / "bare.usda"), "-o", str(tmp_path / "x.npz")]) == 2
    assert "bare.usda: /Room/Objects/bed: has no bounds" in capsys.readouterr().err


@pytest.mark.parametrize("held", ['{"rooms": 3}', '{"rooms": null}', "[]", '{"rooms": {"a": 1}}'])
def test_a_file_that_holds_no_rooms_is_named(tmp_path, capsys, held):
    (tmp_path / "odd.json").write_text(held)
    assert run(["data", "import", str(tmp_path / "odd.json"), "-o", str(tmp_path / "x.npz")]) == 2
    assert "odd.json: " in capsys.readouterr().err
    assert not (tmp_path / "x.npz").exists()
