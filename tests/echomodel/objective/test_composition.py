"""Terms of composition: for each a room that breaks it just so, and one that does not."""

import numpy as np
import pytest
import torch

from echomodel.boxes import Boxes
from echomodel.objective import access, composition, crowding, lounging, seating, sight
from echomodel.objective.copies import copies_of
from echomodel.objective.plan import plan_of

HALF = np.pi / 2


def seen(term, things, floor=(5.0, 4.0)):
    """What a term finds in a room of (category, (w, h, d), (x, z), yaw): {number of the box: margin}, and the plan."""
    x, z = np.array(floor) / 2
    boxes = Boxes(
        torch.tensor([size for _, size, _, _ in things], dtype=torch.float64),
        torch.tensor([(at[0], 0.0, at[1]) for _, _, at, _ in things], dtype=torch.float64, requires_grad=True),
        torch.tensor([yaw for _, _, _, yaw in things], dtype=torch.float64),
    )
    outline = np.array([(-x, -z), (x, -z), (x, z), (-x, z)])
    found = term(plan_of(boxes, [word for word, *_ in things], outline))
    return dict(zip(found.who.tolist(), found.margin.tolist(), strict=True)), found, boxes


def row_of(count, width, pitch):
    """A table 1.6 m long with chairs on one side, their middles a pitch apart."""
    table = [("dining_table", (1.6, 0.75, 0.9), (0.0, 0.0), 0.0)]
    places = (np.arange(count) - (count - 1) / 2) * pitch
    return table + [("dining_chair", (width, 0.9, 0.5), (x, 0.6), np.pi) for x in places]


def test_every_seat_has_room_for_the_elbows():
    assert seen(seating.elbow_room, row_of(2, 0.45, 0.6))[0][0] == pytest.approx(0.8 - 0.6)
    margin, found, _ = seen(seating.elbow_room, row_of(3, 0.45, 0.53))
    assert margin == {0: pytest.approx(1.6 / 3 - 0.6)}
    assert found.measure.tolist() == [pytest.approx(1.6 / 3)]


@pytest.mark.parametrize(("pitch", "margin"), [(0.62, -0.03), (0.7, 0.05)])
def test_chairs_stand_no_fence(pitch, margin):
    row = row_of(2, 0.6, pitch)
    assert list(seen(crowding.seats_apart, row)[0].values()) == [pytest.approx(margin)]
    turned = [(word, size, (at[1], -at[0]), yaw + HALF) for word, size, at, yaw in row]
    assert list(seen(crowding.seats_apart, turned)[0].values()) == [pytest.approx(margin)]


@pytest.mark.parametrize(("aside", "margin"), [(0.18, -0.04), (0.0, 0.14)])
def test_chairs_do_not_touch_across_the_corner_of_their_table(aside, margin):
    chairs = seated(((0.4, 0.65), np.pi), ((0.85, aside), -HALF))
    assert list(seen(crowding.seats_apart, chairs)[0].values()) == [pytest.approx(margin)]


@pytest.mark.parametrize(("gap", "margin"), [(1.4, -0.1), (1.6, 0.1)])
def test_an_armchair_of_a_group_looks_at_no_chair_of_another(gap, margin):
    sofa = ("multi_seat_sofa", (2.0, 0.8, 0.9), (0.0, 0.0), 0.0)
    armchair = ("armchair", (0.8, 0.8, 0.8), (1.8, 0.8), HALF)
    back = ("dining_chair", (0.5, 0.9, 0.5), (2.2 + gap + 0.25, 0.8), HALF)
    table = ("dining_table", (0.8, 0.75, 1.6), (2.2 + gap + 0.85, 0.8), 0.0)
    found, seen_of, _ = seen(lounging.sofa_ahead, [sofa, armchair, table, back], (9.0, 4.0))
    assert found[1] == pytest.approx(margin)
    assert dict(zip(seen_of.who.tolist(), seen_of.other.tolist(), strict=True))[1] == 3
    assert seen_of.measure.tolist()[seen_of.who.tolist().index(1)] == pytest.approx(gap)
    alone, *_ = seen(lounging.sofa_ahead, [armchair, table, back], (9.0, 4.0))
    assert alone == {0: pytest.approx(margin)}  # one of no group, too, but it may look at a table, and a face
    assert seen(lounging.sofa_ahead, [armchair, table], (9.0, 4.0))[0] == {}
    assert seen(lounging.sofa_ahead, [armchair, table, (*back[:3], -HALF)], (9.0, 4.0))[0] == {}


@pytest.mark.parametrize(("gap", "aside", "margin"), [(0.5, 0.0, -0.1), (0.7, 0.0, 0.1), (0.5, 1.5, 0.1)])
def test_one_passes_between_a_sofa_and_the_table_behind_it(gap, aside, margin):
    sofa = ("multi_seat_sofa", (2.0, 0.8, 0.9), (0.0, 0.0), 0.0)
    table = ("dining_table", (1.2, 0.75, 0.8), (aside, -0.45 - gap - 0.4), 0.0)
    _, found, _ = seen(lounging.sofa_ahead, [sofa, table])
    assert found.margin.tolist()[-1] == pytest.approx(margin if not aside else 0.2 - (1.0 + 0.6 - aside))
    assert found.words.tolist()[-1] == 1
    desk = ("desk", (1.2, 0.75, 0.8), (aside, -0.45 - gap - 0.4), 0.0)  # which may stand there
    assert min(seen(lounging.sofa_ahead, [sofa, desk])[0].values(), default=1.0) >= 0


