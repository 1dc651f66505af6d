"""Poses that a person would try for a piece: at what it attends, along the walls, over what it lights, in the open."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from echomodel.boxes2d import axes
from echomodel.late import Late, lates
from echomodel.objective.sizes import places_of
from echomodel.objective.support import FREE, ON_CEILING
from echomodel.vocabulary import Category, vocabulary
from echousd.place.distances import APART, MOST_UNDER, kept_apart, over_bed, seen_from, spread_at_walls
from echousd.place.geometry import depth_inside
from echousd.place.problem import Problem
from echousd.place.slots import HALF_PI, INNER, Row, Size, Slot, head, on_top, over

SEATS = "echousd.place.seats"
in_view, midway, sides = lates(SEATS, "in_view", "midway", "sides")
STANDS: dict[str, Callable[[Size, Size, Category, int, float, float], list[Slot]]] = {
    "head": head, "on_top": on_top, "over": over, "with": Late(f"{SEATS}:joined"),
    **{name: Late(f"{SEATS}:{name}") for name in ("around", "at_front", "before", "beside", "company", "foot")},
}  # fmt: skip
STEP = 0.2  # metres between two places at a wall
GRID, PLACES = 0.35, 1000  # metres between two places in the open; in a hall so many, farther apart
SLIDES = (0.08, 0.2, 0.45, 0.8)  # metres by which a piece is moved along its width and its depth


def proposals(problem: Problem, position: np.ndarray, yaw: np.ndarray, there: np.ndarray, i: int) -> np.ndarray:
    """(K, 4) float: x, z, yaw of all poses to try for box i, and how much of a metre other poses are preferred.

    Arguments:
        position: (n, 3) float, yaw: (n,) float, where the others stand. there: (n,) bool, which of them do.
    """
    kind, anchor = problem.kinds[i], int(problem.anchor[i])
    rows: list[Row] = []
    if anchor >= 0 and there[anchor]:
        rows += [out_of(position[anchor], float(yaw[anchor]), slot) for slot in slots_at(problem, i, anchor)]
    for k in _mates(problem, "before", anchor) if problem.slot_roles[i] == "with" else ():
        rows += [
            out_of(position[k], float(yaw[k]), slot) for slot in sides(problem.size[i], problem.size[k]) if there[k]
        ]
    loose = LOOSE * bool(rows)
    if kind.support == "ceiling":
        rows += _overhead(problem, position, yaw, there, i)
    elif problem.carrier[i] >= 0:
        pass
    elif kind.support == "wall":
        rows += along_walls(problem, i, 0.0)
    else:
        at_wall = _leans(problem, i)
        walls = along_walls(problem, i, loose)
        rows += walls
        if kind.role in ("decor", "light", "storage"):
            rows += _corners(problem, i, loose)
        if kind.stands == "company":
            rows += _corners(problem, i, loose, across=True)
        if kind.role == "sofa":
            rows += in_view(problem, i, walls)
        if not at_wall and kind.role not in ("decor", "light", "storage"):
            rows += _in_the_open(problem, i, loose)
        for one in (one for one in problem.stated if one.subject == i):  # where the graph says that it stands
            if one.others:
                rows += _in_the_open(problem, i, 0.2) + midway(position, yaw, one.others)
            else:
                rows += along_walls(problem, i, 0.0) + _corners(problem, i, 0.0)
                rows += _corners(problem, i, 0.0, across=True) if kind.front else []
        beside = twins(problem, position, yaw, i)
        rows = [*beside, *((*row[:3], row[3] + APART_TWINS) for row in rows)] if beside else rows
    now = (position, yaw) if kind.support == "ceiling" else (problem.position, problem.yaw)
    drawn, more = problem.position[i, [0, 2]].tolist(), loose + out_of_habit(problem, i, *now)
    carrier = int(problem.carrier[i])
    turns = (_squared(problem, i), float(problem.yaw[i])) if carrier < 0 else (float(yaw[carrier]),)
    rows += [(*drawn, turn, more) for turn in turns]
    out = np.array(rows, float)
    if problem.turned[i]:
        like = np.abs(np.sin((out[:, 2] - problem.yaw[i]) / 2)) < 0.05
        out = out[like] if like.any() else out
        out[:, 2] = problem.yaw[i]
    return out


LOOSE = 0.5  # by which poses at what a piece attends are preferred to others, and those at walls of what belongs there
APART_TWINS = 2.0  # the same of beds that share a nightstand
HUNG, AT = 0.1, 0.4  # metres between where a lamp or a piece was drawn and a place for such a one
GAP = 0.15  # metres between a back and the wall behind it that it stands at
NEARLY = 1.0  # metres between the middle of the room and of what a lamp hangs over, so that it does
EDGE = 0.5  # metres between the middle of a plant or lamp and a wall that it stands at


def out_of_habit(problem: Problem, i: int, position: np.ndarray, yaw: np.ndarray) -> float:
    """By how much other poses of a box are preferred to where it was drawn: nothing where such a piece may stand so,
    the others at position (n, 3) and yaw (n,)."""
    kind, anchor, here = problem.kinds[i], int(problem.anchor[i]), problem.position[i, [0, 2]]
    rows = twins(problem, position, yaw, i)
    if kind.support == "ceiling":
        rows = _overhead(problem, position, yaw, np.ones(len(yaw), bool), i)
    elif anchor >= 0 and problem.carrier[i] < 0 and not rows:
        rows = [out_of(position[anchor], float(yaw[anchor]), slot) for slot in slots_at(problem, i, anchor)]
    if rows and anchor < 0 and kind.support == "floor":
        return APART_TWINS * (min(math.hypot(row[0] - here[0], row[1] - here[1]) for row in rows) > AT)
    if rows:
        habits = ((math.hypot(row[0] - here[0], row[1] - here[1]), row[2]) for row in rows if row[3] < LOOSE)
        near, turn = min(habits, default=(math.inf, 0.0))
        across = kind.stands == "before" and abs(math.sin(turn - problem.yaw[i])) > AT
        return LOOSE * (across or near > (HUNG if kind.support == "ceiling" else AT))
    inside = float(depth_inside(problem.floor, here[None])[0])
    at_wall = _leans(problem, i)
    small = kind.role in ("decor", "light") and problem.standing(i)
    return LOOSE * (inside > float(problem.size[i, 2]) / 2 + GAP if at_wall else small and inside > EDGE)


def _leans(problem: Problem, i: int) -> bool:
    """Whether a box belongs with its back to a wall, by its kind or because the graph has it there."""
    stated = any(one.subject == i and one.placement == "against_wall" for one in problem.stated)
    kind = problem.kinds[i]
    return stated or kind.wall or (kind.role == "board" and kind.access > 0)


def slots_at(problem: Problem, i: int, anchor: int) -> list[tuple[float, float, float, float]]:
    """Where box i may stand in the frame of its anchor; empty where its row does not say."""
    stands = slot_role(problem, i, anchor)
    if stands not in STANDS:
        return []
    seats = np.array([kind.role == "seat" for kind in problem.kinds]) & (problem.anchor == anchor)
    count = int(places_of(problem.size[seats]).sum())
    near = _apart(problem, i, anchor, stands)
    found = STANDS[stands](problem.size[i], problem.size[anchor], problem.kinds[anchor], count, *near)
    if stands == "head":  # all with the same gap to the wall
        level = float(problem.behind[_mates(problem, stands, anchor)[0]] - problem.behind[anchor])
        found = [(lateral, forward + level, turn, more) for lateral, forward, turn, more in found]
    return found


def _apart(problem: Problem, i: int, anchor: int, stands: str) -> tuple[float, float]:
    """Metres between box i and its anchor and those it stands before its middle, as `distances.kept_apart`."""
    if stands not in APART:
        return 0.0, 0.0
    drawn = seen_from(problem.size, problem.position, problem.yaw, anchor)[_mates(problem, stands, anchor)]
    if stands == "before" and problem.kinds[anchor].name in vocabulary().cornered:
        drawn = drawn + np.array([0.0, 0.0, 0.0, INNER])
    kept, ahead = kept_apart(stands, drawn, problem.kinds[anchor].name, problem.size[anchor])
    return max(kept, -MOST_UNDER * float(problem.size[i, 2]), -float(problem.shared[i, anchor])), ahead


def _mates(problem: Problem, stands: str, anchor: int) -> list[int]:
    """All who stand so to a box."""
    return [j for j in np.flatnonzero(problem.anchor == anchor).tolist() if slot_role(problem, j, anchor) == stands]


def slot_role(problem: Problem, i: int, anchor: int) -> str:
    """How box i stands to what it attends: the name of its slots, or of the row's own word where it has none."""
    kind, to = problem.kinds[i], problem.kinds[anchor]
    if problem.carrier[i] == anchor:
        return "on_top"
    if kind.support != "floor":
        return "over" if problem.slot_roles[i] == "over" else ""
    if kind.stands in ("at", "foot") and to.role == "board":
        return "at_front" if to.access else "around"
    return problem.slot_roles[i]


