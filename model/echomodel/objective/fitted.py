"""Terms of fitted rooms: kitchens in rows, their ways and landings, and where one stands at what washes."""

from echomodel.arrays import Array, at_least, full, norm, rows, sum_of
from echomodel.objective.access import before_fronts
from echomodel.objective.plan import FAR, Found, Plan, found, joined, worst
from echomodel.openings import segment
from echomodel.sizes import AISLE, LANDING, TALL, TRIANGLE

FLUSH = 0.02  # metres between neighbours of a row, and between their backs
CENTRED = 0.06  # metres between the middles of a hood and its hob, of a mirror and its basin
COVERED = 0.85  # share of a wall unit's width that has a worktop below
WALKED = 0.3  # metres before a front where the ways between hob, sink and fridge begin
POINTS = 9  # of each way that are looked at


def row_flush(plan: Plan) -> Found:
    """Fitted units stand in a row: no gap to the next one, backs in one line, or corner to corner."""
    units, xp = plan.stands("row") & plan.standing, plan.kit
    i, j = plan.pairs(units, units)
    lateral, forward = plan.local(i, j)
    half_width, half_depth = plan.reach(i, j)
    level = abs(forward - half_depth + plan.size[j, 2] / 2)
    gap = abs(abs(lateral) - half_width - plan.size[j, 0] / 2)
    along = xp.cos(plan.yaw[i] - plan.yaw[j])
    off = xp.where(along > 0.99, xp.maximum(gap, level), xp.where(abs(along) < 0.01, plan.apart(i, j), FAR))
    least, about = worst(i, abs(off), j, len(plan), FAR)
    who = rows(xp.bincount(i) > 0)
    return found(who, FLUSH - least[who], other=about[who], measure=least[who])


def hung_over(plan: Plan) -> Found:
    """Wall units hang over worktops, a hood over the middle of its hob, a mirror over its basin."""
    hung, stores, xp = plan.stands("over"), plan.which(lambda kind: kind.task == "store"), plan.kit
    i, j = plan.pairs(hung & stores, plan.stands("row") & plan.standing & (plan.size[:, 1] <= TALL))
    lateral, forward = plan.local(i, j)
    half_width, _ = plan.reach(i, j)
    shared = at_least(xp.minimum(2 * half_width, half_width + plan.size[j, 0] / 2 - abs(lateral)), 0.0)
    total = sum_of(i, xp.where(abs(forward) < plan.size[j, 2] / 2, shared, 0.0), len(plan))
    who = rows(xp.bincount(i) > 0)
    out = found(who, total[who] - COVERED * plan.size[who, 0], measure=100 * total[who] / plan.size[who, 0])
    one, other = plan.attended("over")
    single = ~stores[one]
    one, other = one[single], other[single]
    lateral, forward = plan.local(one, other)
    off = xp.maximum(abs(lateral) - CENTRED, abs(forward) - plan.size[other, 2] / 2)
    return joined(out, found(one, -off, other=other, measure=off + CENTRED, words=xp.ones_like(one)))


def aisle(plan: Plan) -> Found:
    """One opens an oven with somebody behind: units keep an aisle to what stands opposite, and one walks along them."""
    works = plan.which(lambda kind: bool(kind.task)) & plan.standing
    i, j = plan.pairs(works, works)
    lateral, forward = plan.local(j, i)
    half_width, half_depth = plan.reach(j, i)
    facing = (plan.kit.cos(plan.yaw[i] - plan.yaw[j]) < -0.9) | ~plan.stands("row")[j]
    met = facing & (abs(lateral) < half_width + plan.size[i, 0] / 2 - 0.1) & (forward > 0)
    clear = forward - half_depth - plan.size[i, 2] / 2
    least, about = worst(i, plan.kit.where(met, clear, FAR), j, len(plan), FAR)
    who = rows(plan.kit.bincount(i) > 0)
    return found(who, least[who] - AISLE, other=about[who], measure=least[who])


