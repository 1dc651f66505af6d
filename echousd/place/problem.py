"""a room to be placed: what is fixed, what stands on what, which wall each piece leans on, who may overlap whom."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from echomodel.boxes2d import seen
from echomodel.objective import Plan, plan_of
from echomodel.objective.support import ON_CEILING, ON_FLOOR, carriers
from echomodel.openings import Opening
from echomodel.roomboxes import footprints
from echomodel.vocabulary import vocabulary
from echousd.place.distances import kept_behind
from echousd.place.geometry import Floor, axes, floor_from_polygon, pair_indices

if TYPE_CHECKING:
    from echomodel.rules.placements import Stated, Walls

WALL_REACH = 0.6  # metres: wall furniture further from every wall behind it stands free
WALL_TURN = np.radians(25.0)  # a piece turned further away from the wall's normal does not lean on it


@dataclass(frozen=True, eq=False)
class Problem:
    """Everything about one room that stays the same while its boxes move.

    Arguments:
        categories: n canonical category words.
        triplets: (e, 3) int, [subject, predicate id, object], those that the rules measure.
        rows: (e,) int, number of each of them among the graph's triplets.
        rules: `strict` or `sgfront`. centre: (2,) float, x and z of the room's centre.
        fixed: (n,) bool, boxes that must not move; rigid: (n,) bool, boxes that must keep their size.
        floor: the floor polygon, or None where the room has none.
        height: height of the ceiling in metres, or None.
        carrier: (n,) int, the object that each one stands on, or `ON_FLOOR`, `ON_CEILING`, `FREE`.
        wall: (n, 2, 2) float, point and inward normal (x, z) of the wall that each one leans on; NaN = none.
        behind: (n,) float, metres that each one keeps between its back and a wall that it leans on.
        stated: where single objects must stand in the room.
    """

    categories: tuple[str, ...]
    triplets: np.ndarray
    rows: np.ndarray
    rules: str
    centre: np.ndarray
    fixed: np.ndarray
    rigid: np.ndarray
    floor: Floor | None
    height: float | None
    carrier: np.ndarray
    wall: np.ndarray
    behind: np.ndarray
    stated: tuple[Stated, ...] = ()

    @cached_property
    def pairs(self) -> np.ndarray:
        """(p, 2) int, pairs that must not collide."""
        i, j = pair_indices(len(self.categories)).T
        apart = ~(self.fixed[i] & self.fixed[j]) & (self.carrier[i] != j) & (self.carrier[j] != i)
        return np.stack([i, j], 1)[apart]

    @cached_property
    def surroundings(self) -> Walls | None:
        """The walls as placements are measured to them, None where the room has none."""
        from echomodel.rules.placements import Walls

        return None if self.floor is None else Walls(self.floor.polygon)

    @cached_property
    def touching(self) -> np.ndarray:
        """(p,) bool, pairs that touch at most, though such a pair may overlap: a bed moved off its nightstand later
        would leave its wall."""
        head = np.array([vocabulary().category(word).stands == "head" for word in self.categories], bool)
        return np.asarray(head[self.pairs].any(1))

    @cached_property
    def fronts(self) -> np.ndarray:
        """(n,) bool, which of the boxes have a front."""
        return np.array([vocabulary().category(word).front for word in self.categories], bool)


@dataclass(frozen=True, eq=False)
class Posed:
    """A problem and boxes to start from.

    Arguments:
        size, position: (n, 3) float, metres; yaw: (n,) float, radians.
    """

    problem: Problem
    size: np.ndarray
    position: np.ndarray
    yaw: np.ndarray

    def plan(self, outline: np.ndarray, openings: Sequence[Opening] = ()) -> Plan:
        """The room as the objective sees it, its floor's corners in the order in which openings count its edges."""
        of = self.problem
        return plan_of(
            self, of.categories, outline, openings, of.triplets, given=of.fixed, height=of.height, rules=of.rules,
            stated=of.stated,
        )  # fmt: skip


