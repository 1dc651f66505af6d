"""Which objects of a graph belong together: one shape, one style."""

from __future__ import annotations

import torch
from torch import Tensor

from echomodel.graph import GraphBatch
from echomodel.vocabulary import vocabulary


def equal_furniture(graph: GraphBatch) -> Tensor:
    """(N,) int64: for every node the first node of its class that relations of style or material join it to."""
    triplets = graph.triplets
    joins = torch.isin(triplets[:, 1], triplets.new_tensor(vocabulary().uniting("shape")))
    joins &= graph.category[triplets[:, 0]] == graph.category[triplets[:, 2]]
    return _first_joined(graph.num_nodes, triplets[joins][:, [0, 2]])


def joined(graph: GraphBatch, styles: Tensor | None = None) -> Tensor:
    """(N,) int64: for every node the first node of its style, by relations of style and by `styles` (N,), -1 = none."""
    triplets = graph.triplets
    ends = triplets[torch.isin(triplets[:, 1], triplets.new_tensor(vocabulary().uniting("style")))][:, [0, 2]]
    if styles is not None:
        styles = styles.to(triplets.device)
        same = (styles[:, None] == styles) & (graph.scene[:, None] == graph.scene) & (styles >= 0)
        ends = torch.cat([ends, same.nonzero()])
    return _first_joined(graph.num_nodes, ends)


def _first_joined(nodes: int, ends: Tensor) -> Tensor:
    """(N,) int64: for every node the first that a chain of the pairs `ends` (E, 2) joins it to."""
    first = torch.arange(nodes, device=ends.device)
    while len(ends):
        lowest = first[ends].amin(1)
        lower = first.scatter_reduce(0, ends.flatten(), lowest.repeat_interleave(2), "amin")
        if torch.equal(lower, first):
            break
        first = lower
    return first
