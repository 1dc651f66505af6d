"""What a caller brings along: a layout, and pieces of furniture, stated in the graph before anything is drawn."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from echousd.graph import SceneGraph

if TYPE_CHECKING:
    from echomodel.boxes import Boxes


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
