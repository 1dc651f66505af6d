"""What stands in a room on a stage: the meshes and boxes of its objects in the room frame (+Y up, metres)."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from pxr import Kind, Sdf, Usd, UsdGeom

from echomodel.boxes2d import seen, turned
from echomodel.triangles import Mesh, bounds_of, connected_pieces, joined, spans_of
from echousd.graph import Node, Relation, RoomSpec
from echousd.stage.encoding import LABELS
from echousd.stage.forms import Polygons, forms, polygons
from echousd.stage.read import RoomPrims, node_names, read_node, relation_of, room_spec
from echousd.stage.units import Z_TO_Y, metres_per_unit, upwards
from echousd.stage.values import NOW, fans, matrix, readable, texts

NOTHING = (np.zeros((0, 3)), np.zeros((0, 3), int))  # points and triangles of what has no surface
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

    @cached_property
    def triangles(self) -> np.ndarray:
        """(f, 3, 3) float, metres: the corners of its faces."""
        return self.points[self.faces]

    @cached_property
    def spans(self) -> np.ndarray:
        """(2, f, 3) float, metres: lower and upper corners of the boxes around its faces."""
        return spans_of(self.triangles)

    @cached_property
    def pieces(self) -> tuple[np.ndarray, list[np.ndarray]]:
        """Triangles (n, 3, 3) of its connected pieces that are open, all together, and of each closed one."""
        edges = np.concatenate([self.faces[:, [0, 1]], self.faces[:, [1, 2]], self.faces[:, [2, 0]]]).astype(np.int64)
        count = len(self.points)
        piece = connected_pieces(self.faces, count)
        _, where = np.unique(edges.min(1) * count + edges.max(1), return_inverse=True)
        balance = np.bincount(where, np.where(edges[:, 0] < edges[:, 1], 1, -1))
        loose = np.isin(piece, np.tile(piece, 3)[balance[where] != 0])
        order = np.argsort(piece[~loose], kind="stable")
        closed = self.triangles[~loose][order]
        parts = np.split(closed, np.flatnonzero(np.diff(piece[~loose][order])) + 1) if len(closed) else []
        return self.triangles[loose], parts

    @cached_property
    def closed_spans(self) -> np.ndarray:
        """(2, p, 3) float, metres: lower and upper corners of the boxes around its closed pieces."""
        corners = [bounds_of(part) for part in self.pieces[1]]
        return np.moveaxis(np.array(corners).reshape(-1, 2, 3), 1, 0)


@dataclass(frozen=True, eq=False)
class RoomObject(Shape):
    """An object of a room: what is seen of it (no points and faces without geometry), what the graph says of it."""

    node: Node

    @property
    def name(self) -> str:
        """Of its prim."""
        return self.node.name


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
        relations: the relations whose two ends are among the objects; unmeasured: those that have a missing end.
    """

    path: str
    spec: RoomSpec | None
    objects: tuple[RoomObject, ...]
    missing: tuple[str, ...]
    relations: tuple[Relation, ...]
    unmeasured: tuple[Relation, ...] = ()


def read_contents(prims: RoomPrims) -> RoomContents:
    """The contents of one room; what is not valid is left out here, the validators report it."""
    stage = prims.room.GetStage()
    cache = UsdGeom.XformCache(NOW)
    to_room = readable(lambda: room_frame(prims.room, cache), np.eye(4))
    names = readable_names(prims)
    owners = {prim.GetPath() for prim in prims.nodes}
    objects, missing = [], []
    for prim in prims.nodes:
        node = readable(partial(read_node, prim, names.get(prim.GetPath(), prim.GetName()), names), None)
        if node is None:
            continue
        found = readable(partial(_object, prim, node, cache, to_room, owners - {prim.GetPath()}), None)
        if found is None:
            missing.append(node.name)
        else:
            objects.append(found)
    present = {thing.node.name for thing in objects}
    read = [readable(partial(relation_of, prim, names), None) for prim in prims.relations]
    stated = {relation.triple: relation for relation in read if relation is not None}.values()
    here, nowhere = (tuple(r for r in stated if ({r.subject, r.object} <= present) is both) for both in (True, False))
    spec = readable(lambda: room_spec(prims), None)
    assert stage
    return RoomContents(str(prims.room.GetPath()), spec, tuple(objects), tuple(missing), here, nowhere)


def readable_names(prims: RoomPrims) -> dict[Sdf.Path, str]:
    """`node_names`, none where two are the same, which the validators report."""
    nameless: dict[Sdf.Path, str] = {}
    return readable(lambda: node_names(prims), nameless)


