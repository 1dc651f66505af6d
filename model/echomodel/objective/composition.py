"""Terms of zones and composition: how whole rooms are composed, where every piece alone may be right.

Distances were measured on 300 real rooms with their furniture, unless a standard is named.
"""

import math
from collections.abc import Sequence

import numpy as np

from echomodel.arrays import Array, at_least, at_most, cast, dot, full, held, least_so_far, once, rows
from echomodel.boxes2d import footprints, to_frame
from echomodel.floors import Walls, footprint, signed_area, signed_distance
from echomodel.objective.company import AROUND, BESIDE, first_of
from echomodel.objective.plan import CLEAR_HEIGHT, FAR, Found, Plan, found, joined, nobody, worst
from echomodel.sizes import REACH, filled_area

# Radius of an empty circle, of the side of a square of each piece's share of the floor; more a square metre; at most.
BARE = (0.48, 0.0116, 1.0)
# Metres of a way along what is bare; side of a square that the rest of the largest such rectangle in a corner is: 90 %
# of real rooms have a smaller one; sine of two walls that meet in one; share of a floor that 95 % of real rooms fill.
WAY, LEFT_BARE, SQUARE, THIN = 1.0, 1.7, 0.9, 0.58
HALL = 24.0  # square metres of a room that a few pieces do not fill
CELL, POINTS = 0.25, 1000  # metres between two points of the floor that are looked at; in a hall so many, farther apart
FEW, LARGE = 5, 0.4  # pieces: fewer fill no room; square metres of those that fill an end of it
NEARER = 0.1  # metres by which a point must be nearer to a piece than what is bare or serves nothing, not to count


def bare_limit(area: float, count: int) -> float:
    """Radius in metres from which on an empty circle is bare, in a floor of an area (square metres), so many pieces."""
    return min(BARE[0] + BARE[1] * area, BARE[2]) * math.sqrt(area / max(count, 1))


def floor_used(plan: Plan) -> Found:
    """No large part of the floor is bare while the pieces stand close elsewhere; the nearest one is told."""
    out, xp = nobody(plan.size), plan.kit
    for area, _, there, points, walls, gap in floor_gaps(plan):
        row = int(plan.stands("row")[there[0]].sum())  # a row of units is one piece
        limit = bare_limit(area, there.shape[1] - max(row - 1, 0))
        inner = rows(walls > limit)
        if not len(inner):  # no circle of that size fits in
            continue
        radius = xp.minimum(gap[:, inner], walls[inner])
        at = held(radius).argmax(1)
        most = radius[xp.arange(len(at)), at]
        near = rows(held(most) > limit - NEARER)  # of smaller circles nobody need hear
        told = _nearest(plan, there[near], points[inner[at[near]]])
        out = joined(out, found(told, limit - most[near], measure=2 * most[near]))
    return out


def corners_used(plan: Plan) -> Found:
    """No corner of a room is bare, of a rectangle in it no more than a way along it; who stands next to it is told."""
    out, xp = nobody(plan.size), plan.kit
    for (_, polygon, _), there in zip(plan.rooms, on_floors(plan), strict=True):
        walls = Walls(polygon)
        corner = np.flatnonzero(walls.turn > SQUARE)
        start, *ways = map(plan.numbers, (walls.start[corner], walls.along[corner], -walls.along[corner - 1]))
        length = plan.numbers(np.stack([walls.length[corner], walls.length[corner - 1]]))
        count = int((~(plan.stands("row") | plan.movable))[there.reshape(-1)].sum())  # these fill no room
        if count < FEW * max(len(there), 1) or not len(corner):
            continue
        moved = plan.moved[there[0]]
        still, moving = (_from_corners(plan, of, start, ways) for of in (there[:1, ~moved], there[:, moved]))
        none = full(plan.size, (len(there), 1, len(corner)), math.inf)
        alike = (xp.broadcast_to(of, (len(there), *of.shape[1:])) for of in still)  # in all copies
        wide, deep = (xp.concat([*of, none], 1) for of in zip(alike, moving, strict=True))
        ends = xp.minimum(wide, length[:1])  # of rectangles, at pieces or walls
        each = xp.arange(len(there))[:, None, None], xp.argsort(held(ends), 1), xp.arange(len(corner))
        ends, before = ends[each], least_so_far(xp.concat([at_most(none, FAR), deep[each]], 1))[:, :-1]
        deep = xp.minimum(before, length[1])
        bare = (at_least(ends - WAY, 0.0) * at_least(deep - WAY, 0.0)).reshape(len(there), -1)
        most = held(bare).argmax(1)
        row, k = xp.arange(len(there)), most % len(corner)
        wide, deep = (of.reshape(len(there), -1)[row, most] for of in (ends, deep))
        middle = start[k] + (wide[:, None] * ways[0][k] + deep[:, None] * ways[1][k]) / 2
        margin = LEFT_BARE - xp.sqrt(at_least(bare[row, most], 1e-6))
        out = joined(out, found(_nearest(plan, there, middle), margin, measure=wide * deep))
    return out


