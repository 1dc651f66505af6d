"""Rules of groups: seats at their tables, the table before its sofa, nightstands at the head, chairs evenly around."""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from echomodel.boxes2d import turned
from echomodel.objective.plan import FAR, Found, Plan, facing_angle, found, joined, worst
from echomodel.vocabulary import vocabulary

LOOK = math.radians(60.0)  # chairs at a corner of their table look at it by up to 45 degrees
LOUNGE = math.radians(100.0)  # an armchair takes part in its group, it does not stare at the table
NEAR_TABLE = 1.5  # metres: a seat further from its table is judged for its distance alone
COMPANY = 2.5  # metres: an armchair further away stands for itself
TOGETHER = 1.5  # metres between armchairs without a sofa: all real ones are nearer
REACH = 0.25  # metres between a seat's front and its table: 95 % of real chairs are nearer
BEFORE_SOFA = (0.12, 1.0)  # metres between a sofa and its coffee table: less than 0.3 is tight, a hand is too little
AT_DESK = 0.33  # share of a desk's width that a seat's middle may lie beside its own: 19 of 20 real ones
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
    looks = (plan.gap(i, j).detach() < NEAR_TABLE) & ~plan.solid[i]  # stools have no front
    i, j = i[looks], j[looks]
    lateral, forward = plan.nearest_point(i, j)
    inside = (lateral.square() + forward.square()).detach() < 1e-6
    centre = plan.local(j, i)
    lateral, forward = turned(torch.stack([lateral, forward], -1), plan.yaw[j] - plan.yaw[i]).unbind(-1)
    off = facing_angle(torch.where(inside, centre[0], lateral), torch.where(inside, centre[1], forward))
    return found(i, LOOK - off, other=j, measure=torch.rad2deg(off))


def seat_in_reach(plan: Plan) -> Found:
    """A seat whose work is at a table or desk stands at it, a stool at its dressing table, a bench at its table."""
    i, j = plan.attended("at", "foot", to=plan.of("board"))
    works = plan.which(lambda kind: kind.access > 0 or kind.wall)  # at a dinner table stools go anywhere
    bound = ~plan.solid[i] | works[j]
    i, j = i[bound], j[bound]
    off = plan.gap(i, j) - plan.size[i, 2] / 2
    return found(i, REACH - off, other=j, measure=off)


def seat_before_desk(plan: Plan) -> Found:
    """Who works at a desk or dressing table sits before it, not at its corner."""
    i, j = plan.attended("at", to=plan.which(lambda kind: kind.role == "board" and (kind.access > 0 or kind.wall)))
    near = plan.gap(i, j).detach() < NEAR_TABLE
    i, j = i[near], j[near]
    aside = plan.local(i, j)[0].abs()
    return found(i, AT_DESK * plan.size[j, 0] - aside, other=j, measure=aside)


def lounger_faces(plan: Plan) -> Found:
    """An armchair of a group is turned towards it, and towards the sofa before which it stands."""
    i, j = plan.attended("company")
    near = plan.gap(i, j).detach() < COMPANY
    sofa = plan.group[i]
    lateral, forward = plan.local(i, sofa)
    before = plan.of("sofa")[sofa] & (forward > plan.size[sofa, 2] / 2) & (lateral.abs() < plan.size[sofa, 0] / 2)
    i, j = torch.cat([i[near], i[near & before]]), torch.cat([j[near], sofa[near & before]])
    off = facing_angle(*plan.local(j, i))
    return found(i, LOUNGE - off, other=j, measure=torch.rad2deg(off))


def loungers_together(plan: Plan) -> Found:
    """Armchairs without a sofa stand together, none with its back to the next one."""
    lone = plan.stands("company") & (plan.anchor < 0) & plan.standing
    i, j = plan.pairs(lone, lone)
    first = _rank_at(i, plan.apart(i, j).detach()) == 0
    i, j = i[first], j[first]
    off, apart = facing_angle(*plan.local(j, i)), plan.apart(i, j)
    margin = torch.stack([LOUNGE - off, TOGETHER - apart], -1)
    return _first_of(i, j, margin, torch.stack([torch.rad2deg(off), apart], -1))


