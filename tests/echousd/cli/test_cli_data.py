"""`echousd data` end to end on small sets."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_room import small_room

from echomodel.data.roomset import RoomSet, pack_rooms
from echomodel.roomboxes import RoomBoxes, read_rooms, write_rooms
from echomodel.rooms.generator import generate_rooms
from echomodel.rules import label_relations
from echomodel.training.rooms import PackedRooms
from echousd.cli.main import run
from echousd.stage.boxes import graph_of, read_stage, room_of, write_stages


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
        and len(a.openings) == len(b.openings)
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


def test_real_rooms_hold_flat_things(rooms_file, tmp_path):
    raw = json.loads(rooms_file.read_text())
    raw["rooms"][1]["objects"][0]["size"] = [0.09, 0.0, 0.09]
    (tmp_path / "flat.json").write_text(json.dumps(raw))
    assert read_rooms(tmp_path / "flat.json")[1].size[0].tolist() == [0.09, 0.0, 0.09]


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"category": 5}, "category is 5, allowed: a string"),
        ({"category": None}, "category is None, allowed: a string"),
        ({"size": [float("nan"), 1, 1]}, "size is [nan, 1, 1], allowed: 3 finite numbers of 0 and more"),
        ({"size": [-1, 1, 1]}, "size is [-1, 1, 1], allowed: 3 finite numbers of 0 and more"),
        ({"size": [1, 1]}, "size is [1, 1], allowed: 3 finite numbers of 0 and more"),
        ({"position": [1e999, 0, 0]}, "position is [inf, 0, 0], allowed: 3 finite numbers"),
        ({"yaw": "ninety"}, "yaw is 'ninety', allowed: a finite number"),
        ({"style": "oak"}, "style is 'oak', allowed: a finite number"),
    ],
)
def test_what_is_wrong_with_an_object_of_a_rooms_file_is_told(rooms_file, tmp_path, capsys, change, told):
    raw = json.loads(rooms_file.read_text())
    raw["rooms"][1]["objects"][0].update(change)
    (tmp_path / "odd.json").write_text(json.dumps(raw))
    for out in ("x.npz", "x.json"):
        assert run(["data", "import", str(tmp_path / "odd.json"), "-o", str(tmp_path / out)]) == 2
        assert f"odd.json: room {raw['rooms'][1]['id']}: {told}" in " ".join(capsys.readouterr().err.split())
        assert not (tmp_path / out).exists()


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"id": 5}, "id is 5, allowed: a string"),
        ({"height": -2}, "height is -2, allowed: a finite number of 0 and more"),
        ({"floor_polygon": [[0, 0], [1, 1]]}, "floor_polygon has 2 corners, allowed: none, or three and more"),
        ({"floor_polygon": [[0, 0, 0]] * 4}, "allowed: n x 2 finite numbers"),
        ({"relations": [[0, 1, 99]]}, "relation [0, 1, 99], allowed: two of"),
        ({"relations": [[-1, 1, 0]]}, "relation [-1, 1, 0], allowed: two of"),
        ({"relations": [[0, 1, 0]]}, "relation [0, 1, 0], allowed: two of"),
        ({"relations": [[0, 999, 1]]}, "relation [0, 999, 1], allowed: two of"),
        ({"relations": [[0, 1]]}, "allowed: n x 3 finite numbers"),
        ({"objects": {"bed": 1}}, "objects is no list of objects"),
    ],
)
def test_what_is_wrong_with_a_room_of_a_rooms_file_is_told(rooms_file, tmp_path, change, told):
    raw = json.loads(rooms_file.read_text())
    raw["rooms"][1].update(change)
    (tmp_path / "odd.json").write_text(json.dumps(raw))
    with pytest.raises(
        ValueError, match=re.escape(f"odd.json: room {raw['rooms'][1]['id']}: ") + ".*" + re.escape(told)
    ):
        read_rooms(tmp_path / "odd.json")


def test_what_a_set_holds_no_numbers_for_is_named_and_turns_are_whole(rooms_file, tmp_path):
    room = read_rooms(rooms_file)[0]
    turned = replace(room, yaw=room.yaw + 4 * np.pi)
    with pytest.raises(ValueError, match=f"room {room.id}: a set of rooms holds .* 32768 styles"):
        pack_rooms(tmp_path / "x.npz", [replace(room, styles=(10**5,) * len(room))], [False], {})
    pack_rooms(tmp_path / "x.npz", [turned, replace(room, size=room.size * 1e-5)], [False] * 2, {})
    held = RoomSet(tmp_path / "x.npz")
    assert np.allclose(np.exp(1j * held.room(0).yaw), np.exp(1j * room.yaw), atol=2e-4)
    assert (held.room(1).size > 0).all()


def test_rooms_of_one_name_and_names_of_other_folders_are_stages_of_their_own(rooms_file, tmp_path):
    one, two, *_ = read_rooms(rooms_file)
    write_stages([one, replace(two, id=one.id), replace(one, id="../out"), replace(one, id="a/b")], tmp_path / "usd")
    assert {path.name for path in tmp_path.rglob("*.usda")} == {
        f"{one.id}.usda",
        f"{one.id}_2.usda",
        "_out.usda",
        "a_b.usda",
    }
    assert [path.name for path in tmp_path.iterdir()] == ["usd"]
    assert read_stage(tmp_path / "usd" / f"{one.id}_2.usda")[0].categories == two.categories


LABELLED = """#usda 1.0
(
    defaultPrim = "World"
    upAxis = "Z"
    metersPerUnit = 0.01
)
class Xform "Nightstand" (prepend apiSchemas = ["SemanticsLabelsAPI:class"])
{
    token[] semantics:labels:class = ["nightstand"]
    def Cube "box"
    {
        double size = 40
    }
}
def Xform "World"
{
    def Xform "Bedroom"
    {
        def Xform "ns_1" (
            instanceable = true
            references = </Nightstand>
        )
        {
            double3 xformOp:translate = (75, 20, 20)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
        def Xform "ns_2" (
            instanceable = true
            references = </Nightstand>
        )
        {
            double3 xformOp:translate = (325, 20, 20)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
    }
}
"""


def test_labelled_stages_of_others_are_imported(tmp_path, capsys):
    (tmp_path / "usd").mkdir()
    (tmp_path / "usd" / "scan.usda").write_text(LABELLED)
    for source in ("usd", "usd/scan.usda"):
        assert run(["data", "import", str(tmp_path / source), "-o", str(tmp_path / "x.json"), "--force"]) == 0
        (room,) = read_rooms(tmp_path / "x.json")
        assert (room.id, room.room_type, room.categories) == ("scan", "bedroom", ("nightstand", "nightstand"))
        assert np.allclose(room.size, 0.4)
        assert np.allclose(room.position, [(0.75, 0.0, -0.2), (3.25, 0.0, -0.2)])
    (tmp_path / "usd" / "other.usda").write_text('#usda 1.0\ndef Cube "thing" {}\n')
    assert run(["data", "import", str(tmp_path / "usd"), "-o", str(tmp_path / "x.npz")]) == 2
    assert "other.usda: no scene graph" in capsys.readouterr().err


def test_data_to_train_on_that_is_not_there_is_named(tmp_path, capsys):
    recipe = ["train", str(Path(__file__).parents[3] / "model/recipes/layout.toml"), "-o", str(tmp_path / "run")]
    assert run([*recipe, "--set", "data=nowhere.npz"]) == 2
    assert "recipe field 'data' names nowhere.npz, which does not exist" in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("name", ["checkpoint.safetensors", "weights.safetensors"])
def test_weights_of_a_run_are_not_written_over(tmp_path, capsys, name):
    (tmp_path / name).write_bytes(b"a night's work")
    recipe = str(Path(__file__).parents[3] / "model/recipes/smoke.toml")
    assert run(["train", recipe, "-o", str(tmp_path)]) == 2
    told = " ".join(capsys.readouterr().err.split())
    assert f"holds {name} already, continue it with --resume or choose another --output" in told
    assert [path.name for path in tmp_path.iterdir()] == [name]


RECIPE = str(Path(__file__).parents[3] / "model/recipes/smoke.toml")


@pytest.mark.parametrize(
    ("words", "what"),
    [
        (("train", RECIPE), "run of echousd train"),
        (("data", "build"), "data set"),
        (("data", "search", "--count", "1"), "data set"),
    ],
)
def test_a_folder_that_holds_other_things_stays_as_it_is(tmp_path, capsys, words, what):
    (tmp_path / "thesis.tex").write_text("mine")
    assert run([*words, "-o", str(tmp_path)]) == 2
    assert f"holds thesis.tex and no {what}; choose another folder" in " ".join(capsys.readouterr().err.split())
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]
