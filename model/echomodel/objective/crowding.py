"""Rules of free space: groups keep apart, chairs can be pulled out, knees have room, beds are walked round."""

from __future__ import annotations

from echomodel.arrays import Array, at_least, cast, rows
from echomodel.objective.access import FOR_TWO, wall_ahead
from echomodel.objective.plan import FAR, Found, Plan, found, joined

# Metres between pieces of different groups, by role: the 2nd to 3rd percentile in real rooms.
APART = {
    ("sofa", "board"): 0.2, ("sofa", "seat"): 0.12, ("board", "board"): 0.1, ("board", "seat"): 0.05,
    ("seat", "seat"): 0.06, ("seat", "storage"): 0.12, ("bed", "seat"): 0.05, ("bed", "sofa"): 0.35,
    ("bed", "bed"): 0.15, ("bed", "board"): 0.25, ("bed", "storage"): 0.2,
}  # fmt: skip
ROLES = sorted({role for pair in APART for role in pair})
AT_BED = 0.12  # metres between a bed and who works at a desk: all ten real ones
LOW = 0.2  # metres between a coffee table and tables and chairs at which people eat or work: 94 % of real ones
PULL, PULL_WALL = 0.22, 0.2  # metres behind a chair at a table, before furniture and before a wall
DESK, DESK_WALL = 0.33, 0.19  # the same at a desk, where one works
AT = 0.5  # metres: a chair further from its table is not pulled back from it
KNEES, KNEES_WALL = 0.4, 0.6  # metres before a sofa or armchair, before furniture of other groups and before a wall
ROOM = 0.25  # metres before a seat to its own group's lamps and other seats
END = 0.8  # metres before an armchair that looks at a sofa's end, to that
TOUCHED = 0.1  # metres between a coffee table and other seats than its sofa: 95 % of real ottomans keep 0.12
HAND = 0.05  # metres between two seats of a group: 90 % of real ones, most others overlap
OF_ITS_OWN = 0.25  # metres between a side table and a coffee table, a seat and a screen's stand
# Metres between the foot of a bed and furniture: one passes sideways; share of the foot from which on something is so.
FOOT, AT_FOOT = 0.35, 0.1
# Metres before a front that lamps and plants keep free, before a nightstand's, before who sits (33 of 34 real ones).
LAMP, AT_STAND, AT_SEAT = 0.6, 0.35, 0.35
MET = 0.25  # share of a width from which on something is before it
EDGE = 0.06  # the same for lamps and plants, which are narrow


def groups_apart(plan: Plan) -> Found:
    """Pieces of different groups leave a gap: a table does not touch a sofa, nor a chair the next bed."""
    massive = plan.of(*ROLES) & plan.standing
    i, j = plan.pairs(massive, massive, least=True)
    keep = (plan.smaller[i] < plan.smaller[j]) & ~plan.kin(i, j)
    i, j = i[keep], j[keep]
    table = plan.numbers([[APART.get((a, b), APART.get((b, a), 0.0)) for b in ROLES] for a in ROLES])
    number = cast(plan.column(lambda kind: ROLES.index(kind.role) if kind.role in ROLES else 0), plan.scene)
    low, high = plan.stands("before"), plan.stands("at") | plan.dining
    wanted = plan.kit.where((low[i] & high[j]) | (low[j] & high[i]), LOW, table[number[i], number[j]])
    bed, aside = plan.of("bed"), (plan.of("board") & ~plan.dining) | plan.stands("head")  # which stand beside beds
    bedside = (aside[i] & bed[j]) | (aside[j] & bed[i])
    sits = plan.stands("at") & plan.works[at_least(plan.anchor, 0)] & (plan.anchor >= 0)
    wanted = plan.kit.where((sits[i] & bed[j]) | (sits[j] & bed[i]), AT_BED, wanted)
    keep = (wanted > 0) & ~_side_by_side(plan, i, j) & ~bedside
    i, j, wanted = i[keep], j[keep], wanted[keep]
    least, about = plan.worst(i, plan.apart(i, j) - wanted, j)
    who = rows(least < FAR)
    j = about[who]
    return found(who, least[who], other=j, measure=at_least(plan.apart(who, j), 0.0))


def _side_by_side(plan: Plan, i: Array, j: Array) -> Array:
    """(P,) bool: desks and the like in one row, looking the same way."""
    boards = plan.of("board")[i] & plan.of("board")[j]
    aside = abs(plan.local(i, j)[0]) - plan.reach(i, j)[0] - plan.size[j, 0] / 2
    return boards & (aside > -0.05) & (plan.kit.cos(plan.yaw[i] - plan.yaw[j]) > 0.97)


def chair_pulls_out(plan: Plan) -> Found:
    """A chair can be moved back from its table or desk, also to another's; a stool from where one works."""
    works, xp = plan.works[at_least(plan.anchor, 0)], plan.kit
    chairs = plan.stands("at") & (plan.anchor >= 0) & (works | ~plan.solid)
    needed, wall = xp.where(works, DESK, PULL), xp.where(works, DESK_WALL, PULL_WALL)
    massive = (plan.of("board", "bed", "storage", "sofa") | plan.stands("company", "at")) & plan.standing
    seen = _clear(plan, chairs, massive, needed, wall, behind=True)
    return seen.take(plan.apart(seen.who, plan.anchor[seen.who]) < AT) if len(seen.who) else seen


