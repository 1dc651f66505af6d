"""Rules of free space: groups keep apart, chairs can be pulled out, knees have room, beds are walked round."""

from __future__ import annotations

import torch
from torch import Tensor

from echomodel.floors import known, signed_distance
from echomodel.objective.found import Found, found, joined, nobody, worst
from echomodel.objective.plan import FAR, Plan

# Metres between pieces of different groups, by role: the 2nd to 3rd percentile in real rooms.
APART = {
    ("sofa", "board"): 0.2, ("sofa", "seat"): 0.12, ("board", "board"): 0.1, ("board", "seat"): 0.05,
    ("seat", "seat"): 0.06, ("seat", "storage"): 0.12, ("bed", "seat"): 0.05, ("bed", "sofa"): 0.12,
    ("bed", "bed"): 0.15,
}  # fmt: skip
PULL, PULL_WALL = 0.22, 0.1  # metres behind a chair at a table, before furniture and before a wall
DESK, DESK_WALL = 0.33, 0.19  # the same at a desk, where one works
SQUEEZED, SPARE = 0.17, 0.6  # metres behind chairs of one side, and how much more behind those opposite is to spare
ALONGSIDE = 0.7  # metres: chairs further from their table are not at it
KNEES, KNEES_WALL = 0.4, 0.6  # metres before a sofa or armchair, before furniture of other groups and before a wall
ROOM = 0.25  # metres before a seat to its own group's lamps and other seats
TOUCHED = 0.08  # metres between a coffee table and a second sofa or an ottoman: 95 % of real ottomans keep 0.12
FOOT = 0.35  # metres between the foot of a bed and furniture: one passes sideways
LAMP, AT_BED = 0.6, 0.35  # metres before a front that lamps and plants keep free, before a nightstand's
MET = 0.25  # share of a width from which on something is before it
EDGE = 0.06  # the same for lamps and plants, which are narrow


def groups_apart(plan: Plan) -> Found:
    """Pieces of different groups leave a gap: a table does not touch a sofa, nor a chair the next bed."""
    roles = sorted({role for pair in APART for role in pair})
    massive = plan.of(*roles) & plan.standing
    i, j = plan.pairs(massive, massive)
    table = plan.numbers([[APART.get((a, b), APART.get((b, a), 0.0)) for b in roles] for a in roles])
    number = plan.column(lambda kind: roles.index(kind.role) if kind.role in roles else 0).long()
    wanted = table[number[i], number[j]]
    other = ~plan.kin(i, j)
    smaller = plan.size[i].detach().prod(1) < plan.size[j].detach().prod(1)
    ordered = smaller | ((plan.size[i].detach().prod(1) == plan.size[j].detach().prod(1)) & (i > j))
    keep = other & ordered & (wanted > 0) & ~_side_by_side(plan, i, j)
    i, j, wanted = i[keep], j[keep], wanted[keep]
    gap = plan.apart(i, j)
    least, about = worst(i, gap - wanted, j, len(plan), FAR)
    who = i.unique()
    return found(who, least[who], other=about[who], measure=_gap_to(plan, who, about[who]))


def _side_by_side(plan: Plan, i: Tensor, j: Tensor) -> Tensor:
    """(P,) bool: desks and the like in one row, looking the same way."""
    lateral, _ = plan.local(i, j)
    half_width, _ = plan.reach(i, j)
    row = lateral.abs() - half_width - plan.size[j, 0] / 2 > -0.05
    return (row & ((plan.yaw[i] - plan.yaw[j]).cos() > 0.97) & plan.of("board")[i] & plan.of("board")[j]).detach()


def _gap_to(plan: Plan, i: Tensor, j: Tensor) -> Tensor:
    return plan.apart(i, j).clamp_min(0.0)


def chair_pulls_out(plan: Plan) -> Found:
    """A chair can be moved back from its table or desk."""
    i, j = plan.attended("at")
    if not len(i):
        return nobody(plan.size)
    near = plan.apart(i, j).detach() < 0.5
    who = i[near & ~plan.which(lambda kind: kind.solid)[i]]
    block = plan.of("board", "bed", "storage", "sofa") & plan.standing
    works = plan.which(lambda kind: kind.access > 0)[plan.anchor.clamp_min(0)]
    needed = PULL + (DESK - PULL) * works.to(plan.size)
    wall = PULL_WALL + (DESK_WALL - PULL_WALL) * works.to(plan.size)
    return _clear(plan, who, block, needed, wall, behind=True)


