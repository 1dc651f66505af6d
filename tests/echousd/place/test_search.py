"""The search over the objective: each of its moves, what it may cost, and that nothing it knows is without weight."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from echomodel.boxes import Boxes
from echomodel.graph import Stated
from echomodel.objective import TERMS, plan_of, unreached
from echomodel.objective.table import COST, costs_of
from echomodel.openings import Opening
from echomodel.rooms.generator import generate_rooms
from echomodel.rules import label_relations, margins
from echomodel.vocabulary import vocabulary
from echousd.place.building import expecting, filled, involved, with_along
from echousd.place.placing import place_boxes
from echousd.place.problem import problem_of
from echousd.place.proposals import out_of_habit, proposals, slots_at
from echousd.place.search import MANY, PIECES, UNEASY, Search, State
from echousd.place.seats import sides

ID = {row.name: row.id for row in vocabulary().predicates}
FLOOR = np.array([(-2.5, -2.0), (2.5, -2.0), (2.5, 2.0), (-2.5, 2.0)])


def searched(words, size, position, yaw, told=(), *, turned=(), fixed=(), floor=FLOOR):
    """A search in a room, and the state that its boxes were drawn in."""
    still, kept = np.isin(np.arange(len(words)), fixed), np.isin(np.arange(len(words)), turned)
    triplets = np.array([(a, ID[word], b) for a, word, b in told], int).reshape(-1, 3)
    problem = problem_of(
        words, np.array(size, float), np.array(position, float), np.array(yaw, float), triplets,
        floor_polygon=floor, height=2.7, fixed=still, rigid=still, turned=still | kept,
    )  # fmt: skip
    problem = problem.spread()
    return Search(problem), State(problem.position, problem.yaw, np.zeros(len(words)))


@pytest.fixture(scope="module")
def missed():
    """Every term with what it finds in rooms whose boxes were shaken, by its name."""
    found = {}
    rooms = [
        room
        for word in ("bedroom", "living_dining_room", "living_room", "dining_room", "study", "kitchen", "bathroom")
        for room in generate_rooms(2 if word == "kitchen" else 8, 2, room_type=word)  # kitchens take a second each
    ]
    for number, room in enumerate(rooms):
        luck = np.random.default_rng(number)
        told = label_relations(room, rules="strict", drop=0.0, rng=luck)
        more = [(0, ID[word], 1) for word in ("facing", "opposite", "aligned_with", "centered_on")]
        told = np.concatenate([told, np.array(more)])
        shaken = replace(
            room,
            position=room.position + luck.normal(0, 0.8, room.position.shape),
            yaw=room.yaw + luck.normal(0, 1.0, len(room)),
            size=room.size * luck.uniform(0.4, 2.5, room.size.shape),
        )  # fmt: skip
        stated = (Stated("against_wall", 0),)
        plan = plan_of(shaken, room.categories, room.floor_polygon, room.openings, told, height=2.5, stated=stated)
        for term in (term for term in TERMS if term.name not in found):
            seen = term.find(plan)
            if bool((seen.margin < 0).any()):
                found[term.name] = seen, plan
    return found


def cost(term, seen, plan):
    """What the rows of a term cost."""
    return costs_of([(term, seen)], plan)[1]


@pytest.mark.parametrize("term", TERMS, ids=[term.name for term in TERMS])
def test_every_term_and_its_weight_count(missed, term):
    if term.name not in missed:
        pytest.skip("no shaken room breaks it")
    seen, plan = missed[term.name]
    full = cost(term, seen, plan)
    assert float(full.max()) > COST[term.kind][0]
    assert float(cost(replace(term, weight=0.0), seen, plan).sum()) < float(full.sum())
    kept = replace(seen, margin=abs(seen.margin) + 1.0)
    assert float(cost(term, kept, plan).sum()) == 0.0


def test_most_terms_are_broken_by_shaken_rooms(missed):
    assert len(missed) > 0.8 * len(TERMS)


def test_what_is_given_is_blamed_for_relations_and_collisions_alone(missed):
    for name in ("parallel", "apart"):
        seen, plan = missed[name]
        given = replace(plan, fixed=np.ones(len(plan), bool))
        term = next(term for term in TERMS if term.name == name)
        assert (float(cost(term, seen, given).sum()) > 0) == (name == "apart")


def test_a_screen_goes_along_to_the_wall_ahead():
    words = ["multi_seat_sofa", "tv_stand"]
    search, state = searched(words, [(2.0, 0.8, 0.9), (1.6, 0.5, 0.4)], [(0, 0, -1.5), (1.0, 0, 1.8)], [0, np.pi])
    row = np.array([[-2.0, 0.3, np.pi / 2, 0.0]])
    position, yaw = search.carried(state, 0, [0], row, screens=[[1]])
    assert position[0, 1, [0, 2]] == pytest.approx([2.5 - 0.2 - search.problem.behind[1], 0.3], abs=1e-6)
    assert np.cos(yaw[0, 1] + np.pi / 2) == pytest.approx(1.0)


def test_a_bed_takes_the_dresser_that_is_told_opposite_along_to_a_shorter_wall():
    words, floor = ["double_bed", "dresser"], FLOOR * np.array([1.0, 0.6])  # 5 x 2.4 m
    at, turn = [(0.0, 0.0, -0.15), (0.0, 0.0, 0.95)], [0.0, np.pi]  # 0.05 m before its foot
    search, state = searched(words, [(1.8, 0.9, 2.05), (1.1, 0.9, 0.4)], at, turn, [(1, "opposite", 0)], floor=floor)
    after = search.moved(state, np.ones(2, bool), 0)
    assert abs(np.sin(after.yaw[0])) == pytest.approx(1.0)
    assert np.hypot(*(after.position[1] - after.position[0])[[0, 2]]) > 2.0
    assert search.faults(after)[1] == []


def test_a_sofa_turns_to_another_wall_though_its_screen_and_a_plant_beside_that_stand_ahead():
    words = ["multi_seat_sofa", "tv_stand", "plant"]
    size = [(2.0, 0.8, 0.9), (1.6, 0.5, 0.4), (0.4, 1.0, 0.4)]
    told = [(1, "opposite", 0), (2, "close_by", 1)]
    search, state = searched(words, size, [(0, 0, -1.5), (0, 0, 1.8), (1.1, 0, 1.8)], [0.0, np.pi, 0.0], told)
    every = np.ones(3, bool)
    there = np.array([[0.0, -1.5, 0.0, 0.0], [-2.0, 0.0, np.pi / 2, 0.0]])
    assert [search.unlikely(state, every, 0, [0], there, at).sum() for at in (None, np.full(2, 7.0))] == [0.0, 14.0]
    assert search.group(1, every, state) == [1, 2]
    position, _ = search.carried(state, 0, [0], there[1:], screens=[[1, 2]])
    assert np.hypot(*(position[0, 2] - position[0, 1])[[0, 2]]) == pytest.approx(1.1, abs=0.05)


def test_a_table_and_the_sideboard_told_near_it_go_to_another_wall_together():
    words, told = ["dining_table", "sideboard", "bookshelf"], [(1, "close_by", 0), (2, "close_by", 1)]
    size = [(1.6, 0.75, 0.9), (1.2, 0.8, 0.4), (0.8, 1.9, 0.3)]
    search, state = searched(
        words, size, [(0.0, 0, 0.0), (-2.29, 0, -1.2), (2.34, 0, 1.4)], [0, np.pi / 2, -np.pi / 2], told
    )
    assert search.alongside == [[(1, 0), (2, 1)], [(2, 1)], [(1, 2)]]
    for still in ({"turned": [1]}, {"fixed": [1]}):  # who has a stated heading or place does not go along
        assert searched(words, size, state.position, state.yaw, told, **still)[0].alongside == [[], [], []]
    rows = np.array([[0.0, 1.2, 0.0, 0.0], [1.6, -1.0, 0.0, 0.0]])
    position, yaw = with_along(search, state, np.ones(3, bool), 0, [0], rows, search.alongside[0])
    for number in range(len(rows)):
        plan = search.problem.plan.at(position[number], yaw[number])
        margins = {term.name: term.find(plan).margin for term in TERMS if term.name in ("close_by", "apart", "at_wall")}
        assert all((margin >= 0).all() for margin in margins.values())
    assert np.hypot(*(position[1] - position[0])[[1, 2], ::2].T).min() > 0.5  # each time at another wall


def test_a_table_is_put_in_where_there_is_a_wall_for_the_sideboard_told_near_it():
    words, told, size = ["dining_table", "sideboard"], [(1, "close_by", 0)], [(1.6, 0.75, 0.9), (1.2, 0.8, 0.4)]
    search, state = searched(words, size, [(0, 0, 0), (2.29, 0, 3.0)], [0, -np.pi / 2], told, floor=2 * FLOOR)
    there = np.array([True, False])
    after = search.moved(expecting(search, state, there, 0), there, 0)
    assert there.all()
    assert search.faults(after)[1] == []


def test_a_nightstand_told_near_a_dresser_is_expected_there_at_a_wall_and_not_at_a_bed_of_it():
    words, told = ["single_bed", "nightstand", "dresser"], [(1, "close_by", 2)]
    size = [(0.9, 0.5, 2.0), (0.45, 0.5, 0.4), (1.0, 0.8, 0.45)]
    search, state = searched(words, size, [(-1.5, 0, -1.0), (-0.8, 0, -1.8), (1.0, 0, -1.7)], [0, 0, 0], told)
    assert [search.problem.anchor[1], search.alongside[2]] == [0, [(1, 2)]]
    there = np.array([True, False, True])
    expected = expecting(search, state, there, 2)
    assert there.all()
    np.testing.assert_array_equal(expected.position, state.position)


def test_storage_that_is_longer_than_every_wall_stays():
    words, told = ["dining_table", "sideboard"], [(1, "close_by", 0)]
    search, state = searched(words, [(1.6, 0.75, 0.9), (5.5, 0.8, 0.4)], [(0, 0, 0), (0, 0, -1.8)], [0, 0], told)
    position, _ = with_along(search, state, np.ones(2, bool), 0, [0], np.array([[0.0, 1.0, 0.0, 0.0]]), [(1, 0)])
    assert position[0, 1].tolist() == state.position[1].tolist()


@pytest.mark.parametrize("count", [MANY - 1, MANY])
def test_a_room_of_many_pieces_is_built_up(monkeypatch, count):
    begun = []
    monkeypatch.setattr("echousd.place.search.rebuilt", lambda search, state, out: begun.append(out) or state)
    search, _ = searched(["stool"] * count, [(0.3, 0.4, 0.3)] * count, [(0.0, 0, 0.0)] * count, [0.0] * count)
    search.run(0)
    assert begun == [list(range(count))] * (count == MANY)


def test_a_bare_part_of_the_floor_is_filled_by_one_piece():
    words, at = ["bookshelf"] * MANY, [(x, 0, z) for x in (-4.0, -1.5) for z in np.linspace(-3.5, 3.5, MANY // 2)]
    still = range(MANY // 2)
    search, state = searched(words, [(0.8, 1.8, 0.3)] * MANY, at, [0.0] * MANY, fixed=still, floor=3 * FLOOR)
    cost, _ = search.faults(state)
    assert search.bare
    after = filled(search, state)
    gone = np.hypot(*(after.position - state.position)[:, ::2].T) > 1.0
    assert gone[MANY // 2 :].sum() == gone.sum() == 1
    assert search.faults(after)[0] + after.taste.sum() < cost + state.taste.sum() - 0.5


@pytest.mark.parametrize("count", [PIECES, PIECES + 1])
def test_the_floor_counts_while_the_pieces_of_a_hall_are_put_in(count):
    at = [(x, 0, z) for x in (-4.0, -1.5) for z in np.linspace(-3.5, 3.5, PIECES // 2 + 1)][:count]
    search, state = searched(["bookshelf"] * count, [(0.8, 1.8, 0.3)] * count, at, [0.0] * count, floor=3 * FLOOR)
    search.looks &= search.whole[:, None]  # no other terms
    there, moved = np.arange(count) < count - 1, np.arange(count) == count - 2
    position = np.repeat(state.position[None], 2, 0)
    position[1, moved, 0] = 4.0
    near, far = search.costs(there, position, np.repeat(state.yaw[None], 2, 0), moved)
    assert (far < near - 0.1) == (near > 0.0) == (count > PIECES)


@pytest.mark.parametrize("bare", [False, True])
def test_others_than_those_next_to_it_are_asked_where_the_floor_is_bare(monkeypatch, bare):
    search, state = searched(["stool"] * 2, [(0.3, 0.4, 0.3)] * 2, [(0, 0, 0), (1, 0, 1)], [0.0] * 2)
    asked = []
    monkeypatch.setattr("echousd.place.search.filled", lambda search, state: asked.append(state) or state)
    monkeypatch.setattr(search, "faults", lambda state: (9.0, [0]))
    search.bare = bare
    search.mended(state, 9.0, [0])
    assert len(asked) == bare


def test_a_second_sofa_is_tried_at_the_sides_of_the_table():
    words = ["multi_seat_sofa", "loveseat_sofa", "coffee_table"]
    size = [(2.2, 0.8, 0.9), (1.6, 0.8, 0.9), (1.2, 0.4, 0.6)]
    search, state = searched(words, size, [(0, 0, -3.4), (3.0, 0, 3.0), (0, 0, -2.2)], [0.0] * 3, floor=2 * FLOOR)
    rows = proposals(search.problem, state.position, state.yaw, np.ones(3, bool), 1)
    near = np.hypot(rows[:, 0] - 1.2 / 2 - 0.45, rows[:, 1] + 2.2) < 0.5  # at its end
    looks = np.sin(rows[near, 2]) < -0.99
    assert (looks & (abs(rows[near, 1] + 2.2) < 0.01)).any()


def test_a_second_sofa_level_with_an_end_of_the_table_is_near_it_and_leaves_room_for_knees():
    words, size = ["sofa", "coffee_table"], [(2.2, 0.8, 0.9), (1.2, 0.4, 0.7)]
    slots = sides(*np.array(size))
    level = [slot for slot in slots if min(abs(slot[0]), abs(slot[1])) > 0.1]
    for lateral, forward, turn, _ in level:
        at = [(lateral, 0.0, forward), (0.0, 0.0, 0.0)]
        search, _ = searched(words, size, at, [turn, 0.0], [(0, "close_by", 1)], floor=FLOOR * 2)
        names = {term.name for term in search.terms if bool((term.find(search.problem.plan).margin < 0).any())}
        assert not names & {"close_by", "knees_free", "apart"}, (lateral, forward)
    assert len(level) == 8


def test_an_ottoman_leaves_room_for_the_knees_before_its_sofa():
    size = [(2.2, 0.8, 0.9), (0.6, 0.4, 0.6)]
    search, _ = searched(["multi_seat_sofa", "ottoman"], size, [(0, 0, -1.5), (0, 0, 0)], [0.0, 0.0])
    before = [slot for slot in slots_at(search.problem, 1, 0) if abs(slot[0]) < 1.1]
    assert min(before, key=lambda slot: slot[3])[1] - 0.45 - 0.3 == pytest.approx(0.5)


@pytest.mark.parametrize(("table", "drawn", "habit"), [(0.5, 0.0, 0.5), (0.5, 0.45, 0.0), (1.5, 0.0, 0.0)])
def test_a_pendant_hangs_over_a_table_that_is_near_the_middle_of_the_room(table, drawn, habit):
    size = [(1.2, 0.4, 0.7), (0.4, 0.6, 0.4)]
    search, state = searched(["coffee_table", "pendant_lamp"], size, [(0, 0, table), (0, 2.0, drawn)], [0.0, 0.0])
    assert out_of_habit(search.problem, 1, state.position, state.yaw) == habit


def test_a_pendant_is_no_longer_where_it_belongs_when_its_table_has_moved():
    size = [(1.2, 0.4, 0.7), (0.4, 0.6, 0.4)]
    search, state = searched(["coffee_table", "pendant_lamp"], size, [(0, 0, 1.0), (0, 2.0, 1.0)], [0.0, 0.0])
    state.position[0, 2] = 1.5
    rows = proposals(search.problem, state.position, state.yaw, np.ones(2, bool), 1)
    over, drawn = (rows[np.hypot(rows[:, 0], rows[:, 1] - z) < 0.01, 3].min() for z in (1.5, 1.0))
    assert (over, drawn) == (0.0, 0.5)


def test_of_two_pendants_at_a_small_table_neither_is_where_it_belongs():
    size = [(0.5, 0.5, 0.5), (0.4, 0.6, 0.4), (0.4, 0.6, 0.4)]
    words = ["side_table", "pendant_lamp", "pendant_lamp"]
    search, state = searched(words, size, [(0, 0, 0), (0, 2.0, 0), (0, 2.0, 0)], [0.0] * 3)
    assert [out_of_habit(search.problem, k, state.position, state.yaw) for k in (1, 2)] == [0.5, 0.5]


@pytest.mark.parametrize(("turn", "habit"), [(0.0, 0.0), (np.pi / 2, 0.5), (np.pi, 0.0)])
def test_a_coffee_table_is_wanted_along_its_sofa(turn, habit):
    size = [(2.2, 0.8, 0.9), (1.2, 0.4, 0.6)]
    search, state = searched(["multi_seat_sofa", "coffee_table"], size, [(0, 0, -1.5), (0, 0, -0.4)], [0.0, turn])
    assert out_of_habit(search.problem, 1, state.position, state.yaw) == habit


@pytest.mark.parametrize(("at", "goes"), [((0.0, -0.7), True), ((2.5, 2.5), False)])
def test_who_is_astray_is_left_where_it_is_and_met_there(at, goes):
    """A sofa whose table stands at the other end of a hall comes to the table, and does not take it through a wall."""
    words, size = ["multi_seat_sofa", "coffee_table"], [(2.0, 0.8, 0.9), (1.2, 0.4, 0.6)]
    hall = 2 * FLOOR
    search, state = searched(words, size, [(0, 0, -1.5), (at[0], 0, at[1])], [0.0, 0.0], floor=hall)
    every = np.ones(2, bool)
    assert (1 in search.group(0, every, state)) == goes
    rows = search._joining(state, every, 0)
    assert bool(len(rows)) != goes
    for x, z, yaw, _ in rows:
        away = np.array(at) - (x, z)
        assert np.hypot(*away) < 1.8
        assert away @ (np.sin(yaw), np.cos(yaw)) > 0.45 + 0.3  # before its front


def test_a_group_goes_as_one():
    words, size = ["double_bed", "nightstand"], [(1.6, 1.0, 2.0), (0.5, 0.5, 0.4)]
    search, state = searched(words, size, [(0, 0, -1.0), (1.1, 0, -1.8)], [0.0, 0.3], turned=[1])
    search.problem.turned[1] = False  # it was drawn askew
    row = np.array([[1.5, 0.0, -np.pi / 2, 0.0]])
    position, yaw = search.carried(state, 0, [0, 1], row)
    x, z = position[0, 1, [0, 2]] - row[0, :2]
    lateral = np.cos(-np.pi / 2) * x - np.sin(-np.pi / 2) * z
    assert lateral == pytest.approx(1.1, abs=0.1)
    assert yaw[0, 1] - yaw[0, 0] == pytest.approx(0.3)


@pytest.mark.parametrize(("away", "goes"), [(0.2, True), (0.6, False)])
def test_a_lamp_over_the_table_of_a_sofa_goes_with_the_sofa(away, goes):
    words = ["multi_seat_sofa", "coffee_table", "pendant_lamp"]
    size = [(2.2, 0.8, 0.9), (1.2, 0.4, 0.6), (0.4, 0.6, 0.4)]
    search, state = searched(words, size, [(0, 0, -1.5), (0, 0, -0.4), (away, 2.0, -0.4)], [0.0] * 3)
    assert (2 in search.group(0, np.ones(3, bool), state)) == goes


def test_a_lamp_leaves_the_one_beside_it_where_it_is():
    words, size = (
        ["dining_table", "coffee_table", *["pendant_lamp"] * 2],
        [(1.6, 0.75, 0.9), (1.0, 0.4, 0.6), *[(0.4, 0.8, 0.4)] * 2],
    )
    at = [(-1.5, 0, 0), (1.5, 0, 0), (1.4, 1.9, 0.1), (1.5, 1.9, 0)]
    search, state = searched(words, size, at, [0] * 4, [(2, "above", 0), (3, "above", 1)])
    every = np.ones(4, bool)
    assert search.group(2, every, state) == [2]
    after = search.moved(state, every, 2)
    assert after.position[2, ::2] == pytest.approx([-1.5, 0.0])
    assert after.position[3, ::2] == pytest.approx([1.5, 0.0])


def test_seats_stay_where_they_are_when_the_table_of_their_sofa_is_turned():
    words = ["multi_seat_sofa", "coffee_table", "armchair"]
    size = [(2.2, 0.8, 0.9), (1.2, 0.4, 0.6), (0.8, 0.8, 0.8)]
    places, turns = [(0, 0, -1.5), (0, 0, -0.4), (1.5, 0, -0.4)], [0.0, np.pi / 2, -np.pi / 2]
    search, state = searched(words, size, places, turns, [(2, "close_by", 1)])
    group = search.group(1, np.ones(3, bool), state)
    position, yaw = search.carried(state, 1, group, np.array([(0.2, -0.3, 0.0, 0.0)]))
    assert set(group) == {1, 2}
    np.testing.assert_allclose(position[0, 1:, ::2], [(0.2, -0.3), (1.7, -0.3)])
    np.testing.assert_allclose(yaw[0], [0.0, 0.0, -np.pi / 2])


def test_chairs_are_seated_together():
    words = ["dining_table", *["dining_chair"] * 4]
    drawn = [(0, 0, 0), (0.3, 0, 0.7), (0.35, 0, -0.7), (-0.5, 0, 0.6), (1.2, 0, -0.1)]
    search, state = searched(words, [(1.6, 0.75, 0.9), *[(0.45, 0.9, 0.5)] * 4], drawn, [0, np.pi, 0, np.pi, -1.2])
    every = np.ones(5, bool)
    before, after = (search.faults(one)[0] for one in (state, search.reseated(state, every, 0)))
    assert before > 2.0
    assert after < before - 1.9


def test_chairs_go_with_their_table_and_one_alone_by_itself(monkeypatch):
    words = ["dining_table", *["dining_chair"] * 4, "desk", "office_chair"]
    size = [(1.6, 0.75, 0.9), *[(0.45, 0.9, 0.5)] * 4, (1.2, 0.75, 0.6), (0.6, 1.0, 0.6)]
    chairs = [(0.3, 0, 0.7), (0.35, 0, -0.7), (-0.5, 0, 0.6), (1.2, 0, -0.1)]
    at = [(0, 0, 0), *chairs, (-1.8, 0, -1.6), (-1.8, 0, -0.9)]
    search, _ = searched(words, size, at, [0, np.pi, 0, np.pi, -1.2, 0, np.pi])
    moved, one = [], Search.moved
    monkeypatch.setattr(Search, "moved", lambda self, *of: moved.append(of[-1]) or one(self, *of))
    assert search.run().wrong == ()
    assert {0, 5, 6} <= {*moved}
    assert not {1, 2, 3, 4} & {*moved}


def test_chairs_are_seated_where_they_are_told_to_be():
    """Each stands in the other one's place, so that none gets to its own alone, nor without what hangs over it."""
    words, at = ["dining_table", *["dining_chair"] * 2, "pendant_lamp"], [(0, 0, -0.6), (0, 0, 0.6), (0, 2.0, -0.6)]
    size, told = [(0.8, 0.75, 0.8), *[(0.45, 0.9, 0.5)] * 2, (0.4, 0.6, 0.4)], [(1, "right", 0), (2, "left", 0)]
    search, state = searched(words, size, [(0, 0, 0), *at], [0, 0, np.pi, 0], [*told, (3, "above", 1)])
    after = search.reseated(state, np.ones(4, bool), 0)
    assert after.position[2, 2] < -0.4 < 0.4 < after.position[1, 2]
    np.testing.assert_allclose(after.position[3, ::2], after.position[1, ::2], atol=0.05)
    assert search.faults(state)[0] - search.faults(after)[0] > 2 * COST["relations"][0]


