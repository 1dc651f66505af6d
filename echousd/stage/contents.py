"""What stands in a room on a stage: the meshes and boxes of its objects in the room frame (+Y up, metres)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
import trimesh
from pxr import Kind, Tf, Usd, UsdGeom

from echousd.graph import Node, Relation, RoomSpec
from echousd.stage.encoding import LABELS, StageError
from echousd.stage.files import open_stage
from echousd.stage.forms import Polygons, forms, polygons
from echousd.stage.read import RoomPrims, node_names, read_node, relation_of, room_spec
from echousd.stage.units import metres_per_unit, up_axis
from echousd.stage.values import matrix, texts

Z_TO_Y = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])  # (x, y, z) with Z up -> (x, z, -y)
HIDDEN = (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy)


@dataclass(frozen=True, eq=False)
class Shape:
    """What is seen of a prim.

    Arguments:
        points: (v, 3) float, metres, room frame; faces: (f, 3) int.
        size, position, yaw: its box: extents at yaw 0, centre of the bottom face (metres), radians about +Y.
    """

    points: np.ndarray
    faces: np.ndarray
    size: np.ndarray
    position: np.ndarray
    yaw: float


@dataclass(frozen=True, eq=False)
class RoomObject:
    """One object of a room.

    Arguments:
        node: what the graph says about it.
        points, faces, size, position, yaw: as in `Shape`; without points and faces where the object has no geometry.
    """

    node: Node
    points: np.ndarray
    faces: np.ndarray
    size: np.ndarray
    position: np.ndarray
    yaw: float

    @property
    def name(self) -> str:
        """Of its prim."""
        return self.node.name


Solid: TypeAlias = RoomObject | Shape


@dataclass(frozen=True, eq=False)
class Surrounding:
    """A component of a room that is no node of its graph: a wall, a small thing, or what nobody told of.

    Arguments:
        prim: its prim. word: its label, "" without one.
        shape: what is seen of it, None for nothing.
    """

    prim: Usd.Prim
    word: str
    shape: Shape | None

    @property
    def name(self) -> str:
        """Of its prim."""
        return str(self.prim.GetName())


@dataclass(frozen=True, eq=False)
class RoomContents:
    """One room of a stage, read as far as it can be read.

    Arguments:
        path: prim path of the room.
        spec: room type, floor and height, or None where they cannot be read.
        objects: the objects that have a box; missing: names of those that have neither geometry nor a fixed box.
        relations: the relations whose two ends are among the objects.
    """

    path: str
    spec: RoomSpec | None
    objects: tuple[RoomObject, ...]
    missing: tuple[str, ...]
    relations: tuple[Relation, ...]


def read_contents(prims: RoomPrims) -> RoomContents:
    """The contents of one room; what is not valid is left out here, the validators report it."""
    stage = prims.room.GetStage()
    cache = UsdGeom.XformCache()
    found_frame = _readable(lambda: room_frame(prims.room, cache))
    to_room = np.eye(4) if found_frame is None else found_frame
    names = _readable(lambda: node_names(prims)) or {}
    owners = [prim.GetPath() for prim in prims.nodes]
    objects, missing = [], []
    for prim in prims.nodes:
        node = _readable(lambda prim=prim: read_node(prim, names.get(prim.GetPath(), prim.GetName()), names))  # type: ignore[misc]
        if node is None:
            continue
        found = _readable(
            lambda prim=prim, node=node: _object(prim, node, cache, to_room, set(owners) - {prim.GetPath()})  # type: ignore[misc]
        )
        if found is None:
            missing.append(node.name)
        else:
            objects.append(found)
    present = {thing.node.name for thing in objects}
    read = [_readable(lambda prim=prim: relation_of(prim, names)) for prim in prims.relations]  # type: ignore[misc]
    relations = tuple(r for r in read if r is not None and r.subject in present and r.object in present)
    spec = _readable(lambda: room_spec(prims))
    assert stage
    relations = tuple({relation.triple: relation for relation in relations}.values())
    return RoomContents(str(prims.room.GetPath()), spec, tuple(objects), tuple(missing), relations)


def room_frame(room: Usd.Prim, cache: UsdGeom.XformCache) -> np.ndarray:
    """(4, 4) float, column vectors: from world coordinates of the stage to the room frame in metres.

    The room frame sits at the room's prim. Where the prim is turned so that its own +Y is up (or the stage is Y-up) its
    axes are the room's; a Z-up prim is turned.
    """
    stage = room.GetStage()
    world = matrix(cache.GetLocalToWorldTransform(room), room)
    up = np.array([0.0, 0, 1] if up_axis(stage) == UsdGeom.Tokens.z else [0.0, 1, 0])
    scale = np.linalg.norm(world[:3, :3], axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    local_up = (world[:3, :3] / scale).T @ up
    turn = Z_TO_Y if abs(local_up[2]) > abs(local_up[1]) else np.eye(3)
    out = np.eye(4)
    out[:3, :3] = turn @ np.diag(scale) * metres_per_unit(stage)
    try:
        return out @ np.linalg.inv(world)
    except np.linalg.LinAlgError:
        return out


def _readable(read):  # type: ignore[no-untyped-def]
    try:
        return read()
    except (StageError, Tf.ErrorException):
        return None


def _object(
    prim: Usd.Prim, node: Node, cache: UsdGeom.XformCache, to_room: np.ndarray, others: set
) -> RoomObject | None:
    found = shape_of(prim, cache, to_room, others)
    if found is not None:
        return RoomObject(node, found.points, found.faces, found.size, found.position, found.yaw)
    if node.size is None or node.position is None or node.yaw is None:
        return None
    size, position = np.array(node.size), np.array(node.position)
    return RoomObject(node, np.zeros((0, 3)), np.zeros((0, 3), int), size, position, node.yaw)


def surroundings(prims: RoomPrims) -> tuple[Surrounding, ...]:
    """The components of a room that are no nodes of its furniture's graph; what cannot be read has no shape."""
    cache = UsdGeom.XformCache()
    to_room = _readable(lambda: room_frame(prims.room, cache))
    found = []
    for prim in components(prims):
        words = _readable(lambda prim=prim: texts(prim.GetAttribute(LABELS))) or ("",)  # type: ignore[misc]
        shape = to_room is not None and _readable(lambda prim=prim: shape_of(prim, cache, to_room))  # type: ignore[misc]
        found.append(Surrounding(prim, words[0], shape or None))
    return tuple(found)