def out_of(position: np.ndarray, yaw: float, slot: tuple[float, float, float, float]) -> Row:
    """Where a slot of something at a position (3,) lies in the room."""
    lateral, forward, turn, more = slot
    c, s = math.cos(yaw), math.sin(yaw)
    x, z = position[0] + c * lateral + s * forward, position[2] - s * lateral + c * forward
    return float(x), float(z), yaw + turn, more


def aside(
    problem: Problem, position: np.ndarray, yaw: np.ndarray, i: int, fine: bool = False, short: Sequence[float] = ()
) -> np.ndarray:
    """(K, 4) float: a little aside of where the box stands, and turned there; rows as `proposals`.

    Arguments:
        fine: whether what belongs at a wall, and stands off it, moves to and from it, too. short: further metres.
    """
    here, turn = position[i], float(yaw[i])
    rows: list[Row] = []
    if problem.carrier[i] >= 0:
        turn = float(yaw[problem.carrier[i]])
    elif problem.kinds[i].support == "floor" and not problem.turned[i]:
        rows += [(float(here[0]), float(here[2]), turn + quarter * HALF_PI, 0.1) for quarter in (1, 2, 3)]
    ways = [sign * way for way in (*SLIDES, *short) for sign in (-1, 1)]
    free = not problem.kinds[i].wall
    if fine and not free:
        back = here[[0, 2]] - axes(np.array(turn))[1] * problem.size[i, 2] / 2
        free = depth_inside(problem.floor, back[None])[0] > problem.behind[i] + GAP
    slots = [(way, 0.0) for way in ways] + [(0.0, way) for way in ways if free]
    return np.array(rows + [out_of(here, turn, (*slot, 0.0, 0.05 + 0.1 * abs(sum(slot)))) for slot in slots])


