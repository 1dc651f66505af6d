"""Rules of groups: seats at their tables, the table before its sofa, nightstands at the head, chairs evenly around."""

from __future__ import annotations

import math
from dataclasses import dataclass

from echomodel.arrays import Array, at_least, full, held, kit, least_of, norm, once, pairs_in, put, rows
from echomodel.boxes2d import turned
from echomodel.floors import footprint
from echomodel.objective.plan import FAR, Found, Plan, facing_angle, found, joined, nobody
from echomodel.vocabulary import vocabulary

LOOK = math.radians(60.0)  # chairs at a corner of their table look at it by up to 45 degrees
LOUNGE = math.radians(100.0)  # an armchair takes part in its group, it does not stare at the table
NEAR_TABLE = 1.5  # metres: a seat further from its table is judged for its distance alone
COMPANY = 2.5  # metres: an armchair further away stands for itself
TOGETHER = 1.5  # metres between armchairs without a sofa: all real ones are nearer
REACH, BENCH = 0.25, 0.12  # metres between a seat's front and its table: 95 % of real chairs are nearer; a bench's
BEFORE_SOFA = (0.12, 0.85)  # metres between a sofa and its coffee table: 90 % of real straight ones lie within
LONG = 1.5  # times as long as deep: 90 % of such coffee tables lie along their only sofa, benches along their bed
AT_DESK = 0.33  # share of a desk's width that a seat's middle may lie beside its own: 19 of 20 real ones
WITHIN = (0.2, 0.25)  # share of a sofa's width, and of a cornered one's, that the table's middle may lie beside its own
BESIDE = 0.4  # metres between a bed and its nightstand: 95 % of real ones are nearer
PAIR = 0.15  # metres by which the gaps of the two nightstands of a bed may differ: 98 % of real ones differ less
IN_BED = 0.4  # metres by which a nightstand may reach into the box of a bed whose board is wider than it is
FOOT = 0.35  # metres between a bed's foot and the bench there: 95 % of real ones
# Share of the bed's width by which its middle may lie beside the bed's: of one alone 4 of 5 real ones, else 95 %.
MIDDLE, ALONG = 0.12, 0.38
HEAD = 0.45  # metres between the level of the headboard and the nightstand's back
TURNED = math.radians(45.0)  # 94 % of real nightstands look the same way as their bed


def seat_faces(plan: Plan) -> Found:
    """A seat that stands at a table or desk looks at it."""
    i, j = plan.attended("at")
    off, xp = plan.kit.stack(plan.local(i, j), -1), plan.kit
    out = abs(off) - plan.size[j, ::2] / 2
    most = xp.amax(held(out), 1)[:, None]  # who is pushed under it came from the side where this is
    away = xp.where(most > 1e-3, -xp.sign(held(off)) * at_least(out, 0.0), -off * (held(out) >= most))
    looks = (norm(at_least(held(out), 0.0)) < NEAR_TABLE) & ~plan.solid[i]  # stools have no front
    i, j, away = i[looks], j[looks], away[looks]
    off = facing_angle(*turned(away, plan.yaw[j] - plan.yaw[i]).T)
    return found(i, LOOK - off, other=j, measure=xp.rad2deg(off))


def seat_in_reach(plan: Plan) -> Found:
    """A seat whose work is at a table or desk stands at it, a stool at its dressing table, a bench at its table."""
    i, j = plan.attended("at", "foot", to=plan.of("board"))
    works = plan.which(lambda kind: kind.access > 0 or kind.wall)  # at a dinner table stools go anywhere
    bound = ~plan.solid[i] | works[j]
    i, j = i[bound], j[bound]
    off = plan.gap(i, j) - plan.size[i, 2] / 2
    return found(i, plan.kit.where(plan.stands("foot")[i], BENCH, REACH) - off, other=j, measure=off)


def seat_before_desk(plan: Plan) -> Found:
    """Who works at a desk or dressing table sits before it, not at its corner."""
    i, j = plan.attended("at", to=plan.which(lambda kind: kind.role == "board" and (kind.access > 0 or kind.wall)))
    near = held(plan.gap(i, j)) < NEAR_TABLE
    i, j = i[near], j[near]
    aside, alone = abs(plan.local(i, j)[0]), plan.kit.bincount(j, minlength=len(plan)) == 1
    share = plan.kit.where(alone[j], AT_DESK, 0.5)  # several sit beside each other, those at a bar from end to end
    return found(i, share * plan.size[j, 0] - aside, other=j, measure=aside)


