"""Poses that a person would try for a piece: along the walls, at what it attends, over what it lights, in the open."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from echomodel.objective.support import ON_CEILING
from echomodel.objective.walls import PASSAGE
from echomodel.vocabulary import vocabulary
from echousd.repair.arrange.attending import Row, at_anchor, out_of
from echousd.repair.arrange.setting import Poses, Setting, State
from echousd.repair.distances import over_bed, spread_at_walls
from echousd.repair.geometry import depth_inside

HALF_PI = math.pi / 2
STEP = 0.2  # metres between two places at a wall
GRID = 0.35  # metres between two places in the open
LONELY = 2.5  # for a piece that does not stand at what it attends though that is there; chairs pay twice
APART = 4.0  # the same for an armchair
ENOUGH, SPARE = 2, 0.3  # armchairs in a group, and LONELY for a further one that nothing is told of
HIGH_UP = 0.6  # for a lamp at the ceiling itself that does not hang in the middle of the room
AHEAD = np.arange(0.0, 15.0, 0.1)  # metres before a sofa
WATCHED = 3.6  # metres between a screen's wall and the middle of its sofa, where there is room
TOO_FAR, IN_THE_ROOM = 5.5, 0.8  # metres from which on a sofa may leave its wall for that, and what that costs
EDGE = 0.5  # metres between the middle of a plant and a wall: so near it may stay where it was drawn
OFF_WALL = 5.0  # for a piece that belongs at a wall and stands elsewhere
AMID = 3.0  # for a desk or plant that stands where it was drawn, in the room


def places(setting: Setting, state: State, i: int) -> Poses:
    """All poses to try for box i, given where others stand; prices say how well such a piece stands there by itself."""
    kind = setting.kinds[i]
    height = _height(setting, state, i)
    draft = (float(setting.draft[i, 0]), float(setting.draft[i, 2]))
    if setting.fixed[i]:
        return Poses(setting.draft[i : i + 1], setting.heading[i : i + 1], np.zeros(1))
    anchor = int(setting.anchor[i])
    rows: list[Row] = []
    if anchor >= 0 and state.placed[anchor]:
        rows = at_anchor(setting, state, i, anchor)
    seated = setting.stances[i] == "at" and not kind.solid
    lonely = LONELY * (1 + (seated or setting.stances[i] == "before")) if anchor >= 0 and rows else 0.0
    if setting.stances[i] == "company" and rows:
        lonely = APART
    if _spare(setting, state, i):
        lonely = min(lonely, SPARE)
    if kind.support == "ceiling":
        rows += overhead(setting, state, i)
    elif setting.carrier[i] >= 0:
        rows += [] if rows else [(*draft, float(setting.heading[i]), 0.0)]
    elif kind.support == "wall":
        rows += along_walls(setting, i, 0.0)
    elif kind.wall or (kind.role == "board" and kind.access > 0):
        rows += along_walls(setting, i, lonely)
        if kind.role == "sofa":
            rows += in_the_open(setting, i, 4.5 + lonely) + _in_view(setting, i, rows)
    elif kind.stands == "company":  # an armchair by itself looks into the room from its edge
        rows += [(*row[:3], row[3] + lonely) for row in nooks(setting, i)] + along_walls(setting, i, 0.2 + lonely)
        rows += in_the_open(setting, i, 2.5 + lonely)
    elif kind.role == "sofa":
        rows += along_walls(setting, i, lonely) + in_the_open(setting, i, 1.5 + lonely)
    elif kind.role in ("decor", "light", "storage"):
        rows += along_walls(setting, i, lonely) + corners(setting, i, lonely)
    else:
        rows += in_the_open(setting, i, lonely)
        rows += along_walls(setting, i, lonely + 0.5)
    at_edge = (kind.role == "board" and kind.access > 0) or kind.role == "decor"
    twins = beside_twin(setting, state, i)
    rows = [*twins, *((*row[:3], row[3] + LONELY * bool(twins)) for row in rows)]
    afar = OFF_WALL if kind.wall else (AMID if at_edge else 1.0) + lonely
    if kind.role == "decor" and float(depth_inside(setting.floor, np.array([draft]))[0]) < EDGE:
        afar = lonely
    if setting.carrier[i] < 0 or not rows:
        rows = [*rows, *as_drawn(setting, i, draft, afar)]
    out = Poses.of([*rows, *as_stated(setting, state, i)], height)
    if kind.role == "decor":  # plants have no front
        oblong = setting.size[i, 0] != setting.size[i, 2]
        square = _squared(setting, i)
        across = np.abs(np.sin(out.yaw - square)) > 0.5  # an oblong one stands along its wall
        out = Poses(out.position, np.where(across & oblong, out.yaw, square), out.price)
    return _as_told(setting, i, out)


def _spare(setting: Setting, state: State, i: int) -> bool:
    """Whether box i is an armchair that its group, which has enough of them, is told nothing of."""
    if setting.stances[i] != "company":
        return False
    group = setting.group == setting.group[i]
    mates = [k for k in np.flatnonzero(group & state.placed).tolist() if setting.stances[k] == "company" and k != i]
    return len(mates) >= ENOUGH and not group[setting.told[i][1]].any()


def as_stated(setting: Setting, state: State, i: int) -> list[Row]:
    """Where the graph says that the box stands in the room: at walls, in corners, between two others."""
    said = {one.placement for one in setting.stated if one.subject == i} if setting.standing(i) else set()
    rows: list[Row] = []
    if said & {"against_wall", "in_corner"}:
        rows += along_walls(setting, i, 0.0)
    if "in_corner" in said:
        rows += corners(setting, i, 0.0)
        rows += nooks(setting, i) if setting.kinds[i].front else []
    for one in setting.stated:
        if one.subject == i and one.others and setting.standing(i):
            rows += along_walls(setting, i, 0.1) + in_the_open(setting, i, 0.2) + midway(setting, state, i, one.others)
    return rows


def beside_twin(setting: Setting, state: State, i: int) -> list[Row]:
    """For a bed that is told to share a nightstand: beside the other one, which is placed, with room for it between."""
    rows: list[Row] = []
    for one in setting.stated:
        if i not in one.others or len(one.others) != 2 or setting.stances[one.subject] != "head":
            continue
        other = next(k for k in one.others if k != i)
        if setting.kinds[i].role != "bed" or setting.kinds[other].role != "bed" or not state.placed[other]:
            continue
        apart = (setting.size[i, 0] + setting.size[other, 0]) / 2 + setting.size[one.subject, 0] + 0.1
        back = (setting.size[i, 2] - setting.size[other, 2]) / 2
        slots = [(side * apart, back, 0.0, 0.0) for side in (-1.0, 1.0)]
        rows += [out_of(state.position[other], float(state.yaw[other]), slot) for slot in slots]
    return rows


def midway(setting: Setting, state: State, i: int, others: Sequence[int]) -> list[Row]:
    """On the line between the centres of two others and a little beside it, turned as either of them."""
    at, turn = state.position[list(others)][:, [0, 2]], state.yaw[list(others)]
    way = at[1] - at[0]
    aside = np.array([-way[1], way[0]]) / max(float(np.linalg.norm(way)), 1e-9)
    return [
        (*(at[0] + share * way + lateral * aside).tolist(), float(yaw), 0.05 + 0.2 * abs(lateral))
        for share in (0.3, 0.4, 0.5, 0.6, 0.7)
        for lateral in (0.0, -0.3, 0.3, -0.6, 0.6)
        for yaw in turn
    ]


def as_drawn(setting: Setting, i: int, draft: tuple[float, float], price: float) -> list[Row]:
    """Where the box was drawn: parallel to the walls, or turned as it was drawn."""
    heading = float(setting.heading[i])
    square = _squared(setting, i)
    if setting.kinds[i].support != "floor":
        return [(*draft, heading, price)]
    askew = 0.0 if abs(square - heading) < 0.02 else 0.5 if setting.kinds[i].role == "seat" else OFF_WALL
    return [(*draft, square, price), (*draft, heading, price + askew)]


def _squared(setting: Setting, i: int) -> float:
    """The heading parallel to the walls that is nearest to the drawn one."""
    return float(HALF_PI * np.round((setting.heading[i] - setting.grain) / HALF_PI) + setting.grain)


def _height(setting: Setting, state: State, i: int) -> float:
    carrier = int(setting.carrier[i])
    if carrier >= 0:
        return float(state.position[carrier, 1] + setting.size[carrier, 1])
    if carrier == ON_CEILING:
        return setting.height - float(setting.size[i, 1])
    return float(setting.draft[i, 1]) if not setting.standing(i) else 0.0


def _as_told(setting: Setting, i: int, poses: Poses) -> Poses:
    """The poses that keep a stated heading, or all with it where none does."""
    if not setting.turned[i]:
        return poses
    like = np.abs(wrapped(poses.yaw - setting.heading[i])) < 0.1
    keep = like if like.any() else np.ones(len(poses), bool)
    yaw = np.full(int(keep.sum()), setting.heading[i])
    return Poses(poses.position[keep], yaw, poses.price[keep])


def along_walls(setting: Setting, i: int, price: float) -> list[Row]:
    """With the back to every wall that is long enough, from corner to corner and where the draft is nearest."""
    key = ("walls", i, price)
    if key in setting.rows:
        return setting.rows[key]
    width, depth = float(setting.size[i, 0]), float(setting.size[i, 2])
    gap = 0.0 if setting.kinds[i].support == "wall" else float(setting.behind[i])
    rows = []
    for start, along, length, yaw in setting.walls:
        free = length - width
        if free < -0.005:
            continue
        low, high = min(0.01, max(free, 0) / 2), max(free - 0.01, max(free, 0) / 2)
        drawn = float((setting.draft[i, [0, 2]] - start) @ along) - width / 2
        offsets = np.unique(np.clip([low, high, free / 2, drawn, *np.arange(low, high, STEP)], low, high).round(3))
        normal = np.array([math.sin(yaw), math.cos(yaw)])
        for offset in offsets.tolist():
            x, z = start + along * (offset + width / 2) + normal * (depth / 2 + gap)
            rows.append((float(x), float(z), yaw, price))
    setting.rows[key] = rows
    return rows


def corners(setting: Setting, i: int, price: float) -> list[Row]:
    """In the corners of the room: plants and lamps like them."""
    half = float(max(setting.size[i, 0], setting.size[i, 2])) / 2
    other = spread_at_walls(f"{setting.categories[i]} aside", setting.size[i])
    rows = []
    polygon = setting.floor.polygon
    for k, corner in enumerate(polygon):
        one, two = setting.floor.normal[k], setting.floor.normal[k - 1]
        x, z = corner + one * (half + setting.behind[i]) + two * (half + other)
        rows.append((float(x), float(z), setting.walls[k][3], price - 0.1))
    return rows


def _in_view(setting: Setting, i: int, at_walls: Sequence[Row]) -> list[Row]:
    """In the room before a screen at the far wall, where a sofa at its own wall would be too far from it."""
    if not any(stance == "opposite" and a == i for stance, a in zip(setting.stances, setting.anchor, strict=True)):
        return []
    out = []
    for x, z, yaw, price in at_walls:
        front = np.array([math.sin(yaw), math.cos(yaw)])
        steps = np.array([x, z]) + AHEAD[:, None] * front
        inside = depth_inside(setting.floor, steps) > 0
        ahead = float(AHEAD[-1] if inside.all() else AHEAD[inside.argmin()])
        if ahead > max(TOO_FAR, WATCHED + PASSAGE):
            dx, dz = ((ahead - WATCHED) * front).tolist()
            out.append((x + dx, z + dz, yaw, price + IN_THE_ROOM))
    return out


def nooks(setting: Setting, i: int) -> list[Row]:
    """In the corners, looking across the room."""
    width, depth = setting.size[i, [0, 2]].tolist()
    away = 0.5 * (width + depth) * math.sqrt(0.5) + 0.1  # half the diagonal of the turned footprint's hull
    rows = []
    for k, corner in enumerate(setting.floor.polygon):
        inward = setting.floor.normal[k] + setting.floor.normal[k - 1]
        x, z = corner + inward * away
        rows.append((float(x), float(z), math.atan2(inward[0], inward[1]), 0.0))
    return rows


def in_the_open(setting: Setting, i: int, price: float) -> list[Row]:
    """On a grid over the floor and at the draft, parallel to the walls."""
    key = ("open", i, price)
    if key in setting.rows:
        return setting.rows[key]
    low, high = setting.floor.polygon.min(0), setting.floor.polygon.max(0)
    xs, zs = (np.arange(a + 0.3, b - 0.2, GRID) for a, b in zip(low, high, strict=True))
    points = np.stack(np.meshgrid(xs, zs), -1).reshape(-1, 2)
    points = np.concatenate([setting.draft[i : i + 1, [0, 2]], points])
    points = points[depth_inside(setting.floor, points) > 0.25 * float(setting.size[i, [0, 2]].min())]
    quarter = HALF_PI * np.round((setting.heading[i] - setting.grain) / HALF_PI) + setting.grain
    turns = [(float(quarter), 0.0), (float(quarter + HALF_PI), 0.1)]
    if setting.kinds[i].role in ("seat", "sofa"):
        turns += [(float(quarter - HALF_PI), 0.1), (float(quarter + math.pi), 0.1)]
    rows = [(x, z, yaw, price + more) for x, z in points.tolist() for yaw, more in turns]
    setting.rows[key] = rows
    return rows


def overhead(setting: Setting, state: State, i: int) -> list[Row]:
    """Over the middle of tables, beds and sofas' tables, and over the middle of the room."""
    above = vocabulary().predicate_id("above")
    told = setting.triplets[(setting.triplets[:, 0] == i) & (setting.triplets[:, 1] == above)][:, 2].tolist()
    low = setting.kinds[i].look == "pendant_lamp"  # it would meet heads
    rows: list[Row] = []
    for j, kind in enumerate(setting.kinds):
        lit = kind.role == "bed" or (kind.role == "board" and not kind.access)
        if not state.placed[j] or not (j in told or (lit and setting.standing(j))):
            continue
        taste = 0.8 * _hanging_over(setting, state, i, j) + 0.4 * (kind.stands == "beside") + HIGH_UP * (not low)
        price, (x, _, z), yaw = 0.0 if j in told else taste, state.position[j].tolist(), float(state.yaw[j])
        long = yaw if setting.size[j, 0] >= setting.size[j, 2] else yaw - HALF_PI
        for away in _row_over(setting, i, j):  # along its long side
            rows.append((x + math.cos(long) * away, z - math.sin(long) * away, yaw, price))
    middle = (setting.floor.polygon.min(0) + setting.floor.polygon.max(0)) / 2
    rows.append((float(middle[0]), float(middle[1]), setting.grain, 0.9 if low and rows else 0.0))
    return rows


def _row_over(setting: Setting, i: int, j: int) -> list[float]:
    """Where lamps hang over box j, metres from its middle: as many in a row as are told to."""
    above = vocabulary().predicate_id("above")
    lamps = {k for k, predicate, other in setting.triplets.tolist() if predicate == above and other == j}
    if i not in lamps or len(lamps) < 2:
        return [over_bed(setting.size, setting.draft, setting.heading, i, j) if setting.kinds[j].role == "bed" else 0.0]
    length = float(setting.size[j, [0, 2]].max())
    return [((k + 0.5) / len(lamps) - 0.5) * length for k in range(len(lamps))]


def _hanging_over(setting: Setting, state: State, i: int, j: int) -> int:
    """How many other lamps hang over box j."""
    lamps = state.placed & np.array([kind.support == "ceiling" for kind in setting.kinds])
    lamps[i] = False
    return int((np.hypot(*(state.position[lamps] - state.position[j])[:, [0, 2]].T) < 0.5).sum())


def wrapped(angle: np.ndarray) -> np.ndarray:
    """Angles in -pi to pi."""
    return (angle + math.pi) % (2 * math.pi) - math.pi
