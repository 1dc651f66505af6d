"""Several rooms of one stage: which there are, where each stands, and the root layer that composes what was made."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom

import echousd
from echousd.graph.files import STAGE_FORMS
from echousd.naming import HOUSE as MARK
from echousd.stage.files import layer_bytes, open_stage, write_whole
from echousd.stage.read import find_rooms
from echousd.stage.turning import rescale, turn_up
from echousd.stage.units import metres_per_unit, up_axis
from echousd.stage.values import matrix

GAP = 1.0  # metres between rooms that stand nowhere in particular
Z_TO_Y = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])


@dataclass(frozen=True, eq=False)
class Place:
    """A room of a house.

    Arguments:
        path: its prim path on the stage that holds the graphs.
        name: of its folder and of its prim in the house.
        pose: (4, 4) float, room frame to house frame, metres, +Y up, column vectors.
    """

    path: str
    name: str
    pose: np.ndarray


def places(file: Path) -> tuple[Place, ...]:
    """The rooms of a stage if it holds several, else nothing; raises ValueError where it cannot be read."""
    if file.suffix.lower() not in STAGE_FORMS:
        return ()
    stage = open_stage(file)
    rooms = find_rooms(stage)
    if len(rooms) < 2:
        return ()
    paths = [prims.room.GetPath() for prims in rooms]
    often = Counter(path.name for path in paths)
    cache, metres = UsdGeom.XformCache(), metres_per_unit(stage)
    turn = Z_TO_Y if up_axis(stage) == "Z" else np.eye(4)
    out = []
    for prims, path in zip(rooms, paths, strict=True):
        pose = turn @ matrix(cache.GetLocalToWorldTransform(prims.room), prims.room)
        pose[:3, 3] *= metres
        pose[:3, :3] = _upright(pose[:3, :3])  # rooms are made upright and in metres
        name = path.name if often[path.name] == 1 else str(path).strip("/").replace("/", "_")
        out.append(Place(str(path), name, pose))
    return tuple(out)


def write_house(root: Path, rooms: Sequence[Place], made: Mapping[str, Path], *, force: bool = False) -> Path:
    """Write the layer that composes rooms which were made; returns its path.

    Rooms that all stand at one place are put in a row along x.

    Arguments:
        made: name of each room -> root layer of its folder, below the folder of `root`.
        force: replace a file that is no house of ours.

    Raises ValueError for a file that is in the way.
    """
    check_house(root, force=force)
    poses = {room.name: room.pose for room in rooms}
    if len({tuple(np.round(pose[:3, 3], 3)) for pose in poses.values()}) == 1:
        poses = _in_a_row(poses, made)
    layer = Sdf.Layer.CreateAnonymous(".usda")
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, "Y")
    house = UsdGeom.Xform.Define(stage, "/House").GetPrim()
    Usd.ModelAPI(house).SetKind("assembly")
    stage.SetDefaultPrim(house)
    for room in rooms:
        pose = Gf.Matrix4d(*(np.round(poses[room.name].T, 6) + 0.0).ravel().tolist())
        UsdGeom.Xform.Define(stage, f"/House/{room.name}").AddTransformOp(opSuffix="house").Set(pose)
    del house, stage  # what an anonymous layer refers to cannot be composed
    for room in rooms:
        file = made[room.name].relative_to(root.parent).as_posix()
        layer.GetPrimAtPath(f"/House/{room.name}").referenceList.prependedItems.append(Sdf.Reference(f"./{file}"))
    first = open_stage(made[rooms[0].name])
    rescale(layer, metres_per_unit(first))
    if up_axis(first) == "Z":
        turn_up(layer)
    layer.customLayerData = {MARK: 1, "generator": f"echousd {echousd.__version__}"}
    write_whole(root, layer_bytes(layer, ".usda"))
    return root


def check_house(root: Path, *, force: bool = False) -> None:
    """Raises ValueError where a house cannot be written for a file that is not ours."""
    if force or not root.exists():
        return
    if not (root.is_file() and f"int {MARK}".encode() in root.read_bytes()):
        raise ValueError(f"{root}: exists and is no house of echousd; choose another folder or use --force")


def _upright(rotation: np.ndarray) -> np.ndarray:
    """The turn about +Y nearest to a rotation: rooms stand on their floor."""
    angle = np.arctan2(rotation[0, 2] - rotation[2, 0], rotation[0, 0] + rotation[2, 2])
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])


def _in_a_row(poses: Mapping[str, np.ndarray], made: Mapping[str, Path]) -> dict[str, np.ndarray]:
    out, reach = {}, 0.0
    for name, pose in poses.items():
        stage = open_stage(made[name])
        box = UsdGeom.BBoxCache(0, ["default"]).ComputeWorldBound(stage.GetDefaultPrim()).ComputeAlignedRange()
        out[name] = pose.copy()
        low, high = (corner[0] * metres_per_unit(stage) for corner in (box.GetMin(), box.GetMax()))
        out[name][0, 3] += reach - low
        reach += high - low + GAP
    return out
