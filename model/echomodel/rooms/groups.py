"""Groups of furniture: sofas, tables and desks with what belongs to them, kitchens in runs, bathrooms and hallways."""

import math

import numpy as np

from echomodel.objective.seating import BEYOND, CORNER
from echomodel.rooms.builder import HALF_PI, Builder, Item, Size
from echomodel.rooms.runs import Site, runs
from echomodel.vocabulary import vocabulary

SOFAS = ("multi_seat_sofa", "l_shaped_sofa", "loveseat_sofa", "sofa", "chaise_longue_sofa", "lazy_sofa")


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
            if placed := room.at_wall("tv_stand", size, wall, place, room.wall_gap("tv_stand"), style):
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
        distance = room.floor.opposite(wall, along)
        gap = room.wall_gap(category)
        low, high = (2.8, 4.3) if wants_tv else (2.0, 5.5)
        if attempt < 14 and not (low < distance < high):
            continue
        if attempt < 22 and distance < (2.6 if wants_tv else 1.8):
            continue
        if wants_tv and distance > 4.8 and pulled:  # then the sofa comes towards its television
            gap = max(min(distance - size[2] / 2 - room.uniform(2.9, 3.5), distance - 3.0), gap)
        if sofa := room.at_wall(category, size, wall, along, gap, style):
            break
    if sofa is None:
        sofa = room.somewhere(category, size, style)
    if sofa is None:
        return None
    if room.wanted.get("tv_stand") and television(room, sofa, nearest=1.0, farthest=9.0 if room.chance(0.2) else 4.4):
        room.wanted["tv_stand"] -= 1
    table = _coffee_table(room, sofa, style)
    _second_sofa(room, sofa, table)
    _seats(room, sofa, table, style)
    _side_tables(room, sofa, style)
    return sofa


def groups_left(room: Builder) -> bool:
    """Whether sofas are wanted that no group has yet."""
    return any(room.wanted.get(category) for category in SOFAS)


def _coffee_table(room: Builder, sofa: Item, style: int) -> Item | None:
    count = room.wanted.get("coffee_table", 0)
    if not count:
        return None
    size = room.size("coffee_table")
    inner = 0.0
    if sofa.category == "l_shaped_sofa":
        # The hull of an L holds its empty inside; the table stands partly in it.
        inner = sofa.size[2] * room.uniform(0.1, 0.4)
    turn = room.pick([0.0, math.pi, HALF_PI, -HALF_PI], [0.6, 0.24, 0.09, 0.07])
    depth = size[2] if abs(math.cos(turn)) > 0.5 else size[0]
    for _ in range(8):
        gap = min(max(0.38 + room.rng.normal(0.0, 0.06), 0.3), 0.5) - inner
        lateral = min(max(room.rng.normal(0.0, 0.08), -0.2), 0.2)
        if inner:
            lateral += room.pick([-1, 1], [1, 1]) * sofa.size[0] * 0.12
        forward = sofa.size[2] / 2 + depth / 2 + gap
        placed = room.beside(sofa, "coffee_table", size, lateral, forward, turn, style, play=0.02,
                             ignore=(sofa,) if inner else ())  # fmt: skip
        if placed:
            room.wanted["coffee_table"] -= 1
            if count > 1 and not groups_left(room):
                room.wanted["coffee_table"] -= 1
                second = (size[0] * 0.75, size[1] * 0.85, size[2] * 0.75)
                room.beside(placed, "coffee_table", second, placed.size[0] * 0.6, room.uniform(-0.3, 0.3), 0.0, style,
                            ignore=(placed,))  # fmt: skip
            return placed
    return None


