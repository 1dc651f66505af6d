"""How different the layouts of one graph are, beside how differently the room generator furnishes the same rooms."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import torch
from scipy.optimize import linear_sum_assignment

from echomodel.boxes import Boxes
from echomodel.drafts import drafted
from echomodel.graph import GraphBatch


def variety_scores(graphs: Sequence[GraphBatch], sample: Callable[[GraphBatch], Boxes], seeds: int, rules: str) -> dict:
    """Mean distance between layouts of one graph (`layout_distance`), and of arrangements that are told nothing.

    Arguments:
        graphs: of one scene each. sample: boxes of packed scenes. seeds: layouts of each graph.
        rules: the rule set that the relations are meant in.

    Returns:
        `here`, `generator`: metres; `ratio` of the two; `rooms` (those with a floor), `seeds`: how many.
    """
    here, generator = [], []
    luck = torch.Generator().manual_seed(0)
    for graph in graphs:
        if not bool(torch.isfinite(graph.floor[0, 0]).all()):
            continue
        here.append(variety(sample(GraphBatch.pack([graph] * seeds)), graph, seeds))
        bare = GraphBatch.pack([graph.with_triplets(graph.triplets[:0])] * seeds)
        generator.append(variety(drafted(bare, luck, rules=rules, draws=1)[0], graph, seeds))
    if not here:
        return {"rooms": 0, "seeds": seeds}
    means = float(np.mean(here)), float(np.mean(generator))
    return {"here": means[0], "generator": means[1], "ratio": means[0] / means[1], "rooms": len(here), "seeds": seeds}


def variety(boxes: Boxes, graph: GraphBatch, count: int) -> float:
    """Mean distance of all pairs of `count` layouts of one graph that lie behind one another in `boxes`, metres."""
    places = boxes.position[:, [0, 2]].detach().cpu().double().numpy().reshape(count, graph.num_nodes, 2)
    category = graph.category.cpu().numpy()
    return float(np.mean([layout_distance(places[i], places[k], category) for i in range(count) for k in range(i)]))


def layout_distance(one: np.ndarray, other: np.ndarray, category: np.ndarray) -> float:
    """Mean distance in plan between the pieces of two layouts of the same furniture, metres; equal pieces may swap.

    Arguments:
        one, other: (n, 2) float, metres. category: (n,) int.
    """
    total = 0.0
    for number in np.unique(category):
        mine = category == number
        apart = np.linalg.norm(one[mine][:, None] - other[mine][None], axis=-1)
        total += float(apart[linear_sum_assignment(apart)].sum())
    return total / max(len(one), 1)
