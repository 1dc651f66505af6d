"""Openings: what they may be, where they lie in plan, and what they keep free."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
import shapely
import torch
from hypothesis import given
from hypothesis import strategies as st

from echomodel.boxes import Boxes
from echomodel.openings import (
    Opening,
    check_openings,
    free_area,
    hinge_point,
    inward_normal,
    numbered,
    opening_from_json,
    rectangle,
    segment,
    swing_area,
    zone,
)
from echomodel.roomboxes import RoomBoxes, read_rooms, write_rooms
from echomodel.surroundings import ROW, clearances, opening_rows

ROOM = rectangle(4.0, 3.0)  # wall 0 at -z, 1 at +x, 2 at +z, 3 at -x


def door(name: str = "door", edge: int = 0, offset: float = 0.5, **fields: object) -> Opening:
    return Opening(
        **{"name": name, "kind": "door", "edge": edge, "offset": offset, "width": 0.9, "height": 2.0, **fields}
    )


def window(name: str = "window", edge: int = 1, offset: float = 0.5, **fields: object) -> Opening:
    given = {"name": name, "kind": "window", "edge": edge, "offset": offset, "width": 1.2, "height": 1.3, "sill": 0.9}
    return Opening(**{**given, **fields})


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"kind": "gate"}, "opening 'door': kind is 'gate', allowed: door, window, passage"),
        ({"hinge": "top"}, "opening 'door': hinge is 'top', allowed: left, right"),
        ({"swing": "up"}, "opening 'door': swing is 'up', allowed: in, out, slide"),
        ({"edge": -1}, "opening 'door': edge is -1, allowed: the number of a corner, 0 or more"),
        ({"edge": True}, "opening 'door': edge is True, allowed: the number of a corner, 0 or more"),
        ({"offset": -0.1}, "opening 'door': offset is -0.1, allowed: 0 or more, metres"),
        ({"width": float("nan")}, "opening 'door': width is nan, allowed: 0.1 or more, metres"),
        ({"offset": 1e300}, "opening 'door': offset is 1e+300, allowed: 0 to 10000, metres"),
        ({"height": 1e300}, "opening 'door': height is 1e+300, allowed: 0.1 to 100, metres"),
        ({"width": 0}, "opening 'door': width is 0, allowed: 0.1 or more, metres"),
        ({"sill": 0.2}, "opening 'door': sill is 0.2, allowed: 0 for a door"),
    ],
)
def test_values_that_no_opening_has(fields: dict, said: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(said)}$"):
        door(**fields)


@pytest.mark.parametrize(
    ("openings", "height", "said"),
    [
        ([door(), door()], None, "two openings are called 'door', allowed: a name of its own for each"),
        ([door(edge=4)], None, "door 'door': wall 4 of a floor with 4 walls, allowed: 0 to 3"),
        (
            [door(offset=3.2)],
            None,
            "door 'door': reaches from 3.20 to 4.10 m along wall 0, which is 4.00 m long; "
            "allowed: offset and width within it",
        ),
        ([window(height=2.0)], 2.5, "window 'window': its top is at 2.90 m, allowed: up to the room's height, 2.50 m"),
        (
            [door(), window(edge=0, offset=1.0)],
            None,
            "window 'window' and door 'door' overlap by 0.40 m on wall 0, allowed: side by side",
        ),
    ],
)
def test_openings_that_do_not_fit(openings: list[Opening], height: float | None, said: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(said)}$"):
        check_openings(openings, ROOM, height)


def test_no_proposed_floor_grows_endlessly_for_an_opening() -> None:
    check_openings([door(offset=10.0)])
    said = (
        "door 'door': ends at 30.90 m along wall 0 of a floor that nobody stated, allowed: up to 12 m, "
        "or say the size of the room"
    )
    with pytest.raises(ValueError, match=f"^{re.escape(said)}$"):
        check_openings([door(offset=30.0)])


def test_openings_side_by_side_fit() -> None:
    check_openings([door(), window(edge=0, offset=1.4), window("high", edge=1)], ROOM, 2.5)


def test_normals_point_inside_in_either_turn() -> None:
    for polygon in (ROOM, ROOM[::-1]):
        for edge in range(4):
            middle = (polygon[edge] + polygon[(edge + 1) % 4]) / 2
            normal = inward_normal(polygon, edge)
            assert shapely.Polygon(polygon).contains(shapely.Point(middle + 0.1 * normal))
            assert not shapely.Polygon(polygon).contains(shapely.Point(middle - 0.1 * normal))


def test_hinge_is_on_the_left_of_someone_who_looks_at_the_door() -> None:
    # Facing the wall at -z from inside, -x is on the left.
    hinge, closed = hinge_point(ROOM, door(hinge="left"))
    np.testing.assert_allclose(hinge, [-1.5, -1.5])
    np.testing.assert_allclose(closed, [1, 0])
    hinge, closed = hinge_point(ROOM, door(hinge="right"))
    np.testing.assert_allclose(hinge, [-0.6, -1.5])
    np.testing.assert_allclose(closed, [-1, 0])


def test_the_same_door_in_the_other_turn_of_the_polygon() -> None:
    turned = ROOM[::-1]  # corner 3 is now corner 0: the wall at -z is edge 2, walked from +x to -x
    there = door(edge=2, offset=4.0 - 0.5 - 0.9)
    np.testing.assert_allclose(segment(turned, there), segment(ROOM, door())[::-1])
    for hinge in ("left", "right"):
        one = swing_area(ROOM, door(hinge=hinge))
        other = swing_area(turned, door(edge=2, offset=there.offset, hinge=hinge))
        np.testing.assert_allclose(one, other, atol=1e-12)


def test_what_openings_keep_free() -> None:
    swing = swing_area(ROOM, door())
    assert shapely.Polygon(swing).area == pytest.approx(np.pi * 0.81 / 4, rel=0.02)
    assert shapely.Polygon(ROOM).buffer(1e-9).contains(shapely.Polygon(swing))
    assert len(swing_area(ROOM, door(swing="out"))) == len(swing_area(ROOM, window())) == 0
    out = shapely.Polygon(free_area(ROOM, door(swing="out")))
    assert out.area == pytest.approx(0.9 * 0.6)
    for hinge, (low, high) in {"left": (-1.5, 0.3), "right": (-0.6, 1.2)}.items():  # the jambs are at -1.5 and -0.6
        slides = shapely.Polygon(free_area(ROOM, door(swing="slide", hinge=hinge)))
        assert slides.area == pytest.approx(0.9 * (0.6 + 0.08))
        assert np.ptp(slides.bounds[::2]) == pytest.approx(high - low)
    assert shapely.Polygon(free_area(ROOM, window())).bounds == pytest.approx((1.65, -1.0, 2.0, 0.2))
    assert shapely.Polygon(zone(ROOM, window(), 1.0)).area == pytest.approx(1.2)


@given(
    st.sampled_from(["door", "window", "passage"]), st.integers(0, 30), st.floats(0, 50), st.floats(0.1, 9),
    st.floats(0.1, 4), st.floats(0, 2), st.sampled_from(["left", "right"]), st.sampled_from(["in", "out", "slide"]),
)  # fmt: skip
def test_fields_come_back_from_json(kind, edge, offset, width, height, sill, hinge, swing) -> None:
    one = Opening("o", kind, edge, offset, width, height, sill if kind == "window" else 0, hinge, swing)
    assert opening_from_json(one.to_json()) == one


def test_faults_in_json() -> None:
    with pytest.raises(ValueError, match=r"opening: unknown field 'colour', allowed: name, kind, edge"):
        opening_from_json({"colour": "red"})
    with pytest.raises(ValueError, match="opening 'a': edge is missing"):
        opening_from_json({"name": "a", "kind": "door"})


def test_names_are_numbered() -> None:
    assert [numbered("door", taken) for taken in ([], ["door"], ["door", "door_2"])] == ["door", "door_2", "door_3"]


def test_openings_of_rooms_come_back(tmp_path) -> None:
    empty = np.zeros((0, 3))
    room = RoomBoxes("r", "bedroom", ROOM, 2.6, (), empty, empty, np.zeros(0), openings=(door(), window()))
    write_rooms(tmp_path / "rooms.json", [room])
    assert read_rooms(tmp_path / "rooms.json")[0].openings == room.openings
    assert "openings" not in replace(room, openings=()).to_json()


def test_clearances_know_doors_and_windows():
    rows = torch.from_numpy(opening_rows((door(offset=2.0), window()), ROOM))
    assert rows.shape == (2, ROW)
    middle, inward = (rows[0, :2] + rows[0, 2:4]) / 2, rows[0, 4:6]
    places = torch.stack([middle + inward * away for away in (0.3, 2.5)])
    position = torch.stack([places[:, 0], torch.zeros(2), places[:, 1]], 1)
    boxes = Boxes(torch.full((2, 3), 0.3), position, torch.zeros(2))
    clear = clearances(boxes, rows[None, :1].expand(2, -1, -1))
    assert clear[0, 5] < 0 < clear[1, 5]
    assert (clear[:, 10:] == 0).all()  # no window was told
    assert (clearances(boxes, torch.zeros(2, 0, ROW)) == 0).all()