def _second_sofa(room: Builder, sofa: Item, table: Item | None) -> None:
    for category in SOFAS:
        if not room.wanted.get(category):
            continue
        if room.wanted.get("coffee_table"):  # a group of its own
            return
        room.wanted[category] -= 1
        size = room.size(category)
        centre = table or sofa
        for side in (1, -1) if room.chance(0.5) else (-1, 1):
            lateral = side * (sofa.size[0] / 2 + size[2] / 2 + room.uniform(0.0, 0.4))
            forward = (0.0 if table else sofa.size[2] / 2 + size[0] / 2) + room.rng.normal(0.0, 0.1)
            if table:
                lateral = side * (centre.hull_x + size[2] / 2 + room.uniform(0.25, 0.6))
                forward += sofa.seen(table.x, table.z)[1]
                lateral = side * max(abs(lateral), sofa.size[0] / 2 + size[2] / 2 - 0.2)
            if room.beside(sofa, category, size, lateral, forward, -side * HALF_PI, sofa.style):
                break


def _seats(room: Builder, sofa: Item, table: Item | None, style: int) -> None:
    """Armchairs, lounge chairs and ottomans around the coffee table, turned towards it."""
    forward_table = sofa.size[2] / 2 + 0.8
    reach = 0.6
    if table:
        forward_table = sofa.seen(table.x, table.z)[1]
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
                turn += room.askew(category)
                if room.beside(sofa, category, size, lateral, forward, turn, style):
                    room.wanted[category] -= 1
                    break
        sides.reverse()


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
    most = length + 2 * (BEYOND + CORNER - 0.03) - size[0]  # they stand a little unevenly
    while per_side > 1 and (per_side - 1) * (size[0] + 0.02) > most:
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
) -> None:
    """A desk or dressing table at a wall (a desk may stand free) with its chair."""
    style = room.style()
    size = room.size(category)
    desk = None
    if category == "desk" and room.chance(0.15):
        desk = room.somewhere(category, size, style, clearance=0.3)
    desk = desk or room.against_wall(category, size=size, style=style, corner=0.45, tries=20, yaw=yaw)
    desk = desk or room.against_wall(category, size=size, style=style, corner=0.45, tries=12)
    if desk is not None:
        seat_at(room, desk, seats, style)


def seat_at(room: Builder, desk: Item, seats: tuple[str, ...], style: int) -> None:
    """The first of the wanted seats before a desk or dressing table."""
    seat = next((s for s in seats if room.wanted.get(s)), None)
    if seat:
        chair = room.size(seat)
        forward = desk.size[2] / 2 + chair[2] / 2 - min(max(room.rng.normal(0.08, 0.08), -0.05), 0.25)
        lateral = min(max(room.rng.normal(0.0, 0.08), -0.2), 0.2)
        if room.beside(desk, seat, chair, lateral, forward, math.pi, style, ignore=(desk,), doors=False):
            room.wanted[seat] -= 1


GIVEN_UP = ("kitchen_island", "tall_unit", "dishwasher", "wall_unit", "base_unit")  # where a run does not fit
TRIED = 5  # of the best plans, one of which is built
WALL_HUNG = ("mirror_cabinet", "towel_radiator")
WET = ("bathtub", "shower", "toilet", "washbasin", "washing_machine")  # the large before the small


def kitchen(room: Builder) -> None:
    """A fitted run with what hangs over it, an island with stools or a table before it."""
    if room.wanted.get("base_unit"):
        room.wanted["base_unit"] = max(2, min(6, room.wanted["base_unit"] + round(room.rng.normal(0.0, 0.8))))
    run = _run(room)
    for _ in range(room.take("kitchen_island")):
        if run:
            _island(room, max(run, key=lambda item: item.size[0]))
    if room.wanted.get("dining_table"):
        room.take("dining_table")
        dining_group(room)
    for chair in ("dining_chair", "bar_stool"):
        room.take(chair)


