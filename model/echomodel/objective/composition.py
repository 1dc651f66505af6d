"""Terms of composition: how whole rooms are composed, where every piece alone may be right.

Distances were measured on 300 real rooms with their furniture, unless a standard is named.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

from echomodel.objective.found import Found, found, joined, nobody, worst
from echomodel.objective.plan import FAR, Plan
from echomodel.objective.zones import floor_gaps, floor_points, in_rooms
from echomodel.plans import REACH, filled_area

SERVED = 1.0  # metres: floor further from all furniture serves nothing
SOFT = 0.2  # metres on both sides of it over which a point of the floor counts in part
CELL = 0.25  # metres between points of the floor that are looked at
ELBOW = 0.55  # metres of a table's edge a seat: 96 % of real sides with two seats or more (0.6 m in DIN 68880)
FENCE = 0.03  # metres between two chairs of one side: 95 % of real ones
AT_SIDE = 0.7  # metres: chairs further from their table are not at it
OPENS = 0.55  # metres before a wardrobe to a bed: a leaf of 0.5 m and who stands aside of it
FACED = 0.3  # share of a wardrobe's width from which on something is before it
AT_HEAD = 0.4  # metres between a bed and a nightstand that serves it


def served_limit(area: float, width: Tensor, depth: Tensor) -> float:
    """Share of a floor (square metres) that may lie far from furniture of these widths and depths (n,), metres.

    The emptier a room, the more: 84 % of real rooms stay below exp(0.8 - 2 f), f being the area that the pieces fill
    (`filled_area`) over the floor's.
    """
    return min(1.0, math.exp(0.8 - 2.0 * filled_area(width.tolist(), depth.tolist()) / area))


def floor_served(plan: Plan) -> Found:
    """Furniture serves the whole floor: no more of it lies far from everything than so much furniture must leave."""
    out = nobody(plan.size)
    for scenes, area, points, _ in floor_points(plan, CELL):
        there = in_rooms(plan, scenes)
        if there.shape[1] < 2:
            continue
        size = plan.size[there[0]].detach()
        row = plan.stands("row")[there[0]]  # whose neighbours fill what is beside each
        gap, nearest = floor_gaps(plan, there, points)
        share = ((gap - SERVED + SOFT) / (2 * SOFT)).clamp(0.0, 1.0).mean(1)
        margin = served_limit(area, size[:, 0] - 2 * REACH * row, size[:, 2]) - share
        farthest = nearest.gather(1, gap.detach().argmax(1, keepdim=True))[:, 0]
        out = joined(out, found(farthest, margin, measure=100.0 * share))
    return out


def elbow_room(plan: Plan) -> Found:
    """Who sits beside others at a table has room for the elbows, and chairs stand apart."""
    i, j = plan.attended("at", "foot")
    tables = plan.which(lambda kind: kind.role == "board" and not (kind.access or kind.wall))
    keep = tables[j] & plan.of("seat")[i] & (plan.apart(i, j).detach() < AT_SIDE)
    i, j = i[keep], j[keep]
    if not len(i):
        return nobody(plan.size)
    lateral, forward = plan.local(i, j)
    half = plan.size[j][:, [0, 2]].detach() / 2
    ahead = forward.detach().abs() - half[:, 1] > lateral.detach().abs() - half[:, 0]
    along, across = torch.where(ahead, lateral, forward), torch.where(ahead, forward, lateral).detach()
    side = 4 * j + 2 * ahead + (across > 0)
    one, other = ((side[:, None] == side[None]) & (along[:, None] < along[None])).nonzero(as_tuple=True)
    if not len(one):
        return nobody(plan.size)
    count = torch.bincount(side, minlength=4 * len(plan))[side]
    edge = torch.where(ahead, plan.size[j, 0], plan.size[j, 2]) / count
    half_width, half_depth = plan.reach(i, j)
    reach = torch.where(ahead, half_width, half_depth)
    gap = along[other] - along[one] - reach[one] - reach[other]
    margins = torch.stack([edge[one] - ELBOW, gap - FENCE], -1)
    least, which = margins.min(1)
    measure = torch.stack([edge[one], gap.clamp_min(0.0)], -1).gather(1, which[:, None])[:, 0]
    at, row = worst(j[one], least, torch.arange(len(one)), len(plan), FAR)
    who = j[one].unique()
    return found(who, at[who], measure=measure[row[who]], words=which[row[who]])


def wardrobe_opens(plan: Plan) -> Found:
    """One can stand before an open wardrobe, also at the foot of a bed."""
    wardrobes = plan.of("storage") & plan.standing & plan.which(lambda kind: kind.access > 0.6)
    i, j = plan.pairs(wardrobes, plan.of("bed") & plan.standing)
    if not len(i):
        return nobody(plan.size)
    lateral, forward = plan.local(j, i)
    half_width, half_depth = plan.reach(j, i)
    clear = forward - half_depth - plan.size[i, 2] / 2
    covered = torch.minimum(plan.size[i, 0], plan.size[i, 0] / 2 + half_width - lateral.abs())
    margin = torch.maximum(torch.maximum(clear - OPENS, FACED * plan.size[i, 0] - covered), -forward)
    least, about = worst(i, margin, j, len(plan), FAR)
    who = i.unique()
    return found(who, least[who], other=about[who], measure=(least[who] + OPENS).clamp_min(0.0))


def each_served(plan: Plan) -> Found:
    """No desk has two chairs while another has none, no bed two nightstands while another has none."""
    out = nobody(plan.size)
    desks = plan.which(lambda kind: kind.role == "board" and kind.access > 0) & plan.standing
    for hosts, guests, near in (
        (desks, plan.stands("at") & plan.of("seat"), AT_SIDE),
        (plan.of("bed") & plan.standing, plan.stands("head"), AT_HEAD),
    ):
        i, j = plan.pairs(guests & plan.standing, hosts)
        close = plan.apart(i, j).detach() < near
        served = torch.zeros(len(plan), dtype=torch.int64).index_add(0, j[close], torch.ones_like(j[close]))
        one, other = plan.pairs(hosts, hosts)
        unfair = (served[one] == 0) & (served[other] > 1)
        who = one[unfair].unique()
        about = torch.full((len(plan),), -1, dtype=torch.int64).index_put((one[unfair],), other[unfair])
        out = joined(out, found(who, torch.full_like(plan.yaw[who], -1.0), other=about[who]))
    return out
