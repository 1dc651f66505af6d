"""Terms of tables and of who sits at them: in reach, evenly around, with room for elbows and to get up."""

import math
from dataclasses import dataclass

from echomodel.arrays import Array, at_least, at_most, full, held, kit, least_of, norm, once, put, rows, sum_of
from echomodel.boxes2d import turned
from echomodel.objective.company import AROUND, first_of, ranked
from echomodel.objective.composition import SEAT, free_beside
from echomodel.objective.crowding import clear
from echomodel.objective.plan import FAR, Found, Plan, facing_angle, found
from echomodel.objective.sizes import ELBOW

LOOK = math.radians(60.0)  # chairs at a corner of their table look at it by up to 45 degrees
NEAR_TABLE = 1.5  # metres: a seat further from its table is judged for its distance alone
REACH, BENCH = 0.25, 0.12  # metres between a seat's front and its table: 95 % of real chairs are nearer; a bench's
AT_DESK = 0.26  # share of a desk's width that a seat's middle may lie beside its own: nine of ten real ones
STAGGERED = 0.12  # metres between a chair's middle and that of the one opposite, where both sides have as many
SPACED = 0.16  # metres by which the distances of neighbours at one side of a table differ: 95 % of real sides
LEVEL = 0.12  # metres by which chairs are pushed under their table unlike each other
EASY = 0.6  # metres of edge a seat that are enough for anybody: DIN 68880
# Metres behind chairs of one side, and how much more behind those opposite is to spare; the same at empty sides.
SQUEEZED, ROOMY, AT_END, AROUND_BOTH = 0.17, 0.6, 0.3, 1.2
BEYOND, CORNER = 0.1, 0.1  # metres that a seat may reach beyond its side of a table, and more beyond one end of it
# Who sits alone at a side of a table: share of it that the middle may be beside its own, metres from which on its ends.
ALONE, OFF = 0.3, 0.05
SEVERAL = 0.1  # the same of several, 82 % of real sides, and of two at both ends or alone at their table, all 46
PULL, PULL_WALL = 0.22, 0.2  # metres behind a chair at a table, before furniture and before a wall
DESK, DESK_WALL = 0.33, 0.19  # the same at a desk, where one works
AT = 0.5  # metres: a chair further from its table is not pulled back from it
NEAR_WALL = 0.2  # metres between a wall and the front or back of a desk
DINERS = 3  # chairs that make a dining table of a desk


def desk_at_wall(plan: Plan) -> Found:
    """A desk has its front or back near a wall: with an end there it would part the room."""
    desks = plan.of("board") & plan.works & plan.standing & ~plan.which(lambda kind: kind.wall or kind.task)
    xp = plan.kit
    seats = xp.bincount(plan.anchor[plan.stands("at") & (plan.anchor >= 0)], minlength=len(plan))
    who = plan.those(desks & plan.walled & plan.moved & (seats < DINERS))
    back = plan.axes(who)[1] * plan.size[who, 2:] / 2
    gap = xp.amin(plan.inside(plan.position[who][:, None, ::2] + xp.stack([back, -back], 1), who), 1)
    return found(who, NEAR_WALL - gap, measure=gap)


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


def chair_pulls_out(plan: Plan) -> Found:
    """A chair can be moved back from its table or desk, also to another's; a stool from where one works."""
    works, xp = plan.works[at_least(plan.anchor, 0)], plan.kit
    chairs = plan.stands("at") & (plan.anchor >= 0) & (works | ~plan.solid)
    needed, wall = xp.where(works, DESK, PULL), xp.where(works, DESK_WALL, PULL_WALL)
    massive = (plan.of("board", "bed", "storage", "sofa") | plan.stands("company", "at")) & plan.standing
    seen = clear(plan, chairs, massive, needed, wall, behind=True)
    return seen.take(plan.apart(seen.who, plan.anchor[seen.who]) < AT) if len(seen.who) else seen


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
    rank, count = ranked(side, held(along))
    return Seats(i, j, ahead, along, across, side, count, rank)


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


def elbow_room(plan: Plan) -> Found:
    """Chairs share the sides of their table: who sits beside others has room for the elbows, or no side is free."""
    seats, xp = seats_at(plan), plan.kit
    who, free = _free_sides(plan)
    count = xp.bincount(seats.side, minlength=4 * len(plan)).reshape(-1, 4)[who]
    edge = plan.size[who][:, [2, 2, 0, 0]]
    best = at_most(xp.amax(xp.where(free > SEAT, edge / (count + 1), 0.0), 1), EASY)
    least = xp.amin(xp.where(count > 1, edge / at_least(count, 1), FAR), 1)
    beside = least < FAR
    who, best, least = who[beside], best[beside], least[beside]
    return first_of(who, xp.full_like(who, -1), [least - ELBOW, least - best], [least, least])