def test_a_bed_comes_beside_its_twin_with_the_nightstand_that_they_share_between():
    words, size = ["single_bed", "single_bed", "nightstand"], [(1.0, 0.9, 2.0), (1.0, 0.9, 2.0), (0.5, 0.5, 0.4)]
    at, none = np.array([(-1.2, 0, -0.98), (1.48, 0, 1.2), (-0.35, 0, -1.75)]), np.zeros(3, bool)
    problem = problem_of(
        words, np.array(size), at, np.array([0, -np.pi / 2, 0]), np.zeros((0, 3), int), floor_polygon=FLOOR,
        height=2.7, stated=(Stated("between", 2, (0, 1)),), fixed=none, rigid=none, turned=none,
    ).spread()  # fmt: skip
    search, state = Search(problem), State(problem.position, problem.yaw, np.zeros(3))
    ((stand, (position, yaw)),) = search._beside_twin(state, np.ones(3, bool), 1)
    assert stand == 2
    assert np.cos(yaw - problem.yaw[0]) == pytest.approx(1.0)
    assert position[:, 2, 0] == pytest.approx(position[:, :2, 0].mean(1))


def test_two_pieces_that_stand_in_each_others_place_are_put_right():
    words, size = ["wardrobe", "bookshelf"], [(2.4, 2.2, 0.6), (0.8, 2.0, 0.3)]
    search, state = searched(words, size, [(-1.2, 0, 1.7), (-1.2, 0, -1.8)], [np.pi, 0.0], [(0, "left", 1)])
    assert search.faults(state)[0] > 5
    assert search.run().wrong == ()


