"""SG-FRONT files: our rooms written so come back, the published sample form, errors that name file and scan."""

import json

import numpy as np
import pytest

from echomodel.data.sgfront import SGFront, write_sgfront
from echomodel.rooms.generator import generate_rooms
from echomodel.rules import label_relations, verdicts
from echomodel.vocabulary import vocabulary

GRAPHS, BOXES = "relationships_all_trainval.json", "obj_boxes_all_trainval.json"


@pytest.fixture(scope="module")
def rooms():
    return generate_rooms(12, 31)


@pytest.fixture
def folder(tmp_path, rooms):
    write_sgfront(tmp_path, rooms[:8], seed=2)
    write_sgfront(tmp_path, rooms[8:], split="test", seed=3)
    return tmp_path


def test_rooms_come_back(folder, rooms):
    for split, part in (("trainval", rooms[:8]), ("test", rooms[8:])):
        read = SGFront(folder, split=split).rooms()
        assert len(read) == len(part)
        shares = []
        for room, true in zip(read, part, strict=True):
            assert room.room_type == true.room_type
            assert room.categories == tuple(vocabulary().category(c).sgfront for c in true.categories)
            assert np.allclose(room.size, true.size)
            assert np.allclose(room.position, true.position)
            assert np.allclose(room.yaw, true.yaw)
            assert room.models == true.models
            assert np.allclose(room.floor_polygon.max(0), true.floor_polygon.max(0))
            assert room.relations is not None
            labels = {tuple(t) for t in label_relations(true, rules="sgfront").tolist()}
            told = {tuple(t) for t in room.relations.tolist()}
            assert told <= labels
            shares.append((len(told), len(labels)))
            assert room.graph().num_nodes == len(room)
        kept, labelled = np.sum(shares, axis=0)
        assert 0.4 < kept / labelled < 0.6


def test_the_published_vocabulary(folder):
    read = SGFront(folder)
    assert len(read.classes) == 36
    assert {"_scene_", "floor"} < set(read.classes)
    scan = json.loads((folder / GRAPHS).read_text())["scans"][0]
    *things, last = scan["objects"]
    assert scan["objects"][last] == "floor"
    # every object has its place: on the floor or above it
    floor = {str(subject): words for subject, other, *words in scan["relationships"] if str(other) == last}
    assert floor.keys() == set(things)
    assert {tuple(words) for words in floor.values()} <= {(6, "above"), (7, "standing on")}


def test_written_graphs_satisfy_the_published_metric(folder):
    for room in SGFront(folder).rooms():
        assert (verdicts(room, room.relations, rules="sgfront") != 0).all()


def edited(folder, name, change):
    path = folder / name
    raw = json.loads(path.read_text())
    change(raw)
    path.write_text(json.dumps(raw))


def first(raw):
    return raw["scans"][0] if "scans" in raw else next(iter(raw.values()))


@pytest.mark.parametrize(
    ("file", "change", "text"),
    [
        (GRAPHS, lambda r: first(r)["relationships"].append([99, 1, 1, "left"]), r"no object 99, there are 1, 2"),
        (GRAPHS, lambda r: first(r)["relationships"].append([1, 2, 16, "left"]), r"id 16, allowed are 1 to 15"),
        (GRAPHS, lambda r: first(r)["relationships"].append([1, 2, 2, "left"]), r"id 2 is 'right' in relat"),
        (GRAPHS, lambda r: first(r)["relationships"].append([1, 2]), r"expected \[subject, object, id, name\]"),
        (GRAPHS, lambda r: first(r)["objects"].update({"1": "piano"}), r"object 1 is a 'piano', which classes_all.txt"),
        (GRAPHS, lambda r: r["scans"].append(first(r)), r"appears twice"),
        (GRAPHS, lambda r: r.pop("scans"), r"no list `scans`"),
        (BOXES, lambda r: first(r).pop("2"), r"no box for object 2 \("),
        (BOXES, lambda r: first(r)["1"]["param7"].pop(), r"object 1: param7 is .* expected 7 finite numbers"),
        (BOXES, lambda r: first(r)["1"].update(param7=[1, -1, 1, 0, 0, 0, 0]), r"size \[1, -1, 1\] is negative"),
        (BOXES, lambda r: first(r).pop("scene_center"), r"scene_center is None, expected 3 numbers"),
        (BOXES, lambda r: r.pop(next(iter(r))), r"scan \w+-0: missing"),
        (GRAPHS, lambda r: first(r).update(relationships=[7]), r"a scan not as SG-FRONT has it \(object of type 'int'"),
        (BOXES, lambda r: first(r).update({"1": 0.5}), r"a scan not as SG-FRONT has it \('float' object has no"),
    ],
)  # fmt: skip
def test_malformed_files_name_file_and_scan(folder, file, change, text):
    edited(folder, file, change)
    with pytest.raises(ValueError, match=text) as caught:
        SGFront(folder).rooms()
    assert file in str(caught.value)
    assert "scan" in str(caught.value)


def test_other_bad_files(folder):
    (folder / "relationships.txt").write_text("left\nright\n")
    with pytest.raises(ValueError, match=r"relationships.txt: holds 2 relationships, expected 15"):
        SGFront(folder)
    (folder / "relationships.txt").unlink()
    with pytest.raises(ValueError, match=r"relationships.txt: no such file"):
        SGFront(folder)
    with pytest.raises(ValueError, match="room 'attic', split 'trainval': allowed are bedroom"):
        SGFront(folder, "attic")
    (folder / GRAPHS).write_text("{")
    with pytest.raises(ValueError, match=r"no such file"):
        SGFront(folder)
