"""A bed with its nightstands, a vanity beside it and a bench at its foot."""

from __future__ import annotations

import math

from echomodel.rooms.builder import BODY, HALF_PI, Builder, Item, Size
from echomodel.rooms.tables import VANITY_SEATS, seat_at

LOW_ROOM = 3.7
GET_IN = 0.45  # metres beside a bed
BEDS = ("double_bed", "single_bed", "kids_bed")


def bed_group(room: Builder, category: str) -> Item | None:
    """A bed with its head at a wall, its nightstands at the head's sides, a bench or ottoman at its foot."""
    count = min(room.wanted.get("nightstand", 0), 2)
    style = room.style()
    size, stand = room.size(category), room.size("nightstand")
    vanity = bool(room.wanted.get("dressing_table")) and room.chance(0.5)
    if vanity:  # it takes the place of a nightstand
        count = min(count, 1)
    if category == "kids_bed":
        size = (max(size[0], 0.7), size[1], max(size[2], 1.2))
    bed: Item | None = None
    for attempt in range(40):
        # With two nightstands the group needs its whole width at the wall; a crowded room gives up one of them.
        sides = min(count, 2 if attempt < 16 else 1 if attempt < 22 else 0)
        width = size[0] + sides * (stand[0] + 0.05)
        spot = room.wall_spot(width, 0.05 if sides == 2 else 0.25, 0.2)
        if spot is None:
            continue
        wall, along = spot
        if room.chance(0.35) and wall.length > width:  # in the middle of its wall
            along = wall.length / 2 + room.rng.normal(0.0, 0.12)
        across, _ = room.floor.opposite(wall, along)
        shy = 0.85 if room.wanted.get("tv_stand") else 0.5
        if across > LOW_ROOM and attempt < 10 and room.chance(shy):  # beds stand across the room rather than along it
            continue
        if sides == 1:
            along += room.pick([-1, 1], [1, 1]) * stand[0] / 2
        x, z = wall.point(along, size[2] / 2 + room.wall_gap(category))
        bed = room.put(category, size, x, z, wall.yaw, style)
        if bed and _sides_kept_free(room, bed):
            break
        if bed:
            room.items.remove(bed)
            bed = None
    if bed is None:
        room.lost = True
        return None
    if vanity:
        _vanity(room, bed, style)
    _nightstands(room, bed, stand, count, style)
    for foot, share in (("bench", 1.0), ("ottoman", 0.75)):
        if room.wanted.get(foot) and room.chance(share):  # at the foot
            piece = room.size(foot)
            forward = size[2] / 2 + piece[2] / 2 + room.uniform(0.0, 0.15)
            turn = 0.0 if foot == "bench" else room.pick([0.0, HALF_PI, math.pi], [0.5, 0.15, 0.35])
            if room.beside(bed, foot, piece, room.rng.normal(0, 0.05), forward, turn, style):
                room.take(foot)
    return bed


def _sides_kept_free(room: Builder, bed: Item) -> bool:
    """Keep the floor free along one long side of a bed, or along both, where a person gets in."""
    sides = []
    for side in (-1, 1):
        x, z = bed.local(side * (bed.size[0] / 2 + GET_IN / 2), 0.22 * bed.size[2])
        zone = Item("", (GET_IN, BODY, 0.5 * bed.size[2]), x, 0.0, z, bed.yaw)
        if room.clear(zone):
            sides.append(zone)
    if len(sides) == 2 and (bed.size[0] < 1.4 or room.chance(0.15)):
        sides.pop(int(room.chance(0.5)))
    room.zones += [(zone, bed) for zone in sides]
    return bool(sides)


def _vanity(room: Builder, bed: Item, style: int) -> None:
    """A dressing table beside the bed's head."""
    size = room.size("dressing_table")
    for side in (1, -1) if room.chance(0.5) else (-1, 1):
        lateral = side * (bed.size[0] / 2 + size[0] / 2 + room.uniform(0.0, 0.5))
        forward = -bed.size[2] / 2 + size[2] / 2 + room.uniform(-0.05, 0.05)
        table = room.beside(bed, "dressing_table", size, lateral, forward, 0.0, style)
        if table:
            room.take("dressing_table")
            seat_at(room, table, VANITY_SEATS, style)
            return


def _nightstands(room: Builder, bed: Item, size: Size, count: int, style: int) -> None:
    if count == 0:
        return
    gap = room.uniform(-0.05, 0.04) if room.chance(0.7) else room.uniform(0.04, 0.12)
    lateral = bed.size[0] / 2 + size[0] / 2 + gap
    shift = room.uniform(-0.09, 0.05) if room.chance(0.8) else room.uniform(0.05, 0.15)
    forward = -bed.size[2] / 2 + size[2] / 2 + shift
    sides = [1, -1] if room.chance(0.5) else [-1, 1]
    placed = 0
    for side in sides:
        for shift in (0.0, 0.06):
            at = side * (lateral + shift + room.rng.normal(0.0, 0.02))
            if room.beside(bed, "nightstand", size, at, forward, 0.0, style, play=0.12):
                room.wanted["nightstand"] -= 1
                placed += 1
                break
        if placed == count:
            return
