"""Rectangles for rooms: a constraint solver finds how they lie, then wall lines are moved until the areas are right."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import networkx
import numpy as np

from echomodel.late import extra
from echousd.graph import GraphError
from echousd.home.graph import HomeRelation

Rect = tuple[float, float, float, float]  # low x, low z, high x, high z, metres
Way = list[tuple[Any, bool]]  # terms that must not be negative, or (True) that must be nothing
Least = Callable[[float, int], float]
Cells = dict[str, Rect]  # of every room: floor and half of its walls

FACADE = 1.4  # metres of outer wall that a window needs
CORNERS = 0.35  # metres of a shared wall that corners and casings take
MORE = 0.4  # square metres that a larger room has more, at least
GAP = 0.1  # metres between rooms that share no wall, at least
FINE = 0.05  # metres that wall lines are moved by
# Of the solver's own clock, which counts work and is the same on every machine, about half a second each. What is not
# found soon is found late or never: a milder problem is sooner solved than the same one longer sought.
EFFORTS = (0.2, 1.2)


@dataclass(frozen=True)
class Wish:
    """A room as the solver sees it.

    Arguments:
        area: square metres of its cell. least, most: what it may be as a share of that.
        ratio: long over short side at most.
        short: metres that its short side has at least.
        outer: metres of outer wall that it wants.
    """

    name: str
    area: float
    least: float
    most: float
    ratio: float
    short: float
    outer: float = 0.0


@dataclass(frozen=True)
class Problem:
    """What is asked of a plan.

    Arguments:
        wishes: of the rooms. relations: that must hold.
        extents: (x, z) of the outline's box, metres. voids: parts of that box outside of the outline.
        free: whether the outline may move. gaps: whether cells may leave some of the box free.
        together: rooms of which each shall touch another. seed: of the solver. before: cells to begin from.
    """

    wishes: tuple[Wish, ...]
    relations: tuple[HomeRelation, ...]
    extents: tuple[float, float]
    voids: tuple[Rect, ...] = ()
    free: bool = True
    gaps: bool = False
    together: tuple[str, ...] = ()
    seed: int = 0
    before: Mapping[str, Rect] | None = None

    @property
    def steps(self) -> np.ndarray:
        """(2,) float: metres of a step of the grid that cells are first laid out on, along x and z."""
        extents = np.array(self.extents)
        step = np.clip(np.sqrt(extents.prod()) / 30, 0.2, 0.4)
        return extents / np.maximum((extents / step).round(), 1)


def solved(problem: Problem, effort: float = EFFORTS[-1]) -> tuple[str, Cells, float]:
    """`solved`, `impossible` (proven) or `unknown` (not within that effort), the cells, and how far off they are."""
    cp = extra("ortools.sat.python.cp_model", "plans need a constraint solver", "home", GraphError)
    model, sides = _model(cp, problem)
    solver = cp.CpSolver()
    solver.parameters.num_workers = 1
    solver.parameters.random_seed = problem.seed
    solver.parameters.linearization_level = 0  # plans of ten rooms four times as fast
    solver.parameters.max_deterministic_time = effort
    status = solver.Solve(model)
    if status not in (cp.OPTIMAL, cp.FEASIBLE):
        return ("impossible" if status == cp.INFEASIBLE else "unknown"), {}, np.inf
    steps = np.tile(problem.steps, 2)
    lie: Cells = {name: tuple((np.array([*map(solver.Value, own)]) * steps).tolist()) for name, own in sides.items()}
    return "solved", *_tuned(problem, lie)


def scaled(lie: Cells, factor: float) -> Cells:
    """The cells with all areas and the outline that many times as large, on wall lines of 5 cm."""
    side = np.sqrt(factor)
    return {name: tuple(((np.array(rect) * side / FINE).round() * FINE).tolist()) for name, rect in lie.items()}


def _model(cp: Any, problem: Problem) -> tuple[Any, dict[str, tuple[Any, Any, Any, Any]]]:
    """The constraints, and (low x, low z, high x, high z) of every cell, in steps."""
    model, steps = cp.CpModel(), problem.steps
    limits = [round(side / step) for side, step in zip(problem.extents, steps, strict=True)]
    cell = float(steps.prod())
    rects: dict[str, tuple[Any, Any, Any, Any]] = {}
    spans: tuple[list[Any], list[Any]] = ([], [])
    sizes: dict[str, Any] = {}

    def least(metres: float, axis: int) -> int:
        return int(np.ceil(metres / steps[axis] - 1e-6))

    for wish in problem.wishes:
        along = []
        for axis in (0, 1):
            low, high = (model.NewIntVar(0, limits[axis], "") for _ in range(2))
            side = model.NewIntVar(least(wish.short, axis), limits[axis], "")
            spans[axis].append(model.NewIntervalVar(low, side, high, ""))
            along.append((low, high, side))
        (west, east, w), (south, north, h) = along
        rects[wish.name] = (west, south, east, north)
        sizes[wish.name] = model.NewIntVar(0, limits[0] * limits[1], "")
        model.AddMultiplicationEquality(sizes[wish.name], [w, h])
        low, high = (round(wish.area * share / cell) for share in (wish.least, wish.most))
        model.AddLinearConstraint(sizes[wish.name], low, high)
        across, deep = (round(1000 * step) for step in steps)
        model.Add(across * 10 * w <= int(wish.ratio * 10) * deep * h)
        model.Add(deep * 10 * h <= int(wish.ratio * 10) * across * w)
        if problem.before and wish.name in problem.before:
            hints = zip(rects[wish.name], problem.before[wish.name], (*steps, *steps), strict=True)
            for variable, at, step in hints:
                model.AddHint(variable, round(at / step))
    voids = [[round(at / step) for at, step in zip(void, (*steps, *steps), strict=True)] for void in problem.voids]
    for low_x, low_z, high_x, high_z in voids:
        spans[0].append(model.NewFixedSizeIntervalVar(low_x, high_x - low_x, ""))
        spans[1].append(model.NewFixedSizeIntervalVar(low_z, high_z - low_z, ""))
    model.AddNoOverlap2D(*spans)
    if not problem.gaps:
        model.Add(sum(sizes.values()) == limits[0] * limits[1] - sum((v[2] - v[0]) * (v[3] - v[1]) for v in voids))

    def held(ways: Sequence[Way]) -> None:
        """Have one of some ways be kept."""
        literals = [model.NewBoolVar("") for _ in ways] if len(ways) > 1 else []
        for number, way in enumerate(ways):
            for term, exact in way:
                bound = model.Add(term == 0 if exact else term >= 0)
                if literals:
                    bound.OnlyEnforceIf(literals[number])
        if literals:
            model.AddBoolOr(literals)

    for ways in _demands(problem, rects, sizes, least, max(int(0.5 / cell), 1)):
        held(ways)
    for wish in problem.wishes:
        if wish.outer:
            own = rects[wish.name]
            ends = [(own[axis + 2 * far], limits[axis] * far) for axis in (0, 1) for far in (0, 1)]
            met = [way for void in voids for way in _touching(own, void, wish.outer, least)]
            held([*([(end - border, True)] for end, border in ends), *met])
    return model, rects


def _touching(one: Sequence[Any], other: Sequence[Any], metres: float, least: Least) -> Iterator[Way]:
    """The four sides on which two rectangles may share so much wall."""
    for axis in (0, 1):
        across, shared = 1 - axis, least(metres, 1 - axis)
        for a, b in ((one, other), (other, one)):
            wide = [(first[2 + across] - second[across] - shared, False) for first, second in ((a, b), (b, a))]
            yield [(a[2 + axis] - b[axis], True), *wide]


def _demands(
    problem: Problem, rects: Mapping[str, Sequence[Any]], sizes: Mapping[str, Any], least: Least, more: float
) -> Iterator[Sequence[Way]]:
    """What must hold between rectangles: each is kept in one of several ways, of numbers or of a solver's variables.

    Arguments:
        rects: (low x, low z, high x, high z) of every room. sizes: their areas.
        least: lengths along an axis, in the unit of the rectangles. more: area that a larger room has more.
    """
    for relation in problem.relations:
        row, (a, b) = relation.row, (rects[name] for name in relation.pair)
        if row.wall:
            yield [*_touching(a, b, row.wall + CORNERS, least)]
        elif any(row.step):
            axis, on = (0 if row.step[0] else 1), sum(row.step) > 0
            twice, edge = a[axis] + a[2 + axis], 2 * b[2 + axis if on else axis]
            yield [[(twice - edge if on else edge - twice, False)]]
        elif row.symmetric:
            orders = [(axis, pair) for axis in (0, 1) for pair in ((a, b), (b, a))]
            yield [[(after[axis] - before[2 + axis] - least(GAP, axis), False)] for axis, (before, after) in orders]
        if row.compares:
            yield [[(sizes[relation.subject] - sizes[relation.object] - more, False)]]
    for name in problem.together if len(problem.together) > 1 else ():
        near = [rects[other] for other in problem.together if other != name]
        yield [way for other in near for way in _touching(rects[name], other, 1.0, least)]


def _tuned(problem: Problem, lie: Cells) -> tuple[Cells, float]:
    """The cells with their wall lines moved, on 5 cm, until areas and proportions are as near as they get: how near."""
    rects = np.array([*lie.values()])
    line, at, pinned = _lines(problem, rects)
    cost, solved_at = _cost(problem, line, rects), at
    at = np.where(pinned, at, (at / FINE).round() * FINE)
    best = cost(at)
    for move in (8 * FINE, 4 * FINE, 2 * FINE, FINE):
        for _ in range(12):
            before = best
            for number in np.flatnonzero(~pinned):
                for step in (move, -move):
                    tried = at.copy()
                    tried[number] += step
                    value = cost(tried)
                    if value < best - 1e-9:
                        at, best = tried, value
                        break
            if best > before - 1e-9:
                break
    best, at = min((best, at), (cost(solved_at), solved_at), key=lambda one: one[0])
    return dict(zip(lie, map(tuple, at[line].round(4).tolist()), strict=True)), best


def _lines(problem: Problem, rects: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(r, 4) int which wall line every side of every rectangle lies on, (l,) where lines are, (l,) which are fixed."""
    steps, border = np.tile(problem.steps, 2), np.array([*problem.voids, (0.0, 0.0, *problem.extents)])
    everything = np.concatenate([rects, (border / steps).round() * steps])  # as the solver has it
    exact = np.concatenate([rects, border])
    joined = networkx.Graph()
    sides = [(r, s) for r in range(len(everything)) for s in range(4)]
    joined.add_nodes_from(sides)
    for (r, s), (q, t) in combinations(sides, 2):
        across = 1 - s % 2
        if s % 2 == t % 2 and abs(everything[r, s] - everything[q, t]) < 1e-6:
            low = max(everything[r, across], everything[q, across])
            if low < min(everything[r, 2 + across], everything[q, 2 + across]) + 1e-6:
                joined.add_edge((r, s), (q, t))
    line, at, pinned = np.zeros((len(everything), 4), int), [], []
    for number, group in enumerate(networkx.connected_components(joined)):
        for r, s in group:
            line[r, s] = number
        at.append(float(exact[max(group)]))
        outer = [side for r, side in group if r >= len(rects)]
        pinned.append(bool(outer) and not (problem.free and min(outer) > 1))
    return line[: len(rects)], np.array(at), np.array(pinned)


