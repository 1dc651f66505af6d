"""Rules of zones: the floor is used evenly, and what a sofa looks into belongs to its group."""

from __future__ import annotations

import math

import numpy as np
import torch

from echomodel.floors import signed_distance
from echomodel.objective.found import Found, found, nobody, worst
from echomodel.objective.plan import CLEAR_HEIGHT, FAR, Plan

BARE = 1.05  # radius of an empty circle, of the side of a square that is each piece's share of the floor
AHEAD = 1.0  # metres before a sofa to other groups: 97 % of real ones have them
COVERED = 0.25  # share of its width from which on something is before it
CELL = 0.2  # metres between two points of the floor that are looked at


def bare_limit(area: float, count: int) -> float:
    """Radius in metres from which on an empty circle is bare, in a floor of an area (square metres), so many pieces."""
    return BARE * math.sqrt(area / max(count, 1))


def floor_used(plan: Plan) -> Found:
    """No large part of the floor is bare while the pieces stand close elsewhere; the nearest one is told."""
    who, margin, measure = [], [], []
    for scene in range(len(plan.floor)):
        corners = plan.floor[scene][torch.isfinite(plan.floor[scene]).all(1)]
        there = ((plan.scene == scene) & plan.standing & (plan.size[:, 1].detach() > CLEAR_HEIGHT)).nonzero()[:, 0]
        if len(corners) < 3 or len(there) < 2:
            continue
        polygon = corners.detach().cpu().numpy()
        x, z = polygon.T
        limit = bare_limit(float(abs(x @ np.roll(z, -1) - z @ np.roll(x, -1)) / 2), len(there))
        low, high = polygon.min(0), polygon.max(0)
        if limit >= min(high - low) / 2:  # no circle of that size fits in
            continue
        xs, zs = (np.arange(a + CELL / 2, b, CELL) for a, b in zip(low, high, strict=True))
        points = plan.numbers(np.stack(np.meshgrid(xs, zs), -1).reshape(-1, 2).tolist())
        walls = _inside(points, corners)
        points, walls = points[walls > limit], walls[walls > limit]
        if not len(points):
            continue
        gap = _gaps(plan, there, points)
        radius = torch.minimum(gap.amin(1), walls).detach()
        at = int(radius.argmax())
        nearest = gap[at].min(0)
        who.append(there[nearest.indices])
        margin.append(limit - torch.minimum(nearest.values, walls[at]))
        measure.append(2 * radius[at])
    if not who:
        return nobody(plan.size)
    return found(torch.stack(who), torch.stack(margin), measure=torch.stack(measure))


def sofa_ahead(plan: Plan) -> Found:
    """What lies right before a sofa belongs to its group: no dining table, chair or desk stands there."""
    sofas = plan.of("sofa") & plan.standing & ~plan.stands("company")
    others = plan.of("board", "seat", "storage", "bed", "sofa") & plan.standing & ~plan.stands("opposite")
    i, j = plan.pairs(sofas, others)
    other = plan.group[i] != plan.group[j]
    i, j = i[other], j[other]
    lateral, forward = plan.local(j, i)
    half_width, half_depth = plan.reach(j, i)
    clear = forward - half_depth - plan.size[i, 2] / 2
    covered = torch.minimum(plan.size[i, 0], plan.size[i, 0] / 2 + half_width - lateral.abs())
    margin = torch.maximum(torch.maximum(clear - AHEAD, COVERED * plan.size[i, 0] - covered), -forward)
    least, about = worst(i, margin, j, len(plan), FAR)
    who = sofas.nonzero()[:, 0]
    return found(who, least[who], other=about[who], measure=(least[who] + AHEAD).clamp_min(0.0))


def _inside(points: torch.Tensor, corners: torch.Tensor) -> torch.Tensor:
    """(P,): metres that points lie inside a floor, negative outside."""
    return signed_distance(points[None], corners[None])[0]


def _gaps(plan: Plan, who: torch.Tensor, points: torch.Tensor) -> torch.Tensor:
    """(P, n): metres from points (P, 2) to the footprints of some boxes (n,)."""
    away = points[:, None] - plan.position[who][:, [0, 2]]
    cos, sin = plan.yaw[who].cos(), plan.yaw[who].sin()
    lateral = (cos * away[..., 0] - sin * away[..., 1]).abs() - plan.size[who, 0] / 2
    forward = (sin * away[..., 0] + cos * away[..., 1]).abs() - plan.size[who, 2] / 2
    return (lateral.clamp_min(0).square() + forward.clamp_min(0).square()).clamp_min(1e-12).sqrt()
