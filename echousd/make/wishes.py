"""What a person wishes to change: in words, read off a stronger layer, or of somebody's half-furnished stage."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from echomodel.boxes2d import axes
from echomodel.vocabulary import vocabulary
from echousd.assets.reference import joined
from echousd.folder.found import own_root
from echousd.graph import GraphError, Node, SceneGraph
from echousd.graph.changes import EditRequest
from echousd.graph.starting import ONE_IS_ENOUGH
from echousd.graph.text import stating, without
from echousd.graph.titles import composed, identifier_of, is_title, name_of
from echousd.make.finished import Room
from echousd.make.pipeline import generate, with_own_pieces
from echousd.make.reading import SavedRoom, read_room
from echousd.place.geometry import Floor, depth_inside
from echousd.place.living import living_faults
from echousd.room import RoomData
from echousd.stage.apart import check_apart
from echousd.stage.files import open_stage
from echousd.stage.foreign import foreign_pieces
from echousd.stage.read import find_rooms

MOVED = 1e-3  # metres: a place further from the room's own is somebody's wish
TURNED = math.radians(0.1)


def wished(saved: SavedRoom, wishes: EditRequest) -> SceneGraph:
    """The graph of a room after some wishes; raises `GraphError` for what cannot be read or is not there.

    An object that is moved, turned or resized keeps the rest of its box as it is; one at a wall, whose place nobody
    stated, keeps its back there when it is resized.
    """
    graph = saved.graph
    for asked in wishes.remove:
        graph = graph.remove_node(_name(graph, asked))
    for text in wishes.unrelate:
        graph = without(graph, text)
    for text in wishes.relabel:
        name, category = _named(graph, text)
        graph = _placed(graph.update_node(name, category=category), saved, name)
    for text in wishes.add:
        graph = _added(graph, text)
    for text in wishes.relate:
        graph = stating(graph, text)
    for asked in wishes.lock:
        name = _name(graph, asked)
        graph = _placed(graph, saved, name).lock(name)
    for asked in wishes.unlock:
        graph = graph.update_node(_name(graph, asked), locked=False, position=None, yaw=None)
    for text in wishes.move:
        name, place = _named(graph, text)
        graph = _placed(graph, saved, name)
        numbers = _numbers("move", text, place, (2, 3), "name:x,z or name:x,y,z, metres")
        height = (graph.node(name).position or (0.0, 0.0, 0.0))[1] if len(numbers) == 2 else numbers[1]
        graph = graph.update_node(name, position=(numbers[0], height, numbers[-1]))
    for text in wishes.turn:
        name, way = _named(graph, text)
        graph = _placed(graph, saved, name)
        graph = graph.update_node(name, yaw=way if way[-1:].isalpha() else f"{way} deg")
    for text in wishes.resize:
        name, size = _named(graph, text)
        numbers = _numbers("resize", text, size, (3,), "name:x,y,z, metres")
        backs = _at_wall(saved, name) if graph.node(name).position is None else None
        graph = _placed(graph, saved, name).update_node(name, size=numbers)
        if backs is not None:
            x, z = (backs[0] + backs[1] * numbers[2] / 2).round(4).tolist()
            graph = graph.update_node(name, position=(x, (graph.node(name).position or (0.0, 0.0))[1], z))
    graph = with_own_pieces(graph, dict(_named(graph, text) for text in wishes.reshape))
    for text in wishes.restyle:
        name, style = _parts(text)
        if name == "room" and name not in graph.names:
            graph = graph.with_room(style=style or None)
        else:
            graph = graph.update_node(_name(graph, name), style=style or None)
    return graph


def artists_wishes(root: Path) -> tuple[Path, SceneGraph, tuple[str, ...], dict[str, str]]:
    """What a stronger layer says otherwise than its room: the room's root layer, the graph as wished, who moved, and
    the assets of what it copied.

    Objects that the layer moves, turns or puts beside what they are copies of are fixed there, and locked.

    Raises ValueError where `root` is no layer over a room of ours, changes nothing, or moves on from a room's places.
    """
    theirs = read_room(root)
    own = own_root(root)
    if own.resolve() == root.resolve():
        raise ValueError(f"{root}: the room's own root layer; name the stronger layer that changes it")
    ours = read_room(own)
    graph, moved = theirs.graph, []
    copies = {name: asset for name, asset in theirs.assets.items() if name not in ours.graph.names}
    for row, name in enumerate(theirs.graph.names):
        size = tuple(theirs.boxes.size[row].round(4).tolist())
        graph = graph.update_node(name, size=size) if name in copies else graph
        like = [k for k, one in enumerate(ours.graph.names) if name == one or copies.get(name) == ours.assets[one]]
        shift = theirs.boxes.position[row] - ours.boxes.position[like]
        turn = np.angle(np.exp(1j * (theirs.boxes.yaw[row] - ours.boxes.yaw[like])))
        if np.all((np.linalg.norm(shift, axis=1) > MOVED) | (abs(turn) > TURNED)):
            if name not in copies and ours.operations[name].items() <= theirs.operations[name].items():
                own_values = f"other values of its own {' and '.join(ours.operations[name])}"
                raise ValueError(f"{root}: moves {name} from wherever the room puts it, allowed: {own_values}")
            graph = _placed(graph, theirs, name, anew=True).lock(name)
            moved.append(name)
    if not ours.graph.diff(graph).lines():
        raise ValueError(f"{root}: changes nothing about the room")
    return own, graph, tuple(moved), copies


def _placed(graph: SceneGraph, saved: SavedRoom, name: str, *, anew: bool = False) -> SceneGraph:
    """The graph with the present place of an object stated, where none is or `anew`."""
    node = graph.node(name)
    if name not in saved.graph.names:
        return graph
    row = saved.graph.names.index(name)
    fields = {
        "position": tuple(round(float(v), 4) for v in saved.boxes.position[row]),
        "yaw": round(float(saved.boxes.yaw[row]), 7),
    }
    return graph.update_node(name, **{k: v for k, v in fields.items() if anew or getattr(node, k) is None})


def _at_wall(saved: SavedRoom, name: str) -> tuple[np.ndarray, np.ndarray] | None:
    """Where the back of an object is, (2,) x and z, and its front's heading; None where no wall is within 0.1 m."""
    if saved.graph.room.corners is None or name not in saved.graph.names:
        return None
    row, boxes = saved.graph.names.index(name), saved.boxes
    front = axes(np.asarray(boxes.yaw[row], float))[1]
    back = np.asarray(boxes.position[row], float)[[0, 2]] - front * float(boxes.size[row, 2]) / 2
    return (back, front) if depth_inside(Floor(saved.graph.room.corners), back[None])[0] < 0.1 else None