def knees_free(plan: Plan) -> Found:
    """Who sits on a sofa or in an armchair has room for the knees, and does not look at a wall."""
    return _clear(plan, _loungers(plan), plan.standing & ~plan.movable, KNEES, KNEES_WALL)


def _loungers(plan: Plan) -> Array:
    """(N,) bool, sofas and armchairs."""
    return (plan.of("sofa") | plan.stands("company")) & plan.standing


def bed_foot_free(plan: Plan) -> Found:
    """One passes between the foot of a bed and what stands opposite; where two sleep, also a wall."""
    others = plan.standing & plan.of("storage", "board", "sofa", "seat", "bed")
    wall = plan.kit.where(plan.size[:, 0] > FOR_TWO, FOOT, -FAR)
    return _clear(plan, plan.of("bed") & plan.standing, others, FOOT, wall, share=AT_FOOT)


def lamp_aside(plan: Plan) -> Found:
    """Lamps and plants do not stand before shelves, cupboards and drawers, nor before who sits."""
    fronts = (plan.of("storage") & plan.standing & plan.works) | _loungers(plan)
    i, j = plan.pairs(plan.of("light", "decor") & plan.standing, fronts, least=True)
    free = plan.kit.where(_loungers(plan), AT_SEAT, plan.kit.where(plan.stands("head"), AT_STAND, LAMP))
    return plan.nearest(i, j, plan.more_ahead(j, i, cast(free, plan.size)[j], EDGE), cast(free, plan.size))


def seat_room(plan: Plan) -> Found:
    """One can sit down in a group, too: nothing but its table stands close before a sofa or armchair, nor a sofa's end
    before an armchair."""
    block = (plan.of("sofa", "light", "decor", "storage", "bed") | plan.stands("company", "beside")) & plan.standing
    close = _clear(plan, _loungers(plan), block, ROOM, -FAR, kin=True)
    tables = plan.stands("before") & plan.standing  # which a second sofa, an armchair or an ottoman does not touch
    chairs, ottomans = (plan.stands(word) & plan.of("seat") & plan.standing for word in ("company", "foot"))
    i, j = plan.pairs((plan.stands("with") & plan.standing) | chairs | ottomans, tables, least=True)
    one, sofa = plan.pairs(chairs, plan.of("sofa") & plan.standing, least=True)
    lateral, forward = plan.local(one, sofa)
    aside = (abs(lateral) > plan.size[sofa, 0] / 2) & (forward < plan.size[sofa, 2] / 2)
    ends = plan.kit.where(aside, plan.more_ahead(one, sofa, END, MET), FAR)
    margin = plan.kit.concat([plan.apart(i, j) - TOUCHED, ends])
    least, about = plan.worst(plan.kit.concat([i, one]), margin, plan.kit.concat([j, sofa]))
    met = least < 0
    met[close.who[close.margin < 0]] = False
    who = rows(met)
    end = plan.of("sofa")[about[who]]
    measure = at_least(least[who] + plan.kit.where(end, END, TOUCHED), 0.0)
    return joined(close, found(who, least[who], other=about[who], measure=measure, words=1 * end))


def seats_apart(plan: Plan) -> Found:
    """Sofas, armchairs, chairs and benches of one group do not touch, nor sofas and armchairs a screen's stand, nor a
    side table a coffee table."""
    loungers, xp = _loungers(plan), plan.kit
    seats = loungers | (plan.of("seat") & plan.stands("at", "foot") & plan.standing)
    i, j = plan.pairs(seats, seats, least=True)
    keep = (plan.smaller[i] < plan.smaller[j]) & plan.kin(i, j)
    of_its_own = [
        plan.pairs(one & plan.standing, plan.stands(word) & plan.standing, least=True)
        for one, word in ((loungers, "opposite"), (plan.stands("beside") & plan.of("board"), "before"))
    ]
    i, j = (xp.concat([kept[keep], *more]) for kept, *more in zip((i, j), *of_its_own, strict=True))
    needed = cast(xp.where(plan.stands("opposite", "before"), OF_ITS_OWN, HAND), plan.size)
    return plan.nearest(i, j, plan.apart(i, j) - needed[j], needed)


def _clear(
    plan: Plan, fronts: Array, block: Array, needed: float | Array, needed_wall: float | Array, *,
    behind: bool = False, kin: bool = False, share: float = MET,
) -> Found:  # fmt: skip
    """How much more than is needed is free before (or behind) some boxes, to other groups' pieces (or their own)."""
    who = plan.those(fronts)
    sign, xp = -1.0 if behind else 1.0, plan.kit
    needed, needed_wall = (xp.zeros_like(plan.yaw) + value for value in (needed, needed_wall))
    i, j = plan.pairs(fronts, block, least=True)
    other = plan.kin(i, j) == kin
    i, j = i[other], j[other]
    margin = plan.more_ahead(i, j, needed[i], share, start=0.25, sign=sign)
    least, about = plan.worst(i, margin, j)
    least, about, needed, needed_wall = least[who], about[who], needed[who], needed_wall[who]
    if bool((needed_wall > 0).any()):
        wall = wall_ahead(plan, who, sign) - needed_wall
        by_wall = wall < least
        least, about = xp.minimum(least, wall), xp.where(by_wall, -1, about)
        needed = xp.where(by_wall, needed_wall, needed)
    return found(who, least, other=about, measure=at_least(least + needed, 0.0))