def lounger_faces(plan: Plan) -> Found:
    """An armchair of a group is turned towards it, and towards the sofa before which it stands."""
    i, j = plan.attended("company")
    near, sofa, xp = held(plan.gap(i, j)) < COMPANY, plan.group[i], plan.kit
    lateral, forward = plan.local(i, sofa)
    before = plan.of("sofa")[sofa] & (forward > plan.size[sofa, 2] / 2) & (abs(lateral) < plan.size[sofa, 0] / 2)
    i, j = xp.concat([i[near], i[near & before]]), xp.concat([j[near], sofa[near & before]])
    off = facing_angle(*plan.local(j, i))
    return found(i, LOUNGE - off, other=j, measure=xp.rad2deg(off))


def loungers_together(plan: Plan) -> Found:
    """Armchairs without a sofa stand together, none with its back to the next one."""
    lone = plan.stands("company") & (plan.anchor < 0) & plan.standing
    i, j = plan.pairs(lone, lone)
    apart = plan.apart(i, j)
    first = _ranked(i, held(apart))[0] == 0
    i, j, apart = i[first], j[first], apart[first]
    off = facing_angle(*plan.local(j, i))
    return first_of(i, j, [LOUNGE - off, TOGETHER - apart], [plan.kit.rad2deg(off), apart])


def table_before_sofa(plan: Plan) -> Found:
    """A coffee table lies before its sofa, within its width and a hand's reach, a long one along it where it is alone;
    of several one does."""
    i, j = plan.attended("before")
    lateral, _, gap = _at_edges(plan, i, j)
    ell, xp, off = plan.which(lambda kind: kind.name in vocabulary().cornered)[j], plan.kit, abs(lateral)
    least = xp.where(ell, BEFORE_SOFA[0] - plan.size[j, 2] * 0.6, BEFORE_SOFA[0])
    within = xp.where(ell, WITHIN[1], WITHIN[0]) * plan.size[j, 0]
    alone = xp.bincount(plan.joins[plan.joins >= 0], minlength=len(plan))[j] == 0
    lies = xp.where(alone, _along(plan, i, j), FAR)
    out = first_of(i, j, [gap - least, BEFORE_SOFA[1] - gap, within - off, lies], [gap, gap, off, gap])
    return out.take(held(-out.margin) <= least_of(j, held(-out.margin), len(plan), math.inf)[j])


def _along(plan: Plan, i: Array, j: Array) -> Array:
    """(P,): by how many metres long pieces lie along others, not across; `FAR` of those that are as wide as deep."""
    size, (wide, deep), xp = held(plan.size)[i], plan.reach(i, j), plan.kit
    long = xp.maximum(size[:, 0], size[:, 2]) > LONG * xp.minimum(size[:, 0], size[:, 2])
    return xp.where(long, wide - deep, FAR)


def nightstand_at_head(plan: Plan) -> Found:
    """Nightstands stand beside the bed at its head; of more than two the nearest two."""
    i, j = plan.attended("head")
    near = _ranked(j, held(plan.gap(i, j)))[0] < 2
    i, j = i[near], j[near]
    _, beside, before = _at_edges(plan, i, j)
    turn, back, xp = plan.yaw[i] - plan.yaw[j], abs(before + plan.size[j, 2]), plan.kit
    off = facing_angle(xp.sin(turn), xp.cos(turn))
    margins = [BESIDE - beside, beside + IN_BED, HEAD - back, TURNED - off]
    return first_of(i, j, margins, [beside, beside, back, xp.rad2deg(off)])


def nightstands_alike(plan: Plan) -> Found:
    """The nightstands at both sides of a bed are as far from it as each other."""
    i, j = plan.attended("head")
    lateral, beside, before = _at_edges(plan, i, j)
    at_head = (abs(before + plan.size[j, 2]) < HEAD) & (beside < BESIDE) & (beside > -IN_BED)
    right, left, xp = at_head & (lateral > 0), at_head & ~(lateral > 0), plan.kit
    one, other = pairs_in((j[:, None] == j[None]) & right[:, None] & left[None])
    apart, swap = abs(beside[one] - beside[other]), beside[one] < beside[other]
    one, other = xp.where(swap, i[other], i[one]), xp.where(swap, i[one], i[other])
    return found(one, PAIR - apart, other=other, measure=apart)


def _at_edges(plan: Plan, i: Array, j: Array) -> tuple[Array, Array, Array]:
    """(P,) each, metres: how far i lies to the side of j, how far beside its edge, and before its front."""
    lateral, forward = plan.local(i, j)
    half_width, half_depth = plan.reach(i, j)
    return lateral, abs(lateral) - half_width - plan.size[j, 0] / 2, forward - half_depth - plan.size[j, 2] / 2


