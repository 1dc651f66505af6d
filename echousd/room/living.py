"""The living rules on a room of ours: what a person would point at, in the words of its graph."""

from __future__ import annotations

import numpy as np

from echomodel.boxes import Boxes
from echomodel.rules.living import Fault, faults
from echousd.graph import SceneGraph
from echousd.room.tensors import graph_batch


def living_faults(graph: SceneGraph, boxes: Boxes, floor: np.ndarray) -> list[Fault]:
    """What a person would point at; numbers are those of the graph's nodes.

    Arguments:
        graph: what was asked for; boxes of nodes with a stated position are not blamed.
        boxes: N boxes in its order. floor: (k, 2) float, corners of the floor, metres.
    """
    return faults(
        boxes,
        [node.category for node in graph.nodes],
        floor if graph.room.corners is None else np.asarray(graph.room.corners),  # openings count its edges
        graph.room.openings,
        graph_batch(graph).triplets,
        given=np.array([node.position is not None for node in graph.nodes]),
    )
