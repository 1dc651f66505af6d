"""Homes on stages: /House/Graph, and below /House/Rooms the rooms, each with its own graph and, if planned, place."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom

from echomodel.boxes2d import footprints, upright
from echomodel.vocabulary import vocabulary
from echousd.graph import Node, SceneGraph
from echousd.home.graph import RATIO, HomeGraph, HomeRelation, HomeRoom
from echousd.home.plan import HomePlan
from echousd.naming import STAGE_FORMS
from echousd.stage import encoding as usd
from echousd.stage import values
from echousd.stage.contents import read_contents
from echousd.stage.encoding import StageError
from echousd.stage.files import open_stage, source
from echousd.stage.graphs import save_layer
from echousd.stage.pen import ops, relate, say
from echousd.stage.read import RoomPrims, faults, find_rooms, place, room_graph, stated_fields, value
from echousd.stage.units import to_metres
from echousd.stage.write import author, define, put

HOME, GRAPH, ROOMS = "/House", "/House/Graph", "/House/Rooms"
DOC = """A home: /House/Graph says how its rooms lie to each other, each room's own graph what stands in it.
North is +X, east +Z, up +Y. Lengths are metres in the graphs."""


def home_layer(home: HomeGraph, plan: HomePlan | None = None, *, rooms: bool = True) -> Sdf.Layer:
    """A new anonymous layer with a home's graph, and where there is a plan, with the rooms in their places.

    Arguments:
        rooms: with each room's own graph; else only prims for what else says it.
    """
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.documentation = DOC
    layer.defaultPrim = HOME[1:]
    layer.pseudoRoot.SetInfo("metersPerUnit", 1.0)
    layer.pseudoRoot.SetInfo("upAxis", "Y")
    with Sdf.ChangeBlock():
        for path, kind in ((HOME, "assembly"), (ROOMS, "group")):
            define(layer, Sdf.Path(path), "Xform").kind = kind
        graph = define(layer, Sdf.Path(GRAPH), usd.HOME_TYPE)
        for name, value in usd.values_of(home, usd.HOME_FIELDS).items():
            put(graph, name, value)
        if home.entrance is not None:
            relate(graph, usd.ENTRANCE, room_path(home.entrance))
        for relation in home.relations:
            taken = {spec.name for spec in graph.nameChildren}
            name = usd.relation_name(relation.subject, relation.predicate, relation.object, taken)
            spec = Sdf.PrimSpec(graph, name, Sdf.SpecifierDef, usd.RELATION_TYPE)
            relate(spec, usd.SUBJECT, room_path(relation.subject))
            relate(spec, usd.OBJECT, room_path(relation.object))
            put(spec, usd.PREDICATE, relation.predicate)
        for room in home.rooms:
            spec = define(layer, room_path(room.name), "Xform")
            spec.SetInfo("apiSchemas", Sdf.TokenListOp.Create(prependedItems=[usd.ROOM_API]))
            if room.area is not None:
                put(spec, usd.AREA, room.area)
            if room.ratio != RATIO:
                put(spec, usd.RATIO, room.ratio)
            if plan is not None:
                pose = Gf.Matrix4d(*(np.round(plan.pose(room.name).T, 6) + 0.0).ravel().tolist())  # in metres
                say(spec, ops(**{"transform:home": ("matrix4d", pose)}))
            if rooms:
                author(layer, room.graph if plan is None else plan.graph(room.name), spec.path)
    return layer


def room_path(name: str) -> Sdf.Path:
    """Prim path of a room of a home."""
    return Sdf.Path(ROOMS).AppendChild(name)


def write_home(home: HomeGraph, path: Path, plan: HomePlan | None = None) -> None:
    """Write a home's stage, with its plan where there is one; raises StageError."""
    save_layer(home_layer(home, plan), path)