@pytest.mark.parametrize(("gap", "margin"), [(0.3, -0.05), (0.4, 0.05)])
def test_a_sofa_keeps_off_the_side_of_a_bed(gap, margin):
    bed = ("double_bed", (1.8, 0.5, 2.0), (0.0, 0.0), 0.0)
    sofa = ("multi_seat_sofa", (2.0, 0.8, 0.9), (0.9 + gap + 1.0, 0.0), 0.0)
    assert list(seen(crowding.groups_apart, [bed, sofa])[0].values()) == [pytest.approx(margin)]


@pytest.mark.parametrize(("gap", "margin"), [(0.1, -0.1), (0.25, 0.05)])
def test_a_wardrobe_keeps_off_the_side_of_a_bed(gap, margin):
    bed = ("kids_bed", (1.2, 0.9, 2.0), (0.0, 0.0), 0.0)
    wardrobe = ("wardrobe", (1.6, 2.2, 0.6), (0.6 + gap + 0.3, 0.3), HALF)
    assert list(seen(crowding.groups_apart, [bed, wardrobe])[0].values()) == [pytest.approx(margin)]
    nightstands = [("nightstand", (0.4, 0.5, 0.4), (side, -0.8), 0.0) for side in (-0.82, 0.82)]
    other = ("kids_bed", (1.2, 0.9, 2.0), (-1.65, 0.0), 0.0)  # whose bed shares one of them
    assert min(seen(crowding.groups_apart, [bed, *nightstands, other])[0].values()) > 0


@pytest.mark.parametrize(
    ("beside", "margin"),
    [("side_table", 0.4), ("cabinet", 0.4), ("floor_lamp", -0.24), ("single_bed", -0.24), ("loveseat_sofa", -0.24),
     ("coffee_table", -0.24)],
)  # fmt: skip
def test_lamps_seats_beds_and_low_tables_make_no_nook_for_a_plant(beside, margin):
    plant = ("plant", (0.4, 1.0, 0.4), (0.0, -1.8), 0.0)
    found, *_ = seen(composition.plant_in_nook, [plant, (beside, (0.4, 1.2, 0.4), (0.6, -1.8), 0.0)], (4.4, 4.0))
    assert found == {0: pytest.approx(margin, abs=1e-3)}


@pytest.mark.parametrize(
    ("behind", "away", "margin"), [(0.1, 4.7, 0.1), (0.1, 4.9, -0.1), (0.8, 4.7, 0.1), (0.8, 4.9, -0.1)]
)
def test_a_sofa_is_near_enough_to_its_screen_at_a_wall_as_where_it_stands_free(behind, away, margin):
    sofa = ("multi_seat_sofa", (2.0, 0.8, 0.9), (0.0, behind + 0.45 - 3.5), 0.0)
    stand = ("tv_stand", (1.8, 0.5, 0.4), (0.0, behind + 0.45 + away - 3.5), np.pi)
    assert seen(sight.screen_in_view, [sofa, stand], (5.0, 7.0))[0] == {1: pytest.approx(margin)}


def test_seats_at_desks_and_single_chairs_need_no_elbow_room():
    assert seen(seating.elbow_room, row_of(1, 0.6, 1.0))[0] == {}
    desk = [("desk", (1.0, 0.75, 0.6), (0.0, 0.0), 0.0), *row_of(2, 0.6, 0.6)[1:]]
    assert seen(seating.elbow_room, desk)[0] == {}


@pytest.mark.parametrize(
    ("gap", "aside", "margin"), [(0.5, 0.0, -0.05), (0.6, 0.0, 0.05), (0.5, 1.4, None), (0.5, 1.6, None)]
)
def test_one_stands_before_an_open_wardrobe(gap, aside, margin):
    bed = ("double_bed", (1.8, 0.5, 2.0), (0.0, 0.0), 0.0)
    wardrobe = ("wardrobe", (1.6, 2.2, 0.6), (aside, 1.0 + gap + 0.3), np.pi)
    found, *_ = seen(composition.wardrobe_opens, [bed, wardrobe])
    # beside the bed's foot only 0.3 or 0.1 m of its front are faced
    expected = max(0.1 * 1.6 - (0.9 + 0.8 - aside), -0.05) if aside else margin
    assert found == {1: pytest.approx(expected)}


@pytest.mark.parametrize(("gap", "margin"), [(0.4, -0.15), (0.7, 0.15)])
def test_no_table_stands_before_storage(gap, margin):
    table = ("dining_table", (1.6, 0.75, 0.9), (0.0, 0.2 + gap + 0.45), 0.0)
    found, seen_of, _ = seen(composition.wardrobe_opens, [("bookshelf", (1.2, 2.0, 0.4), (0.0, 0.0), 0.0), table])
    assert found == {0: pytest.approx(margin)}
    assert seen_of.other.tolist() == [1]


@pytest.mark.parametrize(("gap", "margin"), [(0.3, -0.25), (0.6, 0.05)])
def test_a_bench_at_the_foot_of_a_bed_is_not_before_a_wardrobe(gap, margin):
    bed, wardrobe = ("double_bed", (1.8, 0.5, 2.0), (0.0, 0.0), 0.0), ("wardrobe", (1.6, 2.2, 0.6), (0.0, 2.2), np.pi)
    bench = ("bench", (1.2, 0.45, 0.1), (0.0, 1.85 - gap), 0.0)
    assert seen(composition.wardrobe_opens, [bed, wardrobe, bench])[0][1] == pytest.approx(margin)


def test_a_bed_behind_a_wardrobe_is_not_before_it():
    bed = ("double_bed", (1.8, 0.5, 2.0), (0.0, 0.0), 0.0)
    assert seen(composition.wardrobe_opens, [bed, ("wardrobe", (1.6, 2.2, 0.6), (0.0, 1.5), 0.0)])[0][1] > 0


