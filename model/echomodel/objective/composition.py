"""Terms of zones and composition: how whole rooms are composed, where every piece alone may be right.

Distances were measured on 300 real rooms with their furniture, unless a standard is named.
"""

from __future__ import annotations

import math

import numpy as np
import torch
from torch import Tensor

from echomodel.floors import signed_distance
from echomodel.objective.company import AROUND, BESIDE, Seats, seats_at
from echomodel.objective.plan import CLEAR_HEIGHT, FAR, Found, Plan, found, joined, nobody, worst
from echomodel.sizes import REACH, filled_area

# Radius of an empty circle, of the side of a square of each piece's share of the floor; more a square metre; at most.
BARE = (0.6, 0.01, 1.05)
AHEAD = 1.0  # metres before a sofa to other groups: 97 % of real ones have them
COVERED = 0.25  # share of its width from which on something is before it
CELL, POINTS = 0.25, 1000  # metres between two points of the floor that are looked at; in a hall so many, farther apart
NEARBY = 0.5  # metres: a point nearer to a piece is neither bare nor far from everything


def bare_limit(area: float, count: int) -> float:
    """Radius in metres from which on an empty circle is bare, in a floor of an area (square metres), so many pieces."""
    return min(BARE[0] + BARE[1] * area, BARE[2]) * math.sqrt(area / max(count, 1))


def floor_used(plan: Plan) -> Found:
    """No large part of the floor is bare while the pieces stand close elsewhere; the nearest one is told."""
    out = nobody(plan.size)
    for scenes, area, points, walls in floor_points(plan):
        there, far, gap, nearest = floor_gaps(plan, scenes, points)
        rows = int(plan.stands("row")[there[0]].sum())  # a row of units is one piece
        limit = bare_limit(area, there.shape[1] - max(rows - 1, 0))
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

    Returns (s, n) int64, the pieces. (q,) int64, numbers of the points that count: in copies of one room not those near
    to what stands alike in all. (s, q) float, metres to the nearest piece, and (s, q) int64, which that is.
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
    size = plan.size[who][:, None]
    aside, ahead = plan.seen(who[:, None], points[:, None])
    lateral = (aside.abs() - size[..., 0] / 2).clamp_min(0)
    forward = (ahead.abs() - size[..., 2] / 2).clamp_min(0)
    squares, which = (lateral.square() + forward.square()).min(-1)
    return squares.clamp_min(1e-12).sqrt(), which


def sofa_ahead(plan: Plan) -> Found:
    """What lies right before a sofa belongs to its group: no dining table, chair or desk stands there."""
    sofas = plan.of("sofa") & plan.standing & ~plan.stands("company")
    others = plan.of("board", "seat", "storage", "bed", "sofa") & plan.standing & ~plan.stands("opposite")
    i, j = plan.pairs(sofas, others, least=True)
    other = plan.group[i] != plan.group[j]
    i, j = i[other], j[other]
    return plan.nearest(i, j, plan.more_ahead(i, j, AHEAD, COVERED), AHEAD)


SERVED = 1.0  # metres: floor further from all furniture serves nothing
SOFT = 0.2  # metres on both sides of it over which a point of the floor counts in part
ELBOW = 0.55  # metres of a table's edge a seat: 96 % of real sides with two seats or more (0.6 m in DIN 68880)
FENCE = 0.03  # metres between two chairs of one side: 95 % of real ones
EASY = 0.6  # metres of edge a seat that are enough for anybody: DIN 68880
SEAT = 0.7  # metres that a side needs before it to seat somebody
BEYOND, CORNER = 0.1, 0.1  # metres that a seat may reach beyond its side of a table, and more beyond one end of it
WORKPLACE = 1.0  # metres between the middles of two who work
OPENS = 0.55  # metres before a wardrobe to a bed: a leaf of 0.5 m and who stands aside of it
FACED = 0.3  # share of a wardrobe's width from which on something is before it


def served_limit(area: float, width: Tensor, depth: Tensor) -> float:
    """Share of a floor (square metres) that may lie far from furniture of these widths and depths (n,), metres.

    The emptier a room, the more: 84 % of real rooms stay below exp(0.8 - 2 f), f being the area that the pieces fill
    (`filled_area`) over the floor's.
    """
    return min(1.0, math.exp(0.8 - 2.0 * filled_area(width.tolist(), depth.tolist()) / area))