def read_home(stage: Usd.Stage) -> HomeGraph:
    """The graph of the home on a stage; raises StageError.

    What a plan says of a room (floor, walls, openings) is no part of what was asked of it.
    """
    with values.reading(stage):
        found = named_rooms(stage)
        graph = next((prim for prim in stage.Traverse() if prim.GetTypeName() == usd.HOME_TYPE), None)
        names = {prims.room.GetPath(): name for name, prims in found.items()}
        with faults(source(stage)):
            rooms = [
                HomeRoom(name, asked(room_graph(prims)), **stated_fields(prims.room, usd.HOME_ROOM_FIELDS))
                for name, prims in found.items()
            ]
            if graph is None:
                return HomeGraph(rooms)
            ways = [_relation(prim, names) for prim in graph.GetChildren() if prim.GetTypeName() == usd.RELATION_TYPE]
            entrance = [names.get(end, str(end)) for end in values.targets(graph, usd.ENTRANCE)]
            return HomeGraph(rooms, ways, entrance=next(iter(entrance), None), **stated_fields(graph, usd.HOME_FIELDS))


def asked(graph: SceneGraph) -> SceneGraph:
    """The graph of a room without what a plan says of it."""
    return graph.with_room(floor_polygon=None, size=None, walls=(), openings=()) if graph.room.walls else graph


def read_poses(path: Path) -> dict[str, tuple[SceneGraph, np.ndarray]]:
    """Of every room of a stage its graph as it stands there, and (4, 4) float, its pose in metres, +Y up."""
    stage = open_stage(path)
    with values.reading(stage):
        cache, turn, out = UsdGeom.XformCache(values.NOW), to_metres(stage), {}
        for name, prims in named_rooms(stage).items():
            pose = turn @ values.matrix(cache.GetLocalToWorldTransform(prims.room), prims.room)
            lean = np.arctan2(pose[0, 2] - pose[2, 0], pose[0, 0] + pose[2, 2])
            pose[:3, :3] = upright(lean)  # the nearest: rooms are made upright and in metres
            out[name] = (room_graph(prims), pose)
        return out


@dataclass(frozen=True, eq=False)
class Standing:
    """A piece of furniture of a home: its node, footprint (4, 2) in the home's frame, and its lower side, metres."""

    node: Node
    corners: np.ndarray
    low: float


def furniture(plan: HomePlan, path: Path) -> list[Standing]:
    """What stands or hangs on walls in the rooms of a home on a stage, where it has a place."""
    found: list[Standing] = []
    if path.suffix.lower() not in STAGE_FORMS:
        return found
    stage = open_stage(path)
    for name, prims in named_rooms(stage).items():
        pose = plan.pose(name)
        for thing in read_contents(prims).objects:
            if vocabulary().category(thing.node.category).support == "ceiling":
                continue
            around = footprints(*(np.array([v], float) for v in (thing.size, thing.position, thing.yaw)))[0]
            corners = around @ pose[[0, 2]][:, [0, 2]].T + pose[[0, 2], 3]
            found.append(Standing(thing.node, corners, float(thing.position[1])))
    return found


def named_rooms(stage: Usd.Stage) -> dict[str, RoomPrims]:
    """The rooms of a stage, each by the name of its prim where it is the only one so called, else by its path."""
    found = {prims.room.GetPath(): prims for prims in find_rooms(stage)}
    often = [path.name for path in found]
    return {
        path.name if often.count(path.name) == 1 else str(path).strip("/").replace("/", "_"): prims
        for path, prims in found.items()
    }


def _relation(prim: Usd.Prim, names: Mapping[Sdf.Path, str]) -> HomeRelation:
    ends = []
    for end in (usd.SUBJECT, usd.OBJECT):
        targets = values.targets(prim, end)
        if len(targets) != 1 or targets[0] not in names:
            listed = ", ".join(map(str, targets)) or "nothing"
            raise StageError(f"{place(prim)}: {end} points to {listed}, allowed: one room of the home")
        ends.append(names[targets[0]])
    with faults(place(prim)):
        return HomeRelation(ends[0], str(value(prim, usd.PREDICATE)), ends[1])
