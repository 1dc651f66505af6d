"""Scene graphs of stages that others authored: semantics labels and bounds become nodes, boxes become relations."""

import math
import os
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

from echomodel.boxes2d import footprints, seen
from echomodel.vocabulary import vocabulary
from echousd.graph import Node, RoomSpec, SceneGraph
from echousd.graph.nodes import OBSTACLE
from echousd.graph.titles import identifier_of
from echousd.naming import free_name
from echousd.stage.contents import room_frame
from echousd.stage.encoding import StageError
from echousd.stage.files import opened, source
from echousd.stage.labels import STRUCTURE, category_of_name, is_floor, is_structure, known_category, labels, spaced
from echousd.stage.read import RoomPrims, faults, node_names, room_graph, value
from echousd.stage.units import Z_TO_Y, metres_per_unit, to_metres
from echousd.stage.values import NOW, lineage

TAKEN_FOR = "cabinet"  # what the networks take a fixed thing of an unknown class for
LARGE = 0.3  # metres: a thing of an unknown class with two longer sides is in the way
COLUMN = (1.2, 0.1, 1.2)  # metres: least height, least and largest side of what stands in the way without a label
USUAL = (0.2, 20.0)  # metres: the largest piece of a room is shorter or longer where its unit is not what is meant
STOREY = 2.6  # metres above a floor that its furniture stands in
_UPRIGHT = 1e-3  # how far an axis may lean, as the deviation of a rotation matrix's entries
_FLAT = 1e-18  # the determinant of a transform that leaves no volume
UNTOLD = "living_room"  # what a room is whose furniture tells nothing


class SkippedPrims(UserWarning):
    """Labelled prims that became no node; the message counts them by reason."""


@dataclass(frozen=True)
class Box:
    """An upright box in the room frame: size (3,) and position (3,) of the bottom centre in metres, yaw in radians."""

    size: tuple[float, float, float]
    position: tuple[float, float, float]
    yaw: float


def box_of(bound: Gf.BBox3d, frame: np.ndarray) -> Box | None:
    """The box around `bound`: turned like its prim where that stands upright, else along the room's axes.

    `frame`: (4, 4) float, column vectors, from the stage's world to the room's frame in metres, as `to_metres`.
    """
    local = bound.GetRange()
    if local.IsEmpty():
        return None
    low, high = np.array(local.GetMin()), np.array(local.GetMax())
    matrix = np.array(bound.GetMatrix())
    linear = frame[:3, :3] @ matrix[:3, :3].T  # columns: the prim's axes in the room frame
    centre = frame[:3, :3] @ (matrix[:3, :3].T @ ((low + high) / 2) + matrix[3, :3]) + frame[:3, 3]
    for axes in (np.eye(3), Z_TO_Y.T):  # the object's own up axis is Y or Z, whatever the stage's
        turned = linear @ axes
        scale = np.linalg.norm(turned, axis=0)
        if (scale == 0).any():
            continue
        rotation = turned / scale
        if rotation[1, 1] > 1 - _UPRIGHT and np.allclose(rotation.T @ rotation, np.eye(3), atol=_UPRIGHT):
            size = np.abs(axes.T @ (high - low)) * scale
            return _box(size, centre, math.atan2(rotation[0, 2], rotation[2, 2]))
    return _box(np.abs(linear) @ (high - low), centre, 0.0)


def _box(size: np.ndarray, centre: np.ndarray, yaw: float) -> Box:
    """A box in whole micrometres: what lies beyond is noise of transforms, which no person wrote."""
    width, height, depth = np.round(size, 6).tolist()
    x, y, z = (np.round(centre - (0.0, size[1] / 2, 0.0), 6) + 0.0).tolist()
    return Box((width, height, depth), (x, y, z), yaw)


