"""A graph as arrays and as models take it, randomness for every branch, numbers rounded so that bytes are equal."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from echomodel.boxes import Boxes
from echomodel.graph import GraphBatch, Stated
from echomodel.randomness import Noise
from echomodel.vocabulary import vocabulary
from echousd.graph import SceneGraph

LENGTH = 1e-4  # metres
ANGLE = 0.01  # degrees
DISTANCE = 1e-4  # of a signed distance on the normalised grid
DESCRIPTION = 1e-4  # of a number that describes a piece of furniture


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


@contextmanager
def one_thread() -> Iterator[None]:
    """Run torch, if it is loaded, on one thread inside the block, whatever the machine or the environment offers."""
    torch = sys.modules.get("torch")
    if torch is None:
        yield
        return
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def rounded_boxes(graph: SceneGraph, boxes: Boxes) -> Boxes:
    """The boxes in tenths of a millimetre and hundredths of a degree, turned by half a turn at most.

    What the graph fixes stays exactly as given.
    """
    degrees = np.rad2deg(np.asarray(boxes.yaw, float))
    turn = np.deg2rad(rounded(degrees - 360 * np.round(degrees / 360.01), ANGLE))  # half a turn keeps its sign
    size = np.maximum(rounded(boxes.size, LENGTH), LENGTH)
    position = rounded(boxes.position, LENGTH)
    for i, node in enumerate(graph.nodes):
        size[i] = size[i] if node.size is None else node.size
        position[i] = position[i] if node.position is None else node.position
        turn[i] = turn[i] if node.yaw is None else node.yaw
    return Boxes(*(values.astype(np.float32) for values in (size, position, turn)))


def rounded(values: np.ndarray, step: float) -> np.ndarray:
    """(...) float numbers in steps, none of them a negative nought."""
    return np.round(np.asarray(values, float) / step) * step + 0.0


def graph_batch(graph: SceneGraph) -> GraphBatch:
    """The graph as arrays of numpy; relations and placements in their order."""
    words = vocabulary()
    kinds = [row.name for row in words.placements]
    return GraphBatch.single(
        [words.category_id(node.category) for node in graph.nodes],
        triplets_of(graph),
        room_type=words.room_type_id(graph.room.type),
        floor=graph.room.floor_polygon or graph.room.size,
        openings=graph.room.openings,
        placements=[
            (one.subject, kinds.index(one.placement), *(one.others or (-1, -1))) for one in stated_placements(graph)
        ],
        height=graph.room.height,
        device=None,
    )


def seeded(seed: int, branch: str, number: int = 0) -> Noise:
    """Independent randomness for each branch and layout, so that one more layout changes no other."""
    state = np.random.SeedSequence([seed, *branch.encode(), number]).generate_state(1, np.uint64)[0]
    return Noise(int(state >> np.uint64(1)))
