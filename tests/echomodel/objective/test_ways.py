"""Ways that are too narrow, and who is astray: for each a room that breaks it just so, and one that does not."""

import numpy as np
import pytest

from echomodel.objective import access, company, crowding, lounging, seating
from echomodel.objective.plan import kinds_of, plan_of
from echomodel.rules.geometry import Spread
from echomodel.vocabulary import vocabulary

HALF = np.pi / 2
FLOOR = np.array([(-2.5, -2.0), (2.5, -2.0), (2.5, 2.0), (-2.5, 2.0)])


def seen(term, things):
    """What a term finds in a room of (category, (w, h, d), (x, z), yaw): {number of the box: margin}, and all of it."""
    words, size, at, yaw = zip(*things, strict=True)
    spread = Spread(np.array(size), np.insert(np.array(at, float), 1, 0.0, 1), np.array(yaw, float))
    found = term(plan_of(spread, words, FLOOR))
    return dict(zip(found.who.tolist(), found.margin.tolist(), strict=True)), found


def told_near(*pairs):
    return np.array([(a, vocabulary().predicate_id("close_by"), b) for a, b in pairs])


@pytest.mark.parametrize(("word", "least"), [("multi_seat_sofa", 0.2), ("dining_table", 0.1)])
@pytest.mark.parametrize("spare", [-0.05, 0.05])
def test_storage_keeps_off_sofas_and_tables_but_beside_them(word, least, spare):
    piece = (word, (2.0, 0.8, 0.9), (0.0, 0.0), 0.0)
    shelf = ("bookshelf", (0.8, 1.8, 0.3), (1.0 + least + spare + 0.15, 0.0), -HALF)
    assert list(seen(crowding.groups_apart, [piece, shelf])[0].values()) == [pytest.approx(spare)]
    beside = ("bookshelf", (0.8, 1.8, 0.3), (1.0 + least + spare + 0.4, -0.3), 0.0)
    assert seen(crowding.groups_apart, [piece, beside])[0] == {}


@pytest.mark.parametrize("word", ["multi_seat_sofa", "armchair"])
@pytest.mark.parametrize("gap", [0.0, 0.3])
def test_a_plant_may_stand_beside_a_sofa_better_with_room_between(word, gap):
    plant = ("plant", (0.4, 1.2, 0.4), (1.2 + gap, 0.0), 0.0)
    assert seen(access.plant_aside, [(word, (2.0, 0.8, 0.9), (0.0, 0.0), 0.0), plant])[0] == {1: pytest.approx(gap)}


@pytest.mark.parametrize(("aside", "margin"), [(0.1, 0.07), (0.2, -0.03)])
def test_chairs_do_not_crowd_at_one_end_of_their_table(aside, margin):
    table = ("dining_table", (1.7, 0.75, 0.8), (0.0, 0.0), 0.0)
    chairs = [("dining_chair", (0.45, 0.9, 0.5), (x + aside, 0.65), np.pi) for x in (-0.3, 0.3)]
    found, rows = seen(seating.bench_fits, [table, *chairs])
    assert min(found.values()) == pytest.approx(margin)
    assert 3 in rows.words.tolist()
    more = [("dining_chair", (0.45, 0.9, 0.5), (x, -0.65), 0.0) for x in (-0.6, 0.0, 0.6)]  # opposite to whom they sit
    others = [("dining_chair", (0.45, 0.9, 0.5), (x, 0.65), np.pi) for x in (0.0, 0.6)]
    assert 3 not in seen(seating.bench_fits, [table, *more, *others])[1].words.tolist()


def test_a_stool_told_to_be_at_a_coffee_table_goes_with_its_sofa():
    words = ["sofa", "coffee_table", "stool", "dining_table"]
    stool = kinds_of(words, told_near((2, 1)))[2]
    assert stool.stands == "foot"
    assert "sofa" in stool.belongs_to
    assert kinds_of(words, told_near((2, 3)))[2].stands == kinds_of(words, np.zeros((0, 3), int))[2].stands == "at"


@pytest.mark.parametrize(("aside", "margin"), [(0.3, 0.064), (0.4, -0.036)])
def test_who_works_alone_at_a_desk_sits_before_its_middle(aside, margin):
    desk, chair = ("desk", (1.4, 0.75, 0.7), (0.0, -1.6), 0.0), ("office_chair", (0.6, 1.0, 0.6), (aside, -1.0), np.pi)
    assert seen(seating.seat_before_desk, [desk, chair])[0] == {1: pytest.approx(margin)}


@pytest.mark.parametrize(
    ("word", "end"), [("bookshelf", 0.0), ("tv_stand", 0.0), ("bookshelf", 0.3), ("nightstand", 0.0)]
)
def test_an_armchair_looks_at_no_end_of_storage(word, end):
    chair = ("armchair", (0.8, 0.8, 0.8), (1.9, 1.5), -HALF)
    storage = (word, (1.8, 0.5, 0.4), (-end, 1.78), np.pi)  # its end is 0.6 m before the armchair, or 0.9
    found, rows = seen(lounging.seat_room, [chair, storage])
    told = (found.get(0, 1.0) < 0, 1 in rows.words.tolist())
    assert told == (word != "nightstand" and not end,) * 2


@pytest.mark.parametrize(("at", "behind"), [((0.0, -1.5), True), ((-1.7, 0.0), False)])
def test_a_second_sofa_stands_not_behind_the_first(at, behind):
    sofa, low = (
        ("multi_seat_sofa", (2.2, 0.85, 0.9), (0.0, 0.0), 0.0),
        ("coffee_table", (1.1, 0.4, 0.6), (0.0, 1.1), 0.0),
    )
    other = ("loveseat_sofa", (1.5, 0.85, 0.9), at, 0.0 if behind else HALF)
    rows = seen(company.at_its_side, [sofa, low, other])[1]
    told = [
        (m < 0, w)
        for k, m, w in zip(rows.who.tolist(), rows.margin.tolist(), rows.words.tolist(), strict=True)
        if k == 2
    ]
    assert ((True, 1) in told) == behind


@pytest.mark.parametrize(("back", "margin"), [(-0.6, -0.15), (-0.3, 0.15)])
@pytest.mark.parametrize(("word", "wide"), [("armchair", 0.9), ("multi_seat_sofa", 2.2)])
def test_a_side_table_is_no_use_behind_its_seat(back, margin, word, wide):
    seat = (word, (wide, 0.85, 1.0), (0.0, 0.0), 0.0)
    table = ("side_table", (0.4, 0.55, 0.4), (wide / 2 + 0.4, back), 0.0)
    lamp = ("floor_lamp", (0.4, 1.6, 0.4), (wide / 2 + 0.4, back), 0.0)
    found, rows = seen(company.at_its_side, [seat, table])
    assert found[1] == pytest.approx(margin)
    assert rows.words.tolist() == [1]
    assert seen(company.at_its_side, [seat, lamp])[0][1] > 0
