"""Losses of the layout branch: denoising boxes (EchoScene 3.3), and on the boxes that it predicts.

Those are a hinge on the relations told, what true boxes measure, collisions and walls.
"""

from collections.abc import Callable

import torch
from torch import Tensor

from echomodel.arrays import Array, at_least
from echomodel.boxes import Boxes
from echomodel.compact.layout import FARTHEST, measurable, measured
from echomodel.compact.model import CompactModel
from echomodel.compact.sampling import box_scale
from echomodel.config import Objective
from echomodel.floors import footprint, signed_distance
from echomodel.objective import Plan
from echomodel.objective.physics import apart
from echomodel.objective.plan import UNKNOWN
from echomodel.randomness import normal
from echomodel.rules import margins
from echomodel.samplers import alpha_sigma, clean_from, expand
from echomodel.surroundings import AWAY, opening_gaps
from echomodel.training.recipe import Recipe
from echomodel.training.rooms import LayoutBatch, draw_levels
from echomodel.vocabulary import vocabulary

STATED_SLACK = 0.02  # the hinge asks for this much more than the rule does (metres or ratio)


def relation_hinge(batch: LayoutBatch, decoded: Boxes, level: Tensor, known: Tensor, rules: tuple[str, ...]) -> Tensor:
    """Mean over told relations of how far the predicted boxes miss them, weighted by (1 - level)^2."""
    # ratios to a height near or below zero would explode or change their sign
    lifted = torch.cat([decoded.position[:, :1], decoded.position[:, 1:2].clamp_min(0), decoded.position[:, 2:]], dim=1)
    boxes = Boxes(decoded.size.clamp(0.05, 8.0), lifted, decoded.yaw)
    triplets = stated_triplets(batch)
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
        total = total + (torch.log1p((STATED_SLACK - margin).clamp_min(0)) * weight).sum()
        weights = weights + weight.sum()
    return total / weights.clamp_min(1)


def stated_triplets(batch: LayoutBatch) -> Tensor:
    """(E, 3) int64, [subject, predicate id, object], the relations that the graphs tell."""
    pair, predicate = batch.predicates.nonzero(as_tuple=True)
    return torch.stack([batch.pairs.receiver[pair], predicate, batch.pairs.sender[pair]], dim=1)


TOUCHING = 0.01  # metres that a box may reach into a wall
FIRM = 10.0  # a miss counts as log(1 + FIRM * metres)


def physics_loss(batch: LayoutBatch, boxes: Boxes, level: Tensor, known: Tensor, *, asked: float = 0.0) -> Tensor:
    """Mean over the free boxes of how far they run into others, through walls and into the way of doors and windows,
    weighted by (1 - level)^2.

    Arguments:
        boxes: N predicted boxes; places and headings alone are pulled at. level: (N,). known: (N,) bool.
        asked: metres by which boxes keep clear of one another and of openings, beyond what is allowed.
    """
    graph, pairs = batch.graph, batch.pairs
    free = measurable(Boxes(boxes.size.detach(), boxes.position, boxes.yaw))
    none = torch.zeros(0, 3, dtype=torch.int64, device=level.device)
    words, openings = (UNKNOWN,) * len(boxes), ((),) * graph.num_scenes
    plan = Plan(words, free.size, free.position, free.yaw, graph.scene, graph.floor, openings, none, known)
    once = ((pairs.receiver < pairs.sender) & torch.isfinite(batch.allowed)).nonzero()[:, 0]
    i, j = pairs.receiver[once], pairs.sender[once]
    vars(plan)["couples"] = i, j, batch.allowed[once]  # whom each may touch is not the network's to choose
    sure = (1 - level).square()
    weight = torch.minimum(sure[i], sure[j]) * ~(known[i] & known[j])
    over = (outside(free, graph.floor[graph.scene]).square().sum(1) + 1e-12).sqrt()
    stands = torch.tensor([row.support == "floor" for row in vocabulary().categories], device=level.device)
    clear = kept_free(free, graph.openings[graph.scene]).clamp_min(-FARTHEST) - asked
    walls = deep(TOUCHING - over) + deep(clear) * stands[graph.category]
    total = (deep(apart(plan).margin - asked) * weight).sum() + (walls * sure * ~known).sum()
    return total / (sure * ~known).sum().clamp_min(1)


