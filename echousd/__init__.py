"""EchoUSD: author indoor scenes in USD from semantic scene graphs."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from echousd import plugin

plugin.register()  # first act: a stage opened before the schema is registered never learns it

if TYPE_CHECKING:
    from echousd.batches.batch import batch, generate_many
    from echousd.graph import GraphError, Node, Relation, RoomSpec, SceneGraph
    from echousd.room import Room, generate
    from echousd.stage import read_graph, read_rooms, relations_from_boxes, update_graph, write_graph

__version__ = "0.1.0"

# Public names and the module of each, imported on first use: `import echousd` loads neither pxr nor torch.
_HOME = {
    "GraphError": "echousd.graph",
    "Node": "echousd.graph",
    "Relation": "echousd.graph",
    "RoomSpec": "echousd.graph",
    "SceneGraph": "echousd.graph",
    "read_graph": "echousd.stage",
    "read_rooms": "echousd.stage",
    "relations_from_boxes": "echousd.stage",
    "update_graph": "echousd.stage",
    "write_graph": "echousd.stage",
    "Room": "echousd.room",
    "batch": "echousd.batches.batch",
    "generate": "echousd.room",
    "generate_many": "echousd.batches.batch",
}
__all__ = [
    "GraphError",
    "Node",
    "Relation",
    "Room",
    "RoomSpec",
    "SceneGraph",
    "batch",
    "generate",
    "generate_many",
    "read_graph",
    "read_rooms",
    "relations_from_boxes",
    "update_graph",
    "write_graph",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'echousd' has no attribute {name!r}")
    value = getattr(importlib.import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})
