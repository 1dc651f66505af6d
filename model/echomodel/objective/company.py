"""Terms of company: nightstands at the head, what is small at the side of what it serves, lamps over what is lit."""

import math

from echomodel.arrays import Array, at_least, cast, full, held, kit, least_of, norm, pairs_in, put, sum_of
from echomodel.boxes2d import to_frame
from echomodel.floors import footprint
from echomodel.objective.plan import FAR, Found, Plan, facing_angle, found, joined, nobody

LONG = 1.5  # times as long as deep: 90 % of such coffee tables lie along their only sofa, benches along their bed
BESIDE = 0.4  # metres between a bed and its nightstand: 95 % of real ones are nearer
PAIR = 0.15  # metres by which the gaps of the two nightstands of a bed may differ: 98 % of real ones differ less
IN_BED = 0.4  # metres by which a nightstand may reach into the box of a bed whose board is wider than it is
FOOT = 0.35  # metres between a bed's foot and the bench there: 95 % of real ones
# Share of the bed's width by which its middle may lie beside the bed's: of one alone 4 of 5 real ones, else 95 %.
MIDDLE, ALONG = 0.12, 0.38
HEAD = 0.45  # metres between the level of the headboard and the nightstand's back
TURNED = math.radians(45.0)  # 94 % of real nightstands look the same way as their bed


def lies_along(plan: Plan, i: Array, j: Array) -> Array:
    """(P,): by how many metres long pieces lie along others, not across; `FAR` of those that are as wide as deep."""
    size, (wide, deep), xp = held(plan.size)[i], plan.reach(i, j), plan.kit
    long = xp.maximum(size[:, 0], size[:, 2]) > LONG * xp.minimum(size[:, 0], size[:, 2])
    return xp.where(long, wide - deep, FAR)


def nightstand_at_head(plan: Plan) -> Found:
    """Nightstands stand beside the bed at its head; of more than two the nearest two."""
    i, j = plan.attended("head")
    near = ranked(j, held(plan.gap(i, j)))[0] < 2
    i, j = i[near], j[near]
    _, beside, before = at_edges(plan, i, j)
    turn, back, xp = plan.yaw[i] - plan.yaw[j], abs(before + plan.size[j, 2]), plan.kit
    off = facing_angle(xp.sin(turn), xp.cos(turn))
    margins = [BESIDE - beside, beside + IN_BED, HEAD - back, TURNED - off]
    return first_of(i, j, margins, [beside, beside, back, xp.rad2deg(off)])


def nightstands_alike(plan: Plan) -> Found:
    """The nightstands at both sides of a bed are as far from it as each other."""
    i, j = plan.attended("head")
    lateral, beside, before = at_edges(plan, i, j)
    at_head = (abs(before + plan.size[j, 2]) < HEAD) & (beside < BESIDE) & (beside > -IN_BED)
    right, left, xp = at_head & (lateral > 0), at_head & ~(lateral > 0), plan.kit
    one, other = pairs_in((j[:, None] == j[None]) & right[:, None] & left[None])
    apart, swap = abs(beside[one] - beside[other]), beside[one] < beside[other]
    one, other = xp.where(swap, i[other], i[one]), xp.where(swap, i[one], i[other])
    return found(one, PAIR - apart, other=other, measure=apart)


def at_edges(plan: Plan, i: Array, j: Array) -> tuple[Array, Array, Array]:
    """(P,) each, metres: how far i lies to the side of j, how far beside its edge, and before its front."""
    lateral, forward = plan.local(i, j)
    half_width, half_depth = plan.reach(i, j)
    return lateral, abs(lateral) - half_width - plan.size[j, 0] / 2, forward - half_depth - plan.size[j, 2] / 2