def _added(graph: SceneGraph, text: str) -> SceneGraph:
    """The graph with an object of `name:category`; a name in another script becomes the object's title."""
    name, category = _parts(text)
    if ":" not in text:
        raise GraphError(f"add: found {text!r}, allowed: name:category, such as lamp:floor_lamp")
    if not is_title(composed(name)):
        return graph.add_node(name, category)
    title = composed(name)
    if title in {node.title for node in graph.nodes}:
        raise GraphError(f"object {title!r} is in this graph")
    return graph.add_node(identifier_of(title, category, set(graph.names)), category, title=title)


def _named(graph: SceneGraph, text: str) -> tuple[str, str]:
    name, rest = _parts(text)
    return _name(graph, name), rest


def _name(graph: SceneGraph, text: str) -> str:
    """The name of the object that a person calls by its name or by its title."""
    return str(name_of(text.strip(), graph.titles))


def _parts(text: str) -> tuple[str, str]:
    name, colon, rest = text.partition(":")
    return name.strip(), rest.strip() if colon else name.strip()


def _numbers(wish: str, text: str, rest: str, counts: tuple[int, ...], allowed: str) -> tuple[float, ...]:
    try:
        numbers = tuple(float(word) for word in rest.replace(",", " ").split())
    except ValueError:
        numbers = ()
    if len(numbers) not in counts or not all(map(math.isfinite, numbers)):
        raise GraphError(f"{wish}: found {text!r}, allowed: {allowed}")
    return numbers


def adopt(
    stage: str | Path, *, room: str | None = None, add: Sequence[str] | None = None, relate: Sequence[str] = (),
    names: bool = False, **given: Any,
) -> Room:  # fmt: skip
    """Complete a stage that others began: its furniture stays where and as it is, new pieces stand around it.

    Arguments:
        stage: a stage with semantics labels and bounds, which is not written; the room refers to its pieces.
        room: room type, None = as the stage's words and furniture say.
        add: new objects as `name:category`, None = what such a room usually holds and this one lacks.
        relate: relations, `lamp close by sofa`.
        names: what has no label is known by the name of its asset or prim.
        given: options and all else that `generate` takes.

    Raises ValueError for a stage that cannot be read, that has nothing to adopt, or that has a scene graph already, and
    as `generate` does.
    """
    check_apart(stage)
    return generate(adopted(Path(stage), room=room, add=add, relate=relate, names=names), **given)


def adopted(
    file: Path, *, room: str | None = None, add: Sequence[str] | None = None, relate: Sequence[str] = (),
    names: bool = False,
) -> SceneGraph:  # fmt: skip
    """The graph of a stage of somebody else's, completed: its objects are locked where they stand and refer to it.

    Arguments and errors are those of `adopt`.
    """
    stage = open_stage(file)
    if find_rooms(stage):
        raise ValueError(f"{file}: has a scene graph already; echousd generate and echousd update go on with it")
    graph, paths = foreign_pieces(stage, room, names=names)
    theirs = tuple(
        node.replaced(locked=True, shapes=None, asset=joined(file.absolute().as_posix(), paths[node.name]))
        for node in graph.nodes
    )
    graph = graph.replaced(nodes=(*theirs, *(lacking(graph) if add is None else ())))
    for text in add or ():
        graph = _added(graph, text)
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
