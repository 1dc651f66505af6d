"""Terms of sofas and armchairs: groups look at each other, with room for knees and a table in reach."""

import math
from dataclasses import replace

from echomodel.arrays import at_least, cast, held, least_of, rows
from echomodel.objective.access import WALKED, screens, wall_ahead
from echomodel.objective.company import at_edges, first_of, lies_along, ranked
from echomodel.objective.crowding import MET, clear, loungers
from echomodel.objective.plan import FAR, Found, Plan, facing_angle, found, joined
from echomodel.vocabulary import vocabulary

LOUNGE = math.radians(100.0)  # an armchair takes part in its group, it does not stare at the table
COMPANY = 2.5  # metres: an armchair further away stands for itself
TOGETHER = 1.5  # metres between armchairs without a sofa: all real ones are nearer
BEFORE_SOFA = (0.12, 0.85)  # metres between a sofa and its coffee table: 90 % of real straight ones lie within
WITHIN = (0.2, 0.25)  # share of a sofa's width, and of a cornered one's, that the table's middle may lie beside its own
CIRCLE = math.radians(85.0)  # a sofa is turned so far at most from the middle of its group: 9 of 11 real second ones
BEFORE = 0.8  # metres before the larger sofa, where the middle of the group is
NEAR = 3.0  # metres: a sofa further away stands for itself
AHEAD, IN_VIEW = 1.0, 1.5  # metres before a sofa and a group's armchair to other groups: 97 % of real ones have them
COVERED = 0.1  # share of its width from which on something is before it
KNEES, KNEES_WALL = 0.4, 0.6  # metres before a sofa or armchair, before furniture of other groups and before a wall
ROOM = 0.25  # metres before a seat to its own group's lamps and other seats, and, but for the first sofa, to its table
END = 0.8  # metres before an armchair that looks at the end of a sofa or of storage, to that
TOUCHED = 0.1  # metres between a coffee table and other seats than its sofa: 95 % of real ottomans keep 0.12
# Metres to what an armchair looks at, to 45 degrees, and to a wall that it does not look at.
SEEN, FACED = 3.0, 2.0


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
    first = ranked(i, held(apart))[0] == 0
    i, j, apart = i[first], j[first], apart[first]
    off = facing_angle(*plan.local(j, i))
    return first_of(i, j, [LOUNGE - off, TOGETHER - apart], [plan.kit.rad2deg(off), apart])


def table_before_sofa(plan: Plan) -> Found:
    """A coffee table lies before its sofa, within its width and a hand's reach, a long one along it where it is alone;
    of several one does."""
    i, j = plan.attended("before")
    lateral, _, gap = at_edges(plan, i, j)
    ell, xp, off = plan.which(lambda kind: kind.name in vocabulary().cornered)[j], plan.kit, abs(lateral)
    least = xp.where(ell, BEFORE_SOFA[0] - plan.size[j, 2] * 0.6, BEFORE_SOFA[0])
    within = xp.where(ell, WITHIN[1], WITHIN[0]) * plan.size[j, 0]
    alone = xp.bincount(plan.joins[plan.joins >= 0], minlength=len(plan))[j] == 0
    lies = xp.where(alone, lies_along(plan, i, j), FAR)
    out = first_of(i, j, [gap - least, BEFORE_SOFA[1] - gap, within - off, lies], [gap, gap, off, gap])
    out = replace(out, words=xp.where((out.words == 0) & (gap < 0), 4, out.words))
    return out.take(held(-out.margin) <= least_of(j, held(-out.margin), len(plan), math.inf)[j])


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