def outside(boxes: Boxes, floor: Tensor) -> Tensor:
    """How far the corners and the middles of the sides lie beyond the walls: (N, 8) metres, 0 where unknown.

    Arguments:
        boxes: N boxes; none is asked to shrink. floor: (N, K, 2) float32, corners of the floor under each.
    """
    return (-signed_distance(footprint(boxes.size.detach(), boxes.position, boxes.yaw), floor)).clamp_min(0)


def kept_free(boxes: Boxes, rows: Tensor) -> Tensor:
    """How far each box keeps out of the way of the openings of its room: the least of all, metres.

    Arguments:
        boxes: N boxes that stand on the floor. rows: (N, O, ROW), openings of the room of each, NaN = none.

    Returns (N,) float32, negative in the way of a door or passage, or before a window and higher than its sill; `AWAY`
    where there is no opening.
    """
    there, window, beside, before, under = opening_gaps(boxes, rows)
    clear = torch.maximum(beside, before)
    clear = clear.where(~window, torch.maximum(clear, under)).where(there, clear.new_full((), AWAY))
    return torch.cat([clear, clear.new_full((len(boxes), 1), AWAY)], 1).amin(1)


def plan_of_batch(batch: LayoutBatch, boxes: Boxes, known: Tensor) -> Plan:
    """What the living rules look at, for all rooms of a batch at once; sizes are not pulled at."""
    graph, kinds = batch.graph, vocabulary().categories
    free = measurable(Boxes(boxes.size.detach(), boxes.position, boxes.yaw))
    return Plan(
        tuple(kinds[number] for number in graph.category.tolist()),
        free.size, free.position, free.yaw, graph.scene, graph.floor, ((),) * graph.num_scenes,
        stated_triplets(batch), known,
    )  # fmt: skip


def deep(margin: Tensor) -> Tensor:
    """By how much margins are missed, as the loss counts it: logarithmic, so that none pulls without bounds."""
    return torch.log1p(FIRM * (-margin).clamp_min(0))


DRAFT = 0.3  # weight of each draft's own denoising loss
Measure = Callable[..., tuple[Tensor, Tensor, Tensor]]  # as `compact.layout.measured`
OPENINGS = 0.5  # weight of the clearances of doors and windows beside the gaps to the walls


def layout_loss(
    model: CompactModel, batch: LayoutBatch, latent: Tensor, generator: torch.Generator, recipe: Recipe
) -> tuple[Tensor, dict[str, Tensor]]:
    """Denoising loss of the unknown nodes, of the drafts too, plus the weighted relation hinge and measure distance.

    Arguments:
        model: with latent graph and layout denoiser. batch: true rooms. latent: (N, latent width), the edited graph's.
        generator: source of levels, noise and of what is known.
        recipe: its weights; 0 leaves the hinge, the distance, or collisions and walls out.

    Returns the loss, and the parts that the log names.
    """
    objective = model.config.layout.objective
    scale = box_scale(model, batch.graph.category)
    clean = batch.boxes.encode(scale)
    known = draw_known(batch.graph.scene, batch.graph.num_scenes, generator)
    level = draw_levels(batch.graph.num_scenes, generator, clean.device)[batch.graph.scene] * ~known
    noise = normal(clean.shape, generator, clean.device)
    noisy = torch.where(known[:, None], clean, add_noise(clean, noise, level, objective))
    context = model.layout.context(batch.graph, batch.pairs, latent, batch.rules, scale)
    outputs = model.layout.drafts(noisy, level, context)
    free, wanted = (~known).float(), target(clean, noise, level, objective)
    errors = [((guess - wanted).square().mean(1) * free).sum() / free.sum().clamp_min(1) for guess in outputs]
    output, parts = outputs[-1], {"denoising": errors[-1]}
    if len(errors) > 1:
        parts["draft"] = errors[0]
    loss = errors[-1] + DRAFT * sum(errors[:-1], noise.new_zeros(()))
    drawn = Boxes.decode(clean_from(output, noisy, level, objective), scale).replaced(known, batch.boxes)
    predicted = as_carried(batch, drawn)
    if recipe.relation_weight:
        parts["relations"] = relation_hinge(batch, predicted, level, known, model.config.rules)
        loss = loss + recipe.relation_weight * parts["relations"]
    if recipe.measure_weight:
        parts["measures"] = measure_distance(batch, predicted, context.floor, level, free, model.layout.measure)
        loss = loss + recipe.measure_weight * parts["measures"]
    if recipe.physics_weight:
        parts["physics"] = physics_loss(batch, predicted, level, known)
        loss = loss + recipe.physics_weight * parts["physics"]
    return loss, parts


