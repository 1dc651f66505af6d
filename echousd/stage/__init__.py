"""Scene graphs on USD stages: written in bulk, read through any composition, changed in place."""

from echousd.stage.encoding import StageError
from echousd.stage.files import open_stage, save_layer
from echousd.stage.read import read_graph, read_rooms
from echousd.stage.write import graph_layer, write_graph

__all__ = ["StageError", "graph_layer", "open_stage", "read_graph", "read_rooms", "save_layer", "write_graph"]
