"""Room sets on disk: equal bytes per seed, resumed builds, rooms and batches that equal what was written."""

import pickle
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from echomodel.data import roomset
from echomodel.data.roomset import RoomSet, build_rooms, pack_rooms
from echomodel.data.shapeset import build_data
from echomodel.furniture.solids import Ball
from echomodel.rooms.generator import generate_rooms
from echomodel.rules import label_relations
from echomodel.tsdf import tsdf_of


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("rooms")
    build_rooms(path, 40, 3, 5)
    return path


def test_rooms_come_back(folder):
    rooms = RoomSet(folder)
    assert len(rooms) == 40
    assert rooms.held_out.sum() == 2
    for number, true in enumerate(generate_rooms(40, 3, styles=5)):
        read = rooms.room(number)
        assert [o.name for o in read.openings] == [o.name for o in true.openings]
        assert read.categories == true.categories
        assert read.models == true.models
        assert read.room_type == true.room_type
        assert np.allclose(read.size, true.size, atol=6e-4)
        assert np.allclose(read.position, true.position, atol=6e-4)
        assert np.allclose(read.floor_polygon, true.floor_polygon, atol=6e-4)
        for rules in ("strict", "sgfront"):
            assert np.array_equal(rooms.relations(number, rules=rules), label_relations(read, rules=rules))


def test_equal_seeds_give_equal_bytes_also_after_an_interruption(folder, tmp_path, monkeypatch):
    monkeypatch.setattr(roomset, "ROOMS_PER_SHARD", 8)

    def stop(done, total):
        if done > 8:
            raise KeyboardInterrupt

    build_rooms(tmp_path / "whole", 24, 3, 5)
    with pytest.raises(KeyboardInterrupt):
        build_rooms(tmp_path / "broken", 24, 3, 5, stop)
    with pytest.raises(ValueError, match="not a room set \\(unfinished set, run the build again\\)"):
        RoomSet(tmp_path / "broken")
    assert [p.name for p in sorted((tmp_path / "broken").glob("rooms-*"))] == ["rooms-0000.npz"]
    build_rooms(tmp_path / "broken", 24, 3, 5)
    for path in (tmp_path / "whole").iterdir():
        assert path.read_bytes() == (tmp_path / "broken" / path.name).read_bytes()
    build_rooms(tmp_path / "other", 24, 4, 5)
    name = "rooms-0000.npz"
    assert (tmp_path / "other" / name).read_bytes() != (tmp_path / "whole" / name).read_bytes()


def test_a_set_of_one_file(folder, tmp_path):
    whole, path = RoomSet(folder), tmp_path / "rooms.npz"
    rooms = [whole.room(k) for k in range(len(whole))]
    pack_rooms(path, rooms, whole.held_out.tolist(), {"seed": 3})
    packed = RoomSet(path)
    assert np.array_equal(packed.held_out, whole.held_out)
    assert path.stat().st_size < 300 * len(rooms)
    for number, true in enumerate(rooms):
        assert packed.room(number).to_json() == true.to_json()
    far = replace(rooms[0], position=rooms[0].position + 40)
    with pytest.raises(ValueError, match=r"room room_3_000000: a set of rooms holds less than 32.768 m"):
        pack_rooms(path, [far], [False], {})
    with zipfile.ZipFile(tmp_path / "header.npz", "w") as packed:
        packed.writestr("note.npy", b"\x93NUMPY\x01\x00\x03\x00('\n")
    for content in (b"PK", pickle.dumps({}), (tmp_path / "header.npz").read_bytes()):
        (tmp_path / "bad.npz").write_bytes(content)
        with pytest.raises(ValueError, match=r"bad.npz: not a packed set of rooms, allowed: a .npz of `echousd"):
            RoomSet(tmp_path / "bad.npz")


def test_bad_folders_are_told(folder, tmp_path):
    with pytest.raises(ValueError, match=r"was begun with seed 3; choose another folder or remove it"):
        build_rooms(folder, 40, 9, 5)
    with pytest.raises(ValueError, match=r"no rooms\.json"):
        RoomSet(tmp_path)
    build_rooms(tmp_path, 5, 1, 2)
    shard = tmp_path / "rooms-0000.npz"
    with np.load(shard) as held:
        columns = dict(held)
    for name, said in (("rooms.objects", "objects"), ("objects.category", "categories"), ("rooms.type", "room types")):
        np.savez(shard, **{**columns, name: np.full_like(columns[name], 255)})
        with pytest.raises(ValueError, match=f"rooms-0000.npz: damaged, its {said} are not those of its rooms"):
            RoomSet(tmp_path)
    shard.write_bytes(shard.read_bytes()[:-3])
    with pytest.raises(ValueError, match=r"rooms-0000.npz: not a packed set of rooms"):
        RoomSet(tmp_path)
    for text, said in (
        ("{", "cannot be read as JSON"),
        ("[" * 60_000, "cannot be read as JSON"),
        ("[]", r"missing: rooms \(int\)"),
        ('{"rooms": "5"}', r"missing: rooms \(int\)"),
    ):
        (shard.parent / "rooms.json").write_text(text)
        with pytest.raises(ValueError, match=f"rooms.json: .*{said}"):
            RoomSet(shard.parent)
    with pytest.raises(ValueError, match="unknown rules 'x': a room set is labelled by strict, sgfront"):
        RoomSet(folder).relations(0, rules="x")
    with pytest.raises(ValueError, match="unknown recipe 'huge': allowed are smoke, packed, full"):
        build_data(tmp_path, "huge", 1)


def test_the_smoke_recipe_makes_rooms_that_refer_to_its_shapes(tmp_path, monkeypatch):
    ball = tsdf_of([Ball(half=np.array([0.3, 0.2, 0.3]))])
    monkeypatch.setattr("echomodel.data.shapeset.tsdf_of", lambda parts: ball)
    told = []
    rooms, shapes = build_data(tmp_path, "smoke", 7, lambda part, done, total: told.append((part, done, total)))
    assert (len(rooms), len(shapes)) == (64, 146)
    assert told[-1] == ("shapes", 146, 146)
    for number in range(len(rooms)):
        room = rooms.room(number)
        for model, category in zip(room.models, room.categories, strict=True):
            assert shapes.categories[shapes.category[shapes.index_of(model)]] == category
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*-0000.*")}
    build_data(tmp_path, "smoke", 7)
    assert before == {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*-0000.*")}
    with pytest.raises(ValueError, match="was begun with seed 7"):
        build_data(tmp_path, "smoke", 8)
