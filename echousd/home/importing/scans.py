"""Homes that people measured or drew: Apple's RoomPlan (JSON) and Sweet Home 3D (.sh3d)."""

from __future__ import annotations

import io
import math
import zipfile
from collections import Counter
from typing import Any

import numpy as np

from echomodel.files import unpacking
from echousd.graph import GraphError
from echousd.home.importing.found import SCREEN, Found, Hole, Piece, Room, rooms_between, span

UNPACKED = 64 * 2**20  # bytes of a Home.xml


def read_roomplan(data: Any) -> Found:
    """A scan of a room, or of a structure of several; it is turned until its walls lie along the axes."""
    scans = data.get("rooms") or [data]
    turn = _straight(scans)
    rooms: list[Room] = []
    holes, pieces, ignored = [], [], Counter[str]()
    for scan in scans:
        storey = str(scan.get("story", 0))
        labels = tuple(str(one.get("label", "")) for one in scan.get("sections") or ())
        heights = [wall["dimensions"][1] for wall in scan["walls"]]
        outlines = [_points(one, one.get("polygonCorners")) for one in scan.get("floors") or ()]
        outlines = [points for points in outlines if len(points) > 2]
        if not outlines:
            outlines = rooms_between([_points(wall, _across(wall)) for wall in scan["walls"]])
        for number, points in enumerate(outlines):
            name = labels[number] if number < len(labels) else f"room_{len(rooms) + 1}"
            rooms.append(Room(name, labels[number:] or labels, points @ turn.T, max(heights, default=None), storey))
        for key, kind in (("doors", "door"), ("openings", "passage"), ("windows", "window")):
            for one in scan.get(key) or ():
                ends = _points(one, _across(one)) @ turn.T
                low = _matrix(one)[1, 3] - one["dimensions"][1] / 2 - min((_low(w) for w in scan["walls"]), default=0.0)
                sill = max(float(low), 0.0) if kind == "window" else None
                holes.append(
                    Hole(str(one.get("identifier", kind)), kind, ends[None], one["dimensions"][1], sill, storey)
                )
        for one in scan.get("objects") or ():
            word = next(iter(one["category"])) if isinstance(one.get("category"), dict) else str(one.get("category"))
            matrix, size = _matrix(one), np.array(one["dimensions"], float)
            at = matrix[:3, 3] - [0.0, size[1] / 2 + min((_low(w) for w in scan["walls"]), default=0.0), 0.0]
            at[[0, 2]] = turn @ at[[0, 2]]
            pieces.append(Piece(word, (word,), at, turn @ matrix[[0, 2], 2], size, storey=storey))
    angle = math.degrees(math.atan2(turn[0, 1], turn[0, 0]))
    frame = f"metres, +Y up; turned by {angle:.1f} degrees until walls lie along the axes"
    storeys = sorted({room.storey for room in rooms}, key=lambda text: (len(text), text))
    return Found(frame, rooms, holes, pieces, storeys, ignored=ignored)


def _matrix(one: Any) -> np.ndarray:
    return np.array(one["transform"], float).reshape(4, 4).T  # stated column by column


def _across(one: Any) -> list[tuple[float, float, float]]:
    half = one["dimensions"][0] / 2
    return [(-half, 0.0, 0.0), (half, 0.0, 0.0)]


def _low(wall: Any) -> float:
    return float(_matrix(wall)[1, 3] - wall["dimensions"][1] / 2)


def _points(one: Any, corners: Any) -> np.ndarray:
    """(k, 2) float in plan, of corners in a surface's own frame."""
    local = np.array(corners or np.zeros((0, 3)), float).reshape(-1, 3)
    matrix = _matrix(one)
    return (local @ matrix[:3, :3].T + matrix[:3, 3])[:, [0, 2]]


