"""Terms of physics: nothing runs into anything, leaves the room, or hangs in the air."""

from __future__ import annotations

import torch
from torch import Tensor

from echomodel.floors import SIDES, edges, known, signed_area, signed_distance
from echomodel.objective.found import Found, found, nobody
from echomodel.objective.plan import FAR, Plan
from echomodel.objective.support import ON_CEILING, ON_FLOOR

TOUCH = 0.01  # metres that two boxes, a box and a wall, a box and its carrier may be off


def apart(plan: Plan) -> Found:
    """No two pieces run into each other, but for what belongs together: a chair is pushed under its own table."""
    i, j, allowed = plan.couples
    if not len(i):
        return nobody(plan.size)
    rise = torch.maximum(
        plan.position[j, 1] - plan.position[i, 1] - plan.size[i, 1],
        plan.position[i, 1] - plan.position[j, 1] - plan.size[j, 1],
    )
    depth = -torch.maximum(plan.apart(i, j), rise)
    return found(i, TOUCH + allowed - depth, other=j, measure=depth)


def on_floor(plan: Plan) -> Found:
    """Every piece lies within the walls."""
    who = (known(plan.floor)[plan.scene] & plan.moved).nonzero()[:, 0]
    if not len(who):
        return nobody(plan.size)
    floor = plan.floor[plan.scene[who]]
    signs = plan.numbers(SIDES)
    half = plan.size[who][:, None, [0, 2]] / 2 * signs
    cos, sin = plan.yaw[who, None].cos(), plan.yaw[who, None].sin()
    x, z = cos * half[..., 0] + sin * half[..., 1], cos * half[..., 1] - sin * half[..., 0]
    points = torch.stack([x, z], -1) + plan.position[who][:, None, [0, 2]]
    inside = signed_distance(points, floor).amin(1)
    return found(who, torch.minimum(inside, _off_corners(plan, who)) + TOUCH, measure=-inside)


def _off_corners(plan: Plan, who: Tensor) -> Tensor:
    """(P,): metres between boxes and the corners that look into their room, negative inside; `FAR` where none does."""
    start, end = edges(plan.floor)
    along = end - start
    before = along.roll(1, 1)
    turn = (before[..., 0] * along[..., 1] - before[..., 1] * along[..., 0]) * signed_area(plan.floor)[:, None]
    reflex = (turn < -1e-6).any(0)
    if not bool(reflex.any()):
        return plan.size.new_full((len(who),), FAR)
    looks = (turn < -1e-6)[plan.scene[who]][:, reflex]
    off = start[plan.scene[who]][:, reflex] - plan.position[who][:, None, [0, 2]]
    cos, sin = plan.yaw[who, None].cos(), plan.yaw[who, None].sin()
    local = torch.stack([cos * off[..., 0] - sin * off[..., 1], sin * off[..., 0] + cos * off[..., 1]], -1)
    outside = (local.abs() - plan.size[who][:, None, [0, 2]] / 2).amax(-1)
    return torch.where(looks, outside, FAR).amin(1)


def rests(plan: Plan) -> Found:
    """Furniture stands on the floor or on its carrier, with its middle over it, and what hangs hangs at the ceiling."""
    carried = plan.carrier >= 0
    on = plan.carrier.clamp_min(0)
    bottom, top = plan.position[:, 1], plan.position[on, 1] + plan.size[on, 1]
    ceiling = plan.ceiling - plan.size[:, 1]
    air = torch.where(carried, bottom - top, torch.where(plan.carrier == ON_CEILING, ceiling - bottom, bottom))
    free = ~(carried | (plan.carrier == ON_FLOOR) | ((plan.carrier == ON_CEILING) & torch.isfinite(ceiling)))
    margin = TOUCH - torch.where(free, torch.zeros_like(air), air).abs()
    i = carried.nonzero()[:, 0]
    lateral, forward = plan.local(i, on[i])
    half = plan.size[on[i]][:, [0, 2]] / 2
    over = torch.minimum(half[:, 0] - lateral.abs(), half[:, 1] - forward.abs())
    beside = torch.full_like(margin, FAR).index_put((i,), over)
    who = torch.arange(len(plan))
    return found(
        who, torch.minimum(margin, beside), other=plan.carrier.clamp_min(-1), measure=torch.where(free, 0.0, air),
        words=(beside < margin).long(),
    )  # fmt: skip


def in_height(plan: Plan) -> Found:
    """Nothing lies below the floor or reaches through the ceiling."""
    ceiling = plan.ceiling
    low, high = plan.position[:, 1], ceiling - plan.position[:, 1] - plan.size[:, 1]
    margin = TOUCH + torch.minimum(low, torch.where(torch.isfinite(ceiling), high, FAR))
    return found(torch.arange(len(plan)), margin, measure=TOUCH - margin, words=(high < low).long())