def _run(room: Builder) -> list[Item]:
    """The fitted units that are wanted, with fewer of them where they do not fit."""
    rows = [row for row in vocabulary().categories if row.stands == "row" or (row.stands == "over" and row.task)]
    wanted = {row.name: count for row in rows if (count := room.take(row.name))}
    style = room.style()
    while True:
        kinds = [row for row in rows for _ in range(wanted.get(row.name, 0))]
        units = sum(kind.stands == "row" for kind in kinds)
        size = np.array([room.size(kind.name) for kind in kinds]).reshape(-1, 3)
        free = np.ones(len(kinds), bool)
        site = Site(np.array(room.floor.polygon), room.floor.in_the_way)
        spot = room.uniform(-1, 1) * room.floor.half_x, 0.0, room.uniform(-1, 1) * room.floor.half_z
        draft = np.tile(spot, (len(kinds), 1))  # towards one end of the room or the other
        plans = runs(kinds, size, free, site, draft=draft, most=TRIED)
        plans = [plan for plan in plans if len(plan.which) == len(kinds)]
        if plans or units < 2:
            break
        less = next((name for name in GIVEN_UP if wanted.get(name, 0) > (name == "base_unit")), None)
        if less is None:
            break
        wanted[less] -= 1
    if units < 2:  # one alone is a piece like others
        room.wanted.update(wanted)
        return []
    room.lost = not plans
    if not plans:
        return []
    plan = plans[min(int(room.rng.exponential(1.2)), len(plans) - 1)]
    items = []
    for i, own, (x, y, z), yaw in zip(plan.which, plan.size, plan.position, plan.yaw, strict=True):
        made = Item(kinds[i].name, tuple(own.tolist()), float(x), float(y), float(z), float(yaw))
        items.append(room.add(made, style))
    return items


def _island(room: Builder, unit: Item) -> None:
    """An island across the aisle from a unit, its stools on the far side."""
    size, style = room.size("kitchen_island"), unit.style
    for away in (1.2, 1.3, 1.1):
        for lateral in (0.0, 0.5, -0.5, 1.0, -1.0):
            forward = (unit.size[2] + size[2]) / 2 + away
            island = room.beside(unit, "kitchen_island", size, lateral, forward, math.pi, style)
            if island is None:
                continue
            stool, count = room.size("bar_stool"), min(room.wanted.get("bar_stool", 0), int(size[0] / 0.6))
            for k in range(count):
                at = (k - (count - 1) / 2) * 0.6
                room.beside(island, "bar_stool", stool, at, -size[2] / 2 - 0.1, 0.0, style, ignore=(island,))
            return


def bathroom(room: Builder) -> None:
    """Tub and shower in corners, what washes along the walls, a mirror over the basin, towels at a free wall."""
    style = room.style()
    for category in WET:
        for _ in range(room.take(category)):
            corner = 1.0 if category in ("bathtub", "shower") else 0.2
            made = room.against_wall(category, corner=corner, gap=0.01, style=style, tries=40, margin=0.2)
            room.lost |= made is None and category in ("toilet", "washbasin")
            if made and category == "washbasin" and room.take("mirror_cabinet"):
                wide, high, deep = room.size("mirror_cabinet")
                x, z = made.local(0.0, (deep - made.size[2]) / 2)
                mounted = vocabulary().category("mirror_cabinet").mounted
                mirror = Item("mirror_cabinet", (min(wide, made.size[0]), high, deep), x, mounted, z, made.yaw)
                if room.free(mirror):  # else the basin is under a window
                    room.add(mirror, style)
    for category in WALL_HUNG:
        low = vocabulary().category(category).mounted
        room.along_walls(category, corner=0.2, margin=0.1, gap=0.01, style=style, tries=20, low=low)


def hallway(room: Builder) -> None:
    """Coats and shoes beside each other at one wall, a bench or console along another."""
    rack = room.against_wall("coat_rack", corner=0.3, gap=0.01) if room.take("coat_rack") else None
    room.along_walls("shoe_cabinet", "bench", "console_table", corner=0.2, gap=0.02, near=rack, tries=24)


def balcony(room: Builder) -> None:
    """A table with its chairs."""
    for _ in range(room.take("garden_table")):
        room.lost |= dining_group(room, "garden_table", ("garden_chair",)) is None


def childrens_room(room: Builder) -> None:
    """A cot and toys at the walls, a small table with its chairs; the rest as in other bedrooms."""
    room.along_walls("cot", "toy_box", corner=0.5, gap=0.03)
    for _ in range(room.take("kids_table")):
        dining_group(room, "kids_table", ("kids_chair",))
    room.take("kids_chair")
