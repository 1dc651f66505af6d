"""A set table with its chairs, a desk or dressing table with its seat."""

from __future__ import annotations

import math

from echomodel.rooms.builder import HALF_PI, Builder, Item, Size
from echomodel.rooms.sofas import SOFAS

VANITY_SEATS = ("dressing_chair", "stool", "chair", "dining_chair", "ottoman")


def dining_group(
    room: Builder, category: str = "dining_table", chairs: tuple[str, ...] = ("dining_chair", "chinese_chair", "chair"),
    *, central: bool = False, sharing: int = 1,
) -> Item | None:  # fmt: skip
    """A table with its chairs tucked in: in the open, or with one end at a wall; `sharing` tables share the chairs."""
    size = room.size(category)
    style = room.style()
    chair_kind = next((c for c in chairs if room.wanted.get(c)), None)
    count = room.wanted.get(chair_kind, 0) if chair_kind else 0
    chair = room.size(chair_kind) if chair_kind else (0.5, 0.8, 0.5)
    margin = chair[2] * 0.6 if count else 0.0
    sofa = next((item for item in room.items if item.category in SOFAS), None)
    table = None
    for attempt in range(36):
        if attempt % 2 == 0 and not (central and attempt < 6) and room.chance(0.8):
            spot = room.wall_spot(size[2] + 2 * margin, 0.1)
            if spot is None:
                continue
            wall, along = spot
            if room.chance(0.6):  # near the end of the wall, with a seat's depth between
                end = size[2] / 2 + chair[2] * 0.8 + abs(room.rng.normal(0.0, 0.35))
                along = end if room.chance(0.5) else wall.length - end
            gap = room.uniform(-0.01, 0.12) if room.chance(0.65) else room.uniform(0.12, 0.9)
            x, z = wall.point(along, size[0] / 2 + gap)
            yaw = wall.yaw + (HALF_PI if room.chance(0.5) else -HALF_PI)
        else:
            spread = 0.35 if central else 1.0
            x = room.uniform(-room.floor.half_x, room.floor.half_x) * spread
            z = room.uniform(-room.floor.half_z, room.floor.half_z) * spread
            yaw = room.pick([0.0, HALF_PI, math.pi, -HALF_PI], [1, 1, 1, 1])
        # seats and table stand side by side along the room
        if sofa is not None and attempt < 16 and not -0.6 < sofa.seen(x, z)[1] < 2.6 and room.chance(0.8):
            continue
        # The chairs' places must be free too; later tries are content with less.
        slack = margin if attempt < 26 else 0.1
        around = Item(category, (size[0], size[1], size[2] + 2 * slack + 0.1), x, 0.0, z, yaw)
        if room.free(around):
            table = room.put(category, size, x, z, yaw, style)
            if table:
                break
    if table is None:
        return None
    if chair_kind:
        count = -(-count // sharing)
        _chairs_around(room, table, chair_kind, chair, count, style if room.chance(0.8) else room.style())
    return table


def _chairs_around(room: Builder, table: Item, category: str, size: Size, count: int, style: int) -> None:
    length, depth = table.size[0], table.size[2]
    per_side = 2 if count <= 6 else min((count - 1) // 2, 4)
    if (count == 2 and room.chance(0.5)) or length < 0.95 or (count == 4 and length < 1.3 and room.chance(0.6)):
        per_side = 1
    if count == 6 and length > 1.9 and room.chance(0.6):
        per_side = 3
    while per_side > 1 and (per_side - 1) * (size[0] + 0.02) > length - 0.1:
        per_side -= 1
    tuck = room.rng.normal(0.085, 0.08)
    spacing = max(length / per_side * room.uniform(0.85, 0.97), size[0] + 0.02)
    across = depth / 2 + size[2] / 2 - tuck
    places = []
    for side in (-1, 1):
        for k in range(per_side):
            places.append(((k - (per_side - 1) / 2) * spacing, side * across, 0.0 if side < 0 else math.pi))
    if count == 2 and per_side == 2:
        places = places[:2] if room.chance(0.5) else places[2:]
    along = length / 2 + size[2] / 2 - tuck
    places += [(along, 0.0, -HALF_PI), (-along, 0.0, HALF_PI)]
    for lateral, forward, turn in places:
        if count <= 0:
            return
        lateral, forward = lateral + room.rng.normal(0, 0.015), forward + room.rng.normal(0, 0.015)
        turn += room.askew(category)
        if room.beside(table, category, size, lateral, forward, turn, style, ignore=(table,)):
            room.wanted[category] -= 1
            count -= 1


def desk_group(
    room: Builder, category: str = "desk", seats: tuple[str, ...] = ("office_chair",), yaw: float | None = None
) -> Item | None:
    """A desk or dressing table at a wall (a desk may stand free) with its chair."""
    style = room.style()
    size = room.size(category)
    desk = None
    if category == "desk" and room.chance(0.15):
        desk = room.somewhere(category, size=size, style=style, clearance=0.3)
    desk = desk or room.against_wall(category, size=size, style=style, corner=0.45, tries=20, yaw=yaw)
    desk = desk or room.against_wall(category, size=size, style=style, corner=0.45, tries=12)
    if desk is None:
        return None
    seat_at(room, desk, seats, style)
    return desk


def seat_at(room: Builder, desk: Item, seats: tuple[str, ...], style: int) -> None:
    """The first of the wanted seats before a desk or dressing table."""
    seat = next((s for s in seats if room.wanted.get(s)), None)
    if seat:
        chair = room.size(seat)
        forward = desk.size[2] / 2 + chair[2] / 2 - min(max(room.rng.normal(0.08, 0.08), -0.05), 0.25)
        lateral = min(max(room.rng.normal(0.0, 0.08), -0.2), 0.2)
        if room.beside(desk, seat, chair, lateral, forward, math.pi, style, ignore=(desk,), doors=False):
            room.wanted[seat] -= 1
