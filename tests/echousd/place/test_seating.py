"""Tables are laid by plans: even sides, chairs opposite each other, benches with a side of their own."""

import numpy as np
import pytest

from echomodel.vocabulary import vocabulary
from echousd.place.placing import place_boxes

FLOOR = np.array([(-2.5, -2.5), (2.5, -2.5), (2.5, 2.5), (-2.5, 2.5)])
CLOSE, FACING = 5, 16


def laid(kinds, *, seed=0, told=()):
    """A dining table with seats that were drawn anywhere, placed; positions relative to the table's, turned to it."""
    rng = np.random.default_rng(seed)
    size = np.array([(1.6, 0.75, 0.9), *((1.2, 0.45, 0.4) if k == "bench" else (0.5, 0.9, 0.5) for k in kinds)])
    position = np.array([(0.0, 0.0, 0.0), *((x, 0.0, z) for x, z in rng.uniform(-1.5, 1.5, (len(kinds), 2)))])
    done = place_boxes(
        ["dining_table", *kinds], size, position, np.zeros(len(size)), np.array(told, int).reshape(-1, 3),
        floor_polygon=FLOOR, height=2.6,
    )  # fmt: skip
    away = (done.position[1:] - done.position[0])[:, [0, 2]]
    c, s = np.cos(done.yaw[0]), np.sin(done.yaw[0])
    return np.stack([c * away[:, 0] - s * away[:, 1], s * away[:, 0] + c * away[:, 1]], -1), done


@pytest.mark.parametrize("seed", range(3))
def test_four_chairs_sit_opposite_each_other(seed):
    told = [row for i in range(1, 5) for row in ((i, CLOSE, 0), (i, FACING, 0))]
    seats, done = laid(["dining_chair"] * 4, seed=seed, told=told)
    assert (done.verdict == 1).all()
    for sign in (-1, 1):
        assert (sign * seats[:, 1] > 0.4).sum() == 2
    left, right = (np.sort(seats[sign * seats[:, 1] > 0, 0]) for sign in (-1, 1))
    assert np.abs(left - right).max() < 0.12


def test_eight_chairs_that_are_too_many_for_two_sides_take_all_four():
    rng = np.random.default_rng(0)
    size = np.array([(2.0, 0.75, 0.9), *[(0.45, 0.9, 0.5)] * 8])
    position = np.array([(0.0, 0.0, 0.0), *((x, 0.0, z) for x, z in rng.uniform(-1.5, 1.5, (8, 2)))])
    done = place_boxes(
        ["dining_table", *["dining_chair"] * 8], size, position, np.zeros(9), np.zeros((0, 3), int),
        floor_polygon=FLOOR, height=2.6, rigid=np.ones(9, bool),
    )  # fmt: skip
    quarters = np.round(np.mod(done.yaw[1:] - done.yaw[0], 2 * np.pi) / (np.pi / 2)).astype(int) % 4
    assert sorted(np.bincount(quarters, minlength=4).tolist()) == [1, 1, 3, 3]


def test_a_bench_has_a_side_of_its_own():
    seats, _ = laid(["bench", "dining_chair", "dining_chair"], told=[(1, CLOSE, 0), (2, CLOSE, 0), (3, CLOSE, 0)])
    assert abs(seats[0, 0]) < 0.12
    assert (seats[1:, 1] * seats[0, 1] < 0).all()


@pytest.mark.parametrize("seed", range(3))
def test_chairs_and_a_bench_share_a_table(seed):
    kinds = ["dining_chair", "dining_chair", "bench", "dining_chair", "dining_chair"]
    seats, _ = laid(kinds, seed=seed)
    bench, chairs = seats[2], seats[[0, 1, 3, 4]]
    assert abs(bench[0]) < 0.25
    ends = np.abs(chairs[:, 0]) > 0.8
    assert ends.sum() == 2
    assert (chairs[~ends, 1] * bench[1] < 0).all()


@pytest.mark.parametrize(("told", "least", "most"), [("bigger_than", 1.9, 2.1), ("smaller_than", 0.9, 1.25)])
def test_a_table_of_told_size_grows_for_its_chairs_where_that_may_be(told, least, most):
    """Eight chairs ask for 2 m; a table that is smaller than a sideboard keeps what it has."""
    word = vocabulary().predicate_id(told)
    size = np.array([(1.2, 0.75, 0.8), (1.6, 0.8, 0.45), *[(0.45, 0.9, 0.5)] * 8])
    position = np.array([(0.0, 0.0, 0.0), (0.0, 0.0, -2.2), *((0.5 * k - 2.0, 0.0, 1.0) for k in range(8))])
    done = place_boxes(
        ["dining_table", "sideboard", *["dining_chair"] * 8], size, position, np.zeros(10), np.array([(0, word, 1)]),
        floor_polygon=FLOOR, height=2.6,
    )  # fmt: skip
    assert done.verdict.tolist() == [1]
    assert least < done.size[0, [0, 2]].max() < most
