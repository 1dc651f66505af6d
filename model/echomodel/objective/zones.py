"""Rules of zones: the floor is used evenly, and what a sofa looks into belongs to its group."""

from __future__ import annotations

import math

import numpy as np
import torch
from torch import Tensor

from echomodel.floors import signed_distance
from echomodel.objective.found import Found, found, joined, nobody, worst
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
    out = nobody(plan.size)
    for scenes, area, points, walls in floor_points(plan, CELL):
        there = in_rooms(plan, scenes)
        if there.shape[1] < 2:
            continue
        limit = bare_limit(area, there.shape[1])
        inner = walls > limit
        if not bool(inner.any()):  # no circle of that size fits in
            continue
        gap, nearest = floor_gaps(plan, there, points[inner])
        radius = torch.minimum(gap, walls[inner])
        at = radius.detach().argmax(1, keepdim=True)
        most = radius.gather(1, at)[:, 0]
        out = joined(out, found(nearest.gather(1, at)[:, 0], limit - most, measure=2 * most))
    return out


def floor_points(plan: Plan, cell: float) -> list[tuple[Tensor, float, Tensor, Tensor]]:
    """For rooms of one floor each: their numbers (s,), its area, points (P, 2) on it, and their distance to walls (P,).

    Arguments:
        cell: metres between two points.
    """
    kept: dict[float, list[tuple[Tensor, float, Tensor, Tensor]]] = vars(plan.first).setdefault("floor_points", {})
    if cell not in kept:
        kept[cell] = []
        for scenes, polygon, _ in plan.first.rooms:
            x, z = polygon.T
            area = float(abs(x @ np.roll(z, -1) - z @ np.roll(x, -1)) / 2)
            low, high = polygon.min(0), polygon.max(0)
            xs, zs = (np.arange(a + cell / 2, b, cell) for a, b in zip(low, high, strict=True))
            points = plan.numbers(np.stack(np.meshgrid(xs, zs), -1).reshape(-1, 2).tolist())
            walls = signed_distance(points[None], plan.numbers(polygon.tolist())[None])[0]
            kept[cell].append((scenes, area, points[walls > 0], walls[walls > 0]))
    rooms = zip(plan.rooms, kept[cell], strict=True)
    return [(scenes, area, points, walls) for (scenes, *_), (_, area, points, walls) in rooms]


def in_rooms(plan: Plan, scenes: Tensor) -> Tensor:
    """(s, n) int64, numbers of the pieces that stand in rooms (s,) of as many pieces."""
    there = torch.isin(plan.scene, scenes) & plan.standing & (plan.size[:, 1].detach() > CLEAR_HEIGHT)
    return there.nonzero()[:, 0].reshape(len(scenes), -1)


def floor_gaps(plan: Plan, there: Tensor, points: Tensor) -> tuple[Tensor, Tensor]:
    """(s, P) and (s, P): metres from points (P, 2) to the nearest of the footprints (s, n) of each room, and which."""
    moved = plan.moved[there[0]]
    columns = [(~moved).nonzero()[:, 0], moved.nonzero()[:, 0]]
    parts = [there[:1, columns[0]], there[:, columns[1]]]  # what stands alike in all rooms is measured once
    found = [
        (*_nearest(plan, part, points), column) for part, column in zip(parts, columns, strict=True) if len(column)
    ]
    gap, which, column = found[0]
    nearest = column[which]
    for other, which, column in found[1:]:
        closer = other < gap
        gap, nearest = torch.where(closer, other, gap), torch.where(closer, column[which], nearest)
    count = len(there)
    return gap.expand(count, -1), there.gather(1, nearest.expand(count, -1))


def _nearest(plan: Plan, who: Tensor, points: Tensor) -> tuple[Tensor, Tensor]:
    position, size = plan.position[who][:, None], plan.size[who][:, None]
    away = points[:, None] - position[..., [0, 2]]
    cos, sin = plan.yaw[who].cos()[:, None], plan.yaw[who].sin()[:, None]
    lateral = ((cos * away[..., 0] - sin * away[..., 1]).abs() - size[..., 0] / 2).clamp_min(0)
    forward = ((sin * away[..., 0] + cos * away[..., 1]).abs() - size[..., 2] / 2).clamp_min(0)
    squares, which = (lateral.square() + forward.square()).min(-1)
    return squares.clamp_min(1e-12).sqrt(), which


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
