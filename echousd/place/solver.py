"""Least movement that satisfies the constraints: sequential quadratic programming with an active-set inner solver.

Each round linearises every constraint (`constraints.linearise`) and solves
min 1/2 |step|^2_W + sum_r rho_r/2 violation_r^2, whose minimum is found exactly by Newton steps over the active set
because the objective is piecewise quadratic. The weights rho are so large that a constraint which can be met is met.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse.linalg import splu

from echousd.place.constraints import (
    CEILING,
    COLLISION,
    FLOOR,
    LONGEST_STEP,
    MANY,
    OVERHANG,
    PLACEMENT,
    RELATION,
    SUPPORT,
    WALL,
    Linearised,
    Matrix,
    linearise,
    stacked_rows,
)
from echousd.place.geometry import COLUMNS
from echousd.place.problem import Posed


@dataclass(frozen=True)
class PlaceConfig:
    """How far and how hard boxes are pushed.

    Arguments:
        move: metres that cost as much as `stretch`.
        stretch: change of the logarithm of a size that costs as much as `move`.
        limit: largest change of the logarithm of a size.
        slack: metres or ratio by which relations are to hold.
        arrange: first choose for every piece among the places that a person would try; False = only by millimetres.
        rounds: most linearisations in one attempt; patience: how many of them without progress end it.
        budget: most linearisations in all attempts together: what a room may cost, the same on every machine.
        without: names of terms of the objective that the search does not see, so that others can judge by them.
    """

    move: float = 0.3
    stretch: float = 0.12
    limit: float = 0.4
    slack: float = 0.004
    rounds: int = 16
    arrange: bool = True
    patience: int = 6
    budget: int = 26
    without: frozenset[str] = frozenset()


# Stiffness of each kind of constraint; walls and ceilings give way to relations and collisions.
STIFFNESS = {
    RELATION: 1e5,
    COLLISION: 1e5,
    FLOOR: 1e5,
    WALL: 3e2,
    SUPPORT: 1e5,
    CEILING: 1e3,
    OVERHANG: 1e4,
    PLACEMENT: 1e5,
}
LIMIT_STIFFNESS = 1e6
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


def solve(start: Posed, config: PlaceConfig) -> Solution:
    """Move and size boxes until the constraints hold; the best attempt where they cannot all hold."""
    handicap = start.problem.handicap.copy()
    best: Solution | None = None
    through = 0
    spent = 0
    while best is None or spent < config.budget:
        left = replace(config, rounds=min(config.rounds, max(config.budget - spent - 1, 1)))
        found = _descend(start, handicap, through, left)
        spent += found.rounds
        if best is None or found.score < best.score:
            best = found
        if violation(found.at) == 0:
            break
        # Next time colliding pairs part along another axis; what still does not fit first walks through the others.
        stuck = np.flatnonzero((found.at.kind == COLLISION) & (found.at.value < -0.01))
        colliding = found.at.pair[stuck - (int(np.argmax(found.at.kind == COLLISION)) if len(stuck) else 0)]
        handicap[colliding, found.at.axis[colliding]] += 0.4
        if not len(stuck) or best is not found:
            through = THROUGH
    assert best is not None
    return best


def _descend(start: Posed, handicap: np.ndarray, through: int, config: PlaceConfig) -> Solution:
    problem, n = start.problem, len(start.size)
    free = np.stack([~problem.fixed] * 3 + [~problem.rigid] * 3, 1).ravel()
    weight = np.tile([config.move**-2] * 3 + [config.stretch**-2] * 3, n)[free]
    origin = np.concatenate((start.position, np.log(start.size)), 1)
    stiffnesses = np.array([STIFFNESS[kind] for kind in range(len(STIFFNESS))])
    sides = np.eye(n * COLUMNS).reshape(n, COLUMNS, -1)[:, 3:].reshape(3 * n, -1)
    bounds = np.concatenate((-sides, sides))
    bounds = sparse.csr_array(bounds) if n > MANY else bounds
    state = origin.copy()
    best: Solution | None = None
    before, last = np.inf, 0
    for number in range(config.rounds + 1):
        now_size, now_position = np.exp(state[:, 3:]), state[:, :3].copy()
        at = linearise(problem, now_size, now_position, start.yaw, handicap=handicap, slack=config.slack)
        hard, soft = violation(at), unmet(at)
        score = hard + SOFT * soft
        if best is None or score < best.score - 1e-9:
            best, last = Solution(now_size, now_position, at, score, number), number
        steady = number > 0 and hard < 1e-9 and (soft < 0.01 or abs(soft - before) < 0.005)
        before = soft
        if number == config.rounds or steady or number - max(last, through) > config.patience:
            break
        # Late rounds are damped: two constraints that take turns would otherwise swing for ever.
        damping = 1.0 if number < 6 + through else 4.0 * (number - through - 5)
        stiffness = stiffnesses[at.kind]
        if number < through:
            stiffness = np.where(at.kind == COLLISION, 0.0, stiffness)
        grown = (state - origin)[:, 3:].ravel()
        step = newton(
            stacked_rows((at.gradient, bounds))[:, free],
            np.concatenate((at.value, config.limit - grown, config.limit + grown)),
            np.concatenate((at.equal, np.zeros(6 * n, bool))),
            np.concatenate((stiffness, np.full(6 * n, LIMIT_STIFFNESS))),
            weight,
            (state - origin).ravel()[free],
            damping,
        )
        full = np.zeros(n * COLUMNS)
        full[free] = step
        state = state + np.clip(full.reshape(n, COLUMNS), -LARGEST_STEP, LARGEST_STEP)
        state[:, 3:] = np.clip(state[:, 3:], origin[:, 3:] - config.limit, origin[:, 3:] + config.limit)
    assert best is not None
    return replace(best, rounds=number + 1)


def violation(at: Linearised) -> float:
    """Sum of the violations of relations, collisions, floor and overhang, beyond a tolerance of 2 mm."""
    hard = ~at.equal
    return float(np.maximum(-at.value[hard] - 0.002, 0.0).sum())


def unmet(at: Linearised) -> float:
    """Sum of what is missing to the walls and the ceiling, metres."""
    return float(np.abs(at.value[np.isin(at.kind, (WALL, CEILING))]).sum())


def newton(
    gradient: np.ndarray,
    value: np.ndarray,
    equal: np.ndarray,
    stiffness: np.ndarray,
    weight: np.ndarray,
    moved: np.ndarray,
    damping: float,
) -> np.ndarray:
    """Exact minimiser of 1/2 |moved + d|^2_W + damping' |d|^2 + sum rho/2 hinge(-(value + gradient d))^2 over d.

    Arguments:
        gradient: (r, m) float, sparse or not; value, stiffness: (r,) float; equal: (r,) bool.
        weight, moved: (m,) float: price of and present distance from the starting boxes.
        damping: factor >= 1 on the price of this step.

    Returns: d (m,) float.
    """
    extra = (damping - 1.0) * weight
    # Rows that no step of the allowed length can violate never become active.
    far = value - LONGEST_STEP * np.asarray(abs(gradient).sum(1)).ravel() > 0
    keep = equal | ~far
    gradient, value, equal, stiffness = gradient[keep], value[keep], equal[keep], stiffness[keep]
    step = np.zeros(len(weight))

    def cost(d: np.ndarray) -> tuple[float, np.ndarray]:
        residual = value + gradient @ d
        active = equal | (residual < 0)
        total = 0.5 * (weight * (moved + d) ** 2).sum() + 0.5 * (extra * d * d).sum()
        return total + 0.5 * (stiffness[active] * residual[active] ** 2).sum(), active

    now, active = cost(step)
    for _ in range(20):
        rows = gradient[active]
        target = _least(rows, stiffness[active], weight + extra, value[active], weight * moved)
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
    if sparse.issparse(rows):
        stiff = sparse.diags_array(stiffness) @ rows
        hessian = (rows.T @ stiff + sparse.diags_array(diagonal)).tocsc()
        factors = splu(hessian, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        found: np.ndarray = factors.solve(-(stiff.T @ value) - pull)
        return found
    scaled = rows * stiffness[:, None]
    hessian = rows.T @ scaled
    hessian[np.diag_indices_from(hessian)] += diagonal
    wanted = -scaled.T @ value - pull
    try:
        solved: np.ndarray = cho_solve(cho_factor(hessian, check_finite=False), wanted)
    except np.linalg.LinAlgError:  # indefinite by rounding: stiff rows span more digits than a float has
        solved = np.linalg.lstsq(hessian, wanted, rcond=None)[0]
    return solved