def work_triangle(plan: Plan) -> Found:
    """The ways between hob, sink and fridge are neither cramped nor long, and nothing stands in them."""
    tasks = {task: plan.which(lambda kind, task=task: kind.task == task) & plan.standing  # type: ignore[misc]
             for task in ("cook", "wash", "cool")}  # fmt: skip
    cook, xp = plan.those(tasks["cook"]), plan.kit
    ends = [(cook, _front(plan, cook))]
    for task in ("wash", "cool"):
        i, j = plan.pairs(tasks["cook"], tasks[task])
        away = norm((plan.position[i] - plan.position[j])[:, ::2])
        near = worst(i, away, j, len(plan), FAR)[1][cook]
        ends.append((near, _front(plan, at_least(near, 0))))
    there = (xp.stack([number for number, _ in ends]) >= 0).all(0)
    cook, points = cook[there], [point[there] for _, point in ends]
    pairs = ((0, 1), (1, 2), (2, 0))
    way = sum(norm(points[a] - points[b]) for a, b in pairs)
    low, high = TRIANGLE
    out = found(cook, xp.minimum(way - low, high - way), measure=way, words=1 * (way > high))
    share = plan.numbers([(k + 0.5) / POINTS for k in range(POINTS)])[:, None]
    walked = xp.concat([points[a][:, None] * share + points[b][:, None] * (1 - share) for a, b in pairs], 1)
    others = plan.standing & ~plan.movable & ~plan.stands("row") & (plan.size[:, 1] > 0.3)
    row, j = plan.beside(cook, others)
    lateral, forward = plan.seen(j[:, None], walked[row])
    beside, ahead = abs(lateral) - plan.size[j, None, 0] / 2, abs(forward) - plan.size[j, None, 2] / 2
    least, about = worst(row, xp.amin(xp.maximum(beside, ahead), 1), j, len(cook), FAR)
    blocked = found(cook, least, other=about, measure=-least, words=xp.full_like(cook, 2))
    return joined(out, blocked)


def _front(plan: Plan, who: Array) -> Array:
    """(P, 2): where one stands before boxes."""
    return plan.position[who][:, ::2] + plan.axes(who)[1] * (plan.size[who, 2] / 2 + WALKED)[:, None]


def hob_safe(plan: Plan) -> Found:
    """A hob has worktop beside it to put a pan down, and lies neither in a corner nor under a window."""
    hobs = plan.which(lambda kind: kind.task == "cook") & plan.standing
    i, j = plan.pairs(hobs, plan.stands("row") & plan.standing)
    who, xp = plan.those(hobs), plan.kit
    lateral, forward = plan.local(j, i)
    half_width, half_depth = plan.reach(j, i)
    along = xp.cos(plan.yaw[i] - plan.yaw[j])
    aside = abs(lateral) - half_width - plan.size[i, 0] / 2
    beside = (along > 0.99) & (abs(aside) < 2 * FLUSH)
    worktop = xp.where(beside & (plan.size[j, 1] <= TALL), plan.size[j, 0], 0.0)
    landing, _ = worst(i, -worktop, j, len(plan), 0.0)
    out = found(who, -landing[who] - LANDING, measure=-landing[who])
    inner = xp.maximum(aside, forward - half_depth - plan.size[i, 2] / 2)
    least, about = worst(i, xp.where(abs(along) < 0.01, inner, FAR), j, len(plan), FAR)
    side = plan.axes(who)[0][:, None] * plan.size[who, None, :1] / 2
    wall = xp.amin(plan.inside(plan.position[who][:, None, ::2] + xp.concat([side, -side], 1), who), 1)
    corner = xp.minimum(least[who], wall)
    out = joined(out, found(who, corner - LANDING / 2, other=xp.where(wall < least[who], -1, about[who]),
                            measure=corner, words=xp.ones_like(who)))  # fmt: skip
    return joined(out, _under_windows(plan, who))


def _under_windows(plan: Plan, who: Array) -> Found:
    margin, xp = full(plan.yaw, len(who), FAR), plan.kit
    for scenes, polygon, openings in plan.rooms:
        here = (plan.scene[who] >= scenes[0]) & (plan.scene[who] <= scenes[-1])
        for one in (opening for opening in openings if opening.kind == "window" and opening.edge < len(polygon)):
            ends = plan.numbers(segment(polygon, one).tolist())
            lateral, forward = plan.seen(who[:, None], ends)
            behind = (forward < -plan.size[who, None, 2] / 4).all(1) & (forward > -plan.size[who, None, 2]).all(1)
            beside = xp.maximum(xp.amin(lateral, 1), -xp.amax(lateral, 1)) - plan.size[who, 0] / 2
            margin = xp.where(here & behind, xp.minimum(margin, beside), margin)
    return found(who, margin, measure=-margin, words=xp.full_like(who, 2))


def standing_room(plan: Plan) -> Found:
    """One stands, sits and bends before what washes: its whole front is clear so deep as it takes."""
    depth = plan.column(lambda kind: kind.clear)
    return before_fronts(plan, (depth > 0) & plan.standing, depth)