BED = (["double_bed", "nightstand", "nightstand", "table_lamp"],
       [(1.8, 1.0, 2.1), (0.5, 0.55, 0.45), (0.5, 0.55, 0.45), (0.3, 0.5, 0.3)])  # fmt: skip


def test_who_attends_a_bed_changes_sides_with_it():
    at = [(1.4, 0, 0.1), (2.2, 0, -1.1), (2.2, 0, 1.3), (2.2, 0.55, -1.1)]
    told = [(1, "left", 0), (2, "right", 0), (3, "standing_on", 1)]
    search, state = searched(*BED, at, [-np.pi / 2] * 4, told)
    mirrored = search._mirrored(state, 0, [0, 1, 2, 3])
    assert mirrored.position[:, 2] == pytest.approx([0.1, 1.3, -1.1, 1.3])
    assert mirrored.position[:, 0] == pytest.approx(state.position[:, 0])
    drawn = np.array(at) * (-1, 1, 1)  # at the other wall, which is liked better: left stays left
    search, _ = searched(*BED, drawn, [np.pi / 2] * 4, told)
    after = search.moved(State(state.position, state.yaw, np.array([2.0, 0, 0, 0])), np.ones(4, bool), 0)
    assert np.cos(after.yaw[0] + np.pi / 2) < 0.5
    assert after.position[1, 2] < after.position[0, 2] < after.position[2, 2]
    assert after.position[3, [0, 2]] == pytest.approx(after.position[1, [0, 2]], abs=0.01)


