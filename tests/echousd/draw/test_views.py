"""Where a camera inside a room stands: it sees far, and nothing that hangs at a wall fills its picture."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import shapely

from echomodel.boxes2d import seen, upright
from echomodel.openings import Opening
from echousd.draw.outside import perspective_views
from echousd.draw.sight import ASPECT, GRID, RAYS, Furniture, filled
from echousd.draw.views import (
    APERTURE,
    COSTS,
    LENSES,
    STRAIGHT,
    _walls,
    inside_view,
    shifted,
    view_matrix,
)
from echousd.graph import Node, RoomSpec, SceneGraph
from echousd.layers.cameras import main_piece, opening_boxes

FLOOR = np.array([(0.0, 0.0), (0.0, 4.0), (5.0, 4.0), (5.0, 0.0)])


def boxes(*rows: tuple[float, ...]) -> Furniture:
    found = np.array(rows, float).reshape(-1, 7)
    return Furniture(found[:, :3], found[:, 3:6], found[:, 6])


def fills(things: Furniture, view: np.ndarray, half: float, reach: float, near: float = 0.0) -> float:
    return float(filled(met(things, view, half, near)[1], np.full(len(RAYS), reach)))


def met(things: Furniture, view: np.ndarray, half: float, near: float = 0.0) -> list[np.ndarray]:
    return [each[0] for each in things.met(view[None], np.array([half]), near)]


def bare_walls(things: list[Furniture], view: np.ndarray, half: float, near: float = 0.0) -> float:
    """Share of a picture that the barest wall takes."""
    every = boxes().with_others(*things, _walls(FLOOR, 2.8))
    return float(met(every, view, half, near)[3][-len(FLOOR) :].max())


BED = boxes((1.8, 0.6, 2.0, 2.5, 0.0, 1.2, 0.0))


def test_the_camera_stays_away_from_curtains() -> None:
    free, _, near = inside_view(FLOOR, BED, 2.8)
    corner = free[[0, 2], 3]
    spot = corner - (near + 0.7) * free[[0, 2], 2] / np.linalg.norm(free[[0, 2], 2])  # on the way that it looks
    curtain = boxes((0.4, 2.2, 0.09, spot[0], 0.0, spot[1], 0.0))
    other, *_ = inside_view(FLOOR, BED, 2.8, curtain)
    assert np.linalg.norm(other[[0, 2], 3] - corner) > 1.0
    way = free[[0, 2], 2] / np.linalg.norm(free[[0, 2], 2])
    far = corner - (near + 2.6) * way + 1.2 * way[::-1] * (-1, 1)  # beside what it looks at
    assert np.allclose(inside_view(FLOOR, BED, 2.8, boxes((0.2, 0.2, 0.1, far[0], 1.3, far[1], 0.0)))[0], free)


def test_the_camera_turns_away_from_what_its_picture_would_cut_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("echousd.draw.views.NEARS", ())  # from within the room
    free, lens, near = inside_view(FLOOR, BED, 2.8)
    away, half = near + 0.6, APERTURE / 2 / lens
    edge = free[:3, 3] - away * free[:3, 2] + away * half * free[:3, 0]  # at the right border of its picture
    plant = boxes((0.4, 1.3, 0.4, edge[0], 0.0, edge[2], 0.0))
    before = fills(plant, free, half, 3.0, near)
    other, lens, near = inside_view(FLOOR, BED, 2.8, plant)
    assert fills(plant, other, APERTURE / 2 / lens, 3.0, near) < 0.25 * before


def test_a_plant_hides_what_stands_behind_it_as_furniture_does() -> None:
    free, lens, near = inside_view(FLOOR, BED, 2.8)
    ahead = near + 0.5 * (np.linalg.norm(BED.position[0] - free[:3, 3]) - near)
    x, _, z = free[:3, 3] + ahead * (BED.position[0] - free[:3, 3]) / np.linalg.norm(BED.position[0] - free[:3, 3])
    plant = boxes((0.5, 1.6, 0.5, x, 0.0, z, 0.0))
    other, wide, begin = inside_view(FLOOR, BED, 2.8, plant)
    hidden = [hidden_share(BED.with_others(plant), *view) for view in ((free, lens, near), (other, wide, begin))]
    assert hidden[0] > 0.2
    assert hidden[1] < 0.5 * hidden[0]


def hidden_share(things: Furniture, view: np.ndarray, lens: float, near: float) -> float:
    """Of the first box in a picture."""
    *_, shown, alone = met(things, view, APERTURE / 2 / lens, near)
    return float(1 - shown[0] / alone[0])


def test_the_camera_looks_down_a_little_in_the_smallest_room() -> None:
    floor = np.array([(0.0, 0.0), (0.0, 2.2), (2.2, 2.2), (2.2, 0.0)])
    view, *_ = inside_view(floor, boxes((1.0, 0.75, 0.5, 1.1, 0.0, 0.3, 0.0)), 2.8)
    assert -0.37 < -view[1, 2] / np.linalg.norm(view[[0, 2], 2]) < 0.0


def test_a_small_room_is_seen_through_a_wall_that_the_near_plane_cuts_away():
    floor = np.array([(0.0, 0.0), (0.0, 2.2), (3.2, 2.2), (3.2, 0.0)])
    things = boxes((1.2, 0.45, 0.35, 1.6, 0.0, 0.2, 0.0), (0.9, 1.1, 0.3, 2.0, 0.0, 2.03, np.pi))
    shelf = boxes((0.6, 0.3, 0.2, 1.2, 1.4, 2.09, np.pi))  # hangs on it
    view, lens, near = inside_view(floor, things, 2.6, shelf, main=0)
    assert lens in LENSES[:STRAIGHT]
    assert not shapely.Polygon(floor).contains(shapely.Point(*view[[0, 2], 3]))
    inside = -view[[0, 2], 2]
    start = view[:3, 3] + near * np.insert(inside, 1, -view[1, 2])
    for side, up in ((-1, -1), (1, -1), (-1, 1), (1, 1)):  # no corner of its picture is in a wall, the floor or above
        x, y, z = start + near * APERTURE / 2 / lens * (side * view[:3, 0] + up / ASPECT * view[:3, 1])
        assert shapely.Polygon(floor).contains(shapely.Point(x, z))
        assert 0 < y < 2.6
    for box in things.with_others(shelf).corners:  # nothing in it is cut open
        x, _, z = np.linalg.inv(view[:3, :3]) @ (box - view[:3, 3]).T
        if (np.abs(x) < near * APERTURE / 2 / lens).any():
            assert (-z > near).all() or (-z < near).all()
    x, _, z = np.linalg.inv(view[:3, :3]) @ (things.corners[0] - view[:3, 3]).T
    assert (np.abs(x) < -z * APERTURE / 2 / lens).all()


def test_the_camera_comes_nearer_where_the_room_is_large() -> None:
    floor = np.array([(0.0, 0.0), (0.0, 9.0), (10.0, 9.0), (10.0, 0.0)])
    group = boxes((2.2, 0.8, 0.9, 5.0, 0.0, 4.0, 0.0), (1.1, 0.4, 0.6, 5.0, 0.0, 5.2, 0.0))
    eye = inside_view(floor, group, 2.8)[0][[0, 2], 3]
    assert 2.0 < np.linalg.norm(eye - (5.0, 4.4)) < 5.5
    hall = np.array([(0.0, 0.0), (0.0, 8.0), (12.0, 8.0), (12.0, 0.0)])
    many = boxes(*((0.5, 0.9, 0.5, x, 0.0, z, 0.0) for x in np.arange(1.0, 12.0) for z in (0.5, 7.5)))
    group = boxes((2.2, 0.8, 0.9, 3.0, 0.0, 2.0, 0.0), (1.1, 0.4, 0.6, 3.0, 0.0, 3.2, 0.0))
    eye = inside_view(hall, many.with_others(group), 2.8, main=22)[0][[0, 2], 3]
    assert np.linalg.norm(eye - (3.0, 2.0)) < 6.0  # not where it sees most pieces


def test_the_back_of_an_armchair_is_not_before_the_sofa() -> None:
    floor = np.array([(-2.15, -2.9), (-2.15, 2.9), (2.15, 2.9), (2.15, -2.9)])
    left, right, back = np.pi / 2, -np.pi / 2, np.pi
    things = boxes(
        (2.01, 0.91, 1.03, -1.55, 0.0, 0.0, left), (0.99, 0.42, 0.85, -0.15, 0.0, 0.08, left),  # sofa, its table
        (2.15, 0.65, 0.52, 1.86, 0.0, -0.2, right), (0.96, 0.92, 1.0, -0.15, 0.0, 1.52, back),  # screen, armchair
        (1.27, 0.78, 0.57, 0.79, 0.0, -2.57, 0.0), (0.52, 0.99, 0.53, 0.79, 0.0, -2.06, back),  # desk and chair
        (0.45, 1.79, 0.23, -0.79, 0.0, -2.71, 0.0), (1.38, 2.04, 0.42, -1.45, 0.0, 2.69, back),
        (0.45, 0.99, 0.45, -0.15, 1.81, 0.08, left),
    )  # fmt: skip
    hung = boxes(
        (0.4, 2.31, 0.09, 1.1, 0.01, 2.81, back), (0.4, 2.31, 0.09, -0.48, 0.01, 2.81, back),
        (0.43, 0.87, 0.43, 1.84, 0.0, 2.59, left), (0.39, 0.39, 0.39, -1.55, 0.0, -1.27, left),
    )  # fmt: skip
    view, lens, near = inside_view(floor, things, 2.8, hung, main=0)
    assert fills(things.of(np.array([3])), view, APERTURE / 2 / lens, 2.6, near) < 0.01
    assert hidden_share(things, view, lens, near) < 0.25


NOTCHED = np.array([(0.0, 0.0), (0.0, 4.6), (2.8, 4.6), (2.8, 2.6), (5.2, 2.6), (5.2, 0.0)])


FLOORS = [FLOOR, NOTCHED, NOTCHED[:, ::-1]]
MAIN = [(1.8, 1.0, 2.1), (2.4, 0.85, 0.95), (1.6, 0.75, 0.9)]  # bed, sofa, table
PLACES = [(1.3, 1.2), (1.4, 3.2), (3.8, 1.3)]


def test_the_camera_sees_seats_from_before_rather_than_their_backs() -> None:
    floor = np.array([(0.0, 5.4), (3.4, 5.4), (3.4, 3.0), (6.0, 3.0), (6.0, 0.0), (0.0, 0.0)])
    right, back = np.pi / 2, np.pi
    things = boxes(
        (2.0, 0.82, 0.84, 0.42, 0.0, 3.79, right), (0.68, 0.48, 0.67, 1.63, 0.0, 3.59, right),
        (1.74, 0.67, 0.41, 3.2, 0.0, 3.79, -right), (1.12, 0.78, 0.64, 4.63, 0.0, 2.62, back),
        (0.57, 0.88, 0.54, 4.63, 0.0, 2.1, 0.0), (0.87, 1.03, 0.23, 0.16, 0.0, 1.36, right),
        (0.96, 0.89, 0.85, 1.72, 0.0, 2.58, 0.0), (0.43, 1.49, 0.43, 3.72, 0.0, 2.62, back),
    )  # fmt: skip
    view, lens, near = inside_view(floor, things, 2.8, main=0)
    which, away, along, *_ = met(things.with_others(_walls(floor, 2.8)), view, APERTURE / 2 / lens, near)
    shown = np.isfinite(away) & (which < len(things.size))
    assert (shown & (along > 0.25)).mean() < 0.02  # before backs counted: 0.05
    assert view[0, 3] - things.position[0, 0] > 1.5  # the sofa looks that way
    assert shown.mean() > 0.3


@pytest.mark.parametrize("number", range(9))  # every pair of floor, piece and place
def test_the_main_piece_is_whole_in_the_picture_and_the_eye_in_the_room(number):
    floor, size, at = FLOORS[number // 3], MAIN[number % 3], PLACES[(number // 3 + number + 1) % 3]
    room = shapely.Polygon(floor)
    if not room.contains(shapely.box(at[0] - 1.2, at[1] - 1.1, at[0] + 1.2, at[1] + 1.1).buffer(-0.1)):
        at = (at[1], at[0])
    piece = boxes((*size, at[0], 0.0, at[1], 0.0), (0.5, 1.9, 0.4, 0.3, 0.0, 0.3, 0.0))
    view, lens, near = inside_view(floor, piece, 2.6, main=0)
    assert lens in LENSES[:STRAIGHT]
    assert room.contains(shapely.Point(*(view[:3, 3] - near * view[:3, 2])[[0, 2]]))
    assert np.allclose(view[:3, 1], (0, 1, 0))  # walls stay upright in the picture
    x, y, z = ((piece.corners[0] - view[:3, 3]) @ np.linalg.inv(view[:3, :3]).T).T
    assert (z < 0).all()
    assert (np.maximum(np.abs(x), ASPECT * np.abs(y)) < -z * APERTURE / 2 / lens).all()


def test_a_wall_is_bare_where_nothing_is_at_it():
    view = view_matrix(np.array([2.5, 1.4, 0.5]), np.array([2.5, 1.4, 4.0]))
    half = APERTURE / 2 / 24.0
    bare = bare_walls([], view, half)
    picture = boxes((3.5, 1.6, 0.05, 2.5, 0.6, 3.97, 0.0))
    assert 0.4 < bare < 0.9
    assert bare_walls([picture], view, half) < bare - 0.1


def test_the_camera_shows_no_bare_wall_where_it_need_not():
    walls = boxes(*((2.4, 2.0, 0.05, x, 0.2, 3.96, 0.0) for x in (1.3, 3.7)))  # panels at one long wall
    bed = boxes((1.8, 0.6, 2.0, 2.5, 0.0, 2.8, 0.0))
    view, lens, near = inside_view(FLOOR, bed, 2.8, walls)
    assert bare_walls([bed, walls], view, APERTURE / 2 / lens, near) < 1 / 3


def test_one_looks_past_doors_where_it_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    doors, shares = boxes(*((0.9, 2.0, 0.02, x, 0.0, 0.01, 0.0) for x in (0.7, 4.3))), []
    for price in (0.0, 2000.0):
        monkeypatch.setitem(COSTS, "doors", price)
        view, lens, near = inside_view(FLOOR, BED, 2.8, doors=doors)
        shares.append(float(met(BED.with_others(doors), view, APERTURE / 2 / lens, near)[3][1:].sum()))
    assert shares[1] < shares[0] - 0.02


def test_a_shifted_picture_has_its_middle_aside_and_below_while_walls_stay_level() -> None:
    level = view_matrix(np.array([1.0, 1.4, 2.0]), np.array([1.0, 1.4, -3.0]))
    view = shifted(level, 0.2, 0.1)
    np.testing.assert_allclose(np.linalg.inv(view[:3, :3]) @ (0.2, -0.4, -2.0), (0.0, 0.0, -2.0), atol=1e-9)
    np.testing.assert_array_equal(view[:3, :2], level[:3, :2])


def test_the_camera_shows_less_bare_floor_where_it_is_asked_to(monkeypatch: pytest.MonkeyPatch) -> None:
    room, sofa = FLOOR * 1.8, (2.4, 0.85, 0.95, 4.5, 0.0, 6.5, np.pi)
    things = boxes(sofa, (0.9, 0.9, 0.9, 2.6, 0.0, 4.6, 1.2), (1.2, 0.4, 0.7, 4.5, 0.0, 5.0, 0.0))
    shares = []
    monkeypatch.setattr("echousd.draw.views.FLOORED", 0.0)
    for price in (0.0, 1000.0):
        monkeypatch.setitem(COSTS, "floor", price)
        view, lens, near = inside_view(room, things, 2.8)
        half = APERTURE / 2 / lens
        away = met(things.with_others(_walls(room, 2.8)), view, half, near)[1]
        shares.append(float((np.isinf(away) & (RAYS[:, 1] * half < view[1, 2])).mean()))
    assert shares[1] < shares[0] - 0.02


def test_what_stands_before_the_eye_is_left_out_and_nothing_cut_open() -> None:
    """A cinema: two sofas behind one another, of which one looks at the back from all around."""
    floor = np.array([(-2.4, -3.0), (-2.4, 3.0), (2.4, 3.0), (2.4, -3.0)])
    things = boxes(
        (2.2, 0.8, 0.9, 0.0, 0.0, 0.2, np.pi), (2.2, 0.8, 0.9, 0.0, 0.0, 2.2, np.pi),
        (1.8, 0.6, 0.45, 0.0, 0.0, -2.7, 0.0), (0.5, 1.7, 0.5, -2.0, 0.0, -2.6, 0.5),
    )  # fmt: skip
    view, lens, near = inside_view(floor, things, 2.6, main=0)
    _, away, along, *_ = met(things, view, APERTURE / 2 / lens, near)
    assert (np.isfinite(away) & (along > 0.25)).mean() < 0.03
    half = APERTURE / 2 / lens
    for box in things.corners:
        x, _, z = np.linalg.inv(view[:3, :3]) @ (box - view[:3, 3]).T
        cut = (-z).min() < near < (-z).max()
        assert not (near and cut and x.min() < near * half and x.max() > -near * half)


def test_the_main_piece_is_in_the_middle_third_of_the_picture() -> None:
    floor = np.array([(0.0, 0.0), (0.0, 4.0), (9.0, 4.0), (9.0, 0.0)])
    sofa = boxes((2.2, 0.8, 0.9, 1.6, 0.0, 0.6, 0.0))  # and many things at the other end
    many = boxes(*((0.5, 0.9, 0.5, x, 0.0, z, 0.0) for x in (5.0, 6.0, 7.0, 8.0) for z in (0.5, 3.5)))
    view, lens, _ = inside_view(floor, sofa.with_others(many), 2.6, main=0)
    x, _, z = np.linalg.inv(view[:3, :3]) @ (sofa.corners[0].mean(0) - view[:3, 3])
    assert abs(x) < -z * APERTURE / 2 / lens / 3


def test_only_what_is_near_and_in_the_picture_fills_it() -> None:
    view = view_matrix(np.array([0.0, 1.5, 0.0]), np.array([1.0, 1.5, 0.0]))
    ahead, behind, beside, far = (
        boxes((0.3, 2.0, 0.3, x, 0.0, z, 0.0)) for x, z in ((0.8, 0.0), (-0.8, 0.0), (0.3, 0.9), (3.0, 0.0))
    )
    assert fills(ahead, view, 1.0, 1.0) > 0.05
    assert fills(behind, view, 1.0, 1.0) == fills(far, view, 1.0, 1.0) == 0
    assert fills(beside, view, 0.5, 1.0) == 0  # a narrow picture does not reach so far


def test_the_camera_turns_to_have_a_picture_on_the_wall_whole() -> None:
    """What its heading alone would cut off: the pictures hang at either end of what it sees without turning."""
    view, lens, _ = inside_view(FLOOR, BED, 2.8)
    for side in (-1, 1):
        at = view[:3, 3] - 3.0 * view[:3, 2] + side * 3.0 * APERTURE / 2 / lens * view[:3, 0]
        picture = boxes((0.5, 0.6, 0.03, np.clip(at[0], 0.4, 4.6), 1.3, 3.97 if at[2] > 2 else 0.03, 0.0))
        other, lens_then, _ = inside_view(FLOOR, BED, 2.8, picture)
        assert within(picture.corners[0], other, lens_then) in (0.0, 1.0)


def lit(at: tuple[float, float], wide: float, tall: float) -> tuple[Furniture, np.ndarray]:
    """The bed below a pendant that hangs from 2.5 m, and (8, 3) corners of its shade; over it is its cord."""
    lamp = boxes((wide, tall, wide, at[0], 2.5 - tall, at[1], 0.0))
    both = Furniture(
        *(np.concatenate([getattr(one, key) for one in (BED, lamp)]) for key in ("size", "position", "yaw"))
    )
    return both, np.minimum(lamp.corners[0], (9.0, 2.5 - tall + min(0.55 * tall, 0.8 * wide), 9.0))


def within(points: np.ndarray, view: np.ndarray, lens: float) -> float:
    """Share of points (n, 3) in a picture from inside."""
    x, y, z = np.linalg.inv(view[:3, :3]) @ (points - view[:3, 3]).T
    return float((np.maximum(np.abs(x), ASPECT * np.abs(y)) < -z * APERTURE / 2 / lens).mean())


@pytest.mark.parametrize("at", [(1.2, 1.0), (1.2, 2.2), (2.5, 1.0), (3.9, 2.2), (0.75, 1.72), (2.85, 1.16), (4.2, 1.7)])
@pytest.mark.parametrize(("wide", "tall"), [(0.5, 0.9), (0.7, 0.6), (0.3, 1.1)])
def test_the_shade_of_a_pendant_is_whole_in_the_picture_or_not_in_it(at, wide, tall) -> None:
    both, shade = lit(at, wide, tall)
    assert within(shade, *inside_view(FLOOR, both, 2.5)[:2]) in (0.0, 1.0)


def test_a_lamp_that_the_picture_has_room_for_is_in_it_and_the_bed_whole() -> None:
    both, shade = lit((2.5, 1.0), 0.5, 0.9)
    view = inside_view(FLOOR, both, 2.5)[:2]
    assert within(shade, *view) == within(both.corners[0], *view) == 1.0


def test_armchairs_before_a_sofa_are_whole_though_the_camera_must_look_from_another_wall() -> None:
    """A lounge whose best view else cut one of two armchairs and a long radiator before the camera."""
    half_pi, floor = np.pi / 2, np.array([(-2.65, -2.1), (-2.65, 2.1), (2.65, 2.1), (2.65, -2.1)])
    things = boxes(
        (2.51, 0.85, 1.03, -2.11, 0.0, -0.3, half_pi), (1.18, 0.39, 0.83, -0.4, 0.0, -0.22, np.pi),
        (1.73, 0.63, 0.42, 2.38, 0.0, -0.19, -half_pi), (1.21, 0.74, 0.18, 2.38, 0.63, -0.19, -half_pi),
        (0.69, 0.78, 0.66, -0.85, 0.0, 0.88, np.pi), (0.69, 0.78, 0.66, 0.3, 0.0, 0.77, np.pi),
        (0.43, 1.69, 0.43, -2.32, 0.0, -1.89, half_pi), (1.67, 1.58, 0.25, 0.55, 0.0, 1.98, -np.pi),
        (0.45, 0.72, 0.45, 2.38, 0.0, -1.56, -half_pi),
    )  # fmt: skip
    hung = boxes(
        (0.44, 2.31, 0.08, -1.03, 0.02, -2.01, 0.0), (0.44, 2.31, 0.08, 1.03, 0.02, -2.01, 0.0),
        (0.4, 1.44, 0.08, -2.56, 0.89, 0.89, half_pi), (0.4, 1.44, 0.08, -2.56, 0.89, -0.89, half_pi),
        (1.3, 0.6, 0.09, 0.0, 0.0, -2.02, 0.0), (0.91, 0.62, 0.03, 2.63, 1.15, -0.19, -half_pi),
        (0.75, 0.21, 0.16, 0.1, 1.58, 1.99, -np.pi), (0.43, 0.44, 0.43, -1.79, 0.0, -1.82, 1.66),
        (0.46, 0.64, 0.03, 2.63, 1.2, 1.15, -half_pi), (0.81, 0.56, 0.04, 1.95, 1.24, -2.08, 0.0),
        (0.6, 0.44, 0.03, -0.95, 1.3, 2.08, -np.pi), (0.51, 1.12, 0.51, 2.3, 0.0, 1.75, -1.85),
    )  # fmt: skip
    windows = boxes((2.0, 1.3, 0.02, 0.0, 0.9, -2.1, 0.0), (1.68, 1.3, 0.02, -2.65, 0.9, 0.0, half_pi))
    view = inside_view(floor, things, 2.8, hung, windows, main=0)[:2]
    assert min(within(corners, *view) for corners in things.corners[[0, 1, 4, 5]]) >= 7 / 8


@pytest.mark.parametrize("at", [(1.5, 1.7), (1.7, 1.5), (1.4, 1.4), (1.9, 1.9)])
def test_a_small_dining_room_has_its_chairs_whole_but_for_a_foot(at) -> None:
    floor, (x, z) = np.array([(0.0, 0.0), (0.0, 3.2), (3.4, 3.2), (3.4, 0.0)]), at
    chairs = [(0.5, 0.9, 0.5, x + 0.35 * a, 0.0, z + 0.65 * b, np.pi * (b > 0)) for a in (-1, 1) for b in (-1, 1)]
    group = boxes((1.4, 0.75, 0.85, x, 0.0, z, 0.0), *chairs)
    view = inside_view(floor, group, 2.6, main=0)[:2]
    assert min(within(corners, *view) for corners in group.corners) >= 7 / 8


@pytest.mark.parametrize(("room", "words", "main"), [
    ("kitchen", ("fridge", "hob_unit", "dining_table"), 1), ("dining_room", ("hob_unit", "dining_table"), 1),
    ("kitchen", ("fridge", "tall_unit"), None), ("study", ("chaise_longue_sofa", "desk"), 1),
    ("living_room", ("desk", "loveseat_sofa"), 1), ("living_dining_room", ("dining_table", "loveseat_sofa"), 1),
])  # fmt: skip
def test_a_picture_is_about_what_its_room_is_for(room, words, main):
    count = len(words)
    furniture = Furniture(np.ones((count, 3)), np.zeros((count, 3)), np.zeros(count))
    assert main_piece(room, words, furniture) == main


def test_wide_scenes_are_seen_from_higher_up():
    """Over the walls between the rooms of a home."""
    furniture = Furniture(np.ones((1, 3)), np.zeros((1, 3)), np.zeros(1))

    def steep(width: float) -> float:
        points = np.array([(x, y, z) for x in (0.0, width) for y in (0.0, 2.6) for z in (0.0, width)])
        back = perspective_views(points, furniture)[0][:3, 2]
        return float(back[1] / np.hypot(back[0], back[2]))

    assert steep(4.0) == pytest.approx(steep(6.9))
    assert steep(14.0) == pytest.approx(2 * steep(4.0))


def test_one_looks_at_windows_rather_than_at_doors_and_passages():
    """These count as bare wall."""
    corners = ((-2.0, -2.0), (-2.0, 2.0), (2.0, 2.0), (2.0, -2.0))
    openings = tuple(
        Opening(kind, kind, edge, 2.0, 0.9, 2.0) for edge, kind in enumerate(("window", "door", "passage"))
    )
    graph = SceneGraph(RoomSpec("hallway", floor_polygon=corners, openings=openings), (Node("bench", "bench"),), ())
    room = SimpleNamespace(graph=graph, corners=graph.room.corners)
    windows, doors = (opening_boxes(room, windows=kind).position[:, [0, 2]].round(2).tolist() for kind in (True, False))
    assert windows == [[-2.0, 0.45]]
    assert len(doors) == 2


def test_what_a_line_of_sight_passes_through_hides_its_end():
    rng = np.random.default_rng(4)
    size, yaw = rng.uniform(0.2, 1.4, (12, 3)), rng.uniform(-3, 3, 12)
    furniture = Furniture(size, np.insert(rng.uniform(0, 5, (12, 2)), 1, 0.0, axis=1), yaw)
    eye = np.array([0.1, 1.5, 0.1])
    places = GRID * size[:, None] + (0.0, 1.0, 0.0) * size[:, None] / 2
    points = furniture.position[:, None] + np.einsum("nij,nkj->nki", upright(yaw), places)
    along = eye + np.linspace(0, 1, 400)[:, None, None, None] * (points - eye)
    passed = np.zeros(points.shape[:2], bool)
    for other in range(12):  # the same, step by step along every line
        away = along - furniture.position[other]
        flat = (np.abs(seen(away[..., ::2], yaw[other])) < size[other, ::2] / 2).all(-1)
        within = flat & (away[..., 1] > 0) & (away[..., 1] < size[other, 1])
        passed |= within.any(0) & (np.arange(12) != other)[:, None]
    hidden = furniture.hidden(eye)
    assert 0.1 < hidden.mean() < 0.9
    assert np.abs(hidden - passed.mean(1)).max() < 0.08


def test_rays_meet_what_is_nearest_beyond_the_near_plane():
    """The same ray by ray and step by step, in three turned boxes."""
    things = boxes(
        (1.0, 0.9, 0.6, 0.3, 0.0, -2.0, 0.7), (0.5, 1.5, 0.5, -0.6, 0.0, -1.2, -2.0), (3.0, 2.0, 0.2, 0, 0, -4, 0)
    )
    view, half = view_matrix(np.array([0.1, 1.4, 0.3]), np.array([0.0, 1.0, -2.0])), 0.7
    for near in (0.0, 1.6):
        which, away, _, shown, alone = met(things, view, half, near)
        ways = (RAYS * (half, half, 1.0)) @ view[:3, :3].T
        ahead = np.linspace(near, 6.0, 1500)
        along = view[:3, 3] + ahead[:, None, None] * ways
        first = np.full((3, len(RAYS)), np.inf)
        for n in range(3):
            apart = along - things.position[n]
            flat = (np.abs(seen(apart[..., ::2], things.yaw[n])) < things.size[n, ::2] / 2).all(-1)
            within = flat & (apart[..., 1] > 0) & (apart[..., 1] < things.size[n, 1])
            first[n, within.any(0)] = ahead[within.argmax(0)[within.any(0)]]
        lengths = first.min(0) * np.linalg.norm(ways, axis=1)
        both = np.isfinite(away) & np.isfinite(lengths)
        assert (np.isfinite(away) == np.isfinite(lengths)).mean() > 0.97
        assert np.abs(away[both] - lengths[both]).max() < 0.03
        assert (which == first.argmin(0))[both].all()
        np.testing.assert_allclose(alone, np.isfinite(first).mean(1), atol=0.02)
        np.testing.assert_allclose(shown, [(both & (which == n)).mean() for n in range(3)], atol=0.02)
