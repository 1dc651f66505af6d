"""Recipes of kitchens and laundries in runs, of bathrooms, hallways, balconies and children's rooms."""

from __future__ import annotations

import math

import numpy as np

from echomodel.rooms.builder import Builder, Item
from echomodel.rooms.groups import dining_group
from echomodel.rooms.runs import Site, runs
from echomodel.vocabulary import vocabulary

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
        for _ in range(room.take(category)):
            size, low = room.size(category), vocabulary().category(category).mounted
            for _ in range(20):
                spot = room.wall_spot(size[0], 0.2, 0.1)
                if spot is None:
                    break
                x, z = spot[0].point(spot[1], size[2] / 2 + 0.01)
                item = Item(category, size, x, low, z, spot[0].yaw)
                if room.free(item):
                    room.add(item, style)
                    break


def hallway(room: Builder) -> None:
    """Coats and shoes beside each other at one wall, a bench or console along another."""
    rack = room.against_wall("coat_rack", corner=0.3, gap=0.01) if room.take("coat_rack") else None
    for category in ("shoe_cabinet", "bench", "console_table"):
        for _ in range(room.take(category)):
            room.against_wall(category, corner=0.2, gap=0.02, near=rack, tries=24)


def balcony(room: Builder) -> None:
    """A table with its chairs."""
    for _ in range(room.take("garden_table")):
        room.lost |= dining_group(room, "garden_table", ("garden_chair",)) is None


def childrens_room(room: Builder) -> None:
    """A cot and toys at the walls, a small table with its chairs; the rest as in other bedrooms."""
    for category in ("cot", "toy_box"):
        for _ in range(room.take(category)):
            room.against_wall(category, corner=0.5, gap=0.03)
    for _ in range(room.take("kids_table")):
        dining_group(room, "kids_table", ("kids_chair",))
    room.take("kids_chair")