def test_one_alone_has_no_sides():
    search, state = searched(
        ["sofa", "coffee_table"], [(2.0, 0.8, 0.9), (1.0, 0.4, 0.6)], [(0, 0, -1), (0.05, 0, 0.4)], [0.0, 0.0]
    )
    assert search._mirrored(state, 0, [0]) is None
    assert search._mirrored(state, 0, [0, 1]) is None  # as good as in the middle


def test_what_stands_on_a_nightstand_comes_with_it_to_its_bed():
    at = [(0.0, 0, -0.9), (2.0, 0, 1.0), (-2.0, 0, 1.0), (2.0, 0.55, 1.0)]
    search, state = searched(*BED, at, np.zeros(4), [(3, "standing_on", 1)])
    there = np.array([True, False, False, True])
    after = expecting(search, state, there, 0)
    assert there.all()
    assert abs(after.position[1, 0]) == pytest.approx(1.2, abs=0.2)
    assert after.position[3, [0, 2]] == pytest.approx(after.position[1, [0, 2]], abs=0.01)


def test_an_armchair_is_expected_where_no_second_sofa_stands_and_goes_out_with_its_table():
    words, size = ["multi_seat_sofa", "coffee_table", "loveseat_sofa", "armchair"], [(2.2, 0.8, 0.9), (1.2, 0.4, 0.6)]
    size += [(1.6, 0.8, 0.9), (0.8, 0.8, 0.8)]
    at, told = [(0, 0, -1.5), (0, 0, -0.4), (4, 0, 3), (4, 0, -3)], [(3, "close_by", 1)]
    search, _ = searched(words, size, at, np.zeros(4), told, floor=2 * FLOOR)
    liked = min(slots_at(search.problem, 3, 1), key=lambda slot: slot[3])
    at[2] = (liked[0], 0, at[1][2] + liked[1])
    search, state = searched(words, size, at, [0.0, 0.0, liked[2], 0.0], told, floor=2 * FLOOR)
    after = expecting(search, state, np.array([True, True, True, False]), 1)
    assert float(search.problem.plan.at(after.position, after.yaw).apart(np.array([3]), np.array([2]))[0]) > -0.01
    assert np.hypot(*(after.position[3] - after.position[1])[::2]) < 2.0
    assert set(involved(search, [1])) == {0, 1, 2, 3}


