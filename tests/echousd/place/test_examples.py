"""Rooms found by search: nothing is missed in them, a stopped search goes on, another one is refused."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from echomodel.data.roomset import pack_rooms
from echomodel.objective import faults_of, plan_of
from echomodel.rooms.generator import generate_rooms
from echousd.place import examples
from echousd.place.examples import ExamplesPlan, search_examples


@pytest.fixture(autouse=True)
def _few(monkeypatch):
    monkeypatch.setattr(examples, "GRAPHS", 2)
    monkeypatch.setattr(examples, "PLAIN", 12)
    monkeypatch.setattr(examples, "HALLS", 0.0)


def test_found_rooms_miss_nothing_and_a_search_goes_on(tmp_path, monkeypatch):
    plan = ExamplesPlan(5, drafts=0)
    search_examples(tmp_path, plan, shards=1)
    first = (tmp_path / "found-00000.npz").read_bytes()
    rooms = search_examples(tmp_path, plan, shards=2)
    assert (tmp_path / "found-00000.npz").read_bytes() == first
    with (tmp_path / "log.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert min(sum(int(row[name]) for row in rows) for name in ("kept", "plain")) > 0
    assert [row["shard"] for row in rows] == ["0", "1"]
    assert sum(int(row["kept"]) + int(row["plain"]) for row in rows) == len(rooms)
    for number in range(len(rooms)):
        room = rooms.room(number)
        found = plan_of(room, room.categories, room.floor_polygon, room.openings, height=room.height)
        assert not faults_of(found, ("physics", "living", "composition"))
    with pytest.raises(ValueError, match="was begun with seed 5; choose another folder or remove it"):
        search_examples(tmp_path, ExamplesPlan(6, drafts=0), shards=1)
    with pytest.raises(ValueError, match="was begun with weights None; choose another folder"):
        search_examples(tmp_path, ExamplesPlan(5, drafts=0, weights="runs/mine"), shards=1)


def test_rooms_of_the_generator_that_miss_nothing_are_kept_unsearched(tmp_path):
    rooms = search_examples(tmp_path, ExamplesPlan(5, searched=False), shards=1)
    row = next(csv.DictReader((tmp_path / "log.csv").open()))
    assert (row["graphs"], row["kept"], int(row["plain"])) == ("0", "0", len(rooms))
    with pytest.raises(ValueError, match="was begun"):
        search_examples(tmp_path, ExamplesPlan(5), shards=1)


def test_a_set_is_not_left_unsearched():
    with pytest.raises(ValueError, match="--unsearched keeps rooms of the generator, --rooms mine"):
        ExamplesPlan(5, searched=False, rooms="mine.npz")


def test_rooms_of_a_set_are_searched_on(tmp_path):
    given = generate_rooms(9, 5)
    pack_rooms(tmp_path / "given.npz", given, [True] * 9, {})
    rooms = search_examples(tmp_path / "out", ExamplesPlan(3, drafts=0, rooms=str(tmp_path / "given.npz")), shards=5)
    rows = list(csv.DictReader((tmp_path / "out/log.csv").open()))
    assert {row["plain"] for row in rows} == {"0"}
    assert sum(int(row["kept"]) for row in rows) == len(rooms) >= 5
    assert rooms.held_out.all()  # what the set held out stays so
    floors = {room.floor_polygon.round(3).tobytes() for room in given}
    assert {rooms.room(k).floor_polygon.round(3).tobytes() for k in range(len(rooms))} <= floors


def test_drafts_are_the_networks():
    rooms = generate_rooms(2, 5)
    none = [np.zeros((0, 3), int)] * 2
    found = examples._drafts(ExamplesPlan(5, drafts=2), rooms, none, 0)
    assert [[len(boxes) for boxes in each] for each in found] == [[len(room)] * 2 for room in rooms]
    assert examples._searched(rooms[0], none[0], found[0][1]) is not None


def test_a_room_that_misses_something_is_left_out():
    room = generate_rooms(1, 5)[0]
    start = room.boxes()
    assert examples._searched(room, np.zeros((0, 3), int), start) is not None
    contradiction = np.array([[0, 1, 1], [1, 1, 0]])  # each to the left of the other
    assert examples._searched(room, contradiction, start) is None
