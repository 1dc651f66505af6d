"""Scene graphs as plain data: objects, relations and the room, with validation, edits, text forms and pictures.

Nothing here imports pxr or torch; `load_graph` and `save_graph` load `echousd.stage` for a stage.
"""

from echomodel.late import Late
from echousd.graph.consistency import GraphError
from echousd.graph.nodes import Node, Placed, Relation, RoomSpec
from echousd.graph.scene import SceneGraph
from echousd.graph.values import MAX_TEXT

load_graph, save_graph = Late("echousd.graph.files:load_graph"), Late("echousd.graph.files:save_graph")
starting_graph = Late("echousd.graph.starting:starting_graph")
__all__ = [
    "MAX_TEXT", "GraphError", "Node", "Placed", "Relation", "RoomSpec", "SceneGraph", "load_graph",
    "save_graph", "starting_graph",
]  # fmt: skip
