"""Rules of what is watched and of lamps: a screen lies ahead of its viewer, pendants hang over what they light."""

from __future__ import annotations

import math

from echomodel.arrays import Array, at_least, at_most, cast, full, held, least_of, norm, once, pairs_in, rows, sum_of
from echomodel.objective.company import first_of, stated_of
from echomodel.objective.plan import FAR, Found, Plan, facing_angle, found, nobody, worst

OVER = 0.25  # metres by which a pendant's middle may lie beyond the edge of what it hangs over
MIDDLE = 0.22  # share of the room's extent: so near to the middle a lamp lights the room
CENTRED = 0.3  # metres that a pendant, the middle of n a share of it, may hang off the middle of its table or bed
PILLOW = 0.3  # metres behind the middle of a bed from which on lamps light a bedside
IN_ROW, SPACED = 0.15, 0.25  # metres that one of several may hang beside their line, and that they keep apart
TOUCH = 0.04  # metres of air below a lamp on its table


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
    lamps = plan.which(lambda kind: kind.look == "pendant_lamp")
    lit = plan.which(lambda kind: kind.role == "bed" or (kind.role == "board" and not kind.access))
    return plan.pairs(lamps, lit & plan.standing)


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
    """A table lamp or television stands on something that can carry it."""
    small = plan.which(lambda kind: kind.support == "table" and not kind.hangs)
    i, j = plan.pairs(small, plan.which(lambda kind: kind.carries))
    who, xp = plan.those(small), plan.kit
    lateral, forward = plan.local(i, j)
    inside = xp.minimum(plan.size[j, 0] / 2 - abs(lateral), plan.size[j, 2] / 2 - abs(forward))
    air = abs(plan.position[i, 1] - plan.position[j, 1] - plan.size[j, 1])
    return found(who, -least_of(i, -xp.minimum(inside, TOUCH - air), len(plan), 1.0)[who])


# From a viewer's front to the screen: 98 of 100 real sofas and 95 of 100 real beds are turned less.
ASIDE = {"sofa": math.radians(25.0), "bed": math.radians(30.0), "seat": math.radians(45.0)}
TURNED = math.radians(45.0)  # from a screen's own front to who watches it
# Metres between the middles of a screen and its viewer: 99 of 100 real sofas and all real beds.
WATCHED_FROM = {"sofa": (1.2, 5.2), "bed": (0.9, 4.2), "seat": (0.9, 5.2)}
# Metres: a sofa so far from the wall may stand in the room on purpose, one walks behind it; who does so puts it so near
# to its screen: 94 of 100 real sofas, and all three that stand free.
PASSAGE, WATCHED_FREE = 0.75, 4.4
WATCHING = ("facing", "opposite")  # predicates that say who watches
ON_AXIS = 0.6  # metres beside the axis of its viewer
STEPS = tuple(0.1 + 0.8 * step / 12 for step in range(13))  # shares of the line of sight where things may be in it
HIGH = 0.65  # metres: one looks over what is lower
# Metres beside the line of sight that are free of what is high (in 108 of 110 real rooms), and of other groups' pieces
# (in 101 of them).
GRAZE, LANE = 0.25, 0.75
BACK = math.radians(125.0)  # 95 of 100 real armchairs of a group are turned less from its screen


def screen_in_view(plan: Plan) -> Found:
    """A television lies ahead of the sofa, seat or bed that it is watched from, not too near and not too far."""
    return _watched(plan)[0]


def screen_on_axis(plan: Plan) -> Found:
    """A screen and its stand are on the axis of the seat that looks at it; one out of its view is told of for that."""
    seen, ahead, _, _ = _watched(plan)
    screen, viewer, xp = seen.who[ahead], seen.other[ahead], plan.kit
    carried = plan.those(plan.of("screen") & (plan.carrier >= 0))
    at, k = pairs_in(plan.carrier[carried][None] == screen[:, None])
    screen, viewer = xp.concat([screen, carried[k]]), xp.concat([viewer, viewer[at]])
    aside = abs(plan.local(screen, viewer)[0])
    return found(screen, ON_AXIS - aside, other=viewer, measure=aside)


def view_free(plan: Plan) -> Found:
    """Nothing high stands between a screen and who watches it, and no table, chair or storage of another group."""
    seen, _, clear, about = _watched(plan)
    return found(seen.who, clear, other=about)


