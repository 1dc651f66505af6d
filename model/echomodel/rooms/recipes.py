"""Recipes: what a room of each kind holds and in which order it is furnished."""

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from echomodel.files import tables
from echomodel.rooms.builder import BODY, HALF_PI, Builder, Item, Size, overlaps
from echomodel.rooms.floor import Wall
from echomodel.rooms.groups import (
    SOFAS,
    VANITY_SEATS,
    balcony,
    bathroom,
    childrens_room,
    desk_group,
    dining_group,
    groups_left,
    hallway,
    kitchen,
    seat_at,
    sofa_group,
    television,
)
from echomodel.rooms.statistics import RoomTypeStatistics
from echomodel.vocabulary import vocabulary

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
        across = room.floor.opposite(wall, along)
        shy = 0.85 if room.wanted.get("tv_stand") else 0.5
        if across > LOW_ROOM and attempt < 10 and room.chance(shy):  # beds stand across the room rather than along it
            continue
        if sides == 1:
            along += room.pick([-1, 1], [1, 1]) * stand[0] / 2
        bed = room.at_wall(category, size, wall, along, room.wall_gap(category), style)
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


TABLES = tables("recipes.toml", __file__)
SOFA_KINDS = ("multi_seat_sofa", "l_shaped_sofa", "loveseat_sofa")
# Of these a room mostly holds one kind.
EXCLUSIVE = (BEDS, SOFA_KINDS, ("pendant_lamp", "ceiling_lamp"))
Anchors = Callable[[], list[Item]]  # what lamps hang over once the room is furnished
LOUNGERS = ("armchair", "lounge_chair")
SMALL_TABLES = ("side_table", "corner_side_table", "round_end_table", "nightstand")
BOARDS = ("dining_table", "desk", "table", "dressing_table")
DINING_CHAIRS = ("dining_chair", "chinese_chair")
DESK_SEATS = ("office_chair", "dining_chair", "chair", "dressing_chair", "stool")


def wanted(statistics: RoomTypeStatistics, area: float, rng: np.random.Generator) -> dict[str, int]:
    """Draw how many of each category a room asks for; larger rooms ask for more."""
    middle = math.log(statistics.area[2])
    spread = (math.log(statistics.area[4]) - math.log(statistics.area[0])) / 3.29
    lean = math.exp(0.45 * min(max((math.log(area) - middle) / spread, -2.0), 2.0))
    want: dict[str, int] = {}
    for category, (share, counts, cumulative) in statistics.presence.items():
        if share < 0.75:
            odds = share / (1 - share) * lean
            share = odds / (1 + odds)
        if rng.random() < share:
            want[category] = counts[int(np.searchsorted(cumulative, rng.random()))]
    for group in EXCLUSIVE:
        held = [category for category in group if category in want]
        keep = 0.0
        if group[0] == "pendant_lamp":
            keep = 0.12 if statistics.name == "bedroom" else 0.6
        if len(held) > 1 and rng.random() >= keep:
            weights = np.array([statistics.presence[category][0] for category in held])
            chosen = held[int(np.searchsorted(np.cumsum(weights / weights.sum()), rng.random()))]
            for category in held:
                if category != chosen:
                    del want[category]
    for category, others in TABLES["substitutes"].items():
        for other, share in others.items():
            if category in want and rng.random() < share:
                want[other] = want.get(other, 0) + want.pop(category)
    for category, share in TABLES["extras"].items():
        if rng.random() < share:
            want[category] = 1 + int(rng.random() < 0.4)
    return want


def furnish(room: Builder, name: str) -> None:
    """Furnish an empty room of one type of the vocabulary; a type without a recipe like the one that its row names."""
    recipes: dict[str, Callable[[Builder], Anchors]] = {
        "bedroom": _bedroom,
        "living_room": _living_room,
        "dining_room": _dining_room,
        "living_dining_room": partial(_living_room, dining=True),
        "study": _study,
        "kitchen": partial(_home, kitchen),
        "utility_room": partial(_home, kitchen),
        "bathroom": partial(_home, bathroom),
        "hallway": partial(_home, hallway),
        "balcony": partial(_home, balcony),
        "childrens_room": _childrens_room,
    }
    if name not in recipes:
        name = vocabulary().room_type(name).like or "living_room"
    anchors = recipes[name](room)
    _rest(room)
    ceiling_lamps(room, anchors())


