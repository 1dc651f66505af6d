"""The constraints of a room, linearised at its present boxes: relations, collisions, floor, walls and support.

What the graph states has the margins of `echomodel.rules`, whose slopes are differences: all numbers of all rows are
moved at once. Headings stay, and so do the slopes of what stands apart, against a wall or on something.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from echomodel.boxes2d import CORNERS, axes, hull
from echomodel.floors import signed_distance
from echomodel.graph import Stated
from echomodel.late import Late
from echomodel.objective.support import ON_CEILING, ON_FLOOR, allowed_overlap
from echomodel.rules import rule_set
from echomodel.rules.geometry import PairGeometry, Spread
from echomodel.rules.margins import pair_margins
from echomodel.vocabulary import vocabulary
from echousd.place.geometry import COLUMNS, PLAN, SIDES, parting
from echousd.place.problem import Problem

csr_array, margin_of = Late("scipy.sparse:csr_array"), Late("echomodel.rules.placements:margin_of")
KINDS = RELATION, PLACEMENT, COLLISION, FLOOR, OVERHANG, WALL, SUPPORT, CEILING = range(8)  # from `WALL` on equalities
MANY = 60  # boxes beyond which gradients are sparse
PART = 0.002  # metres that pairs are parted farther than they may overlap
HANDLES = 0.05  # metres at the front of a box that handles and doors take, on which nothing can stand
ROUNDED = 0.02  # metres at its back, where a top with rounded corners may end before its box
NEIGHBOURS = 2.0  # metres by which neighbours at one wall rather part along it than one in front of the other
LONGEST_STEP = 0.6  # of any number in one round, metres or ratio
SLACK = 0.004  # metres or ratio by which what is told is to hold, so that rounding does not break it
NEARBY = 1e-6  # metres to either side at which slopes are measured

Matrix: TypeAlias = Any  # (r, m) float, an array of numpy or a sparse one


@dataclass(frozen=True, eq=False)
class Linearised:
    """Constraints value + gradient . step >= 0 (or = 0) around the present boxes, less those that no step can break.

    Arguments:
        value: (r,) float, metres or ratio, the wanted slack already taken off.
        gradient: (r, n * 6) float, by the positions and the logarithms of the sides; sparse for very many boxes.
        kind: (r,) int, one of `KINDS`.
        number: (r,) int, which one of its kind: row of the problem's triplets, of its pairs; of others any.
        axis: (p,) int, separating axis chosen for each pair.
    """

    value: np.ndarray
    gradient: Matrix
    kind: np.ndarray
    number: np.ndarray
    axis: np.ndarray

    @property
    def equal(self) -> np.ndarray:
        """(r,) bool, values that must be zero rather than not negative."""
        return self.kind >= WALL

    def boxes_of(self, row: int) -> set[int]:
        """The boxes that a constraint is about."""
        return {int(column) // COLUMNS for column in self.gradient[[row]].nonzero()[1]}


@dataclass(frozen=True, eq=False)
class Rows:
    """Constraints of one kind.

    Arguments:
        who: (r, k) int, the boxes that each is about.
        value: (r,) float, metres or ratio. by: (r, k, 6) float, its slopes by their positions and sides.
    """

    kind: int | np.ndarray
    who: np.ndarray
    value: np.ndarray
    by: np.ndarray


class Constraints:
    """The constraints of a room whose boxes keep their headings."""

    def __init__(self, start: Problem) -> None:
        self.problem, self.yaw = start, start.yaw
        self.axis = np.stack(axes(start.yaw), 1)
        self.parting = parting(self.axis, start.pairs)
        self.handicap, self.barred = self._handicap(start), self._barred()

    def _handicap(self, start: Problem) -> np.ndarray:
        """(p, 5) float, metres by which an axis has to part better than others: pairs pass over one another only where
        they do already; neighbours at one wall part along it."""
        wall, pairs = self.problem.wall, self.problem.pairs
        gap = np.einsum("psbc,pbc->ps", self.parting[:, 4], np.concatenate([start.position, start.size], 1)[pairs])
        (one, other), axis = wall[pairs].swapaxes(0, 1), self.axis[pairs].reshape(-1, 4, 2)
        across = np.abs(np.einsum("pad,pd->pa", axis, np.nan_to_num(one[:, 1]))) > 0.7
        aside = NEIGHBOURS * (across & (np.abs(one - other) < 1e-6).all((1, 2))[:, None])
        return np.concatenate([aside, np.where(gap.max(1) > -0.02, 0.0, np.inf)[:, None]], 1)

    def _barred(self) -> np.ndarray:
        """(p, 5, 2) bool: to which sides of the first of each pair the relations do not have the second."""
        triplets, pairs = self.problem.triplets, self.problem.pairs
        step = np.array([predicate.step for predicate in vocabulary().predicates])[triplets[:, 1]]
        order = np.zeros((len(self.yaw), len(self.yaw), 2))
        np.add.at(order, (triplets[:, 2], triplets[:, 0]), step)
        wanted = (order - order.swapaxes(0, 1))[pairs[:, 0], pairs[:, 1]]
        axis = self.axis[pairs].reshape(-1, 4, 2)
        along = (np.where(np.abs(axis) > 0.9, axis, 0.0) * wanted[:, None]).sum(-1)  # what runs along x or z
        out = np.zeros((len(pairs), 5, 2), bool)
        out[:, :4] = np.stack([along < 0, along > 0], -1)
        return out

    def at(self, size: np.ndarray, position: np.ndarray, handicap: np.ndarray) -> Linearised:
        """All constraints at the present boxes.

        Arguments:
            size, position: (n, 3) float, metres.
            handicap: (p, 5) float, metres by which a separating axis must be better to be chosen (inf = never).
        """
        state = np.concatenate([position, size], 1)
        apart, axis = self._apart(state, handicap)
        rows = [*self._relations(state), apart, *self._floor(state), self._walls(state), self._support(state)]
        return _linearised([*rows, self._overhang(state)], state, axis)

    def _relations(self, state: np.ndarray) -> list[Rows]:
        """Relations, and placements, for which furniture moves, but none grows or shrinks."""
        problem, triplets, found = self.problem, self.problem.triplets, []
        rules, ends = rule_set(problem.rules), triplets[:, [0, 2]]
        middle = np.array([problem.centre[0], 0.0, problem.centre[1]])

        def relations(boxes: np.ndarray) -> np.ndarray:
            times = len(boxes) // len(ends)
            (one, other), (yaw, turn) = boxes.swapaxes(0, 1), np.tile(self.yaw[ends], (times, 1)).T
            fronts = np.tile(problem.fronts[ends].all(1), times)
            pair = PairGeometry(
                one[:, 3:], other[:, 3:], one[:, :3] - middle, other[:, :3] - middle, yaw, turn, rules.oriented, fronts
            )
            return pair_margins(pair, np.tile(triplets[:, 1], times), rules)

        if len(triplets):
            margin, by = _with_slopes(relations, state[ends])
            found.append(Rows(RELATION, ends, margin - SLACK, by))
        for stated in problem.stated:
            who = [stated.subject, *stated.others]

            def placement(boxes: np.ndarray, stated: Stated = stated, who: list[int] = who) -> np.ndarray:
                poses = {box: Spread(boxes[:, at, 3:], boxes[:, at, :3], self.yaw[box].repeat(len(boxes)))
                         for at, box in enumerate(who)}  # fmt: skip
                return margin_of(stated, poses, problem.outline, problem.categories)

            if stated.others or problem.outline is not None:
                margin, by = _with_slopes(placement, state[[who]])
                by[..., 3:] = 0.0
                found.append(Rows(PLACEMENT, np.array([who]), margin - SLACK, by))
        return found

    def _apart(self, state: np.ndarray, handicap: np.ndarray) -> tuple[Rows, np.ndarray]:
        """Pairs, each parted along the axis and to the side that are best."""
        problem, row = self.problem, np.arange(len(self.problem.pairs))
        gap = np.einsum("pasbc,pbc->pas", self.parting, state[problem.pairs])
        side = np.where(self.barred, -np.inf, gap).argmax(2)
        gap = np.take_along_axis(gap, side[..., None], 2)[..., 0]
        axis = (gap - handicap).argmax(1)
        head = problem.plan.stands("head")[problem.pairs].any(1)  # a bed moved off its nightstand would leave its wall
        allowed = np.where(head, 0.0, allowed_overlap(problem.categories, state[:, 3:], problem.pairs))
        value = gap[row, axis] + allowed - PART
        return Rows(COLLISION, problem.pairs, value, self.parting[row, axis, side[row, axis]]), axis

    def _floor(self, state: np.ndarray) -> list[Rows]:
        """Corners of footprints within the floor, and corners of the floor that look into it outside of footprints."""
        floor, who = self.problem.outline, np.flatnonzero(~self.problem.fixed)
        if floor is None:
            return []
        place, side, axis = state[who][:, PLAN], state[who][:, SIDES], self.axis[who]
        arm = np.array(CORNERS)[:, :, None] / 2 * axis[:, None]  # of each corner, for a metre of each side
        point = place[:, None] + np.einsum("ncsd,ns->ncd", arm, side)
        inside, slopes = _with_slopes(
            lambda points: signed_distance(points.swapaxes(0, 1), floor.polygon[None])[0], point.reshape(-1, 1, 2)
        )
        way = slopes.reshape(-1, 4, 2)
        by = np.zeros((*way.shape[:2], COLUMNS))
        by[..., PLAN], by[..., SIDES] = way, np.einsum("ncd,ncsd->ncs", way, arm)
        found = [_of_one(FLOOR, who.repeat(4), inside, by.reshape(-1, COLUMNS))]
        if len(floor.reflex):
            local = np.einsum("nsd,nrd->nrs", axis, floor.reflex - place[:, None])
            off = np.abs(local) - side[:, None] / 2
            by = np.zeros((*off.shape, COLUMNS))
            by[..., PLAN] = -np.sign(local)[..., None] * axis[:, None]
            by[..., 0, 3], by[..., 1, 5] = -0.5, -0.5
            best = off.argmax(2)[..., None]
            by, off = np.take_along_axis(by, best[..., None], 2), np.take_along_axis(off, best, 2)
            found.append(_of_one(FLOOR, who.repeat(len(floor.reflex)), off.ravel(), by.reshape(-1, COLUMNS)))
        return found

    def _walls(self, state: np.ndarray) -> Rows:
        """The backs of what leans on a wall as far from it as they are meant to be."""
        problem = self.problem
        who = np.flatnonzero(~problem.fixed & ~np.isnan(problem.wall[:, 0, 0]))
        (start, normal), by = problem.wall[who].transpose(1, 0, 2), np.zeros((len(who), COLUMNS))
        by[:, PLAN], by[:, SIDES] = normal, -np.abs(np.einsum("nsd,nd->ns", self.axis[who], normal)) / 2
        return _of_one(WALL, who, (by * state[who]).sum(1) - (start * normal).sum(1) - problem.behind[who], by)

    def _support(self, state: np.ndarray) -> Rows:
        """Bottoms on the floor or on what carries them, tops of what hangs at the ceiling."""
        problem, carrier = self.problem, self.problem.carrier
        hangs = (carrier == ON_CEILING) & (problem.height is not None)
        who = np.flatnonzero(~problem.fixed & ((carrier >= ON_FLOOR) | hangs))
        on, hung, by = carrier[who] >= 0, hangs[who], np.zeros((len(who), 2, COLUMNS))
        by[:, 0, 1], by[hung, 0, 4] = 1.0, 1.0
        by[on, 1, 1], by[on, 1, 4] = -1.0, -1.0
        ends = np.stack([who, np.where(on, carrier[who], who)], 1)
        value = (by * state[ends]).sum((1, 2)) - np.where(hung, problem.height or 0.0, 0.0)
        return Rows(np.where(hung, CEILING, SUPPORT), ends, value, by)

    def _overhang(self, state: np.ndarray) -> Rows:
        """Footprints of what stands on something within that one's, or the middle where it is the larger one; none
        grows or shrinks for it."""
        problem = self.problem
        who = np.flatnonzero(problem.carrier >= 0)
        who = who[~(problem.fixed[who] & problem.fixed[problem.carrier[who]])]
        on = problem.carrier[who]
        reach = hull(state[who][:, SIDES] / 2, self.yaw[who] - self.yaw[on])
        room = (state[on][:, SIDES] / 2 - reach)[..., None] - [[0.0, 0.0], [HANDLES, ROUNDED]]
        by = np.zeros((*room.shape, 2, COLUMNS))  # along both sides of the one below, to its right or front and back
        by[..., 0, PLAN] = self.axis[on][:, :, None] * [[-1.0], [1.0]]
        by[..., 1, PLAN] = -by[..., 0, PLAN]
        ends = np.stack([who, on], 1).repeat(4, 0)
        by = by.reshape(-1, 2, COLUMNS)
        return Rows(OVERHANG, ends, np.maximum(room, 0.02).ravel() + (by * state[ends]).sum((1, 2)), by)


def _of_one(kind: int, who: np.ndarray, value: np.ndarray, by: np.ndarray) -> Rows:
    """Rows about one box each: numbers (r,), values (r,), slopes (r, 6)."""
    return Rows(kind, who[:, None], value, by[:, None])


def _with_slopes(margin: Callable[[np.ndarray], np.ndarray], at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Margins (r,) and their slopes (r, k, c) at numbers (r, k, c), of what gives the margins of many times r rows."""
    rows, numbers = len(at), int(np.prod(at.shape[1:]))
    off = NEARBY * np.concatenate([np.zeros((1, numbers)), np.eye(numbers), -np.eye(numbers)])
    found = margin((at + off.reshape(-1, 1, *at.shape[1:])).reshape(-1, *at.shape[1:])).reshape(2 * numbers + 1, rows)
    ahead, behind = found[1:].reshape(2, numbers, rows)
    return found[0], ((ahead - behind) / (2 * NEARBY)).T.reshape(at.shape)


def _linearised(every: Sequence[Rows], state: np.ndarray, axis: np.ndarray) -> Linearised:
    """Rows below one another as `Linearised`, by the logarithms of the sides."""
    scale = np.concatenate([np.ones((len(state), 3)), state[:, 3:]], 1)
    kept: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    gradient: Matrix = np.zeros((sum(len(rows.value) for rows in every), *state.shape))
    first = 0
    for rows in every:
        by, kind = rows.by * scale[rows.who], np.broadcast_to(rows.kind, len(rows.value))
        near = np.flatnonzero((kind >= WALL) | (rows.value <= LONGEST_STEP * np.abs(by).sum((1, 2))))
        kept.append((rows.value[near], kind[near], near))
        for end in range(by.shape[1]):
            gradient[np.arange(first, first + len(near)), rows.who[near, end]] += by[near, end]
        first += len(near)
    value, kind, number = (np.concatenate(part) for part in zip(*kept, strict=True))
    gradient = gradient[:first].reshape(first, state.size)
    if len(state) > MANY:
        gradient = csr_array(gradient)
    return Linearised(value, gradient, kind, number, axis)