def test_a_door_that_may_make_way_is_no_reason_to_begin_anew():
    none, door = np.zeros(1, bool), Opening("door", "door", 0, 0.75, 0.9, 2.0, 0.0)
    problem = problem_of(
        ["wardrobe"], np.array([(2.4, 2.2, 0.6)]), np.zeros((1, 3)), np.zeros(1), np.zeros((0, 3), int),
        floor_polygon=FLOOR * (0.5, 0.3), height=2.7, fixed=none, rigid=~none, turned=none, openings=(door,),
    )  # fmt: skip
    firm = Search(problem.spread(), tuple(term for term in TERMS if term.name in ("door_free", "on_floor")))
    found = firm.run()
    assert found.wrong == (0,)
    late = Search(problem.spread(), firm.terms, yields=frozenset({"door_free"}))
    sooner = late.run()
    assert sooner.wrong == ()
    assert sooner.cost > 1.0  # it is seen all the same
    assert late.faults(sooner.state)[0] == pytest.approx(sooner.cost)
    assert sooner.judged < found.judged


def test_what_is_fixed_or_turned_is_not_moved():
    words = ["double_bed", "nightstand", "wardrobe"]
    size, drawn = [(1.6, 1.0, 2.0), (0.5, 0.5, 0.4), (1.5, 2.2, 0.6)], [(0, 0, 0.3), (1.0, 0, 1.5), (0.5, 0, 0.2)]
    search, _ = searched(words, size, drawn, [0.7, 1.0, 1.5], fixed=[0], turned=[2])
    found = search.run()
    assert found.state.position[0].tolist() == [0, 0, 0.3]
    assert found.state.yaw[[0, 2]].tolist() == [0.7, 1.5]