def _home(first: Callable[[Builder], None], room: Builder) -> Anchors:
    first(room)
    room.along_walls("radiator", corner=0.1, gap=0.02)
    return list


def _childrens_room(room: Builder) -> Anchors:
    beds = [bed for category in BEDS for _ in range(room.take(category)) if (bed := bed_group(room, category))]
    childrens_room(room)
    _wardrobe(room, beds[0] if beds else None)
    room.along_walls("radiator", corner=0.1, gap=0.02)
    _desks(room)
    return lambda: list(beds)


def _bedroom(room: Builder) -> Anchors:
    beds = _beds(room)
    if beds and room.take("tv_stand"):
        television(room, beds[0])
    _wardrobe(room, beds[0] if beds else None)
    if room.take("dressing_table"):
        yaw = beds[0].yaw + math.pi if beds and room.chance(0.9) else None
        desk_group(room, "dressing_table", VANITY_SEATS, yaw=yaw)
    _desks(room)
    return lambda: list(beds)


def _beds(room: Builder) -> list[Item]:
    """The beds, each with what belongs to it; sofas and tables of a sleeping and living room after them."""
    beds = [bed for category in BEDS for _ in range(room.take(category)) if (bed := bed_group(room, category))]
    if room.wanted.get("coffee_table"):
        _sofas(room)
    if room.wanted.get("dining_table"):
        _set_tables(room)
    return beds


def _wardrobe(room: Builder, bed: Item | None) -> None:
    """Wardrobes along the side walls of the bed."""
    for _ in range(room.take("wardrobe")):
        size, style = room.size("wardrobe"), room.style()
        if bed is None or not room.chance(0.88) or not _beside_bed(room, bed, size, style):
            room.against_wall("wardrobe", size=size, style=style, corner=0.5, tries=16)


def _beside_bed(room: Builder, bed: Item, size: tuple[float, float, float], style: int) -> Item | None:
    """A wardrobe at a side wall, level with the bed or in the corner beside its head."""
    walls = [wall for wall in room.floor.walls if abs(math.sin(wall.yaw - bed.yaw)) > 0.9 and wall.length >= size[0]]
    for attempt in range(10):
        if not walls:
            return None
        wall = walls[int(room.rng.integers(len(walls)))]
        level = (bed.x - wall.x) * wall.dx + (bed.z - wall.z) * wall.dz
        along = level + room.rng.normal(0.0, 0.12 + 0.06 * attempt)
        ends = (size[0] / 2 + 0.01, wall.length - size[0] / 2 - 0.01)
        if room.chance(0.5):
            along = min(ends, key=lambda end: abs(end - level))
        along = min(max(along, ends[0]), max(ends))
        if placed := room.at_wall("wardrobe", size, wall, along, room.wall_gap("wardrobe"), style):
            return placed
    return None


def _living_room(room: Builder, *, dining: bool = False) -> Anchors:
    sofa = _sofas(room)
    if dining:
        _no_chairs_without(room, _set_tables(room))
    elif room.wanted.get("dining_table") or room.wanted.get("dining_chair", 0) > 2:
        _set_tables(room)
    _desks(room)
    return lambda: _anchors(room, sofa)


def _dining_room(room: Builder) -> Anchors:
    tables = _set_tables(room, central=True)
    _no_chairs_without(room, tables)
    if room.wanted.get("coffee_table"):
        _sofas(room)
    _desks(room)
    return lambda: [table for table in tables if table]


def _set_tables(room: Builder, *, central: bool = False) -> list[Item | None]:
    """The dining tables with their chairs; several chairs ask for one."""
    if sum(room.wanted.get(chair, 0) for chair in DINING_CHAIRS) > 1:
        room.wanted.setdefault("dining_table", 1)
    count = room.take("dining_table")
    return [dining_group(room, central=central, sharing=count - k) for k in range(count)]


def _no_chairs_without(room: Builder, tables: list[Item | None]) -> None:
    """Dining chairs stay out of a room whose table found no place."""
    if not any(tables):
        for chair in DINING_CHAIRS:
            room.take(chair)


