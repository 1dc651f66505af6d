"""Terms of fitted rooms: for each a room that breaks it just so, and one that does not."""

import numpy as np
import pytest
import torch

from echomodel.boxes import Boxes
from echomodel.objective import access, fitted
from echomodel.objective.copies import copies_of
from echomodel.objective.plan import plan_of
from echomodel.openings import BOARD, Opening

HALF = np.pi / 2
SIZES = {
    "base_unit": (0.8, 0.9, 0.6), "sink_unit": (0.8, 1.17, 0.6), "hob_unit": (0.6, 0.9, 0.6), "fridge": (0.6, 1.8, 0.6),
    "tall_unit": (0.6, 2.1, 0.6), "wall_unit": (0.8, 0.7, 0.35), "range_hood": (0.6, 0.7, 0.5),
    "kitchen_island": (1.6, 0.9, 0.9), "dining_table": (0.8, 0.75, 0.8), "toilet": (0.4, 0.8, 0.65),
    "washbasin": (0.6, 1.0, 0.45), "mirror_cabinet": (0.6, 0.7, 0.15), "shower": (0.9, 2.0, 0.9),
    "bathtub": (1.7, 0.65, 0.75), "washing_machine": (0.6, 0.85, 0.6), "towel_radiator": (0.5, 1.2, 0.08),
}  # fmt: skip
Z = -1.7  # of what stands at the wall behind


def seen(term, *things, floor=(6.0, 4.0), openings=()):
    """{category: margin, the least} of a term in a room of (category, x, z, yaw, bottom)."""
    things = [(*thing, *(0.0, 0.0)[len(thing) - 3 :]) for thing in things]
    x, z = np.array(floor) / 2
    boxes = Boxes(
        torch.tensor([SIZES[word] for word, *_ in things], dtype=torch.float64),
        torch.tensor([(x, y, z) for _, x, z, _, y in things], dtype=torch.float64),
        torch.tensor([yaw for *_, yaw, _ in things], dtype=torch.float64),
    )
    outline = np.array([(-x, -z), (x, -z), (x, z), (-x, z)])
    words = [word for word, *_ in things]
    room = plan_of(boxes, words, outline, openings, height=2.6)
    found = term(room)
    out = {}
    for who, margin in zip(found.who.tolist(), found.margin.tolist(), strict=True):
        out[words[who]] = min(margin, out.get(words[who], 9.0))
    two = copies_of(room, boxes.position.expand(2, -1, -1), boxes.yaw.expand(2, -1), torch.ones(len(words)) > 0)
    twice = term(two)
    assert sorted(twice.margin.tolist()) == pytest.approx(sorted([*found.margin.tolist()] * 2))
    return out


@pytest.mark.parametrize(("gap", "out", "kept"), [(0.01, 0.0, True), (0.03, 0.0, False), (0.0, 0.03, False)])
def test_units_stand_flush(gap, out, kept):
    margins = seen(fitted.row_flush, ("base_unit", 0.0, Z), ("hob_unit", 0.7 + gap, Z + out))
    assert set(margins) == {"base_unit", "hob_unit"}
    assert (min(margins.values()) >= 0) == kept


@pytest.mark.parametrize(("x", "kept"), [(2.7, True), (2.6, False)])
def test_a_row_goes_on_around_a_corner(x, kept):
    # the unit in the corner reaches to the wall; that at the next wall begins where it ends
    margins = seen(fitted.row_flush, ("base_unit", 2.6, Z), ("fridge", x, -1.1 + 0.05 * (not kept), -HALF))
    assert (margins["fridge"] >= 0) == kept


@pytest.mark.parametrize(("x", "kept"), [(0.1, True), (0.2, False)])
def test_wall_units_hang_over_worktops(x, kept):
    row = ("base_unit", 0.0, Z), ("fridge", 0.7, Z)
    margins = seen(fitted.hung_over, *row, ("wall_unit", x, -1.82, 0.0, 1.4))
    assert margins == {"wall_unit": pytest.approx(0.8 - x - 0.85 * 0.8)}
    assert (margins["wall_unit"] >= 0) == kept


@pytest.mark.parametrize(("x", "kept"), [(0.05, True), (0.08, False)])
def test_hoods_and_mirrors_hang_over_the_middle(x, kept):
    assert (seen(fitted.hung_over, ("hob_unit", 0, Z), ("range_hood", x, -1.75, 0.0, 1.55))["range_hood"] >= 0) == kept
    basin = ("washbasin", 1.0, -1.77)
    margins = seen(fitted.hung_over, basin, ("mirror_cabinet", 1.0 - x, -1.92, 0.0, 1.2))
    assert (margins["mirror_cabinet"] >= 0) == kept


