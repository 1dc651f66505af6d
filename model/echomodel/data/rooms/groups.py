"""Functional groups: a bed with its nightstands, a sofa with its table, chairs and television, a set table, a desk."""

from __future__ import annotations

import math

from echomodel.data.rooms.builder import BODY, HALF_PI, Builder, Item, Size

SOFAS = ("multi_seat_sofa", "l_shaped_sofa", "loveseat_sofa", "sofa", "chaise_longue_sofa", "lazy_sofa")
VANITY_SEATS = ("dressing_chair", "stool", "chair", "dining_chair", "ottoman")
LOW_ROOM = 3.7
GET_IN = 0.45  # metres beside a bed
BEDS = ("double_bed", "single_bed", "kids_bed")


def bed_group(room: Builder, category: str) -> Item | None:
    """A bed with its head at a wall, its nightstands at the head's sides, a bench or ottoman at its foot."""
    count = room.take("nightstand")
    style = room.style()
    size, stand = room.size(category), room.size("nightstand")
    vanity = bool(room.wanted.get("dressing_table")) and room.chance(0.5)
    if vanity:  # it takes the place of a nightstand
        count = min(count, 1)
    if category == "kids_bed":
        size = (max(size[0], 0.7), size[1], max(size[2], 1.2))
    bed: Item | None = None
    for attempt in range(30):
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
        x, z = wall.point(along, size[2] / 2 + room.wall_gap())
        bed = room.put(category, size, x, z, wall.yaw, style, doors=attempt < 24)
        if bed and (_sides_kept_free(room, bed) or attempt > 24):
            break
        if bed:
            room.items.remove(bed)
            bed = None
    if bed is None:
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
    shift = room.uniform(-0.06, 0.04) if room.chance(0.85) else room.uniform(0.04, 0.12)
    forward = -bed.size[2] / 2 + size[2] / 2 + shift
    sides = [1, -1] if room.chance(0.5) else [-1, 1]
    placed = 0
    for side in sides:
        for shift in (0.0, 0.06):
            at = side * (lateral + shift + room.rng.normal(0.0, 0.02))
            if room.beside(bed, "nightstand", size, at, forward, 0.0, style, play=0.12):
                placed += 1
                break
        if placed == count:
            return


def television(room: Builder, anchor: Item, nearest: float = 0.3, farthest: float = 9.0) -> Item | None:
    """A tv stand at the wall that the anchor (a bed or sofa) faces, `nearest` to `farthest` metres off."""
    size = room.size("tv_stand")
    style = room.style()
    x, z = anchor.x, anchor.z
    for wall in room.floor.walls:
        if math.cos(wall.yaw - anchor.yaw) > -0.5:
            continue
        nx, nz = math.sin(wall.yaw), math.cos(wall.yaw)
        distance = (x - wall.x) * nx + (z - wall.z) * nz
        along = (x - wall.x) * wall.dx + (z - wall.z) * wall.dz
        fits = anchor.size[2] / 2 + size[2] + nearest <= distance <= farthest
        if not fits or not 0.0 < along < wall.length:
            continue
        for attempt in range(6):
            spread = 0.1 if attempt == 0 else 0.15 * attempt
            place = along + room.rng.normal(0.0, spread)
            place = min(max(place, size[0] / 2), max(wall.length - size[0] / 2, size[0] / 2))
            px, pz = wall.point(place, size[2] / 2 + abs(room.rng.normal(0.02, 0.025)))
            placed = room.put("tv_stand", size, px, pz, wall.yaw, style)
            if placed:
                return placed
        size = (size[0] * 0.85, size[1], size[2])
    return None


