"""What is stated before anything is drawn: what is locked, what a caller brings along."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from echomodel.boxes import Boxes
from echomodel.late import Late
from echousd.graph import SceneGraph
from echousd.graph.files import STAGE_FORMS
from echousd.stage.files import opened
from echousd.stage.read import find_rooms

read_contents = Late("echousd.stage.contents:read_contents")  # of a stage where something is locked


def with_own_boxes(graph: SceneGraph, boxes: Boxes | None) -> SceneGraph:
    """The graph whose objects state size, place and heading of `boxes` (n, in its order); raises ValueError."""
    if boxes is None:
        return graph
    if len(boxes) != len(graph.nodes):
        raise ValueError(f"boxes: {len(boxes)} for a graph of {len(graph.nodes)} objects: need one box per object")
    rows = zip(graph.nodes, boxes.size.tolist(), boxes.position.tolist(), boxes.yaw.tolist(), strict=True)
    return graph.replaced(
        nodes=tuple(node.replaced(size=tuple(size), position=tuple(at), yaw=yaw) for node, size, at, yaw in rows)
    )


def with_own_pieces(graph: SceneGraph, meshes: Mapping[str, str | Path]) -> SceneGraph:
    """The graph in which some objects are files: object name -> file; raises ValueError naming object and file."""
    for name, file in meshes.items():
        if not Path(file).is_file():
            raise ValueError(f"meshes: object {name!r}: {file}: no such file")
        graph = graph.update_node(name, asset=Path(file).absolute().as_posix(), shapes=None)
    return graph


def with_locked_places(graph: SceneGraph, *files: Path | None) -> tuple[SceneGraph, tuple[str, ...]]:
    """The graph with size, position and yaw of locked objects that lack one, and a sentence for each without a place.

    Arguments:
        files: stages or folders of rooms in which the objects may stand, the first that holds one counts.

    Raises ValueError for a stage that cannot be read.
    """
    wanted = {node.name for node in graph.nodes if node.locked and None in (node.size, node.position, node.yaw)}
    for file in files:
        stage = None if file is None else _stage_of(file)
        if wanted and stage is not None:
            graph, found = _filled(graph, stage, wanted)
            wanted -= found
    lost = sorted(name for name in wanted if graph.node(name).position is None)
    return graph, tuple(f"{name} is locked but stands nowhere yet: it gets a place like all others" for name in lost)


def with_earlier_locks(graph: SceneGraph, earlier: Path | None) -> tuple[SceneGraph, tuple[str, ...]]:
    """The graph in which what the last generation has locked stays so, where the graph says nothing of its place.

    `earlier`: folder or root layer of that generation. Returns the graph, and a sentence for each object that stays.
    """
    from echousd.folder.manifest import find_manifest

    folder = earlier if earlier is None or earlier.is_dir() else earlier.parent
    manifest = find_manifest(folder, earlier.stem) if earlier and folder and folder.is_dir() else None
    if not manifest:
        return graph, ()
    try:
        old = SceneGraph.from_json(json.dumps(manifest.get("graph")))
    except ValueError:  # no graph that can be read
        return graph, ()
    kept = [
        node.replaced(locked=True, size=node.size or was.size, position=was.position, yaw=was.yaw)
        for node in graph.nodes
        if node.name in old.names and (node.locked, node.position, node.yaw) == (False, None, None)
        for was in [old.node(node.name)]
        if was.locked and was.category == node.category
    ]
    names = {node.name: node for node in kept}
    graph = graph.replaced(nodes=tuple(names.get(node.name, node) for node in graph.nodes)) if kept else graph
    return graph, tuple(
        f"{name} stays locked as in the room that is there; echousd edit --unlock frees it" for name in names
    )


def _stage_of(file: Path) -> Path | None:
    """The stage at a path: the file itself, or the root layer of a room's folder."""
    if file.is_dir():
        from echousd.folder.manifest import find_manifest

        manifest = find_manifest(file, file.resolve().name)
        file = file / f"{manifest['name']}.usda" if manifest else file
    return file if file.is_file() and file.suffix in STAGE_FORMS else None


def _filled(graph: SceneGraph, file: Path, wanted: set[str]) -> tuple[SceneGraph, set[str]]:
    stage = opened(file)
    things = {thing.node.name: thing for room in find_rooms(stage) for thing in read_contents(room).objects}
    found = wanted & things.keys()
    nodes = []
    for node in graph.nodes:
        if node.name in found:
            thing = things[node.name]
            node = node.replaced(
                size=node.size or tuple(thing.size.round(4).tolist()),
                position=node.position or tuple(thing.position.round(4).tolist()),
                yaw=round(float(thing.yaw), 5) if node.yaw is None else node.yaw,
            )
        nodes.append(node)
    return graph.replaced(nodes=tuple(nodes)), found
