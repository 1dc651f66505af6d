"""What the arranging reckons with: groups that slide, walls and slots that fixed or drawn pieces decide, poses."""

from __future__ import annotations

import numpy as np
import pytest

from echomodel.boxes2d import axes
from echousd.place.geometry import depth_inside
from echousd.place.placing import place_boxes
from echousd.place.problem import Problem, problem_of
from echousd.place.proposals import aside, proposals, slots_at
from echousd.place.search import Search, State

FLOOR = np.array([(-2.5, -2.0), (2.5, -2.0), (2.5, 2.0), (-2.5, 2.0)])


def problem(
    words: list[str], size: list, position: list, yaw: list, fixed: tuple[int, ...] = (), floor: np.ndarray = FLOOR
) -> Problem:
    """The problem of boxes in a room, some of them fixed."""
    still, none = np.isin(np.arange(len(words)), fixed), np.zeros(len(words), bool)
    return problem_of(
        words, np.array(size, float), np.array(position, float), np.array(yaw, float), np.zeros((0, 3), int),
        floor_polygon=floor, height=2.7, fixed=still, rigid=none, turned=still,
    ).spread()  # fmt: skip


def test_a_lamp_on_the_sideboard_of_a_table_does_not_slide_with_the_table() -> None:
    words = ["dining_table", "dining_chair", "sideboard", "table_lamp"]
    size = [(1.4, 0.75, 0.9), (0.5, 0.9, 0.5), (1.4, 0.9, 0.4), (0.3, 0.5, 0.3)]
    found = problem(words, size, [(0, 0, 0), (0.3, 0, 0.6), (0, 0, -1.78), (0.3, 0.9, -1.78)], [0, np.pi, 0, 0])
    assert found.slot_roles[2] == "near"
    assert found.carrier[3] == 2
    state = State(found.position, found.yaw, np.zeros(4))
    assert Search(found).group(0, np.ones(4, bool), state) == [0, 1]


@pytest.mark.parametrize("width", [1.6, 1.8])
def test_a_nightstand_comes_close_to_a_fixed_bed_that_is_flush_with_its_wall(width: float) -> None:
    size = [(width, 1.0, 2.1), (0.5, 0.5, 0.4)]
    drawn, still = [(0.0, 0.0, -0.95), (1.6, 0.0, 0.8)], [True, False]
    found = problem(["double_bed", "nightstand"], size, drawn, [0.0, 0.0], (0,))
    assert found.behind[0] == pytest.approx(0.0, abs=1e-9)
    done = place_boxes(
        ["double_bed", "nightstand"], np.array(size), np.array(drawn), np.zeros(2), np.zeros((0, 3), int),
        floor_polygon=FLOOR, height=2.7, fixed=np.array(still), rigid=np.array(still),
    )  # fmt: skip
    assert abs(done.position[1, 0]) - (done.size[1, 0] + width) / 2 < 0.13
    assert done.position[1, 2] - done.size[1, 2] / 2 + 2.0 == pytest.approx(found.behind[1], abs=0.02)


def test_the_coffee_table_of_a_corner_sofa_keeps_the_distance_that_was_drawn() -> None:
    """0.35 m before the seats, which is 0.1 m before the box: it reaches into the corner."""
    sofa, table = (2.6, 0.8, 1.6), (0.9, 0.4, 0.6)
    ahead = 0.8 + 0.3 + 0.1
    found = problem(["l_shaped_sofa", "coffee_table"], [sofa, table], [(0, 0, -1.2), (0, 0, ahead - 1.2)], [0, 0])
    _, forward, _, _ = min(slots_at(found, 1, 0), key=lambda slot: slot[3])
    assert forward == pytest.approx(ahead)


@pytest.mark.parametrize("size", [(0.8, 1.0, 0.3), (0.3, 1.0, 0.8), (0.5, 1.0, 0.5)])
def test_plants_have_no_pose_that_leaves_the_floor(size: tuple[float, float, float]) -> None:
    found = problem(["plant"], [size], [(0.4, 0.0, 0.3)], [0.0])
    rows = proposals(found, found.position, found.yaw, np.ones(1, bool), 0)
    search = Search(found)
    state = State(found.position, found.yaw, np.zeros(1))
    kept = rows[search._promising(state, np.ones(1, bool), 0, [0], rows, rows[:, 3])]
    side = np.stack(axes(kept[:, 2]), 1) * np.array([[size[0] / 2], [size[2] / 2]])  # (K, 2, 2)
    signs = np.array([(-1, -1), (-1, 1), (1, 1), (1, -1)])
    corners = kept[:, None, :2] + signs @ side
    assert len(kept) > 20
    assert depth_inside(found.floor, corners.reshape(-1, 2)).min() > -1e-6


