"""Rules of lamps: pendants hang over what they light, and lamps that need a surface have one."""

from __future__ import annotations

import torch

from echomodel.floors import extents, known
from echomodel.objective.found import Found, found, nobody
from echomodel.objective.plan import Plan

OVER = 0.25  # metres by which a pendant's middle may lie beyond the edge of what it hangs over
MIDDLE = 0.22  # share of the room's extent: so near to the middle a lamp lights the room
CLEAR = 0.9  # metres: so far from every table a lamp lights free floor
CENTRED = 0.3  # metres that a pendant, or the middle of several, may hang off the middle of its table
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
    """What hangs over a table hangs over its middle; several pendants do so together."""
    lamps = plan.which(lambda kind: kind.look == "pendant_lamp")
    tables = plan.which(lambda kind: kind.role == "board" and not kind.access) & plan.standing
    i, j = plan.pairs(lamps, tables)
    if not len(i):
        return nobody(plan.size)
    over = (plan.gap(i, j) < 1e-3).to(plan.size)
    away = (plan.position[i] - plan.position[j])[:, [0, 2]] * over[:, None]
    count = over.new_zeros(len(plan)).index_add(0, j, over)
    mean = away.new_zeros(len(plan), 2).index_add(0, j, away) / count.clamp_min(1.0)[:, None]
    off = (mean[j].square().sum(1) + 1e-12).sqrt() * over  # of what hangs elsewhere, nothing
    return found(i, CENTRED - off, other=j, measure=off)


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
