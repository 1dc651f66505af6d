"""Houses of simulators (ProcTHOR, Holodeck, SceneSmith, SAGE, Infinigen), RoomPlan's scans, Sweet Home 3D."""

import ast
import io
import math
import re
import zipfile
from collections import Counter
from typing import Any
from xml.etree import ElementTree

import numpy as np
import shapely

from echomodel.bounded import unpacking
from echomodel.files import raising
from echousd.graph import GraphError
from echousd.home.importing.found import MAP, SCREEN, Drawn, Hole, Piece, Room, long_sides, rooms_between, span
from echousd.shapes.walls import outline as offset

UNITY = "metres, left-handed with +Y up as Unity has it; its +z is our north"
Z_UP = "metres, z up; its +y is our north"
SHAPE = re.compile(r"\s*(?:shapely\.)?(box|Polygon|LineString)\s*\((.*)\)\s*", re.DOTALL)
LONGEST = 20_000  # characters of one shape
# ProcTHOR's types of rooms by ours: others are living rooms.
THOR = {"kitchen": "Kitchen", "bathroom": "Bathroom", "bedroom": "Bedroom", "childrens_room": "Bedroom"}


def read_procthor(data: Any) -> Drawn:
    """ProcTHOR 1.0.0 and Holodeck: walls without a surface are passages, holes count along their first wall.

    What only our own plans have (names and types of rooms, thickness of walls, leaves) stands in `metadata`.
    """
    ours = (data.get("metadata") or {}).get("echousd") or {"rooms": {}, "doors": {}}
    rooms = [_procthor_room(one, ours["rooms"].get(str(one["id"])), data) for one in data["rooms"]]
    walls = {str(wall["id"]): _flat(wall["polygon"]) for wall in data.get("walls", ()) if wall.get("polygon")}
    holes = []
    for kind in ("door", "window"):
        for one in data.get(f"{kind}s", ()):
            low, high = one["holePolygon"][:2]
            if one.get(f"{kind}Segment"):
                ends = np.array(one[f"{kind}Segment"], float) @ MAP.T
            else:
                start, *_ = corners = walls[str(one["wall0"])]
                along = corners[np.linalg.norm(corners - start, axis=1).argmax()] - start
                unit = along / np.linalg.norm(along)
                ends = start + unit * np.array([[low["x"]], [high["x"]]], float)
            passage = str(one.get("assetId", "")).startswith("Doorframe")  # without a leaf
            height = abs(high["y"] - low["y"])
            sill = min(low["y"], high["y"]) if kind == "window" else None
            tips = None
            if leaf := ours["doors"].get(str(one["id"])):
                hinge, tip = _flat([leaf["hinge"], leaf["tip"]])
                ends, tips = ends[np.linalg.norm(ends - hinge, axis=1).argsort()], tip[None]
            holes.append(Hole(str(one["id"]), "passage" if passage else kind, ends[None], height, sill, tips=tips))
    holes += [Hole(str(wall["id"]), "passage", walls[str(wall["id"])][None, :2]) for wall in _open_walls(data)]
    by_name = {room.name: shapely.Polygon(room.corners) for room in rooms}
    for pair in data.get("open_room_pairs", ()):
        shared = by_name[str(pair[0])].intersection(by_name[str(pair[1])])
        if shared.length > 0.5:
            ends = np.array(shapely.line_merge(shared).minimum_rotated_rectangle.coords)[[0, -1]]
            holes.append(Hole(f"{pair[0]} open to {pair[1]}", "passage", ends[None]))
    pieces, ignored = [], Counter[str]()
    for one in data.get("objects", ()):
        ignored["small things on furniture"] += len(one.get("children") or ())
        where, turn = one["position"], math.radians(one.get("rotation", {}).get("y", 0.0))
        at = np.array([where["z"], where["y"], where["x"]], float)
        word = str(one.get("object_name") or one["id"]).split("|")[0].split("-")[0]
        front = np.array([math.cos(turn), math.sin(turn)])
        pieces.append(Piece(word, (word, str(one.get("assetId", ""))), at, front))
    return Drawn(UNITY, rooms, holes, pieces, ignored=ignored)


def _procthor_room(one: Any, ours: Any, data: Any) -> Room:
    """A room; of a plan of ours, if nobody changed its type or corners since, its floor between the walls."""
    corners, name = _flat(one["floorPolygon"]), str(one["id"])
    words: tuple[str, ...] = (str(one["roomType"]),)
    if ours and THOR.get(ours["type"], "LivingRoom") == one["roomType"]:
        name, words = str(ours["name"]), (str(ours["type"]), *words)
    if ours and len(ours["walls"]) == len(corners):
        corners = offset(corners, [-float(thick) for thick in ours["walls"]])
    return Room(name, words, corners, _ceiling(one, data))


