"""Rules of zones: the floor is used evenly, and what a sofa looks into belongs to its group."""

from __future__ import annotations

import math

import numpy as np
import torch
from torch import Tensor

from echomodel.floors import signed_distance
from echomodel.objective.found import Found, found, joined, nobody
from echomodel.objective.plan import CLEAR_HEIGHT, FAR, Plan

BARE = 1.05  # radius of an empty circle, of the side of a square that is each piece's share of the floor
AHEAD = 1.0  # metres before a sofa to other groups: 97 % of real ones have them
COVERED = 0.25  # share of its width from which on something is before it
CELL, POINTS = 0.25, 1000  # metres between two points of the floor that are looked at; in a hall so many, farther apart
NEARBY = 0.5  # metres: a point nearer to a piece is neither bare nor far from everything


def bare_limit(area: float, count: int) -> float:
    """Radius in metres from which on an empty circle is bare, in a floor of an area (square metres), so many pieces."""
    return BARE * math.sqrt(area / max(count, 1))


def floor_used(plan: Plan) -> Found:
    """No large part of the floor is bare while the pieces stand close elsewhere; the nearest one is told."""
    out = nobody(plan.size)
    for scenes, area, points, walls in floor_points(plan):
        there, far, gap, nearest = floor_gaps(plan, scenes, points)
        limit = bare_limit(area, there.shape[1])
        inner = walls[far] > limit
        if not bool(inner.any()):  # no circle of that size fits in
            continue
        nearest, radius = nearest[:, inner], torch.minimum(gap[:, inner], walls[far[inner]])
        at = radius.detach().argmax(1, keepdim=True)
        most = radius.gather(1, at)[:, 0]
        out = joined(out, found(nearest.gather(1, at)[:, 0], limit - most, measure=2 * most))
    return out


def floor_points(plan: Plan) -> list[tuple[Tensor, float, Tensor, Tensor]]:
    """For rooms of one floor: their numbers (s,), its area, points (P, 2) on it, and their distance to walls (P,)."""
    kept: list[tuple[Tensor, float, Tensor, Tensor]] = vars(plan.first).setdefault("floor_points", [])
    if not kept:
        for scenes, polygon, _ in plan.first.rooms:
            x, z = polygon.T
            area = float(abs(x @ np.roll(z, -1) - z @ np.roll(x, -1)) / 2)
            low, high = polygon.min(0), polygon.max(0)
            cell = max(CELL, math.sqrt(float(np.prod(high - low)) / POINTS))
            xs, zs = (np.arange(a + cell / 2, b, cell) for a, b in zip(low, high, strict=True))
            points = plan.numbers(np.stack(np.meshgrid(xs, zs), -1).reshape(-1, 2).tolist())
            walls = signed_distance(points[None], plan.numbers(polygon.tolist())[None])[0]
            kept.append((scenes, area, points[walls > 0], walls[walls > 0]))
    rooms = zip(plan.rooms, kept, strict=True)
    return [(scenes, area, points, walls) for (scenes, *_), (_, area, points, walls) in rooms]


def in_rooms(plan: Plan, scenes: Tensor) -> Tensor:
    """(s, n) int64, numbers of the pieces that stand in rooms (s,) of as many pieces."""
    there = torch.isin(plan.scene, scenes) & plan.standing & (plan.size[:, 1].detach() > CLEAR_HEIGHT)
    return plan.those(there).reshape(len(scenes), -1)


def floor_gaps(plan: Plan, scenes: Tensor, points: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """How far points (P, 2) lie from the pieces of rooms (s,) of one floor.

    Returns:
        (s, n) int64, the pieces. (q,) int64, numbers of the points that count: in copies of one room not those near to
        what stands alike in all. (s, q) float, metres to the nearest piece, and (s, q) int64, which that is.
    """
    kept: dict[int, tuple[Tensor, Tensor, Tensor, Tensor]] = vars(plan).setdefault("floor_gaps", {})
    asked = int(scenes[0])
    if asked not in kept:
        kept[asked] = _floor_gaps(plan, in_rooms(plan, scenes), points)
    return kept[asked]


def _floor_gaps(plan: Plan, there: Tensor, points: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    count, far = len(there), torch.arange(len(points))
    if there.shape[1] < 2:
        return there, far[:0], points[:0], far[:0]
    moved = plan.moved[there[0]]
    still, moved = (~moved).nonzero()[:, 0], moved.nonzero()[:, 0]
    if not len(still):
        gap, which = _nearest(plan, there, points)
        return there, far, gap, there.gather(1, which)
    gap, which = _nearest(plan, there[:1, still], points)
    far = (gap[0] > NEARBY).nonzero()[:, 0]
    gap, nearest = gap[:, far].expand(count, -1), still[which[:, far]].expand(count, -1)
    if len(moved):
        other, which = _nearest(plan, there[:, moved], points[far])
        closer = other < gap
        gap, nearest = torch.where(closer, other, gap), torch.where(closer, moved[which], nearest)
    return there, far, gap, there.gather(1, nearest)


def _nearest(plan: Plan, who: Tensor, points: Tensor) -> tuple[Tensor, Tensor]:
    position, size = plan.position[who][:, None], plan.size[who][:, None]
    away = points[:, None] - position[..., [0, 2]]
    cos, sin = plan.turn[0][who][:, None], plan.turn[1][who][:, None]
    lateral = ((cos * away[..., 0] - sin * away[..., 1]).abs() - size[..., 0] / 2).clamp_min(0)
    forward = ((sin * away[..., 0] + cos * away[..., 1]).abs() - size[..., 2] / 2).clamp_min(0)
    squares, which = (lateral.square() + forward.square()).min(-1)
    return squares.clamp_min(1e-12).sqrt(), which


def sofa_ahead(plan: Plan) -> Found:
    """What lies right before a sofa belongs to its group: no dining table, chair or desk stands there."""
    sofas = plan.of("sofa") & plan.standing & ~plan.stands("company")
    others = plan.of("board", "seat", "storage", "bed", "sofa") & plan.standing & ~plan.stands("opposite")
    i, j = plan.pairs(sofas, others, least=True)
    other = plan.group[i] != plan.group[j]
    i, j = i[other], j[other]
    clear, covered, forward = plan.ahead(i, j)
    margin = torch.maximum(torch.maximum(clear - AHEAD, COVERED * plan.size[i, 0] - covered), -forward)
    least, about = plan.worst(i, margin, j)
    who = (least < FAR).nonzero()[:, 0]
    return found(who, least[who], other=about[who], measure=(least[who] + AHEAD).clamp_min(0.0))