def _cost(problem: Problem, line: np.ndarray, rects: np.ndarray) -> Callable[[np.ndarray], float]:
    """How far lines at some places are from what is asked; what the solver has seen to costs thousands if it breaks."""
    wishes = problem.wishes
    target, least, most, ratio, short = np.array([(w.area, w.least, w.most, w.ratio, w.short) for w in wishes]).T
    low, high = rects[:, :2], rects[:, 2:]
    divided = [  # pairs of rectangles, and the axis along which one ends before the other begins
        (i, j, axis)
        for i in range(len(rects))
        for j in range(len(rects))
        for axis in (0, 1)
        if i != j and high[i, axis] <= low[j, axis] + 1e-6
    ]
    first, second, along = np.array(divided, int).reshape(-1, 3).T

    def cost(at: np.ndarray) -> float:
        here = at[line]
        sides = here[:, 2:] - here[:, :2]
        areas = sides.prod(1)
        share = areas / target
        shape = np.maximum(sides.max(1) / np.maximum(sides.min(1), 0.1), 1.0)
        wrong = np.maximum(short[:, None] - sides, 0).sum()
        wrong += np.maximum(shape - ratio, 0).sum()
        wrong += np.maximum(least - share, 0).sum() + np.maximum(share - most, 0).sum()
        wrong += np.maximum(here[first, 2 + along] - here[second, along], 0).sum()
        names = [wish.name for wish in wishes]
        own, sizes = (dict(zip(names, rows.tolist(), strict=True)) for rows in (here, areas))
        for ways in _demands(problem, own, sizes, lambda m, _: m, MORE):
            wrong += min(sum(abs(term) if exact else max(-term, 0.0) for term, exact in way) for way in ways)
        tidy = 0.02 * np.maximum(shape - 1.5, 0).sum()
        return float((np.square(share - 1) / np.maximum(1 - least, 0.05)).sum() + tidy + 1e4 * wrong)

    return cost