def room_frame(room: Usd.Prim, cache: UsdGeom.XformCache) -> np.ndarray:
    """(4, 4) float, column vectors: from world coordinates of the stage to the room frame in metres.

    The room frame sits at the room's prim. Where the prim is turned so that its own +Y is up (or the stage is Y-up) its
    axes are the room's; a Z-up prim is turned.
    """
    stage = room.GetStage()
    world = matrix(cache.GetLocalToWorldTransform(room), room)
    scale = np.linalg.norm(world[:3, :3], axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    local_up = (world[:3, :3] / scale).T @ upwards(stage)
    turn = Z_TO_Y if abs(local_up[2]) > abs(local_up[1]) else np.eye(3)
    out = np.eye(4)
    out[:3, :3] = turn @ np.diag(scale) * metres_per_unit(stage)
    try:
        return out @ np.linalg.inv(world)
    except np.linalg.LinAlgError:
        return out


def _object(
    prim: Usd.Prim, node: Node, cache: UsdGeom.XformCache, to_room: np.ndarray, others: set
) -> RoomObject | None:
    found = shape_of(prim, cache, to_room, others)
    if found is not None:
        return RoomObject(**vars(found), node=node)
    if node.size is None or node.position is None or node.yaw is None:
        return None
    size, position = np.array(node.size), np.array(node.position)
    return RoomObject(*NOTHING, size, position, node.yaw, node)


def surroundings(prims: RoomPrims) -> tuple[Surrounding, ...]:
    """The components of a room that are no nodes of its furniture's graph; what cannot be read has no shape."""
    cache = UsdGeom.XformCache(NOW)
    to_room = readable(lambda: room_frame(prims.room, cache), None)
    found = []
    for prim in components(prims):
        shape = None if to_room is None else readable(partial(shape_of, prim, cache, to_room), None)
        found.append(Surrounding(prim, next(iter(words_of(prim)), ""), shape))
    return tuple(found)


def words_of(prim: Usd.Prim) -> tuple[str, ...]:
    """The labels of a prim of the taxonomy `category`, none where they cannot be read."""
    return readable(lambda: texts(prim.GetAttribute(LABELS)), ())


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
    vertices, faces = surface_of(
        prim, cache, to_room, others, lambda each: readable(lambda: triangulated(each), NOTHING)
    )
    return Shape(vertices, faces, *upright_box(vertices, own[:3, :3])) if len(faces) else None


def triangulated(prim: Usd.Prim) -> tuple[np.ndarray, np.ndarray]:
    """Points (v, 3) float in the prim's own frame and unit, and triangles (f, 3) int."""
    surface = polygons(prim)
    return surface.points, triangles_of(surface)


def triangles_of(surface: Polygons) -> np.ndarray:
    """(f, 3) int points of the triangles of polygons."""
    return surface.indices[fans(surface.counts)[1]]


def surface_of(
    top: Usd.Prim, cache: UsdGeom.XformCache, placed: np.ndarray, others: set | frozenset = frozenset(),
    read: Callable[[Usd.Prim], tuple[np.ndarray, np.ndarray]] = triangulated,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Points (v, 3) float and triangles (f, 3) int of all that is seen at and below a prim, but for `others`.

    Arguments:
        placed: (4, 4) float, column vectors, from the stage's world to where the points are wanted.
        read: what gives the points and triangles of a prim in its own frame.
    """
    pieces = [Mesh(*NOTHING)]
    for form in forms(top, cache, others):
        vertices, triangles = read(form.prim)
        if len(triangles):
            world = placed @ form.world
            pieces.append(Mesh(vertices @ world[:3, :3].T + world[:3, 3], triangles))
    whole = joined(pieces)
    return whole.vertices, whole.faces


def upright_box(points: np.ndarray, own: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Size (3,), bottom centre (3,) and yaw of the box that stands around points (n, 3), +Y up, as their own axes head.

    `own`: (3, 3) float, column vectors, turns these axes.
    """
    front, width = own[:, 2], own[:, 0]
    # The front is horizontal in our rooms; in a frame whose up is +Z it is not, then the width tells the heading.
    level = np.hypot(front[0], front[2]) > np.hypot(width[0], width[2]) * 1e-3
    yaw = float(np.arctan2(front[0], front[2])) if level else float(np.arctan2(-width[2], width[0]))
    ahead = points.copy()
    ahead[:, [0, 2]] = seen(points[:, [0, 2]], yaw)
    low, high = ahead.min(0), ahead.max(0)
    position = low.copy()
    position[[0, 2]] = turned((low + high)[[0, 2]] / 2, yaw)
    return high - low, position, yaw