def bench_at_foot(plan: Plan) -> Found:
    """A bench or ottoman at the foot of a bed stands close to it, within its width, one alone before its middle; a long
    one lies along it."""
    i, j = plan.attended("foot", to=plan.of("bed"))
    (lateral, _, gap), xp = _at_edges(plan, i, j), plan.kit
    most = xp.where(xp.bincount(j, minlength=len(plan))[j] == 1, MIDDLE, ALONG) * plan.size[j, 0]
    return first_of(i, j, [FOOT - gap, most - abs(lateral), _along(plan, i, j)], [gap, abs(lateral), gap])


def _ranked(anchor: Array, distance: Array) -> tuple[Array, Array]:
    """(P,) and (P,) int64: how many of the same anchor are nearer, and how many it has."""
    xp, counts = kit(anchor), kit(anchor).bincount(anchor)
    order = xp.argsort(distance, stable=True)
    order = order[xp.argsort(anchor[order], stable=True)]
    return put(anchor, order, xp.arange(len(anchor))) - (counts.cumsum(0) - counts)[anchor], counts[anchor]


def first_of(i: Array, j: Array, margins: list[Array], measures: list[Array]) -> Found:
    """Of several demands, (P,) each, the one that is missed by most."""
    xp, margin = kit(i), kit(i).stack(margins)
    at = margin.argmin(0), xp.arange(len(i))
    return found(i, margin[at], other=j, measure=xp.stack(measures)[at], words=at[0])


