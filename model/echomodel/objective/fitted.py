"""Terms of fitted rooms: kitchens in rows, their ways and landings, and where one stands at what washes."""

from __future__ import annotations

import torch
from torch import Tensor

from echomodel.objective.access import before_fronts
from echomodel.objective.plan import FAR, Found, Plan, found, joined, nobody, worst
from echomodel.openings import segment
from echomodel.sizes import AISLE, LANDING, TALL, TRIANGLE

FLUSH = 0.02  # metres between neighbours of a row, and between their backs
CENTRED = 0.06  # metres between the middles of a hood and its hob, of a mirror and its basin
COVERED = 0.85  # share of a wall unit's width that has a worktop below
WALKED = 0.3  # metres before a front where the ways between hob, sink and fridge begin
POINTS = 9  # of each way that are looked at


def row_flush(plan: Plan) -> Found:
    """Fitted units stand in a row: no gap to the next one, backs in one line, or corner to corner."""
    units = plan.stands("row") & plan.standing
    i, j = plan.pairs(units, units)
    lateral, forward = plan.local(i, j)
    half_width, half_depth = plan.reach(i, j)
    level = (forward - half_depth + plan.size[j, 2] / 2).abs()
    gap = (lateral.abs() - half_width - plan.size[j, 0] / 2).abs()
    along = (plan.yaw[i] - plan.yaw[j]).cos()
    off = torch.where(along > 0.99, torch.maximum(gap, level), torch.where(along.abs() < 0.01, plan.apart(i, j), FAR))
    least, about = worst(i, off.abs(), j, len(plan), FAR)
    who = i.unique()
    return found(who, FLUSH - least[who], other=about[who], measure=least[who])


def hung_over(plan: Plan) -> Found:
    """Wall units hang over worktops, a hood over the middle of its hob, a mirror over its basin."""
    hung = plan.stands("over")
    tops = plan.stands("row") & plan.standing & (plan.size[:, 1].detach() <= TALL)
    i, j = plan.pairs(hung & plan.which(lambda kind: kind.task == "store"), tops)
    lateral, forward = plan.local(i, j)
    half_width, _ = plan.reach(i, j)
    shared = torch.minimum(2 * half_width, half_width + plan.size[j, 0] / 2 - lateral.abs()).clamp_min(0.0)
    below = forward.abs() < plan.size[j, 2] / 2
    total = torch.zeros_like(plan.yaw).index_add(0, i, torch.where(below, shared, torch.zeros_like(shared)))
    who = i.unique()
    out = found(who, total[who] - COVERED * plan.size[who, 0], measure=100 * total[who] / plan.size[who, 0])
    one, other = plan.attended("over")
    single = ~plan.which(lambda kind: kind.task == "store")[one]
    one, other = one[single], other[single]
    lateral, forward = plan.local(one, other)
    off = torch.maximum(lateral.abs() - CENTRED, forward.abs() - plan.size[other, 2] / 2)
    return joined(out, found(one, -off, other=other, measure=off + CENTRED, words=torch.ones_like(one)))


def aisle(plan: Plan) -> Found:
    """One opens an oven with somebody behind: units keep an aisle to what stands opposite, and one walks along them."""
    works = plan.which(lambda kind: bool(kind.task)) & plan.standing
    i, j = plan.pairs(works, works)
    lateral, forward = plan.local(j, i)
    half_width, half_depth = plan.reach(j, i)
    facing = ((plan.yaw[i] - plan.yaw[j]).cos() < -0.9) | ~plan.stands("row")[j]
    met = facing & (lateral.abs() < half_width + plan.size[i, 0] / 2 - 0.1) & (forward > 0)
    clear = forward - half_depth - plan.size[i, 2] / 2
    least, about = worst(i, torch.where(met, clear, FAR), j, len(plan), FAR)
    who = i.unique()
    return found(who, least[who] - AISLE, other=about[who], measure=least[who])