def pose(
    categories: Sequence[str],
    size: np.ndarray,
    position: np.ndarray,
    yaw: np.ndarray,
    triplets: np.ndarray,
    *,
    floor_polygon: np.ndarray | None,
    height: float | None,
    fixed: np.ndarray,
    rigid: np.ndarray,
    turned: np.ndarray,
    stated: tuple[Stated, ...] = (),
    rules: str = "strict",
) -> Posed:
    """The problem of a room, with its boxes put at their height and wall furniture turned square to its wall.

    Arguments:
        turned: (n,) bool, boxes that must keep their yaw.
        The others as `echousd.place.place_boxes`.
    """
    from echomodel.rules import measured

    words = tuple(vocabulary().category(word).name for word in categories)
    told = np.flatnonzero(np.isin(triplets[:, 1], sorted(measured(rules))))
    floor = None if floor_polygon is None else floor_from_polygon(floor_polygon)
    n = len(words)
    carrier = carriers([vocabulary().category(word) for word in words], size, position, yaw, triplets)
    position, yaw = stacked(size, position, carrier, height, fixed), yaw.copy()
    wall = np.full((n, 2, 2), np.nan)
    if floor is not None:
        backed = {one.subject for one in stated if one.placement == "against_wall"}
        wall = lean(words, size, position, yaw, floor, carrier, backed)
        turn = ~np.isnan(wall[:, 1, 0]) & ~fixed & ~turned
        yaw[turn] = np.arctan2(wall[turn, 1, 0], wall[turn, 1, 1])
    behind = kept_behind(words, size, wall_gaps(wall, size, position, yaw))
    problem = Problem(
        words,
        triplets[told],
        told,
        rules,
        np.zeros(2) if floor_polygon is None else (floor_polygon.max(0) + floor_polygon.min(0)) / 2,
        fixed,
        rigid,
        floor,
        height,
        carrier,
        wall,
        behind,
        stated,
    )
    return Posed(problem, size, position, yaw)


def wall_gaps(wall: np.ndarray, size: np.ndarray, position: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """(n,) float: metres between the back of each leaning piece and its wall (`Problem.wall`); NaN for the others."""
    normal = wall[:, 1]
    reach = (np.abs(seen(normal, yaw)) * size[:, [0, 2]]).sum(-1) / 2
    return ((position[:, [0, 2]] - wall[:, 0]) * normal).sum(-1) - reach


def stacked(
    size: np.ndarray, position: np.ndarray, carrier: np.ndarray, height: float | None, fixed: np.ndarray
) -> np.ndarray:
    """(n, 3) float: positions with each bottom on the floor or its carrier's top, and ceiling things at the ceiling."""
    out = position.copy()
    done = fixed.copy()

    def put(i: int) -> float:
        if not done[i]:
            done[i] = True
            if carrier[i] >= 0:
                out[i, 1] = put(int(carrier[i]))
            elif carrier[i] == ON_FLOOR:
                out[i, 1] = 0.0
            elif carrier[i] == ON_CEILING and height is not None:
                out[i, 1] = height - size[i, 1]
        return float(out[i, 1] + size[i, 1])

    for i in range(len(size)):
        put(i)
    return out


def lean(
    categories: Sequence[str],
    size: np.ndarray,
    position: np.ndarray,
    yaw: np.ndarray,
    floor: Floor,
    carrier: np.ndarray,
    told: Collection[int] = (),
) -> np.ndarray:
    """(n, 2, 2) float: point and inward normal of the wall that each piece of wall furniture leans on, NaN = none.

    Arguments:
        told: boxes that the graph has against a wall, whatever they are.
    """
    rows = [vocabulary().category(word) for word in categories]
    leaning = [
        ((row.wall or i in told) and carrier[i] == ON_FLOOR) or row.support == "wall" for i, row in enumerate(rows)
    ]
    length = np.linalg.norm(floor.edge, axis=1)
    along = floor.edge / length[:, None]
    facing = axes(yaw)[:, 1] @ floor.normal.T > np.cos(WALL_TURN)
    corner = footprints(size, position, yaw)
    gap = ((corner[:, None] - floor.polygon[:, None]) * floor.normal[:, None]).sum(-1).min(2)
    at = ((position[:, None, [0, 2]] - floor.polygon) * along).sum(-1)
    near = facing & (at > -0.2) & (at < length + 0.2) & (gap < WALL_REACH) & (gap > -1.5)
    distance = np.where(near & np.array(leaning, bool)[:, None], np.abs(gap), np.inf)
    best = distance.argmin(1)
    found = np.stack([floor.polygon[best], floor.normal[best]], 1)
    found[np.isinf(distance.min(1))] = np.nan
    return found
