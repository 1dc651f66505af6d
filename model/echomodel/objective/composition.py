"""Terms of composition: how whole rooms are composed, where every piece alone may be right.

Distances were measured on 300 real rooms with their furniture, unless a standard is named.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

from echomodel.objective.company import AROUND, seats_at
from echomodel.objective.found import Found, found, joined, nobody, worst
from echomodel.objective.groups import BESIDE
from echomodel.objective.plan import FAR, Plan
from echomodel.objective.zones import floor_gaps, floor_points
from echomodel.plans import REACH, filled_area

SERVED = 1.0  # metres: floor further from all furniture serves nothing
SOFT = 0.2  # metres on both sides of it over which a point of the floor counts in part
ELBOW = 0.55  # metres of a table's edge a seat: 96 % of real sides with two seats or more (0.6 m in DIN 68880)
FENCE = 0.03  # metres between two chairs of one side: 95 % of real ones
OPENS = 0.55  # metres before a wardrobe to a bed: a leaf of 0.5 m and who stands aside of it
FACED = 0.3  # share of a wardrobe's width from which on something is before it


def served_limit(area: float, width: Tensor, depth: Tensor) -> float:
    """Share of a floor (square metres) that may lie far from furniture of these widths and depths (n,), metres.

    The emptier a room, the more: 84 % of real rooms stay below exp(0.8 - 2 f), f being the area that the pieces fill
    (`filled_area`) over the floor's.
    """
    return min(1.0, math.exp(0.8 - 2.0 * filled_area(width.tolist(), depth.tolist()) / area))


def floor_served(plan: Plan) -> Found:
    """Furniture serves the whole floor: no more of it lies far from everything than so much furniture must leave."""
    out = nobody(plan.size)
    for scenes, area, points, _ in floor_points(plan):
        there, far, gap, nearest = floor_gaps(plan, scenes, points)
        if not len(far):
            continue
        size = plan.size[there[0]].detach()
        row = plan.stands("row")[there[0]]  # whose neighbours fill what is beside each
        share = ((gap - SERVED + SOFT) / (2 * SOFT)).clamp(0.0, 1.0).sum(1) / len(points)
        margin = served_limit(area, size[:, 0] - 2 * REACH * row, size[:, 2]) - share
        farthest = nearest.gather(1, gap.detach().argmax(1, keepdim=True))[:, 0]
        out = joined(out, found(farthest, margin, measure=100.0 * share))
    return out


def elbow_room(plan: Plan) -> Found:
    """Who sits beside others at a table has room for the elbows, and chairs stand apart."""
    seats = seats_at(plan)
    if seats is None:
        return nobody(plan.size)
    i, j = seats.i, seats.j
    one, other = seats.beside()
    keep = plan.of("seat")[i[one]] & plan.of("seat")[i[other]]
    one, other = one[keep], other[keep]
    edge = torch.where(seats.ahead, plan.size[j, 0], plan.size[j, 2]) / seats.count
    half_width, half_depth = plan.reach(i, j)
    reach = torch.where(seats.ahead, half_width, half_depth)
    gap = seats.along[other] - seats.along[one] - reach[one] - reach[other]
    margins = torch.stack([edge[one] - ELBOW, gap - FENCE], -1)
    least, which = margins.min(1)
    measure = torch.stack([edge[one], gap.clamp_min(0.0)], -1).gather(1, which[:, None])[:, 0]
    at, row = worst(j[one], least, torch.arange(len(one)), len(plan), FAR)
    who = (at < FAR).nonzero()[:, 0]
    return found(who, at[who], measure=measure[row[who]], words=which[row[who]])


def wardrobe_opens(plan: Plan) -> Found:
    """One can stand before an open wardrobe, also at the foot of a bed."""
    wardrobes = plan.of("storage") & plan.standing & plan.which(lambda kind: kind.access > 0.6)
    i, j = plan.pairs(wardrobes, plan.of("bed") & plan.standing, least=True)
    if not len(i):
        return nobody(plan.size)
    clear, covered, forward = plan.ahead(i, j)
    margin = torch.maximum(torch.maximum(clear - OPENS, FACED * plan.size[i, 0] - covered), -forward)
    least, about = plan.worst(i, margin, j)
    who = (least < FAR).nonzero()[:, 0]
    return found(who, least[who], other=about[who], measure=(least[who] + OPENS).clamp_min(0.0))


def each_served(plan: Plan) -> Found:
    """No desk has two chairs while another has none, no bed two nightstands while another has none."""
    out = nobody(plan.size)
    desks = plan.of("board") & plan.works & plan.standing
    for hosts, guests, near in (
        (desks, plan.stands("at") & plan.of("seat"), AROUND),
        (plan.of("bed") & plan.standing, plan.stands("head"), BESIDE),
    ):
        one, other = plan.pairs(hosts, hosts)
        if not len(one):
            continue
        i, j = plan.pairs(guests & plan.standing, hosts)
        close = plan.apart(i, j).detach() < near
        served = torch.zeros(len(plan), dtype=torch.int64).index_add(0, j[close], torch.ones_like(j[close]))
        unfair = (served[one] == 0) & (served[other] > 1)
        who = one[unfair].unique()
        about = torch.full((len(plan),), -1, dtype=torch.int64).index_put((one[unfair],), other[unfair])
        out = joined(out, found(who, torch.full_like(plan.yaw[who], -1.0), other=about[who]))
    return out