def table_before_sofa(plan: Plan) -> Found:
    """A coffee table lies before its sofa, within its width and a hand's reach; of several one does."""
    i, j = plan.attended("before")
    lateral, forward = plan.local(i, j)
    _, half_depth = plan.reach(i, j)
    gap = forward - half_depth - plan.size[j, 2] / 2
    cornered = vocabulary().cornered
    ell = plan.which(lambda kind: kind.name in cornered)[j]
    least = torch.where(ell, BEFORE_SOFA[0] - plan.size[j, 2] * 0.6, plan.numbers([BEFORE_SOFA[0]]).expand_as(gap))
    within = WITHIN * plan.size[j, 0] - lateral.abs()
    margin = torch.stack([gap - least, BEFORE_SOFA[1] - gap, within], -1)
    most = margin.new_full((len(plan),), -torch.inf).scatter_reduce(0, j, margin.amin(1), "amax")
    first = margin.amin(1).detach() >= most.detach()[j]
    return _first_of(i[first], j[first], margin[first], torch.stack([gap, gap, lateral.abs()], -1)[first])


def nightstand_at_head(plan: Plan) -> Found:
    """Nightstands stand beside the bed at its head; of more than two the nearest two."""
    i, j = plan.attended("head")
    _, beside, back = _at_bed(plan, i, j)
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
    lateral, beside, back = _at_bed(plan, i, j)
    at_head, right = (back.abs() < HEAD) & (beside < BESIDE) & (beside > -IN_BED), lateral > 0
    pairs = (j[:, None] == j[None]) & (at_head & right)[:, None] & (at_head & ~right)[None]
    one, other = pairs.nonzero(as_tuple=True)
    apart = (beside[one] - beside[other]).abs()
    swap = (beside[one] < beside[other]).detach()
    return found(
        torch.where(swap, i[other], i[one]), PAIR - apart, other=torch.where(swap, i[one], i[other]), measure=apart
    )


