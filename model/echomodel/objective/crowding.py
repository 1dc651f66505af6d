"""Rules of free space: groups keep apart, chairs can be pulled out, knees have room, beds are walked round."""

from echomodel.arrays import Array, at_least, cast, rows
from echomodel.objective.access import FOR_TWO, wall_ahead
from echomodel.objective.plan import FAR, Found, Plan, found

# Metres between pieces of different groups, by role: the 2nd to 3rd percentile in real rooms.
APART = {
    ("sofa", "board"): 0.2, ("sofa", "seat"): 0.12, ("board", "board"): 0.1, ("board", "seat"): 0.05,
    ("seat", "seat"): 0.06, ("seat", "storage"): 0.12, ("bed", "seat"): 0.05, ("bed", "sofa"): 0.35,
    ("bed", "bed"): 0.15, ("bed", "board"): 0.25, ("bed", "storage"): 0.2, ("sofa", "storage"): 0.2,
    ("board", "storage"): 0.1,
}  # fmt: skip
ROLES = sorted({role for pair in APART for role in pair})
AT_BED = 0.12  # metres between a bed and who works at a desk: all ten real ones
LOW = 0.2  # metres between a coffee table and tables and chairs at which people eat or work: 94 % of real ones
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
    """(P,) bool: desks and the like, and storage beside them or sofas, in one row, looking the same way."""
    board, storage, sofa = (plan.of(role) for role in ("board", "storage", "sofa"))
    row = (board[i] | storage[i]) & (board[j] | storage[j]) | (storage[i] & sofa[j]) | (sofa[i] & storage[j])
    aside = abs(plan.local(i, j)[0]) - plan.reach(i, j)[0] - plan.size[j, 0] / 2
    return row & (aside > -0.05) & (plan.kit.cos(plan.yaw[i] - plan.yaw[j]) > 0.97)


def loungers(plan: Plan) -> Array:
    """(N,) bool, sofas and armchairs."""
    return (plan.of("sofa") | plan.stands("company")) & plan.standing


def bed_foot_free(plan: Plan) -> Found:
    """One passes between the foot of a bed and what stands opposite; where two sleep, also a wall."""
    others = plan.standing & plan.of("storage", "board", "sofa", "seat", "bed")
    wall = plan.kit.where(plan.size[:, 0] > FOR_TWO, FOOT, -FAR)
    return clear(plan, plan.of("bed") & plan.standing, others, FOOT, wall, share=AT_FOOT)


def lamp_aside(plan: Plan) -> Found:
    """Lamps and plants do not stand before shelves, cupboards and drawers, nor before who sits."""
    fronts = (plan.of("storage") & plan.standing & plan.works) | loungers(plan)
    i, j = plan.pairs(plan.of("light", "decor") & plan.standing, fronts, least=True)
    free = plan.kit.where(loungers(plan), AT_SEAT, plan.kit.where(plan.stands("head"), AT_STAND, LAMP))
    return plan.nearest(i, j, plan.more_ahead(j, i, cast(free, plan.size)[j], EDGE), cast(free, plan.size))


def seats_apart(plan: Plan) -> Found:
    """Sofas, armchairs, chairs and benches of one group do not touch, nor sofas and armchairs a screen's stand, nor a
    side table a coffee table."""
    lounge, xp = loungers(plan), plan.kit
    seats = lounge | (plan.of("seat") & plan.stands("at", "foot") & plan.standing)
    i, j = plan.pairs(seats, seats, least=True)
    keep = (plan.smaller[i] < plan.smaller[j]) & plan.kin(i, j)
    of_its_own = [
        plan.pairs(one & plan.standing, plan.stands(word) & plan.standing, least=True)
        for one, word in ((lounge, "opposite"), (plan.stands("beside") & plan.of("board"), "before"))
    ]
    i, j = (xp.concat([kept[keep], *more]) for kept, *more in zip((i, j), *of_its_own, strict=True))
    needed = cast(xp.where(plan.stands("opposite", "before"), OF_ITS_OWN, HAND), plan.size)
    return plan.nearest(i, j, plan.apart(i, j) - needed[j], needed)


def clear(
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