def _flat(corners: Any) -> np.ndarray:
    return np.array([(corner["x"], corner["z"]) for corner in corners], float) @ MAP.T


def _ceiling(room: Any, data: Any) -> float | None:
    tops = [c["y"] for wall in data.get("walls", ()) if wall.get("roomId") == room["id"] for c in wall["polygon"]]
    return data.get("wall_height") or max(tops, default=None)


def _open_walls(data: Any) -> list[Any]:
    """One of each two walls without a surface."""
    found: dict[Any, Any] = {}
    for wall in data.get("walls", ()):
        if wall.get("empty"):
            found.setdefault(tuple(sorted({(c["x"], c["z"]) for c in wall["polygon"]})), wall)
    return list(found.values())


def read_scenesmith(data: Any) -> Drawn:
    """SceneSmith's house layout: rectangles with walls and what opens in them, from a wall's start to its near side."""
    kinds = {str(room["id"]): str(room.get("type", "")) for room in data.get("rooms", ())}
    rooms: list[Room] = []
    holes: dict[str, Hole] = {}
    for room in data["placed_rooms"]:
        name, walls = str(room["room_id"]), room["walls"]
        ends = np.array([[p[0], p[1]] for w in walls for p in (w["start_point"], w["end_point"])])
        low, high = ends.min(0), ends.max(0)
        corners = np.array([low, (high[0], low[1]), high, (low[0], high[1])]) @ MAP.T
        rooms.append(Room(name, (kinds.get(name, ""), name), corners, data.get("wall_height")))
        for wall in walls:
            start, end = (np.array(wall[key][:2], float) @ MAP.T for key in ("start_point", "end_point"))
            unit = (end - start) / np.linalg.norm(end - start)
            for one in wall.get("openings", ()):
                kind = str(one["opening_type"]).lower().replace("open", "passage")
                along = one["position_along_wall"]
                ends = start + unit * np.array([[along], [along + one["width"]]])
                key = str(one["opening_id"])
                holes.setdefault(key, Hole(key, kind, ends[None], one.get("height"), one.get("sill_height")))
    return Drawn(Z_UP, rooms, [*holes.values()])


def read_sage(data: Any) -> Drawn:
    """SAGE's layout: rooms with walls, doors and windows at a share of their wall, objects as boxes."""
    rooms, holes, pieces = [], [], []
    for room in data["rooms"]:
        points = {str(w["id"]): np.array([_xy(w["start_point"]), _xy(w["end_point"])]) @ MAP.T for w in room["walls"]}
        box = shapely.MultiPoint(np.concatenate([*points.values()])).envelope
        corners = np.array(box.exterior.coords)[:-1]
        words = (str(room["room_type"]),)
        rooms.append(Room(str(room.get("id", room["room_type"])), words, corners, room.get("ceiling_height")))
        for kind in ("door", "window"):
            for one in room.get(f"{kind}s", ()):
                start, end = points[str(one["wall_id"])]
                ends = span(start + (end - start) * one["position_on_wall"], end - start, one["width"])
                kind_of = "passage" if one.get("opening") is True and kind == "door" else kind
                holes.append(Hole(str(one["id"]), kind_of, ends, one.get("height"), one.get("sill_height")))
        for one in room.get("objects", ()):
            turn = math.radians((one.get("rotation") or {}).get("z", 0.0))
            size, where = one["dimensions"], one["position"]
            at = np.array([where["y"], where.get("z", 0.0), where["x"]], float)
            front = np.array([math.cos(turn), -math.sin(turn)])  # +y of the source, turned about its z
            extents = np.array([size["width"], size["height"], size["length"]], float)
            pieces.append(Piece(str(one["type"]), (str(one["type"]),), at, front, extents, sides=2))
    return Drawn(Z_UP, rooms, holes, pieces)


def _xy(point: Any) -> tuple[float, float]:
    return (point["x"], point["y"]) if isinstance(point, dict) else (point[0], point[1])


def read_infinigen(data: Any) -> Drawn:
    """Infinigen's plans: shapes by name, stated as a call of shapely's or as its name and arguments; none is called."""
    rooms = []
    for name, entry in data["rooms"].items():
        words, _, number = name.partition("_")
        level = number.partition("/")[0]
        rooms.append(Room(name, (words.replace("-", " "),), _shape(name, entry), storey=level))
    levels = sorted({room.storey for room in rooms})
    holes = [
        Hole(name, kind, ends := _ends(name, entry), storey=_level(ends, rooms))
        for key, kind in (("doors", "door"), ("opens", "passage"), ("interiors", "passage"), ("windows", "window"))
        for name, entry in (data.get(key) or {}).items()
    ]
    entrance = data.get("entrance")
    if isinstance(entrance, dict) and ("shape" in entrance or "operation" in entrance):
        ends = _ends("entrance", entrance)
        holes.append(Hole("entrance", "door", ends, storey=_level(ends, rooms)))
    return Drawn(Z_UP, rooms, holes, storeys=levels)