def test_the_floor_is_as_far_from_pieces_that_stand_square_as_from_all_others():
    rng = np.random.default_rng(5)
    boxes = Boxes(rng.uniform(0.4, 1.6, (6, 3)), rng.uniform(-3, 3, (6, 3)), np.pi / 2 * rng.integers(0, 4, 6))
    plan = plan_of(boxes, ["bookshelf"] * 6, np.array([(-4.0, -3.0), (4.0, -3.0), (4.0, 3.0), (-4.0, 3.0)]))
    who, points = np.arange(6).reshape(2, 3), composition.floor_points(plan)[0][2]
    away = abs(points - boxes.position[who][:, :, None, ::2])
    turned = (np.round(boxes.yaw / (np.pi / 2)) % 2 == 1)[who]
    half = np.where(turned[..., None], boxes.size[who][..., ::-2], boxes.size[who][..., ::2]) / 2
    slow = (np.maximum(away - half[:, :, None], 0) ** 2).sum(-1)
    np.testing.assert_allclose(composition._squares(plan, who, points), slow, atol=1e-9)
    askew = plan.at(plan.position, plan.yaw + 1e-7)
    np.testing.assert_allclose(composition._squares(askew, who, points), slow, atol=1e-5)


def test_furniture_huddled_at_one_end_leaves_the_floor_unserved():
    one = np.array([(-2.9, -1.7), (-1.5, -1.6), (-2.8, 0.0), (-2.9, 1.7), (-1.5, 1.6), (-1.4, 0.2)])
    other = one * [(1, 1), (-1, 1), (1, 1), (1, 1), (-1, 1), (-1, 1)]  # half of them at the other end

    def room(places):
        return [("bookshelf", (1.3, 2.0, 0.9), tuple(place), 0.0) for place in places]

    spread, _, _ = seen(composition.floor_served, room(other), (7.0, 4.0))
    huddled, found, boxes = seen(composition.floor_served, room(one), (7.0, 4.0))
    assert min(spread.values()) > 0
    assert max(huddled.values()) < 0
    assert 30 < float(found.measure.detach()) < 60  # percent
    found.margin.sum().backward()
    assert float(boxes.position.grad[:, 0].max()) > 0  # drawn into the bare half


def test_a_small_room_has_no_circle_so_bare_as_a_hall_may():
    assert composition.bare_limit(16.0, 4) == pytest.approx(0.6656 * 2)
    assert composition.bare_limit(36.0, 9) == pytest.approx(0.8976 * 2)
    assert composition.bare_limit(100.0, 25) == pytest.approx(1.0 * 2)


def test_an_emptier_room_may_leave_more_of_its_floor():
    one = torch.ones(1, dtype=torch.float64)
    assert composition.served_limit(8.0, one, one) == pytest.approx(np.exp(0.8 - 2 * 4 / 8))
    assert composition.served_limit(4.0, one, one) == pytest.approx(np.exp(0.8 - 2))
    assert composition.served_limit(100.0, one, one) == 1.0


@pytest.mark.parametrize(
    ("at", "margin", "measure"),
    [((0.0, 0.0), 1.7 - 10**0.5, 17.5), ((-2.0, 1.0), 1.7 - 3**0.5, 10.5), ((-2.2, 1.2), 1.7 - 1.8**0.5, 9.1)],
)
def test_no_corner_of_a_hall_is_bare(at, margin, measure):
    corners = [("bookshelf", (1.0, 2.0, 1.0), place, 0.0) for place in ((-3.5, -2.5), (3.5, -2.5), (3.5, 2.5))]
    corners += [("bookshelf", (1.0, 2.0, 1.0), (2.5, -2.5), 0.0)]
    room = [("bookshelf", (1.0, 2.0, 1.0), at, HALF), *corners, ("carpet", (2.0, 0.02, 2.0), (-3.0, 2.0), 0.0)]
    found, rows, boxes = seen(composition.corners_used, room, (8.0, 6.0))
    assert found == {0: pytest.approx(margin)}  # of the one corner without a shelf; a rug fills none
    assert rows.measure.tolist() == [pytest.approx(measure)]  # square metres
    rows.margin.sum().backward()
    assert float(boxes.position.grad[0, 0]) <= 0 <= float(boxes.position.grad[0, 2])  # drawn into the corner
    assert float(abs(boxes.position.grad[0]).max()) > 0.5
    units = [("base_unit", (0.6, 0.9, 0.6), (x, -1.7), 0.0) for x in np.arange(-2.0, 2.0, 0.6)]
    for few in (room[:4], row_of(4, 0.4, 0.45), units):  # so few, chairs of a table and units of a row fill no room
        assert seen(composition.corners_used, few, (8.0, 6.0))[0] == {}


@pytest.mark.parametrize(("wide", "margin"), [(3.0, -0.08), (4.6, 0.072)])
def test_a_hall_holds_enough_for_its_floor(wide, margin):
    room = [("bookshelf", (wide, 2.0, 1.0), (x, 0.0), 0.0) for x in (-1.0, 1.0)]
    carpet = ("carpet", (3.0, 0.02, 3.0), (0.0, 0.0), 0.0)
    found, rows, _ = seen(
        composition.floor_filled, [("desk", (1.5, 0.75, 1.0), (0.0, 2.0), 0.0), *room, carpet], (7.0, 6.0)
    )
    assert found == {1: pytest.approx((4 * (wide + 1) + 5) / 42 - 0.58)}
    assert margin == pytest.approx(found[1], abs=0.02)
    assert rows.measure.tolist() == [pytest.approx(100 * (0.58 + found[1]))]
    assert seen(composition.floor_filled, room[:1], (5.0, 4.0))[0] == {}  # which may be sparse