def table_amid(plan: Plan) -> Found:
    """A table is not shoved to one side: chairs are not squeezed where those opposite have room to spare."""
    i, j = plan.attended("at", "foot")
    tables = plan.which(lambda kind: kind.role == "board" and not (kind.access or kind.wall))
    keep = tables[j] & (plan.apart(i, j).detach() < ALONGSIDE)
    i, j = i[keep], j[keep]
    lateral, forward = plan.local(i, j)
    half = plan.size[j][:, [0, 2]].detach() / 2
    ahead = forward.detach().abs() - half[:, 1] > lateral.detach().abs() - half[:, 0]
    behind, about = _room_behind(plan, i, j, ahead, torch.where(ahead, forward, lateral).detach().sign())
    side = 4 * j + 2 * ahead + (torch.where(ahead, forward, lateral) > 0)
    least, which = worst(side, behind, about, 4 * len(plan), FAR)
    asked = side.unique()
    asked = asked[torch.isin(asked ^ 1, asked)]  # chairs sit opposite
    asked = asked[known(plan.floor)[plan.scene[asked // 4]]]
    margin = torch.maximum(least[asked] - SQUEEZED, SPARE - least[asked ^ 1] + least[asked])
    at, other = worst(asked // 4, margin, asked, len(plan), FAR)
    who = (asked // 4).unique()
    return found(who, at[who], other=which[other[who]], measure=least[other[who]].clamp_min(0.0))


def _room_behind(plan: Plan, i: Tensor, j: Tensor, ahead: Tensor, sign: Tensor) -> tuple[Tensor, Tensor]:
    """(P,) and (P,): metres from chairs i away from their tables j to furniture or a wall, and which, -1 = a wall.

    Arguments:
        ahead: (P,) bool, chairs at the front or back of the table, the others at its sides. sign: (P,) float, which.
    """
    axis = torch.where(ahead, plan.yaw[j], plan.yaw[j] + torch.pi / 2)
    way = torch.stack([axis.sin(), axis.cos()], -1) * sign[:, None]
    across = torch.stack([way[:, 1], -way[:, 0]], -1)

    def half(k: Tensor, along: Tensor) -> Tensor:
        side = torch.stack([plan.yaw[k].cos(), -plan.yaw[k].sin()], -1)
        front = torch.stack([plan.yaw[k].sin(), plan.yaw[k].cos()], -1)
        return ((side * along).sum(-1).abs() * plan.size[k, 0] + (front * along).sum(-1).abs() * plan.size[k, 2]) / 2

    block = plan.of("board", "bed", "storage", "sofa") & plan.standing
    row, k = ((plan.scene[i][:, None] == plan.scene[None]) & block[None]).nonzero(as_tuple=True)
    keep = k != j[row]
    row, k = row[keep], k[keep]
    away = (plan.position[k] - plan.position[i[row]])[:, [0, 2]]
    gap = (away * way[row]).sum(-1) - half(k, way[row]) - half(i[row], way[row])
    covered = half(k, across[row]) + half(i[row], across[row]) - (away * across[row]).sum(-1).abs()
    met = (covered > MET * plan.size[i[row], 0]) & ((away * way[row]).sum(-1) > 0)
    least, about = worst(row, torch.where(met, gap, FAR), k, len(i), FAR)
    start, along, normal, length = (of[plan.scene[i]] for of in plan.walls)
    back = plan.position[i][:, [0, 2]] + way * half(i, way)[:, None]
    towards = -(normal * way[:, None]).sum(-1)
    reach = ((back[:, None] - start) * normal).sum(-1) / towards.clamp_min(1e-3)
    at = ((back[:, None] + reach[..., None] * way[:, None] - start) * along).sum(-1)
    hit = (length > 0) & (towards > 1e-3) & (at > -1e-3) & (at < length + 1e-3) & (reach > -0.3)
    wall = torch.where(hit, reach, FAR).amin(1)
    return torch.minimum(least, wall), torch.where(wall < least, -1, about)


def knees_free(plan: Plan) -> Found:
    """Who sits on a sofa or in an armchair has room for the knees, and does not look at a wall."""
    seats = (plan.of("sofa") | plan.stands("company")) & plan.standing
    return _clear(plan, seats.nonzero()[:, 0], plan.standing & ~plan.movable, KNEES, KNEES_WALL)


def bed_foot_free(plan: Plan) -> Found:
    """One passes between the foot of a bed and what stands opposite."""
    beds = (plan.of("bed") & plan.standing).nonzero()[:, 0]
    return _clear(plan, beds, plan.standing & plan.of("storage", "board", "sofa", "seat", "bed"), FOOT, -FAR)


def lamp_aside(plan: Plan) -> Found:
    """Lamps and plants do not stand before shelves, cupboards and drawers."""
    fronts = plan.of("storage") & plan.standing & plan.which(lambda kind: kind.access > 0)
    i, j = plan.pairs(plan.of("light", "decor") & plan.standing, fronts)
    if not len(i):
        return nobody(plan.size)
    lateral, forward = plan.local(i, j)
    half_width, half_depth = plan.reach(i, j)
    clear = forward - half_depth - plan.size[j, 2] / 2
    covered = torch.minimum(2 * half_width, plan.size[j, 0] / 2 + half_width - lateral.abs())
    free = torch.where(plan.stands("head")[j], AT_BED, LAMP).to(plan.size)
    margin = torch.maximum(torch.maximum(clear - free, EDGE * plan.size[j, 0] - covered), -forward)
    least, about = worst(i, margin, j, len(plan), FAR)
    who = i.unique()
    least, about = least[who], about[who]
    return found(who, least, other=about, measure=least + torch.where(plan.stands("head")[about], AT_BED, LAMP))


def seat_room(plan: Plan) -> Found:
    """One can sit down in a group, too: nothing but its table stands close before a sofa or armchair."""
    seats = ((plan.of("sofa") | plan.stands("company")) & plan.standing).nonzero()[:, 0]
    block = (plan.of("sofa", "light", "decor", "storage", "bed") | plan.stands("company", "beside")) & plan.standing
    found_one = _clear(plan, seats, block, ROOM, -FAR, kin=True)
    tables = plan.stands("before") & plan.standing  # which a second sofa or an ottoman does not touch
    i, j = plan.pairs((plan.stands("with") | (plan.stands("foot") & plan.of("seat"))) & plan.standing, tables)
    least, about = worst(i, plan.apart(i, j) - TOUCHED, j, len(plan), FAR)
    who = i.unique()
    who = who[(least[who] < 0) & ~torch.isin(who, found_one.who[found_one.margin < 0])]
    touched = found(who, least[who], other=about[who], measure=(least[who] + TOUCHED).clamp_min(0.0))
    return joined(found_one, touched)


def _clear(
    plan: Plan, who: Tensor, block: Tensor, needed: float | Tensor, needed_wall: float | Tensor, *,
    behind: bool = False, kin: bool = False,
) -> Found:  # fmt: skip
    """How much more than is needed is free before (or behind) some boxes, to other groups' pieces (or their own)."""
    if not len(who):
        return nobody(plan.size)
    sign = -1.0 if behind else 1.0
    needed, needed_wall = (torch.zeros_like(plan.yaw) + value for value in (needed, needed_wall))
    mask = torch.zeros(len(plan), dtype=torch.bool)
    mask[who] = True
    i, j = plan.pairs(mask, block)
    other = plan.kin(i, j) == kin
    i, j = i[other], j[other]
    lateral, forward = plan.local(j, i)
    half_width, half_depth = plan.reach(j, i)
    clear = sign * forward - half_depth - plan.size[i, 2] / 2
    covered = torch.minimum(plan.size[i, 0], plan.size[i, 0] / 2 + half_width - lateral.abs())
    beyond = plan.size[i, 2] / 4 - sign * forward  # beside it, or on its other side
    margin = torch.maximum(torch.maximum(clear - needed[i], MET * plan.size[i, 0] - covered), beyond)
    least, about = worst(i, margin, j, len(plan), FAR)
    needed, needed_wall = needed[who], needed_wall[who]
    front = torch.stack([plan.yaw[who].sin(), plan.yaw[who].cos()], -1) * sign
    points = plan.position[who][:, [0, 2]] + front * (plan.size[who, 2] / 2 + needed_wall.clamp_min(0.0))[:, None]
    floor = plan.floor[plan.scene[who]]
    wall = signed_distance(points[:, None], floor)[:, 0]
    wall = torch.where(known(floor) & (needed_wall > 0), wall, torch.full_like(wall, FAR))
    by_wall = wall < least[who]
    return found(
        who, torch.minimum(least[who], wall), other=torch.where(by_wall, -1, about[who]),
        measure=torch.where(by_wall, wall + needed_wall, least[who] + needed).clamp_min(0.0),
    )  # fmt: skip