def _study(room: Builder) -> Anchors:
    beds = _beds(room)
    if not beds and not room.wanted.get("desk"):
        room.wanted["desk"] = 1
    if room.wanted.get("desk") and not any(room.wanted.get(seat) for seat in DESK_SEATS) and room.chance(0.5):
        room.wanted["office_chair"] = 1
    _desks(room)
    _wardrobe(room, beds[0] if beds else None)
    return lambda: [item for item in room.items if item.category in (*BEDS, "desk")][:1]


def _sofas(room: Builder) -> Item | None:
    """The first sofa with its group; further coffee tables ask for further groups."""
    first: Item | None = None
    while groups_left(room) and (first is None or room.wanted.get("coffee_table")):
        category = max(SOFAS, key=lambda name: room.wanted.get(name, 0))
        room.wanted[category] -= 1
        made = sofa_group(room, category)
        if made is None:
            break
        first = first or made
    if first is not None:
        room.take("coffee_table")  # what found no place before a sofa has none
    return first


def _anchors(room: Builder, sofa: Item | None) -> list[Item]:
    """What pendant lamps hang over, the most usual first."""
    tables = [item for item in room.items if item.category == "dining_table"]
    coffee = [item for item in room.items if item.category == "coffee_table"][:1]
    anchors = tables + (coffee or ([sofa] if sofa else []))
    return anchors if room.chance(0.75) else anchors[::-1]


def _desks(room: Builder) -> None:
    for category in ("desk", "table"):
        for _ in range(room.take(category)):
            desk_group(room, category, DESK_SEATS)
    if room.take("dressing_table"):
        desk_group(room, "dressing_table", ("dressing_chair", "stool", "chair"))


def _rest(room: Builder) -> None:
    """Everything still wanted: storage along the walls, plants and lamps in corners, loose seats on the floor."""
    sofa = next((item for item in room.items if item.category in (*SOFAS, *BEDS)), None)
    for _ in range(room.take("tv_stand")):
        if sofa is None:
            room.against_wall("tv_stand", corner=0.05, margin=0.2)
        else:
            television(room, sofa)
    table = next((item for item in room.items if item.category == "dining_table"), None)
    for category in TABLES["storage"]["order"]:
        count = room.take(category)
        if count:
            size, style = room.size(category), room.style()
            for k in range(count):
                if k and room.chance(0.5):
                    size = room.size(category)
                near = table if category == "sideboard" and room.chance(0.7) else None
                room.against_wall(category, size=size, style=style, corner=0.4, tries=14, near=near)
    for category in ("plant", "floor_lamp"):
        for _ in range(room.take(category)):
            _by_the_wall(room, category)
    for category in [c for c in room.wanted if c in SMALL_TABLES]:
        for _ in range(room.take(category)):
            if category != "nightstand" and room.chance(0.5):
                room.against_wall(category, corner=0.3, near=sofa, gap=room.uniform(0.02, 0.4))
    on_top(room)
    if any(item.category in BOARDS for item in room.items):  # chairs that found no place at a table stay out
        for category in (*DINING_CHAIRS, "chair", "office_chair", "dressing_chair"):
            room.take(category)
    for category in [c for c in room.wanted if c not in ("pendant_lamp", "ceiling_lamp")]:
        count = room.take(category)
        size, style = room.size(category), room.style()
        for _ in range(min(count, 4)):
            _loose(room, category, size, style)


def _by_the_wall(room: Builder, category: str) -> None:
    """A plant or lamp: beside the tv stand, in a corner, or along a wall."""
    size, style = room.size(category), room.style()
    stands = [item for item in room.items if item.category == "tv_stand"]
    turn = room.pick([0.0, HALF_PI, math.pi, -HALF_PI], [0.4, 0.25, 0.15, 0.2]) + room.askew(category)
    sofas = [item for item in room.items if item.category in SOFAS]
    if (stands or sofas) and category == "plant" and room.chance(0.8):
        stand = (stands or sofas)[0] if room.chance(0.75) else (sofas or stands)[0]
        for side in (1, -1) if room.chance(0.5) else (-1, 1):
            lateral = side * (stand.size[0] / 2 + size[0] / 2 + room.uniform(-0.03, 0.3))
            forward = size[2] / 2 - stand.size[2] / 2 + room.uniform(0.0, 0.15)
            if room.beside(stand, category, size, lateral, forward, turn, style, play=0.06):
                return
    for _ in range(10):
        spot = room.wall_spot(size[0], 0.7)
        if spot is None:
            return
        if room.at_wall(category, size, *spot, abs(room.rng.normal(0.02, 0.08)), style, turn=turn):
            return