def _from_corners(plan: Plan, there: Array, start: Array, ways: Sequence[Array]) -> tuple[Array, Array]:
    """(s, n, c) each: metres to pieces (s, n) along both walls of corners at (c, 2); `FAR` for what is behind one."""
    who, xp = there.reshape(-1), plan.kit
    at = footprints(plan.size[who], plan.position[who], plan.yaw[who])[:, :, None] - start
    away = [dot(at, way) for way in ways]
    met = (xp.amax(held(away[0]), 1) > 0) & (xp.amax(held(away[1]), 1) > 0)
    wide, deep = (xp.where(met, at_least(xp.amin(of, 1), 0.0), FAR).reshape(*there.shape, len(start)) for of in away)
    return wide, deep


def floor_filled(plan: Plan) -> Found:
    """A hall holds enough for its floor, whatever its places; the largest piece is told."""
    out = nobody(plan.size)
    for (_, area, *_), there in zip(floor_points(plan), on_floors(plan), strict=True):
        if area >= HALL and there.shape[1]:
            wide, deep = (held(plan.size)[there, k] for k in (0, 2))
            share = ((wide + 2 * REACH) * (deep + 2 * REACH)).sum(1) / area
            largest = there[plan.kit.arange(len(there)), (wide * deep).argmax(1)]
            out = joined(out, found(largest, share - THIN, measure=100.0 * share))
    return out


def floor_points(plan: Plan) -> list[tuple[Array, float, Array, Array]]:
    """For rooms of one floor: their numbers (s,), its area, points (P, 2) on it, and their distance to walls (P,)."""
    kept: list[tuple[float, Array, Array]] = vars(plan.first).setdefault("floor_points", [])
    if not kept:
        for _, polygon, _ in plan.first.rooms:
            area = abs(float(signed_area(polygon[None])[0]))
            low, high = polygon.min(0), polygon.max(0)
            cell = max(CELL, math.sqrt(float(np.prod(high - low)) / POINTS))
            xs, zs = (np.arange(a + cell / 2, b, cell) for a, b in zip(low, high, strict=True))
            points = plan.numbers(np.stack(np.meshgrid(xs, zs), -1).reshape(-1, 2).tolist())
            walls = signed_distance(points[None], plan.numbers(polygon.tolist())[None])[0]
            kept.append((area, points[walls > 0], walls[walls > 0]))
    return [(scenes, *of) for (scenes, _, _), of in zip(plan.rooms, kept, strict=True)]


@once
def on_floors(plan: Plan) -> list[Array]:
    """(s, n) int64 for rooms (s,), one after the other, of one floor: the pieces that stand there, rugs apart."""
    out = []
    for scenes, *_ in plan.rooms:
        here = (plan.scene >= int(scenes[0])) & (plan.scene <= int(scenes[-1]))
        out.append(plan.those(here & plan.standing & (plan.size[:, 1] > CLEAR_HEIGHT)).reshape(len(scenes), -1))
    return out


@once
def floor_gaps(plan: Plan) -> list[tuple[float, int, Array, Array, Array, Array]]:
    """How far the floor lies from the pieces, for rooms (s,), one after the other, of one floor.

    Returns its area, how many points it has, (s, n) int64, the pieces, (q, 2) the points that count: in copies of one
    room not those near to what stands alike in all, (q,) metres to the walls, and (s, q) to the nearest piece.
    """
    out = []
    for (_, area, points, walls), there in zip(floor_points(plan), on_floors(plan), strict=True):
        near = min(SERVED - SOFT, bare_limit(area, there.shape[1]) - NEARER)
        far, gap = _far_points(plan, there, points, near)
        out.append((area, len(points), there, points[far], walls[far], gap))
    return out


