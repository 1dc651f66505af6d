"""What an edit puts elsewhere takes its company along, and what is free makes way for it."""

import numpy as np
import pytest

import echousd
from echomodel.boxes import Boxes
from echousd.graph import Node, Relation, RoomSpec, SceneGraph
from echousd.graph.arrays import triplets_of
from echousd.make.edit import attending, carried, edit, touched
from echousd.make.reading import read_room
from echousd.place.living import plan_to_live_in

# name: category, size, position, yaw
STANDS = {
    "table": ("dining_table", (1.4, 0.75, 0.9), (-1.4, 0.0, 0.4), 0.0),
    "west": ("dining_chair", (0.45, 0.9, 0.5), (-1.4, 0.0, -0.25), 0.0),
    "east": ("dining_chair", (0.45, 0.9, 0.5), (-1.4, 0.0, 1.05), np.pi),
    "light": ("table_lamp", (0.15, 0.3, 0.15), (-1.2, 0.75, 0.3), 0.0),
    "lamp": ("pendant_lamp", (0.4, 1.0, 0.4), (-1.4, 1.8, 0.4), 0.0),
    "shelf": ("bookshelf", (1.0, 1.8, 0.35), (2.2, 0.0, -1.8), 0.0),
}
TOLD = (Relation("light", "standing_on", "table"), Relation("lamp", "close_by", "table"))


def room(*told, **fields):
    nodes = tuple(Node(name, kind, **fields.get(name, {})) for name, (kind, *_) in STANDS.items())
    return SceneGraph(RoomSpec("dining_room", size=(6.0, 4.2), height=2.8), nodes, (*TOLD, *told))


def boxes():
    columns = zip(*((size, position, yaw) for _, size, position, yaw in STANDS.values()), strict=True)
    return Boxes(*(np.array(column, np.float32) for column in columns))


def moved(after, before=None):
    """Who went along, and where everything stands, by name."""
    there, names = carried(before or room(), after, boxes())
    places = zip(there.position.tolist(), there.yaw.tolist(), strict=True)
    return names, {name: (np.array(place), yaw) for name, (place, yaw) in zip(STANDS, places, strict=True)}


def test_who_attends_whom():
    graph = room()
    assert len(triplets_of(graph)) == len(TOLD)
    names, found = list(STANDS), attending(plan_to_live_in(graph, boxes()))
    assert {(names[k], names[i]) for k, i in found} == {
        (name, "table") for name in ("west", "east", "light", "lamp")
    }  # fmt: skip


def test_company_goes_along_and_keeps_its_place_at_what_was_moved():
    after = room(table={"position": (1.0, 0.0, 0.1), "yaw": 0.0})
    names, places = moved(after)
    assert names == {"west", "east", "light", "lamp"}
    for name, (_, _, position, yaw) in STANDS.items():
        shift = (2.4, 0, -0.3) if name in names else (0, 0, 0)
        np.testing.assert_allclose(places[name][0], np.add(position, shift), atol=1e-5)
        assert places[name][1] == pytest.approx(yaw)


def test_company_turns_with_what_is_turned():
    _, places = moved(room(table={"position": STANDS["table"][2], "yaw": np.pi / 2}))
    np.testing.assert_allclose(places["west"][0], (-2.05, 0.0, 0.4), atol=1e-5)  # behind it, which looks along +x now
    assert places["west"][1] == pytest.approx(np.pi / 2)
    np.testing.assert_allclose(places["light"][0], (-1.5, 0.75, 0.2), atol=1e-5)


def test_company_of_what_has_a_place_and_no_heading_keeps_its_own():
    _, places = moved(room(table={"position": (1.0, 0.0, 0.4)}))
    for name in ("west", "east", "light"):
        np.testing.assert_allclose(places[name][0], np.add(STANDS[name][2], (2.4, 0, 0)), atol=1e-5)
        assert places[name][1] == pytest.approx(STANDS[name][3])


def test_what_is_locked_or_put_somewhere_itself_stays_and_what_is_lifted_lifts_what_stands_on_it():
    put = {"table": {"position": (1.0, 0.1, 0.4), "yaw": 0.0}, "west": {"locked": True}}
    put["east"] = {"position": STANDS["east"][2]}
    names, places = moved(room(**put))
    assert names == {"light", "lamp"}
    assert places["light"][0][1] == pytest.approx(0.85)
    assert places["lamp"][0][1] == pytest.approx(1.8)
    np.testing.assert_allclose(places["west"][0], STANDS["west"][2], atol=1e-5)


def test_nobody_goes_along_where_nothing_was_moved():
    names, places = moved(room(table={"position": STANDS["table"][2], "yaw": 0.0}))
    assert names == set()
    np.testing.assert_allclose(places["west"][0], STANDS["west"][2], atol=1e-6)


def test_company_of_what_is_placed_anew_is_placed_anew():
    before, after = room(), room(Relation("table", "left", "shelf"))
    assert touched(before, after, boxes()) == (set(), {"table", "west", "east", "light", "lamp"})
    assert touched(before, after) == (set(), {"table", "light"})