def test_no_more_poses_are_judged_than_were_allowed():
    words = ["double_bed", *["wardrobe"] * 5]
    search, _ = searched(
        words, [(2.0, 1, 2.2), *[(1.8, 2.2, 0.6)] * 5], np.zeros((6, 3)), np.zeros(6), floor=0.6 * FLOOR
    )
    search.budget = 100
    found = search.run()
    assert found.judged < 100 + 150  # the move that was begun
    assert search.faults(found.state)[0] == pytest.approx(found.cost)
    more = Search(search.problem).run(0, found)
    assert (more.cost, more.judged) == (pytest.approx(found.cost), 0)  # it goes on from there


def test_more_poses_are_judged_in_a_hall():
    few, many = (searched(["chair"] * n, np.full((n, 3), 0.5), np.zeros((n, 3)), np.zeros(n))[0] for n in (8, 32))
    assert many.budget > 2 * few.budget


def test_a_lamp_that_is_told_the_impossible_stays_in_the_room():
    words = ["coffee_table", "pendant_lamp"]
    size, drawn = np.array([(1.0, 0.4, 0.6), (0.5, 0.9, 0.5)]), np.array([(0.0, 0, 0), (0.2, 0.2, 0.1)])
    told = np.array([(1, ID["shorter_than"], 0), (1, ID["close_by"], 0)])
    done = place_boxes(words, size, drawn, np.zeros(2), told, floor_polygon=FLOOR, height=2.7)
    assert done.position[:, 1].min() >= 0.0
    assert (done.position[:, 1] + done.size[:, 1]).max() <= 2.7 + 1e-6


