"""Floors and openings that nobody stated: sizes like real rooms', openings where nothing stands."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from echomodel.openings import Opening, check_openings, free_area, rectangle, signed_area, swing_area
from echomodel.plans import filled_area, floor_extents, floor_outline, footprint, used_area
from echomodel.rooms.openings import place_openings

BEDROOM = ["double_bed", "nightstand", "nightstand", "wardrobe", "pendant_lamp"]
LOUNGE = ["multi_seat_sofa", "coffee_table", "tv_stand", "armchair"]


def test_lamps_above_cover_nothing_and_seats_half() -> None:
    chair = ((0.5, 0.9, 0.6),)
    assert footprint(["pendant_lamp"], [None]) == 0
    assert footprint(["dining_chair"], chair) == pytest.approx(0.15)
    assert footprint(["wardrobe"], [(2.0, 2.2, 0.6)]) == pytest.approx(1.2)
    assert footprint(BEDROOM, [None] * 5, least=True) < footprint(BEDROOM, [None] * 5)


@pytest.mark.parametrize(
    ("kind", "words", "low", "high"), [("bedroom", BEDROOM, 9, 22), ("living_room", LOUNGE, 12, 45)]
)
def test_floors_are_as_large_as_real_ones(kind: str, words: list[str], low: float, high: float) -> None:
    made = [floor_extents(kind, words, [None] * len(words), np.random.default_rng(seed)) for seed in range(40)]
    areas = [x * z for x, z in made]
    assert low < min(areas)
    assert max(areas) < high
    assert all(1.0 <= max(e) / min(e) <= 2.3 for e in made)
    assert 8 < sum(x > z for x, z in made) < 32
    assert made[3] == floor_extents(kind, words, [None] * len(words), np.random.default_rng(3))


def test_more_furniture_gets_a_larger_floor_and_stated_openings_fit() -> None:
    def extents(count: int, openings: tuple[Opening, ...] = ()) -> tuple[float, float]:
        rng = np.random.default_rng(0)
        return floor_extents("bedroom", ["wardrobe"] * count, [None] * count, rng, openings=openings)

    assert np.prod(extents(40)) > 40 > np.prod(extents(2))
    wide = Opening("w", "window", 3, 4.0, 3.0, 1.3, 0.9)
    assert extents(2, (wide,))[1] >= 7.0


def test_a_floor_is_no_hall_for_one_table() -> None:
    words = ["dining_table", *["dining_chair"] * 4, "pendant_lamp"]
    sizes = [(1.6, 0.75, 0.9), *[(0.45, 0.9, 0.5)] * 4, None]
    filled = filled_area([size[0] for size in sizes[:5]], [size[2] for size in sizes[:5]])
    assert filled == pytest.approx(2.6 * 1.9 + 4 * 1.45 * 1.5)
    for seed in range(20):
        x, z = floor_extents("living_dining_room", words, sizes, np.random.default_rng(seed))
        assert x * z < filled / 0.8 * 1.05  # sides come in steps of 0.1 m


def test_openings_lie_where_nothing_stands() -> None:
    floor = rectangle(4.0, 3.2)
    # a bed in the middle of the wall at -z, a wardrobe all along the wall at +x, a desk at +z
    size = np.array([[1.8, 1.0, 2.1], [3.0, 2.2, 0.6], [1.4, 0.75, 0.6]])
    position = np.array([[-0.5, 0.0, -0.5], [1.7, 0.0, 0.0], [-1.2, 0.0, 1.3]])
    yaw = np.array([0.0, -np.pi / 2, np.pi])
    for seed in range(8):
        made = place_openings(floor, 2.6, np.random.default_rng(seed), boxes=(size, position, yaw))
        assert [o.kind for o in made] == ["door", "window"]
        check_openings(made, floor, 2.6)
        door, window = made
        swing = shapely.Polygon(swing_area(floor, door))
        assert shapely.Polygon(floor).buffer(1e-6).contains(swing)
        bed = shapely.box(-1.4, -1.55, 0.4, 0.55)
        wardrobe = shapely.box(1.4, -1.5, 2.0, 1.5)
        desk = shapely.box(-1.9, 1.0, -0.5, 1.6)
        assert max(swing.intersection(thing).area for thing in (bed, wardrobe, desk)) < 0.01
        assert shapely.Polygon(free_area(floor, window)).intersection(wardrobe).area < 0.01


def test_halls_get_more_openings_and_cupboards_none() -> None:
    rng = np.random.default_rng(0)
    assert [o.kind for o in place_openings(rectangle(8, 6), 2.6, rng)] == ["door", "door", "window", "window"]
    assert place_openings(rectangle(0.8, 0.8), 2.6, rng) == ()


def test_a_room_too_low_for_an_opening_gets_none() -> None:
    polygon = rectangle(4.0, 3.0)
    assert {one.kind for one in place_openings(polygon, 1.0, np.random.default_rng(1))} == {"door"}
    assert place_openings(polygon, 0.05, np.random.default_rng(1)) == ()


def test_a_door_swings_out_of_a_room_that_leaves_its_leaf_no_place() -> None:
    floor = rectangle(3.0, 3.0)
    block = (np.array([[1.4, 1.0, 1.4]]), np.zeros((1, 3)), np.zeros(1))  # 0.8 m all around
    door = place_openings(floor, 2.6, np.random.default_rng(0), boxes=block)[0]
    assert door.swing == "in"  # in a corner
    corners = [(x, 0.0, z) for x in (-1.25, 1.25) for z in (-1.25, 1.25)]  # and something in every corner
    size = np.array([[1.75, 1.0, 1.75]] + [[0.5, 1.0, 0.5]] * 4)
    boxes = (size, np.array([(0.0, 0.0, 0.0), *corners]), np.zeros(5))
    door = place_openings(floor, 2.6, np.random.default_rng(0), boxes=boxes)[0]
    assert door.swing == "out"


def test_use_takes_more_than_furniture_covers_and_floors_hold_it() -> None:
    table, chairs = ["dining_table"], ["dining_chair"] * 6
    assert used_area(table, [None]) < used_area(table + chairs, [None] * 7)
    assert used_area(BEDROOM, [None] * 5) > footprint(BEDROOM, [None] * 5)
    for kind, words in (("bedroom", BEDROOM), ("living_room", LOUNGE), ("dining_room", table + chairs)):
        for seed in range(10):
            made = floor_extents(kind, words, [None] * len(words), np.random.default_rng(seed))
            assert np.prod(made) > used_area(words, [None] * len(words))


def test_some_large_floors_are_cut_and_keep_their_area() -> None:
    made = [floor_outline("living_dining_room", (8.0, 5.6), 2.4, np.random.default_rng(seed)) for seed in range(60)]
    cut = [outline for outline in made if outline is not None]
    assert 8 < len(cut) < 35
    for outline in cut:
        assert outline.shape == (6, 2)
        assert shapely.Polygon(outline).is_valid
        assert signed_area(outline) == pytest.approx(8.0 * 5.6, rel=0.05)
        np.testing.assert_allclose(outline.max(0), -outline.min(0))
    assert all(floor_outline("study", (3.0, 3.0), 1.6, np.random.default_rng(seed)) is None for seed in range(60))
