"""Small distances: kept as drawn where a person leaves them so, spread and alike within a group where not."""

from __future__ import annotations

import numpy as np
import pytest

from echomodel.vocabulary import vocabulary
from echousd.place.distances import APART, kept_behind, over_bed, score, seen_from
from echousd.place.placing import place_boxes
from echousd.place.solver import PlaceConfig

FLOOR = np.array([(-3.0, -2.5), (3.0, -2.5), (3.0, 2.5), (-3.0, 2.5)])
CLOSE = next(p.id for p in vocabulary().predicates if p.name == "close_by")
TABLE, CHAIR = (1.6, 0.75, 0.9), (0.45, 0.85, 0.5)


def laid(gap: float) -> np.ndarray:
    """(5, 3) float, centres of a table and four chairs that are drawn so far from it, somewhat unevenly."""
    ahead = 0.45 + 0.25 + gap
    uneven = (-0.01, 0.0, 0.0, 0.01)
    places = [(-0.4, -ahead), (0.4, -ahead), (-0.4, ahead), (0.4, ahead)]
    return np.array([(0.0, 0.0, 0.0)] + [(x, 0.0, z + off) for (x, z), off in zip(places, uneven, strict=True)])


def chairs_apart(gap: float, long: float = 1.6) -> np.ndarray:
    """(4,) float: metres between a table and its chairs after placing."""
    size = np.array([(long, *TABLE[1:])] + [CHAIR] * 4)
    told = np.array([(k, CLOSE, 0) for k in range(1, 5)])
    done = place_boxes(
        ["dining_table"] + ["dining_chair"] * 4, size, laid(gap), np.array([0.0, 0.0, 0.0, np.pi, np.pi]), told,
        floor_polygon=FLOOR, height=2.7,
    )  # fmt: skip
    return seen_from(done.size, done.position, done.yaw, 0)[1:, 2:].max(1)


@pytest.mark.parametrize("gap", [-0.2, -0.1, 0.0])
def test_chairs_stay_as_far_below_their_table_as_they_were_drawn_and_alike(gap: float) -> None:
    assert chairs_apart(gap) == pytest.approx(np.full(4, gap), abs=0.02)


def test_chairs_that_were_drawn_astray_are_spread_from_table_to_table_and_even_at_each() -> None:
    found = [chairs_apart(0.4, long) for long in (1.5, 1.6, 1.7, 1.8)]
    assert all(np.ptp(gaps) < 0.02 for gaps in found)
    assert all(APART["around"].least - 0.01 <= gaps[0] <= APART["around"].most + 0.01 for gaps in found)
    assert np.ptp([gaps[0] for gaps in found]) > 0.02


def test_backs_off_their_walls_are_spread_as_real_ones_are() -> None:
    widths = np.linspace(1.0, 2.0, 200)
    size = np.stack([widths, np.full(200, 2.2), np.full(200, 0.6)], 1)
    kept = kept_behind(["wardrobe"] * 200, size, np.full(200, np.nan))
    assert kept.min() == 0.0
    assert kept.max() <= 0.08
    assert np.median(kept) == pytest.approx(0.03, abs=0.012)
    assert np.array_equal(kept, kept_behind(["wardrobe"] * 200, size, np.full(200, 0.5)))


def test_backs_of_desks_which_often_stand_free_are_spread_as_usual() -> None:
    size = np.stack([np.linspace(1.0, 2.0, 200), np.full(200, 0.75), np.full(200, 0.6)], 1)
    kept = kept_behind(["desk"] * 200, size, np.full(200, np.nan))
    assert np.median(kept) == pytest.approx(0.03, abs=0.012)
    assert np.mean(kept == kept.max()) < 0.2


def test_scores_are_equal_for_equal_pieces_and_normal_in_all() -> None:
    sizes = np.random.default_rng(0).uniform(0.3, 2.0, (500, 3))
    scores = np.array([score("nightstand", size) for size in sizes])
    assert score("nightstand", sizes[0] + 1e-5) == scores[0]
    assert abs(scores.mean()) < 0.15
    assert scores.std() == pytest.approx(1.0, abs=0.1)


def test_the_lamp_of_a_bed_hangs_where_it_was_drawn_over_it() -> None:
    size, yaw = np.array([(1.8, 1.0, 2.1), (0.5, 0.6, 0.5)]), np.zeros(2)
    for drawn, kept in ((0.2, 0.2), (-0.1, -0.1)):
        position = np.array([(0.0, 0.0, 0.0), (0.1, 2.0, drawn)])
        assert over_bed(size, position, yaw, 1, 0) == pytest.approx(kept)
    away = np.array([(0.0, 0.0, 0.0), (1.5, 2.0, 0.5)])
    assert -0.1 <= over_bed(size, away, yaw, 1, 0) <= 0.25
    square = np.array([(2.0, 1.0, 2.0), (0.5, 0.6, 0.5)])  # has no longer side
    assert over_bed(square, np.array([(0.0, 0.0, 0.0), (0.1, 2.0, 0.5)]), yaw, 1, 0) == 0.0


@pytest.mark.parametrize(("drawn", "kept"), [(-0.1, None), (0.0, 0.0), (0.045, 0.045), (0.3, None)])
def test_backs_keep_the_distance_to_their_wall_that_was_drawn_or_get_one_that_is_usual(
    drawn: float, kept: float | None
) -> None:
    size = np.array([[1.2, 2.2, 0.6]])
    position = np.array([[0.3, 0.0, -2.5 + 0.3 + drawn]])
    (usual,) = kept_behind(["wardrobe"], size, np.array([np.nan]))
    for arrange in (True, False):
        done = place_boxes(
            ["wardrobe"], size, position, np.zeros(1), np.zeros((0, 3)), floor_polygon=FLOOR, height=2.7,
            rigid=np.ones(1, bool), config=PlaceConfig(arrange=arrange),
        )  # fmt: skip
        wished = usual if arrange or kept is None else kept
        assert done.position[0, 2] - 0.3 + 2.5 == pytest.approx(wished, abs=0.012)  # a wall gives way a little
