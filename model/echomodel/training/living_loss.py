"""What a person would point at in predicted boxes, as a loss: margins of the living rules, openings, headings."""

from __future__ import annotations

import torch
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.compact.draft import measurable
from echomodel.openingrows import kept_free
from echomodel.rules.living import RULES, Plan
from echomodel.training.rooms import LayoutBatch
from echomodel.vocabulary import vocabulary

SLACK = 0.03  # metres or radians that are asked for beyond what a rule does
# Sizes are learned as they are; openings come as rows; what stands on a table is put there by repair.
OTHERWISE = ("scale", "door_free", "window_free", "lamp_on_surface")
STANDING = 0.3  # metres: what begins higher is in nobody's way
HEADINGS = 4.0  # weight of the headings beside the rules, which forgive five degrees
FIRM = 10.0  # a miss counts as log(1 + FIRM * metres)


def living_loss(batch: LayoutBatch, boxes: Boxes, level: Tensor, known: Tensor) -> Tensor:
    """Mean over the free boxes of tidy rooms of how far they miss the living rules, weighted by (1 - level)^2.

    Arguments:
        boxes: N predicted boxes; places and headings alone are pulled at. level: (N,). known: (N,) bool.
    """
    graph = batch.graph
    kinds = vocabulary().categories
    free = measurable(Boxes(boxes.size.detach(), boxes.position, boxes.yaw))
    plan = Plan(
        tuple(kinds[number] for number in graph.category.tolist()),
        free.size, free.position, free.yaw, graph.scene, graph.floor, ((),) * graph.num_scenes,
        _told(batch), known,
    )  # fmt: skip
    weight = (1 - level).square() * ~known * (batch.tidy[graph.scene] > 0)
    with torch.no_grad():
        truth = Plan(
            plan.kinds, batch.boxes.size, batch.boxes.position, batch.boxes.yaw, plan.scene, plan.floor, plan.openings,
            plan.triplets, known,
        )  # fmt: skip
        vars(plan)["anchor"] = truth.anchor  # whom each attends is not the network's to choose
    total = weight.new_zeros(())
    for rule in RULES:
        if rule.name in OTHERWISE:
            continue
        seen = rule.find(plan)
        total = total + (_miss(seen.margin) * weight[seen.who]).sum()
    clear = kept_free(free, graph.openings[graph.scene])
    low = (batch.boxes.position[:, 1] < STANDING) & plan.which(lambda kind: kind.support == "floor")
    total = total + (_miss(clear) * weight * low).sum()
    return total / weight.sum().clamp_min(1)


def heading_distance(batch: LayoutBatch, boxes: Boxes, level: Tensor, known: Tensor) -> Tensor:
    """Mean angle to the nearest quarter turn from the true heading, radians, weighted by (1 - level)^2."""
    weight = (1 - level).square() * ~known * (batch.tidy[batch.graph.scene] > 0)
    turn = 4 * (boxes.yaw - batch.boxes.yaw)
    off = (torch.atan2(turn.sin(), turn.cos()) / 4).abs()
    return (off * weight).sum() / weight.sum().clamp_min(1)


def _miss(margin: Tensor) -> Tensor:
    return torch.log1p(FIRM * (SLACK - margin.float()).clamp_min(0))


def _told(batch: LayoutBatch) -> Tensor:
    """(E, 3) int64, the relations that the graphs tell."""
    pair, predicate = batch.predicates.nonzero(as_tuple=True)
    return torch.stack([batch.pairs.receiver[pair], predicate, batch.pairs.sender[pair]], dim=1)
