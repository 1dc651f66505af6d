"""A room or a home for Habitat and for SceneEval: descriptions of the scene, and a glb for every object."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdPhysics

from echomodel.boxes2d import upright
from echousd.exporting.glb import glb, object_glb
from echousd.exporting.packing import Reach
from echousd.graph import SceneGraph
from echousd.naming import free_name
from echousd.stage.files import source
from echousd.stage.foreign import boxed_graph
from echousd.stage.read import RoomPrims, find_rooms, node_names, room_graph, the_room
from echousd.stage.turning import TURN
from echousd.stage.units import metres_per_unit, up_axis
from echousd.stage.values import NOW

UP = {"up": [0, 1, 0], "front": [0, 0, -1]}  # Habitat's own, and of every glb
FOLDERS = {"stages": "stages", "objects": "objects", "scene_instances": "scenes"}


def habitat_files(stage: Usd.Stage, out: Path, reach: Reach) -> dict[Path, bytes]:
    """`NAME.scene_dataset_config.json` and beside it stages, objects, the scene, and regions of its rooms.

    What dresses a room is part of the stage; furniture is objects, those that stand free to be moved.

    Raises ValueError for a stage without rooms, and as `export`.
    """
    rooms = find_rooms(stage)
    if not rooms:
        raise ValueError(f"{source(stage)}: no scene graph, Habitat needs one: a room or a home of EchoUSD")
    name = reach.room.stem
    top = f"{name}.scene_dataset_config.json"
    files: dict[str, bytes | dict[str, Any]] = {top: b""}
    objects: list[dict[str, Any]] = []
    names: dict[str, str] = {}
    cache = UsdGeom.XformCache(NOW)
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        for prims, prim, called in _objects(rooms):
            word = names[str(prim.GetPath())] = free_name(called, set(names.values()))
            files[f"objects/{word}.glb"] = object_glb(stage, prims.room.GetPath(), prim.GetPath())
            mass = UsdPhysics.MassAPI(prim).GetMassAttr().Get()
            config = {"render_asset": f"{word}.glb", **UP, **({"mass": round(float(mass), 3)} if mass else {})}
            files[f"objects/{word}.object_config.json"] = config
            pose = _metric(stage, cache.GetLocalToWorldTransform(prim))
            turn = pose.ExtractRotationQuat()
            objects.append(
                {
                    "template_name": f"objects/{word}",
                    "translation": [round(v, 6) for v in pose.ExtractTranslation()],
                    "rotation": [round(v, 6) for v in (turn.GetReal(), *turn.GetImaginary())],
                    "translation_origin": "ASSET_LOCAL",
                    "motion_type": "DYNAMIC" if prim.HasAPI(UsdPhysics.RigidBodyAPI) else "STATIC",
                }
            )
        for prim_path in names:
            stage.GetPrimAtPath(prim_path).SetActive(False)
        files[f"stages/{name}.glb"] = glb(stage, reach)
    files[f"stages/{name}.stage_config.json"] = {"render_asset": f"{name}.glb", **UP}
    files[f"scenes/{name}.scene_instance.json"] = {
        "stage_instance": {"template_name": f"stages/{name}"},
        "object_instances": objects,
        "semantic_scene_instance": name,
    }
    files[f"{name}.semantic_config.json"] = {"region_annotations": [_region(stage, prims) for prims in rooms]}
    files[top] = {
        **{kind: {"paths": {".json": [folder]}} for kind, folder in FOLDERS.items()},
        "semantic_scene_descriptor_instances": {"paths": {".json": [f"{name}.semantic_config.json"]}},
    }
    return {
        out / where: content if isinstance(content, bytes) else (json.dumps(content, indent=1) + "\n").encode()
        for where, content in files.items()
    }


def _objects(rooms: list[RoomPrims]) -> Iterator[tuple[RoomPrims, Usd.Prim, str]]:
    """Every object with its room and what it is called; of several rooms, after its own."""
    for prims in rooms:
        before = f"{prims.room.GetName()}_" if len(rooms) > 1 else ""
        for path, name in node_names(prims).items():
            yield prims, prims.room.GetStage().GetPrimAtPath(path), before + name


def _metric(stage: Usd.Stage, matrix: Gf.Matrix4d) -> Gf.Matrix4d:
    """A pose of a stage in metres with +Y up, of row vectors."""
    out = TURN * matrix * TURN.GetInverse() if up_axis(stage) == "Z" else Gf.Matrix4d(matrix)
    out.SetTranslateOnly(out.ExtractTranslation() * metres_per_unit(stage))
    return out.RemoveScaleShear()


def _region(stage: Usd.Stage, prims: RoomPrims) -> dict[str, Any]:
    """The floor of a room as a region."""
    graph = room_graph(prims)
    pose = _metric(stage, UsdGeom.XformCache(NOW).GetLocalToWorldTransform(prims.room))
    corners = graph.room.corners if graph.room.corners is not None else np.zeros((0, 2))
    points = [pose.Transform(Gf.Vec3d(float(x), 0.0, float(z))) for x, z in corners]
    floor = round(pose.ExtractTranslation()[1], 4)
    return {
        "name": prims.room.GetName(),
        "label": graph.room.type,
        "poly_loop": [[round(v, 4) for v in point] for point in points],
        "floor_height": floor,
        "extrusion_height": graph.room.tall,
    }


Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])  # our (x, y, z) is (x, -z, y) there
ASSETS, PREFIX = Path("_data/layoutvlm-objathor"), "layoutvlm-objaverse"


def sceneeval_files(stage: Usd.Stage, out: Path) -> dict[Path, bytes]:
    """`input/EchoUSD/scene_0.json` and the models below `_data`, as SceneEval's own folder has them.

    Raises ValueError for a room without a floor or with an object that has no place, and as `export`.
    """
    prims = the_room(stage, None)
    graph = boxed_graph(prims)
    state = (json.dumps(scene_state(graph), indent=1) + "\n").encode()
    files = {out / "input" / "EchoUSD" / "scene_0.json": state}
    for path, name in node_names(prims).items():
        node, number = graph.node(name), model_name(name)
        about = {"category": node.category.replace("_", " "), "description": f"a {node.category.replace('_', ' ')}"}
        folder = out / ASSETS / number
        files[folder / f"{number}.glb"] = object_glb(stage, prims.room.GetPath(), path)
        files[folder / "data.json"] = json.dumps({"annotations": {**about, "materials": []}}).encode()
    return files


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
            {"id": f"wall_{edge}", "roomId": kind, "type": "Wall", "height": graph.room.tall, "depth": 0.1,
             "points": [start, floor[(edge + 1) % len(floor)]], "holes": holes}
        )  # fmt: skip
    objects = []
    for index, node in enumerate(graph.nodes):
        if node.position is None or node.yaw is None:
            raise ValueError(f"object {node.name!r} has no place, allowed: a position and a yaw for every object")
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = upright(node.yaw), node.position
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
