"""Losses on predicted boxes: what the graph tells, and what a person would point at, by living rules."""

from __future__ import annotations

from dataclasses import replace

import torch
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.compact.draft import measurable
from echomodel.guidance import outside
from echomodel.objective import BY_EYE, TERMS, Plan
from echomodel.objective.physics import apart
from echomodel.objective.plan import UNKNOWN
from echomodel.openingrows import kept_free
from echomodel.rules import margins
from echomodel.training.rooms import LayoutBatch
from echomodel.vocabulary import vocabulary

TOLD_SLACK = 0.02  # the hinge asks for this much more than the rule does (metres or ratio)


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
        total = total + (torch.log1p((TOLD_SLACK - margin).clamp_min(0)) * weight).sum()
        weights = weights + weight.sum()
    return total / weights.clamp_min(1)


def told_triplets(batch: LayoutBatch) -> Tensor:
    """(E, 3) int64, [subject, predicate id, object], the relations that the graphs tell."""
    pair, predicate = batch.predicates.nonzero(as_tuple=True)
    return torch.stack([batch.pairs.receiver[pair], predicate, batch.pairs.sender[pair]], dim=1)


SLACK = 0.03  # metres or radians that are asked for beyond what a rule does
# Sizes are learned as they are; openings come as rows; what stands on a table is put there by placing.
OTHERWISE = ("scale", "door_free", "window_free", "lamp_on_surface")
STANDING = 0.3  # metres: what begins higher is in nobody's way
HEADINGS = 4.0  # weight of the headings beside the rules, which forgive five degrees
TOUCHING = 0.01  # metres that a box may reach into a wall
FIRM = 10.0  # a miss counts as log(1 + FIRM * metres)


def living_loss(batch: LayoutBatch, boxes: Boxes, level: Tensor, known: Tensor) -> Tensor:
    """Mean over the free boxes of how far they miss the living rules, weighted by (1 - level)^2.

    Arguments:
        boxes: N predicted boxes; places and headings alone are pulled at. level: (N,). known: (N,) bool.
    """
    plan = plan_of_batch(batch, boxes, known)
    with torch.no_grad():
        truth = replace(plan, size=batch.boxes.size, position=batch.boxes.position, yaw=batch.boxes.yaw)
        vars(plan)["anchor"] = truth.anchor  # whom each attends is not the network's to choose
    weight = (1 - level).square() * ~known
    return living_miss(plan, batch.graph.openings[batch.graph.scene], stands_low(batch.boxes), weight)


def physics_loss(batch: LayoutBatch, boxes: Boxes, level: Tensor, known: Tensor) -> Tensor:
    """Mean over the free boxes of how far they run into others and through walls, weighted by (1 - level)^2.

    Arguments:
        boxes: N predicted boxes; places and headings alone are pulled at. level: (N,). known: (N,) bool.
    """
    graph, pairs = batch.graph, batch.pairs
    free = measurable(Boxes(boxes.size.detach(), boxes.position, boxes.yaw))
    told = torch.zeros(0, 3, dtype=torch.int64, device=level.device)
    words, openings = (UNKNOWN,) * len(boxes), ((),) * graph.num_scenes
    plan = Plan(words, free.size, free.position, free.yaw, graph.scene, graph.floor, openings, told, known)
    once = ((pairs.receiver < pairs.sender) & torch.isfinite(batch.allowed)).nonzero()[:, 0]
    i, j = pairs.receiver[once], pairs.sender[once]
    vars(plan)["couples"] = i, j, batch.allowed[once]  # whom each may touch is not the network's to choose
    sure = (1 - level).square()
    weight = torch.minimum(sure[i], sure[j]) * ~(known[i] & known[j])
    over = (outside(free, graph.floor[graph.scene]).square().sum(1) + 1e-12).sqrt()
    total = (deep(apart(plan).margin) * weight).sum() + (deep(TOUCHING - over) * sure * ~known).sum()
    return total / (sure * ~known).sum().clamp_min(1)


def plan_of_batch(batch: LayoutBatch, boxes: Boxes, known: Tensor) -> Plan:
    """What the living rules look at, for all rooms of a batch at once; sizes are not pulled at."""
    graph, kinds = batch.graph, vocabulary().categories
    free = measurable(Boxes(boxes.size.detach(), boxes.position, boxes.yaw))
    return Plan(
        tuple(kinds[number] for number in graph.category.tolist()),
        free.size, free.position, free.yaw, graph.scene, graph.floor, ((),) * graph.num_scenes,
        told_triplets(batch), known,
    )  # fmt: skip


def stands_low(boxes: Boxes) -> Tensor:
    """(N,) bool, what begins so low that it is in the way of doors and windows."""
    return (boxes.position[:, 1] < STANDING).detach()


def living_miss(plan: Plan, openings: Tensor, low: Tensor, weight: Tensor) -> Tensor:
    """Weighted mean over the boxes of how far they miss the living rules and stand in the way of doors and windows.

    Arguments:
        openings: (N, O, ROW), of the room of each box. low: (N,) bool, what stands so low that it is in their way.
        weight: (N,).
    """
    total = weight.new_zeros(())
    for term in TERMS:
        if term.kind not in BY_EYE or term.name in OTHERWISE:
            continue
        seen = term.find(plan)
        total = total + (missed(seen.margin) * weight[seen.who]).sum()
    clear = kept_free(Boxes(plan.size, plan.position, plan.yaw), openings)
    total = total + (missed(clear) * weight * (low & plan.which(lambda kind: kind.support == "floor"))).sum()
    return total / weight.sum().clamp_min(1)


def heading_distance(batch: LayoutBatch, boxes: Boxes, level: Tensor, known: Tensor) -> Tensor:
    """Mean angle to the nearest quarter turn from the true heading, radians, weighted by (1 - level)^2."""
    weight = (1 - level).square() * ~known
    turn = 4 * (boxes.yaw - batch.boxes.yaw)
    off = (torch.atan2(turn.sin(), turn.cos()) / 4).abs()
    return (off * weight).sum() / weight.sum().clamp_min(1)


def missed(margin: Tensor) -> Tensor:
    """By how much margins are missed, as the losses count it: logarithmic, so that none pulls without bounds."""
    return deep(margin.float() - SLACK)


def deep(margin: Tensor) -> Tensor:
    """The same without slack: true rooms hold things that touch."""
    return torch.log1p(FIRM * (-margin).clamp_min(0))