def foreign_graph(
    stage: Usd.Stage | str | os.PathLike[str], room_type: str | None = None, *, names: bool = False
) -> SceneGraph:
    """The nodes of a stage without a scene graph: its topmost prims with semantics labels and bounds, boxes fixed.

    A label of any SemanticsLabelsAPI instance or of Omniverse's SemanticsAPI counts if the vocabulary knows it; the
    instance `category` is asked first. Large things of unknown labels become fixed obstacles: locked boxes that keep
    their label. Lengths and axes are converted to metres and +Y up. A prim labelled `floor` gives the floor. Without
    `room_type` it is guessed: by a prim's name or label, else by the furniture. Warns `SkippedPrims`; raises StageError
    where nothing is left.

    Arguments:
        names: what has no label is known by the name of its asset or prim.
    """
    return foreign_pieces(opened(stage), room_type, names=names)[0]


def foreign_pieces(
    stage: Usd.Stage, room_type: str | None = None, *, names: bool = False
) -> tuple[SceneGraph, dict[str, str]]:
    """The graph as `foreign_graph` reads it, and the prim path of every node; columns without a label are obstacles."""
    found, floors, words = _read(stage, names=names, columns=True)
    floor = next((box for _, box in floors), None)
    graph = _graph(stage, [node for _, node in found], floor, room_type, words)
    return graph, {node.name: str(path) for path, node in found}


def foreign_rooms(stage: Usd.Stage | str | os.PathLike[str], *, names: bool = False) -> dict[str, SceneGraph]:
    """The rooms of a house without scene graphs, by prim path: those that prims are called after, else one a floor.

    What belongs to no room is told (`SkippedPrims`). A stage that tells of no rooms is one room, with the path "".

    Arguments:
        names: as for `foreign_graph`.
    """
    stage = opened(stage)
    found, floors, words = _read(stage, names=names)
    members: dict[str, list[Node]] = {}
    for path, node in found:
        members.setdefault(_room_above(stage.GetPrimAtPath(path)), []).append(node)
    inside = {key: box for key, box in ((_room_above(stage.GetPrimAtPath(p)), box) for p, box in floors) if key}
    if len({key for key in members if key}) < 2:
        if len(floors) < 2:
            floor = next((box for _, box in floors), None)
            return {"": _graph(stage, [node for _, node in found], floor, None, words)}
        members, inside = {}, {str(path): box for path, box in floors}
        for _, node in found:
            members.setdefault(next((key for key, box in inside.items() if _over(node, box)), ""), []).append(node)
    homeless = [node.name for node in members.pop("", ())]
    if homeless:
        warnings.warn(f"{source(stage)}: in no room: {', '.join(homeless[:8])}", SkippedPrims, stacklevel=2)
    return {
        key: _graph(stage, nodes, inside.get(key), None, [key.rpartition("/")[2]]) for key, nodes in members.items()
    }


