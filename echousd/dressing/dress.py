"""From a room to its dressing: what stands where, and the geometry of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from echomodel.dressing import KINDS
from echomodel.dressing import thing as solids_of
from echomodel.vocabulary import vocabulary
from echousd.draw.sight import Furniture
from echousd.dressing import bareness, corners, floors, hangings, tabletops, upholstery, walls
from echousd.dressing.nodes import graph_of
from echousd.dressing.setting import Setting, Thing, standing
from echousd.graph.titles import DressingGraph
from echousd.naming import free_name
from echousd.room import RoomData
from echousd.shapes.colliders import standing_hull
from echousd.shapes.geometry import Geometry, Origin
from echousd.shapes.joinery import part_of, within_budget
from echousd.shapes.matter import weighed

ORIGIN = Origin("dressing")
TALL = 0.7  # metres: what reaches or hangs higher may stand in a camera's way
RULES = (
    floors.rugs,
    hangings.hung_up,
    walls.curtains,
    walls.pictures,
    upholstery.throws,
    upholstery.cushions,
    upholstery.bed_cushions,
    upholstery.folded,
    tabletops.tabletops,
    floors.by_doors,
    floors.baskets,
    hangings.coats,
    floors.toys,
    hangings.tall_mirror,
    hangings.shelves,
    hangings.clock,
    corners.cables,
    corners.slippers,
    corners.corner_plants,
    corners.poufs,
    bareness.bare_walls,
    bareness.bare_corners,
)


@dataclass(frozen=True, eq=False)
class Dressing:
    """The small things of a room.

    Arguments:
        layouts: for every layout of the room, name of a thing -> the thing.
        assets: name of a thing -> name of its asset; one name is one asset in all layouts.
        geometry: name of an asset -> its geometry.
        bare: names of the windows that have curtains in no layout.
        graphs: the things of every layout as nodes, none without `dress_graph`.
    """

    layouts: tuple[Mapping[str, Thing], ...]
    assets: Mapping[str, str]
    geometry: Mapping[str, Geometry]
    bare: frozenset[str] = frozenset()
    graphs: tuple[DressingGraph, ...] = ()

    @property
    def kinds(self) -> dict[str, str]:
        """Name of an asset -> its kind."""
        return {self.assets[name]: t.kind for things in self.layouts for name, t in things.items()}

    @property
    def hung(self) -> Furniture:
        """Boxes of what a camera at a wall would have right before it, in the first layout."""
        things = [t for t in next(iter(self.layouts), {}).values() if t.size[1] > TALL or t.position[1] > TALL]
        size = np.array([t.size for t in things]).reshape(-1, 3)
        position = np.array([t.position for t in things]).reshape(-1, 3)
        return Furniture(size, position, np.array([t.yaw for t in things]))


def dress(room: RoomData) -> Dressing:
    """Small things for every layout of a room as `room.options.dress` asks for; the same room gives the same."""
    layouts: list[dict[str, Thing]] = []
    graphs: list[DressingGraph] = []
    assets: dict[str, str] = {}
    geometry: dict[str, Geometry] = {}
    known: dict[tuple, str] = {}
    kinds: dict[str, tuple] = {}
    taken = {*room.names, *room.assets.values()}
    bare = {o.name for o in room.graph.room.openings if o.kind == "window"}
    for number in range(max(len(room.layouts), 1)):
        named: dict[str, Thing] = {}
        setting = dressed(room, number)
        bare -= setting.curtained
        if room.options.dress == "none":  # rails hang where curtains would
            continue
        for found in setting.placed:
            key = (found.kind, *np.round(found.size, 4).tolist(), found.variant)
            if key not in known:
                known[key] = free_name(f"small_{found.kind}", taken | set(geometry))
                geometry[known[key]] = geometry_of(found.kind, tuple(found.size.tolist()), found.variant)
            word = KINDS[found.kind].name
            name = free_name(word, taken | set(named))
            while kinds.setdefault(name, key) != key:  # a name has one asset in all layouts
                name = free_name(word, taken | set(named) | set(kinds))
            named[name], assets[name] = found, known[key]
        layouts.append(named)
        if room.options.dress_graph:
            graphs.append(graph_of(setting, named))
    return Dressing(tuple(layouts), assets, geometry, frozenset(bare), tuple(graphs))


def placed(room: RoomData, layout: int = 0) -> list[Thing]:
    """The things of one layout, in the order in which they were placed."""
    return dressed(room, layout).placed


def dressed(room: RoomData, layout: int = 0) -> Setting:
    """One layout after all rules; after that of the curtains in a room that is not dressed."""
    setting = setting_of(room, layout)
    for rule in (walls.curtains,) if room.options.dress == "none" else RULES:
        rule(setting)
    return setting


def setting_of(room: RoomData, layout: int = 0) -> Setting:
    """What the rules look at."""
    boxes = room.layouts[layout] if room.layouts else room.boxes
    size, position, yaw = (np.asarray(v, float) for v in (boxes.size, boxes.position, boxes.yaw))
    objects = {
        node.name: standing(node.name, node.category, size[i], position[i], yaw[i], room.geometry[node.name])
        for i, node in enumerate(room.graph.nodes)
    }
    corners = room.graph.room.corners
    floor = np.asarray(room.floor if corners is None else corners, float)
    return Setting(
        objects, floor, tuple(room.graph.room.openings), room.height, room.options.walls,
        room.options.dress == "full", room.provenance.seed, vocabulary().room_type(room.graph.room.type).use,
    )  # fmt: skip


@lru_cache(maxsize=100)  # a room that is edited keeps most of its things
def geometry_of(kind: str, size: tuple[float, float, float], variant: int) -> Geometry:
    """The geometry of a thing, with one hull to bump into that stands."""
    solids = solids_of(kind, np.array(size), np.random.default_rng(variant))
    pieces = within_budget(solids, np.array(size), KINDS[kind].faces)
    part = part_of("mesh", pieces)
    return Geometry((part,), (standing_hull(part.mesh),), ORIGIN, weighed(pieces))
