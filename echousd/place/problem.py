"""A problem of placing: what is fixed, what stands on what, on which wall each piece leans, who may overlap whom."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from echomodel.boxes2d import axes, footprints, seen
from echomodel.graph import Stated
from echomodel.objective import Plan, plan_of
from echomodel.objective.support import FREE, ON_FLOOR, carriers, stacked
from echomodel.openings import Opening
from echomodel.rules import measured
from echomodel.rules.geometry import Spread
from echomodel.vocabulary import vocabulary
from echousd.place.distances import BEHIND, kept_behind
from echousd.place.geometry import Floor, pair_indices

WALL_REACH = 0.6  # metres: wall furniture further from every wall behind it stands free
WALL_TURN = np.radians(25.0)  # a piece turned further away from the wall's normal does not lean on it


def _of_plan(name: str) -> cached_property[Any]:
    return cached_property(lambda problem: getattr(problem.plan, name))


@dataclass(frozen=True, eq=False)
class Problem:
    """Everything about one room that stays the same while its boxes move, and where they start from.

    Arguments:
        plan: n boxes as the objective sees them: what they are, the relations that are measured, floor and openings;
            those that must not move are given.
        rows: (e,) int, number of each of its relations among the graph's triplets.
        rigid, turned: (n,) bool, boxes that must keep their size, their heading.
        outline: the floor polygon, or None where the room has none.
        carrier: (n,) int, the object that each one stands on, or `ON_FLOOR`, `ON_CEILING`, `FREE`.
        wall: (n, 2, 2) float, point and inward normal (x, z) of the wall that each one leans on; NaN = none.
        behind: (n,) float, metres that each one keeps between its back and a wall that it leans on.
    """

    plan: Plan
    rows: np.ndarray
    rigid: np.ndarray
    turned: np.ndarray
    outline: Floor | None
    carrier: np.ndarray
    wall: np.ndarray
    behind: np.ndarray

    def at(self, size: np.ndarray, position: np.ndarray, yaw: np.ndarray) -> "Problem":
        """The same room with boxes of size and at position (n, 3), metres, and yaw (n,), radians."""
        return replace(self, plan=replace(self.plan, size=size, position=position, yaw=yaw))

    def no_deeper(self, reach: Sequence[tuple[int, float]]) -> "Problem":
        """The same room, where seats reach under some tables, by number, by so many metres at most."""
        kinds = list(self.kinds)
        for table, metres in reach:
            sides = self.size[self.anchor == table][:, [0, 2]].min(1)  # of which it is a share
            kinds[table] = replace(kinds[table], admits=(("seat", metres / float(sides.max())),))
        return replace(self, plan=replace(self.plan, kinds=tuple(kinds)))

    def spread(self) -> "Problem":
        """The problem whose pieces keep usual distances to walls where drawn ones are too alike, at those walls."""
        usual = kept_behind(self.categories, self.size, np.full(len(self.size), np.nan))
        walled = np.isin(np.arange(len(usual)), [one.subject for one in self.stated if not one.others])  # of walls
        usual = np.where(walled, np.minimum(usual, BEHIND[1]), usual)
        behind = np.where(self.fixed, self.behind, usual)
        leaning = np.flatnonzero(~np.isnan(self.wall[:, 0, 0]) & ~self.fixed)
        position = self.position.copy()
        away = wall_gaps(self.wall, self.size, position, self.yaw) - behind  # which the solver would take up later
        position[leaning[:, None], [0, 2]] -= away[leaning, None] * self.wall[leaning, 1]
        vars(self.plan)["carrier"] = self.carrier
        return replace(self, plan=self.plan.at(position, self.plan.yaw), behind=behind)

    # -- what the plan says, as arrays -------------------------------------------------------------------------------

    size = _of_plan("size")  # (n, 3) float, metres
    position = _of_plan("position")  # (n, 3) float, metres, of the middles of the bottoms
    yaw = _of_plan("yaw")  # (n,) float, radians
    triplets = _of_plan("triplets")  # (e, 3) int, [subject, predicate id, object], those that the rules measure
    fixed = _of_plan("fixed")  # (n,) bool, boxes that must not move
    anchor = _of_plan("anchor")  # (n,) int, whom each attends, -1 = nobody
    fronts = _of_plan("fronts")  # (n,) bool, which of the boxes have a front
    kinds = _of_plan("kinds")  # rows of the vocabulary
    slot_roles = _of_plan("slot_role")  # how each stands to whom it attends
    rules = _of_plan("rules")  # the rule set that the relations are meant in
    stated = _of_plan("stated")  # where single objects must stand in the room

    @cached_property
    def categories(self) -> tuple[str, ...]:
        """Canonical category words."""
        return tuple(kind.name for kind in self.kinds)

    @cached_property
    def height(self) -> float | None:
        """Height of the ceiling in metres, or None."""
        return None if self.plan.height is None else float(self.plan.height[0])

    # -- who and what stands where -----------------------------------------------------------------------------------

    @cached_property
    def pairs(self) -> np.ndarray:
        """(p, 2) int, pairs that must not collide."""
        i, j = pair_indices(len(self.size)).T
        apart = ~(self.fixed[i] & self.fixed[j]) & (self.carrier[i] != j) & (self.carrier[j] != i)
        return np.stack([i, j], 1)[apart]

    @cached_property
    def shared(self) -> np.ndarray:
        """(n, n) float: depth in metres to which two boxes may overlap; without bound for a carrier and its load."""
        i, j, allowed = self.plan.couples
        out = np.full((len(self.size), len(self.size)), np.inf)
        out[i, j] = out[j, i] = allowed
        return out

    @cached_property
    def hanging(self) -> np.ndarray:
        """(n,) bool, lamps of the ceiling that go where what they light goes."""
        return np.array([kind.support == "ceiling" for kind in self.kinds], bool) & ~self.fixed

    def standing(self, i: int) -> bool:
        """Whether a box stands on the floor itself."""
        return bool(self.carrier[i] == ON_FLOOR)

    def triplets_of(self, i: int) -> np.ndarray:
        """(r, 3) int, the triplets that name a box."""
        return np.asarray(self.triplets[(self.triplets[:, [0, 2]] == i).any(1)])

    # -- the floor ---------------------------------------------------------------------------------------------------

    @property
    def floor(self) -> Floor:
        """The floor of a room that has one."""
        assert self.outline is not None
        return self.outline

    @cached_property
    def centre(self) -> np.ndarray:
        """(2,) float, x and z of the room's centre, metres."""
        if self.outline is None:
            return np.zeros(2)
        corners = self.outline.polygon
        return np.asarray((corners.max(0) + corners.min(0)) / 2)

    @cached_property
    def walls(self) -> list[tuple[np.ndarray, np.ndarray, float, float]]:
        """Start (2,), direction (2,), length and the heading of what stands with its back to it, for each wall."""
        floor, yaw = self.floor, np.arctan2(*self.floor.normal.T)
        return list(zip(floor.start, floor.along, floor.length.tolist(), yaw.tolist(), strict=True))

    @cached_property
    def grain(self) -> float:
        """Heading of the longest wall, radians: free furniture stands parallel to it."""
        return max(self.walls, key=lambda wall: wall[2])[3]


