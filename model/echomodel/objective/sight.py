"""Rules of what is watched and of lamps: a screen lies ahead of its viewer, pendants hang over what they light."""

from __future__ import annotations

import math
from collections.abc import Sequence

import torch
from torch import Tensor

from echomodel.floors import extents, known
from echomodel.objective.plan import FAR, Found, Plan, facing_angle, found, nobody, worst

OVER = 0.25  # metres by which a pendant's middle may lie beyond the edge of what it hangs over
MIDDLE = 0.22  # share of the room's extent: so near to the middle a lamp lights the room
CLEAR = 0.9  # metres: so far from every table a lamp lights free floor
CENTRED = 0.3  # metres that a pendant, or the middle of several, may hang off the middle of its table
IN_ROW, SPACED = 0.15, 0.25  # metres that one of several may hang beside their line, and that they keep apart
TOUCH = 0.04  # metres of air below a lamp on its table


def pendant_over(plan: Plan) -> Found:
    """A pendant hangs over a table, bed or seat, over the middle of the room, or well away from all tables."""
    lamps = plan.which(lambda kind: kind.look == "pendant_lamp")
    if not bool(lamps.any()):
        return nobody(plan.size)
    i, j = plan.pairs(lamps, (plan.of("board", "bed", "sofa") | plan.stands("head")) & plan.standing)
    tables = plan.which(lambda kind: kind.role == "board" and not (kind.belongs_to or kind.access))[j]
    gap = plan.gap(i, j)
    who = plan.those(lamps)
    best = gap.new_full((len(plan),), -9.0).scatter_reduce(0, i, OVER - gap, "amax")[who]
    near = gap.new_full((len(plan),), 9.0).scatter_reduce(0, i[tables], gap[tables], "amin")[who]
    floor = plan.floor[plan.scene[who]]
    there = known(floor)
    corners = torch.nan_to_num(torch.where(torch.isfinite(floor), floor, floor[:, :1]))  # NaN would spoil gradients
    middle = (corners.amax(1) + corners.amin(1)) / 2
    away = ((plan.position[who][:, [0, 2]] - middle).abs() / torch.nan_to_num(extents(floor), nan=1.0)).amax(1)
    central = torch.where(there, MIDDLE - away, -torch.ones_like(away))
    margin = torch.maximum(torch.maximum(best, central), near - CLEAR)
    return found(who, margin, measure=near)


def pendant_centred(plan: Plan) -> Found:
    """What hangs over a table, or shall, hangs over its middle; several pendants do so together."""
    lamps = plan.which(lambda kind: kind.look == "pendant_lamp")
    tables = plan.which(lambda kind: kind.role == "board" and not kind.access) & plan.standing
    i, j = plan.pairs(lamps, tables)
    over = ((plan.gap(i, j) < 1e-3) | _told(plan, i, j, ("above",))).to(plan.size)
    away = (plan.position[i] - plan.position[j])[:, [0, 2]] * over[:, None]
    count = over.new_zeros(len(plan)).index_add(0, j, over)
    mean = away.new_zeros(len(plan), 2).index_add(0, j, away) / count.clamp_min(1.0)[:, None]
    off = (mean[j].square().sum(1) + 1e-12).sqrt() * over  # of what hangs elsewhere, nothing
    return found(i, CENTRED - off, other=j, measure=off)


def pendants_in_row(plan: Plan) -> Found:
    """Several pendants over one table hang in one line along it, apart from each other."""
    lamps = plan.which(lambda kind: kind.look == "pendant_lamp")
    tables = plan.which(lambda kind: kind.role == "board" and not kind.access) & plan.standing
    i, j = plan.pairs(lamps, tables)
    over = plan.gap(i, j).detach() < 1e-3 if len(i) else i.bool()
    i, j = i[over], j[over]
    one, other = ((j[:, None] == j[None]) & (i[:, None] < i[None])).nonzero(as_tuple=True)
    if not len(one):
        return nobody(plan.size)
    lateral, forward = plan.local(i, j)
    long = (plan.size[j, 0] >= plan.size[j, 2])[one]
    aside, ahead = (lateral[one] - lateral[other]).abs(), (forward[one] - forward[other]).abs()
    along, across = torch.where(long, aside, ahead), torch.where(long, ahead, aside)
    margin, which = torch.stack([IN_ROW - across, along - SPACED], -1).min(1)
    return found(i[one], margin, other=i[other], measure=torch.where(which == 0, across, along), words=which)


