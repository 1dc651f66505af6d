"""Terms of relations and of physics: what the graph states; nothing runs into anything, leaves the room or hangs in
the air."""

from collections.abc import Callable

import numpy as np

from echomodel.arrays import Array, at_least, cast, full, held, put
from echomodel.floors import Walls, edges, footprint, signed_area
from echomodel.late import Late
from echomodel.objective.plan import FAR, Found, Plan, found, joined, nobody
from echomodel.objective.support import ON_CEILING, ON_FLOOR
from echomodel.rules import RULE_SETS, rule_set
from echomodel.rules.geometry import Spread
from echomodel.vocabulary import vocabulary

margin_of = Late("echomodel.rules.placements:margin_of")
TOUCH = 0.01  # metres that two boxes, a box and a wall, a box and its carrier may be off


def apart(plan: Plan) -> Found:
    """No two pieces run into each other, but for what belongs together: a chair is pushed under its own table."""
    i, j, allowed = plan.couples
    rise = plan.kit.maximum(
        plan.position[j, 1] - plan.position[i, 1] - plan.size[i, 1],
        plan.position[i, 1] - plan.position[j, 1] - plan.size[j, 1],
    )
    depth = -plan.kit.maximum(plan.apart(i, j), rise)
    return found(i, TOUCH + allowed - depth, other=j, measure=depth)


def on_floor(plan: Plan) -> Found:
    """Every piece lies within the walls."""
    who = plan.those(plan.walled & plan.moved)
    inside = plan.inside(footprint(plan.size[who], plan.position[who], plan.yaw[who]), who)
    inside = plan.kit.amin(inside, 1)
    clear = inside if plan.first.rectangle is not None else plan.kit.minimum(inside, _off_corners(plan, who))
    return found(who, clear + TOUCH, measure=-inside)


def _off_corners(plan: Plan, who: Array) -> Array:
    """(P,): metres between boxes and the corners that look into their room, negative inside; `FAR` where none does."""
    start, end = edges(plan.floor)
    along, xp = end - start, plan.kit
    before = xp.roll(along, 1, 1)
    turn = (before[..., 0] * along[..., 1] - before[..., 1] * along[..., 0]) * signed_area(plan.floor)[:, None]
    reflex = (turn < -1e-6).any(0)
    if not bool(reflex.any()):
        return full(plan.size, len(who), FAR)
    looks = (turn < -1e-6)[plan.scene[who]][:, reflex]
    local = xp.stack(plan.seen(who[:, None], start[plan.scene[who]][:, reflex]), -1)
    outside = xp.amax(abs(local) - plan.size[who][:, None, ::2] / 2, -1)
    return xp.amin(xp.where(looks, outside, FAR), 1)


def rests(plan: Plan) -> Found:
    """Furniture stands on the floor or on its carrier, with its middle over it, and what hangs hangs at the ceiling."""
    xp = plan.kit
    who = plan.those(plan.moved | plan.moved[at_least(plan.carrier, 0)])
    carrier = plan.carrier[who]
    carried, on = carrier >= 0, at_least(carrier, 0)
    bottom, top = plan.position[who, 1], plan.position[on, 1] + plan.size[on, 1]
    ceiling = plan.ceiling[who] - plan.size[who, 1]
    air = xp.where(carried, bottom - top, xp.where(carrier == ON_CEILING, ceiling - bottom, bottom))
    free = ~(carried | (carrier == ON_FLOOR) | ((carrier == ON_CEILING) & xp.isfinite(ceiling)))
    air = xp.where(free, 0.0, air)
    margin, beside = TOUCH - abs(air), xp.full_like(air, FAR)
    if bool(carried.any()):
        lateral, forward = plan.local(who[carried], on[carried])
        half = plan.size[on[carried]][:, ::2] / 2
        beside = put(beside, carried, xp.minimum(half[:, 0] - abs(lateral), half[:, 1] - abs(forward)))
    other, words = at_least(carrier, -1), 1 * (beside < margin)
    return found(who, xp.minimum(margin, beside), other=other, measure=air, words=words)


def in_height(plan: Plan) -> Found:
    """Nothing lies below the floor or reaches through the ceiling."""
    who = plan.those(plan.moved)
    ceiling, low = plan.ceiling[who], plan.position[who, 1]
    high = ceiling - low - plan.size[who, 1]
    margin = TOUCH + plan.kit.minimum(low, plan.kit.where(plan.kit.isfinite(ceiling), high, FAR))
    return found(who, margin, measure=TOUCH - margin, words=1 * (high < low))


def stated(predicate: str) -> Callable[[Plan], Found]:
    """The term of a relation: its margins wherever the graph states it, by the plan's own set of rules."""

    def find(plan: Plan) -> Found:
        rule = rule_set(plan.rules).rules.get(predicate)
        rows = plan.rows_of(predicate)
        if rule is None or rule.margin is None or not len(rows):
            return nobody(plan.size)
        i, _, j = plan.stated_pairs
        return found(i[rows], rule.margin(plan.pair_geometry)[rows], other=j[rows])

    strict = rule_set("strict").rules.get(predicate)
    find.__name__, find.__doc__ = predicate, "" if strict is None else strict.means
    return find


def placed(plan: Plan) -> Found:
    """A piece stands in the room as the graph says: against a wall, in a corner, between two others."""
    out, box = nobody(plan.size), cast(np.arange(len(plan)) % max(len(plan.first), 1), plan.scene)  # in each copy
    for one in plan.stated:
        rows = [plan.those(box == number) for number in (one.subject, *one.others)]
        every = {number: Spread(plan.size[at], plan.position[at], plan.yaw[at])
                 for number, at in zip((one.subject, *one.others), rows, strict=True)}  # fmt: skip
        floor = plan.floor[int(plan.scene[one.subject])]
        corners = np.asarray(held(floor[plan.kit.isfinite(floor).all(1)]))
        walls = Walls(corners) if len(corners) else None
        if walls is None and not one.others:
            continue
        margin = margin_of(one, every, walls, {one.subject: plan.kinds[one.subject].name})
        about = rows[1] if one.others else full(rows[0], len(rows[0]), -1)
        number = [row.name for row in vocabulary().placements].index(one.placement)
        out = joined(out, found(rows[0], margin, other=about, words=full(rows[0], len(rows[0]), number)))
    return out


def measured() -> list[tuple[str, str]]:
    """Names of the predicates that a set of rules measures, each with the unit of its margin."""
    known = {name for rules in RULE_SETS.values() for name, rule in rules.rules.items() if rule.margin is not None}
    return [
        (row.name, "share" if row.measures == "size" else "m") for row in vocabulary().predicates if row.name in known
    ]