def screen_not_behind(plan: Plan) -> Found:
    """Who sits in the group that watches a screen does not turn the back on it."""
    screen, viewer = _watched(plan)[0].who, _watched(plan)[0].other
    chairs = plan.stands("company", "with") & plan.standing & plan.of("seat", "sofa")
    at, i = pairs_in((plan.group[None] == plan.group[viewer][:, None]) & chairs[None])
    keep = i != viewer[at]
    i, j = i[keep], screen[at[keep]]
    off = facing_angle(*plan.local(j, i))
    return found(i, BACK - off, other=j, measure=plan.kit.rad2deg(off))


def screens(plan: Plan) -> Array:
    """(N,) bool, what televisions stand on, and those that stand or hang elsewhere."""
    stands = plan.stands("opposite")
    return stands | (plan.of("screen") & ~(stands[plan.anchor] & (plan.anchor >= 0)))


@once
def _watched(plan: Plan) -> tuple[Found, Array, Array, Array]:
    """Each screen with the viewer that sees it best, of those that the graph names where it names any.

    Returns what `screen_in_view` finds of these (seen from its viewer, its own front, too near, too far). ahead: (P,)
    bool, whether the screen lies in its viewer's view. clear: (P,) float, metres that the line of sight keeps from what
    is high. about: (P,) int64, what is nearest to it, -1 = nothing.
    """
    xp = plan.kit
    i, j = plan.pairs(screens(plan), plan.of("sofa", "bed") | plan.stands("company"))
    if not len(i):
        return nobody(plan.size), i > 0, full(plan.size, 0, 0.0), i
    main = plan.of("sofa", "bed") & ~plan.stands("company")  # armchairs watch where there is neither
    for better in (lambda plan, i, j: stated_of(plan, i, j, *WATCHING), lambda _plan, _i, j: main[j]):
        good = better(plan, i, j)
        keep = good | (xp.bincount(i[good], minlength=len(plan))[i] == 0)
        i, j = i[keep], j[keep]
    roles = [plan.kinds[viewer].role for viewer in j.tolist()]
    aside = plan.numbers([ASIDE.get(role, ASIDE["seat"]) for role in roles])
    span = plan.numbers([WATCHED_FROM.get(role, WATCHED_FROM["seat"]) for role in roles])
    seen, own = facing_angle(*plan.local(i, j)), facing_angle(*plan.local(j, i))
    away = (plan.position[i] - plan.position[j])[:, ::2]
    far = xp.sqrt(at_least((away * away).sum(1), 1e-12))
    free = plan.of("sofa")[j] & (plan.back_gaps(j) >= PASSAGE)
    most = xp.where(free, at_most(span[:, 1], WATCHED_FREE), span[:, 1])
    margins = [aside - seen, TURNED - own, far - span[:, 0], most - far]
    view = first_of(i, j, margins, [xp.rad2deg(seen), xp.rad2deg(own), far, far])
    clear, about = _clear(plan, i, j)
    worse = -held(xp.minimum(view.margin, clear))
    best = rows(worse == least_of(i, worse, len(plan), math.inf)[i])
    best = best[least_of(i[best], best, len(plan), len(i))[i[best]] == best]
    return view.take(best), held(margins[0])[best] >= 0, clear[best], about[best]


def _clear(plan: Plan, i: Array, j: Array) -> tuple[Array, Array]:
    """(P,) and (P,): how much more than needed is free beside the line from screen i to viewer j, and what is next."""
    high = held(plan.position[:, 1] + plan.size[:, 1]) > HIGH
    massive = plan.of("board", "seat", "storage", "bed", "sofa")
    pair, block = plan.beside(i, plan.standing & ~plan.stands("before"))
    needed = plan.kit.where(high[block], GRAZE, -FAR)
    needed = plan.kit.where(massive[block] & (plan.group[block] != plan.group[j[pair]]), LANE, needed)
    keep = (block != j[pair]) & (held(plan.gap(i[pair], block)) > 1e-3)  # else it stands on that
    pair, block, needed = pair[keep], block[keep], cast(needed[keep], plan.size)
    share = plan.numbers(STEPS)[:, None, None]
    start, end = plan.position[i[pair]][:, ::2], plan.position[j[pair]][:, ::2]
    lateral, forward = plan.seen(block, start + share * (end - start))
    beside, ahead = abs(lateral) - plan.size[block, 0] / 2, abs(forward) - plan.size[block, 2] / 2
    return worst(pair, plan.kit.amin(plan.kit.maximum(beside, ahead), 0) - needed, block, len(i), FAR)