def _far_points(plan: Plan, there: Array, points: Array, near: float) -> tuple[Array, Array]:
    if there.shape[1] < 2:
        return there.reshape(-1)[:0], points[:0]
    moved, xp = plan.moved[there[0]], plan.kit
    still, moved = there[:1, ~moved], there[:, moved]
    squares = xp.amin(_squares(plan, still, points), 1) if still.shape[1] else full(points, (1, len(points)), math.inf)
    far = rows(squares[0] > near**2)
    squares = squares[:, far]
    for k in range(moved.shape[1]):  # one after the other, which fits a cache
        squares = xp.minimum(squares, _squares(plan, moved[:, k : k + 1], points[far])[:, 0])
    return far, xp.broadcast_to(xp.sqrt(at_least(squares, 1e-12)), (len(there), len(far)))


def _nearest(plan: Plan, who: Array, points: Array) -> Array:
    """(s,) int64, of pieces (s, n) those nearest to points (s, 2)."""
    return who[plan.kit.arange(len(who)), _squares(plan, who, points[:, None, None])[..., 0].argmin(1)]


def _squares(plan: Plan, who: Array, points: Array) -> Array:
    """(s, n, P): square of the metres between pieces (s, n) and points (..., P, 2)."""
    size, position, cos, sin = (of[who][..., None] for of in (plan.size, plan.position, *plan.turn))
    if isinstance(points, np.ndarray) and points.ndim == 2 and (abs(cos * sin) < 1e-9).all():
        half = np.where(abs(cos)[..., None] > 0.5, size, size[:, :, ::-1]) / 2
        out = 0.0
        for k in (0, 1):  # along x and z each line of points once, as the points form a grid
            line, at = np.unique(points[:, k], return_inverse=True)
            out += (at_least(abs(line - position[:, :, 2 * k]) - half[:, :, 2 * k], 0.0) ** 2).take(at, -1)
        return out
    x, z = points[..., 0] - position[:, :, 0], points[..., 1] - position[:, :, 2]
    lateral, forward = to_frame(x, z, cos, sin)
    lateral, forward = (at_least(abs(away) - size[:, :, k] / 2, 0.0) for away, k in ((lateral, 0), (forward, 2)))
    return lateral * lateral + forward * forward


# Share of a room's extent from a wall to the nearest large piece: 87 % of real rooms, of the longer one: 84 %; from one
# such piece to the next: 98 %; metres of each that are never bare.
BARE_END, BARE_LONG, BARE_STRIP, SHORT, SPARE = 0.45, 0.37, 0.4, 1.6, 2.5
HALF, LONG = 0.3, 4.5  # of an even share of the large pieces that half of such a length has, metres


