"""From a room to its dressing: what stands where, what bare walls and corners get, its geometry and its nodes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from string import ascii_lowercase
from typing import TYPE_CHECKING

import numpy as np
import shapely

from echomodel.dressing import KINDS, usual
from echomodel.late import Late
from echomodel.openings import Opening, inward_normal
from echomodel.vocabulary import vocabulary
from echousd.draw.sight import Furniture
from echousd.dressing import floors, tabletops, upholstery, walls
from echousd.dressing.floors import CORNER_AIR, GREEN
from echousd.dressing.setting import Recipe, Setting, Thing, standing
from echousd.dressing.stories import guessed, story
from echousd.dressing.walls import EYE, WIDEST, arranged, free_walls, hung_at
from echousd.naming import free_name
from echousd.room import RoomData

if TYPE_CHECKING:
    from echousd.graph.dressing import DressingGraph

graph_of = Late("echousd.dressing.nodes:graph_of")
TALL, SEEN = 0.7, 0.3  # metres: what is or hangs higher may stand in a camera's way if it is so large
LOW = 0.2  # metres: the same of what stands on the floor, which a near plane might cut open


@dataclass(frozen=True, eq=False)
class Dressing:
    """The small things of a room."""

    layouts: tuple[Mapping[str, Thing], ...]  # for every layout of the room, name of a thing -> the thing
    assets: Mapping[str, str]  # name of a thing -> name of its asset; one name is one asset in all layouts
    recipes: Mapping[str, Recipe]  # name of an asset -> what it is
    bare: frozenset[str] = frozenset()  # names of the windows that have curtains in no layout
    cuts: tuple[Opening, ...] = ()  # of walls, for what is sunk into them
    graphs: tuple[DressingGraph, ...] = ()  # the things of every layout as nodes, none without `dress_graph`

    @property
    def hung(self) -> Furniture:
        """Boxes of what a camera at a wall would have right before it, in the first layout."""
        every = next(iter(self.layouts), {}).values()
        high = [max(t.size[1], t.position[1]) > (TALL if t.position[1] else LOW) for t in every]
        things = [t for t, tall in zip(every, high, strict=True) if tall and t.size.max() > SEEN]
        rows = np.array([(*t.size, *t.position, t.yaw) for t in things]).reshape(-1, 7)
        return Furniture(rows[:, :3], rows[:, 3:6], rows[:, 6])


def dress(room: RoomData) -> Dressing:
    """Small things for every layout of a room as `room.options.dress` asks for; the same room gives the same."""
    layouts: list[dict[str, Thing]] = []
    graphs: list[DressingGraph] = []
    assets: dict[str, str] = {}
    known: dict[Recipe, str] = {}
    kinds: dict[str, Recipe] = {}
    taken = {*room.names, *room.assets.values()}
    bare = {o.name for o in room.graph.room.openings if o.kind == "window"}
    for number in range(len(room.layouts)):
        named: dict[str, Thing] = {}
        setting = dressed(room, number)
        bare -= setting.curtained
        if room.options.dress == "none":  # rails hang where curtains would
            continue
        for found in setting.placed:
            if (key := found.recipe) not in known:
                form = ascii_lowercase[found.variant : found.variant + 1]  # none of those in sizes of their own
                word = f"small_{found.kind}_{form}".rstrip("_")
                known[key] = free_name(word, taken | set(known.values()))
            word = "_".join([*found.on.split(), KINDS[found.kind].name])  # which stays where other things come or go
            name = free_name(word, taken | set(named))
            while kinds.setdefault(name, key) != key:  # a name has one asset in all layouts
                name = free_name(word, taken | set(named) | set(kinds))
            named[name], assets[name] = found, known[key]
        layouts.append(named)
        if room.options.dress_graph:
            graphs.append(graph_of(setting, named))
    recipes = {asset: recipe for recipe, asset in known.items()}
    return Dressing(tuple(layouts), assets, recipes, frozenset(bare), tuple(setting.cuts), tuple(graphs))


def dressed(room: RoomData, layout: int = 0) -> Setting:
    """One layout after all rules; after that of the curtains in a room that is not dressed."""
    setting = setting_of(room, layout)
    for rule in (walls.curtains,) if room.options.dress == "none" else RULES:
        rule(setting)
    return setting


def setting_of(room: RoomData, layout: int = 0) -> Setting:
    """What the rules look at."""
    boxes = room.layouts[layout]
    size, position, yaw = (np.asarray(v, float) for v in (boxes.size, boxes.position, boxes.yaw))
    objects = {
        node.name: standing(node.name, node.category, size[i], position[i], yaw[i], room.geometry[node.name])
        for i, node in enumerate(room.graph.nodes)
    }
    who = room.graph.room.resident or guessed(room.graph.room.type, [o.row for o in objects.values()])
    return Setting(
        objects, room.corners, tuple(room.graph.room.openings), room.height, room.options.walls,
        room.options.dress == "full", room.provenance.seed, vocabulary().room_type(room.graph.room.type).use,
        story(who), who if any(o.row.role == "bed" for o in objects.values()) else "",
        vocabulary().known_style(room.graph.room.style), not room.graph.room.walls and len(room.layouts) == 1,
    )  # fmt: skip


OTHER, SHORT = 0.4, 1.9  # share of short stretches with no pictures, and metres of such; shares that pictures take
FULL = (0.54, 0.66)
EMPTY = 0.65  # metres around a corner where nothing stands
FLOORS = (5.0, 13.0, 24.0, 36.0)  # m² of floor from which on one, two, three, four corners get something


def bare_walls(setting: Setting) -> None:
    """Pictures on the free stretches of every wall, as wide as suits them; on some short ones other things instead."""
    if not setting.walls or setting.use:
        return
    for length, middle, wall in free_walls(setting):
        rng = setting.rng(f"wall {wall.edge}", f"bare {middle:.1f}")
        kind = str(rng.choice(setting.story.decor))
        if length < SHORT and rng.random() < OTHER:
            size, variant = usual(kind, rng)
            one = hung_at(setting, wall, middle, kind, size, EYE - float(size[1]) / 2, variant)
            if one and kind not in {thing.kind for thing in setting.placed}:
                setting.placed.append(one)
                continue
        arranged(setting, wall, middle, min(length * rng.uniform(*FULL), WIDEST), rng)


def bare_corners(setting: Setting) -> None:
    """Plants, then a tall vase, in the emptiest corners of rooms that are large for what stands in them; in full rooms
    in every corner."""
    green = setting.plants
    wanted = len(setting.floor) if setting.full else sum(setting.room.area >= area for area in FLOORS) - green
    around = [other.footprint for other in setting.objects.values() if other.position[1] < 0.5]
    away = [min((shapely.Point(corner).distance(plan) for plan in around), default=9.0) for corner in setting.floor]
    for number in np.argsort(away)[::-1].tolist():
        inside = [inward_normal(setting.floor, edge) for edge in (number - 1, number)]
        if abs(float(inside[0] @ inside[1])) > 0.5 or not (setting.full or away[number] >= EMPTY):
            continue
        if wanted <= 0 or any(thing.kind == "floor_vase" for thing in setting.placed):
            return
        rng = setting.rng(f"corner {number}", "bare")
        kind = "floor_plant" if green < GREEN else "floor_vase"
        size, variant = usual(kind, rng)
        middles = [setting.floor[number] + (inside[0] + inside[1]) * (float(size[0]) / 2 + off) for off in (0.1, 0.2)]
        turn = float(rng.uniform(-3, 3))
        things = (Thing(kind, size, np.array([x, 0.0, z]), turn, "", variant) for x, z in middles)
        if setting.put_first(things, margin=CORNER_AIR) is not None:
            green, wanted = green + 1, wanted - 1


RULES = (
    floors.rugs, walls.hung_up, walls.curtains, walls.radiators, walls.sills, walls.sockets, walls.pictures,
    upholstery.throws, upholstery.cushions, upholstery.on_covers, upholstery.bed_cushions, tabletops.tabletops,
    floors.clusters, walls.coats, walls.tall_mirror, walls.shelves, walls.clock, floors.cables,
    bare_walls, bare_corners,
)  # fmt: skip