def test_a_corner_behind_a_wall_and_one_that_points_into_the_room_are_none():
    outline = np.array([(-4.0, -3.0), (4.0, -3.0), (4.0, 0.0), (0.0, 0.0), (0.0, 3.0), (-4.0, 3.0)])
    places = ((-3.5, -1.5), (-3.5, -2.5), (-0.5, 2.5), (-3.5, 2.5), (3.5, -0.5), (3.5, -2.5))
    at = np.array([(x, 0.0, z) for x, z in places])
    boxes = Boxes(np.full((6, 3), 1.0), at, np.zeros(6))
    for turned in (outline, outline[::-1]):  # all five corners have a shelf
        found = composition.corners_used(plan_of(boxes, ["bookshelf"] * 6, turned))
        assert found.margin.tolist() == [pytest.approx(1.7 - 1e-3)]
        without = plan_of(Boxes(boxes.size[:5], at[:5], np.zeros(5)), ["bookshelf"] * 5, turned)
        assert composition.corners_used(without).margin.tolist() == [pytest.approx(1.7 - 6**0.5)]  # 7 m by 2 m


def bare_in_corners(size, position, low, high):
    """Side of a square of the largest bare rectangle in a corner less a way, one after the other; yaws of none."""
    most = 0.0
    for side in ((0, 0), (0, 1), (1, 0), (1, 1)):
        away = np.where(side, high - position, position - low)
        near = [np.maximum(of - half / 2, 0.0) for of, half in zip(away, size, strict=True)]
        for end in [*(of[0] for of in near), high[0] - low[0]]:
            deep = min([*(of[1] for of in near if of[0] < end - 1e-6), high[1] - low[1]])
            most = max(most, max(end - 1.0, 0.0) * max(deep - 1.0, 0.0))
    return most**0.5


def test_the_largest_bare_rectangle_in_a_corner_is_found_in_rooms_and_in_copies_of_them():
    rng, half = np.random.default_rng(3), np.array([4.0, 3.0])
    for count in rng.integers(5, 12, 40).tolist():
        size = np.round(rng.uniform(0.4, 1.6, (count, 3)), 1)  # so that ends meet
        at = np.round(rng.uniform(-0.8, 0.8, (3, count, 3)) * [4.0, 0.0, 3.0], 1)
        at[1:, 2:] = at[0, 2:]  # copies differ by two
        floor = np.array([(-4.0, -3.0), (4.0, -3.0), (4.0, 3.0), (-4.0, 3.0)])
        plan = plan_of(Boxes(size, at[0], np.zeros(count)), ["bookshelf"] * count, floor)
        copies = copies_of(plan, at, np.zeros((3, count)), np.arange(count) < 2)
        slow = [1.7 - max(bare_in_corners(size[:, ::2], p[:, ::2], -half, half), 1e-3) for p in at]
        assert composition.corners_used(copies).margin.tolist() == pytest.approx(slow)
        assert composition.corners_used(plan).margin.tolist() == pytest.approx(slow[:1])


@pytest.mark.parametrize(("middle", "margin"), [(-2.0, -0.205), (-0.2, 0.02)])
def test_no_end_of_a_hall_is_bare(middle, margin):
    group = [("sofa", (2.8, 0.85, 0.95), (middle, -1.6), 0.0), ("coffee_table", (1.2, 0.4, 0.6), (middle, -0.5), 0.0)]
    stand = ("tv_stand", (1.6, 0.5, 0.4), (middle, 2.0), np.pi)
    plants = [("plant", (0.7, 1.2, 0.7), (x, 2.0), 0.0) for x in (-3.6, 3.6)]  # no plant fills an end
    found, rows, boxes = seen(composition.ends_used, [*group, stand, *plants], (8.0, 5.0))
    assert found == {0: pytest.approx(margin)}  # from the sofa's end to the wall at the right
    assert rows.measure.tolist() == [pytest.approx(100 * (0.37 - margin))]
    rows.margin.sum().backward()
    assert float(boxes.position.grad[0, 0]) == pytest.approx(1 / 8)
    square = seen(composition.ends_used, [*group, stand, *plants], (8.0, 8.0))[0]  # has no longer extent
    assert square == {0: pytest.approx(margin + 0.08)}
    assert seen(composition.ends_used, group, (8.0, 5.0))[0] == {}  # so few fill no hall
    table = ("dining_table", (1.2, 0.75, 0.9), (-0.5, 0.0), 0.0)  # 1.5 m of 3.2 m are no bare end
    assert seen(composition.ends_used, [table, *plants, *plants], (3.2, 2.8))[0] == {
        0: pytest.approx((1.6 - 1.5) / 3.2)
    }


@pytest.mark.parametrize(("right", "margin"), [(3.0, -0.0625), (2.0, 0.0625)])
def test_no_strip_between_two_islands_is_bare(right, margin):
    group = [("sofa", (2.0, 0.85, 0.95), (-2.0, -1.6), 0.0), ("coffee_table", (1.2, 0.4, 0.6), (-2.0, -0.5), 0.0)]
    stand, shelf = ("tv_stand", (1.6, 0.5, 0.4), (-2.0, 2.0), np.pi), ("bookshelf", (0.6, 2.0, 0.8), (right, 0.0), 0.0)
    room = [*group, stand, shelf, ("plant", (0.7, 1.2, 0.7), (0.5, 0.0), 0.0)]  # which fills none either
    assert seen(composition.ends_used, room, (8.0, 5.0))[0] == {0: pytest.approx(margin)}


