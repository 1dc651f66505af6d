"""Relations that the boxes of a graph show."""

from __future__ import annotations

import numpy as np

from echomodel.roomboxes import RoomBoxes
from echomodel.vocabulary import vocabulary
from echousd.graph import Relation, SceneGraph
from echousd.stage.encoding import StageError


def relations_from_boxes(graph: SceneGraph, *, rules: str = "strict", per_object: float | None = None) -> SceneGraph:
    """`graph` with the relations that its boxes show (SG-FRONT's rules) between pairs that it says nothing about.

    Arguments:
        graph: every node with size, position and yaw, as `foreign_graph` reads them.
        rules: `strict` or `sgfront`, see `echomodel.rules`.
        per_object: only so many relations an object, those that a person would write down: of near pairs, places
            before sizes; None = all that hold.

    Raises StageError for a node without a box.
    """
    from echomodel.rules import label_relations

    boxes = room_boxes(graph)
    found = label_relations(boxes, rules=rules, headings=True)
    if per_object is not None:
        from echomodel.rules.telling import told_of_room

        found = told_of_room(found, boxes, per_object)
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