def _straight(scans: Any) -> np.ndarray:
    """(2, 2) float: the turn of at most 45 degrees that lays most metres of wall along the axes."""
    walls = [np.diff(_points(wall, _across(wall)), axis=0)[0] for scan in scans for wall in scan["walls"]]
    if not walls:
        return np.eye(2)
    angles, lengths = np.array([math.atan2(w[1], w[0]) for w in walls]), np.linalg.norm(walls, axis=1)
    lean = np.angle((lengths * np.exp(4j * angles)).sum()) / 4  # a quarter turn is no turn of a rectangle
    cos, sin = math.cos(-lean), math.sin(-lean)
    return np.array([[cos, -sin], [sin, cos]])


def read_sweethome(content: bytes, name: str) -> Found:
    """The Home.xml in a file of Sweet Home 3D 5.3 or later; centimetres, y down, angles clockwise."""
    from xml.etree import ElementTree

    with unpacking(name), zipfile.ZipFile(io.BytesIO(content)) as archive:
        if "Home.xml" not in archive.namelist():
            raise GraphError(
                f"{name}: no Home.xml (before Sweet Home 3D 5.3 a file is a serialised Java object), "
                "allowed: the file saved again by a later version"
            )
        if archive.getinfo("Home.xml").file_size > UNPACKED:
            raise GraphError(f"{name}: Home.xml has more than {UNPACKED >> 20} MiB, allowed: that much")
        text = archive.read("Home.xml")
    if b"<!ENTITY" in text:
        raise GraphError(f"{name}: Home.xml defines entities, allowed: none")
    try:
        home = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise GraphError(f"{name}: Home.xml cannot be read as XML ({error})") from None
    levels = sorted(home.iter("level"), key=lambda one: float(one.get("elevation", 0)))
    number = {one.get("id", ""): str(place) for place, one in enumerate(levels)}
    high = float(home.get("wallHeight", 250)) / 100

    def storey(one: ElementTree.Element) -> str:
        return number.get(one.get("level", ""), "")

    def point(one: ElementTree.Element, *keys: str) -> np.ndarray:
        return np.array([float(one.get(key, "nan")) for key in keys]) / 100 @ SCREEN.T

    rooms: list[Room] = []
    for one in home.iter("room"):
        called, corners = one.get("name", ""), np.array([point(each, "x", "y") for each in one.iter("point")])
        rooms.append(Room(called or f"room_{len(rooms) + 1}", (called,), corners, high, storey(one)))
    walls = [(w, np.array([point(w, "xStart", "yStart"), point(w, "xEnd", "yEnd")])) for w in home.iter("wall")]
    if not rooms:
        for level in dict.fromkeys(storey(wall) for wall, _ in walls):
            inside = rooms_between([points for wall, points in walls if storey(wall) == level])
            rooms += [Room(f"room_{n + 1}", (), corners, high, level) for n, corners in enumerate(inside)]
    holes, pieces = [], []
    for one in home.iter():
        if one.tag not in ("doorOrWindow", "pieceOfFurniture", "light"):
            continue
        turn, called = float(one.get("angle", 0)), one.get("name") or one.get("catalogId") or "piece"
        along = SCREEN @ [math.cos(turn), math.sin(turn)]
        middle, above = point(one, "x", "y"), float(one.get("elevation", 0)) / 100
        size = np.array([float(one.get(key, "nan")) for key in ("width", "height", "depth")]) / 100
        if one.tag == "doorOrWindow":
            words = f"{called} {one.get('catalogId', '')}".lower()
            kind = "window" if above > 0.3 or "window" in words else "passage" if one.find("sash") is None else "door"
            sill = above if kind == "window" else None
            holes.append(Hole(called, kind, span(middle, along, float(size[0])), float(size[1]), sill, storey(one)))
        else:
            at = np.array([middle[0], above, middle[1]])
            front = SCREEN @ [-math.sin(turn), math.cos(turn)]
            pieces.append(Piece(called, (called, one.get("catalogId", "")), at, front, size, storey=storey(one)))
    told = "centimetres, up of the plan is our north"
    return Found(told, rooms, holes, pieces, [*number.values()] or [""], [points for _, points in walls])