def bench_at_foot(plan: Plan) -> Found:
    """A bench or ottoman at the foot of a bed stands close to it, within its width, one alone before its middle; a long
    one lies along it."""
    i, j = plan.attended("foot", to=plan.of("bed"))
    (lateral, _, gap), xp = at_edges(plan, i, j), plan.kit
    most = xp.where(xp.bincount(j, minlength=len(plan))[j] == 1, MIDDLE, ALONG) * plan.size[j, 0]
    return first_of(i, j, [FOOT - gap, most - abs(lateral), lies_along(plan, i, j)], [gap, abs(lateral), gap])


def ranked(anchor: Array, distance: Array) -> tuple[Array, Array]:
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


AROUND = 0.7  # metres: chairs further from their table are not at it
COVERS = 0.12  # share of a sofa's width that side tables and lamps may stand before
AHEAD, OF_TABLES = 0.1, -0.15  # metres that the middles of lamps and tables may lie before its front: 97 % of real ones
SIDE = 0.6  # metres: what is further from its seat stands for itself
ELBOW, KNEES = 0.15, 0.3  # share of a sofa's width that an armchair may stand before, and metres from which on all
FORTH, REACHED = 0.6, 0.25  # metres beyond its sofa's back that armchairs, all of 99, and tables, 96 of 97, reach
LEFT, OWN = 0.7, 0.6  # metres from its group from which on an armchair stands apart, and to what is its own: 97 %
ALONE = 0.45  # metres from everything: nothing small stands so in a room
# Metres less from furniture, more for ottomans: 98 % of real side tables are within 0.3 of something, 90 % of these in
# 0.6. Of 47 real floor lamps 46 are within 0.4 of a wall, the other one is at a sofa.
OF_SMALL = 0.15
LIT = 1.1  # metres between a floor lamp and the next seat, bed or table: 95 % of real ones
EDGE, LAID = 0.5, 0.3  # metres between a wall and an only armchair that belongs to no group, and such a daybed


def at_its_side(plan: Plan) -> Found:
    """Side tables and floor lamps stand beside their sofa, armchair or bed, not before it, armchairs and second sofas
    not before its knees, and none of them but lamps behind it."""
    i, j = plan.attended("beside", to=plan.of("sofa", "bed") | plan.stands("company"))
    keep, xp = held(plan.apart(i, j)) < SIDE if len(i) else i > 0, plan.kit
    chairs = plan.those((plan.stands("company") & plan.of("sofa")[plan.group] & ~plan.of("sofa")) | plan.stands("with"))
    i, j = xp.concat([i[keep], chairs]), xp.concat([j[keep], plan.group[chairs]])
    chair, width = plan.stands("company", "with")[i], plan.size[j, 0]
    lateral, forward = plan.local(i, j)
    half_width, half_depth = plan.reach(i, j)
    covered = width / 2 + half_width - abs(lateral)
    ahead = forward - plan.size[j, 2] / 2  # of its middle, where it stands off the end as well
    before = ahead - half_depth
    margin = xp.maximum(xp.where(chair, ELBOW * width, COVERS * width) - covered, -0.05 - before)
    table = plan.of("board")[i]
    most = xp.where(table, OF_TABLES, AHEAD)
    margin = xp.where(chair, xp.maximum(margin, before - KNEES), xp.minimum(margin, most - ahead))
    behind = ahead + half_depth + plan.size[j, 2] - xp.where(chair, FORTH, xp.where(table, REACHED, -FAR))
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


OVER = 0.25  # metres by which a pendant's middle may lie beyond the edge of what it hangs over
AMID = 0.22  # share of the room's extent: so near to the middle a lamp lights the room
CENTRED = 0.3  # metres that a pendant, the middle of n a share of it, may hang off the middle of its table or bed
PILLOW = 0.3  # metres behind the middle of a bed from which on lamps light a bedside
IN_ROW, SPACED = 0.15, 0.25  # metres that one of several may hang beside their line, and that they keep apart
TOUCH, HUNG = 0.04, 0.1  # metres of air below a lamp on its table, and behind what hangs at a wall


