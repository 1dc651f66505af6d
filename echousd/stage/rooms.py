"""Rooms as boxes, of any data set, as scene graphs with their boxes, and back."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from echomodel.roomboxes import RoomBoxes
from echomodel.vocabulary import vocabulary
from echousd.graph import Node, Relation, RoomSpec, SceneGraph
from echousd.stage.boxes import room_boxes
from echousd.stage.files import save_layer
from echousd.stage.read import read_rooms
from echousd.stage.write import graph_layer

STYLE = "style_"
USD_FILES = (".usda", ".usdc", ".usd")


def graph_of(room: RoomBoxes, rules: str | None = "strict") -> SceneGraph:
    """A room as a scene graph with its boxes.

    Arguments:
        room: its own relations are kept where it has some.
        rules: rule set that labels a room without relations; None = leave it without.

    Raises:
        UnknownWord: a category or room type that the vocabulary does not hold.
    """
    from echomodel.rules import label_relations

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
    return SceneGraph(RoomSpec(room.room_type, floor_polygon=polygon, height=room.height), nodes, relations)


def room_of(graph: SceneGraph, name: str) -> RoomBoxes:
    """The room that `graph_of` (or anybody else) put into a graph whose nodes all have boxes.

    Raises:
        StageError: a node without a box.
    """
    words, place = vocabulary(), {node.name: k for k, node in enumerate(graph.nodes)}
    edges = [(place[r.subject], words.predicate_id(r.predicate), place[r.object]) for r in graph.relations]
    given = [node.style for node in graph.nodes]
    ours = all(style is None or re.fullmatch(rf"{STYLE}\d+", style) for style in given)
    room = room_boxes(graph)
    return replace(
        room,
        id=name,
        models=tuple(str(node.attributes.get("model", "")) for node in graph.nodes),
        styles=tuple(int(s.removeprefix(STYLE)) if s else -1 for s in given) if ours else room.styles,
        relations=np.array(edges, np.int64).reshape(-1, 3),
    )


def write_stages(rooms: Iterable[RoomBoxes], folder: Path, rules: str | None = "strict") -> None:
    """A stage with its scene graph for every room that holds something; `rules` as for `graph_of`."""
    folder.mkdir(parents=True, exist_ok=True)
    for room in rooms:
        if len(room):
            save_layer(graph_layer(graph_of(room, rules)), folder / f"{room.id}.usda")


def read_stages(paths: Iterable[Path]) -> list[RoomBoxes]:
    """The rooms of stages, or of all stages of folders; raises StageError for an object without a box."""
    files: list[Path] = []
    for path in paths:
        files += sorted(p for p in path.iterdir() if p.suffix in USD_FILES) if path.is_dir() else [path]
    found = []
    for path in files:
        for prim, graph in read_rooms(str(path)).items():
            name = path.stem if prim in ("/Room", "") else f"{path.stem}{prim.replace('/', '_')}"
            found.append(room_of(graph, name))
    return found
