"""A graph as arrays: its relations and placements by the numbers of its nodes, the middle of its floor."""

from __future__ import annotations

import numpy as np

from echomodel.rules.placements import Stated
from echomodel.vocabulary import vocabulary
from echousd.graph import SceneGraph


def triplets_of(graph: SceneGraph) -> np.ndarray:
    """(e, 3) int, the relations of a graph in their order: numbers of subject, predicate and object."""
    number, words = {name: i for i, name in enumerate(graph.names)}, vocabulary()
    rows = [(number[r.subject], words.predicate_id(r.predicate), number[r.object]) for r in graph.relations]
    return np.array(rows, np.int64).reshape(-1, 3)


def stated_placements(graph: SceneGraph) -> tuple[Stated, ...]:
    """The placements of a graph by the numbers of its nodes, in the order of `SceneGraph.placements`."""
    number = {name: i for i, name in enumerate(graph.names)}
    return tuple(
        Stated(one.placement, number[one.subject], tuple(number[name] for name in one.others))
        for one in graph.placements
    )


def floor_centre(graph: SceneGraph) -> np.ndarray:
    """(3,) float32: the middle of the floor's bounding box, where the model's frame has its origin."""
    corners = np.array(graph.room.floor_polygon or np.zeros((1, 2)), np.float32)
    x, z = (corners.max(0) + corners.min(0)) / 2
    return np.array([x, 0.0, z], np.float32)