@pytest.mark.parametrize(("rigid", "times"), [(True, 1), (False, 2)])  # quickly, then smaller, which is better
def test_a_full_room_is_not_arranged_again_where_nothing_may_shrink(monkeypatch, rigid: bool, times: int) -> None:
    run, calls = Search.run, []
    monkeypatch.setattr(Search, "run", lambda search, *asked: calls.append(search) or run(search, *asked))
    size = np.array([(2.0, 1.0, 2.2), (1.8, 2.2, 0.6), (1.8, 2.2, 0.6), (1.8, 2.2, 0.6)])
    small = FLOOR * (0.46, 0.6)
    place_boxes(
        ["double_bed", *["wardrobe"] * 3], size, np.zeros((4, 3)), np.zeros(4), np.zeros((0, 3), int),
        floor_polygon=small, height=2.7, rigid=np.full(4, rigid),
    )  # fmt: skip
    assert len(calls) == times


@pytest.mark.parametrize(("off", "moves"), [(0.05, False), (1.2, True)])
def test_a_sofa_in_the_room_slides_back_and_forth_too_one_at_its_wall_along_it(off: float, moves: bool) -> None:
    found = problem(["multi_seat_sofa"], [(2.2, 0.8, 0.9)], [(0, 0, off + 0.45 - 2.0)], [0.0])
    fine, usual = (aside(found, found.position, found.yaw, 0, fine) for fine in (True, False))
    assert bool((abs(fine[:, 1] - found.position[0, 2]) > 0.01).any()) == moves
    assert not (abs(usual[:, 1] - found.position[0, 2]) > 0.01).any()
    assert (abs(usual[:, 0] - found.position[0, 0]) > 0.01).any()


def test_what_is_missed_by_a_hair_is_moved_by_as_much() -> None:
    floor = np.array([(-1.2, -1.5), (1.3, -1.5), (1.3, 1.5), (-1.2, 1.5)])  # 0.5 m at the bed's foot
    bed, shelf = (1.0, 0.9, 2.0), (0.7475, 1.8, 2.0)  # 0.505 m beside the bed: 0.3 m at one side, 0.2 at the other
    position = [(-0.2, 0.0, -0.0375), (-0.2, 0.0, -1.12625), (-0.2, 0.0, 1.12625)]
    words = ["single_bed", "bookshelf", "bookshelf"]
    found = problem(words, [bed, shelf, shelf], position, [np.pi / 2] * 3, fixed=(1, 2), floor=floor)
    search, state = Search(found), State(found.position, found.yaw, np.zeros(3))
    assert 0 in search.faults(state)[1]
    after = search.swept(state, [0])
    assert not search.faults(after)[1]
    assert abs(after.position[0, 2] - state.position[0, 2]) < 0.02


@pytest.mark.parametrize(("aside", "moves"), [(0.2, False), (0.39, True)])
def test_a_table_goes_towards_the_middle_of_its_free_floor_where_nothing_is_wrong(aside, moves):
    chairs = [(aside + along, 0, across) for across in (-0.6, 0.6) for along in (-0.4, 0.4)]
    size, floor = [(1.6, 0.75, 0.9), *[(0.45, 0.9, 0.5)] * 4], FLOOR / np.abs(FLOOR).max(0) * (1.5, 1.6)
    words, at = ["dining_table", *["dining_chair"] * 4], [(aside, 0, 0), *chairs]
    found = problem(words, size, at, [0, 0, 0, np.pi, np.pi], floor=floor)
    search, state = Search(found), State(found.position, found.yaw, np.zeros(5))
    total, wrong = search.faults(state)
    assert not wrong
    after, _ = search.eased(state, total)
    assert (after.position[0, 0] < aside - 0.1) == moves
    np.testing.assert_allclose(after.position[1:, 0] - after.position[0, 0], [-0.4, 0.4] * 2, atol=1e-6)
