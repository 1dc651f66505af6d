"""What is wrong with rooms that the network draws itself, led back through the last steps of sampling.

This is DRaFT-K (Clark et al. 2024) with the terms of the objective as the reward, weighed alike, not by what they cost
a search: a person who looks at a draw counts what is wrong in it.
"""

from __future__ import annotations

import torch
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.compact.model import CompactModel
from echomodel.compact.sampling import box_scale, layout_predictor
from echomodel.guidance import heights
from echomodel.objective import BY_EYE, TERMS, Plan
from echomodel.objective.support import FREE, ON_CEILING, ON_FLOOR
from echomodel.randomness import normal
from echomodel.samplers import sample
from echomodel.training.layout_losses import deep, physics_loss, plan_of_batch, relation_hinge
from echomodel.training.rooms import LayoutBatch
from echomodel.vocabulary import vocabulary

STEPS, KEPT = (5, 10), 2  # of a draw at least and at most, and its last steps, which the gradient goes through
LONGEST = 200.0  # slope of one box at a step: one that turns at a hair's breadth would drown all others
ASKED = 0.02  # metres, radians or a share beyond a term's margin
PHYSICS = 3.0  # weight of what runs into something
RELATIONS = 30.0  # weight of a metre by which something told is missed, as steep as a term is
# Sizes are learnt as they are, openings are looked at with walls, what is bare is looked at room by room.
OTHERWISE = ("scale", "door_free", "window_free", "floor_used", "floor_served", "ends_used", "hung_over")


def drawn_loss(model: CompactModel, batch: LayoutBatch, generator: torch.Generator) -> tuple[Tensor, dict[str, Tensor]]:
    """The mean over the boxes of all that terms, walls, openings and relations miss in rooms drawn from noise.

    Arguments:
        batch: graphs and floors; of its true boxes only what stands on what counts. generator: source of all noise.

    Returns the loss, and the parts that the log names.
    """
    drawn = drawn_boxes(model, batch, generator)
    free = torch.zeros(len(drawn), dtype=torch.bool, device=drawn.yaw.device)
    with drawn.yaw.device:  # where the plan makes its numbers
        plan = plan_of_batch(batch, drawn, free)
        vars(plan)["carrier"] = carrier_of(batch)
        plan = plan.at(torch.stack([plan.position[:, 0], heights(plan), plan.position[:, 2]], 1), plan.yaw)
        terms = missed_terms(plan)
        boxes, level = Boxes(plan.size, plan.position, plan.yaw), torch.zeros_like(plan.yaw)
        physics = physics_loss(batch, boxes, level, free, asked=ASKED)
        relations = relation_hinge(batch, boxes, level, free, model.config.rules)
    parts = {"drawn_terms": terms, "drawn_physics": physics, "drawn_relations": relations}
    return terms + PHYSICS * physics + RELATIONS * relations, parts


def missed_terms(plan: Plan) -> Tensor:
    """By how much living rules and composition are missed, a box."""
    total = plan.yaw.new_zeros(())
    for term in TERMS:
        if term.kind in BY_EYE and term.name not in OTHERWISE:
            total = total + deep(term.find(plan).margin - ASKED).sum()
    return total / len(plan)


def carrier_of(batch: LayoutBatch) -> Tensor:
    """(N,) int64, what each box stands on, as in the true room: `Plan.carrier`."""
    words = {"floor": ON_FLOOR, "table": ON_FLOOR, "ceiling": ON_CEILING}
    own = [words.get(row.support, FREE) for row in vocabulary().categories]
    out = torch.tensor(own, device=batch.graph.category.device)[batch.graph.category]
    i, j, low = batch.pairs.receiver, batch.pairs.sender, batch.boxes.position[:, 1]
    on = torch.isinf(batch.allowed) & (low[i] > low[j])
    out[i[on]] = j[on]
    return out


def drawn_boxes(model: CompactModel, batch: LayoutBatch, generator: torch.Generator) -> Boxes:
    """Boxes (N) as the network's own sampler ends with them; its last `KEPT` steps keep the gradient."""
    layout = model.config.layout
    with torch.no_grad():
        latent = model.latent(batch.graph.category, batch.pairs)
    predict = layout_predictor(model, batch.graph, batch.pairs, latent, batch.rules)
    steps = int(torch.randint(STEPS[0], STEPS[1] + 1, (), generator=generator))

    def late(x: Tensor, level: Tensor) -> Tensor:
        x = torch.cat([x[:, :3].detach(), x[:, 3:]], 1)  # or furniture would shrink between two steps
        with torch.set_grad_enabled(float(level[0]) * steps < KEPT + 0.5):
            return steadied(predict(x, level))

    noise = normal((batch.graph.num_nodes, 8), generator, batch.graph.category.device)
    x = sample(layout.sampler, late, noise, steps, layout.objective, generator=generator)
    return Boxes.decode(x, box_scale(model, batch.graph.category))


def steadied(x: Tensor) -> Tensor:
    """The same boxes (N, 8), back through which no slope of a box goes that is longer than `LONGEST`."""
    if x.requires_grad:
        x.register_hook(_shortened)
    return x


def _shortened(slope: Tensor) -> Tensor:
    slope = slope.nan_to_num(0.0, 0.0, 0.0)  # of two middles at one place, say
    most = LONGEST / len(slope)  # of a mean over all
    return slope * (most / slope.norm(dim=1, keepdim=True).clamp_min(1e-12)).clamp_max(1)
