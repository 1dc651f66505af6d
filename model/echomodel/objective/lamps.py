"""Terms of lamps: pendants hang over what they light, what is small stands on a surface."""

from __future__ import annotations

from echomodel.arrays import Array, at_least, cast, held, least_of, norm, pairs_in, sum_of
from echomodel.objective.company import first_of, stated_of
from echomodel.objective.plan import FAR, Found, Plan, found

OVER = 0.25  # metres by which a pendant's middle may lie beyond the edge of what it hangs over
MIDDLE = 0.22  # share of the room's extent: so near to the middle a lamp lights the room
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
    central = MIDDLE - xp.amax(away / at_least(high - low, 1e-3), 1)
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
    cos, sin = plan.turn[0][j], plan.turn[1][j]
    aside = abs(cos * x - sin * z) * (sin * x + cos * z > -PILLOW)
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