@pytest.mark.parametrize(("aside", "margin"), [(0.05, 0.05), (0.2, -0.1)])
def test_a_bench_alone_at_its_side_lies_before_the_middle(aside, margin):
    bench = ("bench", (1.2, 0.45, 0.4), (aside, 0.75), np.pi)
    assert seen(seating.bench_fits, [*seated(), bench])[0] == {1: pytest.approx(margin)}


@pytest.mark.parametrize(("gap", "margin"), [(0.3, -0.02), (0.6, 0.05)])
def test_no_armchair_stands_before_the_end_of_a_screen(gap, margin):
    stand = ("tv_stand", (1.6, 0.5, 0.4), (0.0, -1.8), 0.0)
    armchair = ("armchair", (0.8, 0.8, 0.8), (1.1, -1.6 + gap + 0.4), -HALF)  # before a sixteenth of it
    assert seen(composition.wardrobe_opens, [stand, armchair])[0] == {0: pytest.approx(margin)}
    shelf = ("bookshelf", (1.6, 0.9, 0.4), (0.0, -1.8), 0.0)
    assert seen(composition.wardrobe_opens, [shelf, armchair])[0][0] > 0


def test_no_desk_goes_without_a_chair_while_another_has_two():
    desks = [("desk", (1.2, 0.75, 0.6), (-1.5, 0.0), 0.0), ("desk", (1.2, 0.75, 0.6), (1.5, 0.0), 0.0)]
    chairs = [("office_chair", (0.5, 0.9, 0.5), at, np.pi) for at in ((-1.8, 0.6), (-1.2, 0.6))]
    margin, found, _ = seen(composition.each_served, [*desks, *chairs])
    assert margin == {1: -1.0}
    assert found.other.tolist() == [0]
    shared = [chairs[0], ("office_chair", (0.5, 0.9, 0.5), (1.5, 0.6), np.pi)]
    assert seen(composition.each_served, [*desks, *shared])[0] == {}
    assert seen(composition.each_served, [*desks, chairs[0]])[0] == {}  # one chair in all: nobody was passed over


def test_no_bed_goes_without_a_nightstand_while_another_has_two():
    beds = [("single_bed", (1.0, 0.5, 2.0), (-1.4, 0.0), 0.0), ("single_bed", (1.0, 0.5, 2.0), (1.4, 0.0), 0.0)]

    def stands(*places):
        return [("nightstand", (0.4, 0.5, 0.4), (x, -0.8), 0.0) for x in places]

    assert seen(composition.each_served, [*beds, *stands(-2.15, -0.65)])[0] == {1: -1.0}
    assert seen(composition.each_served, [*beds, *stands(-0.65, 0.65)])[0] == {}


def seated(*places):
    """A table 1.3 m long and 0.9 m deep with chairs where their middles lie, each looking at it."""
    chairs = [("dining_chair", (0.42, 0.9, 0.5), at, yaw) for at, yaw in places]
    return [("dining_table", (1.3, 0.75, 0.9), (0.0, 0.0), 0.0), *chairs]


CROWDED = [((side * 0.85, z), -side * HALF) for side in (-1, 1) for z in (-0.22, 0.22)]  # at both short sides


def test_chairs_do_not_crowd_a_short_side_while_the_long_ones_are_free():
    margin, found, _ = seen(seating.elbow_room, seated(*CROWDED))
    assert margin == {0: pytest.approx(0.45 - 0.6)}
    assert found.measure.tolist() == [pytest.approx(0.45)]
    around = [((0.33 * x, 0.65 * z), np.pi * (z > 0)) for x in (-1, 1) for z in (-1, 1)]
    assert seen(seating.elbow_room, seated(*around))[0] == {0: pytest.approx(0.65 - 0.6)}
    turned = [(word, size, (at[1], -at[0]), yaw + HALF) for word, size, at, yaw in seated(*CROWDED)]
    assert seen(seating.elbow_room, turned, (4.0, 5.0))[0] == {0: pytest.approx(0.45 - 0.6)}


def sides(front, back):
    """A table with so many chairs before it and behind it."""
    return seated(*(
        ((0.42 * (number - (count - 1) / 2), side * 0.65), np.pi * (side > 0))
        for count, side in ((front, 1), (back, -1)) for number in range(count)
    ))  # fmt: skip


@pytest.mark.parametrize(
    ("front", "back", "margin", "more"),
    [(2, 2, 0.5, 0.0), (2, 1, 0.5, 1.0), (3, 1, -1.5, 2.0), (1, 3, -1.5, 2.0), (3, 0, -1.5, 3.0)],
)
def test_as_many_sit_at_one_side_of_a_table_as_opposite(front, back, margin, more):
    found, rows, _ = seen(seating.chairs_balanced, sides(front, back))
    assert found == {0: pytest.approx(margin)}
    assert rows.measure.tolist() == [pytest.approx(more)]


def test_two_sit_opposite_or_around_a_corner_and_nobody_is_missed_where_no_room_is():
    assert seen(seating.chairs_balanced, sides(2, 0))[0] == {0: pytest.approx(-1.5)}
    assert seen(seating.chairs_balanced, sides(1, 1))[0] == {0: pytest.approx(0.5)}
    corner = seated(((0.0, 0.65), np.pi), ((0.85, 0.0), -HALF))
    assert seen(seating.chairs_balanced, corner)[0] == {0: pytest.approx(0.5)}
    shelf = [("bookshelf", (1.6, 2.0, 0.3), (0.0, -1.0), 0.0)]
    assert seen(seating.chairs_balanced, sides(3, 0) + shelf)[0] == {0: pytest.approx(1.5)}


