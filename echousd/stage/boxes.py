"""Relations that the boxes of a graph show."""

import os
import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
from pxr import Usd

from echomodel.roomboxes import RoomBoxes
from echomodel.rules import label_relations
from echomodel.vocabulary import vocabulary
from echousd.graph import Node, Relation, RoomSpec, SceneGraph
from echousd.graph.arrays import triplets_of
from echousd.graph.dressing import DressingGraph, SmallNode
from echousd.naming import free_name
from echousd.stage import encoding as usd
from echousd.stage import values
from echousd.stage.encoding import StageError
from echousd.stage.files import open_stage, opened
from echousd.stage.foreign import boxed_graph, foreign_rooms
from echousd.stage.graphs import save_layer
from echousd.stage.read import faults, find_rooms, node_names, place, relation_of, stated_fields, the_room
from echousd.stage.write import graph_layer


def relations_from_boxes(graph: SceneGraph, *, rules: str = "strict", per_object: float | None = None) -> SceneGraph:
    """`graph` with the relations that its boxes show (SG-FRONT's rules) between pairs that it says nothing about.

    Arguments:
        graph: every node with size, position and yaw, as `foreign_graph` reads them.
        rules: `strict` or `sgfront`, see `echomodel.rules`.
        per_object: only so many relations an object, those that a person would write down: of near pairs, places
            before sizes; None = all that hold.

    Raises StageError for a node without a box.
    """
    boxes = room_boxes(graph)
    found = label_relations(boxes, rules=rules, headings=True)
    if per_object is not None:
        from echomodel.rules.telling import stated_of_room

        found = stated_of_room(found, boxes, per_object)
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
    corners = graph.room.corners
    if corners is None:
        corners = np.array(((low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])))
    return RoomBoxes(
        id="stage", room_type=graph.room.type, floor_polygon=np.asarray(corners, float),
        height=graph.room.height or max(graph.room.tall, float((position[:, 1] + size[:, 1]).max())),
        categories=tuple(node.category for node in graph.nodes), size=size, position=position,
        yaw=np.array([node.yaw for node in graph.nodes], float), models=("",) * len(graph.nodes),
        styles=tuple(styles.get(node.style, -1) if node.style else -1 for node in graph.nodes),
        openings=graph.room.openings,
    )  # fmt: skip


def read_dressing(stage: Usd.Stage | str | os.PathLike[str], room: str | None = None) -> DressingGraph:
    """The small things that are nodes on a stage or in a file, and their relations; those of the layout that is shown.

    Empty where the room was made without `dress_graph`, and where its layer `dressing` is muted.

    Arguments:
        room: prim path of the room, needed where there are several.

    Raises StageError that names the prim at fault, for one with a category that no small thing has.
    """
    stage = opened(stage)
    with values.reading(stage):
        prims = the_room(stage, room)
        names = node_names(prims, small=True)
        nodes = tuple(read_small(prim) for prim in prims.small)
        found = (relation_of(prim, names) for prim in prims.small_relations)
        return DressingGraph(nodes, tuple(relation for relation in found if relation))


def read_small(prim: Usd.Prim) -> SmallNode:
    """The small thing that a prim states; raises StageError."""
    known = {name: field for name, field in usd.NODE_FIELDS.items() if field in SmallNode.model_fields}
    fields = stated_fields(prim, known)
    if "category" not in fields:
        raise StageError(f"{place(prim)}: no category, allowed: {usd.CATEGORY}, one of those of small things")
    with faults(place(prim)):
        return SmallNode(name=prim.GetName(), **fields)


STYLE = "style_"


def graph_of(room: RoomBoxes, rules: str | None = "strict") -> SceneGraph:
    """A room as a scene graph with its boxes.

    Arguments:
        room: its own relations are kept where it has some.
        rules: rule set that labels a room without relations; None = leave it without.

    Raises:
        UnknownWord: a category or room type that the vocabulary does not hold.
    """
    words, number = vocabulary(), Counter[str]()
    totals = Counter(words.category(word).name for word in room.categories)
    names = []
    for word in room.categories:
        name = words.category(word).name
        number[name] += 1
        names.append(name if totals[name] == 1 else f"{name}_{number[name]}")
    styles, models = room.styles or (-1,) * len(room), room.models or ("",) * len(room)
    nodes = tuple(
        Node(
            names[k],
            room.categories[k],
            style=f"{STYLE}{styles[k]}" if styles[k] >= 0 else None,
            size=tuple(room.size[k].tolist()),
            position=tuple(room.position[k].tolist()),
            yaw=float(room.yaw[k]),
            attributes={"model": models[k]} if models[k] else {},
        )
        for k in range(len(room))
    )
    edges = room.relations
    if edges is None and rules is not None:
        edges = label_relations(room, rules=rules, headings=True)
    spelled = {predicate.id: predicate.name for predicate in words.predicates}
    relations = tuple(Relation(names[s], spelled[p], names[o]) for s, p, o in ([] if edges is None else edges.tolist()))
    polygon = tuple((float(x), float(z)) for x, z in room.floor_polygon) or None
    spec = RoomSpec(room.room_type, floor_polygon=polygon, height=room.height, openings=room.openings)
    return SceneGraph(spec, nodes, relations)


def room_of(graph: SceneGraph, name: str) -> RoomBoxes:
    """The room that `graph_of` (or anybody else) put into a graph whose nodes all have boxes.

    Raises:
        StageError: a node without a box.
    """
    words = [node.style for node in graph.nodes]
    ours = all(style is None or re.fullmatch(rf"{STYLE}\d+", style) for style in words)
    room = room_boxes(graph)
    return replace(
        room,
        id=name,
        models=tuple(str(node.attributes.get("model", "")) for node in graph.nodes),
        styles=tuple(int(s.removeprefix(STYLE)) if s else -1 for s in words) if ours else room.styles,
        relations=triplets_of(graph),
    )


def write_stages(rooms: Iterable[RoomBoxes], folder: Path, rules: str | None = "strict") -> None:
    """A stage with its scene graph for every room that holds something; `rules` as for `graph_of`."""
    folder.mkdir(parents=True, exist_ok=True)
    taken: set[str] = set()
    for room in rooms:
        if len(room):
            name = free_name(re.sub(r"[^\w.-]", "_", room.id).lstrip(".") or "room", taken)
            taken.add(name)
            save_layer(graph_layer(graph_of(room, rules)), folder / f"{name}.usda")


def read_stage(path: Path) -> list[RoomBoxes]:
    """The rooms of a stage that hold something, as stated, else as they stand there; each is called after the file.

    Raises StageError for a file that is no stage, one without graphs and labels, and an object without bounds.
    """
    found, stage = [], open_stage(path)
    graphs = {str(prims.room.GetPath()): boxed_graph(prims) for prims in find_rooms(stage)}
    for prim, graph in (graphs or foreign_rooms(stage)).items():
        name = path.stem if prim in ("/Room", "") else f"{path.stem}{prim.replace('/', '_')}"
        found += [room_of(graph, name)] if graph.nodes else []
    return found