def sofa_group(room: Builder, category: str) -> Item | None:
    """A sofa, its coffee table, a television opposite, armchairs and side tables around."""
    style = room.style()
    size = room.size(category)
    wants_tv = room.wanted.get("tv_stand", 0) > 0
    sofa = None
    sides = 0.4 if any(room.wanted.get(table) for table in ("side_table", "round_end_table", "floor_lamp")) else 0.15
    pulled = room.chance(0.2)
    for attempt in range(30):
        spot = room.wall_spot(size[0], 0.3 if category == "l_shaped_sofa" else 0.02, sides if attempt < 20 else 0.0)
        if spot is None:
            break
        wall, along = spot
        spare = wall.length - size[0]
        if spare > 2.5 and attempt < 20 and room.chance(0.6):  # towards one end of a long wall, with room for a seat
            end = 0.3 + abs(room.rng.normal(0.0, 0.9))
            along = size[0] / 2 + (min(end, spare) if room.chance(0.5) else max(spare - end, 0.0))
        distance, _ = room.floor.opposite(wall, along)
        gap = room.wall_gap()
        low, high = (2.8, 4.3) if wants_tv else (2.0, 5.5)
        if attempt < 14 and not (low < distance < high):
            continue
        if attempt < 22 and distance < (2.6 if wants_tv else 1.8):
            continue
        if wants_tv and distance > 4.8 and pulled:  # then the sofa comes towards its television
            gap = max(min(distance - size[2] / 2 - room.uniform(2.9, 3.5), distance - 3.0), gap)
        x, z = wall.point(along, size[2] / 2 + gap)
        sofa = room.put(category, size, x, z, wall.yaw, style)
        if sofa:
            break
    if sofa is None:
        sofa = room.somewhere(category, size=size, style=style)
    if sofa is None:
        return None
    if room.wanted.get("tv_stand") and television(room, sofa, nearest=1.0, farthest=9.0 if room.chance(0.2) else 4.4):
        room.take("tv_stand")
    table = _coffee_table(room, sofa, style)
    _second_sofa(room, sofa, table)
    _seats(room, sofa, table, style)
    _side_tables(room, sofa, style)
    return sofa


def _coffee_table(room: Builder, sofa: Item, style: int) -> Item | None:
    count = room.take("coffee_table")
    if not count:
        return None
    size = room.size("coffee_table")
    inner = 0.0
    if sofa.category == "l_shaped_sofa":
        # The hull of an L holds its empty inside; the table stands partly in it.
        inner = sofa.size[2] * room.uniform(0.1, 0.4)
    turn = room.pick([0.0, math.pi, HALF_PI, -HALF_PI], [0.6, 0.24, 0.09, 0.07])
    depth = size[2] if abs(math.cos(turn)) > 0.5 else size[0]
    for attempt in range(8):
        gap = min(max(0.38 + room.rng.normal(0.0, 0.06), 0.3), 0.5) - inner
        lateral = min(max(room.rng.normal(0.0, 0.08), -0.2), 0.2)
        if inner:
            lateral += room.pick([-1, 1], [1, 1]) * sofa.size[0] * 0.12
        forward = sofa.size[2] / 2 + depth / 2 + gap
        placed = room.beside(sofa, "coffee_table", size, lateral, forward, turn, style, play=0.02,
                             ignore=(sofa,) if inner else ())  # fmt: skip
        if placed:
            if count > 1:
                second = (size[0] * 0.75, size[1] * 0.85, size[2] * 0.75)
                room.beside(placed, "coffee_table", second, placed.size[0] * 0.6, room.uniform(-0.3, 0.3), 0.0, style,
                            ignore=(placed,))  # fmt: skip
            return placed
    return None


def _second_sofa(room: Builder, sofa: Item, table: Item | None) -> None:
    for category in SOFAS:
        if not room.wanted.get(category):
            continue
        room.take(category)
        size = room.size(category)
        centre = table or sofa
        for side in (1, -1) if room.chance(0.5) else (-1, 1):
            lateral = side * (sofa.size[0] / 2 + size[2] / 2 + room.uniform(0.0, 0.4))
            forward = (0.0 if table else sofa.size[2] / 2 + size[0] / 2) + room.rng.normal(0.0, 0.1)
            if table:
                lateral = side * (centre.hull_x + size[2] / 2 + room.uniform(0.25, 0.6))
                dx, dz = table.x - sofa.x, table.z - sofa.z
                forward += math.sin(sofa.yaw) * dx + math.cos(sofa.yaw) * dz
                lateral = side * max(abs(lateral), sofa.size[0] / 2 + size[2] / 2 - 0.2)
            if room.beside(sofa, category, size, lateral, forward, -side * HALF_PI, sofa.style):
                break