def as_carried(batch: LayoutBatch, boxes: Boxes) -> Boxes:
    """Boxes (N) at the heights that floor, ceiling or what carries them gives, as they get them once they are drawn
    (`guidance.heights`): no loss lifts one over what it runs into. What hangs on a wall keeps its own."""
    hangs = torch.tensor([row.support == "wall" for row in vocabulary().categories], device=boxes.yaw.device)
    height = torch.where(hangs[batch.graph.category], boxes.position[:, 1], batch.boxes.position[:, 1])
    return Boxes(boxes.size, torch.stack([boxes.position[:, 0], height, boxes.position[:, 2]], 1), boxes.yaw)


def measure_distance(
    batch: LayoutBatch, boxes: Boxes, floor: Tensor, level: Tensor, free: Tensor, measure: Measure = measured
) -> Tensor:
    """Mean difference of what predicted and true boxes measure (`compact.layout`), weighted by (1 - level)^2.

    It asks for a back at the wall and a chair at the table to the centimetre, where the square of a normalised position
    would be content with a hand's breadth. It pulls at places and headings alone: sizes would shrink to their median.

    Arguments:
        boxes: N predicted boxes. floor: (N, K, 2). level: (N,). free: (N,) float, 0 for known boxes.
        measure: how it is measured.
    """
    pairs = batch.pairs
    weight = (1 - level).square()
    own = weight * free
    boxes, truth = measurable(Boxes(boxes.size.detach(), boxes.position, boxes.yaw)), measurable(batch.boxes)
    openings = batch.graph.openings[batch.graph.scene]
    found, true = (measure(these, floor, openings, pairs) for these in (boxes, truth))
    walls, clear, between = ((one - other).abs().mean(1) for one, other in zip(found, true, strict=True))
    walls = walls + OPENINGS * clear
    both = torch.minimum(weight[pairs.receiver], weight[pairs.sender]) * free[pairs.receiver]
    return (walls * own).sum() / own.sum().clamp_min(1) + (between * both).sum() / both.sum().clamp_min(1)


def draw_known(scene: Tensor, scenes: int, generator: torch.Generator) -> Tensor:
    """(N,) bool: in half of the scenes nothing is known, in the others a random share of the nodes."""
    some = torch.rand(scenes, generator=generator) < 0.5
    share = (torch.rand(scenes, generator=generator) * some).to(scene.device)
    return torch.rand(len(scene), generator=generator).to(scene.device) < share[scene]


def add_noise(clean: Array, noise: Array, level: Array, objective: Objective) -> Array:
    """Noisy samples at a level per node: clean, noise (N, ...), level (N,) -> (N, ...)."""
    alpha, sigma = alpha_sigma(expand(level, clean), objective)
    return alpha * clean + sigma * noise


def target(clean: Array, noise: Array, level: Array, objective: Objective) -> Array:
    """The training target: the noise (DDPM), alpha noise - sigma clean (v), or noise - clean (rectified flow)."""
    if objective == "noise":
        return noise
    if objective == "flow":
        return noise - clean
    alpha, sigma = alpha_sigma(expand(level, clean), objective)
    return alpha * noise - sigma * clean


def output_from(clean: Array, noisy: Array, level: Array, objective: Objective, floor: float = 0.05) -> Array:
    """The prediction that a clean sample stands for; levels below `floor` are treated as `floor` (1 / sigma grows)."""
    level = at_least(level, floor)
    if objective == "flow":
        return (noisy - clean) / expand(level, noisy)
    alpha, sigma = alpha_sigma(expand(level, noisy), objective)
    noise = (noisy - alpha * clean) / sigma
    return noise if objective == "noise" else alpha * noise - sigma * clean
