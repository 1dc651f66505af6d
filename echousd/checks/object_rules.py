"""Rules on the objects of a room: upright, labelled once, as large and turned as the graph says, on a floor."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from pxr import Tf, Usd, UsdGeom

from echousd.checks.findings import Finding, Rule
from echousd.checks.reading import Reading
from echousd.graph.nodes import OBSTACLE
from echousd.stage import encoding as usd
from echousd.stage.contents import room_frame
from echousd.stage.encoding import StageError
from echousd.stage.labels import known_category
from echousd.stage.read import RoomPrims, value
from echousd.stage.values import matrix, texts

UPRIGHT = 0.5  # cosine of the angle between an object's up and the room's
SIZE = 0.05, 0.1  # metres, and share of the stated size: differences below either are none
FLOOR = usd.FLOOR_SIZE, usd.FLOOR_POLYGON
TURN = np.radians(15)


def upright(reading: Reading) -> Iterator[Finding]:
    """Objects stand the right way up: their own +Y (or +Z) points upwards in the room."""
    cache = reading.cache
    for room in reading.rooms:
        to_room = room_frame(room.room, cache)
        for prim in room.nodes:
            ups = _ups(prim, to_room, cache)
            if ups is not None and ups.max() < UPRIGHT:
                angle = np.degrees(np.arccos(np.clip(ups.max(), -1, 1)))
                yield Finding(prim.GetPath(), f"leans by {angle:.0f} degrees, allowed: upright")
        for prim in _others(room):
            ups = _ups(prim, to_room, cache)
            if ups is not None and ups[0] < -UPRIGHT and ups[1] < UPRIGHT:
                yield Finding(prim.GetPath(), "stands on its head, allowed: its own +Y (or +Z) upwards")


def _ups(prim: Usd.Prim, to_room: np.ndarray, cache: UsdGeom.XformCache) -> np.ndarray | None:
    """(2,) float, cosines of the angles between the room's up and a prim's own +Y and +Z; None = it has no axes."""
    try:
        own = to_room @ matrix(cache.GetLocalToWorldTransform(prim), prim)
    except (StageError, Tf.ErrorException):  # the rules on values report it
        return None
    length = np.linalg.norm(own[:3, 1:3], axis=0)
    return None if (length < 1e-9).any() else own[1, 1:3] / length


def one_label(reading: Reading) -> Iterator[Finding]:
    """An object has one label of the taxonomy `category`, and it is the category that the graph states."""
    for room in reading.rooms:
        for prim in room.nodes:
            try:
                words = texts(prim.GetAttribute(usd.LABELS))
                category = value(prim, usd.CATEGORY)
            except (StageError, Tf.ErrorException):
                continue
            if len(words) > 1:
                yield Finding(prim.GetPath(), f"{usd.LABELS} is {', '.join(words)}, allowed: one word")
            elif words and words[0] == value(prim, f"{usd.FREE}{OBSTACLE}"):
                continue
            elif words and isinstance(category, str) and known_category(words[0]) != known_category(category):
                yield Finding(prim.GetPath(), f"{usd.LABELS} is {words[0]!r}, {usd.CATEGORY} {category!r}")
        for prim in _others(room):
            try:
                words = texts(prim.GetAttribute(usd.LABELS))
            except (StageError, Tf.ErrorException):
                continue
            if len(words) > 1:
                yield Finding(prim.GetPath(), f"{usd.LABELS} is {', '.join(words)}, allowed: one word")


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


def floors(reading: Reading) -> Iterator[Finding]:
    """Every room with objects has a floor: stated by its graph or as labelled geometry."""
    for room in reading.rooms:
        stated = any(
            room.graph.GetAttribute(name).HasAuthoredValue() for name in FLOOR if room.graph.HasAttribute(name)
        )
        if room.nodes and not stated and not any(map(_is_floor, Usd.PrimRange(room.room))):
            allowed = f"{' or '.join(FLOOR)}, or geometry labelled 'floor'"
            yield Finding(room.graph.GetPath(), f"the room has no floor, allowed: {allowed}")


def _is_floor(prim: Usd.Prim) -> bool:
    try:
        return "floor" in texts(prim.GetAttribute(usd.LABELS))
    except (StageError, Tf.ErrorException):
        return False


def _others(room: RoomPrims) -> list[Usd.Prim]:
    """Components of a room that are no nodes of its graph: walls, floors, small things."""
    nodes = {prim.GetPath() for prim in room.nodes}
    found, walk = [], iter(Usd.PrimRange(room.room, Usd.TraverseInstanceProxies()))
    for prim in walk:
        if prim.GetPath() in nodes or (prim.IsModel() and not prim.IsGroup()):
            walk.PruneChildren()
            if prim.GetPath() not in nodes:
                found.append(prim)
    return found


def _shown(size: object) -> str:
    return " x ".join(f"{length:.3g}" for length in np.asarray(size))


RULES = (
    Rule("echo:Upright", "Objects stand the right way up.", upright),
    Rule("echo:OneLabel", "Objects have one label, that of their category.", one_label),
    Rule("echo:StatedBoxes", "Geometry is as large and turned as the graph states.", stated_boxes),
    Rule("echo:Floor", "Rooms have floors.", floors),
)
