"""A room to be arranged: what stays the same while poses are tried, and where its boxes stand so far."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from echomodel.objective.access import TALL
from echomodel.objective.company import PLACE
from echomodel.objective.plan import kind_of
from echomodel.objective.support import ON_FLOOR, shared_fraction
from echomodel.openings import STEP, WINDOW_DEPTH, Opening, inward_normal, segment
from echomodel.vocabulary import Category, vocabulary
from echousd.repair.distances import BEHIND, kept_behind
from echousd.repair.geometry import Floor, axes
from echousd.repair.problem import Posed, required_order

if TYPE_CHECKING:
    from echomodel.rules.placements import Stated, Walls

MASSIVE = ("sofa", "board", "bed", "storage")
TOGETHER = {"sofa", "board", "bed", "seat"}
BACKLIT = 1.2  # for a screen before a window
CIRCLE = ("company", "with", "beside", "foot")  # who stands so sits in one circle with its group


@dataclass(frozen=True, eq=False)
class Zones:
    """Boxes that others should keep out of.

    Arguments:
        size, position: (z, 3) float, metres; yaw: (z,) float, radians.
        price: (z,) float, what it costs to stand in one. owner: (z,) int, the box that it belongs to, -1 = an opening.
    """

    size: np.ndarray
    position: np.ndarray
    yaw: np.ndarray
    price: np.ndarray
    owner: np.ndarray


@dataclass(frozen=True, eq=False)
class Setting:
    """What stays the same.

    Arguments:
        categories: n canonical category words.
        size: (n, 3) float, metres. draft, heading: (n, 3) and (n,) float, where the boxes were drawn: the preference.
        triplets: (e, 3) int, what must hold; rules: their rule set; centre: (2,) float, x and z of the room's centre.
        fixed, turned: (n,) bool, boxes that must not move, must not turn.
        floor: the floor polygon; height: of the ceiling, metres.
        carrier, behind: (n,) int and float, as in `Problem`, the latter spread. anchor: (n,) int, what each stands on,
            or whom it attends, -1 = nobody.
        stances: how each stands to that (`Plan.stance`). group: (n,) int, the box that its group is about.
        stated: where single objects must stand in the room; surroundings: the walls that this is measured to.
        openings: doors and windows. outline: (k, 2) float, the floor's corners in the order that these count edges in.
    """

    categories: tuple[str, ...]
    size: np.ndarray
    draft: np.ndarray
    heading: np.ndarray
    triplets: np.ndarray
    rules: str
    centre: np.ndarray
    fixed: np.ndarray
    turned: np.ndarray
    floor: Floor
    height: float
    carrier: np.ndarray
    behind: np.ndarray
    anchor: np.ndarray
    stances: tuple[str, ...]
    group: np.ndarray
    openings: Sequence[Opening]
    outline: np.ndarray
    stated: tuple[Stated, ...]
    surroundings: Walls

    @cached_property
    def kinds(self) -> tuple[Category, ...]:
        """Rows of the vocabulary."""
        return tuple(kind_of(word) for word in self.categories)

    @cached_property
    def shared(self) -> np.ndarray:
        """(n, n) float: depth in metres to which two boxes may overlap; without bound for a carrier and its load."""
        n = len(self.categories)
        out = np.zeros((n, n))
        for i in range(n):
            for j in range(i):
                share, owner = shared_fraction(self.kinds[i], self.kinds[j])
                side = self.size[(i, j)[owner]]
                out[i, j] = out[j, i] = share * min(side[0], side[2])
                strange = self.anchor[i] != j and self.anchor[j] != i  # chairs are tucked under their own table
                if strange or "head" in (self.stances[i], self.stances[j]):  # solid pieces would be moved apart later
                    out[i, j] = out[j, i] = 0.0
                if self.carrier[i] == j or self.carrier[j] == i:
                    out[i, j] = out[j, i] = np.inf
        return out

    @cached_property
    def order(self) -> np.ndarray:
        """(n, n, 2) float: sign that the relations ask of (second - first) in x and z, 0 = none."""
        return required_order(len(self.categories), self.triplets)

    @cached_property
    def rows(self) -> dict[tuple[str, int, float], list[tuple[float, float, float, float]]]:
        """Poses that only the room and the box decide, kept when they are asked for again."""
        return {}

    @cached_property
    def cells(self) -> dict[str, tuple[np.ndarray, np.ndarray, float]]:
        """Points of the floor, kept when they are asked for again (`spread`)."""
        return {}

    @cached_property
    def slots(self) -> dict[tuple[int, int], list[tuple[float, float, float, float]]]:
        """Slots of a box at what it attends, kept when they are asked for again (`attending.slots_at`)."""
        return {}

    @cached_property
    def spots(self) -> dict[tuple[int, int], tuple[np.ndarray, int]]:
        """(S, 2) the distinct places among them, the good ones first, and how many these are (`outlook.missing`)."""
        return {}

    @cached_property
    def seats(self) -> np.ndarray:
        """(n,) bool, pieces of the role seat."""
        return np.array([kind.role == "seat" for kind in self.kinds], bool)

    @cached_property
    def hanging(self) -> np.ndarray:
        """(n,) bool, lamps of the ceiling that go where what they light goes."""
        return np.array([kind.support == "ceiling" for kind in self.kinds], bool) & ~self.fixed

    @cached_property
    def sitting(self) -> np.ndarray:
        """(n,) float: how many sit on each piece that is a seat."""
        return np.maximum(np.round(self.size[:, 0] / PLACE), 1.0)

    @cached_property
    def at_home(self) -> np.ndarray:
        """(n, n) bool: fronts are open to each other, as one attends the other or both sit in one circle."""
        n = len(self.kinds)
        circle = np.array([stance in CIRCLE for stance in self.stances], bool)
        out = (self.group[:, None] == self.group) & (circle[:, None] | circle)
        for i in range(n):
            for j in range(i):
                if self.anchor[i] == j or self.anchor[j] == i:
                    guest = i if self.anchor[i] == j else j
                    out[i, j] = self.stances[guest] not in ("near", "opposite")
                    guest = j if self.anchor[j] == i else i
                    out[j, i] = self.stances[guest] not in ("near", "opposite")
        return out

    @cached_property
    def told(self) -> tuple[tuple[np.ndarray, np.ndarray, np.ndarray], ...]:
        """For each box its relations (r, 3) int, their other ends (r,) int and whether they name a side (r,) bool.

        Without those of sizes, which hold or not wherever it stands.
        """
        words = vocabulary().predicates
        sided = np.array([any(predicate.step) for predicate in words], bool)
        placed = np.array([predicate.measures != "size" for predicate in words], bool)[self.triplets[:, 1]]
        out = []
        for i in range(len(self.kinds)):
            rows = self.triplets[(self.triplets[:, [0, 2]] == i).any(1) & placed]
            out.append((rows, np.where(rows[:, 0] == i, rows[:, 2], rows[:, 0]), sided[rows[:, 1]]))
        return tuple(out)

    @cached_property
    def laid(self) -> np.ndarray:
        """(n,) bool, tables at which two or more sit."""
        seats = np.array([kind.stands == "at" for kind in self.kinds])
        counts = [int((seats & (self.anchor == i)).sum()) for i in range(len(self.kinds))]
        return np.array(counts) > 1

    @cached_property
    def fronts(self) -> np.ndarray:
        """(n,) bool, which of the boxes have a front."""
        return np.array([kind.front for kind in self.kinds], bool)

    @cached_property
    def wishes(self) -> tuple[np.ndarray, np.ndarray]:
        """(n, n) and (n, n) float: metres wished for between pieces of different groups, and the price of none."""
        n = len(self.kinds)
        wish, dear = np.zeros((n, n)), np.zeros((n, n))
        for i in range(n):
            for j in range(i):
                aside = {self.stances[i], self.stances[j]} & {"near", "opposite"}
                if (self.group[i] != self.group[j] or aside) and self.standing(i) and self.standing(j):
                    wish[i, j], dear[i, j] = self._wished(i, j)
                    if self.group[i] == self.group[j]:
                        wish[i, j] = min(wish[i, j], 0.5)
        return wish + wish.T, dear + dear.T

    def _wished(self, i: int, j: int) -> tuple[float, float]:
        one, other = self.kinds[i].role, self.kinds[j].role
        if one == other == "board" and self.kinds[i].access and self.kinds[j].access:  # two desks stand in a row
            return 0.0, 0.0
        if (self.laid[i] or self.laid[j]) and one in MASSIVE and other in MASSIVE:
            return (0.9 if "before" in (self.stances[i], self.stances[j]) else 1.1), 1.8
        if {one, other} <= TOGETHER:
            return 0.7, 1.4
        if {one, other} == {"seat", "storage"}:
            return 0.5, 0.9
        return (0.3, 0.6) if {one, other} & {"light", "decor"} and {one, other} & TOGETHER else (0.0, 0.0)

    @cached_property
    def movable(self) -> np.ndarray:
        """(n,) bool, seats that are moved aside to open something."""
        return np.array([kind.role == "seat" and not kind.access for kind in self.kinds])

    @cached_property
    def walls(self) -> list[tuple[np.ndarray, np.ndarray, float, float]]:
        """Start (2,), direction (2,), length and the heading of what stands with its back to it, for each wall."""
        start = self.floor.polygon
        edge = np.roll(start, -1, 0) - start
        length = np.linalg.norm(edge, axis=1)
        yaw = np.arctan2(self.floor.normal[:, 0], self.floor.normal[:, 1])
        return [(start[k], edge[k] / length[k], float(length[k]), float(yaw[k])) for k in range(len(start))]

    @cached_property
    def grain(self) -> float:
        """Heading of the longest wall, radians: free furniture stands parallel to it."""
        return max(self.walls, key=lambda wall: wall[2])[3]

    @cached_property
    def doors(self) -> Zones:
        """What doors, passages and windows need."""
        rows = []
        polygon = self.outline
        for opening in self.openings:
            near, far = segment(polygon, opening)
            normal = inward_normal(polygon, opening.edge)
            if opening.kind == "window":
                depth, low, tall, price = WINDOW_DEPTH, opening.sill + TALL, opening.height, 4.0
            else:
                swings = opening.kind == "door" and opening.swing == "in"
                depth, low, tall, price = (opening.width if swings else STEP), 0.02, opening.height, 6.0
            middle = (near + far) / 2 + normal * depth / 2
            rows.append((opening.width, tall, depth, middle[0], low, middle[1], np.arctan2(*normal), price))
        table = np.array(rows).reshape(-1, 8)
        return Zones(table[:, :3], table[:, 3:6], table[:, 6], table[:, 7], np.full(len(table), -1))

    @cached_property
    def windows(self) -> Zones:
        """Where a screen would have the light behind it: all the way down before windows."""
        doors = self.doors
        rows = np.array([opening.kind == "window" for opening in self.openings], bool)
        size, position = doors.size[rows].copy(), doors.position[rows].copy()
        size[:, 1], position[:, 1] = size[:, 1] + position[:, 1], 0.0
        return Zones(size, position, doors.yaw[rows], np.full(len(size), BACKLIT), doors.owner[rows])

    def standing(self, i: int) -> bool:
        """Whether a box stands on the floor itself."""
        return bool(self.carrier[i] == ON_FLOOR)


def setting_of(at: Posed, turned: np.ndarray, *, openings: Sequence[Opening], outline: np.ndarray) -> Setting:
    """The setting of a posed problem with a floor, whose boxes were drawn where they stand.

    Arguments:
        turned: (n,) bool, headings that are stated. openings, outline: as in `Setting`.
    """
    from echomodel.objective import plan_of

    problem = at.problem
    assert problem.floor is not None
    assert problem.surroundings is not None
    plan = plan_of(at, problem.categories, problem.floor.polygon, (), problem.triplets)
    top = float((at.position[:, 1] + at.size[:, 1]).max(initial=0.0))
    spread = kept_behind(problem.categories, at.size, np.full(len(at.size), np.nan))  # drawn ones are too alike
    told = np.isin(np.arange(len(spread)), [one.subject for one in problem.stated if not one.others])  # of walls
    behind = np.where(problem.fixed, problem.behind, np.where(told, np.minimum(spread, BEHIND[1]), spread))
    anchor = np.where(problem.carrier >= 0, problem.carrier, plan.anchor.numpy())
    return Setting(
        problem.categories, at.size, at.position, at.yaw, problem.triplets, problem.rules, problem.centre,
        problem.fixed, turned, problem.floor, problem.height or top, problem.carrier, behind,
        anchor, plan.stance, plan.group.numpy(), openings, outline, problem.stated, problem.surroundings,
    )  # fmt: skip


@dataclass(eq=False)
class State:
    """Where the boxes stand so far.

    Arguments:
        position: (n, 3) float, yaw: (n,) float; placed: (n,) bool, others stand where they are expected.
        regrets: box -> poses that led to a bad end in earlier rounds: x, z, yaw and what that cost.
        along: (n,) bool, boxes that move as one with the box that is priced, so that nothing changes between them.
        bills, zones: what was computed for states and poses before (`groups.paid_by`, `costs.fronts`).
    """

    position: np.ndarray
    yaw: np.ndarray
    placed: np.ndarray
    regrets: dict[int, list[tuple[float, float, float, float]]]
    along: np.ndarray = field(init=False)
    bills: dict[tuple[object, ...], float] = field(default_factory=dict)
    zones: dict[tuple[object, ...], list[tuple[float, ...]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.along = np.zeros(len(self.yaw), bool)


@dataclass(frozen=True, eq=False)
class Poses:
    """K poses of one box: position (K, 3) float, yaw (K,) float, and what each costs by itself (K,) float."""

    position: np.ndarray
    yaw: np.ndarray
    price: np.ndarray

    def __len__(self) -> int:
        return len(self.yaw)

    @cached_property
    def axes(self) -> np.ndarray:
        """(K, 2, 2) float: unit vectors of the width axis and of the front, as `geometry.axes`."""
        return axes(self.yaw)

    @cached_property
    def turns(self) -> tuple[np.ndarray, np.ndarray]:
        """(K, 1) and (K, 1) float: cosine and sine of the headings."""
        return np.cos(self.yaw)[:, None], np.sin(self.yaw)[:, None]

    @classmethod
    def of(cls, rows: Sequence[tuple[float, float, float, float]], height: float) -> Poses:
        """Poses from (x, z, yaw, price) with their bottom at `height`."""
        table = np.asarray(rows, float).reshape(-1, 4)
        position = np.stack([table[:, 0], np.full(len(table), height), table[:, 1]], -1)
        return cls(position, table[:, 2], table[:, 3])

    def take(self, rows: np.ndarray) -> Poses:
        """The poses of these numbers."""
        return Poses(self.position[rows], self.yaw[rows], self.price[rows])
