"""A scene graph as the model takes it: tensors in its frame, and randomness of its own for every branch."""

from __future__ import annotations

import numpy as np
import torch

from echomodel.graph import GraphBatch
from echomodel.vocabulary import vocabulary
from echousd.graph import SceneGraph


def graph_batch(graph: SceneGraph) -> GraphBatch:
    """The graph as tensors; relations and placements in their order."""
    words = vocabulary()
    index = {node.name: i for i, node in enumerate(graph.nodes)}
    kinds = [row.name for row in words.placements]
    return GraphBatch.single(
        [words.category_id(node.category) for node in graph.nodes],
        [(index[r.subject], words.predicate_id(r.predicate), index[r.object]) for r in graph.relations],
        room_type=words.room_type_id(graph.room.type),
        floor=graph.room.floor_polygon or graph.room.size,
        names=[node.name for node in graph.nodes],
        openings=graph.room.openings,
        placements=[
            (index[one.subject], kinds.index(one.placement), *([index[name] for name in one.others] or (-1, -1)))
            for one in graph.placements
        ],
    )


def floor_centre(graph: SceneGraph) -> torch.Tensor:
    """(3,) float32: the middle of the floor's bounding box, where the model's frame has its origin."""
    polygon = graph.room.floor_polygon
    if not polygon:
        return torch.zeros(3)
    corners = torch.tensor(polygon, dtype=torch.float32)
    middle = (corners.max(0).values + corners.min(0).values) / 2
    return torch.stack([middle[0], torch.zeros(()), middle[1]])


def seeded(seed: int, branch: str, number: int = 0) -> torch.Generator:
    """Independent randomness for each branch and layout, so that one more layout changes no other."""
    state = np.random.SeedSequence([seed, *branch.encode(), number]).generate_state(1, np.uint64)[0]
    return torch.Generator().manual_seed(int(state >> np.uint64(1)))
