"""The layout stage: rooms in batches, the losses of true rooms and of draws, and what held-out rooms say.

What is wrong with rooms that the network draws itself is led back through the last steps of sampling. This is DRaFT-K
(Clark et al. 2024) with the terms of the objective as the reward, weighed alike, not by what they cost a search: a
person who looks at a draw counts what is wrong in it.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import ClassVar

import numpy as np
import torch
from torch import Tensor
from torch.utils.data import DataLoader, IterableDataset, get_worker_info

from echomodel.arrays import Array
from echomodel.boxes import Boxes, BoxStatistics
from echomodel.compact.layout import measured, temperatures
from echomodel.compact.learned import places
from echomodel.compact.model import CompactModel
from echomodel.compact.sampling import box_scale, layout_predictor
from echomodel.objective import BY_EYE, TERMS, Plan, faults_of
from echomodel.objective.support import FREE, ON_CEILING, ON_FLOOR, stacked
from echomodel.randomness import normal
from echomodel.rules import verdicts
from echomodel.samplers import sample
from echomodel.sizes import Z95
from echomodel.training.layout_losses import (
    deep,
    layout_loss,
    physics_loss,
    plan_of_batch,
    relation_hinge,
    stated_triplets,
)
from echomodel.training.recipe import Recipe
from echomodel.training.rooms import LayoutBatch, PackedRooms, draw_batch, make_batch
from echomodel.training.start import Start
from echomodel.vocabulary import vocabulary


class LayoutStage:
    """What the trainer needs to know about layouts.

    Arguments:
        rooms, held: packed rooms to train on and to validate with. recipe: budgets, weights and parts that stay.
    """

    saved = ("latent", "layout")
    parts: ClassVar[tuple[str, ...]] = saved
    needs: ClassVar[tuple[str, ...]] = ()

    def __init__(self, rooms: PackedRooms, held: PackedRooms, recipe: Recipe) -> None:
        self.rooms, self.held, self.recipe = rooms, held, recipe
        self._ahead: Iterator[LayoutBatch] | None = None
        self.trained = tuple(part for part in self.saved if part not in recipe.frozen)

    @classmethod
    def open(cls, start: Start) -> "LayoutStage":
        """The stage of a recipe; new layouts are normalised by its rooms, new categories by those of them."""
        rooms, held = (start.rooms(held=held) for held in (False, True))
        names, known = start.model.config.categories, start.model.statistics
        old = start.known_categories if "layout" in start.loaded else 0
        if old < len(names):
            rows = places("categories", names, rooms.category)
            own = statistics_of(rooms.boxes, rows, len(names))
            start.model.statistics = own if not old else replace(known, classes=known.classes[:old] + own.classes[old:])
        if start.recipe.compiled:
            start.model.layout.measure = torch.compile(measured, dynamic=True)
        return cls(rooms, held, start.recipe)

    def loss(self, model: CompactModel, generator: torch.Generator) -> tuple[Tensor, dict[str, Tensor]]:
        """Loss of one random batch, whose graph passes encoder and manipulator, and of draws, and their parts."""
        batch, recipe = self._drawn(generator).to(model.device), self.recipe
        # by the inverse strategy: pseudo graph into the encoder, true graph out of the manipulator
        edit = {"before": batch.before, "added": batch.added, "touched": batch.touched}
        latent = model.latent(batch.graph.category, batch.pairs, **edit)
        loss, parts = layout_loss(model, batch, latent, generator, recipe)
        if recipe.drawn_weight:
            drawn, of_draws = drawn_loss(model, batch, generator)
            loss, parts = loss + recipe.drawn_weight * drawn, parts | of_draws
        return loss, parts

    def _drawn(self, generator: torch.Generator) -> LayoutBatch:
        """A batch drawn here, or by `workers` processes ahead of the step: then a resumed run draws other batches."""
        nodes, workers = self.recipe.nodes, self.recipe.workers
        if not workers:
            return draw_batch(self.rooms, nodes, generator)
        if self._ahead is None:
            source = _Batches(self.rooms, nodes, generator.initial_seed())
            self._ahead = iter(DataLoader(source, batch_size=None, num_workers=workers, prefetch_factor=4))
        return next(self._ahead)

    @torch.no_grad()
    def validate(self, model: CompactModel, rooms: int = 96) -> dict[str, float]:
        """Held-out losses, share of kept relations per predicate, what a person would point at (openings left out);
        by rule set, half of the relations told, seeded."""
        generator = torch.Generator().manual_seed(0)
        out: dict[str, float] = {}
        for number, name in enumerate(model.config.rules):
            picked = (self.held.rules == number).nonzero()[:rooms, 0]
            if not len(picked):
                continue
            batch = make_batch(self.held, picked, generator, train=False).to(model.device)
            latent = model.latent(batch.graph.category, batch.pairs)
            _, parts = layout_loss(model, batch, latent, torch.Generator().manual_seed(1), self.recipe)
            out |= {f"{name}/held_{part}": float(value) for part, value in parts.items()}
            boxes = sampled_boxes(model, batch, generator, model.config.layout.steps)
            cpu, made = batch.to("cpu"), boxes.to("cpu")
            found = faults_of(plan_of_batch(cpu, made, torch.zeros(len(made), dtype=torch.bool)))
            out[f"{name}/faults"] = len(found) / len(made)
            wrong = {int(cpu.graph.scene[fault.object]) for fault in found}
            out[f"{name}/rooms_without"] = 1 - len(wrong) / cpu.graph.num_scenes
            triplets = stated_triplets(batch)
            kept = verdicts(boxes, triplets, rules=name)
            for entry in vocabulary().predicates:
                mine = kept[(triplets[:, 1] == entry.id) & (kept >= 0)]
                if len(mine):
                    out[f"{name}/{entry.name}"] = float(mine.float().mean())
            out[f"{name}/all"] = float(kept[kept >= 0].float().mean())
            truth = batch.boxes.size.log()
            out[f"{name}/log_size_error"] = float((boxes.size.clamp_min(1e-2).log() - truth).abs().mean())
        return out


class _Batches(IterableDataset):
    """Batches without end, other ones in every worker."""

    def __init__(self, rooms: PackedRooms, nodes: int, seed: int) -> None:
        self.rooms, self.nodes, self.seed = rooms, nodes, seed

    def __iter__(self) -> Iterator[LayoutBatch]:
        torch.set_num_threads(1)
        worker = get_worker_info()
        generator = torch.Generator().manual_seed((self.seed + (0 if worker is None else worker.id)) % 2**63)
        while True:
            yield draw_batch(self.rooms, self.nodes, generator)


STEPS, KEPT = (5, 10), 2  # of a draw at least and at most, and its last steps, which the gradient goes through
LONGEST = 200.0  # slope of one box at a step: one that turns at a hair's breadth would drown all others
ASKED = 0.02  # metres, radians or a share beyond a term's margin
PHYSICS = 3.0  # weight of what runs into something
RELATIONS = 30.0  # weight of a metre by which something told is missed, as steep as a term is
# Sizes are learnt as they are, openings are looked at with walls, what is bare is looked at room by room.
OTHERWISE = (
    "scale", "door_free", "leaf_aside", "window_free", "floor_used", "corners_used", "floor_served", "floor_filled",
    "ends_used", "hung_over",
)  # fmt: skip


def drawn_loss(model: CompactModel, batch: LayoutBatch, generator: torch.Generator) -> tuple[Tensor, dict[str, Tensor]]:
    """The mean over the boxes of all that terms, walls, openings and relations miss in rooms drawn from noise.

    Arguments:
        batch: graphs and floors; of its true boxes only what stands on what counts. generator: source of all noise.

    Returns the loss, and the parts that the log names.
    """
    steps = int(torch.randint(STEPS[0], STEPS[1] + 1, (), generator=generator))
    drawn = sampled_boxes(model, batch, generator, steps)
    free = torch.zeros(len(drawn), dtype=torch.bool, device=drawn.yaw.device)
    with drawn.yaw.device:  # where the plan makes its numbers
        plan = plan_of_batch(batch, drawn, free)
        vars(plan)["carrier"] = carrier_of(batch)
        plan = plan.at(stacked(plan.size, plan.position, plan.carrier, plan.ceiling), plan.yaw)
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


def sampled_boxes(model: CompactModel, batch: LayoutBatch, generator: torch.Generator, steps: int) -> Boxes:
    """Boxes (N) as the config's sampler ends with them after so many steps, of which the last `KEPT` keep the gradient
    where there is one."""
    layout, slopes = model.config.layout, torch.is_grad_enabled()
    with torch.no_grad():
        latent = model.latent(batch.graph.category, batch.pairs)
    predict = layout_predictor(model, batch.graph, batch.pairs, latent, batch.rules)

    def late(x: Tensor, level: Tensor) -> Tensor:
        x = torch.cat([x[:, :3].detach(), x[:, 3:]], 1)  # or furniture would shrink between two steps
        with torch.set_grad_enabled(slopes and float(level[0]) * steps < KEPT + 0.5):
            return steadied(predict(x, level))

    noise = normal((batch.graph.num_nodes, 8), generator, model.device)
    x = sample(
        layout.sampler, late, noise, steps, layout.objective, generator=generator,
        temperature=temperatures(layout, noise),
    )  # fmt: skip
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


FEWEST = 50  # boxes that the statistics of a class need
NARROWEST = 0.02  # log metres: sizes that hardly vary would turn noise into huge numbers


def statistics_of(boxes: Boxes, category: Array, categories: int) -> BoxStatistics:
    """Spreads of log size per class and of position; x and z share theirs (rooms turn).

    Arguments:
        boxes: N boxes. category: (N,) int64, their classes. categories: number of classes; one with fewer than
            `FEWEST` boxes gets the spread of all.
    """
    boxes, category = boxes.to(None), np.asarray(category)
    size, position = np.log(np.maximum(boxes.size.astype(float), 1e-3)), boxes.position.astype(float)
    mean, std = size.mean(0), size.std(0, ddof=1)
    centre = np.array([0.0, position[:, 1].mean(), 0.0])
    plane = np.sqrt(np.square(position[:, ::2]).mean())
    spread = np.array([plane, position[:, 1].std(ddof=1), plane])
    numbers = [(mean - std), (mean + std), (centre - spread), (centre + spread)]
    low, high, start, stop = (tuple(round(float(v), 5) for v in values) for values in numbers)
    rows = []
    for number in range(categories):
        own = size[category == number]
        few, middle, many = np.quantile(own if len(own) >= FEWEST else size, [0.05, 0.5, 0.95], axis=0)
        steps = np.maximum(np.concatenate([middle - few, many - middle]) / Z95, NARROWEST)
        rows.append(tuple(round(float(v), 4) for v in (*middle, *steps)))
    return BoxStatistics(low, high, start, stop, log_size=True, classes=tuple(rows))
