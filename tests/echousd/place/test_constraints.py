"""The slopes of all constraints are those of their values, and what the graph states has the margins of the rules."""

import numpy as np
import pytest
import torch

from echomodel.boxes import Boxes
from echomodel.graph import Stated
from echomodel.rules import margins, measured
from echomodel.vocabulary import vocabulary
from echousd.place.constraints import KINDS, OVERHANG, PLACEMENT, RELATION, SLACK, Constraints, Linearised
from echousd.place.geometry import COLUMNS
from echousd.place.problem import Problem, problem_of

WORDS = ["wardrobe", "dresser", "bookshelf", "table_lamp", "pendant_lamp", "cabinet", "armchair"]
NOTCHED = np.array([(0, 0), (4, 0), (4, 2), (2, 2), (2, 3.5), (0, 3)], float)
STATED = (Stated("in_corner", 5), Stated("between", 6, (0, 2)))


def posed(rules: str, square: bool, seed: int) -> Problem:
    """A room in which little is right, with all relations at once."""
    luck, n = np.random.default_rng(seed), len(WORDS)
    size, position = luck.uniform(0.4, 1.2, (n, 3)), luck.uniform(0, 4, (n, 3)) * (1, 0.3, 0.8)
    yaw = luck.integers(-1, 3, n) * np.pi / 2 if square else luck.uniform(-3, 3, n)
    on, told = vocabulary().predicate_id("standing_on"), sorted(measured(rules))
    every = [(i, p, j) for i in range(n) for j in range(n) if i != j for p in told if p != on]
    triplets, shelf = np.array([*every, (3, on, 2)]), WORDS.index("bookshelf")
    position[shelf], yaw[shelf] = (1.5, 0.0, size[shelf, 2] / 2 + 0.1), 0.0
    none = np.zeros(n, bool)
    return problem_of(
        WORDS, size, position, yaw, triplets, floor_polygon=NOTCHED, height=2.6, fixed=none, rigid=none, turned=none,
        stated=STATED, rules=rules,
    )  # fmt: skip


def at(start: Problem, size: np.ndarray, position: np.ndarray) -> Linearised:
    found = Constraints(start)
    return found.at(size, position, found.handicap)


@pytest.mark.parametrize(("rules", "square"), [("strict", False), ("sgfront", True)])
def test_slopes_are_those_of_the_values(monkeypatch, rules, square):
    monkeypatch.setattr("echousd.place.constraints.LONGEST_STEP", 99.0)  # no row is left out
    start = posed(rules, square, 1)
    moved = start.position + np.random.default_rng(2).normal(0, 0.05, start.position.shape)
    found, step = at(start, start.size, moved), 1e-6
    assert {*found.kind.tolist()} == {*KINDS}
    for box in range(len(WORDS)):
        for column in range(COLUMNS):
            ends = []
            for sign in (1, -1):
                size, position = start.size.copy(), moved.copy()
                if column < 3:
                    position[box, column] += sign * step
                else:
                    size[box, column - 3] *= np.exp(sign * step)
                ends.append(at(start, size, position).value)
            slope, told = (ends[0] - ends[1]) / (2 * step), found.gradient[:, COLUMNS * box + column]
            rigid = np.isin(found.kind, (PLACEMENT, OVERHANG)) & (column > 2)  # nothing grows or shrinks for these
            smooth = np.abs((ends[0] + ends[1]) / 2 - found.value) < 1e-9
            close = np.isclose(slope, told, atol=1e-5) | rigid
            assert close[smooth].all()
            assert smooth.mean() > 0.9
            assert not told[rigid].any()


@pytest.mark.parametrize("rules", ["strict", "sgfront"])
def test_relations_are_those_of_the_rules(monkeypatch, rules):
    monkeypatch.setattr("echousd.place.constraints.LONGEST_STEP", 99.0)
    start = posed(rules, False, 3)
    found = at(start, start.size, start.position)
    boxes = Boxes(*(torch.from_numpy(of) for of in (start.size, start.position, start.yaw)))
    told = margins(
        boxes, torch.from_numpy(start.triplets), rules=rules, center=torch.from_numpy(start.centre),
        fronts=torch.from_numpy(start.fronts),
    )  # fmt: skip
    row = found.kind == RELATION
    np.testing.assert_allclose(found.value[row] + SLACK, told.numpy()[found.number[row]], atol=1e-12)
    sloped = np.abs(found.gradient[row]).sum(1) > 0
    assert {*start.triplets[found.number[row][sloped], 1].tolist()} == measured(rules)


@pytest.mark.parametrize("mode", [torch.no_grad, torch.inference_mode])
def test_slopes_come_wherever_they_are_asked_for(mode):
    start = posed("strict", False, 4)
    with mode():
        found = at(start, start.size, start.position)
    np.testing.assert_array_equal(found.gradient, at(start, start.size, start.position).gradient)


def test_what_no_step_breaks_is_left_out():
    start = posed("strict", False, 5)
    found = at(start, start.size, start.position)
    far = start.position + 50.0 * np.eye(len(WORDS), 3)
    assert len(at(start, start.size, far).value) < len(found.value)