def work_triangle(plan: Plan) -> Found:
    """The ways between hob, sink and fridge are neither cramped nor long, and nothing stands in them."""
    tasks = {task: plan.which(lambda kind, task=task: kind.task == task) & plan.standing  # type: ignore[misc]
             for task in ("cook", "wash", "cool")}  # fmt: skip
    cook = plan.those(tasks["cook"])
    ends = [(cook, _front(plan, cook))]
    for task in ("wash", "cool"):
        i, j = plan.pairs(tasks["cook"], tasks[task])
        away = (plan.position[i] - plan.position[j])[:, [0, 2]].norm(dim=1)
        near = worst(i, away, j, len(plan), FAR)[1][cook]
        ends.append((near, _front(plan, near.clamp_min(0))))
    there = (torch.stack([number for number, _ in ends]) >= 0).all(0)
    cook, points = cook[there], [point[there] for _, point in ends]
    if not len(cook):
        return nobody(plan.size)
    pairs = ((0, 1), (1, 2), (2, 0))
    way = sum((points[a] - points[b]).norm(dim=1) for a, b in pairs)
    low, high = TRIANGLE
    out = found(cook, torch.minimum(way - low, high - way), measure=way, words=(way > high).long())
    share = plan.numbers([(k + 0.5) / POINTS for k in range(POINTS)])[:, None]
    walked = torch.cat([points[a][:, None] * share + points[b][:, None] * (1 - share) for a, b in pairs], 1)
    others = plan.standing & ~plan.movable & ~plan.stands("row") & (plan.size[:, 1].detach() > 0.3)
    i, j = plan.pairs(tasks["cook"], others)
    keep = torch.isin(i, cook)
    i, j = i[keep], j[keep]
    number = torch.full((len(plan),), -1).index_put((cook,), torch.arange(len(cook)))
    lateral, forward = plan.seen(j[:, None], walked[number[i]])
    beside, ahead = lateral.abs() - plan.size[j, None, 0] / 2, forward.abs() - plan.size[j, None, 2] / 2
    least, about = worst(i, torch.maximum(beside, ahead).amin(1), j, len(plan), FAR)
    blocked = found(cook, least[cook], other=about[cook], measure=-least[cook], words=torch.full_like(cook, 2))
    return joined(out, blocked)


def _front(plan: Plan, who: Tensor) -> Tensor:
    """(P, 2): where one stands before boxes."""
    return plan.position[who][:, [0, 2]] + plan.axes(who)[1] * (plan.size[who, 2] / 2 + WALKED)[:, None]


def hob_safe(plan: Plan) -> Found:
    """A hob has worktop beside it to put a pan down, and lies neither in a corner nor under a window."""
    hobs = plan.which(lambda kind: kind.task == "cook") & plan.standing
    rows = plan.stands("row") & plan.standing
    i, j = plan.pairs(hobs, rows)
    if not bool(hobs.any()):
        return nobody(plan.size)
    lateral, forward = plan.local(j, i)
    half_width, half_depth = plan.reach(j, i)
    along = (plan.yaw[i] - plan.yaw[j]).cos()
    beside = (along > 0.99) & ((lateral.abs() - half_width - plan.size[i, 0] / 2).abs() < 2 * FLUSH)
    worktop = torch.where(beside & (plan.size[j, 1] <= TALL), plan.size[j, 0], torch.zeros_like(lateral))
    who = plan.those(hobs)
    landing, _ = worst(i, -worktop, j, len(plan), 0.0)
    out = found(who, -landing[who] - LANDING, measure=-landing[who])
    across = along.abs() < 0.01
    inner = torch.maximum(lateral.abs() - half_width - plan.size[i, 0] / 2, forward - half_depth - plan.size[i, 2] / 2)
    least, about = worst(i, torch.where(across, inner, FAR), j, len(plan), FAR)
    start, along_wall, normal, length = (of[plan.scene[who]] for of in plan.walls)
    side = plan.axes(who)[0][:, None]
    off = plan.position[who][:, None, [0, 2]] - start
    gap = (off * normal).sum(-1) - plan.size[who, None, 0] / 2
    at = (off * along_wall).sum(-1)
    met = (length > 0) & ((normal * side).sum(-1).abs() > 0.9) & (at > 0) & (at < length) & (gap > -0.1)
    wall = torch.where(met, gap, FAR).amin(1)
    corner = torch.minimum(least[who], wall)
    out = joined(out, found(who, corner - LANDING / 2, other=torch.where(wall < least[who], -1, about[who]),
                            measure=corner, words=torch.ones_like(who)))  # fmt: skip
    return joined(out, _under_windows(plan, who))


def _under_windows(plan: Plan, who: Tensor) -> Found:
    margin = torch.full_like(plan.yaw[who], FAR)
    for scenes, polygon, openings in plan.rooms:
        here = torch.isin(plan.scene[who], scenes)
        for one in (opening for opening in openings if opening.kind == "window" and opening.edge < len(polygon)):
            ends = plan.numbers(segment(polygon, one).tolist())
            lateral, forward = plan.seen(who[:, None], ends)
            behind = (forward < -plan.size[who, None, 2] / 4).all(1) & (forward > -plan.size[who, None, 2]).all(1)
            beside = torch.maximum(lateral.amin(1) - plan.size[who, 0] / 2, -lateral.amax(1) - plan.size[who, 0] / 2)
            margin = torch.where(here & behind, torch.minimum(margin, beside), margin)
    return found(who, margin, measure=-margin, words=torch.full_like(who, 2))


def standing_room(plan: Plan) -> Found:
    """One stands, sits and bends before what washes: its whole front is clear so deep as it takes."""
    depth = plan.column(lambda kind: kind.clear)
    return before_fronts(plan, (depth > 0) & plan.standing, depth)