def sofa_ahead(plan: Plan) -> Found:
    """What lies right before a sofa belongs to its group; an armchair looks at the back of no chair, one of a group at
    no table of another; behind a sofa one passes between it and those."""
    seats, xp = plan.of("sofa") | (plan.stands("company") & plan.of("seat")), plan.kit
    sofas = plan.of("sofa") & plan.standing & ~plan.stands("company")
    chairs, grouped = plan.stands("at") & plan.of("seat") & plan.standing, plan.anchor >= 0
    others = plan.of("board", "seat", "storage", "bed", "sofa") & plan.standing & ~plan.stands("opposite")
    i, j = plan.pairs(seats & plan.standing, others, least=True)
    met = (plan.group[i] != plan.group[j]) & (sofas[i] | chairs[j] | (grouped[i] & plan.dining[j]))
    i, j = i[met], j[met]
    needed = cast(xp.where(sofas, AHEAD, IN_VIEW), plan.size)
    towards = chairs[j] & ~sofas[i] & (xp.cos(plan.yaw[i] - plan.yaw[j]) < 0)
    ahead = plan.nearest(i, j, xp.where(towards, FAR, plan.more_ahead(i, j, needed[i], COVERED)), 0.0)
    ahead = replace(ahead, measure=at_least(ahead.margin + needed[ahead.who], 0.0))
    met = sofas[i] & (plan.dining | chairs)[j]
    behind = plan.nearest(i[met], j[met], plan.more_ahead(i[met], j[met], WALKED, COVERED, sign=-1.0), WALKED)
    return joined(ahead, replace(behind, words=behind.words + 1))


def looks_in(plan: Plan) -> Found:
    """An armchair looks at a seat, table, bed or screen, one without a group perhaps into its room: at no wall near."""
    chairs, xp = plan.stands("company") & plan.standing, plan.kit
    i, j = plan.pairs(chairs, (plan.of("sofa", "bed", "board", "seat") | screens(plan)) & plan.standing)
    lateral, forward = plan.local(j, i)
    within = xp.minimum(forward - abs(lateral), SEEN - xp.sqrt(lateral * lateral + forward * forward + 1e-12))
    who = plan.those(chairs & plan.walled)
    wall, anchor = wall_ahead(plan, who), plan.anchor[who]
    seated = (anchor >= 0) & plan.of("seat")[who] & (held(plan.gap(who, anchor)) < COMPANY)
    into = xp.where(seated, -FAR, wall - FACED)
    return found(who, xp.maximum(-least_of(i, -within, len(plan), FAR)[who], into), measure=wall)


def knees_free(plan: Plan) -> Found:
    """Who sits on a sofa or in an armchair has room for the knees, and does not look at a wall."""
    return clear(plan, loungers(plan), plan.standing & ~plan.movable, KNEES, KNEES_WALL)


def seat_room(plan: Plan) -> Found:
    """One can sit down in a group, too: nothing but its table stands close before a sofa or armchair, nor the end of a
    sofa or of storage before an armchair."""
    block = (plan.of("sofa", "light", "decor", "storage", "bed") | plan.stands("company", "beside")) & plan.standing
    close = clear(plan, loungers(plan), block, ROOM, -FAR, kin=True)
    tables = plan.stands("before") & plan.standing  # which a second sofa, an armchair or an ottoman does not touch
    chairs, ottomans = (plan.stands(word) & plan.of("seat") & plan.standing for word in ("company", "foot"))
    i, j = plan.pairs((plan.stands("with") & plan.standing) | chairs | ottomans, tables, least=True)
    long = plan.of("sofa", "storage") & ~plan.stands("head")
    one, other = plan.pairs(chairs, long & plan.standing, least=True)
    lateral, forward = plan.local(one, other)
    level = plan.of("storage")[other] | (forward < plan.size[other, 2] / 2)  # a sofa is looked at from before it, too
    aside = (abs(lateral) > plan.size[other, 0] / 2) & level
    ends = plan.kit.where(aside, plan.more_ahead(one, other, END, MET), FAR)
    knees = plan.kit.where(ottomans[i], FAR, plan.more_ahead(i, j, ROOM, MET))
    margin = plan.kit.concat([plan.kit.minimum(plan.apart(i, j) - TOUCHED, knees), ends])
    least, about = plan.worst(plan.kit.concat([i, one]), margin, plan.kit.concat([j, other]))
    met = least < 0
    met[close.who[close.margin < 0]] = False
    who = rows(met)
    end = long[about[who]]
    measure = at_least(plan.kit.where(end, least[who] + END, plan.apart(who, about[who])), 0.0)
    return joined(close, found(who, least[who], other=about[who], measure=measure, words=1 * end))
