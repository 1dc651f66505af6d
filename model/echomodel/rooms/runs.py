"""Fitted runs: units flush side by side along walls and around corners, cut to the length there is, others over them.

A run is planned as a person plans a kitchen: which walls, in which order, how wide; the cheapest plans are for the
objective to judge. Lengths along a wall count from its first corner, metres.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, pairwise, product

import numpy as np

from echomodel.boxes2d import footprints
from echomodel.compiled import linear_sum_assignment
from echomodel.openings import Opening, free_area, signed_area
from echomodel.rooms.floor import Wall, walls_of
from echomodel.sizes import AISLE, LANDING, TALL, TRIANGLE, usual_range
from echomodel.vocabulary import Category

WORKTOP = 0.9  # metres
BEHIND = 0.005  # metres between the backs and their wall
CASING = 0.06  # metres that units keep from what blocks a wall
OVER_SILL = 0.3  # metres that a unit may reach over a window's sill: a tap
BLIND = 0.35  # metres of a corner's unit that stay free beside the run around the corner
LEAST_LEG = 0.55  # metres of wall that a run is begun at
WIDEST = 1.5  # metres of a unit that is stretched, where less does not fill the wall
SLIVER = 0.35  # metres of wall that are not left over beside a run
BUILT = 100  # plans of one room that are looked at with what hangs over them
Interval = tuple[float, float]
Obstacle = tuple[np.ndarray, float, float, bool]


@dataclass(frozen=True, eq=False)
class Run:
    """Where units stand and hang: which (m,) int, size and position of the bottom (m, 3), metres, yaw (m,); cost."""

    which: np.ndarray
    size: np.ndarray
    position: np.ndarray
    yaw: np.ndarray
    cost: float


@dataclass(frozen=True)
class Leg:
    """A part of a run: a wall, from where to where; of each end whether it `owns` a corner or `meets` another leg."""

    wall: int
    low: float
    high: float
    ends: tuple[str, str] = ("", "")

    @property
    def length(self) -> float:
        return self.high - self.low


@dataclass(frozen=True, eq=False)
class Site:
    """Walls to build at, and what is in the way.

    Arguments:
        polygon: (k, 2) float, corners of the floor, metres.
        obstacles: outline in plan (m, 2), from which to which height, metres, and whether it is a window.
    """

    polygon: np.ndarray
    obstacles: Sequence[Obstacle] = ()

    @cached_property
    def walls(self) -> tuple[Wall, ...]:
        """The sides of the floor, the inside to the left of each."""
        turned = self.polygon if signed_area(self.polygon) > 0 else self.polygon[::-1]
        return walls_of(tuple((float(x), float(z)) for x, z in turned))

    def blocked(self, wall: int, deep: float, low: float, high: float, *, glass: bool = False) -> list[Interval]:
        """Where something is in the way of units so deep from one height to another; of windows alone if `glass`."""
        at, out = self.walls[wall], []
        for shape, bottom, top, window in self.obstacles:
            if bottom >= high or top <= low or (glass and not window):
                continue
            off = shape - (at.x, at.z)
            along, away = off @ (at.dx, at.dz), off @ (math.sin(at.yaw), math.cos(at.yaw))
            if away.min() < deep - 1e-6 and away.max() > 1e-6 and along.max() > 0 and along.min() < at.length:
                out.append((float(along.min()) - CASING, float(along.max()) + CASING))
        return out

    def free(self, wall: int, deep: float, low: float, high: float) -> list[Interval]:
        """What is left of a wall."""
        return _without((0.0, self.walls[wall].length), self.blocked(wall, deep, low, high), LEAST_LEG)

    def ahead(self, wall: int, along: float, away: float) -> bool:
        """Whether a point before a wall lies on the floor."""
        x, z = self.walls[wall].point(along, away)
        inside = False
        for (x0, z0), (x1, z1) in zip(self.polygon, np.roll(self.polygon, -1, 0), strict=True):
            if (z0 > z) != (z1 > z) and x < x0 + (z - z0) / (z1 - z0) * (x1 - x0):
                inside = not inside
        return inside

    def shapes(self, deep: float) -> Iterator[tuple[Leg, ...]]:
        """One wall, two around a corner or opposite each other, three around two corners."""
        free = [self.free(k, deep, 0.0, WORKTOP) for k in range(len(self.walls))]
        for k, parts in enumerate(free):
            yield from ((Leg(k, lo, hi),) for lo, hi in parts)
        for one in range(len(self.walls)):
            two, three = (one + 1) % len(self.walls), (one + 2) % len(self.walls)
            if not (self._corner(one) and free[one] and free[two]):
                continue
            (a, b), (c, d) = free[one][-1], free[two][0]
            if b < self.walls[one].length - 1e-6 or c > 1e-6:
                continue
            yield Leg(one, a, b, ("", "owns")), Leg(two, deep, d, ("meets", ""))
            yield Leg(one, a, b - deep, ("", "meets")), Leg(two, c, d, ("owns", ""))
            wide = self.walls[two].length - 1e-6 < d > 2 * deep + AISLE and self._corner(two) and three != one
            if wide and free[three] and free[three][0][0] < 1e-6:
                yield (Leg(one, a, b - deep, ("", "meets")), Leg(two, c, d, ("owns", "owns")),
                       Leg(three, deep, free[three][0][1], ("meets", "")))  # fmt: skip
        for k, here in enumerate(self.walls):
            for m, there in enumerate(self.walls[:k]):
                apart = (there.x - here.x) * math.sin(here.yaw) + (there.z - here.z) * math.cos(here.yaw)
                if math.cos(here.yaw - there.yaw) < -0.99 and 2 * deep + AISLE < apart < 2 * deep + 2 * AISLE:
                    yield from ((Leg(m, *a), Leg(k, *b)) for a in free[m] for b in free[k])

    def _corner(self, wall: int) -> bool:
        """Whether the next wall leaves into the room at a right angle."""
        one, two = self.walls[wall], self.walls[(wall + 1) % len(self.walls)]
        return one.dx * two.dz - one.dz * two.dx > 0.999


def runs(
    kinds: Sequence[Category], size: np.ndarray, free: np.ndarray, site: Site, *,
    over: dict[int, int] | None = None, draft: np.ndarray | None = None,
    missed: Callable[[Run], float] | None = None, most: int = 12,
) -> list[Run]:  # fmt: skip
    """The best plans for the fitted units among n pieces, the cheapest first; none where they do not fit.

    Arguments:
        kinds: n rows of the vocabulary. size: (n, 3) float, metres; free: (n,) bool, those that may be cut.
        over: piece that hangs -> unit that it is told to hang over.
        draft: (n, 3) float, where the pieces are rather, None = anywhere. most: how many plans.
        missed: what a plan costs besides.
    """
    units = [i for i, kind in enumerate(kinds) if kind.stands == "row"]
    if len(units) < 2:
        return []
    planner = _Planner(kinds, _even(kinds, size, free), free, site, units, over or {}, draft)
    plans = sorted(planner.plans(), key=lambda plan: round(plan[0], 6))
    out: dict[tuple[object, ...], tuple[float, Run]] = {}
    for _, legs, parts in plans:
        alike = tuple((leg.wall, tuple(kinds[i].name for i in part)) for leg, part in zip(legs, parts, strict=True))
        if alike not in out:
            run = planner.built(legs, parts)
            out[alike] = run.cost + (missed(run) if missed else 0.0), run
        if len(out) == BUILT:
            break
    return [run for _, run in sorted(out.values(), key=lambda row: round(row[0], 6))[:most]]


def _even(kinds: Sequence[Category], size: np.ndarray, free: np.ndarray) -> np.ndarray:
    """(n, 3) float: what hangs in one line is as high and deep, high units are as high; they end at one height."""
    out = size.copy()
    groups: dict[str, list[int]] = {}
    for i in np.flatnonzero(free).tolist():
        if kinds[i].stands in ("row", "over"):
            groups.setdefault(kinds[i].name, []).append(i)
    for members in groups.values():
        out[members, 1:] = size[members, 1:].max(0)
    tops = [out[i, 1] for i, kind in enumerate(kinds) if kind.task == "store" and out[i, 1] > TALL]
    for i in (i for members in groups.values() for i in members if tops and _hangs(kinds[i])):
        low, high = usual_range(kinds[i].name)[1]
        out[i, 1] = min(max(max(tops) - kinds[i].mounted, low), high)
    return out


def _without(span: Interval, closed: Sequence[Interval], least: float) -> list[Interval]:
    """What is left of a span, as far as it is long enough."""
    left = [span]
    for a, b in closed:
        left = [part for lo, hi in left for part in ((lo, min(hi, a)), (max(lo, b), hi)) if part[1] > part[0]]
    return [part for part in left if part[1] - part[0] >= least]


def _hangs(kind: Category) -> bool:
    """Whether it is a cupboard above a worktop."""
    return kind.stands == "over" and kind.task == "store"


class _Planner:
    """Orders of units, legs for them, widths, and what each plan costs."""

    def __init__(
        self, kinds: Sequence[Category], size: np.ndarray, free: np.ndarray, site: Site, units: list[int],
        over: dict[int, int], draft: np.ndarray | None,
    ) -> None:  # fmt: skip
        self.kinds, self.size, self.free, self.site, self.units, self.over = kinds, size, free, site, units, over
        self.draft = draft
        self.deep = BEHIND + max(float(size[i, 2]) for i in units if size[i, 1] <= TALL or kinds[i].task != "cool")
        self.hung = [i for i, kind in enumerate(kinds) if kind.stands == "over" and kind.task]
        self.elastic = {i: bool(free[i]) and kinds[i].task in ("prepare", "store") for i in units}
        self.least = {i: usual_range(kinds[i].name)[0][0] if self.elastic[i] else float(size[i, 0]) for i in units}

    def task(self, i: int) -> str:
        return self.kinds[i].task

    def orders(self) -> list[tuple[int, ...]]:
        """Sequences of all units: what is high at the ends, the dishwasher at the sink, worktop about the hob."""
        high = [i for i in self.units if self.size[i, 1] > TALL]
        cold = [i for i in high if self.task(i) == "cool"]
        store = [i for i in high if i not in cold]
        wet = [i for i in self.units if self.task(i) == "wash"]
        beside = [i for i in self.units if self.task(i) == "rinse"]
        hot = [i for i in self.units if self.task(i) == "cook"]
        tops = [i for i in self.units if i not in (*high, *wet, *beside, *hot)]
        ends = [(high, []), (store, cold), (cold, store), ([], high)]
        found: dict[tuple[int, ...], None] = {}
        for left, right in ends:
            for sink in ([*wet, *beside], [*beside, *wet]):
                for a in range(len(tops) + 1):
                    for b in range(a, len(tops) + 1):
                        core = [*tops[:a], *sink, *tops[a:b], *hot, *tops[b:]]
                        for inner in (core, core[::-1]):
                            found[(*left, *inner, *right)] = None
        return list(found)

    def plans(self) -> Iterator[tuple[float, tuple[Leg, ...], tuple[tuple[int, ...], ...]]]:
        orders = self.orders()
        least = {order: np.cumsum([0.0, *(self.least[i] for i in order)]).tolist() for order in orders}
        for legs in self.site.shapes(self.deep):
            if sum(leg.length for leg in legs) < sum(self.least.values()):
                continue
            for order, cuts in product(orders, combinations(range(1, len(self.units)), len(legs) - 1)):
                ends = list(pairwise((0, *cuts, len(order))))
                if all(least[order][b] - least[order][a] < leg.length + 1e-6
                       for leg, (a, b) in zip(legs, ends, strict=True)):  # fmt: skip
                    parts = tuple(order[a:b] for a, b in ends)
                    cost = self.cost(legs, parts)
                    if cost is not None:
                        yield cost, legs, parts

    def widths(self, leg: Leg, part: Sequence[int]) -> np.ndarray | None:
        """(u,) float: how wide the units of a leg are, metres; None where they do not fit."""
        least, soft = np.array([self.least[i] for i in part]), np.array([self.elastic[i] for i in part])
        for at, end in zip((0, -1), leg.ends, strict=True):
            if end == "owns":
                if not soft[at] or self.size[part[at], 1] > TALL:
                    return None
                least[at] = max(least[at], self.deep + BLIND)
        want = np.where(soft, np.maximum(self.size[list(part), 0], least), least)
        spare, less = leg.length - want.sum(), want - least
        if spare < 0:
            return want + less * spare / max(less.sum(), 1e-9) if less.sum() > -spare - 1e-6 else None
        more = np.where(soft, np.maximum(WIDEST - want, 0.0), 0.0)
        if more.sum() < spare < more.sum() + SLIVER and soft.any():  # rather a wide unit than a gap beside a wall
            more += soft * (spare - more.sum()) / soft.sum()
        return want + more * min(spare / max(more.sum(), 1e-9), 1.0)

    def spans(self, leg: Leg, part: Sequence[int]) -> list[Interval] | None:
        """From where to where along its wall each unit of a leg stands."""
        widths = self.widths(leg, part)
        if widths is None:
            return None
        left = leg.length - widths.sum()
        start = leg.high - widths.sum() if leg.ends[1] else leg.low + left * (leg.low > 1e-6 and not leg.ends[0])
        return list(pairwise(np.cumsum([start, *widths]).tolist()))

    def cost(self, legs: Sequence[Leg], parts: Sequence[Sequence[int]]) -> float | None:
        """What a person objects to in a plan, without its distances to the rest of the room; None = it cannot be."""
        total, at, count = 0.15 * (len(legs) - 1), {}, len(legs)
        order = [i for part in parts for i in part]
        for leg, part in zip(legs, parts, strict=True):
            spans = self.spans(leg, part)
            if spans is None:
                return None
            length = self.site.walls[leg.wall].length
            left = leg.length - (spans[-1][1] - spans[0][0])
            total += 0.25 * left + 1.0 * (0.01 < left < SLIVER)
            for number, (i, (lo, hi)) in enumerate(zip(part, spans, strict=True)):
                inner = "meets" in (leg.ends[0] * (number == 0), leg.ends[1] * (number == len(part) - 1))
                high = self.site.blocked(leg.wall, float(self.size[i, 2]), WORKTOP, float(self.size[i, 1]))
                if any(lo < b and hi > a for a, b in high):  # a tap, too
                    return None
                if self.size[i, 1] > TALL:
                    total += 2.0 * inner + 1.0 * (count > 1 and i not in (order[0], order[-1]))
                elif self.task(i) == "cook":
                    sides = [self._top(part, spans, number, side) for side in (-1, 1)]
                    total += 1.5 * (max(sides) < LANDING) + 0.7 * (min(sides) < LANDING / 2) + 1.5 * inner
                    total += 1.0 * (min(lo, length - hi) < LANDING - 1e-6)
                    glass = self.site.blocked(leg.wall, self.deep, WORKTOP, 9.0, glass=True)
                    total += 2.0 * any(lo < b and hi > a for a, b in glass)
                elif self.task(i) == "wash":
                    glass = self.site.blocked(leg.wall, self.deep, WORKTOP, 9.0, glass=True)
                    total -= 0.4 * any(a < (lo + hi) / 2 < b for a, b in glass)
                elif self.task(i) == "rinse":
                    total += 0.6 * inner
                at[i] = self.site.walls[leg.wall].point((lo + hi) / 2, float(self.size[i, 2]))
            middle = (spans[0][0] + spans[-1][1]) / 2
            total += 4.0 * (not self.site.ahead(leg.wall, middle, self.deep + 0.75 * AISLE))
        for one, two in pairwise(order):
            total += 0.3 * ({self.task(one), self.task(two)} in ({"cook", "wash"}, {"cook", "cool"}))
        corners = [at[next(i for i in order if self.task(i) == task)]
                   for task in ("wash", "cook", "cool") if any(self.task(i) == task for i in order)]  # fmt: skip
        if len(corners) == 3:
            way = sum(math.dist(corners[k], corners[k - 1]) for k in range(3))
            total += max(TRIANGLE[0] - way, way - TRIANGLE[1], 0.0)
        if self.draft is not None:
            off = [math.dist(at[i], self.draft[i, [0, 2]]) for i in order]
            total += 0.1 * float(np.mean(off))
        return total

    def _top(self, part: Sequence[int], spans: Sequence[Interval], number: int, side: int) -> float:
        """Metres of worktop beside a unit of a leg."""
        out, k = 0.0, number + side
        while 0 <= k < len(part) and self.size[part[k], 1] <= TALL:
            out += spans[k][1] - spans[k][0]
            k += side
        return out

    def built(self, legs: Sequence[Leg], parts: Sequence[Sequence[int]]) -> Run:
        """The plan as boxes, with what hangs over it."""
        rows: list[tuple[int, int, Interval, float]] = []  # unit, wall, from where to where, height
        for leg, part in zip(legs, parts, strict=True):
            spans = self.spans(leg, part)
            assert spans is not None
            rows += [(i, leg.wall, span, 0.0) for i, span in zip(part, spans, strict=True)]
        cost = float(self.cost(legs, parts) or 0.0)
        hoods = [i for i in self.hung if not _hangs(self.kinds[i])]
        cooks = [row for row in rows if self.task(row[0]) == "cook"]
        hooded = list(zip(hoods, cooks, strict=False))
        over = [(i, wall, self._hood(i, span), self.kinds[i].mounted) for i, (_, wall, span, _) in hooded]
        over += self._wall_units(legs, rows, [row for row in over])
        every = [*rows, *over]
        which = np.array([row[0] for row in every])
        size = self.size[which].copy()
        size[:, 0] = [span[1] - span[0] for _, _, span, _ in every]
        walls = [self.site.walls[wall] for _, wall, _, _ in every]
        plan = np.array([wall.point((span[0] + span[1]) / 2, BEHIND + deep / 2)
                         for wall, (_, _, span, _), deep in zip(walls, every, size[:, 2], strict=True)])  # fmt: skip
        position = np.stack([plan[:, 0], [row[3] for row in every], plan[:, 1]], 1)
        return Run(which, size, position, np.array([wall.yaw for wall in walls]), cost + len(self.hung) - len(over))

    def _hood(self, i: int, span: Interval) -> Interval:
        half = (span[1] - span[0]) / 2 if self.free[i] else float(self.size[i, 0]) / 2
        middle = (span[0] + span[1]) / 2
        return middle - half, middle + half

    def _wall_units(
        self, legs: Sequence[Leg], rows: Sequence[tuple[int, int, Interval, float]],
        hoods: Sequence[tuple[int, int, Interval, float]],
    ) -> list[tuple[int, int, Interval, float]]:  # fmt: skip
        """Wall units in line over worktops: none over the hob, before a window, or through a high unit."""
        units = [i for i in self.hung if _hangs(self.kinds[i])]
        if not units:
            return []
        low, (_, high, deep) = self.kinds[units[0]].mounted, self.size[units].max(0)
        least = usual_range(self.kinds[units[0]].name)[0][0]
        gaps: list[tuple[int, Interval]] = []
        for leg in legs:
            mine = [(i, span) for i, wall, span, _ in rows if wall == leg.wall]
            closed = [span for i, span in mine if self.size[i, 1] > low or self.task(i) == "cook"]
            closed += [span for _, wall, span, _ in hoods if wall == leg.wall]
            closed += self.site.blocked(leg.wall, float(deep), low, low + float(high))
            start, end = mine[0][1][0], mine[-1][1][1]
            start = min(start, float(deep)) if leg.ends[0] == "meets" else start
            end = max(end, self.site.walls[leg.wall].length - float(deep)) if leg.ends[1] == "meets" else end
            gaps += [(leg.wall, part) for part in _without((start, end), closed, least)]
        count = [0] * len(gaps)
        for _ in units:  # each to where it is widest
            room = [(b - a) / (n + 1) for (_, (a, b)), n in zip(gaps, count, strict=True)]
            if room and max(room) >= least:
                count[int(np.argmax(np.round(room, 6)))] += 1
        places: list[tuple[int, Interval]] = []
        for (wall, (a, b)), n in zip(gaps, count, strict=True):
            step = min((b - a) / max(n, 1), WIDEST * 1.6)
            places += [(wall, (a + k * step, a + (k + 1) * step)) for k in range(n)]
        spans = {i: (wall, span) for i, wall, span, _ in rows}

        def aside(i: int, wall: int, span: Interval) -> float:
            at, (a, b) = spans.get(self.over.get(i, -1), (wall, span))
            return -max(min(b, span[1]) - max(a, span[0]), 0.0) if at == wall else 0.0

        cost = np.array([[aside(i, *place) for place in places] for i in units]).reshape(len(units), len(places))
        one, other = linear_sum_assignment(np.round(cost, 6))
        return [(units[i], *places[k], low) for i, k in zip(one.tolist(), other.tolist(), strict=True)]


def obstacles(
    polygon: np.ndarray, openings: Sequence[Opening], size: np.ndarray, position: np.ndarray, yaw: np.ndarray
) -> list[Obstacle]:
    """What openings in the edges of a floor and boxes (n, 3), (n, 3), (n,) that stand there take (`Site.obstacles`)."""
    out = [(shape, float(at[1]), float(at[1] + own[1]), False)
           for shape, own, at in zip(footprints(size, position, yaw), size, position, strict=True)]  # fmt: skip
    for one in openings:
        glass = one.kind == "window"
        bottom, top = (one.sill + OVER_SILL, one.sill + one.height) if glass else (0.0, math.inf)
        out.append((free_area(polygon, one), bottom, top, glass))
    return out
