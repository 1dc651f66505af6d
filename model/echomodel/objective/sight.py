"""Terms of what is watched: a screen lies ahead of its viewer, and nothing stands between them."""

import math

from echomodel.arrays import Array, at_least, cast, full, held, least_of, once, pairs_in, rows
from echomodel.objective.access import FARTHEST, screens
from echomodel.objective.company import first_of, stated_of
from echomodel.objective.plan import FAR, Found, Plan, facing_angle, found, nobody, worst

TURNED = math.radians(45.0)  # from a screen's own front to who watches it
# From a viewer's front to the screen, degrees: 98 of 100 real sofas and 95 of 100 real beds are turned less; metres
# between their middles, at least and at most: 97 of 100 real sofas and all real beds.
VIEWS = {"sofa": (25.0, 1.2, FARTHEST), "bed": (30.0, 0.9, 4.2), "seat": (45.0, 0.9, 5.2)}
WATCHING = ("facing", "opposite")  # predicates that say who watches
ON_AXIS = 0.6  # metres beside the axis of its viewer
STEPS = tuple(0.1 + 0.8 * step / 12 for step in range(13))  # shares of the line of sight where things may be in it
HIGH = 0.65  # metres: one looks over what is lower
# Metres beside the line of sight that are free of what is high (in 108 of 110 real rooms), and of other groups' pieces
# (in 101 of them).
GRAZE, LANE = 0.25, 0.75
# From its screen at most: 95 of 100 real armchairs of a group are turned less, all second sofas.
BACK, ASKANCE = math.radians(125.0), math.radians(90.0)


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
    most = plan.kit.where(plan.of("sofa")[i], ASKANCE, BACK)
    return found(i, most - off, other=j, measure=plan.kit.rad2deg(off))


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
    aside, near, most = plan.numbers([VIEWS.get(plan.kinds[viewer].role, VIEWS["seat"]) for viewer in j.tolist()]).T
    seen, own = facing_angle(*plan.local(i, j)), facing_angle(*plan.local(j, i))
    away = (plan.position[i] - plan.position[j])[:, ::2]
    far = xp.sqrt(at_least((away * away).sum(1), 1e-12))
    margins = [xp.deg2rad(aside) - seen, TURNED - own, far - near, most - far]
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
