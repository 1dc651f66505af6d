"""Least movement that satisfies the constraints: sequential quadratic programming with an active-set inner solver.

Each round linearises every constraint (`constraints.linearise`) and solves
min 1/2 |step|^2_W + sum_r rho_r/2 violation_r^2, whose minimum is found exactly by Newton steps over the active set
because the objective is piecewise quadratic. The weights rho are so large that a constraint which can be met is met.
"""

from dataclasses import dataclass, replace

import numpy as np

from echomodel.late import Late
from echousd.place.constraints import CEILING, COLLISION, KINDS, OVERHANG, WALL, Constraints, Linearised, Matrix
from echousd.place.geometry import COLUMNS
from echousd.place.problem import Problem

diags_array, splu = Late("scipy.sparse:diags_array"), Late("scipy.sparse.linalg:splu")


@dataclass(frozen=True)
class PlaceConfig:
    """How far and how hard boxes are pushed.

    Arguments:
        arrange: first choose for every piece among the places that a person would try; False = only by millimetres.
        anew: times that a search that still misses something takes pieces out and puts them in again.
        yields: names of terms that the search sees, but for which it does not begin anew: doors that may be moved.
        without: names of terms of the objective that the search does not see, so that others can judge by them.
        reach: tables, by number, and metres that seats of theirs reach under them at most, as their solids allow.
    """

    arrange: bool = True
    anew: int = 2
    yields: frozenset[str] = frozenset()
    without: frozenset[str] = frozenset()
    reach: tuple[tuple[int, float], ...] = ()


MOVE, STRETCH = 0.3, 0.12  # metres, and change of the logarithm of a size, that cost as much
LIMIT = 0.4  # largest change of the logarithm of a size
ROUNDS, PATIENCE = 16, 6  # most linearisations in one attempt, and how many of them without progress end it
BUDGET = 26  # most linearisations in all attempts together: what a room may cost, the same on every machine
# Stiffness of each kind of constraint; walls and ceilings give way to relations and collisions.
STIFFNESS = np.full(len(KINDS), 1e5)
STIFFNESS[[OVERHANG, CEILING, WALL]] = 1e4, 1e3, 3e2
LIMIT_STIFFNESS = 1e6
UNMET = 0.01  # metres or ratio by which a constraint is missed that does not hold
THROUGH = 4  # rounds in which collisions do not count, in an attempt that walks through other things
SOFT = 1e-2  # weight of a metre to the wall or the ceiling against a metre of collision when results are compared
LARGEST_STEP = np.array([0.5, 0.5, 0.5, 0.25, 0.25, 0.25])


@dataclass(frozen=True, eq=False)
class Solution:
    """Where an attempt ended.

    Arguments:
        size, position: (n, 3) float, metres.
        at: constraints linearised there; rounds: linearisations of the attempt.
        score: violations of the hard constraints and a little of the soft ones.
    """

    size: np.ndarray
    position: np.ndarray
    at: Linearised
    score: float
    rounds: int


def solve(start: Problem) -> Solution:
    """Move and size boxes until the constraints hold; the best attempt where they cannot all hold."""
    constraints = Constraints(start)
    handicap = constraints.handicap.copy()
    best: Solution | None = None
    through = 0
    spent = 0
    while best is None or spent < BUDGET:
        found = _descend(start, constraints, handicap, through, min(ROUNDS, max(BUDGET - spent - 1, 1)))
        spent += found.rounds
        if best is None or found.score < best.score:
            best = found
        if violation(found.at) == 0:
            break
        # Next time colliding pairs part along another axis; what still does not fit first walks through the others.
        stuck = np.flatnonzero((found.at.kind == COLLISION) & (found.at.value < -0.01))
        colliding = found.at.number[stuck]
        handicap[colliding, found.at.axis[colliding]] += 0.4
        if not len(stuck) or best is not found:
            through = THROUGH
    assert best is not None
    return best