@pytest.mark.parametrize(("aisle", "kept"), [(1.21, True), (1.15, False)])
def test_fronts_that_face_each_other_keep_an_aisle(aisle, kept):
    opposite = ("base_unit", 0.3, Z + 0.6 + aisle, np.pi)
    assert (seen(fitted.aisle, ("sink_unit", 0.0, Z), opposite)["sink_unit"] >= 0) == kept
    island = ("kitchen_island", 0.3, Z + 0.75 + aisle)
    assert (seen(fitted.aisle, ("sink_unit", 0.0, Z), island)["sink_unit"] >= 0) == kept
    assert seen(fitted.aisle, ("sink_unit", 0.0, Z), ("base_unit", 0.8, Z))["sink_unit"] > 1  # its neighbour


def test_the_work_triangle_is_neither_cramped_nor_long():
    for at, margin in ((0.8, 3.2 - 3.6), (1.0, 0.4), (2.1, 8.0 - 8.4)):  # hob, sink, fridge in one line
        margins = seen(fitted.work_triangle, ("hob_unit", 0, Z), ("sink_unit", -at, Z), ("fridge", at, Z), floor=(8, 4))
        assert margins == {"hob_unit": pytest.approx(margin)}


def test_nothing_stands_in_the_work_triangle():
    row = ("hob_unit", -1.0, Z), ("sink_unit", 0.2, Z), ("fridge", 1.4, Z)
    assert seen(fitted.work_triangle, *row, ("dining_table", 0.0, 0.5))["hob_unit"] > 0
    assert seen(fitted.work_triangle, *row, ("dining_table", -0.4, -0.9))["hob_unit"] < -0.1


@pytest.mark.parametrize("aside", [0.58, 0.65])
def test_a_hob_has_somewhere_to_put_a_pan(aside):
    # the next unit is flush, or a gap away; a high one is no worktop
    margins = seen(fitted.hob_safe, ("hob_unit", 0.0, Z), ("base_unit", 0.12 + aside, Z))
    assert (margins["hob_unit"] >= 0) == (aside < 0.6)
    assert seen(fitted.hob_safe, ("hob_unit", 0.0, Z), ("tall_unit", 0.6, Z))["hob_unit"] == pytest.approx(-0.4)


@pytest.mark.parametrize(("x", "kept"), [(2.45, True), (2.55, False)])
def test_a_hob_is_in_no_corner(x, kept):
    margins = seen(fitted.hob_safe, ("hob_unit", x, Z), ("base_unit", x - 0.7, Z))
    assert (margins["hob_unit"] >= 0) == kept
    corner = ("base_unit", 2.7, -1.0, -HALF)  # begins where the hob ends, around the corner
    assert seen(fitted.hob_safe, ("base_unit", 1.3, Z), ("hob_unit", 2.0, Z), corner)["hob_unit"] < -0.05


@pytest.mark.parametrize(("offset", "kept"), [(3.35, True), (3.25, False)])
def test_a_hob_lies_under_no_window(offset, kept):
    window = Opening("window", "window", 0, offset, 1.2, 1.2, 0.95)  # the hob ends at 3.3 m
    margins = seen(fitted.hob_safe, ("base_unit", -0.7, Z), ("hob_unit", 0.0, Z), openings=[window])
    assert (margins["hob_unit"] >= 0) == kept


@pytest.mark.parametrize(
    ("word", "needed"),
    [("toilet", 0.6), ("washbasin", 0.7), ("shower", 0.75), ("bathtub", 0.75), ("washing_machine", 0.9)],
)
def test_one_stands_before_what_washes(word, needed):
    half = SIZES[word][2] / 2
    for gap in (needed + 0.02, needed - 0.02):
        machine = ("tall_unit", 0.0, -2.0 + 2 * half + gap + 0.3)
        found = seen(fitted.standing_room, (word, 0.0, half - 2.0), machine)
        assert found[word] == pytest.approx(gap - needed)
        narrow = seen(fitted.standing_room, (word, 0.0, -gap / 2), floor=(6.0, 2 * half + gap))  # a wall is, too
        assert narrow[word] == pytest.approx(gap - needed)


def test_cupboards_hang_at_walls_and_before_no_window_nor_does_a_fridge_stand_at_its_board():
    window = Opening("window", "window", 0, 2.0, 1.2, 1.2, 0.95)
    for x, kept in ((0.0, False), (1.2, True)):
        hung = ("wall_unit", x, -1.82, 0.0, 1.4)
        assert (seen(access.window_free, hung, openings=[window])["wall_unit"] >= 0) == kept
    window = Opening("window", "window", 0, 2.4, 1.2, 1.2, 1.2)
    beside = 0.6 + SIZES["fridge"][0] / 2 + BOARD
    for word, x, kept in (("fridge", beside + 0.01, True), ("fridge", beside - 0.01, False), ("base_unit", 0.0, True)):
        at = (word, x, SIZES[word][2] / 2 - 2.0)
        assert (seen(access.window_free, at, openings=[window])[word] >= 0) == kept, (word, x)
    assert seen(access.at_wall, ("towel_radiator", 0.0, -1.95, 0.0, 0.3))["towel_radiator"] > 0
    assert seen(access.at_wall, ("towel_radiator", 0.0, 0.0, 0.0, 0.3))["towel_radiator"] < 0
