"""A room for SceneEval: its `sceneState`, and a glb with what it is for every object, where that looks for them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from echousd.exporting.glb import object_glb
from echousd.graph import SceneGraph
from echousd.stage.files import open_stage, write_all
from echousd.stage.foreign import boxed_graph
from echousd.stage.read import node_names, the_room

Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])  # our (x, y, z) is (x, -z, y) there
ASSETS, PREFIX = Path("_data/layoutvlm-objathor"), "layoutvlm-objaverse"
HEIGHT = 2.8  # metres, of walls that nobody states


def export_sceneeval(room: str | Path, out: Path, *, method: str = "EchoUSD", scene: int = 0) -> list[Path]:
    """Write `input/METHOD/scene_N.json` and the models below `_data`, as SceneEval's own folder has them.

    Raises ValueError for a room without a floor or with an object that has no place, and as `export`.
    """
    stage = open_stage(room)
    prims = the_room(stage, None)
    graph = boxed_graph(prims)
    state = scene_state(graph)  # raises before anything is written
    files: dict[Path, bytes] = {
        out / "input" / method / f"scene_{scene}.json": (json.dumps(state, indent=1) + "\n").encode()
    }
    for path, name in node_names(prims).items():
        node, number = graph.node(name), model_name(name)
        told = {"category": node.category.replace("_", " "), "description": f"a {node.category.replace('_', ' ')}"}
        folder = out / ASSETS / number
        files[folder / f"{number}.glb"] = object_glb(stage, prims.room.GetPath(), path)
        files[folder / "data.json"] = json.dumps({"annotations": {**told, "materials": []}}).encode()
    write_all(files)
    return list(files)


def model_name(name: str) -> str:
    """What the model of an object is called there, where dots end a data set's name."""
    return f"echousd_{name}"


def scene_state(graph: SceneGraph) -> dict[str, Any]:
    """The room as SceneEval's `sceneState` (scene@1.0.2, arch@1.0.2): Z up, metres, column-major matrices."""
    corners = graph.room.corners
    if corners is None:
        raise ValueError("the room has no floor, SceneEval needs one: state floor_polygon or size")
    floor = [[float(x), float(-z), 0.0] for x, z in corners]
    kind = graph.room.type
    elements: list[dict[str, Any]] = [{"id": "floor", "roomId": kind, "type": "Floor", "depth": 0.05, "points": floor}]
    for edge, start in enumerate(floor):
        holes = [
            {"id": o.name, "type": "Window" if o.kind == "window" else "Door",
             "box": {"min": [o.offset, o.sill], "max": [o.end, o.sill + o.height]}}
            for o in graph.room.openings if o.edge == edge
        ]  # fmt: skip
        elements.append(
            {"id": f"wall_{edge}", "roomId": kind, "type": "Wall", "height": graph.room.height or HEIGHT, "depth": 0.1,
             "points": [start, floor[(edge + 1) % len(floor)]], "holes": holes}
        )  # fmt: skip
    objects = []
    for index, node in enumerate(graph.nodes):
        if node.position is None or node.yaw is None:
            raise ValueError(f"object {node.name!r} has no place, allowed: a position and a yaw for every object")
        pose = np.eye(4)
        cos, sin = np.cos(node.yaw), np.sin(node.yaw)
        pose[:3, :3] = [[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]]
        pose[:3, 3] = node.position
        data = [round(float(v), 6) for v in (Z_UP @ pose).T.flatten()]
        objects.append(
            {"id": str(index), "index": index, "modelId": f"{PREFIX}.{model_name(node.name)}", "parentId": "",
             "parentIndex": -1, "transform": {"rows": 4, "cols": 4, "data": data}}
        )  # fmt: skip
    up = {"up": [0, 0, 1], "front": [0, 1, 0]}
    arch = {"version": "arch@1.0.2", "id": "room", "scaleToMeters": 1, "coords2d": [0, 1], **up, "elements": elements,
            "regions": [{"id": kind, "type": "Other", "walls": [e["id"] for e in elements[1:]]}]}  # fmt: skip
    scene = {"version": "scene@1.0.2", "id": "room", "unit": 1.0, **up, "assetSource": ["objaverse"], "arch": arch}
    return {"format": "sceneState", "scene": {**scene, "object": objects, "modifications": []}, "selected": []}
