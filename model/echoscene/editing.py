"""Pseudo graphs of the inverse manipulation strategy: an edited graph in, the true scene out (EchoScene, 3.5)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import accumulate

import torch
from torch import Tensor

from echoscene.encoder import SceneGraphTensors
from echoscene.model import GraphChange

CHANGEABLE = range(1, 12)  # predicates that a relation is changed into, as published

RelationText = Callable[[int, int, int], Tensor]  # (subject node, predicate id, object node) -> (text,) float32


def pseudo_graph(
    graph: SceneGraphTensors, generator: torch.Generator, relation_text: RelationText | None = None
) -> GraphChange:
    """The graph from which an edit would have led to `graph`: a node less, another relation, or the same graph.

    The three are equally likely; a scene without an object or a relation to change stays as it is.

    Arguments:
        graph: one scene, its floor and `_scene_` node last. generator: source of the choice.
        relation_text: text features of a changed relation; needed where the graph has edge texts.

    Raises:
        ValueError: the graph has edge texts and `relation_text` is missing.
    """
    if graph.edge_text is not None and relation_text is None:
        raise ValueError("a graph with edge texts needs relation_text for the relations that are changed")
    kind = int(torch.randint(3, (), generator=generator))
    objects, triples = len(graph.classes) - 2, graph.triples
    if kind == 0 and objects > 0:
        node = int(torch.randint(objects, (), generator=generator))
        return GraphChange(without_node(graph, node), added=(node,))
    eligible = ((triples[:, 1] != 0) & (triples[:, [0, 2]] < objects).all(1)).nonzero()[:, 0]
    if kind == 1 and len(eligible):
        row = int(eligible[torch.randint(len(eligible), (), generator=generator)])
        subject, old, target = triples[row].tolist()
        others = [p for p in CHANGEABLE if p != old]
        new = others[int(torch.randint(len(others), (), generator=generator))]
        changed, text = triples.clone(), graph.edge_text
        changed[row, 1] = new
        if text is not None and relation_text is not None:
            text = text.clone()
            text[row] = relation_text(subject, new, target)
        return GraphChange(replace(graph, triples=changed, edge_text=text), touched=(subject, target))
    return GraphChange(graph)


def without_node(graph: SceneGraphTensors, node: int) -> SceneGraphTensors:
    """The graph without a node and its relations."""
    keep = torch.arange(len(graph.classes)) != node
    rows = (graph.triples[:, [0, 2]] != node).all(1)
    triples = graph.triples[rows].clone()
    for column in (0, 2):
        triples[:, column] -= (triples[:, column] > node).long()
    text = None if graph.edge_text is None else graph.edge_text[rows]
    return SceneGraphTensors(graph.classes[keep], triples, graph.node_text[keep], text)


def pack_scenes(graphs: Sequence[SceneGraphTensors]) -> tuple[SceneGraphTensors, Tensor]:
    """Scenes behind one another as one disjoint graph, and the scene (N,) int64 of each node."""
    counts = [len(graph.classes) for graph in graphs]
    starts = [0, *accumulate(counts)]
    texts = [graph.edge_text for graph in graphs]
    whole = SceneGraphTensors(
        torch.cat([graph.classes for graph in graphs]),
        torch.cat([g.triples + torch.tensor([s, 0, s]) for g, s in zip(graphs, starts, strict=False)]),
        torch.cat([graph.node_text for graph in graphs]),
        None if any(text is None for text in texts) else torch.cat([text for text in texts if text is not None]),
    )
    return whole, torch.repeat_interleave(torch.arange(len(graphs)), torch.tensor(counts))


def pack_changes(graphs: Sequence[SceneGraphTensors], changes: Sequence[GraphChange]) -> GraphChange:
    """The changes that lead to `graphs`, for the packed graph.

    Added nodes are counted in the packed graph before, touched ones in the packed graph after; the published code
    counts both in the graph before, and flags the wrong nodes once an earlier scene of the batch has an addition.
    """
    before, _ = pack_scenes([change.before for change in changes])
    old = [0, *accumulate(len(change.before.classes) for change in changes)]
    new = [0, *accumulate(len(graph.classes) for graph in graphs)]
    return GraphChange(
        before,
        added=tuple(start + node for start, change in zip(old, changes, strict=False) for node in change.added),
        touched=tuple(start + node for start, change in zip(new, changes, strict=False) for node in change.touched),
    )
