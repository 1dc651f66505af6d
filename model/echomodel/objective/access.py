"""Rules of walls and access: what belongs at a wall touches it, fronts open, doors swing, windows give light."""

import math

import numpy as np

from echomodel.arrays import Array, at_least, at_most, cast, dot, full, held, kit, once, picked, put
from echomodel.objective.company import first_of
from echomodel.objective.plan import CLEAR_HEIGHT, FAR, Found, Plan, found, nobody, worst
from echomodel.openings import BOARD, SLID, Opening, hinge_point, inward_normal, segment

CROOKED = math.radians(1.0)  # 98 % of such furniture in real rooms is turned less
TOUCHING = 0.3  # metres: 93 % of real beds, nightstands and tv stands have a smaller gap behind
DEEP = 6.0  # metres of the room along its axis from which on it does; or something of another group stands behind it
# Metres behind it at most, if nothing stands there (two of 129 real sofas have more), and what of more counts; in a
# hall so deep that from there no screen at the wall ahead is watched more.
WALKED_BEHIND, BARE, IN_HALL = 1.3, 0.02, 6.0
MET = 0.25  # share of its width from which on something is behind it
# Metres: a sofa so far from the wall may stand in the room on purpose, one walks behind it; as far from its screen at
# most are 97 of 100 real ones.
PASSAGE, FARTHEST = 0.75, 4.8


def parallel(plan: Plan) -> Found:
    """Storage, beds, sofas, tables and desks stand parallel to a wall; side tables go with their seat."""
    massive = plan.of("storage", "bed", "sofa", "board") & plan.standing
    who = plan.those(massive & ~plan.stands("company", "beside") & plan.moved)
    off = abs(askew(plan, who))
    return found(who, CROOKED - off, measure=plan.kit.rad2deg(off))


def askew(plan: Plan, who: Array) -> Array:
    """(P,) radians by which boxes are turned from the nearest quarter turn to a wall, or to x and z without walls."""
    _, along, _, length = (of[plan.scene[who]] for of in plan.walls)
    xp, yaw = plan.kit, plan.yaw[who]
    off = _from_quarter(yaw[:, None] - xp.atan2(-along[..., 1], along[..., 0]))
    off = picked(off, xp.where(length > 0.3, abs(held(off)), math.pi / 4).argmin(1))
    return xp.where((length > 0.3).any(1), off, _from_quarter(yaw))


def _from_quarter(angle: Array) -> Array:
    """How far an angle is from the nearest quarter turn, radians."""
    xp, four = kit(angle), 4 * angle
    return xp.atan2(xp.sin(four), xp.cos(four)) / 4


def at_wall(plan: Plan) -> Found:
    """What belongs at a wall has its back to one, but for nightstands at their bed and sofas that join another."""
    wall = plan.which(lambda kind: kind.wall)
    beside = (plan.stands("head") & (plan.anchor >= 0)) | plan.stands("with")
    hung = plan.which(lambda kind: kind.support == "wall" and kind.role == "storage")
    belongs = (wall & plan.standing & ~beside) | hung
    who = plan.those(belongs & plan.walled & (plan.moved | plan.of("sofa")))
    gap = plan.back_gaps(who)
    looks = plan.stands("before", "opposite", "company") & (plan.anchor >= 0)  # at these, where it stands free
    free = plan.of("sofa") & (plan.kit.bincount(plan.anchor[looks], minlength=len(plan)) > 0)
    free, margin, xp = free[who] & (gap >= PASSAGE), TOUCHING - gap, plan.kit
    if bool(free.any()):
        depth = gap + plan.size[who, 2] + wall_ahead(plan, who)
        most = (depth - FARTHEST).clip(WALKED_BEHIND, IN_HALL)
        bare = at_least(most - gap, -BARE)
        bare = xp.where(depth >= DEEP, bare, margin)
        bare = xp.where(_backed(plan, who, held(gap)), FAR, bare)
        margin = xp.where(free, xp.minimum(gap - PASSAGE, bare), margin)
    return found(who, margin, measure=gap, words=1 * (gap < FAR))


def wall_ahead(plan: Plan, who: Array, sign: float = 1.0) -> Array:
    """(P,): metres from the middle of the fronts of boxes (-1: backs) straight on to the wall; `FAR` without."""
    front = sign * plan.axes(who)[1]
    return to_wall(plan, who, plan.position[who][:, ::2] + front * plan.size[who, 2:] / 2, front)