def chairs_balanced(plan: Plan) -> Found:
    """As many sit at one side of a table as opposite, but for an odd one, two at a corner or no room."""
    seats, xp = seats_at(plan), plan.kit
    who, free = _free_sides(plan)
    places = at_least((held(plan.size)[:, 0] / ELBOW).round(), 1.0)  # a bench counts for several chairs
    count = sum_of(seats.side, places[seats.i], 4 * len(plan)).reshape(-1, 2, 2)[who]
    one, other, free = count[..., 0], count[..., 1], (free > SEAT).reshape(-1, 2, 2)
    room = xp.where(other < one, free[..., 1], free[..., 0]) | (xp.minimum(one, other) > 0)
    uneven, seated = abs(one - other) * room, count.sum((1, 2))
    more = xp.where(seated > 2, uneven.sum(-1), 2 * at_least(xp.amax(uneven, 1) - 1, 0.0))
    i, j = plan.attended("at", "foot")  # who stands far off, too
    total = sum_of(j, places[i], len(plan))[who]
    return found(who, total % 2 + 0.5 - more, measure=more)


def bench_fits(plan: Plan) -> Found:
    """A seat stands within its side of a table, before its middle if alone, several around that, as do two at its ends
    or alone there; a bench along one that is as long as it."""
    seats, xp = seats_at(plan), plan.kit
    half_width, half_depth = plan.reach(seats.i, seats.j)
    own = 2 * xp.where(seats.ahead, half_width, half_depth)
    side = xp.where(seats.ahead, plan.size[seats.j, 0], plan.size[seats.j, 2])
    aside = abs(seats.along) * ~plan.solid[seats.i]  # a stool stands anywhere
    spare = (side - own) / 2
    most = xp.where(seats.count == 1, xp.minimum(ALONE * side, at_least(spare, 0.0) + OFF), spare + BEYOND + CORNER)
    middle = abs(sum_of(seats.side, seats.along, 4 * len(plan))[seats.side] / seats.count)
    opposite = xp.bincount(seats.side, minlength=4 * len(plan))[seats.side ^ 1]  # of more, each sits opposite one
    wide = plan.size[seats.j, 0] >= plan.size[seats.j, 2]
    two = (opposite == 1) & ((seats.ahead != wide) | (xp.bincount(seats.j, minlength=len(plan))[seats.j] == 2))
    several = ((seats.count > 1) | two) & (seats.rank == 0) & (opposite <= seats.count) & ~plan.solid[seats.i]
    together = xp.where(several, SEVERAL * side - middle, FAR)
    measures = [own - side, plan.size[seats.i, 0] - own, aside, middle]
    margins = [BEYOND - measures[0], BEYOND - measures[1], most - aside, together]
    return first_of(seats.i, seats.j, margins, measures)


def table_amid(plan: Plan) -> Found:
    """A table is not shoved aside: chairs, and ends where nobody sits, have room where it is to spare opposite."""
    seats, xp = seats_at(plan), plan.kit
    half_width, half_depth = plan.reach(seats.i, seats.j)
    edge = xp.where(seats.ahead, plan.size[seats.j, 2], plan.size[seats.j, 0]) / 2
    out = abs(seats.across) + xp.where(seats.ahead, half_depth, half_width) - edge
    who, free = _free_sides(plan)
    most = -least_of(seats.side, -out, 4 * len(plan), FAR).reshape(-1, 4)[who]
    behind, sits = (free - at_least(most, 0.0)).reshape(-1, 2, 2), (most > -FAR).reshape(-1, 2, 2)
    least, seated, alike = xp.amin(behind, 2), sits.all(2), sits[..., 0] == sits[..., 1]
    near, spare = xp.where(seated, SQUEEZED, AT_END), xp.where(seated, ROOMY, AROUND_BOTH)
    margin = xp.where(alike, xp.maximum(least - near, spare - xp.amax(behind, 2) + least), FAR)
    at = xp.arange(len(who)), held(margin).argmin(1)
    seen = found(who, margin[at], measure=at_least(least[at], 0.0), words=1 * ~seated[at])
    return seen.take(rows(alike.any(1) & plan.walled[who]))


@once
def _free_sides(plan: Plan) -> tuple[Array, Array]:
    """(P,) int64, the tables with seats, and (P, 4), metres free left, right, behind and before them."""
    who = rows(plan.kit.bincount(seats_at(plan).j, minlength=len(plan)) > 0)
    return who, free_beside(plan, who, plan.of("seat", "light"))