def test_a_side_at_a_wall_or_at_furniture_is_not_free():
    shelves = [("bookshelf", (1.6, 2.0, 0.3), (0.0, z), 0.0) for z in (-1.0, 1.0)]
    both, narrow = (seated(*CROWDED) + shelves, (5.0, 4.0)), (seated(*CROWDED), (5.0, 2.0))
    for room, words in ((both, 0), (narrow, 0), ((seated(*CROWDED) + shelves[:1], (5.0, 4.0)), 1)):
        margin, found, _ = seen(seating.elbow_room, *room)
        assert margin == {0: pytest.approx(0.45 - (0.6 if words else 0.55))}
        assert found.words.tolist() == [words]


@pytest.mark.parametrize(("apart", "margin"), [(2.4, 0.37), (2.0, -0.03)])
def test_who_works_back_to_back_sits_apart(apart, margin):
    things = []
    for side in (-1, 1):
        yaw = HALF * (side + 1)  # each desk at its wall, its front into the room
        things += [("desk", (1.2, 0.75, 0.6), (0.0, side * apart / 2), yaw),
                   ("office_chair", (0.5, 0.9, 0.5), (0.0, side * (apart / 2 - 0.6)), yaw + np.pi)]  # fmt: skip
    assert seen(seating.chair_pulls_out, things)[0] == {1: pytest.approx(margin), 3: pytest.approx(margin)}


def test_no_table_goes_without_a_chair_while_another_has_two():
    tables = [("dining_table", (1.2, 0.75, 0.8), (x, 0.0), 0.0) for x in (-1.5, 1.5)]
    chairs = [("dining_chair", (0.45, 0.9, 0.5), (-1.5, z), np.pi * (z > 0)) for z in (-0.6, 0.6)]
    assert seen(composition.each_served, [*tables, *chairs])[0] == {1: -1.0}
    moved = ("dining_chair", (0.45, 0.9, 0.5), (1.5, 0.6), np.pi)
    assert seen(composition.each_served, [*tables, chairs[0], moved])[0] == {}
    coffee = ("coffee_table", (1.2, 0.4, 0.6), (1.5, 0.0), 0.0)  # nobody sits at it
    assert seen(composition.each_served, [tables[0], coffee, *chairs])[0] == {}


@pytest.mark.parametrize(("length", "margin"), [(0.8, 0.1), (1.2, -0.2)])
def test_no_bench_lies_across_the_end_of_its_table(length, margin):
    bench = ("bench", (length, 0.45, 0.4), (0.95, 0.0), -HALF)
    assert seen(seating.bench_fits, [*seated(), bench])[0] == {1: pytest.approx(margin)}
    along = ("bench", (length, 0.45, 0.4), (0.0, 0.75), np.pi)
    assert seen(seating.bench_fits, [*seated(), along])[0][1] > 0
    end_on = ("bench", (length, 0.45, 0.4), (0.0, 0.45 + length / 2), HALF)
    assert seen(seating.bench_fits, [*seated(), end_on])[0] == {1: pytest.approx(0.5 - length)}


@pytest.mark.parametrize(("along", "margin"), [(0.6, 0.04), (0.68, -0.04)])  # 0.16 and 0.24 m beyond the corner
def test_nobody_sits_at_the_corner_of_a_table(along, margin):
    found = seen(seating.bench_fits, seated(((along, 0.65), np.pi), ((-0.4, 0.65), np.pi)))
    assert found[0][1] == pytest.approx(margin)
    assert found[1].measure.tolist()[0] == pytest.approx(along)
    stool = ("stool", (0.4, 0.45, 0.4), (0.8, 0.6), 0.0)
    assert seen(seating.bench_fits, [*seated(), stool])[0][1] > 0  # which has no front


@pytest.mark.parametrize(("aside", "margin"), [(0.2, 0.07), (0.36, -0.09)])
def test_who_sits_alone_at_the_end_of_a_table_sits_before_its_middle(aside, margin):
    found, rows, _ = seen(seating.bench_fits, seated(((0.85, aside), -HALF), ((0.0, 0.65), np.pi)))
    assert found[1] == pytest.approx(margin)
    assert rows.measure.tolist()[0] == pytest.approx(aside)


@pytest.mark.parametrize(("aside", "margin"), [(0.1, 0.03), (0.2, -0.07)])
def test_two_opposite_each_other_sit_at_the_middle_of_their_table(aside, margin):
    found, rows, _ = seen(seating.bench_fits, seated(((aside, 0.65), np.pi), ((aside, -0.65), 0.0)))
    assert found == {1: pytest.approx(margin), 2: pytest.approx(margin)}
    assert rows.words.tolist() == [3, 3]


# at the wall though there is room at the other side, too near it, free of it, in the middle
@pytest.mark.parametrize(("gap", "margin"), [(0.01, -0.29), (0.25, -0.05), (0.35, 0.05), (2.6, 2.15)])
def test_a_bed_for_two_is_got_into_from_both_sides_where_there_is_room(gap, margin):
    bed = ("double_bed", (1.8, 1.0, 2.1), (0.9 + gap - 3.5, -0.9), 0.0)
    found, rows, _ = seen(access.bed_side_free, [bed], (7.0, 4.0))
    assert found == {0: pytest.approx(margin)}
    assert rows.measure.tolist() == [pytest.approx(gap)]
    if gap < 0.1:  # so narrow a room has not 0.3 m for one side beside 0.45 m for the other, a slit of 0.01 m is none
        for wide in (2.4, 2.54):
            at = (0.91 - wide / 2, -0.9)
            assert seen(access.bed_side_free, [(*bed[:2], at, 0.0)], (wide, 4.0))[0][0] > 0


