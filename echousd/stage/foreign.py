"""Scene graphs of stages that others authored: semantics labels and bounds become nodes, boxes become relations."""

from __future__ import annotations

import math
import os
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from pxr import Gf, Tf, Usd, UsdGeom

from echomodel.roomboxes import RoomBoxes, footprints
from echomodel.vocabulary import UnknownWord, normalised, vocabulary
from echousd.graph import GraphError, Node, Relation, RoomSpec, SceneGraph
from echousd.naming import free_name
from echousd.stage.encoding import StageError
from echousd.stage.files import opened, source
from echousd.stage.units import metres_per_unit, up_axis
from echousd.stage.values import texts

LABELS_SCHEMA = "SemanticsLabelsAPI:"
OLD_SCHEMA = "SemanticsAPI:"  # Omniverse before UsdSemantics
STRUCTURE = frozenset({"floor", "wall", "walls", "ceiling", "door", "window", "room", "building", "curtain", "rug"})
_UPRIGHT = 1e-3  # how far an axis may lean, as the deviation of a rotation matrix's entries
_FLAT = 1e-18  # the determinant of a transform that leaves no volume
_Z_TO_Y = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])  # (x, y, z) of a Z-up stage -> (x, z, -y)


class SkippedPrims(UserWarning):
    """Labelled prims that became no node; the message counts them by reason."""


@dataclass(frozen=True)
class Box:
    """An upright box in the room frame: size (3,) and position (3,) of the bottom centre in metres, yaw in radians."""

    size: tuple[float, float, float]
    position: tuple[float, float, float]
    yaw: float


@dataclass(frozen=True)
class StageFrame:
    """From the stage's axes and unit to the room frame: +Y up, metres."""

    rotation: np.ndarray
    metres: float

    @classmethod
    def of(cls, stage: Usd.Stage) -> StageFrame:
        z_up = up_axis(stage) == UsdGeom.Tokens.z
        return cls(_Z_TO_Y if z_up else np.eye(3), metres_per_unit(stage))

    def box(self, bound: Gf.BBox3d) -> Box | None:
        """The box around `bound`: turned like its prim where that stands upright, else along the room's axes."""
        local = bound.GetRange()
        if local.IsEmpty():
            return None
        low, high = np.array(local.GetMin()), np.array(local.GetMax())
        matrix = np.array(bound.GetMatrix())
        linear = self.rotation @ matrix[:3, :3].T * self.metres  # columns: the prim's axes in the room frame
        centre = self.rotation @ (matrix[:3, :3].T @ ((low + high) / 2) + matrix[3, :3]) * self.metres
        for axes in (np.eye(3), _Z_TO_Y.T):  # the object's own up axis is Y or Z, whatever the stage's
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
    x, y, z = (float(number) for number in centre)
    width, height, depth = (float(number) for number in size)
    return Box((width, height, depth), (x, y - height / 2, z), yaw)


def foreign_graph(stage: Usd.Stage | str | os.PathLike[str], room_type: str | None = None) -> SceneGraph:
    """The nodes of a stage without a scene graph: its topmost prims with semantics labels and bounds, boxes fixed.

    A label of any SemanticsLabelsAPI instance or of Omniverse's SemanticsAPI counts if the vocabulary knows it; the
    instance `category` is asked first. Lengths and axes are converted to metres and +Y up. A prim labelled `floor`
    gives the floor. Without `room_type` it is guessed: by a prim's name or label, else by the furniture.
    Warns `SkippedPrims`; raises StageError where nothing is left.
    """
    stage = opened(stage)
    frame = StageFrame.of(stage)
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_, UsdGeom.Tokens.render], True)
    nodes: dict[str, Node] = {}
    floor: Box | None = None
    room_words: list[str] = []
    skipped: Counter[str] = Counter()
    prims = iter(Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()))
    for prim in prims:
        words = list(labels(prim))
        room_words += [*words, prim.GetName()]
        category = next(filter(None, map(known_category, words)), None)
        if category is None:
            if "floor" in map(normalised, words) and floor is None:
                floor = frame.box(_object_bound(cache, prim))
            elif words and not any(_is_structure(word) for word in words):
                skipped[f"unknown label {words[0]!r}"] += 1
            continue
        box = frame.box(_object_bound(cache, prim))
        if box is None or min(box.size) <= 0:
            skipped["no bounds"] += 1
            continue
        prims.PruneChildren()
        ascii_name = prim.GetName().encode("ascii", "replace").decode().replace("?", "_")
        name = free_name(Tf.MakeValidIdentifier(ascii_name), nodes)
        nodes[name] = Node(name, category, size=box.size, position=box.position, yaw=box.yaw)
    if skipped:
        told = ", ".join(f"{reason} ({count})" for reason, count in skipped.most_common(8))
        warnings.warn(f"{source(stage)}: labelled prims that became no node: {told}", SkippedPrims, stacklevel=2)
    if not nodes:
        raise StageError(
            f"{source(stage)}: no scene graph (no EchoSceneGraph prim) and no prims with semantics labels and bounds "
            "to make one of"
        )
    kind = room_type or _room_type(room_words, [node.category for node in nodes.values()])
    try:
        return SceneGraph(RoomSpec(kind, floor_polygon=_corners(floor)), tuple(nodes.values()))
    except GraphError as error:
        raise StageError(f"{source(stage)}: {error}") from None