def _read(
    stage: Usd.Stage, *, names: bool, columns: bool = False
) -> tuple[list[tuple[Sdf.Path, Node]], list[tuple[Sdf.Path, Box]], list[str]]:
    """What a stage holds: prim path and node, prim path and box of every floor, and all words."""
    boxed = _boxes(to_metres(stage))
    nodes: list[tuple[Sdf.Path, Node]] = []
    floors: list[tuple[Sdf.Path, Box]] = []
    seen_words: list[str] = []
    taken: set[str] = set()
    skipped: Counter[str] = Counter()
    obstacles: Counter[str] = Counter()
    prims = iter(Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()))
    for prim in prims:
        if prim.IsA(UsdShade.Material):
            prims.PruneChildren()
            continue
        words = list(labels(prim))
        if value(prim, "visibility") == UsdGeom.Tokens.invisible:
            skipped.update(["hidden"] if words else [])
            prims.PruneChildren()
            continue
        seen_words.extend((*words, prim.GetName()))
        category, about = next(filter(None, map(known_category, words)), None), {}
        if category is None and prim.IsA(UsdGeom.PointInstancer):  # prototypes stand nowhere by themselves
            skipped.update(["of an instancer"] if names or _holds_furniture(prim) else [])
            prims.PruneChildren()
            continue
        if category is None and names and not words:
            category = category_of_name(prim)
        if category is None:
            if is_floor(prim, words, names=names) and (ground := boxed(prim)) is not None:
                floors.append((prim.GetPath(), ground))
            if columns and not words and _is_column(prim, boxed(prim)):
                words = [spaced(prim.GetName()) or OBSTACLE]
            if not words or any(is_structure(word) for word in words):
                continue
            size = () if _holds_furniture(prim) or (box := boxed(prim)) is None else sorted(box.size)
            if size and size[0] > 0 and size[1] >= LARGE:
                category, about = TAKEN_FOR, {OBSTACLE: words[0]}
                obstacles[repr(words[0])] += 1
            else:
                skipped[f"unknown label {words[0]!r}"] += 1
                continue
        box = boxed(prim)
        if box is None or min(box.size) <= 0:
            skipped["no bounds"] += 1
            continue
        prims.PruneChildren()
        called = prim.GetName()
        name = free_name(called, taken) if called.isascii() else identifier_of(called, category, taken)
        taken.add(name)
        node = Node(
            name, category, size=box.size, position=box.position, yaw=box.yaw, locked=bool(about), attributes=about,
            shapes="boxes" if about else None, title=None if called.isascii() else called,
        )  # fmt: skip
        nodes.append((prim.GetPath(), node))
    _tell(stage, skipped, obstacles)
    if not nodes:
        raise StageError(
            f"{source(stage)}: no scene graph (no EchoSceneGraph prim) and no prims with semantics labels and bounds "
            "to make one of" + ("" if names else "; --names takes the names of prims for labels")
        )
    longest = max(max(node.size or (0.0,)) for _, node in nodes)
    if not USUAL[0] < longest < USUAL[1]:
        unit = f"{metres_per_unit(stage):g}" + " (not stated)" * (not UsdGeom.StageHasAuthoredMetersPerUnit(stage))
        fits = f"its largest object is {longest:.3g} m long: does metersPerUnit, {unit}, fit?"
        warnings.warn(f"{source(stage)}: {fits}", stacklevel=3)
    return nodes, floors, seen_words


def _tell(stage: Usd.Stage, skipped: Counter[str], obstacles: Counter[str]) -> None:
    seen = (("labelled prims that became no node", skipped), ("unknown labels, fixed obstacles", obstacles))
    if text := [f"{what}: {', '.join(f'{w} ({n})' for w, n in found.most_common(8))}" for what, found in seen if found]:
        warnings.warn(f"{source(stage)}: {'; '.join(text)}", SkippedPrims, stacklevel=4)


def _graph(
    stage: Usd.Stage, nodes: list[Node], floor: Box | None, room_type: str | None, words: list[str]
) -> SceneGraph:
    kind = room_type or _room_type(words, [node.category for node in nodes])
    with faults(source(stage)):
        return SceneGraph(RoomSpec(kind, floor_polygon=_corners(floor)), tuple(nodes))


def _is_column(prim: Usd.Prim, box: Box | None) -> bool:
    """Whether a thing without a label stands in the way: high, and no wall by its plan or its name."""
    if box is None or box.size[1] < COLUMN[0] or any(any(labels(below)) for below in Usd.PrimRange(prim)):
        return False
    if not COLUMN[1] <= min(box.size[0], box.size[2]) <= max(box.size[0], box.size[2]) <= COLUMN[2]:
        return False
    return not any(
        any(labels(above)) or not STRUCTURE.isdisjoint(spaced(above.GetName()).split("_")) for above in lineage(prim)
    )


def _holds_furniture(prim: Usd.Prim) -> bool:
    below = Usd.PrimRange(prim, Usd.TraverseInstanceProxies())
    return any(known_category(word) for each in below if each != prim for word in labels(each))