def ends_used(plan: Plan) -> Found:
    """No end of a room is bare, nor a strip right across it: its large pieces stand about all of it; one is told."""
    out, xp = nobody(plan.size), plan.kit
    for there, first, last, width, _ in _large(plan):
        row = xp.arange(len(there))
        start = xp.concat([0.0 * last[:, :1], last], 1)  # of what may be bare: the wall, the far side of each piece
        near, far, since = (xp.stack([of[..., 0], of[..., 1]], 1) for of in (first, last, start))  # (s, 2, n), in rows
        beyond = held(far[:, :, None]) > held(since[..., None]) + 1e-6  # (s, 2, n + 1, n), what ends further on
        end = xp.amin(xp.where(beyond, near[:, :, None], 1.0), 3).swapaxes(1, 2)
        ends = (start <= 0.0) | (end >= 1.0)
        bare = xp.where(width > width[[1, 0]], BARE_LONG, BARE_END)
        most = xp.where(ends, xp.maximum(SHORT / width, bare), at_least(SPARE / width, BARE_STRIP))
        margin = (most - end + start).reshape(len(there), -1)
        widest = held(margin).argmin(1)
        nearest = held(first)[row, :, widest % 2].argmin(1)
        piece = xp.where(widest < 2, nearest, widest // 2 - 1)
        share = (end - start).reshape(len(there), -1)[row, widest]
        out = joined(out, found(there[row, piece], margin[row, widest], measure=100.0 * share))
    return out


def halves_used(plan: Plan) -> Found:
    """No half of a long room is nearly bare: it has its part of the large pieces; the largest in the other is told."""
    out, xp = nobody(plan.size), plan.kit
    for there, first, last, width, middle in _large(plan):
        row, area = xp.arange(len(there)), plan.size[there, :1] * plan.size[there, 2:]
        lower = area * ((middle - first) / at_least(last - first, 1e-6)).clip(0.0, 1.0)  # (s, n, 2)
        has = xp.stack([lower.sum(1), (area - lower).sum(1)], 1) / area.sum(1)[:, None]  # (s, 2, 2)
        margin = xp.where(width > LONG, 2.0 * has - HALF, 1.0).reshape(len(there), -1)
        at = held(margin).argmin(1)
        told = xp.stack([area - lower, lower], 1)[row, at // 2, :, at % 2].argmax(1)
        share = 1.0 - has.reshape(len(there), -1)[row, at]
        out = joined(out, found(there[row, told], margin[row, at], measure=100.0 * share))
    return out


@once
def _large(plan: Plan) -> list[tuple[Array, Array, Array, Array, Array]]:
    """Large pieces (s, n) of rooms (s,) of one floor that have enough, where they begin and end, (s, n, 2) shares of
    its extents, these (2,), metres, and its middle (2,), as shares."""
    out = []
    for (_, polygon, _), (*_, points, _), there in zip(plan.rooms, floor_points(plan), on_floors(plan), strict=True):
        large = (plan.size[there[0], 0] * plan.size[there[0], 2] > LARGE) & ~plan.of("decor")[there[0]]
        if there.shape[1] - max(int(plan.stands("row")[there[0]].sum()) - 1, 0) < FEW or not bool(large.any()):
            continue  # a row of units is one piece
        there = there[:, large]
        low, high = (plan.numbers(of(polygon, axis=0).tolist()) for of in (np.min, np.max))
        who = there.reshape(-1)
        at = (footprint(plan.size[who], plan.position[who], plan.yaw[who]) - low) / (high - low)
        first, last = (of(at, 1).reshape(len(there), -1, 2) for of in (plan.kit.amin, plan.kit.amax))
        out.append((there, first, last, high - low, (points.mean(0) - low) / (high - low)))
    return out


SERVED = 1.0  # metres: floor further from all furniture serves nothing
SOFT = 0.2  # metres on both sides of it over which a point of the floor counts in part
SEAT = 0.7  # metres that a side needs before it to seat somebody
NOOK, AT_WALL = 0.66, 0.4  # metres between a plant and what is next to it along and across, and to the next wall
# Metres before a wardrobe to a bed: a leaf of 0.5 m and who stands aside of it; before storage to a sofa.
OPENS, PASSED = 0.55, 0.8
# Share of the width of storage from which on nightstands, and other pieces, are before it; of a screen's all.
BESIDES, FACED, SCREENED = 0.2, 0.1, 0.05


def served_limit(area: float, width: Array, depth: Array) -> float:
    """Share of a floor (square metres) that may lie far from furniture of these widths and depths (n,), metres.

    The emptier a room, the more: 84 % of real rooms stay below exp(0.8 - 2 f), f being the area that the pieces fill
    (`filled_area`) over the floor's.
    """
    return min(1.0, math.exp(0.8 - 2.0 * filled_area(width.tolist(), depth.tolist()) / area))


def floor_served(plan: Plan) -> Found:
    """Furniture serves the whole floor: no more of it lies far from everything than so much furniture must leave."""
    out = nobody(plan.size)
    for area, count, there, points, _, gap in floor_gaps(plan):
        if not len(points):
            continue
        size = held(plan.size[there[0]])
        row = plan.stands("row")[there[0]]  # whose neighbours fill what is beside each
        share = ((gap - SERVED + SOFT) / (2 * SOFT)).clip(0.0, 1.0).sum(1) / count
        margin = served_limit(area, size[:, 0] - 2 * REACH * row, size[:, 2]) - share
        out = joined(out, found(_nearest(plan, there, points[held(gap).argmax(1)]), margin, measure=100.0 * share))
    return out


def free_beside(plan: Plan, who: Array, but: Array) -> Array:
    """(P, 4): metres free left, right, behind and before of boxes, to walls and pieces, but for some (N,) bool."""
    (right, front), xp = plan.axes(who), plan.kit
    out = xp.stack([-right, right, -front, front], 1)
    half = plan.size[:, [0, 0, 2, 2]] / 2
    edge = plan.position[who][:, None, ::2] + out * half[who][..., None]
    walls = plan.inside(edge + out * SEAT, who) + SEAT
    asked = full(plan.fixed, len(plan.first), False)
    asked[who % len(asked)] = True
    others = plan.standing & ~but & (plan.size[:, 1] > CLEAR_HEIGHT)
    j, k = plan.pairs(asked, others, least=True)
    lateral, forward = plan.local(k, j)
    wide, deep = plan.reach(k, j)
    ahead, aside = abs(forward) - deep - plan.size[j, 2] / 2, abs(lateral) - wide - plan.size[j, 0] / 2
    beyond = xp.stack([-lateral - wide, lateral - wide, -forward - deep, forward - deep], -1) - half[j]
    meets = (xp.stack([ahead, ahead, aside, aside], -1) < 0) & (beyond > -half[j])
    beyond = xp.where(meets, beyond, FAR)
    return xp.minimum(walls, xp.stack([plan.worst(j, side, k)[0] for side in beyond.T], 1)[who])


def plant_in_nook(plan: Plan) -> Found:
    """A plant fills a corner, or the end of storage or a table; it stands amid no bare wall, nor beside seats alone."""
    who, xp = plan.those(plan.of("decor") & plan.standing & plan.walled), plan.kit
    no_nook = plan.of("seat", "light", "sofa", "bed") | plan.stands("before")
    free = free_beside(plan, who, no_nook)
    widest = xp.maximum(xp.minimum(free[:, 0], free[:, 1]), xp.minimum(free[:, 2], free[:, 3]))
    wall = xp.amin(plan.inside(footprint(plan.size[who], plan.position[who], plan.yaw[who]), who), 1)
    return first_of(who, xp.full_like(who, -1), [NOOK - widest, AT_WALL - wall], [widest, wall])


def wardrobe_opens(plan: Plan) -> Found:
    """One can stand before an open wardrobe, also at the foot of a bed; no sofa, seat, table or other storage stands
    before any storage, nor a bed before a screen's, and one passes a low table there."""
    stores, xp = plan.of("storage") & plan.works & plan.standing & ~plan.stands("near"), plan.kit
    massive = plan.of("bed", "sofa", "board", "storage") & ~plan.stands("row")
    i, j = plan.pairs(stores, (massive | plan.stands("company", "at", "foot")) & plan.standing, least=True)
    met = (plan.stands("opposite") | plan.which(lambda kind: kind.access > 0.6))[i] | ~plan.of("bed")[j]
    i, j = i[met], j[met]
    share = xp.where(plan.stands("opposite")[i], SCREENED, xp.where(plan.stands("head")[j], BESIDES, FACED))
    share = cast(share, plan.size)
    needed = cast(xp.where(plan.of("sofa") & ~plan.stands("company"), PASSED, OPENS), plan.size)
    return plan.nearest(i, j, plan.more_ahead(i, j, needed[j], share), needed)


def each_served(plan: Plan) -> Found:
    """No desk or table has two chairs while another has none, no bed two nightstands while another has none."""
    out = nobody(plan.size)
    desks, chairs = plan.of("board") & plan.works & plan.standing, plan.stands("at") & plan.of("seat")
    tables = plan.which(lambda kind: kind.role == "board" and not (kind.belongs_to or kind.access or kind.wall))
    for hosts, guests, near in (
        (desks, chairs, AROUND),
        (tables & plan.standing, chairs, AROUND),
        (plan.of("bed") & plan.standing, plan.stands("head"), BESIDE),
    ):
        one, other = plan.pairs(hosts, hosts)
        if not len(one):
            continue
        i, j = plan.pairs(guests & plan.standing, hosts)
        served = plan.kit.bincount(j[plan.apart(i, j) < near], minlength=len(plan))
        unfair = (served[one] == 0) & (served[other] > 1)
        least, about = worst(one, -1.0 * cast(unfair, plan.yaw), other, len(plan), FAR)
        who = rows(least < 0)
        out = joined(out, found(who, least[who], other=about[who]))
    return out
