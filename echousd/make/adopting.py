"""Somebody's half-furnished stage as a graph: what stands there stays, what such a room lacks is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from echomodel.vocabulary import vocabulary
from echousd.assets.model_file import joined
from echousd.graph import GraphError, Node, SceneGraph
from echousd.graph.sentences import stating
from echousd.place.living import living_faults
from echousd.room import RoomData
from echousd.stage.files import open_stage
from echousd.stage.foreign import foreign_pieces
from echousd.stage.read import find_rooms

ONE_IS_ENOUGH = ("bed", "sofa", "screen")  # roles of which a room that has one lacks none


def adopted(
    file: Path,
    *,
    room: str | None = None,
    add: Sequence[str] | None = None,
    relate: Sequence[str] = (),
    names: bool = False,
) -> SceneGraph:
    """The graph of a stage of somebody else's, completed: its objects are locked where they stand and refer to it.

    Arguments:
        file: a stage with semantics labels and bounds; it is never written.
        room: room type, None = as the stage's words and furniture say.
        add: new objects as `name:category`, None = what such a room usually holds and this one lacks.
        relate: relations, `lamp close by sofa`.
        names: what has no label is known by the name of its asset or prim.

    Raises ValueError for a stage that cannot be read, that has nothing to adopt, or that has a scene graph already.
    """
    stage = open_stage(file)
    if find_rooms(stage):
        raise ValueError(f"{file}: has a scene graph already; echousd generate and echousd update go on with it")
    graph, paths = foreign_pieces(stage, room, names=names)
    theirs = tuple(
        node.replaced(locked=True, shapes=None, asset=joined(file.absolute().as_posix(), paths[node.name]))
        for node in graph.nodes
    )
    graph = graph.replaced(nodes=theirs)
    for node in lacking(graph) if add is None else map(_node, add):
        graph = graph.replaced(nodes=(*graph.nodes, node))
    for text in relate:
        graph = stating(graph, text)
    return graph


def lacking(graph: SceneGraph) -> list[Node]:
    """Objects that a room of this type usually holds and this one does not."""
    words = vocabulary()
    have = [node.category for node in graph.nodes]
    roles = {words.category(category).role for category in have}
    taken = set(graph.names)
    out: list[Node] = []
    for category, count in words.room_type(graph.room.type).contents:
        if words.category(category).role in roles & set(ONE_IS_ENOUGH):
            continue
        family = words.category(category).coarse, words.category(category).support
        present = sum((words.category(c).coarse, words.category(c).support) == family for c in have)
        for number in range(max(count - present, 0)):
            name = category if count - present == 1 else f"{category}_{number + 1}"
            while name in taken:
                name += "_new"
            taken.add(name)
            out.append(Node(name, category, style=category if count - present > 1 else None))
    return out


def seen_in_theirs(room: RoomData) -> list[str]:
    """What a person would point at among the pieces that stood there already: told, and left as it is.

    Walls count where their stage has a floor: a proposed one came after them.
    """
    theirs = {node.name for node in room.graph.nodes if node.locked and node.asset is not None}
    found = living_faults(room.graph, room.boxes, all_blamed=True)
    return [fault.says for fault in found if fault.object in theirs and fault.other in {None, *theirs}]


def _node(text: str) -> Node:
    name, colon, category = text.partition(":")
    if not colon:
        raise GraphError(f"add: found {text!r}, allowed: name:category, such as lamp:floor_lamp")
    return Node(name.strip(), category.strip())