def floor_served(plan: Plan) -> Found:
    """Furniture serves the whole floor: no more of it lies far from everything than so much furniture must leave."""
    out = nobody(plan.size)
    for scenes, area, points, _ in floor_points(plan):
        there, far, gap, nearest = floor_gaps(plan, scenes, points)
        if not len(far):
            continue
        size = plan.size[there[0]].detach()
        row = plan.stands("row")[there[0]]  # whose neighbours fill what is beside each
        share = ((gap - SERVED + SOFT) / (2 * SOFT)).clamp(0.0, 1.0).sum(1) / len(points)
        margin = served_limit(area, size[:, 0] - 2 * REACH * row, size[:, 2]) - share
        farthest = nearest.gather(1, gap.detach().argmax(1, keepdim=True))[:, 0]
        out = joined(out, found(farthest, margin, measure=100.0 * share))
    return out


def elbow_room(plan: Plan) -> Found:
    """Who sits beside others at a table has room for the elbows, and chairs stand apart."""
    seats = seats_at(plan)
    i, j = seats.i, seats.j
    one, other = seats.beside()
    keep = plan.of("seat")[i[one]] & plan.of("seat")[i[other]]
    one, other = one[keep], other[keep]
    edge = torch.where(seats.ahead, plan.size[j, 0], plan.size[j, 2]) / seats.count
    half_width, half_depth = plan.reach(i, j)
    reach = torch.where(seats.ahead, half_width, half_depth)
    gap = seats.along[other] - seats.along[one] - reach[one] - reach[other]
    margins = torch.stack([edge[one] - ELBOW, gap - FENCE], -1)
    least, which = margins.min(1)
    measure = torch.stack([edge[one], gap.clamp_min(0.0)], -1).gather(1, which[:, None])[:, 0]
    at, row = worst(j[one], least, torch.arange(len(one)), len(plan), FAR)
    who = (at < FAR).nonzero()[:, 0]
    return found(who, at[who], measure=measure[row[who]], words=which[row[who]])


def chairs_at_sides(plan: Plan) -> Found:
    """Chairs share the sides of their table: none sits shoulder to shoulder with others while a side is free."""
    seats = seats_at(plan)
    who, free = _free_sides(plan, seats)
    side = 4 * who[:, None] + torch.arange(4)
    count = torch.bincount(seats.side, minlength=4 * len(plan))[side]
    edge = plan.size[who][:, [2, 2, 0, 0]]
    each = torch.where(count > 1, edge / count.clamp_min(1), FAR)
    best = torch.where(free, edge / (count + 1), 0.0).amax(1).clamp_max(EASY)
    least = each.amin(1)
    crowded = least < FAR
    return found(who[crowded], (least - best)[crowded], measure=least[crowded])


def chairs_balanced(plan: Plan) -> Found:
    """As many sit at one side of a table as opposite, but for one where their number is odd, or no room is there."""
    seats = seats_at(plan)
    who, free = _free_sides(plan, seats)
    places = (plan.size[:, 0].detach() / ELBOW).round().clamp_min(1.0)  # a bench counts for several chairs
    count = places.new_zeros(4 * len(plan)).index_add(0, seats.side, places[seats.i]).reshape(-1, 2, 2)[who]
    fewer = count.argmin(-1, keepdim=True)
    room = free.reshape(-1, 2, 2).gather(-1, fewer) | (count.gather(-1, fewer) > 0)
    more = ((count[..., 0] - count[..., 1]).abs() * room[..., 0]).sum(-1)
    i, j = plan.attended("at", "foot")  # who stands far off, too
    total = places.new_zeros(len(plan)).index_add(0, j, places[i])[who]
    some = count.sum((1, 2)) > 2  # two may sit around a corner
    return found(who[some], (total % 2 + 0.5 - more)[some], measure=more[some])


def bench_fits(plan: Plan) -> Found:
    """A seat stands within its side of a table, a bench along one that is as long as it, with no end to it."""
    seats = seats_at(plan)
    half_width, half_depth = plan.reach(seats.i, seats.j)
    own = 2 * torch.where(seats.ahead, half_width, half_depth)
    side = torch.where(seats.ahead, plan.size[seats.j, 0], plan.size[seats.j, 2])
    beyond = (seats.along.abs() + (own - side) / 2) * ~plan.solid[seats.i]  # a stool stands anywhere
    least, which = torch.stack([own - side, plan.size[seats.i, 0] - own, beyond - CORNER], -1).max(-1)
    return found(seats.i, BEYOND - least, other=seats.j, measure=least + CORNER * (which == 2), words=which)