def pendant_over(plan: Plan) -> Found:
    """A pendant hangs over a table, bed or seat, or over the middle of the room."""
    lamps = plan.which(lambda kind: kind.look == "pendant_lamp")
    who, xp = plan.those(lamps & plan.walled), plan.kit
    i, j = plan.pairs(lamps, (plan.of("board", "bed", "sofa") | plan.stands("head")) & plan.standing)
    corners = plan.walls[0][plan.scene[who]]
    low, high = xp.amin(corners, 1), xp.amax(corners, 1)
    away = abs(plan.position[who][:, ::2] - (low + high) / 2)
    central = AMID - xp.amax(away / at_least(high - low, 1e-3), 1)
    best = OVER - least_of(i, plan.gap(i, j), len(plan), OVER + FAR)[who]
    return found(who, xp.maximum(best, central), measure=norm(away))


def _hung(plan: Plan) -> tuple[Array, Array]:
    """Pairs (P,), (P,) of pendants and of the beds, and tables at which nobody works, of their room."""
    lit = plan.which(lambda kind: kind.role == "bed" or (kind.role == "board" and not kind.access))
    return plan.pairs(plan.which(lambda kind: kind.look == "pendant_lamp"), lit & plan.standing)


def _over(plan: Plan, i: Array, j: Array) -> Array:
    """(P,) bool: lamp i hangs over j, or shall."""
    return (held(plan.gap(i, j)) < 1e-3) | stated_of(plan, i, j, "above")


def pendant_centred(plan: Plan) -> Found:
    """What hangs over a table, or shall, hangs over its middle, over a bed on its axis; several pendants together."""
    i, j = _hung(plan)
    over = cast(_over(plan, i, j), plan.size)
    away, count = plan.position[i] - plan.position[j], at_least(sum_of(j, over, len(plan)), 1.0)
    x, z = ((sum_of(j, away[:, axis] * over, len(plan)) / count)[j] for axis in (0, 2))
    lateral, forward = to_frame(x, z, plan.turn[0][j], plan.turn[1][j])
    aside = abs(lateral) * (forward > -PILLOW)
    off = plan.kit.where(plan.of("bed")[j], aside, plan.kit.sqrt(x * x + z * z + 1e-12)) * over  # elsewhere, nothing
    return found(i, CENTRED / count[j] - off, other=j, measure=off)


def pendants_in_row(plan: Plan) -> Found:
    """Several pendants over one table hang in one line along it, apart from each other."""
    i, j = _hung(plan)
    over, xp = _over(plan, i, j) & plan.of("board")[j], plan.kit
    i, j = i[over], j[over]
    one, other = pairs_in((j[:, None] == j[None]) & (i[:, None] < i[None]))
    lateral, forward = plan.local(i, j)
    long = (plan.size[j, 0] >= plan.size[j, 2])[one]
    aside, ahead = abs(lateral[one] - lateral[other]), abs(forward[one] - forward[other])
    along, across = xp.where(long, aside, ahead), xp.where(long, ahead, aside)
    return first_of(i[one], i[other], [IN_ROW - across, along - SPACED], [across, along])


def lamp_on_surface(plan: Plan) -> Found:
    """A table lamp or television stands on something that can carry it; a television may hang at a wall."""
    small = plan.which(lambda kind: kind.support == "table")
    i, j = plan.pairs(small, plan.which(lambda kind: kind.carries))
    who, xp = plan.those(small), plan.kit
    lateral, forward = plan.local(i, j)
    inside = xp.minimum(plan.size[j, 0] / 2 - abs(lateral), plan.size[j, 2] / 2 - abs(forward))
    air = abs(plan.position[i, 1] - plan.position[j, 1] - plan.size[j, 1])
    margin, behind = -least_of(i, -xp.minimum(inside, TOUCH - air), len(plan), 1.0)[who], plan.back_gaps(who)
    hung = plan.which(lambda kind: kind.hangs)[who]
    return found(who, xp.where(hung, xp.maximum(margin, HUNG - behind * plan.walled[who]), margin))