PLACE = 0.62  # metres at a table that one who sits there takes: two on a bench
STAGGERED = 0.12  # metres between a chair's middle and that of the one opposite, where both sides have as many
SPACED = 0.16  # metres by which the distances of neighbours at one side of a table differ: 95 % of real sides
LEVEL = 0.12  # metres by which chairs are pushed under their table unlike each other
AROUND = 0.7  # metres: chairs further from their table are not at it
CIRCLE = math.radians(85.0)  # a sofa is turned so far at most from the middle of its group: 9 of 11 real second ones
BEFORE = 0.8  # metres before the larger sofa, where the middle of the group is
NEAR = 3.0  # metres: a sofa further away stands for itself
COVERS = 0.12  # share of a sofa's width that side tables and lamps may stand before
AHEAD, OF_TABLES = 0.1, -0.15  # metres that the middles of lamps and tables may lie before its front: 97 % of real ones
SIDE = 0.6  # metres: what is further from its seat stands for itself
ELBOW, KNEES = 0.15, 0.3  # share of a sofa's width that an armchair may stand before, and metres from which on all
FORTH = 0.6  # metres of an armchair, or more, before the line of its sofa's back: all 88 real ones
LEFT, OWN = 0.7, 0.6  # metres from its group from which on an armchair stands apart, and to what is its own: 97 %
ALONE = 0.45  # metres from everything: nothing small stands so in a room
# Metres less from furniture, more for ottomans: 98 % of real side tables are within 0.3 of something, 90 % of these in
# 0.6. Of 47 real floor lamps 46 are within 0.4 of a wall, the other one is at a sofa.
OF_SMALL = 0.15
LIT = 1.1  # metres between a floor lamp and the next seat, bed or table: 95 % of real ones
EDGE, LAID = 0.5, 0.3  # metres between a wall and an only armchair that belongs to no group, and such a daybed


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

    i: Array
    j: Array
    ahead: Array
    along: Array
    across: Array
    side: Array
    count: Array
    rank: Array

    def facing(self) -> tuple[Array, Array]:
        """Rows (Q,) of seats that have another one opposite, of as many, and rows (Q,) of those."""
        one, other = self._rows(self.side ^ 1, self.rank)
        keep = self.count[one] == self.count[other]
        return one[keep], other[keep]

    def beside(self) -> tuple[Array, Array]:
        """Rows (Q,) of seats that have another one to their right, and rows (Q,) of those."""
        return self._rows(self.side, self.rank + 1)

    def _rows(self, side: Array, rank: Array) -> tuple[Array, Array]:
        most = max(self.count.tolist(), default=0) + 1
        place = full(self.side, (max(self.side.tolist(), default=0) // 4 + 1) * 4 * most, -1)
        place[self.side * most + self.rank] = kit(self.side).arange(len(self.i))
        other = place[side * most + rank]
        one = rows(other >= 0)
        return one, other[one]


@once
def seats_at(plan: Plan) -> Seats:
    """Seats at the tables that people sit around."""
    return _seats_at(plan, plan.dining)


@once
def seats_anywhere(plan: Plan) -> Seats:
    """Seats at every table, desk and bar."""
    return _seats_at(plan, plan.of("board"))


def _seats_at(plan: Plan, boards: Array) -> Seats:
    i, j = plan.attended("at", "foot", to=boards)
    near, xp = held(plan.apart(i, j)) < AROUND if len(i) else i > 0, plan.kit
    i, j = i[near], j[near]
    lateral, forward = plan.local(i, j)
    half = held(plan.size)[j] / 2
    ahead = abs(held(forward)) - half[:, 2] > abs(held(lateral)) - half[:, 0]
    along, across = xp.where(ahead, lateral, forward), xp.where(ahead, forward, lateral)
    side = 4 * j + 2 * ahead + (across > 0)
    rank, count = _ranked(side, held(along))
    return Seats(i, j, ahead, along, across, side, count, rank)


def places_of(size: Array) -> Array:
    """(...,) how many sit on seats of sizes (..., 3)."""
    return at_least((size[..., 0] / PLACE).round(), 1.0)


def chairs_opposite(plan: Plan) -> Found:
    """Where both sides of a table have as many chairs, each has another one opposite."""
    seats = seats_at(plan)
    return _alike(plan, seats, *seats.facing(), seats.along, STAGGERED)


def chairs_level(plan: Plan) -> Found:
    """The chairs of a table or bar are pushed under it alike: neighbours, and those opposite each other."""
    seats, xp = seats_anywhere(plan), plan.kit
    half_width, half_depth = plan.reach(seats.i, seats.j)
    out = abs(seats.across) - xp.where(seats.ahead, half_depth, half_width)
    one, other = (xp.concat(of) for of in zip(seats.facing(), seats.beside(), strict=True))
    chairs = plan.stands("at")[seats.i]
    keep = chairs[one] & chairs[other]
    return _alike(plan, seats, one[keep], other[keep], out, LEVEL)


def chairs_spaced(plan: Plan) -> Found:
    """Three chairs and more at one side of a table or bar stand there at equal distances."""
    seats = seats_anywhere(plan)
    one, other = seats.beside()
    apart = put(full(seats.along, len(seats.i), 0.0), one, seats.along[other] - seats.along[one])
    both = apart[other] > 0
    return _alike(plan, seats, one[both], other[both], apart, SPACED)


def _alike(plan: Plan, seats: Seats, one: Array, other: Array, off: Array, most: float) -> Found:
    """Tables at which some seats differ from others by less than `most` metres."""
    least = least_of(seats.j[one], most - abs(off[one] - off[other]), len(plan), FAR)
    who = rows(least < FAR)
    return found(who, least[who], measure=most - least[who])


def sofas_in_circle(plan: Plan) -> Found:
    """A second sofa looks into the group of the first, and at it where it stands before it."""
    i, j = plan.attended("with")
    near = held(plan.apart(i, j)) < NEAR
    i, j = i[near], j[near]
    middle, xp = plan.position[j][:, ::2] + plan.axes(j)[1] * (plan.size[j, 2] / 2 + BEFORE)[:, None], plan.kit
    off = facing_angle(*plan.seen(i, middle))
    lateral, forward = plan.local(i, j)
    before = (forward > plan.size[j, 2] / 2) & (abs(lateral) < plan.size[j, 0] / 2)
    off = xp.where(before, xp.maximum(off, facing_angle(*plan.local(j, i))), off)
    return found(i, CIRCLE - off, other=j, measure=xp.rad2deg(off))


def at_its_side(plan: Plan) -> Found:
    """Side tables and floor lamps stand beside their sofa, armchair or bed, not before it, armchairs neither before its
    knees nor behind it."""
    i, j = plan.attended("beside", to=plan.of("sofa", "bed") | plan.stands("company"))
    keep, xp = held(plan.apart(i, j)) < SIDE if len(i) else i > 0, plan.kit
    chairs = plan.those(plan.stands("company") & plan.of("sofa")[plan.group] & ~plan.of("sofa"))
    i, j = xp.concat([i[keep], chairs]), xp.concat([j[keep], plan.group[chairs]])
    armchair, width = plan.stands("company")[i], plan.size[j, 0]
    lateral, forward = plan.local(i, j)
    half_width, half_depth = plan.reach(i, j)
    covered = width / 2 + half_width - abs(lateral)
    ahead = forward - plan.size[j, 2] / 2  # of its middle, where it stands off the end as well
    before = ahead - half_depth
    margin = xp.maximum(xp.where(armchair, ELBOW * width, COVERS * width) - covered, -0.05 - before)
    most = xp.where(plan.of("board")[i], OF_TABLES, AHEAD)
    margin = xp.where(plan.of("seat")[i], margin, xp.minimum(margin, most - ahead))
    margin = xp.where(armchair, xp.maximum(margin, before - KNEES), margin)
    behind = xp.where(armchair, ahead + half_depth + plan.size[j, 2] - FORTH, FAR)
    return found(i, xp.minimum(margin, behind), other=j, measure=at_least(before, 0.0), words=1 * (behind < margin))


def stated_of(plan: Plan, i: Array, j: Array, *words: str) -> Array:
    """(P,) bool: the graph says one of these words of i and j, or of j and i."""
    count = len(plan.first)
    related = full(plan.fixed, (count, count), False)
    for one, other in map(plan.first.ends_of, words):
        related[one, other] = related[other, one] = True
    return related[i % count, j % count]


def not_alone(plan: Plan) -> Found:
    """Small tables and ottomans stand at a wall or at something, lamps at a wall, a sofa or the table that the graph
    says they are close by, an only armchair or daybed at a wall, the latter with a long side.

    Behind a seat a table is at nothing. A lamp lights a seat, bed or table. An armchair that stands apart from its
    group has something of its own: a lamp, a table, shelves, another one.
    """
    daybed = plan.which(lambda kind: kind.role == "sofa" and not kind.wall)
    loner = (plan.stands("company") | daybed) & (plan.anchor < 0)
    loner = loner & (plan.kit.bincount(plan.scene[loner], minlength=len(plan))[plan.scene] == 1)
    watches = plan.kit.bincount(plan.anchor[plan.anchor >= 0], minlength=len(plan)) > 0
    sticks = daybed & ~watches & (plan.size[:, 2] > LONG * plan.size[:, 0])  # into the room from its back
    pouf = plan.stands("foot") & plan.of("seat")
    small = (plan.of("light") | plan.stands("beside") | loner | pouf) & plan.standing
    company = plan.stands("company") & plan.of("seat") & plan.standing & (plan.anchor >= 0)
    lonely, xp = nobody(plan.size), plan.kit
    if bool(small.any()):
        i, j = plan.pairs(small, plan.standing, least=True)
        lamp, apart = plan.of("light")[i], plan.apart(i, j)
        beside = plan.of("sofa")[j] | (plan.of("board")[j] & stated_of(plan, i, j, "close_by"))
        behind = plan.local(i, j)[1] + plan.reach(i, j)[1] + plan.size[j, 2] / 2 < 0
        strange = xp.where(lamp, ~beside, plan.of("sofa", "seat")[j] & behind)
        gap, _ = plan.worst(i, xp.where(strange, FAR, apart), j)
        used = plan.of("sofa", "seat", "bed", "board")[j]
        lit, _ = plan.worst(i, xp.where(lamp & used, apart, FAR), j)
        who = plan.those(small & plan.walled)
        gap, loner, lit = gap[who], loner[who], lit[who]
        corners = plan.inside(footprint(plan.size[who], plan.position[who], plan.yaw[who]), who)
        sides = xp.minimum(xp.amax(corners[:, [0, 6]], 1), xp.amax(corners[:, [2, 4]], 1))
        wall = xp.where(sticks[who], sides, xp.amin(corners, 1))
        free = gap + OF_SMALL * (1 * (plan.stands("beside") & ~plan.of("light")) - 1 * pouf)[who]
        edge = xp.where(daybed[who], LAID, EDGE)
        away = xp.where(loner, wall - (edge - ALONE), xp.minimum(free, wall))
        near, lit = xp.where(loner, wall, xp.minimum(gap, wall)), xp.where(lit < FAR, lit, 0.0)
        lonely = first_of(who, xp.full_like(who, -1), [ALONE - away, LIT - lit], [near, lit])
    others = plan.of("light", "storage") | plan.stands("beside", "before", "company")
    i, j = plan.pairs(company, others & plan.standing, least=True)
    gap, _ = plan.worst(i, plan.apart(i, j), j)
    who = plan.those(company)
    who = who[held(plan.apart(who, plan.anchor[who])) > LEFT]
    return joined(lonely, found(who, OWN - gap[who], measure=at_least(gap[who], 0.0)))