def _descend(start: Problem, constraints: Constraints, handicap: np.ndarray, through: int, rounds: int) -> Solution:
    n = len(start.size)
    free = np.stack([~start.fixed] * 3 + [~start.rigid] * 3, 1).ravel()
    weight = np.tile([MOVE**-2] * 3 + [STRETCH**-2] * 3, n)[free]
    origin = np.concatenate((start.position, np.log(start.size)), 1)
    limit = np.tile([np.inf] * 3 + [LIMIT] * 3, n)[free]
    state = origin.copy()
    best: Solution | None = None
    before, last = np.inf, 0
    for number in range(rounds + 1):
        now_size, now_position = np.exp(state[:, 3:]), state[:, :3].copy()
        at = constraints.at(now_size, now_position, handicap)
        hard = violation(at)
        soft = float(np.abs(at.value[np.isin(at.kind, (WALL, CEILING))]).sum())  # missing to them, metres
        score = hard + SOFT * soft
        if best is None or score < best.score - 1e-9:
            best, last = Solution(now_size, now_position, at, score, number), number
        steady = number > 0 and hard < 1e-9 and (soft < 0.01 or abs(soft - before) < 0.005)
        before = soft
        if number == rounds or steady or number - max(last, through) > PATIENCE:
            break
        # Late rounds are damped: two constraints that take turns would otherwise swing for ever.
        damping = 1.0 if number < 6 + through else 4.0 * (number - through - 5)
        stiffness = STIFFNESS[at.kind]
        if number < through:
            stiffness = np.where(at.kind == COLLISION, 0.0, stiffness)
        moved = (state - origin).ravel()[free]
        step = newton(at.gradient[:, free], at.value, at.equal, stiffness, weight, moved, limit, damping)
        full = np.zeros(n * COLUMNS)
        full[free] = step
        state = state + np.clip(full.reshape(n, COLUMNS), -LARGEST_STEP, LARGEST_STEP)
        state[:, 3:] = np.clip(state[:, 3:], origin[:, 3:] - LIMIT, origin[:, 3:] + LIMIT)
    assert best is not None
    return replace(best, rounds=number + 1)


def violation(at: Linearised) -> float:
    """Sum of the violations of relations, collisions, floor and overhang, beyond a tolerance of 2 mm."""
    return float(np.maximum(-at.value[~at.equal] - 0.002, 0.0).sum())


def unmet(at: Linearised) -> int:
    """How many of them are missed by more than `UNMET`."""
    return int((at.value[~at.equal] < -UNMET).sum())


def newton(
    rows: Matrix, value: np.ndarray, equal: np.ndarray, stiffness: np.ndarray, weight: np.ndarray, moved: np.ndarray,
    limit: np.ndarray, damping: float,
) -> np.ndarray:  # fmt: skip
    """Exact minimiser of 1/2 |moved + d|^2_W + damping' |d|^2 + sum rho/2 hinge(-(value + rows d))^2 over d.

    Arguments:
        rows: (r, m) float, sparse or not; value, stiffness: (r,) float; equal: (r,) bool.
        weight, moved: (m,) float: cost of and present distance from the starting boxes; limit: the most of that.
        damping: factor >= 1 on the cost of this step.

    Returns: d (m,) float.
    """
    extra = (damping - 1.0) * weight
    step = np.zeros(len(weight))

    def cost(d: np.ndarray) -> tuple[float, np.ndarray]:
        """Of a step, and which rows and limits count there."""
        residual, there = value + rows @ d, moved + d
        past = np.maximum(np.abs(there) - limit, 0.0)
        active = np.concatenate([equal | (residual < 0), past > 0])
        own = (weight * there**2 + extra * d * d + LIMIT_STIFFNESS * past**2).sum()
        return 0.5 * (own + (stiffness * residual**2)[active[: len(value)]].sum()), active

    now, active = cost(step)
    for _ in range(20):
        row, hold = active[: len(value)], LIMIT_STIFFNESS * active[len(value) :]
        pull = weight * moved + hold * (moved - np.clip(moved + step, -limit, limit))
        target = _least(rows[row], stiffness[row], weight + extra + hold, value[row], pull)
        direction, length = target - step, 1.0
        for _ in range(12):
            after, following = cost(step + length * direction)
            if after <= now + 1e-12:
                break
            length *= 0.5
        else:
            return step
        same = length == 1.0 and bool((following == active).all())
        step, now, active = step + length * direction, after, following
        if same:
            break
    return step


def _least(
    rows: Matrix, stiffness: np.ndarray, diagonal: np.ndarray, value: np.ndarray, pull: np.ndarray
) -> np.ndarray:
    """The d (m,) with (rows' S rows + D) d = -rows' S value - pull."""
    if not isinstance(rows, np.ndarray):
        stiff = diags_array(stiffness) @ rows
        hessian = (rows.T @ stiff + diags_array(diagonal)).tocsc()
        factors = splu(hessian, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        found: np.ndarray = factors.solve(-(stiff.T @ value) - pull)
        return found
    scaled = rows * stiffness[:, None]
    hessian = rows.T @ scaled
    hessian[np.diag_indices_from(hessian)] += diagonal
    wanted = -scaled.T @ value - pull
    try:
        np.linalg.cholesky(hessian)
        solved: np.ndarray = np.linalg.solve(hessian, wanted)
    except np.linalg.LinAlgError:  # indefinite by rounding: stiff rows span more digits than a float has
        solved = np.linalg.lstsq(hessian, wanted, rcond=None)[0]
    return solved
