"""What a person wishes to change about a finished room, applied to its graph; and wishes read off a stronger layer."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from echousd.graph import GraphError, SceneGraph
from echousd.graph.sentences import stating, without
from echousd.graph.titles import composed, identifier_of, is_title, name_of
from echousd.make.reading import SavedRoom, read_room
from echousd.options import EditRequest

MOVED = 1e-3  # metres: a place further from the room's own is somebody's wish
TURNED = math.radians(0.1)


def wished(saved: SavedRoom, wishes: EditRequest) -> SceneGraph:
    """The graph of a room after some wishes; raises `GraphError` for what cannot be read or is not there.

    An object that is moved, turned or resized keeps the rest of its box as it is.
    """
    graph = saved.graph
    for said in wishes.remove:
        graph = graph.remove_node(_name(graph, said))
    for text in wishes.unrelate:
        graph = without(graph, text)
    for text in wishes.relabel:
        name, category = _named(graph, text)
        graph = _placed(graph.relabel_node(name, category), saved, name)
    for text in wishes.add:
        graph = _added(graph, text)
    for text in wishes.relate:
        graph = stating(graph, text)
    for said in wishes.lock:
        name = _name(graph, said)
        graph = _placed(graph, saved, name).lock(name)
    for said in wishes.unlock:
        graph = graph.update_node(_name(graph, said), locked=False, position=None, yaw=None)
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
        graph = _placed(graph, saved, name).update_node(name, size=numbers)
    for text in wishes.restyle:
        name, style = _parts(text)
        if name == "room" and name not in graph.names:
            graph = graph.replaced(room=graph.room.replaced(style=style or None))
        else:
            graph = graph.update_node(_name(graph, name), style=style or None)
    return graph


def artists_wishes(root: Path) -> tuple[Path, SceneGraph, tuple[str, ...]]:
    """What a stronger layer says otherwise than its room: the room's root layer, the graph as wished, who moved.

    Objects that the layer moves or turns are fixed where it puts them, and locked.

    Raises ValueError where `root` is no layer over a room of ours.
    """
    theirs = read_room(root)
    own = root.parent / f"{theirs.manifest['name']}.usda"
    if own.resolve() == root.resolve():
        raise ValueError(f"{root}: the room's own root layer; name the stronger layer that changes it")
    ours = read_room(own)
    graph, moved = theirs.graph, []
    for row, name in enumerate(theirs.graph.names):
        if name not in ours.graph.names:
            continue
        before = ours.graph.names.index(name)
        shift = np.asarray(theirs.boxes.position[row]) - np.asarray(ours.boxes.position[before])
        turn = float(theirs.boxes.yaw[row]) - float(ours.boxes.yaw[before])
        if np.linalg.norm(shift) > MOVED or abs(math.remainder(turn, 2 * math.pi)) > TURNED:
            graph = _placed(graph, theirs, name, anew=True).lock(name)
            moved.append(name)
    return own, graph, tuple(moved)


def _placed(graph: SceneGraph, saved: SavedRoom, name: str, *, anew: bool = False) -> SceneGraph:
    """The graph with the present place of an object stated, where none is or `anew`."""
    node = graph.node(name)
    if name not in saved.graph.names:
        return graph
    row = saved.graph.names.index(name)
    fields = {
        "position": tuple(round(float(v), 4) for v in saved.boxes.position[row]),
        "yaw": round(float(saved.boxes.yaw[row]), 5),
    }
    return graph.update_node(name, **{k: v for k, v in fields.items() if anew or getattr(node, k) is None})


def _added(graph: SceneGraph, text: str) -> SceneGraph:
    """The graph with an object of `name:category`; a name in another script becomes the object's title."""
    name, category = _parts(text)
    if not is_title(composed(name)):
        return graph.add_node(name, category)
    title = composed(name)
    if title in {node.title for node in graph.nodes}:
        raise GraphError(f"object {title!r} is in this graph")
    return graph.add_node(identifier_of(title, category, set(graph.names)), category, title=title)


def _named(graph: SceneGraph, text: str) -> tuple[str, str]:
    name, rest = _parts(text)
    return _name(graph, name), rest


def _name(graph: SceneGraph, said: str) -> str:
    """The name of the object that a person calls by its name or by its title."""
    return str(name_of(said.strip(), graph.titles))


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
