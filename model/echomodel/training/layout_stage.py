"""The layout stage: rooms in batches, the losses of true rooms and of draws, and what held-out rooms say."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import torch
from torch import Tensor
from torch.utils.data import DataLoader, IterableDataset, get_worker_info

from echomodel.boxes import Boxes, BoxStatistics
from echomodel.compact.learned import places
from echomodel.compact.model import CompactModel
from echomodel.compact.sampling import box_scale, layout_predictor
from echomodel.objective import faults_of
from echomodel.randomness import normal
from echomodel.rules import verdicts
from echomodel.samplers import sample
from echomodel.training.draws import drawn_loss
from echomodel.training.layout_losses import edited_latent, layout_loss, plan_of_batch, told_triplets
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
    def open(cls, start: Start) -> LayoutStage:
        """The stage of a recipe; new layouts are normalised by its rooms."""
        rooms, held = (start.rooms(held=held) for held in (False, True))
        if "layout" not in start.given:
            names = start.model.config.categories
            rows = places("categories", names, rooms.category)
            start.model.statistics = BoxStatistics.from_boxes(rooms.boxes, rows, len(names))
        return cls(rooms, held, start.recipe)

    def loss(self, model: CompactModel, generator: torch.Generator) -> tuple[Tensor, dict[str, Tensor]]:
        """Loss of one random batch, whose graph passes encoder and manipulator, and of draws, and their parts."""
        batch, recipe = self._drawn(generator).to(model.device), self.recipe
        loss, parts = layout_loss(model, batch, edited_latent(model, batch), generator, recipe)
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
            boxes = sample_boxes(model, batch, generator)
            cpu, made = batch.to("cpu"), boxes.to("cpu")
            found = faults_of(plan_of_batch(cpu, made, torch.zeros(len(made), dtype=torch.bool)))
            out[f"{name}/faults"] = len(found) / len(made)
            wrong = {int(cpu.graph.scene[fault.object]) for fault in found}
            out[f"{name}/rooms_without"] = 1 - len(wrong) / cpu.graph.num_scenes
            triplets = told_triplets(batch)
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


def sample_boxes(model: CompactModel, batch: LayoutBatch, generator: torch.Generator) -> Boxes:
    """Sample all boxes of a batch with the config's sampler and steps."""
    layout = model.config.layout
    latent = model.latent(batch.graph.category, batch.pairs)
    predict = layout_predictor(model, batch.graph, batch.pairs, latent, batch.rules)
    noise = normal((batch.graph.num_nodes, 8), generator, model.device)
    vectors = sample(layout.sampler, predict, noise, layout.steps, layout.objective, generator=generator)
    return Boxes.decode(vectors, box_scale(model, batch.graph.category))