def labels(prim: Usd.Prim) -> Iterator[str]:
    """All semantics labels of a prim, those of the taxonomy `category` first."""
    applied = prim.GetPrimTypeInfo().GetAppliedAPISchemas()
    new = [name.removeprefix(LABELS_SCHEMA) for name in applied if name.startswith(LABELS_SCHEMA)]
    for taxonomy in sorted(new, key=lambda name: name != "category"):
        attribute = prim.GetAttribute(f"semantics:labels:{taxonomy}")
        yield from texts(attribute)
    for name in applied:
        if name.startswith(OLD_SCHEMA):
            attribute = prim.GetAttribute(f"semantic:{name.removeprefix(OLD_SCHEMA)}:params:semanticData")
            for found in texts(attribute):
                yield from (word.strip() for word in found.split(","))


def known_category(word: str) -> str | None:
    """The vocabulary's name for a label, None where it has none."""
    try:
        return vocabulary().category(word).name
    except UnknownWord:
        return None


def _is_structure(word: str) -> bool:
    if normalised(word) in STRUCTURE:
        return True
    try:
        return bool(vocabulary().room_type(word))
    except UnknownWord:
        return False


def _object_bound(cache: UsdGeom.BBoxCache, prim: Usd.Prim) -> Gf.BBox3d:
    """The prim's bound along its own axes, where `BBoxCache` gives one along the world's to what is no component."""
    imageable = UsdGeom.Imageable(prim)
    if not imageable:
        return Gf.BBox3d()
    to_world = imageable.ComputeLocalToWorldTransform(Usd.TimeCode.Default())
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
    for word in words:
        try:
            return vocabulary().room_type(word.rstrip("0123456789_")).name
        except UnknownWord:
            continue
    has = set(categories)
    coarse = {vocabulary().category(name).coarse for name in has}
    if "bed" in coarse:
        return "bedroom"
    if "dining_table" in has:
        return "living_dining_room" if "sofa" in coarse else "dining_room"
    return "study" if "desk" in has and "sofa" not in coarse else "living_room"


def relations_from_boxes(graph: SceneGraph, *, rules: str = "strict") -> SceneGraph:
    """`graph` with the relations that its boxes show (SG-FRONT's rules) between pairs that it says nothing about.

    Arguments:
        graph: every node with size, position and yaw, as `foreign_graph` reads them.
        rules: `strict` or `sgfront`, see `echomodel.rules`.

    Raises StageError for a node without a box.
    """
    from echomodel.rules import label_relations

    found = label_relations(room_boxes(graph), rules=rules)
    names = {predicate.id: predicate.name for predicate in vocabulary().predicates}
    stated = {frozenset((relation.subject, relation.object)) for relation in graph.relations}
    nodes = graph.names
    triples = [(nodes[s], names[p], nodes[o]) for s, p, o in np.asarray(found).tolist()]
    new = tuple(Relation(*triple) for triple in triples if frozenset((triple[0], triple[2])) not in stated)
    return SceneGraph(graph.room, graph.nodes, (*graph.relations, *new))


def room_boxes(graph: SceneGraph) -> RoomBoxes:
    """A graph whose nodes all have boxes as `RoomBoxes`; the floor, where unknown, is the boxes' bounding rectangle."""
    for node in graph.nodes:
        if node.size is None or node.position is None or node.yaw is None:
            raise StageError(f"object {node.name!r} has no size, position and yaw, allowed: a box for every object")
    size = np.array([node.size for node in graph.nodes])
    position = np.array([node.position for node in graph.nodes])
    styles = {style: number for number, style in enumerate(dict.fromkeys(n.style for n in graph.nodes if n.style))}
    reach = np.hypot(size[:, 0], size[:, 2])[:, None] / 2
    low, high = (position[:, ::2] - reach).min(0), (position[:, ::2] + reach).max(0)
    corners = graph.room.floor_polygon or ((low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1]))
    return RoomBoxes(
        id="stage",
        room_type=graph.room.type,
        floor_polygon=np.array(corners),
        height=graph.room.height or float((position[:, 1] + size[:, 1]).max()),
        categories=tuple(node.category for node in graph.nodes),
        size=size,
        position=position,
        yaw=np.array([node.yaw for node in graph.nodes], float),
        models=("",) * len(graph.nodes),
        styles=tuple(styles.get(node.style, -1) if node.style else -1 for node in graph.nodes),
    )