def _loose(room: Builder, category: str, size: tuple[float, float, float], style: int) -> None:
    """A loose seat: with its back to a wall, now and then turned into the room, or on open floor."""
    group = [item for item in room.items if item.category in ("coffee_table", *SOFAS)]
    if room.chance(0.6) or (group and category in LOUNGERS):
        for attempt in range(8):
            spot = room.wall_spot(size[0] + 0.1, 0.0, 0.25)
            if spot is None:
                break
            if group and category in LOUNGERS and not _faces(*spot, group[0]):
                continue
            askew = category in LOUNGERS and not group and room.chance(0.45)
            turn = room.pick([-1, 1], [1, 1]) * room.uniform(0.3, 0.8) if askew else 0.0
            off = room.uniform(0.2, 0.9) if attempt < 5 else room.uniform(0.02, 0.1)  # seats stand in the room
            if room.at_wall(category, size, *spot, max(off, 0.2) if askew else off, style, turn=turn, play=0.0):
                return
    if not (group and category in LOUNGERS):
        room.somewhere(category, size, style)


def _faces(wall: Wall, along: float, group: Item) -> bool:
    """Whether what stands there with its back to the wall looks towards a group."""
    x, z = wall.point(along, 0.0)
    dx, dz = group.x - x, group.z - z
    return math.sin(wall.yaw) * dx + math.cos(wall.yaw) * dz > 0.3 * math.hypot(dx, dz)


def ceiling_lamps(room: Builder, anchors: list[Item]) -> None:
    """Hang the wanted lamps over the anchors (a table, a bed, a coffee table) and the free floor."""
    pendants, flush = room.take("pendant_lamp"), room.take("ceiling_lamp")
    spots = list(anchors)
    beds = [a for a in anchors if a.category.endswith("bed")]
    if beds and pendants:
        _bed_pendants(room, beds[0], pendants)
        pendants = 0
    tables = [a for a in spots if a.category == "dining_table"]
    if tables and pendants >= 3 and room.chance(0.75):
        _row(room, tables[0], 3 if pendants < 5 else 4)
        pendants -= 3
        spots.remove(tables[0])
    twins = room.size("pendant_lamp") if room.chance(0.25) else None
    for _ in range(pendants):
        size = twins or room.size("pendant_lamp")
        anchor = spots.pop(0) if spots and room.chance(0.93) else None
        _hang(room, "pendant_lamp", size, *_over(room, anchor), _turn(room, anchor))
    for _ in range(flush):
        anchor = spots.pop(0) if spots and room.chance(0.6) else None
        _hang(room, "ceiling_lamp", room.size("ceiling_lamp"), *_over(room, anchor), _turn(room, anchor))


def _bed_pendants(room: Builder, bed: Item, count: int) -> None:
    """One lamp above the bed or the room's middle; two more over the nightstands."""
    if count in (1, 3):
        if room.chance(0.6):
            x, z = bed.local(room.rng.normal(0.0, 0.12), room.rng.normal(0.25, 0.35))
        else:
            x, z = 0.5 * bed.x + room.rng.normal(0.0, 0.15), 0.5 * bed.z + room.rng.normal(0.0, 0.15)
        _hang(room, "pendant_lamp", room.size("pendant_lamp"), x, z, _turn(room, None))
    if count == 2 and room.chance(0.5):  # a pair along the bed's middle
        size = room.size("pendant_lamp")
        for forward in (-0.2, 0.75):
            x, z = bed.local(room.rng.normal(0.0, 0.3), forward + room.rng.normal(0.0, 0.2))
            _hang(room, "pendant_lamp", size, x, z, _turn(room, None))
    elif count >= 2:
        size = _narrow(room.size("pendant_lamp"), 0.45)
        lateral, forward = bed.size[0] / 2 + 0.25, -bed.size[2] / 2 + 0.22
        for item in room.items:
            if item.category == "nightstand":
                lateral, forward = bed.seen(item.x, item.z)
                lateral = abs(lateral)
                break
        style = room.style()
        for side in (-1, 1):
            x, z = bed.local(side * lateral + room.rng.normal(0.0, 0.02), forward + room.rng.normal(0.0, 0.03))
            _hang(room, "pendant_lamp", size, x, z, bed.yaw, style, low=0.3)


