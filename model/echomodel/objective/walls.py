"""Rules of walls: furniture stands parallel to them, and what belongs at a wall touches it."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from echomodel.objective.found import Found, found
from echomodel.objective.plan import FAR, Plan

CROOKED = math.radians(5.0)  # 98 to 100 % of such furniture in real rooms is turned less
TOUCHING = 0.3  # metres: 93 % of real beds, nightstands and tv stands have a smaller gap behind
PASSAGE = 0.75  # metres: a sofa so far from the wall may stand in the room on purpose, one walks behind it
DEEP = 6.0  # metres of the room along its axis from which on it does; or something of another group stands behind it


def parallel(plan: Plan) -> Found:
    """Storage, beds, sofas, tables and desks stand parallel to a wall; side tables go with their seat."""
    massive = plan.of("storage", "bed", "sofa", "board") & plan.standing
    who = plan.those(massive & ~plan.stands("company", "beside") & plan.moved)
    _, along, _, length = (of[plan.scene[who]] for of in plan.walls)
    wall = torch.atan2(-along[..., 1], along[..., 0])
    off = _from_quarter(plan.yaw[who, None] - wall)
    off = torch.where(length > 0.3, off, torch.full_like(off, math.pi / 4)).amin(1)
    off = torch.where((length > 0).any(1), off, _from_quarter(plan.yaw[who]))
    return found(who, CROOKED - off, measure=torch.rad2deg(off))


def _from_quarter(angle: Tensor) -> Tensor:
    """How far an angle is from the nearest quarter turn, radians."""
    return torch.atan2((4 * angle).sin(), (4 * angle).cos()).abs() / 4


def at_wall(plan: Plan) -> Found:
    """What belongs at a wall has its back to one, but for nightstands at their bed and sofas that join another."""
    wall = plan.which(lambda kind: kind.wall)
    beside = (plan.stands("head") & (plan.anchor >= 0)) | plan.stands("with")
    there = (plan.walls[3] > 0).any(1)[plan.scene]
    hung = plan.which(lambda kind: kind.support == "wall" and kind.role == "storage")
    belongs = (wall & plan.standing & ~beside) | hung
    who = plan.those(belongs & there & (plan.moved | plan.of("sofa")))
    gap = plan.back_gaps(who)
    free = plan.of("sofa")[who] & (gap >= PASSAGE)
    if bool(free.any()):
        free = free & (_deep(plan, who) | _backed(plan, who, gap.detach()))
    return found(who, torch.where(free, gap - PASSAGE, TOUCHING - gap), measure=gap, words=(gap < FAR).long())


def _deep(plan: Plan, who: Tensor) -> Tensor:
    """(P,) bool: the room is so long where boxes look that at the wall they would be far from all else."""
    front = torch.stack([plan.yaw[who].sin(), plan.yaw[who].cos()], -1)
    along = (plan.floor[plan.scene[who]] * front[:, None]).sum(-1).detach()
    there = torch.isfinite(along)
    least = torch.where(there, along, torch.inf).amin(1)
    return torch.where(there, along, -torch.inf).amax(1) - least >= DEEP


def _backed(plan: Plan, who: Tensor, gap: Tensor) -> Tensor:
    """(P,) bool: something of another group stands between a box and the wall behind it."""
    i, j = plan.pairs(plan.standing, plan.standing & plan.of("board", "storage", "bed", "seat", "sofa"))
    lateral, forward = plan.local(j, i)
    back = -forward.detach() - plan.size[i, 2] / 2
    room = torch.full((len(plan),), -1.0, dtype=plan.size.dtype).index_put((who,), gap.to(plan.size))
    behind = (back > 0) & (back < room[i]) & (lateral.abs() < plan.size[i, 0] / 2) & ~plan.kin(i, j)
    return torch.isin(who, i[behind])