def _free_sides(plan: Plan, seats: Seats) -> tuple[Tensor, Tensor]:
    """(P,) int64, the tables with seats, and (P, 4) bool, whether one could sit left, right, behind and before them."""
    kept: dict[str, tuple[Tensor, Tensor]] = vars(plan)
    if "free_sides" not in kept:
        who = seats.j.unique()
        kept["free_sides"] = who, _free_beside(plan, who) > SEAT
    return kept["free_sides"]


def _free_beside(plan: Plan, who: Tensor) -> Tensor:
    """(P, 4): metres free left, right, behind and before of tables, to walls and to what is no seat."""
    right, front = plan.axes(who)
    out = torch.stack([-right, right, -front, front], 1)
    half = plan.size[who][:, [0, 0, 2, 2]] / 2
    edge = plan.position[who][:, None, [0, 2]] + out * half[..., None]
    walls = plan.inside(edge + out * SEAT, who) + SEAT
    asked = torch.zeros(len(plan), dtype=torch.bool).index_put((who,), torch.tensor(True))
    row, k = plan.beside(who, plan.standing & ~plan.of("seat") & (plan.size[:, 1].detach() > CLEAR_HEIGHT))
    j = who[row]
    keep = (k != j) & asked[j]
    row, k, j = row[keep], k[keep], j[keep]
    lateral, forward = plan.local(k, j)
    wide, deep = plan.reach(k, j)
    meets = torch.stack([forward.abs() - deep - plan.size[j, 2] / 2, lateral.abs() - wide - plan.size[j, 0] / 2], -1)
    beyond = torch.stack([-lateral - wide, lateral - wide, -forward - deep, forward - deep], -1) - half[row]
    beyond = torch.where((meets.repeat_interleave(2, -1) < 0) & (beyond > -half[row]), beyond, FAR)
    index = row[:, None].expand(-1, 4)
    return walls.scatter_reduce(0, index, beyond.to(walls), "amin")


def workers_apart(plan: Plan) -> Found:
    """Two who work at desks of their own sit apart from each other."""
    chairs, at = plan.attended("at")
    chairs = chairs[(plan.of("board") & plan.works)[at] & plan.of("seat")[chairs]]
    sits = torch.zeros(len(plan), dtype=torch.bool).index_put((chairs,), torch.tensor(True))
    row, k = plan.beside(chairs, sits)
    i = chairs[row]
    keep = (i < k) & (plan.anchor[i] != plan.anchor[k])
    i, k = i[keep], k[keep]
    apart = (plan.position[i] - plan.position[k])[:, [0, 2]].square().sum(1).clamp_min(1e-12).sqrt()
    return found(i, apart - WORKPLACE, other=k, measure=apart)


def wardrobe_opens(plan: Plan) -> Found:
    """One can stand before an open wardrobe, also at the foot of a bed, and nobody sits there."""
    wardrobes = plan.of("storage") & plan.standing & plan.which(lambda kind: kind.access > 0.6)
    i, j = plan.pairs(wardrobes, (plan.of("bed") | plan.stands("company")) & plan.standing, least=True)
    return plan.nearest(i, j, plan.more_ahead(i, j, OPENS, FACED), OPENS)


def each_served(plan: Plan) -> Found:
    """No desk or table has two chairs while another has none, no bed two nightstands while another has none."""
    out = nobody(plan.size)
    desks, chairs = plan.of("board") & plan.works & plan.standing, plan.stands("at") & plan.of("seat")
    tables = plan.which(lambda kind: kind.role == "board" and not (kind.belongs_to or kind.access or kind.wall))
    for hosts, guests, near in (
        (desks, chairs, AROUND),
        (tables & plan.standing, chairs, AROUND),
        (plan.of("bed") & plan.standing, plan.stands("head"), BESIDE),
    ):
        one, other = plan.pairs(hosts, hosts)
        if not len(one):
            continue
        i, j = plan.pairs(guests & plan.standing, hosts)
        close = plan.apart(i, j).detach() < near
        served = torch.zeros(len(plan), dtype=torch.int64).index_add(0, j[close], torch.ones_like(j[close]))
        unfair = (served[one] == 0) & (served[other] > 1)
        who = one[unfair].unique()
        about = torch.full((len(plan),), -1, dtype=torch.int64).index_put((one[unfair],), other[unfair])
        out = joined(out, found(who, torch.full_like(plan.yaw[who], -1.0), other=about[who]))
    return out