@pytest.mark.parametrize(("width", "words", "margin"), [(2.2, 0, -0.05), (2.3, 0, 0.05), (2.42, 1, 0.1)])
def test_who_sleeps_in_two_in_a_narrow_room_has_more_beside_the_bed(width, words, margin):
    bed = ("double_bed", (1.8, 1.0, 2.1), (0.9 - width / 2, -0.9), 0.0)
    found, rows, _ = seen(access.bed_side_free, [bed], (width, 4.0))
    assert (found, rows.words.tolist()) == ({0: pytest.approx(margin)}, [words])


@pytest.mark.parametrize(("gap", "margin"), [(0.05, 0.05), (0.15, -0.05), (0.25, -0.05), (0.35, 0.05)])
def test_a_bed_leaves_no_slit_to_the_wall(gap, margin):
    bed = ("single_bed", (1.0, 0.7, 2.0), (-2.0 + gap, -0.9), 0.0)
    assert seen(access.bed_along_wall, [bed])[0] == {0: pytest.approx(margin)}


@pytest.mark.parametrize("word", ["kids_bed", "cot"])
@pytest.mark.parametrize(("width", "gap", "margin"), [
    (1.0, 0.05, 0.05), (1.0, 0.3, -0.2), (1.0, 0.75, -0.65), (1.5, 0.05, 0.05), (1.5, 0.3, -0.2), (1.5, 0.75, 0.05),
])  # fmt: skip
def test_a_childs_bed_lies_along_a_wall_or_is_wide_and_free(word, width, gap, margin):
    bed = (word, (width, 0.8, 1.8), (width / 2 + gap - 2.5, -1.1), 0.0)
    assert seen(access.bed_along_wall, [bed])[0] == {0: pytest.approx(margin)}
    shelf = ("bookshelf", (0.8, 1.5, 0.3), (width / 2 + 0.2, -1.0), HALF)
    beside = seen(access.bed_along_wall, [(word, bed[1], (0.0, -1.1), 0.0), shelf])[0]
    assert beside == {0: pytest.approx(0.05)}  # along what stands there


@pytest.mark.parametrize(("stands", "margin"), [(1, -0.65), (2, 0.05)])
def test_a_childs_bed_between_two_nightstands_is_free(stands, margin):
    bed = ("kids_bed", (1.0, 0.8, 1.8), (1.25 - 2.5, -1.1), 0.0)
    beside = [("nightstand", (0.4, 0.5, 0.4), (1.25 - 2.5 + side * 0.72, -1.8), 0.0) for side in (1, -1)][:stands]
    assert seen(access.bed_along_wall, [bed, *beside])[0] == {0: pytest.approx(margin)}


@pytest.mark.parametrize(("gap", "margin"), [(0.3, -0.05), (0.4, 0.05)])
def test_two_get_past_the_foot_of_their_bed(gap, margin):
    bed = ("double_bed", (1.8, 1.0, 2.1), (0.0, 2.0 - gap - 1.05), 0.0)
    assert seen(crowding.bed_foot_free, [bed])[0] == {0: pytest.approx(margin)}
    assert seen(crowding.bed_foot_free, [("single_bed", (1.0, 1.0, 2.1), *bed[2:])])[0][0] > 1.0


@pytest.mark.parametrize(("gap", "margin"), [(0.08, -0.04), (0.16, 0.04)])
def test_who_works_at_a_desk_sits_off_the_bed(gap, margin):
    desk, chair = ("desk", (1.2, 0.75, 0.6), (0.0, -1.6), 0.0), ("chair", (0.5, 0.9, 0.5), (0.0, -1.05), np.pi)
    bed = ("double_bed", (1.4, 1.0, 2.0), (0.95 + gap, -0.9), 0.0)
    found = seen(crowding.groups_apart, [desk, chair, bed])[0]
    assert pytest.approx(margin) in list(found.values())


@pytest.mark.parametrize(("gap", "margin"), [(0.15, -0.18), (0.4, 0.07)])
def test_a_stool_moves_back_from_where_one_works(gap, margin):
    vanity = ("dressing_table", (1.0, 0.75, 0.5), (0.0, -1.7), 0.0)
    stool = ("stool", (0.4, 0.45, 0.4), (0.0, -1.2), np.pi)
    bed = ("double_bed", (2.1, 1.0, 1.8), (0.0, -0.1 + gap), 0.0)
    assert seen(seating.chair_pulls_out, [vanity, stool, bed])[0] == {1: pytest.approx(margin)}


