"""Terms of ways through one room, which have no gradient: a person walks in, and passes to every piece; how far a robot
of 0.2 m radius gets is what SceneEval and PhyScene ask of rooms."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from echomodel.arrays import Array, held, once
from echomodel.boxes2d import footprints
from echomodel.objective.plan import CLEAR_HEIGHT, Found, Plan, found
from echomodel.openings import inward_normal, segment

# Metres: the robot's radius, half of the width on which a person passes, and walks in, and how much narrower a way
# each takes.
ROBOT, PASSES, PERSON, SLACK = 0.2, 0.25, 0.3, 0.025
STEP, BEFORE = 0.1, 0.35  # metres beyond that between a door and where one enters, and around it
LEAST = 1e-4  # square metres: no smaller place to be
ARM = 0.4  # metres between the robot and what it can take hold of
OPEN, MOST = 0.75, 0.5  # share of the free floor that it gets to, in 94 % of 300 real rooms, and that who walks in does


@dataclass(frozen=True, eq=False)
class Ways:
    """Where somebody of a radius (metres) gets to in a plan of one room.

    Arguments:
        boxes: (n,) polygons. high: (n,) bool, those that are in the way.
        parts: (p,) polygons of the floor where the middle can be: those at doors first, the larger before the others.
        area: (p,) square metres. doors: for each the part that it leads to, -1 = none, and the place before it.
    """

    plan: Plan
    radius: float
    boxes: np.ndarray
    high: np.ndarray
    parts: np.ndarray
    area: np.ndarray
    doors: list[tuple[int, Any]]

    @property
    def share(self) -> float:
        """Of the floor that is free, the share that is got to from the door that leads to most; 1 for no floor."""
        return float(self.area[0] / self.area.sum()) if len(self.area) else 1.0

    @property
    def lost(self) -> list[int]:
        """Furniture that is not reached from there; with its bed a nightstand is, with its table a chair."""
        near, attends = self.near(self.parts[:1], ARM), np.asarray(self.plan.anchor)
        furniture = self.plan.standing & self.plan.of("seat", "sofa", "board", "bed", "storage")
        return np.flatnonzero(furniture & ~(near | ((attends >= 0) & near[attends]))).tolist()

    def between(self, *places: Any) -> int:
        """The smallest box that may be blamed for closing two places off from each other; -1 for none."""
        free = self.high & self.near(places[:1]) & self.near(places[1:]) & ~np.asarray(self.plan.fixed)
        volume = np.where(free, np.asarray(held(self.plan.size)).prod(1), np.inf)
        return int(volume.argmin()) if free.any() else -1

    def near(self, places: Any, further: float = 0.0) -> np.ndarray:
        """(n,) bool: boxes that one meets in any of some places, or so many metres further."""
        import shapely

        met: np.ndarray = shapely.dwithin(self.boxes, np.array(places)[:, None], self.radius + further)
        return met.max(0, initial=False)


def _ways(plan: Plan, radius: float, there: Array) -> Ways:
    """Where somebody gets to around some boxes (n,) bool."""
    import shapely

    _, polygon, openings = plan.rooms[0]
    size, *pose = (np.asarray(held(of)) for of in (plan.size, plan.position, plan.yaw))
    boxes = shapely.polygons(footprints(size, *pose))
    high = np.asarray(plan.standing & there) & (size[:, 1] > CLEAR_HEIGHT)
    taken = shapely.union_all(shapely.buffer(boxes[high], radius - SLACK, quad_segs=4))
    free = shapely.buffer(shapely.Polygon(polygon), SLACK - radius, join_style="mitre")
    parts = shapely.get_parts(shapely.difference(free, taken))
    parts = parts[shapely.area(parts) > LEAST]
    area, doors, led = shapely.area(parts), [], np.zeros(len(parts), bool)
    for opening in openings if len(parts) else ():
        if opening.kind != "window" and opening.edge < len(polygon):
            inside = segment(polygon, opening).mean(0) + inward_normal(polygon, opening.edge) * (radius + STEP)
            met = shapely.area(shapely.intersection(parts, place := shapely.Point(inside).buffer(BEFORE)))
            doors.append((int(met.argmax()) if met.max() > 0 else -1, place))
            led[met.argmax()] |= met.max() > 0
    order = np.argsort(-area - area.sum() * led)
    doors = [(order.tolist().index(part) if part >= 0 else -1, place) for part, place in doors]
    return Ways(plan, radius, boxes, high, parts[order], area[order], doors)


def walk(plan: Plan, radius: float = ROBOT) -> Ways | None:
    """Where a robot gets to from the door or passage that leads to most of a room, or in its largest free part where
    there are none; chairs are pulled aside. None where its floor is unknown. `radius`: metres."""
    return _ways(plan, radius, ~(plan.movable & plan.stands("at"))) if plan.rooms else None


@once
def entered(plan: Plan) -> Ways | None:
    """As `walk`, where a person gets to who pulls no chair aside."""
    return _ways(plan, PERSON, plan.standing) if plan.rooms else None


def reached(plan: Plan) -> Found:
    """A way leads from the door to what is used, to most of the floor and to the other doors."""
    if (ways := entered(plan)) and (ways.share < OPEN or any(part for part, _ in ways.doors) or ways.lost):
        ways = walk(plan, PASSES)  # else who is less wide gets there, too
    rows = [(k, -1.0, 2 * PASSES, 0) for k in ways.lost] if ways else []
    if ways and ways.share < (least := 1.0 if (parted := any(part > 0 for part, _ in ways.doors)) else OPEN):
        rows.append((ways.between(*ways.parts[:2]), ways.share - least, 100 * (1 - ways.share), 1 + parted))
    return _rows(rows)


def way_in(plan: Plan) -> Found:
    """From each door one walks in, as wide as a person, to most of the floor that is free for one."""
    rows = []
    if ways := entered(plan):
        for part, place in ways.doors:
            share = ways.area[part] / ways.area.sum() if part >= 0 else 0.0
            rest = ways.parts[(ways.area * (np.arange(len(ways.area)) != part)).argmax()]
            here = ways.parts[part] if part >= 0 else place
            rows += [(ways.between(here, rest), share - MOST, 2 * PERSON, 0)] if share < MOST else []
    return _rows(rows)


def _rows(of: list[tuple[int, float, float, int]]) -> Found:
    """Boxes, margins, measures and sentences as what a rule found: of each box the worst, of none (-1) nothing."""
    worst = {row[0]: row for row in sorted(of, key=lambda row: -row[1]) if row[0] >= 0}
    who, margin, measure, words = np.array([*worst.values()], float).reshape(-1, 4).T
    return found(who.astype(int), margin, measure=measure, words=words.astype(int))