def problem_of(
    categories: Sequence[str], size: np.ndarray, position: np.ndarray, yaw: np.ndarray, triplets: np.ndarray, *,
    floor_polygon: np.ndarray | None, height: float | None, fixed: np.ndarray, rigid: np.ndarray, turned: np.ndarray,
    openings: Sequence[Opening] = (), stated: tuple[Stated, ...] = (), rules: str = "strict",
) -> Problem:  # fmt: skip
    """The problem of a room, its boxes put at their height and wall furniture turned square to its wall.

    Arguments:
        turned: (n,) bool, boxes that must keep their yaw.
        The others as `echousd.place.place_boxes`.
    """
    words = tuple(vocabulary().category(word).name for word in categories)
    rows = np.flatnonzero(np.isin(triplets[:, 1], sorted(measured(rules))))
    floor = None if floor_polygon is None else Floor(floor_polygon)
    carrier = carriers([vocabulary().category(word) for word in words], size, position, yaw, triplets)
    ceiling, yaw = np.nan if height is None else height, yaw.copy()
    position = stacked(size, position, np.where(fixed, FREE, carrier), ceiling)
    wall = np.full((len(words), 2, 2), np.nan)
    if floor is not None:
        backed = {one.subject for one in stated if one.placement == "against_wall"}
        wall = lean(words, size, position, yaw, floor, carrier, backed)
        turn = ~np.isnan(wall[:, 1, 0]) & ~fixed & ~turned
        yaw[turn] = np.arctan2(wall[turn, 1, 0], wall[turn, 1, 1])
    behind = kept_behind(words, size, wall_gaps(wall, size, position, yaw))
    plan = plan_of(
        Spread(size, position, yaw), words, floor_polygon, openings, triplets[rows], fixed=fixed, height=height,
        rules=rules, stated=stated,
    )  # fmt: skip
    return Problem(plan, rows, rigid, turned, floor, carrier, wall, behind)


def wall_gaps(wall: np.ndarray, size: np.ndarray, position: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """(n,) float: metres between the back of each leaning piece and its wall (`Problem.wall`); NaN for the others."""
    normal = wall[:, 1]
    reach = (np.abs(seen(normal, yaw)) * size[:, [0, 2]]).sum(-1) / 2
    return ((position[:, [0, 2]] - wall[:, 0]) * normal).sum(-1) - reach


def lean(
    categories: Sequence[str], size: np.ndarray, position: np.ndarray, yaw: np.ndarray, floor: Floor,
    carrier: np.ndarray, walled: Collection[int] = (),
) -> np.ndarray:  # fmt: skip
    """(n, 2, 2) float: point and inward normal of the wall that each piece of wall furniture leans on, NaN = none.

    Arguments:
        walled: boxes that the graph has against a wall, whatever they are.
    """
    rows = [vocabulary().category(word) for word in categories]
    leaning = [
        ((row.wall or i in walled) and carrier[i] == ON_FLOOR) or row.support == "wall" for i, row in enumerate(rows)
    ]
    facing = axes(yaw)[1] @ floor.normal.T > np.cos(WALL_TURN)
    corner = footprints(size, position, yaw)
    gap = ((corner[:, None] - floor.polygon[:, None]) * floor.normal[:, None]).sum(-1).min(2)
    at = ((position[:, None, [0, 2]] - floor.polygon) * floor.along).sum(-1)
    near = facing & (at > -0.2) & (at < floor.length + 0.2) & (gap < WALL_REACH) & (gap > -1.5)
    distance = np.where(near & np.array(leaning, bool)[:, None], np.abs(gap), np.inf)
    best = distance.argmin(1)
    found = np.stack([floor.polygon[best], floor.normal[best]], 1)
    found[np.isinf(distance.min(1))] = np.nan
    return found
