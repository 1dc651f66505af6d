"""Training on own samples: the last steps of a sampling run are differentiated, what is wrong with its end is the loss.

A network that is trained on noised true rooms alone never meets the errors that it makes itself on the way from noise.
Here it arranges rooms as a user has it do, and learns from what a person would point at in them (DRaFT-K, Clark et al.
2024, with the margins of the living rules and of what the graph tells in place of a learned reward).
"""

from __future__ import annotations

from itertools import pairwise

import torch
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.compact.layout import exactly
from echomodel.compact.model import CompactModel
from echomodel.compact.predictors import layout_predictor
from echomodel.guidance import outside
from echomodel.randomness import normal
from echomodel.samplers import SAMPLERS
from echomodel.schedule import sampling_levels
from echomodel.training.living_loss import SLACK, living_miss, missed, plan_of_batch, stands_low
from echomodel.training.relation_loss import relation_hinge
from echomodel.training.rooms import LayoutBatch

SPARSE = 0.15  # share of dense graphs among the rooms that the network arranges
LATE = 0.5  # above this level every second step is left out: nothing is decided there to the centimetre
RELATIONS = 10.0  # weight of a metre by which something told is missed, as steep as the living rules are
LONGEST = 0.05  # of the gradient of a box: one that turns at a hair's breadth would drown all others


def own_loss(
    model: CompactModel, batch: LayoutBatch, generator: torch.Generator, kept: int
) -> tuple[Tensor, dict[str, Tensor]]:
    """What is wrong with tidy rooms that the network arranges alone: living rules, openings, floors and what is told.

    Arguments:
        batch: the graphs; its true boxes are not looked at. generator: source of all noise.
        kept: last steps of sampling through which the gradient is kept.

    Returns:
        The loss, and the parts that the log names.
    """
    graph, boxes = batch.graph, own_rooms(model, batch, generator, kept)
    with exactly(boxes.position):
        given = torch.zeros(len(boxes), dtype=torch.bool, device=boxes.yaw.device)
        plan, openings = plan_of_batch(batch, boxes, given), graph.openings[graph.scene]
        living = living_miss(plan, openings, stands_low(boxes), torch.ones_like(boxes.yaw))
        relations = relation_hinge(batch, boxes, torch.zeros_like(boxes.yaw), given, model.config.rules)
        over = outside(boxes, graph.floor[graph.scene])
        floor = missed(SLACK - (over.square().sum(1) + 1e-12).sqrt()).mean()
    parts = {"own_living": living, "own_relations": relations, "own_floor": floor}
    return living + RELATIONS * relations + floor, parts


def own_rooms(model: CompactModel, batch: LayoutBatch, generator: torch.Generator, kept: int) -> Boxes:
    """Boxes (N) as the network's own sampler ends with them; arguments as for `own_loss`."""
    layout = model.config.layout
    step = SAMPLERS[layout.sampler](layout.objective, generator)
    levels = [level for k, level in enumerate(sampling_levels(layout.steps).tolist()) if level <= LATE or k % 2 == 0]
    with torch.no_grad():
        latent = model.latent(batch.graph.category, batch.pairs)
    predict = layout_predictor(model, batch.graph, batch.pairs, latent, batch.rules)
    x = normal((batch.graph.num_nodes, 8), generator, batch.graph.category.device)
    first = max(len(levels) - 1 - kept, 0)
    for number, (start, end) in enumerate(pairwise(levels)):
        with torch.set_grad_enabled(number >= first):
            x = _steadied(step(x, predict(x, torch.full_like(x[:, 0], start)), start, end))
    return Boxes.decode(x, model.scale(batch.graph.category))


def _steadied(x: Tensor) -> Tensor:
    """The same boxes (N, 8), back through which no gradient of a box goes that is longer than `LONGEST`."""
    if x.requires_grad:
        x.register_hook(lambda g: g * (LONGEST / g.norm(dim=1, keepdim=True).clamp_min(1e-12)).clamp_max(1))
    return x