@pytest.mark.parametrize(("x", "margin"), [(-0.5, 1 / 30), (-0.3, -1 / 30)])
def test_no_half_of_a_hall_is_bare(x, margin):
    right = [("cabinet", (1.0, 1.0, 1.0), (k % 3 + 1.0, k // 3 - 0.5), 0.0) for k in range(5)]
    right[4] = ("bookshelf", (1.25, 2.0, 0.8), (3.0, -1.6), 0.0)
    hall = [*right, ("cabinet", (1.0, 1.0, 1.0), (x, 1.0), 0.0)]
    found, rows, boxes = seen(composition.halves_used, hall, (8.0, 4.0))
    assert list(found.values()) == [pytest.approx(margin)]
    assert rows.measure.tolist() == [pytest.approx(100 - 50 * (margin + 0.3))]
    rows.margin.sum().backward()
    assert float(boxes.position.grad[5, 0]) == pytest.approx(-2 / 6)
    assert seen(composition.halves_used, hall, (4.4, 4.0))[0][0] > 0.5  # no half of so short a room
    assert seen(composition.halves_used, hall[2:], (8.0, 4.0))[0] == {}  # so few fill no hall


@pytest.mark.parametrize(("gap", "margin"), [(0.3, -0.08), (0.75, -0.05), (0.85, 0.05)])
def test_no_sofa_stands_before_storage_with_its_back_to_it(gap, margin):
    shelf = ("bookshelf", (0.8, 2.0, 0.4), (0.9, -1.8), 0.0)  # a fifth of whose front it covers
    sofa = ("multi_seat_sofa", (2.2, 0.8, 0.9), (-0.44, -1.6 + gap + 0.45), 0.0)
    assert seen(composition.wardrobe_opens, [shelf, sofa])[0] == {0: pytest.approx(margin)}


@pytest.mark.parametrize(("aside", "margin"), [(0.7, -0.14), (1.0, 0.16)])
def test_no_screen_stands_before_a_part_of_a_wardrobe(aside, margin):
    wardrobe = ("wardrobe", (1.6, 2.2, 0.6), (0.0, -1.7), 0.0)
    stand = ("tv_stand", (1.2, 0.5, 0.4), (aside, -0.5), -HALF)  # at the next wall
    assert seen(composition.wardrobe_opens, [wardrobe, stand])[0][0] == pytest.approx(margin)


def test_nobody_sits_before_a_wardrobe():
    wardrobe = ("wardrobe", (1.6, 2.2, 0.6), (0.0, -1.7), 0.0)
    beanbag = ("lazy_sofa", (0.8, 0.75, 0.8), (0.0, -0.5), 0.0)
    assert seen(composition.wardrobe_opens, [wardrobe, beanbag])[0] == {0: pytest.approx(0.5 - 0.55)}
    aside = ("lazy_sofa", (0.8, 0.75, 0.8), (1.6, -0.5), 0.0)
    assert seen(composition.wardrobe_opens, [wardrobe, aside])[0][0] > 0


@pytest.mark.parametrize(("gap", "margin"), [(0.3, -0.25), (0.6, 0.05)])
def test_no_nightstand_stands_before_a_wardrobe(gap, margin):
    wardrobe = ("wardrobe", (0.6, 2.2, 0.6), (0.0, -1.7), 0.0)
    bed = ("double_bed", (1.6, 0.5, 2.0), (1.6, 0.2), 0.0)
    stand = ("nightstand", (0.5, 0.5, 0.4), (0.1, -1.4 + gap + 0.2), 0.0)
    assert seen(composition.wardrobe_opens, [wardrobe, bed, stand])[0][0] == pytest.approx(margin)


@pytest.mark.parametrize(("left", "floor", "margin"), [(0.2, 5.0, -0.1), (0.4, 5.0, 0.1), (0.2, 3.0, 0.2)])
def test_no_end_of_a_table_is_shoved_at_a_wall_while_the_other_has_room(left, floor, margin):
    x = left + 0.8 - floor / 2
    chairs = [
        ("dining_chair", (0.5, 0.9, 0.5), (x + 0.4 * a, 0.6 * b), np.pi * (b > 0)) for a in (-1, 1) for b in (-1, 1)
    ]
    table = ("dining_table", (1.6, 0.75, 0.9), (x, 0.0), 0.0)
    found, rows, _ = seen(seating.table_amid, [table, *chairs], (floor, 4.0))
    assert found == {0: pytest.approx(margin)}
    assert rows.words.tolist() == [1]
    assert rows.measure.tolist() == [pytest.approx(left)]


@pytest.mark.parametrize("turn", [0.7, 0.77])
def test_a_second_sofa_does_not_look_away_from_what_its_group_watches(turn):
    sofa = ("multi_seat_sofa", (2.2, 0.8, 0.9), (0.0, -1.53), 0.0)
    low = ("coffee_table", (1.1, 0.4, 0.6), (0.0, -0.4), 0.0)
    stand = ("tv_stand", (1.8, 0.5, 0.4), (0.0, 1.78), np.pi)
    off = np.arctan2(1.88, 1.7) + turn  # of the front from the screen
    for word, most in (("loveseat_sofa", 90), ("armchair", 125)):
        other = (word, (1.2, 0.8, 0.8), (-1.7, -0.1), HALF + turn)
        assert seen(sight.screen_not_behind, [sofa, low, stand, other])[0] == {
            3: pytest.approx(np.radians(most) - off, abs=1e-6)
        }


@pytest.mark.parametrize(("covered", "margin"), [(0.3, -0.07), (0.15, 0.07)])
def test_no_table_of_another_group_stands_before_a_tenth_of_a_sofa(covered, margin):
    sofa = ("multi_seat_sofa", (2.2, 0.8, 0.9), (0.0, -1.53), 0.0)
    table = ("dining_table", (0.8, 0.75, 0.8), (-1.1 + covered - 0.4, 0.25), 0.0)  # 0.93 m before it
    assert seen(lounging.sofa_ahead, [sofa, table])[1].margin.tolist()[0] == pytest.approx(margin)


@pytest.mark.parametrize(("gap", "margin"), [(0.2, -0.05), (0.3, 0.05)])
def test_who_faces_a_coffee_table_has_room_for_the_knees(gap, margin):
    sofa = ("multi_seat_sofa", (2.2, 0.8, 0.9), (0.0, -1.53), 0.0)
    low = ("coffee_table", (1.1, 0.4, 0.6), (0.0, -0.4), 0.0)
    armchair = ("armchair", (0.8, 0.8, 0.8), (0.55 + gap + 0.4, -0.3), -HALF)
    _, rows, _ = seen(lounging.seat_room, [sofa, low, armchair])
    assert (2 in rows.who[rows.margin < 0].tolist()) == (margin < 0)
    if margin < 0:
        assert rows.measure.tolist()[-1] == pytest.approx(gap)
