"""What hangs and what stands on other things: lamps at ceiling, wall and table, televisions on their stands."""

from __future__ import annotations

import math

from echomodel.rooms.builder import HALF_PI, Builder, Item, Size


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
        size = room.size("pendant_lamp")
        shrink = min(1.0, 0.45 / max(size[0], size[2]))
        size = (size[0] * shrink, size[1], size[2] * shrink)
        lateral, forward = bed.size[0] / 2 + 0.25, -bed.size[2] / 2 + 0.22
        for item in room.items:
            if item.category == "nightstand":
                lateral = math.hypot(item.x - bed.x, item.z - bed.z)
                dx, dz = item.x - bed.x, item.z - bed.z
                lateral = abs(math.cos(bed.yaw) * dx - math.sin(bed.yaw) * dz)
                forward = math.sin(bed.yaw) * dx + math.cos(bed.yaw) * dz
                break
        style = room.style()
        for side in (-1, 1):
            x, z = bed.local(side * lateral + room.rng.normal(0.0, 0.02), forward + room.rng.normal(0.0, 0.03))
            _hang(room, "pendant_lamp", size, x, z, bed.yaw, style, low=0.3)


def _row(room: Builder, table: Item, count: int) -> None:
    size = room.size("pendant_lamp")
    shrink = min(1.0, 0.35 / max(size[0], size[2]))
    size = (size[0] * shrink, size[1], size[2] * shrink)
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
    if any(overlap(item, other) for other in room.items if other.category.endswith("_lamp")):
        return
    room.add(item, room.style() if style is None else style)


def overlap(a: Item, b: Item) -> bool:
    """Whether the hulls of two lamps meet in plan and height."""
    return (
        abs(a.x - b.x) < a.hull_x + b.hull_x
        and abs(a.z - b.z) < a.hull_z + b.hull_z
        and a.y < b.y + b.size[1]
        and b.y < a.y + a.size[1]
    )


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
