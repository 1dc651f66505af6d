"""Rules of groups: seats at their tables, the table before its sofa, nightstands at the head."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from echomodel.objective.found import Found, found, nobody
from echomodel.objective.plan import Plan, facing_angle
from echomodel.vocabulary import vocabulary

LOOK = math.radians(60.0)  # chairs at a corner of their table look at it by up to 45 degrees
LOUNGE = math.radians(100.0)  # an armchair takes part in its group, it does not stare at the table
NEAR = 1.5  # metres: a seat further from its table is judged for its distance alone
COMPANY = 2.5  # metres: an armchair further away stands for itself
REACH = 0.6  # metres between a seat's front and its table: 99 % of real dining chairs are nearer
BEFORE = (0.12, 1.0)  # metres between a sofa and its coffee table: less than 0.3 is tight, a hand is too little
WITHIN = 0.35  # share of a sofa's width that the table's middle may lie beside its own: 80 % of real ones lie 0.2
BESIDE = 0.4  # metres between a bed and its nightstand: 95 % of real ones are nearer
PAIR = 0.15  # metres by which the gaps of the two nightstands of a bed may differ: 98 % of real ones differ less
IN_BED = 0.4  # metres by which a nightstand may reach into the box of a bed whose board is wider than it is
FOOT = 0.35  # metres between a bed's foot and the bench there: 95 % of real ones
ALONG = 0.38  # share of the bed's width by which its middle may lie beside the bed's: 95 % of real ones
HEAD = 0.45  # metres between the level of the headboard and the nightstand's back
TURNED = math.radians(45.0)  # 94 % of real nightstands look the same way as their bed


def seat_faces(plan: Plan) -> Found:
    """A seat that stands at a table or desk looks at it."""
    i, j = plan.attended("at")
    if not len(i):
        return nobody(plan.size)
    looks = (plan.gap(i, j).detach() < NEAR) & ~plan.which(lambda kind: kind.solid)[i]  # stools have no front
    i, j = i[looks], j[looks]
    lateral, forward = plan.nearest_point(i, j)
    inside = (lateral.square() + forward.square()).detach() < 1e-6
    centre = plan.local(j, i)
    lateral, forward = _turned(lateral, forward, plan.yaw[j] - plan.yaw[i])
    off = facing_angle(torch.where(inside, centre[0], lateral), torch.where(inside, centre[1], forward))
    return found(i, LOOK - off, other=j, measure=torch.rad2deg(off))


def seat_in_reach(plan: Plan) -> Found:
    """A seat whose work is at a table or desk stands at it, a stool at its dressing table."""
    i, j = plan.attended("at")
    if not len(i):
        return nobody(plan.size)
    works = plan.which(lambda kind: kind.access > 0 or kind.wall)  # at a dinner table stools go anywhere
    bound = ~plan.which(lambda kind: kind.solid)[i] | works[j]
    i, j = i[bound], j[bound]
    off = plan.gap(i, j) - plan.size[i, 2] / 2
    return found(i, REACH - off, other=j, measure=off)


def lounger_faces(plan: Plan) -> Found:
    """An armchair of a group is turned towards it."""
    i, j = plan.attended("company")
    if not len(i):
        return nobody(plan.size)
    near = plan.gap(i, j).detach() < COMPANY
    i, j = i[near], j[near]
    off = facing_angle(*plan.local(j, i))
    return found(i, LOUNGE - off, other=j, measure=torch.rad2deg(off))


def table_before_sofa(plan: Plan) -> Found:
    """A coffee table lies before its sofa, within its width and a hand's reach; of several one does."""
    i, j = plan.attended("before")
    if not len(i):
        return nobody(plan.size)
    lateral, forward = plan.local(i, j)
    _, half_depth = plan.reach(i, j)
    gap = forward - half_depth - plan.size[j, 2] / 2
    cornered = vocabulary().cornered
    ell = plan.which(lambda kind: kind.name in cornered)[j]
    least = torch.where(ell, BEFORE[0] - plan.size[j, 2] * 0.6, plan.numbers([BEFORE[0]]).expand_as(gap))
    within = WITHIN * plan.size[j, 0] - lateral.abs()
    margin = torch.stack([gap - least, BEFORE[1] - gap, within], -1)
    most = margin.new_full((len(plan),), -torch.inf).scatter_reduce(0, j, margin.amin(1), "amax")
    first = margin.amin(1).detach() >= most.detach()[j]
    return _first_of(i[first], j[first], margin[first], torch.stack([gap, gap, lateral.abs()], -1)[first])