def lamp_on_surface(plan: Plan) -> Found:
    """A table lamp or television stands on something that can carry it."""
    small = plan.which(lambda kind: kind.support == "table" and not kind.hangs)
    if not bool(small.any()):
        return nobody(plan.size)
    carriers = plan.which(lambda kind: kind.carries)
    i, j = plan.pairs(small, carriers)
    who = plan.those(small)
    lateral, forward = plan.local(i, j)
    half = plan.size[j][:, [0, 2]] / 2
    inside = torch.minimum(half[:, 0] - lateral.abs(), half[:, 1] - forward.abs())
    air = (plan.position[i, 1] - plan.position[j, 1] - plan.size[j, 1]).abs()
    margin = torch.minimum(inside, TOUCH - air)
    best = margin.new_full((len(plan),), -1.0).scatter_reduce(0, i, margin, "amax")[who]
    return found(who, best)


# From a viewer's front to the screen: 98 of 100 real sofas and 95 of 100 real beds are turned less.
ASIDE = {"sofa": math.radians(25.0), "bed": math.radians(30.0), "seat": math.radians(45.0)}
TURNED = math.radians(45.0)  # from a screen's own front to who watches it
# Metres between the middles of a screen and its viewer: 99 of 100 real sofas and all real beds.
WATCHED_FROM = {"sofa": (1.2, 5.2), "bed": (0.9, 4.2), "seat": (0.9, 5.2)}
TOLD = ("facing", "opposite")  # predicates that say who watches
ON_AXIS = 0.6  # metres beside the axis of its viewer
STEPS = 13
HIGH = 0.65  # metres: one looks over what is lower
GRAZE = 0.25  # metres beside the line of sight that are free: in 2 of 110 real rooms they are not
BACK = math.radians(125.0)  # 95 of 100 real armchairs of a group are turned less from its screen


def screen_in_view(plan: Plan) -> Found:
    """A television lies ahead of the sofa, seat or bed that it is watched from, not too near and not too far."""
    who, viewer, margin, measure, _, _ = _watched(plan)
    least, which = margin.min(1)
    return found(who, least, other=viewer, measure=measure.gather(1, which[:, None])[:, 0], words=which)


def screen_on_axis(plan: Plan) -> Found:
    """A screen stands on the axis of the seat that looks at it; one that is out of its view is told of for that."""
    screen, viewer, margin, *_ = _watched(plan)
    ahead = margin.detach()[:, 0] >= 0
    screen, viewer = screen[ahead], viewer[ahead]
    aside = plan.local(screen, viewer)[0].abs()
    return found(screen, ON_AXIS - aside, other=viewer, measure=aside)


def view_free(plan: Plan) -> Found:
    """Nothing high stands between a screen and who watches it."""
    who, _, _, _, clear, about = _watched(plan)
    return found(who, clear, other=about)


def screen_not_behind(plan: Plan) -> Found:
    """Who sits in the group that watches a screen does not turn the back on it."""
    screen, viewer, *_ = _watched(plan)
    chairs = plan.stands("company", "with") & plan.standing & plan.of("seat", "sofa")
    at, i = ((plan.group[None] == plan.group[viewer][:, None]) & chairs[None]).nonzero(as_tuple=True)
    keep = i != viewer[at]
    i, j = i[keep], screen[at[keep]]
    off = facing_angle(*plan.local(j, i))
    return found(i, BACK - off, other=j, measure=torch.rad2deg(off))


Watched = tuple[Tensor, Tensor, Tensor, Tensor, Tensor, Tensor]


def _watched(plan: Plan) -> Watched:
    """What `_viewers` finds, which three rules ask for."""
    kept = vars(plan)
    if "watched" not in kept:
        kept["watched"] = _viewers(plan)
    found: Watched = kept["watched"]
    return found


