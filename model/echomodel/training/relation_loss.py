"""What the graph tells, as a loss on predicted boxes: a hinge on the relations' margins."""

from __future__ import annotations

import torch
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.rules import margins
from echomodel.training.rooms import LayoutBatch
from echomodel.vocabulary import vocabulary

SLACK = 0.02  # the hinge asks for this much more than the rule does (metres or ratio)


def relation_hinge(batch: LayoutBatch, decoded: Boxes, level: Tensor, known: Tensor, rules: tuple[str, ...]) -> Tensor:
    """Mean over told relations of how far the predicted boxes miss them, weighted by (1 - level)^2."""
    # ratios to a height near or below zero would explode or change their sign
    lifted = torch.cat([decoded.position[:, :1], decoded.position[:, 1:2].clamp_min(0), decoded.position[:, 2:]], dim=1)
    boxes = Boxes(decoded.size.clamp(0.05, 8.0), lifted, decoded.yaw)
    triplets = told_triplets(batch)
    ids = [entry.id for entry in vocabulary().predicates if entry.measures]
    triplets = triplets[torch.isin(triplets[:, 1], triplets.new_tensor(ids))]
    total, weights = level.new_zeros(()), level.new_zeros(())
    emphasis = level.new_tensor([entry.loss_weight for entry in vocabulary().predicates])
    own = batch.rules[batch.graph.scene[triplets[:, 0]]]
    for number, name in enumerate(rules):
        chosen = triplets[own == number]
        if not len(chosen):
            continue
        ends = chosen[:, [0, 2]]
        weight = (1 - level[ends].amax(1)).square() * ~known[ends].all(1)
        margin = margins(boxes, chosen, rules=name, rigid=True)
        weight = weight * emphasis[chosen[:, 1]]
        total = total + (torch.log1p((SLACK - margin).clamp_min(0)) * weight).sum()
        weights = weights + weight.sum()
    return total / weights.clamp_min(1)


def told_triplets(batch: LayoutBatch) -> Tensor:
    """(E, 3) int64, [subject, predicate id, object], the relations that the graphs tell."""
    pair, predicate = batch.predicates.nonzero(as_tuple=True)
    return torch.stack([batch.pairs.receiver[pair], predicate, batch.pairs.sender[pair]], dim=1)