def _at_bed(plan: Plan, i: Tensor, j: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """(P,) each, metres: how far i lies to the side of bed j, how far beside its edge, and before the head's level."""
    lateral, forward = plan.local(i, j)
    half_width, half_depth = plan.reach(i, j)
    return lateral, lateral.abs() - half_width - plan.size[j, 0] / 2, forward - half_depth + plan.size[j, 2] / 2


def bench_at_foot(plan: Plan) -> Found:
    """A bench or ottoman at the foot of a bed stands close to it, within its width."""
    i, j = plan.attended("foot", to=plan.of("bed"))
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


EVEN = 0.16  # metres between a table's middle and the middle of its chairs, one chair pulled out is less
PLACE = 0.62  # metres at a table that one who sits there takes: two on a bench
ODD = 0.6  # share of the table's half side that an odd chair may shift that middle, over the number of chairs
STAGGERED = 0.12  # metres between a chair's middle and that of the one opposite, where both sides have as many
LEVEL = 0.12  # metres by which chairs are pushed under their table unlike each other
AROUND = 0.7  # metres: chairs further from their table are not at it
CIRCLE = math.radians(100.0)  # a sofa is turned so far at most from the middle of its group
BEFORE = 0.8  # metres before the larger sofa, where the middle of the group is
NEAR = 3.0  # metres: a sofa further away stands for itself
COVERS = 0.12  # share of a sofa's width that side tables and lamps may stand before
AHEAD = 0.1  # metres that their middles may lie before its front: 97 % of real ones lie less
SIDE = 0.6  # metres: what is further from its seat stands for itself
ELBOW, KNEES = 0.2, 0.3  # share of a sofa's width that an armchair may stand before, and metres from which on all of it
LEFT, OWN = 1.8, 0.6  # metres from its group from which on an armchair stands apart, and to what is its own: all real
ALONE = 0.45  # metres from everything: nothing small stands so in a room
# Metres less from furniture: 98 % of real plants are at a wall, the others touch something; of side tables and floor
# lamps within 0.3, and these of what one sits, lies or works at.
OF_PLANTS, OF_SMALL = 0.35, 0.15
EDGE = 0.8  # metres between a wall and an armchair that belongs to no group


@dataclass(frozen=True, eq=False)
class Seats:
    """Who sits around tables.

    Arguments:
        i, j: (P,) int64, a seat and its table.
        ahead: (P,) bool, whether it sits at the table's front or back, not at one of its sides.
        along, across: (P,) float, metres from the table's middle along the side where it sits and away from it.
        side: (P,) int64, number of that side among all sides of all tables; the one opposite is `side ^ 1`.
        count, rank: (P,) int64, how many sit there, and how many of them further to the left.
    """

    i: Tensor
    j: Tensor
    ahead: Tensor
    along: Tensor
    across: Tensor
    side: Tensor
    count: Tensor
    rank: Tensor

    def facing(self) -> tuple[Tensor, Tensor]:
        """Rows (Q,) of seats that have another one opposite, of as many, and rows (Q,) of those."""
        one, other = self._rows(self.side ^ 1, self.rank)
        keep = self.count[one] == self.count[other]
        return one[keep], other[keep]

    def beside(self) -> tuple[Tensor, Tensor]:
        """Rows (Q,) of seats that have another one to their right, and rows (Q,) of those."""
        return self._rows(self.side, self.rank + 1)

    def _rows(self, side: Tensor, rank: Tensor) -> tuple[Tensor, Tensor]:
        most = max(self.count.tolist(), default=0) + 1
        place = torch.full(((max(self.side.tolist(), default=0) // 4 + 1) * 4 * most,), -1)
        place[self.side * most + self.rank] = torch.arange(len(self.i))
        other = place[side * most + rank]
        one = (other >= 0).nonzero()[:, 0]
        return one, other[one]


def seats_at(plan: Plan) -> Seats:
    """Seats at the tables that people sit around."""
    kept: dict[str, Seats] = vars(plan)
    if "seats_at" not in kept:
        kept["seats_at"] = _seats_at(plan)
    return kept["seats_at"]


def _seats_at(plan: Plan) -> Seats:
    i, j = plan.attended("at", "foot", to=plan.dining)
    near = plan.apart(i, j).detach() < AROUND
    i, j = i[near], j[near]
    lateral, forward = plan.local(i, j)
    half = plan.size[j][:, [0, 2]].detach() / 2
    ahead = forward.detach().abs() - half[:, 1] > lateral.detach().abs() - half[:, 0]
    along, across = torch.where(ahead, lateral, forward), torch.where(ahead, forward, lateral)
    side = 4 * j + 2 * ahead + (across > 0)
    order = along.detach().argsort(stable=True)
    order = order[side[order].argsort(stable=True)]
    counts = torch.bincount(side)
    ends, count = counts.cumsum(0)[side], counts[side]
    rank = torch.empty_like(side).index_put((order,), torch.arange(len(side))) - (ends - count)
    return Seats(i, j, ahead, along, across, side, count, rank)


def chairs_even(plan: Plan) -> Found:
    """The chairs of a table stand evenly around it; a bench counts as the chairs that it stands for."""
    seats = seats_at(plan)
    i, j = seats.i, seats.j
    places = (plan.size[i, 0] / PLACE).round().clamp_min(1.0).detach()
    count = torch.zeros(len(plan), dtype=plan.size.dtype).index_add(0, j, places)
    away = torch.stack(plan.local(i, j), -1) * places[:, None]
    sums = torch.zeros(len(plan), 2, dtype=plan.size.dtype).index_add(0, j, away)
    who = (count > 1).nonzero()[:, 0]
    n = count[who]
    shift = (sums[who] / n[:, None]).abs()
    odd = (n % 2)[:, None] * (ODD * plan.size[who][:, [0, 2]] + 0.3) / n[:, None]
    margin, axis = (EVEN + odd - shift).min(1)
    return found(who, margin, measure=shift.gather(1, axis[:, None])[:, 0])


def chairs_opposite(plan: Plan) -> Found:
    """Where both sides of a table have as many chairs, each has another one opposite."""
    seats = seats_at(plan)
    one, other = seats.facing()
    margin = STAGGERED - (seats.along[one] - seats.along[other]).abs()
    least, _ = worst(seats.j[one], margin, seats.i[one], len(plan), FAR)
    who = (least < FAR).nonzero()[:, 0]
    return found(who, least[who], measure=STAGGERED - least[who])


def chairs_level(plan: Plan) -> Found:
    """The chairs of a table are pushed under it alike: neighbours, and those opposite each other."""
    seats = seats_at(plan)
    half_width, half_depth = plan.reach(seats.i, seats.j)
    out = seats.across.abs() - torch.where(seats.ahead, half_depth, half_width)
    one, other = (torch.cat(rows) for rows in zip(seats.facing(), seats.beside(), strict=True))
    chairs = plan.stands("at")[seats.i]
    keep = chairs[one] & chairs[other]
    one, other = one[keep], other[keep]
    least, _ = worst(seats.j[one], LEVEL - (out[one] - out[other]).abs(), seats.i[one], len(plan), FAR)
    who = (least < FAR).nonzero()[:, 0]
    return found(who, least[who], measure=LEVEL - least[who])


def sofas_in_circle(plan: Plan) -> Found:
    """A second sofa looks into the group of the first."""
    i, j = plan.attended("with")
    near = plan.apart(i, j).detach() < NEAR
    i, j = i[near], j[near]
    middle = plan.position[j][:, [0, 2]] + plan.axes(j)[1] * (plan.size[j, 2] / 2 + BEFORE)[:, None]
    off = facing_angle(*plan.seen(i, middle))
    return found(i, CIRCLE - off, other=j, measure=torch.rad2deg(off))


def at_its_side(plan: Plan) -> Found:
    """Side tables and floor lamps stand beside their sofa or bed, not before it; armchairs leave room for its knees."""
    i, j = plan.attended("beside")
    keep = (plan.apart(i, j).detach() < SIDE) & plan.of("sofa", "bed")[j]
    chairs = plan.those(plan.stands("company") & plan.of("sofa")[plan.group] & ~plan.of("sofa"))
    i, j = torch.cat([i[keep], chairs]), torch.cat([j[keep], plan.group[chairs]])
    armchair = plan.stands("company")[i]
    lateral, forward = plan.local(i, j)
    half_width, half_depth = plan.reach(i, j)
    covered = plan.size[j, 0] / 2 + half_width - lateral.abs()
    before = forward - half_depth - plan.size[j, 2] / 2
    share = torch.where(armchair, ELBOW, COVERS).to(plan.size)
    margin = torch.maximum(share * plan.size[j, 0] - covered, -0.05 - before)
    ahead = forward - plan.size[j, 2] / 2  # of its middle, where it stands off the end as well
    margin = torch.where(plan.of("seat")[i], margin, torch.minimum(margin, AHEAD - ahead))
    margin = torch.where(armchair, torch.maximum(margin, before - KNEES), margin)
    return found(i, margin, other=j, measure=before.clamp_min(0.0))


def not_alone(plan: Plan) -> Found:
    """Plants, lamps and small tables stand at a wall or at something, an armchair without a group at a wall.

    An armchair that stands apart from its group has something of its own: a lamp, a table, shelves, another one.
    """
    loner = plan.stands("company") & (plan.anchor < 0)
    small = (plan.of("light", "decor") | plan.stands("beside") | loner) & plan.standing
    company = plan.stands("company") & plan.of("seat") & plan.standing & ~loner
    lit = plan.of("seat", "sofa", "bed", "board")
    i, j = plan.pairs(small, plan.standing, least=True)
    gap, _ = plan.worst(i, torch.where(plan.of("light")[i] & ~lit[j], FAR, plan.apart(i, j)), j)
    who = plan.those(small & plan.walled)
    half = plan.size[who][:, [0, 2]].amax(1) / 2
    wall = plan.inside(plan.position[who][:, None, [0, 2]], who)[:, 0] - half
    free = torch.where(plan.of("decor"), OF_PLANTS, torch.where(plan.stands("beside"), OF_SMALL, 0.0))[who]
    away = torch.minimum(gap[who] + free, wall)
    away = torch.where(loner[who], wall - (EDGE - ALONE), away)
    lonely = found(who, ALONE - away, measure=torch.where(loner[who], wall, torch.minimum(gap[who], wall)))
    others = plan.of("light", "storage", "board") | plan.stands("beside", "company")
    i, j = plan.pairs(company, others & plan.standing, least=True)
    gap, _ = plan.worst(i, plan.apart(i, j), j)
    who = plan.those(company)
    who = who[plan.apart(who, plan.anchor[who]).detach() > LEFT]
    return joined(lonely, found(who, OWN - gap[who], measure=gap[who].clamp(0.0, FAR)))
