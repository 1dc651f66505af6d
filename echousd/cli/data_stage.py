"""`echousd data to-usd`, `from-usd`, `to-sgfront`, `from-sgfront`: rooms of any source to other files and back."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    import numpy as np

    from echomodel.roomboxes import RoomBoxes
    from echousd.graph import SceneGraph

STYLE = "style_"
USD_FILES = (".usda", ".usdc", ".usd")


def register(app: typer.Typer) -> None:
    """Add the commands to `echousd data`."""
    from echousd.cli.data import data_app

    data_app.command("to-usd")(to_usd)
    data_app.command("from-usd")(from_usd)
    data_app.command("to-sgfront")(to_sgfront)
    data_app.command("from-sgfront")(from_sgfront)


def graph_of(room: RoomBoxes, rules: str | None = "strict") -> SceneGraph:
    """A room as a scene graph with its boxes.

    Arguments:
        room: its own relations are kept where it has some.
        rules: rule set that labels a room without relations; None = leave it without.

    Raises:
        UnknownWord: a category or room type that the vocabulary does not hold.
    """
    from echomodel.rules import label_relations
    from echomodel.vocabulary import vocabulary
    from echousd.graph import Node, Relation, RoomSpec, SceneGraph

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
        edges = label_relations(room, rules=rules)
    spelled = {predicate.id: predicate.name for predicate in words.predicates}
    relations = tuple(Relation(names[s], spelled[p], names[o]) for s, p, o in ([] if edges is None else edges.tolist()))
    polygon = tuple((float(x), float(z)) for x, z in room.floor_polygon) or None
    return SceneGraph(RoomSpec(room.room_type, floor_polygon=polygon, height=room.height), nodes, relations)


def room_of(graph: SceneGraph, name: str) -> RoomBoxes:
    """The room that `graph_of` (or anybody else) put into a graph whose nodes all have boxes.

    Raises:
        StageError: a node without a box.
    """
    from dataclasses import replace

    import numpy as np

    from echomodel.vocabulary import vocabulary
    from echousd.stage.foreign import room_boxes

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


def to_usd(
    rooms: Annotated[Path, typer.Argument(help="Rooms file (JSON) or folder of a room set.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for the stages, one per room.")],
    limit: Annotated[int | None, typer.Option(help="Only the first rooms.")] = None,
    rules: Annotated[str, typer.Option(help="Label rooms without relations: strict, sgfront or none.")] = "strict",
    known: Annotated[bool, typer.Option(help="Leave out objects that the vocabulary does not hold.")] = True,
) -> None:
    """Write rooms of any source as USD stages with their scene graphs.

    Example: echousd data to-usd rooms.json -o stages --limit 10
    """
    from echomodel.metrics.room_figures import with_known_words
    from echousd.cli.data import load_rooms
    from echousd.stage import graph_layer
    from echousd.stage.files import save_layer

    found = load_rooms(rooms, limit)
    given = [room.relations for room in found]
    if known:
        kept = with_known_words(found)
        # Relations speak of places in the list: they stay valid only where nothing was left out.
        found = [
            room if len(room) < len(old) else _with_relations(room, edges)
            for room, old, edges in zip(kept, found, given, strict=True)
        ]
    out.mkdir(parents=True, exist_ok=True)
    for room in found:
        if len(room):
            save_layer(graph_layer(graph_of(room, None if rules == "none" else rules)), out / f"{room.id}.usda")


def _with_relations(room: RoomBoxes, relations: np.ndarray | None) -> RoomBoxes:
    from dataclasses import replace

    return replace(room, relations=relations)


def from_usd(
    stages: Annotated[list[Path], typer.Argument(help="Stages, or folders of stages.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="Rooms file (JSON).")],
) -> None:
    """Read the rooms of USD stages, whose objects all have boxes, into a rooms file.

    Example: echousd data from-usd stages -o rooms.json
    """
    from echomodel.roomboxes import write_rooms
    from echousd.stage import read_rooms

    files: list[Path] = []
    for path in stages:
        files += sorted(p for p in path.iterdir() if p.suffix in USD_FILES) if path.is_dir() else [path]
    found = []
    for path in files:
        for prim, graph in read_rooms(str(path)).items():
            name = path.stem if prim in ("/Room", "") else f"{path.stem}{prim.replace('/', '_')}"
            found.append(room_of(graph, name))
    if not found:
        raise ValueError(f"{', '.join(map(str, stages))}: no room found")
    write_rooms(out, found)


def to_sgfront(
    rooms: Annotated[Path, typer.Argument(help="Rooms file (JSON) or folder of a room set.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for the files.")],
    split: Annotated[str, typer.Option(help="trainval or test.")] = "trainval",
    drop: Annotated[float, typer.Option(help="Share of the relations that is left out.")] = 0.5,
    seed: Annotated[int, typer.Option(help="Seed of the dropping.")] = 0,
) -> None:
    """Write rooms in the files of SG-FRONT, labelled by its rules.

    Example: echousd data to-sgfront rooms.json -o sgfront
    """
    from echomodel.data.sgfront_writer import write_sgfront
    from echomodel.metrics.room_figures import with_known_words
    from echousd.cli.data import load_rooms

    write_sgfront(out, with_known_words(load_rooms(rooms)), split=split, drop=drop, seed=seed)


def from_sgfront(
    folder: Annotated[Path, typer.Argument(help="Folder with the files of SG-FRONT.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="Rooms file (JSON).")],
    room: Annotated[str, typer.Option(help="bedroom, livingroom, diningroom, library or all.")] = "all",
    split: Annotated[str, typer.Option(help="trainval or test.")] = "trainval",
) -> None:
    """Read SG-FRONT into a rooms file, with its relations.

    Example: echousd data from-sgfront 3D-FRONT --split test -o test.json
    """
    from echomodel.data.sgfront import SGFront
    from echomodel.roomboxes import write_rooms

    write_rooms(out, SGFront(folder, room, split).rooms())