def _level(ends: np.ndarray, rooms: list[Room]) -> str:
    """The storey in whose walls a hole lies, which is not stated; "" where several have one there."""
    off = [max(map(shapely.Polygon(room.corners).exterior.distance, shapely.points(ends[0]))) for room in rooms]
    near = {room.storey for room, far in zip(rooms, off, strict=True) if far < min(off) + 0.05}
    return near.pop() if len(near) == 1 else ""


def _ends(name: str, entry: Any) -> np.ndarray:
    middle, along, length, _ = long_sides(_shape(name, entry))
    return span(middle, along, length)


def _shape(name: str, entry: Any) -> np.ndarray:
    """(k, 2) float, the points of a shape."""
    if isinstance(entry, dict) and "operation" in entry:
        kind, args = str(entry["operation"]).rpartition(".")[2], entry["args"]
    else:
        text = str(entry["shape"] if isinstance(entry, dict) else entry)
        match = SHAPE.fullmatch(text[:LONGEST])
        if match is None:
            raise ValueError(f"{name}: {text[:60]!r}, allowed: shapely.box, Polygon or LineString of numbers")
        kind, args = match[1], list(ast.literal_eval(f"({match[2]},)"))  # numbers in brackets, nothing is run
    if kind == "box":
        low_x, low_y, high_x, high_y = args
        args = [[(low_x, low_y), (high_x, low_y), (high_x, high_y), (low_x, high_y)]]
    return np.array(args[0], float)[:, :2] @ MAP.T


UNPACKED = 64 * 2**20  # bytes of a Home.xml


def read_roomplan(data: Any) -> Drawn:
    """A scan of a room, or of a structure of several; it is turned until its walls lie along the axes."""
    scans = data.get("rooms") or [data]
    turn = _straight(scans)
    rooms: list[Room] = []
    holes, pieces, ignored = [], [], Counter[str]()
    for scan in scans:
        storey = str(scan.get("story", 0))
        labels = tuple(str(one.get("label", "")) for one in scan.get("sections") or ())
        heights = [wall["dimensions"][1] for wall in scan["walls"]]
        ground = min(map(_low, scan["walls"]), default=0.0)
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
                sill = max(_low(one) - ground, 0.0) if kind == "window" else None
                name, height = str(one.get("identifier", kind)), one["dimensions"][1]
                holes.append(Hole(name, kind, ends[None], height, sill, storey))
        for one in scan.get("objects") or ():
            word = next(iter(one["category"])) if isinstance(one.get("category"), dict) else str(one.get("category"))
            matrix, size = _matrix(one), np.array(one["dimensions"], float)
            at = matrix[:3, 3] - [0.0, size[1] / 2 + ground, 0.0]
            at[[0, 2]] = turn @ at[[0, 2]]
            pieces.append(Piece(word, (word,), at, turn @ matrix[[0, 2], 2], size, storey=storey))
    angle = math.degrees(math.atan2(turn[0, 1], turn[0, 0]))
    frame = f"metres, +Y up; turned by {angle:.1f} degrees until walls lie along the axes"
    storeys = sorted({room.storey for room in rooms}, key=lambda text: (len(text), text))
    return Drawn(frame, rooms, holes, pieces, storeys, ignored=ignored)


def _matrix(one: Any) -> np.ndarray:
    return np.array(one["transform"], float).reshape(4, 4).T  # stated column by column


def _across(one: Any) -> list[tuple[float, float, float]]:
    half = one["dimensions"][0] / 2
    return [(-half, 0.0, 0.0), (half, 0.0, 0.0)]


def _low(one: Any) -> float:
    return float(_matrix(one)[1, 3] - one["dimensions"][1] / 2)


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


def read_sweethome(content: bytes, name: str) -> Drawn:
    """The Home.xml in a file of Sweet Home 3D 5.3 or later; centimetres, y down, angles clockwise."""

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
    with raising(f"{name}: Home.xml cannot be read as XML", ElementTree.ParseError, kind=GraphError):
        home = ElementTree.fromstring(text)
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
    frame = "centimetres, up of the plan is our north"
    return Drawn(frame, rooms, holes, pieces, [*number.values()] or [""], [points for _, points in walls])