def nightstand_at_head(plan: Plan) -> Found:
    """Nightstands stand beside the bed at its head; of more than two the nearest two."""
    i, j = plan.attended("head")
    if not len(i):
        return nobody(plan.size)
    lateral, forward = plan.local(i, j)
    half_width, half_depth = plan.reach(i, j)
    beside = lateral.abs() - half_width - plan.size[j, 0] / 2
    back = (forward - half_depth) + plan.size[j, 2] / 2
    rank = _rank_at(j, plan.gap(i, j).detach())
    turn = plan.yaw[i] - plan.yaw[j]
    off = facing_angle(turn.sin(), turn.cos())
    margin = torch.stack([BESIDE - beside, beside + IN_BED, HEAD - back.abs(), TURNED - off], -1)
    keep = rank < 2
    measure = torch.stack([beside, beside, back.abs(), torch.rad2deg(off)], -1)
    return _first_of(i[keep], j[keep], margin[keep], measure[keep])


def nightstands_alike(plan: Plan) -> Found:
    """The nightstands at both sides of a bed are as far from it as each other."""
    i, j = plan.attended("head")
    if not len(i):
        return nobody(plan.size)
    lateral, forward = plan.local(i, j)
    half_width, half_depth = plan.reach(i, j)
    beside = lateral.abs() - half_width - plan.size[j, 0] / 2
    at_head = ((forward - half_depth + plan.size[j, 2] / 2).abs() < HEAD) & (beside < BESIDE) & (beside > -IN_BED)
    right = lateral > 0
    pairs = (j[:, None] == j[None]) & (at_head & right)[:, None] & (at_head & ~right)[None]
    one, other = pairs.nonzero(as_tuple=True)
    apart = (beside[one] - beside[other]).abs()
    swap = (beside[one] < beside[other]).detach()
    return found(
        torch.where(swap, i[other], i[one]), PAIR - apart, other=torch.where(swap, i[one], i[other]), measure=apart
    )


def bench_at_foot(plan: Plan) -> Found:
    """A bench or ottoman at the foot of a bed stands close to it, within its width."""
    i, j = plan.attended("foot")
    i, j = (of[plan.of("bed")[j]] for of in (i, j))
    if not len(i):
        return nobody(plan.size)
    lateral, forward = plan.local(i, j)
    _, half_depth = plan.reach(i, j)
    gap = forward - half_depth - plan.size[j, 2] / 2
    margin = torch.stack([FOOT - gap, ALONG * plan.size[j, 0] - lateral.abs()], -1)
    return _first_of(i, j, margin, torch.stack([gap, lateral.abs()], -1))


def _rank_at(anchor: Tensor, distance: Tensor) -> Tensor:
    """(P,) int64: how many of the same anchor are nearer."""
    same = anchor[:, None] == anchor[None]
    order = torch.arange(len(anchor))
    nearer = (distance[None] < distance[:, None]) | ((distance[None] == distance[:, None]) & (order < order[:, None]))
    return (same & nearer).sum(1)


def _first_of(i: Tensor, j: Tensor, margin: Tensor, measure: Tensor) -> Found:
    """Of several demands (P, Q) the one that is missed by most."""
    least, which = margin.min(1)
    return found(i, least, other=j, measure=measure.gather(1, which[:, None])[:, 0], words=which)


def _turned(lateral: Tensor, forward: Tensor, turn: Tensor) -> tuple[Tensor, Tensor]:
    """A direction in a frame that is turned by `turn` to another one, in that other one."""
    cos, sin = turn.cos(), turn.sin()
    return cos * lateral + sin * forward, cos * forward - sin * lateral