def _narrow(size: Size, most: float) -> Size:
    """A size at most so many metres across."""
    shrink = min(1.0, most / max(size[0], size[2]))
    return size[0] * shrink, size[1], size[2] * shrink


def _row(room: Builder, table: Item, count: int) -> None:
    size = _narrow(room.size("pendant_lamp"), 0.35)
    style, step = room.style(), table.size[0] * room.uniform(0.22, 0.32)
    across = room.rng.normal(0.0, 0.05)
    for k in range(count):
        x, z = table.local((k - (count - 1) / 2) * step, across)
        _hang(room, "pendant_lamp", size, x, z, table.yaw, style)


def _over(room: Builder, anchor: Item | None) -> tuple[float, float]:
    if anchor is not None:
        return anchor.local(room.rng.normal(0.0, 0.1), room.rng.normal(0.0, 0.1))
    floor = room.floor
    for _ in range(6):
        x = room.rng.normal(0.0, 0.25) * floor.half_x
        z = room.rng.normal(0.0, 0.25) * floor.half_z
        if floor.holds(x - 0.3, z - 0.3, x + 0.3, z + 0.3):
            break
    return x, z


def _turn(room: Builder, anchor: Item | None) -> float:
    base = anchor.yaw if anchor is not None and room.chance(0.5) else 0.0
    return base + room.pick([0.0, HALF_PI, math.pi, -HALF_PI], [0.34, 0.25, 0.18, 0.23])


def _hang(
    room: Builder, category: str, size: Size, x: float, z: float, yaw: float, style: int | None = None, low: float = 0.0
) -> None:
    """Hang a lamp: flush, on a longer cord, or (as in many real rooms) with its mount inside the ceiling."""
    height = room.floor.height
    if category == "ceiling_lamp":
        gap = room.rng.normal(0.0, 0.02) if room.chance(0.85) else room.rng.normal(0.0, 0.12)
    else:
        gap = room.pick([0.0, room.uniform(-0.4, 0.0), room.uniform(0.0, 0.6)], [0.42, 0.38, 0.2]) + low
    bottom = min(max(height - size[1] - gap, 1.2 if category == "pendant_lamp" else 1.7), height - 0.05)
    item = Item(category, size, x, bottom, z, yaw)
    if not room.floor.holds(x - item.hull_x, z - item.hull_z, x + item.hull_x, z + item.hull_z):
        return
    if any(overlaps(item, other, 0.0) for other in room.items if other.category.endswith("_lamp")):
        return
    room.add(item, room.style() if style is None else style)


def on_top(room: Builder) -> None:
    """Table lamps on nightstands, desks and side tables, televisions on tv stands, lamps on walls."""
    for category, supports in (
        ("table_lamp", ("nightstand", "desk", "side_table", "dresser", "console_table")),
        ("tv", ("tv_stand",)),
    ):
        count = room.take(category)
        if not count:
            continue
        size, style = room.size(category), room.style()
        for support in [item for item in room.items if item.category in supports][:count]:
            shrink = min(1.0, support.size[0] / size[0], support.size[2] / size[2])
            fitted = (size[0] * shrink, size[1] * shrink, size[2] * shrink)
            x, z = support.local(
                room.rng.normal(0, 0.02) if support.size[0] < 0.9 or category == "tv" else support.size[0] * 0.32,
                room.rng.normal(0, 0.02),
            )
            room.add(Item(category, fitted, x, support.size[1], z, support.yaw), style)
    for _ in range(room.take("wall_lamp")):
        size = room.size("wall_lamp")
        spot = room.wall_spot(size[0], 0.0)
        if spot:
            x, z = spot[0].point(spot[1], size[2] / 2)
            room.add(Item("wall_lamp", size, x, room.uniform(1.4, 1.9), z, spot[0].yaw), room.style())