def _seats(room: Builder, sofa: Item, table: Item | None, style: int) -> None:
    """Armchairs, lounge chairs and ottomans around the coffee table, turned towards it."""
    forward_table = sofa.size[2] / 2 + 0.8
    reach = 0.6
    if table:
        dx, dz = table.x - sofa.x, table.z - sofa.z
        forward_table = math.sin(sofa.yaw) * dx + math.cos(sofa.yaw) * dz
        reach = (table.size[0] if abs(math.cos(table.yaw - sofa.yaw)) > 0.5 else table.size[2]) / 2
    for category in ("armchair", "lounge_chair", "ottoman", "stool"):
        count = room.wanted.get(category, 0)
        if not count or not room.chance(0.85):
            continue
        size = room.size(category)
        askew = room.chance({"armchair": 0.55, "lounge_chair": 0.75}.get(category, 0.0))
        stray = category in ("ottoman", "stool")
        chair_style = style if room.chance(0.6) else room.style()
        side = 1 if room.chance(0.5) else -1
        for _ in range(min(count, 4)):
            for attempt in range(12):
                if attempt < 9 or room.chance(0.8):
                    lateral = side * max(
                        reach + size[2] / 2 + room.uniform(0.2, 0.7), sofa.size[0] / 2 + room.uniform(-0.1, 0.7)
                    )
                    forward = forward_table + room.rng.normal(0.0, 0.3)
                    turn = -side * HALF_PI
                else:
                    lateral = room.rng.normal(0.0, 0.5)
                    forward = forward_table + reach * 0.6 + size[2] / 2 + room.uniform(0.3, 0.7)
                    turn = math.pi
                if askew:  # towards the middle of the group
                    turn = math.atan2(-lateral, forward_table - forward) + room.rng.normal(0.0, 0.06)
                if stray:
                    turn = room.pick([0.0, HALF_PI, math.pi, -HALF_PI], [0.45, 0.28, 0.13, 0.14])
                if room.beside(sofa, category, size, lateral, forward, turn, chair_style):
                    room.wanted[category] -= 1
                    side = -side
                    break
                if attempt in (3, 6):
                    side = -side


def _side_tables(room: Builder, sofa: Item, style: int) -> None:
    """Side tables, floor lamps and plants at the sofa's ends."""
    sides = [1, -1] if room.chance(0.5) else [-1, 1]
    for category in ("side_table", "corner_side_table", "round_end_table", "floor_lamp"):
        count = room.wanted.get(category, 0)
        if not count or not room.chance(0.9):
            continue
        size = room.size(category)
        for side in list(sides)[: min(count, 2)]:
            for attempt in range(4):
                gap = abs(room.rng.normal(0.08, 0.08)) + 0.08 * attempt
                lateral = side * (sofa.size[0] / 2 + size[0] / 2 + gap)
                forward = room.rng.normal(-0.02, 0.1) if attempt < 3 else -sofa.size[2] / 2 + size[2] / 2
                turn = room.pick([0.0, -HALF_PI, HALF_PI, math.pi], [0.42, 0.25, 0.19, 0.14])
                if room.beside(sofa, category, size, lateral, forward, turn, style):
                    room.wanted[category] -= 1
                    break
        sides.reverse()


def dining_group(room: Builder, *, central: bool = False) -> Item | None:
    """A table with its chairs tucked in: in the open, or with one end at a wall."""
    size = room.size("dining_table")
    style = room.style()
    chair_kind = next((c for c in ("dining_chair", "chinese_chair", "chair") if room.wanted.get(c)), None)
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
            gap = room.uniform(0.0, 0.12) if room.chance(0.85) else room.uniform(0.1, 0.5)
            x, z = wall.point(along, size[0] / 2 + gap)
            yaw = wall.yaw + (HALF_PI if room.chance(0.5) else -HALF_PI)
        else:
            spread = 0.35 if central else 1.0
            x = room.uniform(-room.floor.half_x, room.floor.half_x) * spread
            z = room.uniform(-room.floor.half_z, room.floor.half_z) * spread
            yaw = room.pick([0.0, HALF_PI, math.pi, -HALF_PI], [1, 1, 1, 1])
        if sofa is not None and attempt < 16:  # seats and table stand side by side along the room
            forward = math.sin(sofa.yaw) * (x - sofa.x) + math.cos(sofa.yaw) * (z - sofa.z)
            if not -0.6 < forward < 2.6 and room.chance(0.8):
                continue
        # The chairs' places must be free too; later tries are content with less.
        slack = margin if attempt < 26 else 0.1
        around = Item("dining_table", (size[0], size[1], size[2] + 2 * slack + 0.1), x, 0.0, z, yaw)
        if room.free(around):
            table = room.put("dining_table", size, x, z, yaw, style)
            if table:
                break
    if table is None:
        return None
    if chair_kind:
        room.take(chair_kind)
        _chairs_around(room, table, chair_kind, chair, count, style if room.chance(0.8) else room.style())
    return table


def _chairs_around(room: Builder, table: Item, category: str, size: Size, count: int, style: int) -> None:
    length, depth = table.size[0], table.size[2]
    per_side = 2 if count <= 6 else min((count - 1) // 2, 4)
    if (count == 2 and room.chance(0.5)) or length < 0.95 or (count == 4 and length < 1.3 and room.chance(0.6)):
        per_side = 1
    if count == 6 and length > 1.9 and room.chance(0.6):
        per_side = 3
    tuck = room.rng.normal(0.085, 0.08)
    spacing = max(length / per_side * room.uniform(0.85, 1.0), size[0] + 0.02)
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
        if room.beside(table, category, size, lateral, forward, turn, style, ignore=(table,)):
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
