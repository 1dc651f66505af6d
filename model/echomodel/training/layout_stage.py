"""The layout stage: denoising boxes, with a hinge on the relations of the boxes it predicts (EchoScene 3.3)."""

from __future__ import annotations

import torch
from torch import Tensor

from echomodel.boxes import Boxes, BoxStatistics
from echomodel.compact.model import CompactModel
from echomodel.compact.predictors import layout_predictor
from echomodel.objectives import add_noise, clean_from, draw_levels, target
from echomodel.rules import margins, verdicts
from echomodel.samplers import sample
from echomodel.training.rooms import LayoutBatch, PackedRooms, draw_batch, make_batch
from echomodel.vocabulary import vocabulary

EMPHASIS = {5: 4.0, 6: 2.0, 7: 4.0, 12: 8.0}  # rare relations that must hit a small region: close by, above, on, mirror
SLACK = 0.02  # the hinge asks for this much more than the rule does (metres or ratio)


def edited_latent(model: CompactModel, batch: LayoutBatch) -> Tensor:
    """The latent graph by the inverse strategy: pseudo graph into the encoder, true graph out of the manipulator."""
    edit = {"before": batch.before, "added": batch.added, "touched": batch.touched}
    return model.latent(batch.graph.category, batch.pairs, **edit)


def layout_loss(
    model: CompactModel, batch: LayoutBatch, latent: Tensor, generator: torch.Generator, relation_weight: float
) -> tuple[Tensor, dict[str, Tensor]]:
    """Denoising loss of the unknown nodes plus the weighted relation hinge, and both apart."""
    objective = model.config.layout.objective
    clean = batch.boxes.encode(model.statistics)
    known = draw_known(batch.graph.scene, batch.graph.num_scenes, generator)
    level = draw_levels(batch.graph.num_scenes, generator)[batch.graph.scene] * ~known
    noise = torch.randn(clean.shape, generator=generator)
    noisy = torch.where(known[:, None], clean, add_noise(clean, noise, level, objective))
    context = model.layout.context(batch.graph, batch.pairs, latent, batch.rules)
    output = model.layout(noisy, level, context)
    free = (~known).float()
    error = (output - target(clean, noise, level, objective)).square().mean(1)
    denoising = (error * free).sum() / free.sum().clamp_min(1)
    parts = {"denoising": denoising}
    loss = denoising
    if relation_weight:
        predicted = clean_from(output, noisy, level, objective)
        predicted = torch.where(known[:, None], clean, predicted)
        parts["relations"] = relation_hinge(batch, predicted, level, known, model.statistics, model.config.rules)
        loss = loss + relation_weight * parts["relations"]
    return loss, parts


def relation_hinge(
    batch: LayoutBatch, vectors: Tensor, level: Tensor, known: Tensor, statistics: BoxStatistics, rules: tuple[str, ...]
) -> Tensor:
    """Mean over told relations of how far the predicted boxes miss them, weighted by (1 - level)^2."""
    decoded = Boxes.decode(vectors, statistics)
    # ratios to a height near or below zero would explode or change their sign
    lifted = torch.cat([decoded.position[:, :1], decoded.position[:, 1:2].clamp_min(0), decoded.position[:, 2:]], dim=1)
    boxes = Boxes(decoded.size.clamp(0.05, 8.0), lifted, decoded.yaw)
    pair, predicate = batch.predicates.nonzero(as_tuple=True)
    measurable = ((predicate >= 1) & (predicate <= 12)).nonzero()[:, 0]
    pair, predicate = pair[measurable], predicate[measurable]
    triplets = torch.stack([batch.pairs.receiver[pair], predicate, batch.pairs.sender[pair]], dim=1)
    total, weights = vectors.new_zeros(()), vectors.new_zeros(())
    emphasis = vectors.new_tensor([EMPHASIS.get(number, 1.0) for number in range(batch.predicates.shape[1])])
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


def draw_known(scene: Tensor, scenes: int, generator: torch.Generator) -> Tensor:
    """(N,) bool: in half of the scenes nothing is known, in the others a random share of the nodes."""
    some = torch.rand(scenes, generator=generator) < 0.5
    share = torch.rand(scenes, generator=generator) * some
    return torch.rand(len(scene), generator=generator) < share[scene]


class LayoutStage:
    """What the trainer needs to know about layouts.

    Arguments:
        rooms, held: packed rooms to train on and to validate with.
        nodes: node budget of a batch.
        relation_weight: weight of the relation hinge.
        frozen: parts that stay as they are.
    """

    saved = ("latent", "layout")

    def __init__(
        self,
        rooms: PackedRooms,
        held: PackedRooms,
        nodes: int,
        relation_weight: float,
        frozen: tuple[str, ...] = (),
    ) -> None:
        self.rooms, self.held, self.nodes, self.relation_weight = rooms, held, nodes, relation_weight
        self.trained = tuple(part for part in ("latent", "layout") if part not in frozen)

    def loss(self, model: CompactModel, generator: torch.Generator) -> tuple[Tensor, dict[str, Tensor]]:
        """Loss of one random batch."""
        batch = draw_batch(self.rooms, self.nodes, generator)
        return layout_loss(model, batch, edited_latent(model, batch), generator, self.relation_weight)

    @torch.no_grad()
    def validate(self, model: CompactModel, rooms: int = 96) -> dict[str, float]:
        """Share of kept relations per predicate and rule set on held-out rooms, half of the relations told, seeded."""
        generator = torch.Generator().manual_seed(0)
        out: dict[str, float] = {}
        for number, name in enumerate(model.config.rules):
            picked = (self.held.rules == number).nonzero()[:rooms, 0]
            if not len(picked):
                continue
            batch = make_batch(self.held, picked, generator, train=False)
            boxes = sample_boxes(model, batch, generator)
            pair, predicate = batch.predicates.nonzero(as_tuple=True)
            triplets = torch.stack([batch.pairs.receiver[pair], predicate, batch.pairs.sender[pair]], dim=1)
            kept = verdicts(boxes, triplets, rules=name)
            for entry in vocabulary().predicates:
                mine = kept[(predicate == entry.id) & (kept >= 0)]
                if len(mine):
                    out[f"{name}/{entry.name}"] = float(mine.float().mean())
            out[f"{name}/all"] = float(kept[kept >= 0].float().mean())
            truth = batch.boxes.size.log()
            out[f"{name}/log_size_error"] = float((boxes.size.clamp_min(1e-2).log() - truth).abs().mean())
        return out


def sample_boxes(model: CompactModel, batch: LayoutBatch, generator: torch.Generator) -> Boxes:
    """Sample all boxes of a batch with the config's sampler and steps."""
    layout = model.config.layout
    latent = model.latent(batch.graph.category, batch.pairs)
    predict = layout_predictor(model, batch.graph, batch.pairs, latent, batch.rules)
    noise = torch.randn(batch.graph.num_nodes, 8, generator=generator)
    vectors = sample(layout.sampler, predict, noise, layout.steps, layout.objective, generator=generator)
    return Boxes.decode(vectors, model.statistics)