def components(room: RoomPrims) -> list[Usd.Prim]:
    """The prims of a room's components that are no nodes of its furniture's graph: walls, floors, small things."""
    nodes = {prim.GetPath() for prim in room.nodes}
    found, walk = [], iter(Usd.PrimRange(room.room, Usd.TraverseInstanceProxies()))
    for prim in walk:
        if prim.GetPath() in nodes or Kind.Registry.IsA(str(prim.GetMetadata("kind") or ""), Kind.Tokens.component):
            walk.PruneChildren()
            if prim.GetPath() not in nodes:
                found.append(prim)
    return found


def shape_of(
    prim: Usd.Prim, cache: UsdGeom.XformCache, to_room: np.ndarray, others: set | frozenset = frozenset()
) -> Shape | None:
    """What is seen of a prim and of all below it but for `others`, None for nothing; raises StageError."""
    own = to_room @ matrix(cache.GetLocalToWorldTransform(prim), prim)
    points, faces = [], []
    count = 0
    for form in forms(prim, cache, is_seen, others):
        found = _readable(lambda form=form: triangulated(form.prim))  # type: ignore[misc]
        if found is None or not len(found[1]):
            continue
        vertices, triangles = found
        world = to_room @ form.world
        points.append(vertices @ world[:3, :3].T + world[:3, 3])
        faces.append(triangles + count)
        count += len(vertices)
    if not points:
        return None
    vertices = np.concatenate(points)
    front = own[:3, :3] @ np.array([0.0, 0, 1])
    width = own[:3, :3] @ np.array([1.0, 0, 0])
    # The front is horizontal in our rooms; in a prim whose own up is +Z it is not, then the width tells the heading.
    level = np.hypot(front[0], front[2]) > np.hypot(width[0], width[2]) * 1e-3
    yaw = float(np.arctan2(front[0], front[2])) if level else float(np.arctan2(-width[2], width[0]))
    cos, sin = np.cos(yaw), np.sin(yaw)
    turned = np.stack(
        (cos * vertices[:, 0] - sin * vertices[:, 2], vertices[:, 1], sin * vertices[:, 0] + cos * vertices[:, 2]), 1
    )
    low, high = turned.min(0), turned.max(0)
    x, z = (low[0] + high[0]) / 2, (low[2] + high[2]) / 2
    position = np.array([cos * x + sin * z, low[1], cos * z - sin * x])
    return Shape(vertices, np.concatenate(faces), high - low, position, yaw)


def is_seen(prim: Usd.Prim) -> bool:
    """Whether a surface is one that people see: no guide, no proxy, not invisible."""
    image = UsdGeom.Imageable(prim)
    return image.ComputePurpose() not in HIDDEN and image.ComputeVisibility() != UsdGeom.Tokens.invisible


def triangulated(prim: Usd.Prim) -> tuple[np.ndarray, np.ndarray]:
    """Points (v, 3) float in the prim's own frame and unit, and triangles (f, 3) int."""
    surface = polygons(prim)
    return surface.points, triangles_of(surface)


def triangles_of(surface: Polygons) -> np.ndarray:
    """(f, 3) int points of the triangles of polygons, those of as many corners behind one another."""
    counts, indices = surface.counts, surface.indices
    if not len(surface.points):
        return np.zeros((0, 3), int)
    starts = np.concatenate(([0], np.cumsum(counts)[:-1]))
    triangles = []
    for corners in np.unique(counts[counts >= 3]):
        first = starts[counts == corners]
        for k in range(1, corners - 1):
            triangles.append(np.stack((indices[first], indices[first + k], indices[first + k + 1]), 1))
    return np.concatenate(triangles) if triangles else np.zeros((0, 3), int)


def stage_mesh(path: Path) -> trimesh.Trimesh:
    """Everything with a surface on a stage as triangles; raises ValueError where there is none."""
    stage = open_stage(path)
    points, faces, count = [], [], 0
    for form in forms(stage.GetPseudoRoot(), UsdGeom.XformCache(), is_seen):
        vertices, triangles = triangulated(form.prim)
        if not len(triangles):
            continue
        points.append(vertices @ form.world[:3, :3].T + form.world[:3, 3])
        faces.append(triangles + count)
        count += len(vertices)
    if not points:
        raise ValueError("the stage holds no visible surfaces")
    vertices = np.concatenate(points) * metres_per_unit(stage)
    if up_axis(stage) == UsdGeom.Tokens.z:
        vertices = vertices[:, [0, 2, 1]] * [1, 1, -1]
    return trimesh.Trimesh(vertices, np.concatenate(faces), process=False)