def twins(problem: Problem, position: np.ndarray, yaw: np.ndarray, i: int) -> list[Row]:
    """For a bed that is told to share a nightstand: beside the other one, with room for it between."""
    rows: list[Row] = []
    for one in problem.stated:
        if i in one.others and len(one.others) == 2 and problem.slot_roles[one.subject] == "head":
            other = next(k for k in one.others if k != i)
            apart = (problem.size[i, 0] + problem.size[other, 0]) / 2 + problem.size[one.subject, 0] + 0.1
            back = (problem.size[i, 2] - problem.size[other, 2]) / 2
            slots = [(side * apart, back, 0.0, 0.0) for side in (-1.0, 1.0)]
            rows += [out_of(position[other], float(yaw[other]), slot) for slot in slots]
    return rows


def _squared(problem: Problem, i: int) -> float:
    """The heading parallel to the walls that is nearest to the drawn one."""
    return float(HALF_PI * np.round((problem.yaw[i] - problem.grain) / HALF_PI) + problem.grain)


def along_walls(problem: Problem, i: int, more: float) -> list[Row]:
    """With the back to every wall that is long enough, from corner to corner and where the draft is nearest."""
    width, depth = float(problem.size[i, 0]), float(problem.size[i, 2])
    gap = 0.0 if problem.carrier[i] == FREE else float(problem.behind[i])
    stated = {(one.placement, one.subject) for one in problem.stated}
    fills = problem.kinds[i].clear > 0 and ("in_corner", i) in stated  # a tub does, other things stand near one
    rows = []
    for start, along, length, yaw in problem.walls:
        free = length - width
        if free < -0.005:
            continue
        low, high = min(0.01, max(free, 0) / 2), max(free - 0.01, max(free, 0) / 2)
        drawn = float((problem.position[i, [0, 2]] - start) @ along) - width / 2
        steps = [] if fills else [free / 2, drawn, *np.arange(low, high, STEP)]
        offsets = np.unique(np.clip([low, high, *steps], low, high).round(3))
        normal = np.array([math.sin(yaw), math.cos(yaw)])
        places = start + along * (offsets[:, None] + width / 2) + normal * (depth / 2 + gap)
        rows += [(x, z, yaw, more) for x, z in places.tolist()]
    return rows