def to_wall(plan: Plan, who: Array, points: Array, way: Array) -> Array:
    """(P,): metres from points (P, 2) in the rooms of boxes (P,) along unit vectors (P, 2) to the wall; or `FAR`."""
    start, along, normal, length = (of[plan.scene[who]] for of in plan.walls)
    towards = -dot(normal, way[:, None])
    reach = dot(points[:, None] - start, normal) / at_least(towards, 1e-3)
    at = dot(points[:, None] + reach[..., None] * way[:, None] - start, along)
    hit = (length > 0) & (towards > 1e-3) & (at > -1e-3) & (at < length + 1e-3) & (reach > -0.3)
    least = plan.kit.amin(plan.kit.where(hit, reach, math.inf), 1)
    return plan.kit.where(hit.any(1), least, FAR)


def _backed(plan: Plan, who: Array, gap: Array) -> Array:
    """(P,) bool: something of another group stands between a box and the wall behind it, as far off at most."""
    i, j = plan.pairs(plan.of("sofa"), plan.standing & plan.of("board", "storage", "bed", "seat", "sofa"))
    room = put(full(plan.size, len(plan), -1.0), who, cast(at_most(gap, WALKED_BEHIND), plan.size))
    behind = (plan.more_ahead(i, j, room[i], MET, sign=-1.0) < 0) & ~plan.kin(i, j)
    return plan.kit.isin(who, i[behind])


NEEDED = 0.45  # share of the vocabulary's access depth below which a front counts as blocked
SHARE = 0.3  # share of a front's width that may be covered
BEDSIDE = 0.3  # metres beside a bed
# Width from which on two sleep in a bed, metres beside it then, and to spare at its other side if one leaves less.
FOR_TWO, AT_TWO, SPARE = 1.35, 0.45, 0.75
BARELY = 0.1  # metres by which a narrow side counts as kept at most, where the other one is not much wider
# Metres between a bed's side and the wall that it stands at, and from which on a wide one of a child stands free.
SLIT, AMID = 0.1, 0.7
INTO_BED, OF_LAMPS, OF_CHAIRS = 0.6, 0.6, 0.2  # metres between a plant and a bed's side, a floor lamp, a chair
LEAF = 0.1  # share of storage's front at either end that a door may open before
GRAZE = 0.01  # metres that furniture may reach into a door's way, as layouts are rounded
# Metres: the width of a way on which one walks in, straight ahead through an open door, and how far no armchair is.
WALKED, ENTERED = 0.6, 1.2
TALL, STORED = 0.3, 0.1  # metres over a window's sill: what is higher, and storage that is, takes its light
HEADBOARD = 0.3  # metres: of a bed only the head is so high
EDGE = 0.15  # metres of a window that may be covered, but by no row, which does not fit before its board
CLEARANCE = 1.9  # metres: what hangs higher is in nobody's way


def front_free(plan: Plan) -> Found:
    """Doors, drawers, shelves and sofas can be reached from the front."""
    depth = plan.column(lambda kind: kind.access) * NEEDED
    return before_fronts(plan, plan.works & plan.standing & ~plan.of("seat"), depth)  # an armchair is walked round


def before_fronts(plan: Plan, opens: Array, depth: Array) -> Found:
    """How much more than a depth (N,) is free before the fronts of boxes (N,) bool; corners of rows are shared."""
    i, j = plan.pairs(opens, plan.standing & ~plan.movable, least=True)
    corner = plan.stands("row")[i] & plan.stands("row")[j] & (abs(plan.kit.cos(plan.yaw[i] - plan.yaw[j])) < 0.1)
    low = plan.position[:, 1] + plan.size[:, 1] < CLEAR_HEIGHT  # rugs
    near = plan.stands("near", "opposite")[i]  # a sideboard opens beside its table, too
    keep = (plan.anchor[j] != i) & ((plan.anchor[i] != j) | near) & ~corner & ~low[j]
    i, j = i[keep], j[keep]
    margin = plan.more_ahead(i, j, depth[i], SHARE, start=0.5)  # what stands beside or behind is in no front's way
    least, about = plan.worst(i, margin, j)
    who = plan.those(opens)
    walls = wall_ahead(plan, who) - depth[who]
    margin = plan.kit.minimum(least[who], walls)
    return found(who, margin, other=plan.kit.where(walls < least[who], -1, about[who]), measure=margin + depth[who])