def test_what_stood_on_something_that_is_gone_is_placed_anew():
    before = room()
    assert touched(before, before.remove_node("table"), boxes()) == (set(), {"light"})
    assert touched(before, before.lock("light").remove_node("table"), boxes()) == (set(), set())


def test_a_lamp_whose_table_goes_finds_another(tmp_path):
    graph = SceneGraph(
        RoomSpec("bedroom", size=(4.4, 3.8), height=2.6),
        (
            Node("bed", "double_bed"),
            Node("left", "nightstand"),
            Node("right", "nightstand"),
            Node("lamp", "table_lamp"),
        ),
        (Relation("lamp", "standing_on", "left"),),
    )
    made = echousd.generate(graph, seed=4, shapes="boxes", walls=False, dress="none", preview=False)
    root = made.save(tmp_path / "room")
    edit(root, remove="left").save(tmp_path / "room")
    assert not echousd.check(root).placement


@pytest.fixture
def saved(tmp_path):
    graph = SceneGraph(
        RoomSpec("living_room", size=(5.0, 4.0), height=2.7),
        (Node("sofa", "three_seat_sofa"), Node("low", "coffee_table"), Node("shelf", "bookshelf")),
    )
    made = echousd.generate(graph, seed=4, shapes="boxes", walls=False, dress="none")
    return made.save(tmp_path / "room", preview=False)


def test_what_is_free_makes_way(saved):
    before = read_room(saved)
    at = tuple(before.boxes.position[before.graph.names.index("sofa")].tolist())
    graph = before.graph.update_node("shelf", position=at, yaw=0.0)
    for asked in (graph, graph.lock("shelf")):  # as `update` has what an artist moved
        after = edit(saved, asked)
        assert after.faults == ()
        there = dict(zip(graph.names, after.boxes.position, strict=True))
        np.testing.assert_allclose(there["shelf"], at, atol=1e-3)
        assert np.linalg.norm(there["sofa"] - at) > 0.5
    locked = edit(saved, graph.lock("sofa").update_node("sofa", position=at))
    np.testing.assert_allclose(locked.boxes.position[0], at, atol=1e-3)
    assert any("sofa" in fault and "shelf" in fault for fault in locked.faults)


def test_solids_that_meet_after_a_change_of_size_make_way(saved):
    graph = read_room(saved).graph.relate("low", "front", "sofa")
    after = edit(saved, graph.update_node("low", size=(1.9, 0.45, 1.1)))
    assert after.faults == ()
    np.testing.assert_allclose(after.boxes.size[1], (1.9, 0.45, 1.1))


def test_what_is_not_in_the_way_stays(saved):
    before = read_room(saved)
    place = before.boxes.position[before.graph.names.index("shelf")] + (0.03, 0, 0)
    after = edit(saved, before.graph.update_node("shelf", position=tuple(place.tolist())))
    np.testing.assert_array_equal(after.boxes.position[:2], before.boxes.position[:2])


@pytest.fixture(scope="module")
def bedroom(tmp_path_factory):
    graph = SceneGraph(
        RoomSpec("bedroom", size=(4.2, 3.6), height=2.6),
        (Node("bed", "double_bed"), *(Node(at, "nightstand") for at in ("left", "right")), Node("lamp", "table_lamp")),
        (Relation("left", "left", "bed"), Relation("left", "close_by", "bed"), Relation("right", "right", "bed"),
         Relation("right", "close_by", "bed"), Relation("lamp", "standing_on", "left")),
    )  # fmt: skip
    made = echousd.generate(graph, seed=7, shapes="boxes", dress="none")
    return made.save(tmp_path_factory.mktemp("bedroom") / "room", preview=False)


def test_what_attends_and_stands_on_one_thing_goes_along_once(bedroom):
    before = read_room(bedroom)
    pairs = attending(plan_to_live_in(before.graph, before.boxes))
    assert len(pairs) == len({*pairs})
    at = dict(zip(before.graph.names, before.boxes.position, strict=True))
    after = before.graph.update_node("bed", position=tuple((at["bed"] + (0.4, 0, 0)).tolist()))
    there, names = carried(before.graph, after, before.boxes)
    assert names == {"left", "right", "lamp"}
    np.testing.assert_allclose(there.position[1:], before.boxes.position[1:] + np.float32((0.4, 0, 0)), atol=1e-5)


@pytest.mark.parametrize("at", [(0.0, 0.0, 0.3), (0.0, 0.0, -0.3), (0.4, 0.0, 0.0)])
def test_company_that_would_leave_the_room_is_placed_anew(bedroom, at):
    after = edit(bedroom, read_room(bedroom).graph.update_node("bed", position=at))
    assert after.faults == ()
    np.testing.assert_allclose(after.boxes.position[0], at, atol=1e-3)
    floor, half = np.array(after.graph.room.size) / 2, after.boxes.size[:, [0, 2]].min(1)[:, None] / 2
    assert (np.abs(after.boxes.position[:, ::2]) + half < floor + 0.01).all()