def test_poses_that_run_into_others_are_not_among_the_first():
    words = ["double_bed", "wardrobe"]
    search, state = searched(words, [(1.8, 1.0, 2.1), (1.5, 2.2, 0.6)], [(0, 0, -0.9), (0.2, 0, -0.9)], [0.0, 0.0])
    every = np.ones(2, bool)
    rows = np.array([[0.2, -0.9, 0.0, 0.0], [0.3, -0.6, 0.0, 0.0], [-0.9, 1.7, np.pi, 0.5], [9.0, 9.0, 0.0, 0.0]])
    assert search._promising(state, every, 1, [1], rows, rows[:, 3])[0] == 2


def test_margins_of_many_poses_are_those_of_one_after_the_other():
    words = ["sofa", "armchair", "coffee_table", "plant"]
    luck = np.random.default_rng(1)
    told = [(0, "front", 1), (2, "close_by", 0), (0, "facing", 2), (0, "symmetrical_to", 1), (3, "bigger_than", 0)]
    size, position, yaw = luck.uniform(0.3, 2.0, (4, 3)), luck.normal(0, 1, (4, 3)), luck.uniform(-4, 4, 4)
    search, state = searched(words, size, position, yaw, told, turned=range(4))
    poses, turns = luck.normal(0, 1, (7, 3)), luck.uniform(-4, 4, 7)
    problem = search.problem
    found = search.margins_at(state, 0, poses, turns, problem.triplets)
    assert (found > 0).any()
    assert (found < 0).any()
    for k in range(7):
        places, headings = state.position.copy(), state.yaw.copy()
        places[0], headings[0] = poses[k], turns[k]
        alone = margins(
            Boxes(*(torch.from_numpy(of) for of in (search.problem.size, places, headings))),
            torch.from_numpy(problem.triplets), center=torch.from_numpy(problem.centre),
            fronts=torch.from_numpy(problem.fronts),
        )  # fmt: skip
        np.testing.assert_allclose(found[k], alone.numpy(), atol=1e-9)


