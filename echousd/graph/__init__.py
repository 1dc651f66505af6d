"""Scene graphs as plain data: objects, relations and the room, with validation, edits, text forms and pictures.

Nothing here imports pxr or torch; `SceneGraph.from_stage` and `SceneGraph.to_stage` load `echousd.stage` when called.
"""

from echousd.graph.consistency import GraphError
from echousd.graph.scene import MAX_TEXT, Node, Relation, RoomSpec, SceneGraph

__all__ = ["MAX_TEXT", "GraphError", "Node", "Relation", "RoomSpec", "SceneGraph"]
