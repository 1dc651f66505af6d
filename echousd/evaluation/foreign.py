"""Rooms from elsewhere: our USD, rooms files, SceneEval's states, Holodeck's and SceneSmith's JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from echomodel.data.roomset import load_rooms
from echomodel.roomboxes import RoomBoxes
from echomodel.vocabulary import vocabulary
from echousd.assets.naming import category_of
from echousd.folder.found import rooms_at
from echousd.stage.boxes import room_of
from echousd.stage.files import open_stage
from echousd.stage.foreign import boxed_graph
from echousd.stage.read import find_rooms

USD = (".usda", ".usdc", ".usd", ".usdz")
ASSETS = ("_data", "assets")  # folders beside SceneEval's states, or above, in which its models lie
HEIGHT = 2.8  # metres, of walls that nobody tells
BUFFER = 0.1  # metres that Holodeck adds to what an object covers
Object = tuple[str, np.ndarray, np.ndarray, float]  # word, size, position, yaw


def foreign_rooms(path: Path) -> list[RoomBoxes]:
    """The rooms at a path, whatever wrote them; the words are theirs.

    Raises ValueError that names the file, for none and for what cannot be read.
    """
    if path.is_dir():
        files = sorted(file for file in path.rglob("*.json") if not {*ASSETS} & {*file.relative_to(path).parts})
        found = [room for file in files for room in _from_json(file)]
        if found:
            return found
        stages = [(file, file.stem) for file in sorted(path.iterdir()) if file.suffix in USD]
        with suppress(ValueError):
            stages = [(file, file.parent.name) for file in rooms_at(path)]
        if not stages:
            raise ValueError(f"{path}: no room in this folder, allowed: rooms of ours, USD, rooms or scene JSON")
        return [room for file, name in stages for room in _from_usd(file, name)]
    if path.suffix in USD:
        return _from_usd(path, path.parent.name)
    rooms = load_rooms(path) if path.suffix == ".npz" else _from_json(path)
    if not rooms:
        raise ValueError(f"{path}: no rooms, a state of SceneEval, Holodeck's or SceneSmith's JSON")
    return rooms


def _from_usd(file: Path, name: str) -> list[RoomBoxes]:
    out = []
    stage = open_stage(file)
    for graph in map(boxed_graph, find_rooms(stage)):
        if graph.nodes:
            corners = graph.room.corners
            room = replace(room_of(graph, name), openings=graph.room.openings)
            out.append(room if corners is None else replace(room, floor_polygon=np.asarray(corners, float)))
    return out


def _from_json(file: Path) -> list[RoomBoxes]:
    try:
        raw = json.loads(file.read_text("utf-8"))
        match raw:
            case {"format": "sceneState"}:
                return [_sceneeval(raw["scene"], file)]
            case {"rooms": list(), "objects": list(), "walls": _}:
                return [_holodeck(raw, room, file) for room in raw["rooms"]]
            case {"rooms": list()}:
                return load_rooms(file)
            case {"room_type": _, "objects": list(), "floor_polygon": _}:
                return [RoomBoxes.from_json(raw)]
            case {"objects": dict()}:
                return [_scenesmith(raw, file)]
    except (KeyError, TypeError, IndexError, json.JSONDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{file}: not a room as it says ({type(error).__name__} {error})") from None
    return []


def _room(name: str, kind: str, floor: Iterable[Iterable[float]], height: float, found: list[Object]) -> RoomBoxes:
    """A room of objects; a type that we do not know is told by its name, else a living room."""
    known = vocabulary().room_types
    words = [row.name for row in known if row.name in kind.lower().replace(" ", "_")]
    return RoomBoxes(
        id=name,
        room_type=words[0] if words else "living_room",
        floor_polygon=np.array([tuple(corner) for corner in floor], float).reshape(-1, 2),
        height=height,
        categories=tuple(category_of([], word, dims=size)[0] or word for word, size, *_ in found),
        size=np.array([size for _, size, _, _ in found], float).reshape(-1, 3),
        position=np.array([place for _, _, place, _ in found], float).reshape(-1, 3),
        yaw=np.array([yaw for *_, yaw in found], float),
    )


def _sceneeval(scene: dict[str, Any], file: Path) -> RoomBoxes:
    """Z up; what an object is and how large says its model."""
    elements = scene["arch"]["elements"]
    floor: list = next((e["points"] for e in elements if e["type"] == "Floor"), [])
    heights = [float(e["height"]) for e in elements if e["type"] == "Wall"]
    found: list[Object] = []
    for entry in scene["object"]:
        matrix = np.array(entry["transform"]["data"], float).reshape(4, 4).T
        word, bounds = _model(entry["modelId"], file)
        corners = trimesh.bounds.corners(bounds) @ matrix[:3, :3].T + matrix[:3, 3]
        scale = np.linalg.norm(matrix[:3, :3], axis=0)
        front = matrix[:3, 2]  # a model's front is its +Z, as in glTF
        middle = matrix[:3, :3] @ bounds.mean(0) + matrix[:3, 3]
        place = np.array([middle[0], corners[:, 2].min(), -middle[1]])
        size = (bounds[1] - bounds[0]) * scale
        found.append((word, size, place, math.atan2(front[0], -front[1])))
    kind = " ".join(sorted({str(e.get("roomId", "")) for e in elements}))
    return _room(file.stem, kind, ((x, -y) for x, y, _ in floor), max(heights, default=HEIGHT), found)


@cache
def _model(name: str, file: Path) -> tuple[str, np.ndarray]:
    """What a model is called and its bounds (2, 3), metres; raises ValueError that names the file that is missing."""
    number = name.rpartition(".")[2]
    for top in (file.parent, *list(file.parents)[1:3]):
        for folder in (place for kind in ASSETS for place in sorted((top / kind).glob(f"*/{number}"))):
            told = json.loads((folder / "data.json").read_text("utf-8"))["annotations"]
            return str(told["category"]), np.asarray(trimesh.load_scene(folder / f"{number}.glb").bounds, float)
    wanted = f"_data/<data set>/{number}/{number}.glb"
    raise ValueError(f"{file}: model {name} is not there, wanted: {wanted} beside it or above")


def _holodeck(house: dict[str, Any], room: dict[str, Any], file: Path) -> RoomBoxes:
    """Left-handed with Y up: x is mirrored. Footprints in centimetres with a rim, heights from the middles."""
    found: list[Object] = []
    for entry in house["objects"]:
        if entry.get("roomId") != room["id"] or "vertices" not in entry:
            continue
        plan = np.ptp(np.array(entry["vertices"], float), axis=0) / 100 - BUFFER
        turned = round(entry["rotation"]["y"] / 90) % 2 == 1
        place = entry["position"]
        size = np.array([plan[1] if turned else plan[0], 2 * place["y"], plan[0] if turned else plan[1]]).clip(0.02)
        name = entry.get("object_name", entry["id"])
        where = np.array([-place["x"], 0.0, place["z"]])
        found.append((name.rpartition("-")[0] or name, size, where, -math.radians(entry["rotation"]["y"])))
    floor = [(-point["x"], point["z"]) for point in room["floorPolygon"]]
    height = float(house.get("wall_height", HEIGHT))
    return _room(f"{file.stem} {room['id']}", str(room.get("roomType", "")), floor, height, found)


def _scenesmith(raw: dict[str, Any], file: Path) -> RoomBoxes:
    """Z up, fronts along +Y; bounds in the object's frame, a pose with a quaternion."""
    found: list[Object] = []
    for entry in raw["objects"].values():
        if entry.get("object_type") in ("wall", "floor") or not entry.get("bbox_min"):
            continue
        low, high = np.array(entry["bbox_min"], float), np.array(entry["bbox_max"], float)
        w, x, y, z = entry["transform"]["rotation_wxyz"]
        turn = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        cos, sin, middle = math.cos(turn), math.sin(turn), (low + high) / 2
        at = np.array(entry["transform"]["translation"], float)
        plan = at[:2] + np.array([cos * middle[0] - sin * middle[1], sin * middle[0] + cos * middle[1]])
        size = (high - low)[[0, 2, 1]]
        place = np.array([plan[0], at[2] + low[2], -plan[1]])
        found.append((entry["name"], size, place, turn + math.pi))
    outline = raw.get("room_geometry") or {}
    x, z = (float(outline.get(side, 0)) / 2 for side in ("length", "width"))
    floor = [(-x, -z), (x, -z), (x, z), (-x, z)] if x and z else []
    return _room(file.stem, str(raw.get("room_type", "")), floor, float(outline.get("wall_height", HEIGHT)), found)