def _room_above(prim: Usd.Prim) -> str:
    """Path of the innermost prim above one that is labelled or called as a room, "" = there is none."""
    for each in lineage(prim.GetParent()):
        if any(vocabulary().known_room_type(spaced(word)) for word in (*labels(each), each.GetName())):
            return str(each.GetPath())
    return ""


def _over(node: Node, floor: Box) -> bool:
    """Whether the middle of a node is above a floor and no storey higher."""
    assert node.position is not None
    away = np.subtract(node.position, floor.position)
    width, depth = np.abs(seen(away[[0, 2]], floor.yaw))
    return bool(width <= floor.size[0] / 2 and depth <= floor.size[2] / 2 and -0.5 < away[1] < STOREY)


def object_box(prim: Usd.Prim) -> Box | None:
    """The upright box around a prim of a stage, turned as the prim is; None where it has no bounds."""
    return _boxes(to_metres(prim.GetStage()))(prim)


def _boxes(frame: np.ndarray) -> Callable[[Usd.Prim], Box | None]:
    """`object_box` of the prims of a stage in some frame, which share what is computed once."""
    cache = UsdGeom.BBoxCache(NOW, [UsdGeom.Tokens.default_, UsdGeom.Tokens.render], True)
    return lambda prim: box_of(_object_bound(cache, prim), frame)


def boxed_graph(prims: RoomPrims) -> SceneGraph:
    """The graph of a room whose nodes all have boxes: as stated, else as their prims stand there; raises StageError."""
    graph = room_graph(prims)
    paths = {name: path for path, name in node_names(prims).items()}
    nodes, stage = [], prims.room.GetStage()
    boxed = _boxes(room_frame(prims.room, UsdGeom.XformCache(NOW)))
    for node in graph.nodes:
        if None in (node.size, node.position, node.yaw):
            box = boxed(stage.GetPrimAtPath(paths[node.name]))
            if box is None:
                where = f"{source(stage)}: {paths[node.name]}"
                raise StageError(f"{where}: has no bounds, allowed: a box or geometry for every object")
            node = node.replaced(size=box.size, position=box.position, yaw=box.yaw)
        nodes.append(node)
    return graph.replaced(nodes=tuple(nodes))


def _object_bound(cache: UsdGeom.BBoxCache, prim: Usd.Prim) -> Gf.BBox3d:
    """The prim's bound along its own axes, where `BBoxCache` gives one along the world's to what is no component."""
    imageable = UsdGeom.Imageable(prim)
    if not imageable:
        return Gf.BBox3d()
    to_world = imageable.ComputeLocalToWorldTransform(NOW)
    if abs(to_world.GetDeterminant3()) < _FLAT:
        return Gf.BBox3d()
    whole = Gf.Range3d()
    descendants = iter(Usd.PrimRange(prim, Usd.TraverseInstanceProxies()))
    for leaf in descendants:
        if leaf.IsA(UsdGeom.Boundable):
            bound = cache.ComputeWorldBound(leaf)
            bound.Transform(to_world.GetInverse())
            whole.UnionWith(bound.ComputeAlignedRange())
            descendants.PruneChildren()
    return Gf.BBox3d(whole, to_world) if not whole.IsEmpty() else cache.ComputeWorldBound(prim)


def _corners(floor: Box | None) -> tuple[tuple[float, float], ...] | None:
    if floor is None or floor.size[0] * floor.size[2] < 1e-6:
        return None
    plan = footprints(np.array([floor.size]), np.array([floor.position]), np.array([floor.yaw]))[0]
    return tuple((x, z) for x, z in plan.tolist())


def _room_type(words: list[str], categories: list[str]) -> str:
    for known in filter(None, (vocabulary().known_room_type(word.rstrip("0123456789_")) for word in words)):
        return known.name
    has = {*categories, *(vocabulary().category(name).coarse for name in categories)}
    kinds = [kind for kind in vocabulary().room_types if kind.signs and has.issuperset(kind.signs)]
    return max(kinds, key=lambda kind: kind.certainty).name if kinds else UNTOLD