def _viewers(plan: Plan) -> Watched:
    """Each screen with the viewer that sees it best, of those that the graph names where it names any.

    Returns screen, viewer: (P,) int64. margin, measure: (P, 4) float, of the three demands on where the screen lies
    (seen from its viewer, its own front, too near, too far). clear: (P,) float, metres that the line of sight keeps
    from what is high. about: (P,) int64, what is nearest to it, -1 = nothing.
    """
    stands = plan.stands("opposite")
    on_stand = (plan.anchor >= 0) & stands[plan.anchor.clamp_min(0)] if len(plan) else stands
    i, j = plan.pairs(stands | (plan.of("screen") & ~on_stand), plan.of("sofa", "bed") | plan.stands("company"))
    if not len(i):
        return i, j, plan.size.new_zeros(0, 4), plan.size.new_zeros(0, 4), plan.size.new_zeros(0), i
    for better in (_told, _lying_or_sitting_back):
        good = better(plan, i, j)
        keep = good | ~torch.isin(i, i[good])
        i, j = i[keep], j[keep]
    aside = plan.column(lambda kind: ASIDE.get(kind.role, ASIDE["seat"]))[j]
    span = plan.column(lambda kind: WATCHED_FROM.get(kind.role, WATCHED_FROM["seat"])).reshape(-1, 2)[j]
    seen, own = facing_angle(*plan.local(i, j)), facing_angle(*plan.local(j, i))
    far = (plan.position[i] - plan.position[j])[:, [0, 2]].square().sum(1).clamp_min(1e-12).sqrt()
    margin = torch.stack([aside - seen, TURNED - own, far - span[:, 0], span[:, 1] - far], -1)
    measure = torch.stack([torch.rad2deg(seen), torch.rad2deg(own), far, far], -1)
    clear, about = _clear(plan, i, j)
    total = torch.minimum(margin.amin(1), clear).detach()
    most = total.new_full((len(plan),), -torch.inf).scatter_reduce(0, i, total, "amax")
    rows = (total == most[i]).nonzero()[:, 0]
    first = torch.full((len(plan),), len(i)).scatter_reduce(0, i[rows], rows, "amin")
    rows = rows[first[i[rows]] == rows]
    return i[rows], j[rows], margin[rows], measure[rows], clear[rows], about[rows]


def _told(plan: Plan, i: Tensor, j: Tensor, words: Sequence[str] = TOLD) -> Tensor:
    """(P,) bool: the graph says one of these words of i and j, or of j and i."""
    ends = [plan.told(word) for word in words]
    said = torch.cat([one * len(plan) + other for a, b in ends for one, other in ((a, b), (b, a))])
    return torch.isin(i * len(plan) + j, said)


def _lying_or_sitting_back(plan: Plan, i: Tensor, j: Tensor) -> Tensor:
    """(P,) bool: j is a sofa or bed; armchairs watch where there is neither."""
    return plan.of("sofa", "bed")[j] & ~plan.stands("company")[j]


def _clear(plan: Plan, i: Tensor, j: Tensor) -> tuple[Tensor, Tensor]:
    """(P,) and (P,): metres between the line from screen i to viewer j and the next thing that is high, and which."""
    high = plan.standing & ~plan.stands("before") & (plan.position[:, 1] + plan.size[:, 1] > HIGH).detach()
    pair, block = plan.beside(i, high)
    keep = (block != i[pair]) & (block != j[pair])
    pair, block = pair[keep], block[keep]
    keep = plan.gap(i[pair], block) > 1e-3  # else it stands on that
    pair, block = pair[keep], block[keep]
    share = torch.linspace(0.1, 0.9, STEPS, dtype=plan.size.dtype)[:, None, None]
    start, end = plan.position[i[pair]][:, [0, 2]], plan.position[j[pair]][:, [0, 2]]
    lateral, forward = plan.seen(block, start + share * (end - start))
    beside, ahead = lateral.abs() - plan.size[block, 0] / 2, forward.abs() - plan.size[block, 2] / 2
    return worst(pair, torch.maximum(beside, ahead).amin(0) - GRAZE, block, len(i), FAR)
