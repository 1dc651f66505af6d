"""Rules on the objects of a room: upright, labelled once, as large and turned as the graph says, on a floor."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from pxr import Kind, Usd, UsdGeom

from echomodel.dressing import SMALL
from echousd.checks.findings import UNREADABLE, Finding, applied, rule
from echousd.checks.reading import Reading, below
from echousd.graph.nodes import OBSTACLE
from echousd.stage import encoding as usd
from echousd.stage.contents import components, is_seen, room_frame
from echousd.stage.labels import known_category
from echousd.stage.read import RoomPrims, value
from echousd.stage.taxonomy import SHELL
from echousd.stage.values import texts

UPRIGHT = 0.5  # cosine of the angle between an object's up and the room's
SIZE = 0.05, 0.1  # metres, and share of the stated size: differences below either are none
FLOOR = usd.FLOOR_SIZE, usd.FLOOR_POLYGON
TURN = np.radians(15)


@rule("echo:Upright")
def upright(reading: Reading) -> Iterator[Finding]:
    """Objects stand the right way up: their own +Y (or +Z) points upwards in the room."""
    for room in reading.rooms:
        to_room = room_frame(room.room, reading.cache)
        for prim in (*room.nodes, *components(room)):
            try:
                own = to_room @ reading.world(prim)
            except UNREADABLE:
                continue
            length = np.linalg.norm(own[:3, 1:3], axis=0)
            if (length < 1e-9).any():
                continue
            ups = own[1, 1:3] / length  # cosines of the angles between the room's up and its own +Y and +Z
            if prim in room.nodes and ups.max() < UPRIGHT:
                angle = np.degrees(np.arccos(np.clip(ups.max(), -1, 1)))
                yield Finding(prim.GetPath(), f"leans by {angle:.0f} degrees, allowed: upright")
            elif prim not in room.nodes and ups[0] < -UPRIGHT and ups[1] < UPRIGHT:
                yield Finding(prim.GetPath(), "stands on its head, allowed: its own +Y (or +Z) upwards")


@rule("echo:OneLabel", "labelled")
def one_label(reading: Reading, prim: Usd.Prim) -> Iterator[str]:
    """An object has one label of the taxonomy `category`, and it is the category that the graph states."""
    words, category = texts(prim.GetAttribute(usd.LABELS)), value(prim, usd.CATEGORY)
    if len(words) > 1:
        yield f"{usd.LABELS} is {', '.join(words)}, allowed: one word"
    elif not words or prim not in reading.nodes or words[0] == value(prim, f"{usd.FREE}{OBSTACLE}"):
        return
    elif isinstance(category, str) and known_category(words[0]) != known_category(category):
        yield f"{usd.LABELS} is {words[0]!r}, {usd.CATEGORY} {category!r}"


@rule("echo:StatedBoxes")
def stated_boxes(reading: Reading) -> Iterator[Finding]:
    """Geometry is as large and turned as the graph states."""
    for room in reading.rooms:
        paths = {prim.GetName(): prim.GetPath() for prim in room.nodes if _states(prim, (usd.SIZE, usd.YAW))}
        for thing in reading.contents(room).objects if paths else ():
            node = thing.node
            if node.name not in paths or not len(thing.points):
                continue
            if node.size is not None:
                apart = np.abs(thing.size - node.size)
                if (apart > np.maximum(SIZE[0], SIZE[1] * np.array(node.size))).any():
                    told = f"{usd.SIZE} is {_shown(node.size)}, its geometry {_shown(thing.size)} metres"
                    yield Finding(paths[node.name], told)
            if node.yaw is not None:
                turn = (thing.yaw - node.yaw + np.pi) % (2 * np.pi) - np.pi
                if abs(turn) > TURN:
                    told = f"{usd.YAW} is {node.yaw:.3g}, it is turned by {thing.yaw:.3g} radians"
                    yield Finding(paths[node.name], told)


def _states(prim: Usd.Prim, names: tuple[str, ...]) -> bool:
    """Whether a prim has a value for one of some attributes."""
    return any(prim.GetAttribute(name).HasAuthoredValue() for name in names if prim.HasAttribute(name))


@rule("echo:Floor")
def floors(reading: Reading) -> Iterator[Finding]:
    """Every room with objects has a floor, stated by its graph or as labelled geometry; nobody switched it off."""
    for prim in reading.inactive:
        word = next(iter(_words(prim)), "")
        if word in SHELL:
            yield Finding(prim.GetPath(), f"the {word} is deactivated", warning=word != "floor")
    for room in reading.rooms:
        stated = any(
            room.graph.GetAttribute(name).HasAuthoredValue() for name in FLOOR if room.graph.HasAttribute(name)
        )
        if stated and any("wall" in _words(prim) for prim in components(room)) and not _has_floor(room, reading):
            yield Finding(room.room.GetPath(), "the room has walls, but no floor")
        if room.nodes and not stated and not any("floor" in _words(prim) for prim in below(room.room)):
            allowed = f"{' or '.join(FLOOR)}, or geometry labelled 'floor'"
            yield Finding(room.graph.GetPath(), f"the room has no floor, allowed: {allowed}")


def _has_floor(room: RoomPrims, reading: Reading) -> bool:
    """Whether a room has geometry that is labelled as its floor, or one that is reported as switched off."""
    return any("floor" in _words(prim) for prim in (*below(room.room), *reading.inactive))


def _words(prim: Usd.Prim) -> tuple[str, ...]:
    try:
        return texts(prim.GetAttribute(usd.LABELS))
    except UNREADABLE:
        return ()


@rule("echo:SomeLabel", "distinct")
def some_label(_reading: Reading, prim: Usd.Prim) -> Iterator[str]:
    """A prim that carries semantics labels has one of each taxonomy that it applies."""
    for schema in applied(prim):
        kind, taxonomy = Usd.SchemaRegistry.GetTypeNameAndInstance(schema)
        attribute = prim.GetAttribute(f"semantics:labels:{taxonomy}")
        if kind == "SemanticsLabelsAPI" and not (attribute and attribute.Get()):
            yield f"semantics:labels:{taxonomy} is empty, allowed: a word"


@rule("echo:Kinds")
def kinds(reading: Reading) -> Iterator[Finding]:
    """Kinds are known; components lie below groups and not in one another; furniture is components."""
    nodes = {prim.GetPath() for prim in reading.nodes}
    modelled = any(_kind(prim) == "component" for prim in reading.nodes)
    groups = {prim.GetParent() for prim in reading.prims if _kind(prim) == "component"}
    groups = {prim for prim in groups if _kind(prim) == "group"}
    for prim in reading.prims:
        kind = _kind(prim)
        node = prim.GetPath() in nodes
        above = prim.GetParent()
        if not kind:
            if (node and modelled) or (prim.IsA(UsdGeom.Xform) and above in groups):
                yield Finding(prim.GetPath(), "has no kind, allowed among components: component")
            continue
        if not Kind.Registry.HasKind(kind):
            yield Finding(prim.GetPath(), f"kind is {kind!r}, allowed: component, subcomponent, group, assembly")
        elif Kind.Registry.IsA(kind, "model") and not prim.IsModel():
            while _kind(above) in ("group", "assembly"):
                above = above.GetParent()
            found = _kind(above) or "none"
            if not any(above.GetPath().HasPrefix(room.room.GetPath()) for room in reading.rooms):
                continue  # a room below the prims of others
            yield Finding(
                prim.GetPath(), f"kind is {kind!r} below <{above.GetPath()}> of kind {found!r}, allowed: group"
            )
        elif node and prim.IsGroup() and not any(each.IsModel() and not each.IsGroup() for each in below(prim)):
            yield Finding(prim.GetPath(), f"kind is {kind!r} of an object, allowed: component")


def _kind(prim: Usd.Prim) -> str:
    return str(prim.GetMetadata("kind") or "")


@rule("echo:Hidden", "nodes")
def hidden(_reading: Reading, prim: Usd.Prim) -> Iterator[str]:
    """Something is seen of an object that has surfaces at all."""
    surfaces = [found for found in below(prim) if found.IsA(UsdGeom.Gprim)]
    if surfaces and not any(map(is_seen, surfaces)):
        yield "nothing of it is seen: its surfaces are invisible or guides"


@rule("echo:Strangers")
def strangers(reading: Reading) -> Iterator[Finding]:
    """Furniture that no graph knows stands in no room that has one."""
    for room in reading.rooms:
        for prim in components(room) if room.nodes else ():
            word = next(iter(_words(prim)), "")
            if word not in SMALL and word not in SHELL and known_category(word) is not None:
                yield Finding(prim.GetPath(), f"a {word} that is no node of the graph", warning=True)


def _shown(size: object) -> str:
    return " x ".join(f"{length:.3g}" for length in np.asarray(size))
