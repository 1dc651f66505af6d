"""Scene graphs as plain data: objects, relations and the room, with validation, edits, text forms and pictures.

Nothing here imports pxr or torch; `SceneGraph.from_stage` and `SceneGraph.to_stage` load `echousd.stage` when called.
"""

from echousd.graph.consistency import GraphError
from echousd.graph.difference import GraphDiff
from echousd.graph.fields import MAX_TEXT
from echousd.graph.files import load_graph, save_graph
from echousd.graph.nodes import Node, Placed, Relation, RoomSpec
from echousd.graph.scene import SceneGraph
from echousd.graph.starting import starting_graph

__all__ = [
    "MAX_TEXT",
    "GraphDiff",
    "GraphError",
    "Node",
    "Placed",
    "Relation",
    "RoomSpec",
    "SceneGraph",
    "load_graph",
    "save_graph",
    "starting_graph",
]