def bed_side_free(plan: Plan) -> Found:
    """A long side of a bed can be reached, below the nightstands, both of one for two where there is room."""
    who, free, _, beside = _bed_sides(plan)
    xp, two = plan.kit, (plan.size[who, 0] > FOR_TWO) & ~_of_child(plan)[who]
    most, least = xp.maximum(*free), xp.minimum(*free)
    both = xp.maximum(least - BEDSIDE, at_most(SPARE + least - most, BARELY))  # kept, but not with ease
    both = xp.where(two, both, FAR)
    seen = first_of(who, who, [most - xp.where(two, AT_TWO, BEDSIDE), both], [most, least])
    told = xp.where((free[0] < free[1]) ^ (seen.words == 0), *beside)  # who is at the side that is told
    return found(who, seen.margin, other=told, measure=seen.measure, words=seen.words)


def bed_along_wall(plan: Plan) -> Found:
    """A bed is at a wall, or so far off that one gets in; a child's is, if narrow and without two nightstands."""
    who, free, gaps, _ = _bed_sides(plan)
    child, xp = _of_child(plan)[who], plan.kit
    stands = xp.bincount(plan.anchor[plan.stands("head") & (plan.anchor >= 0)], minlength=len(plan))[who]
    near = xp.where(child, xp.minimum(*free), xp.minimum(*gaps))
    least = xp.where(child, xp.where((plan.size[who, 0] > FOR_TWO) | (stands > 1), AMID, FAR), BEDSIDE)
    return found(who, xp.maximum(near - least, SLIT - near), measure=near)


def _of_child(plan: Plan) -> Array:
    return plan.which(lambda kind: kind.sgfront == "kids_bed")


@once
def _bed_sides(plan: Plan) -> tuple[Array, list[Array], list[Array], list[Array]]:
    """(P,) int64, beds; and for each side (P,) metres that are free there, those to the wall, and who is next, -1 = a
    wall."""
    beds, xp = plan.of("bed") & plan.standing, plan.kit
    who, free, gaps, beside = plan.those(beds), [], [], []
    i, j = plan.pairs(beds, plan.standing & ~plan.stands("head") & ~plan.movable, least=True)
    lateral, aside, along = _at_side(plan, j, i)
    for sign in (1.0, -1.0):
        off = xp.maximum(xp.where(sign * lateral > 0, aside, FAR), 0.4 * plan.size[i, 2] - along)
        way = sign * plan.axes(who)[0]
        gaps.append(to_wall(plan, who, plan.position[who][:, ::2] + way * plan.size[who, :1] / 2, way))
        nearest, about = (of[who] for of in plan.worst(i, off, j))
        free.append(xp.minimum(nearest, gaps[-1]))
        beside.append(xp.where(nearest < gaps[-1], about, -1))
    return who, free, gaps, beside


def _at_side(plan: Plan, i: Array, j: Array) -> tuple[Array, Array, Array]:
    """(P,) each, metres: how far i lies to the side of bed j, from its edge, and along it from shoulders to foot."""
    lateral, forward = plan.local(i, j)
    half_width, half_depth = plan.reach(i, j)
    length, xp = plan.size[j, 2], plan.kit
    along = xp.minimum(forward + half_depth, length / 2) - xp.maximum(forward - half_depth, -length / 5)
    return lateral, abs(lateral) - half_width - plan.size[j, 0] / 2, along


def plant_aside(plan: Plan) -> Found:
    """A plant crowds neither a floor lamp nor a chair, nor stands where one gets into bed; lamps keep as far apart.

    Beside sofas and armchairs it may stand, better with room between.
    """
    seats, lamps, plants = plan.of("sofa", "seat"), plan.of("light"), plan.of("decor")
    i, j = plan.pairs((plants | lamps) & plan.standing, (lamps | plan.of("bed") | seats) & plan.standing, least=True)
    keep = plants[i] | lamps[j]
    i, j = i[keep], j[keep]
    _, aside, along = _at_side(plan, i, j)
    xp = plan.kit
    apart, chair = plan.apart(i, j), plan.stands("at")[j]
    apart = xp.where(seats[j] & ~chair, at_least(apart, 0.0), apart - xp.where(chair, OF_CHAIRS, OF_LAMPS))
    return plan.nearest(i, j, xp.where(plan.of("bed")[j], xp.maximum(aside - INTO_BED, -along), apart), 0.0)


def door_free(plan: Plan) -> Found:
    """Doors swing, and passages are passed, without meeting furniture; who walks in walks into no armchair."""
    low = (held(plan.position)[:, 1] < CLEARANCE) & (plan.kit.amax(held(plan.size), 1) > 0.3)
    hangs = ~plan.standing & low & plan.of("storage", "seat", "sofa", "board", "bed")
    return _before_openings(plan, plan.standing | hangs, window=False)


