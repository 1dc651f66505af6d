"""Scene graphs on USD stages: written in bulk, read through any composition, changed in place."""

from echousd.stage.boxes import read_dressing, relations_from_boxes
from echousd.stage.encoding import StageError
from echousd.stage.files import open_stage, save_layer
from echousd.stage.foreign import foreign_graph, foreign_rooms
from echousd.stage.graphs import read_graph, write_graph
from echousd.stage.read import read_rooms
from echousd.stage.update import update_graph
from echousd.stage.write import graph_layer

__all__ = [
    "StageError",
    "foreign_graph",
    "foreign_rooms",
    "graph_layer",
    "open_stage",
    "read_dressing",
    "read_graph",
    "read_rooms",
    "relations_from_boxes",
    "save_layer",
    "update_graph",
    "write_graph",
]
