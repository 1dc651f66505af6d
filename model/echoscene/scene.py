"""A labelled scene graph in the form of the published loader: floor and scene nodes, `in` relations, text features."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from echomodel.text import TextEncoder, edge_text, node_text
from echomodel.vocabulary import vocabulary
from echoscene.encoder import SceneGraphTensors
from echoscene.model import STRUCTURE


def published_scene(
    labels: Sequence[str],
    triples: Tensor,
    *,
    classes: Sequence[str],
    text: TextEncoder,
    edges: bool = False,
) -> SceneGraphTensors:
    """One scene as the published model takes it.

    A floor and a `_scene_` node are put behind the objects, and every node but the last gets an `in` relation to it,
    behind the given ones (SPEC: section 1.3). The compact vocabulary's `Category.coarse` is the label of a class in
    the published weights of 14 classes.

    Arguments:
        labels: class names of the objects. triples: (E, 3) int64 [subject, predicate id, object] among them.
        classes: class names in the order of their ids (`ReleasedModel.classes`).
        text: encoder of labels and relations.
        edges: encode relations too (`paper` preset; the published weights never use them).

    Returns:
        N + 2 nodes and E + N + 1 triples.

    Raises:
        ValueError: a label that is no class, or a triple with an unknown predicate or end; names it.
    """
    index = {name: number for number, name in enumerate(classes)}
    names = [*labels, *STRUCTURE]
    for position, name in enumerate(names):
        if name not in index or (name in STRUCTURE and position < len(labels)):
            allowed = ", ".join(sorted(set(classes) - {*STRUCTURE}))
            raise ValueError(f"label of node {position} is {name!r}, allowed: {allowed}")
    predicates = vocabulary().sgfront_predicates
    triples = torch.as_tensor(triples, dtype=torch.int64).reshape(-1, 3)
    for row, (subject, predicate, target) in enumerate(triples.tolist()):
        if predicate not in predicates:
            raise ValueError(f"predicate of triplet {row} is {predicate}, allowed: 0..{max(predicates)}")
        if not (0 <= subject <= len(labels) and 0 <= target <= len(labels)):  # the floor is right behind the objects
            raise ValueError(f"triplet {row} joins nodes {subject} and {target}, allowed: 0..{len(labels)}")
    last = len(names) - 1
    inside = torch.tensor([[node, 0, last] for node in range(last)])
    triples = torch.cat([triples, inside])
    features = None
    if edges:
        features = text([edge_text(names[s], predicates[p], names[o]) for s, p, o in triples.tolist()])
    ids = torch.tensor([index[name] for name in names])
    return SceneGraphTensors(ids, triples, text([node_text(name) for name in names]), features)