def leaf_aside(plan: Plan) -> Found:
    """No door opens before the front of storage, where its leaf rests or meets who takes something out."""
    opens = plan.of("storage") & plan.works & plan.standing
    return _before_openings(plan, opens, window=False, depth=plan.column(lambda kind: kind.access) * NEEDED)


def screens(plan: Plan) -> Array:
    """(N,) bool, what televisions stand on, and those that stand or hang elsewhere."""
    stands = plan.stands("opposite")
    return stands | (plan.of("screen") & ~(stands[plan.anchor] & (plan.anchor >= 0)))


def window_free(plan: Plan) -> Found:
    """Windows are not covered by tall furniture, nor are screens watched against their light."""
    on_wall = plan.which(lambda kind: kind.support == "wall" and kind.role == "storage")
    return _before_openings(plan, plan.standing | on_wall | screens(plan), window=True)


def _before_openings(plan: Plan, asked: Array, *, window: bool, depth: Array | None = None) -> Found:
    """What boxes keep off openings; `depth` (N,): what their fronts keep off leaves, so many metres before them."""
    rows: list[tuple[Array, Array, int]] = []
    for scenes, polygon, openings in plan.rooms:
        here = plan.scene == scenes[0] if len(scenes) < 2 else plan.scene >= 0  # one room, or all are copies of one
        who = plan.those(here & asked & plan.moved)
        for number, opening in enumerate(openings):
            if (opening.kind == "window") == window and opening.edge < len(polygon):
                rows.append((who, _clearance(plan, who, polygon, opening, depth), number))
    if not rows:
        return nobody(plan.size)
    xp = plan.kit
    who, margin = (xp.concat([row[k] for row in rows]) for k in (0, 1))
    about = xp.concat([full(row[0], len(row[0]), row[2]) for row in rows])
    least, which = worst(who, margin, about, len(plan), FAR)
    met = xp.unique(who)
    return found(met, least[met], measure=GRAZE - least[met], words=which[met])


def _clearance(plan: Plan, who: Array, polygon: np.ndarray, opening: Opening, depth: Array | None) -> Array:
    """(P,): how far boxes, or what is before them, stay out of an opening's way, beyond what is tolerated, metres."""
    near, far = map(plan.numbers, segment(polygon, opening))
    inward = plan.numbers(inward_normal(polygon, opening.edge))
    along = (far - near) / opening.width
    swings = opening.kind == "door" and opening.swing == "in"
    if depth is not None and not swings:
        return full(plan.yaw, len(who), FAR)
    (side, front), middle, xp = plan.axes(who), plan.position[who][:, ::2], plan.kit
    width, length = plan.size[who, 0] / 2, plan.size[who, 2] / 2
    if depth is not None:
        middle = middle + front * (length + depth[who] / 2)[:, None]
        width, length = width * (1 - 2 * LEAF), depth[who] / 2

    def reach(axis: Array) -> Array:
        return abs(side @ axis) * width + abs(front @ axis) * length

    at, deep = (middle - near) @ along, (middle - near) @ inward - reach(inward) - opening.depth
    beside = abs(at - opening.width / 2) - opening.width / 2 - reach(along)
    out = xp.maximum(beside, deep)
    if opening.kind == "window":
        row = plan.stands("row")[who]  # flush with the wall, from which a single piece can draw back
        over = xp.where(row, GRAZE, xp.where(plan.of("storage"), STORED, TALL + HEADBOARD * plan.of("bed"))[who])
        low = opening.sill + over - (plan.position[who, 1] + plan.size[who, 1])
        return xp.maximum(out + xp.where(row, -BOARD, EDGE), xp.where(screens(plan)[who], -FAR, low))
    hinge, closed = map(plan.numbers, hinge_point(polygon, opening))
    if opening.swing == "slide":  # to the side of what would be its hinges
        aside = abs((middle - hinge) @ closed + opening.width / 2) - opening.width / 2 - reach(closed)
        out = xp.minimum(out, xp.maximum(aside, deep + opening.depth - SLID))
    if swings:  # of the corner of the square that the leaf does not sweep what one walks through
        x = at_least(abs((middle - hinge) @ closed) - reach(closed), 0.0)
        z = at_least(abs((middle - hinge) @ inward) - reach(inward), 0.0)
        out = xp.maximum(out, xp.sqrt(at_least(x * x + z * z, 1e-12)) - opening.width)
    if depth is None:
        further = max(ENTERED - opening.depth, 0.0) * plan.stands("company")[who]
        out = xp.minimum(out, xp.maximum(beside + max(opening.width - WALKED, 0.0) / 2, deep - further))
    return out + GRAZE