def _corners(problem: Problem, i: int, more: float, *, across: bool = False) -> list[Row]:
    """In the corners of the room: plants and lamps at their walls, or armchairs that look across it."""
    width, depth = problem.size[i, [0, 2]].tolist()
    half, other = max(width, depth) / 2, spread_at_walls(f"{problem.kinds[i].name} aside", problem.size[i])
    away = 0.5 * (width + depth) * math.sqrt(0.5) + 0.1  # half the diagonal of the turned footprint's hull
    rows = []
    for k, corner in enumerate(problem.floor.polygon):
        one, two = problem.floor.normal[k], problem.floor.normal[k - 1]
        at = away * (one + two) if across else one * (half + problem.behind[i]) + two * (half + other)
        turn = math.atan2(*(one + two).tolist()) if across else problem.walls[k][3]
        rows.append((float(corner[0] + at[0]), float(corner[1] + at[1]), turn, more))
    return rows


def _in_the_open(problem: Problem, i: int, more: float) -> list[Row]:
    """On a grid over the floor and at the draft, parallel to the walls."""
    low, high = problem.floor.polygon.min(0), problem.floor.polygon.max(0)
    step = max(GRID, math.sqrt(float(np.prod(high - low)) / PLACES))
    xs, zs = (np.arange(a + 0.3, b - 0.2, step) for a, b in zip(low, high, strict=True))
    points = np.stack(np.meshgrid(xs, zs), -1).reshape(-1, 2)
    points = points[depth_inside(problem.floor, points) > 0.25 * float(problem.size[i, [0, 2]].min())]
    quarters = range(4 if problem.kinds[i].role in ("seat", "sofa") else 2)
    turns = [_squared(problem, i) + quarter * HALF_PI for quarter in quarters]
    return [(x, z, yaw, more) for x, z in points.tolist() for yaw in turns]


def _overhead(problem: Problem, position: np.ndarray, yaw: np.ndarray, there: np.ndarray, i: int) -> list[Row]:
    """Over the middle of tables, beds and sofas' tables, and over the middle of the room."""
    above = vocabulary().predicate_id("above")
    under = [b for a, word, b in problem.triplets.tolist() if a == i and word == above]
    low = problem.kinds[i].look == "pendant_lamp"  # it would meet heads
    others = there & np.array([kind.support == "ceiling" for kind in problem.kinds]) & (np.arange(len(there)) != i)
    rows: list[Row] = []
    for j, kind in enumerate(problem.kinds):
        lit = kind.role == "bed" or (kind.role == "board" and not kind.access)
        if not there[j] or not (j in under or (lit and problem.standing(j))):
            continue
        (x, _, z), heading = position[j].tolist(), float(yaw[j])
        long = heading if problem.size[j, 0] >= problem.size[j, 2] else heading - HALF_PI
        lamps = int((np.hypot(*(position[others] - position[j])[:, [0, 2]].T) < 0.5).sum())  # that hang there already
        more = 0.3 * lamps + 0.2 * (kind.stands == "beside") + LOOSE * (not low)
        more = 0.0 if j in under else more
        for away in _row_over(problem, i, j):  # along its long side
            rows.append((x + math.cos(long) * away, z - math.sin(long) * away, heading, more))
    x, z = problem.centre.tolist()
    beside = any(math.hypot(row[0] - x, row[1] - z) < NEARLY for row in rows)
    return [*rows, (x, z, problem.grain, LOOSE / (1 if beside else 2) * low)]


def _row_over(problem: Problem, i: int, j: int) -> list[float]:
    """Where lamps hang over box j, metres from its middle: as many in a row as are told to."""
    above = vocabulary().predicate_id("above")
    lamps = {k for k, predicate, other in problem.triplets.tolist() if predicate == above and other == j}
    if i not in lamps or len(lamps) < 2:
        return [over_bed(problem.size, problem.position, problem.yaw, i, j) if problem.kinds[j].role == "bed" else 0.0]
    length = float(problem.size[j, [0, 2]].max())
    return [((k + 0.5) / len(lamps) - 0.5) * length for k in range(len(lamps))]


def height_of(problem: Problem, position: np.ndarray, i: int) -> float:
    """Height of the bottom of a box, metres, where its carrier stands so."""
    carrier = int(problem.carrier[i])
    if carrier >= 0:
        return float(position[carrier, 1] + problem.size[carrier, 1])
    if carrier == ON_CEILING and problem.height is not None:
        return problem.height - float(problem.size[i, 1])
    return 0.0 if problem.standing(i) else float(problem.position[i, 1])