def test_a_television_that_nothing_carries_hangs_at_a_wall():
    size = ((1.6, 0.9, 2.0), (1.2, 0.7, 0.1))
    search, _ = searched(("double_bed", "tv"), size, ((0.0, 0.0, -0.99), (1.0, 1.0, 0.3)), (0.0, 0.0))
    found = search.run()
    assert not found.wrong
    wall = np.abs(FLOOR).max(0) - np.abs(found.state.position[1, ::2])
    assert min(wall) < 0.1


def test_what_is_barely_as_it_shall_be_is_moved_where_nothing_is_wrong(monkeypatch):
    desk, chair = (1.6, 0.75, 0.7), (0.5, 0.9, 0.5)
    search, state = searched(("desk", "chair"), (desk, chair), ((0.0, 0.0, -1.65), (0.4, 0.0, -1.1)), (0.0, np.pi))
    monkeypatch.setattr(search, "_first", lambda: (state, *search.faults(state)))
    assert not search.faults(state)[1]
    assert search.faults(state, UNEASY)[1]
    found = search.run()
    assert not found.wrong
    assert found.cost < search.faults(state)[0] - 0.2
    assert abs(found.state.position[1, 0] - found.state.position[0, 0]) < 0.05


def test_a_table_goes_with_its_chairs_to_where_these_have_more_room_where_nothing_is_wrong(monkeypatch):
    """Drawn 0.33 m from the wall behind two of its chairs, with 1.13 m behind those opposite."""
    table, chair, floor = (1.6, 0.75, 0.8), (0.45, 0.9, 0.5), FLOOR * (0.8, 0.85)
    drawn = ((0.0, 0.0, -0.4), (-0.4, 0.0, -1.12), (0.4, 0.0, -1.12), (-0.4, 0.0, 0.32), (0.4, 0.0, 0.32))
    words, yaw = ("dining_table", *["dining_chair"] * 4), (0.0, 0.0, 0.0, np.pi, np.pi)
    search, state = searched(words, (table, *[chair] * 4), drawn, yaw, floor=floor)
    search = Search(search.problem, tuple(term for term in TERMS if term.name != "ends_used"))
    monkeypatch.setattr(search, "_first", lambda: (state, *search.faults(state)))
    assert not search.faults(state)[1]
    found = search.run()
    assert not found.wrong
    behind = found.state.position[:, 2]
    assert 1.45 + behind[1:3].min() > 0.58
    assert 1.45 - behind[3:].max() > 0.58
    assert np.allclose(behind[1:] - behind[0], [-0.72, -0.72, 0.72, 0.72])  # as they sat


def test_a_bed_without_room_beside_it_tells_who_is_there():
    plan = plan_of(
        Boxes(torch.tensor([(1.6, 0.9, 2.0), (1.0, 0.9, 0.5)]), torch.tensor([(-1.68, 0.0, -0.95), (-0.1, 0.0, -0.5)]),
              torch.tensor([0.0, -np.pi / 2])), ["double_bed", "dresser"], FLOOR,
    )  # fmt: skip
    seen = next(term for term in TERMS if term.name == "bed_side_free").find(plan)
    assert seen.other.tolist() == [1]


def test_what_stands_at_a_leafs_edge_is_moved_a_hand_away_from_it():
    door = Opening("door", "door", 3, 0.3, 0.9, 2.0)  # the left wall, z from 0.8 to 1.7; the leaf reaches x = -1.6
    done = place_boxes(
        ["sideboard"], np.array([(1.2, 0.9, 0.4)]), np.array([(-1.0, 0.0, 1.78)]), np.array([np.pi]), np.zeros((0, 3)),
        floor_polygon=FLOOR, height=2.7, openings=(door,),
    )  # fmt: skip
    assert done.position[0, 0] - done.size[0, 0] / 2 > -1.5
    assert done.position[0, 0] < 0.5  # no further than it must


def test_what_stands_in_the_way_in_is_moved_out_of_it():
    words, door = ["double_bed", "wardrobe", "plant", "dresser"], Opening("door", "door", 1, 0.2, 0.9, 2.0)
    size = np.array([(1.8, 1.0, 2.1), (1.8, 2.2, 0.6), (0.6, 1.2, 0.6), (1.2, 0.8, 0.45)])
    position = np.array([(-0.4, 0.0, -0.93), (-0.6, 0.0, 1.7), (1.3, 0.0, -0.6), (1.25, 0.0, 0.9)])
    floor, none = np.array([(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)]), np.zeros((0, 3), int)

    def told(boxes):
        return {fault.rule for fault in unreached(plan_of(boxes, words, floor, (door,)))}

    drawn = Boxes(size, position, np.array([0.0, np.pi, 0.0, np.pi]))
    assert told(drawn) == {"way_in"}
    done = place_boxes(words, size, position, drawn.yaw, none, floor_polygon=floor, height=2.7, openings=(door,))
    assert told(done) == set()
