"""The parts stage: denoising descriptions of all furniture of a scene, joined by their echoes (EchoScene 3.4)."""

from typing import ClassVar

import numpy as np
import torch
from torch import Tensor

from echomodel.compact.model import CompactModel
from echomodel.compact.pairs import Pairs
from echomodel.furniture.drawn import draw_styles, sample_size
from echomodel.furniture.style import OPEN
from echomodel.graph import GraphBatch
from echomodel.training.rooms import PackedRooms, draw_batch
from echomodel.training.shape_stage import ShapeBatch, draw_suites, noised
from echomodel.training.start import Start
from echomodel.vocabulary import vocabulary

STYLES, HELD, SEED = 20_000, 500, 1  # styles to learn from and to validate with; they are a third of a kilobyte each
SUITES = 4  # objects in a suite
SILENT = 0.3  # share of the scenes whose graph says nothing of styles
LOWEST = 0.15  # level below which the weight of an error stops growing
NUMBERS = 4.0  # weight of the numbers against the words


def parts_loss(
    model: CompactModel, batch: ShapeBatch, clean: Tensor, size: Tensor, generator: torch.Generator
) -> tuple[Tensor, dict[str, Tensor]]:
    """Denoising loss of the unknown objects' descriptions: cross entropy of the words, squares of the numbers.

    Arguments:
        batch: scenes; `shape` numbers equal pieces. clean: (N, D) float32 descriptions. size: (N, 3) float32, metres.
    """
    settings = model.config.furniture
    known, level, noisy = noised(batch, clean, settings.objective, generator)
    with torch.no_grad():
        latent = model.latent(batch.graph.category, batch.pairs)
    context = model.furniture.context(batch.graph, size, batch.pairs, latent)
    scores = model.furniture.scores(noisy, level, context).float()
    hot = sum(settings.kinds)
    parts, words = scores.split([*settings.kinds, settings.numbers], dim=1), clean[:, :hot].split(settings.kinds, dim=1)
    surprise = [
        torch.nn.functional.cross_entropy(logits, true.argmax(1), reduction="none")
        for logits, true in zip(parts[:-1], words, strict=True)
    ]
    off = (parts[-1] - clean[:, hot:]).square().mean(1)
    free = (~known).float()
    weight = free / level.clamp_min(LOWEST)
    kinds = (torch.stack(surprise).mean(0) * weight).sum() / free.sum().clamp_min(1)
    numbers = (off * weight).sum() / free.sum().clamp_min(1)
    return kinds + NUMBERS * numbers, {"kinds": kinds, "numbers": numbers}


class PartsStage:
    """What the trainer needs to know about descriptions of furniture.

    Arguments:
        rooms: packed rooms; their style groups get styles drawn anew for every batch.
        nodes: node budget of a batch.
    """

    trained = saved = ("furniture",)
    parts: ClassVar[tuple[str, ...]] = ("latent", "furniture")
    needs: ClassVar[tuple[str, ...]] = ("latent",)

    def __init__(self, rooms: PackedRooms, nodes: int) -> None:
        self.rooms, self.nodes = rooms, nodes
        rng = np.random.default_rng(SEED)
        styles = torch.from_numpy(draw_styles(STYLES + HELD, rng))
        self.styles, self.held = styles[:STYLES], styles[STYLES:]
        words = [category.name for category in vocabulary().categories]
        self.sizes = torch.tensor(np.array([[sample_size(w, rng) for _ in range(200)] for w in words])).float()

    @classmethod
    def open(cls, start: Start) -> "PartsStage":
        """The stage of a recipe."""
        return cls(start.rooms(held=False), start.recipe.nodes)

    def draw(self, generator: torch.Generator) -> tuple[ShapeBatch, Tensor]:
        """Rooms on even draws, suites on odd ones, with the size (N, 3) of every object."""
        if float(torch.rand(1, generator=generator)) < 0.4:
            return self.suites(self.nodes // SUITES, generator)
        drawn = draw_batch(self.rooms, self.nodes, generator)
        scenes, categories = drawn.graph.num_scenes, len(self.sizes)
        silent = torch.rand(scenes, generator=generator) < SILENT
        stated = silenced(drawn.pairs, silent, drawn.graph)
        groups = drawn.graph.scene * (1 + int(drawn.style.max())) + drawn.style
        return ShapeBatch(drawn.graph, stated, groups * categories + drawn.graph.category), drawn.boxes.size

    def suites(self, count: int, generator: torch.Generator) -> tuple[ShapeBatch, Tensor]:
        """Suites without a room, which hold rare classes as often as others."""
        batch = draw_suites(count, torch.arange(10_000), generator)
        category = batch.graph.category
        return batch, self.sizes[category, torch.randint(self.sizes.shape[1], category.shape, generator=generator)]

    def described(self, batch: ShapeBatch, styles: Tensor, generator: torch.Generator) -> Tensor:
        """(N, D) descriptions: a style for every group, open choices for every kind of piece in it."""
        categories = len(self.sizes)
        _, group = (batch.shape // categories).unique(return_inverse=True)
        _, piece = (batch.graph.scene * 10**9 + batch.shape).unique(return_inverse=True)
        style = styles[torch.randint(len(styles), (int(group.max()) + 1,), generator=generator)]
        open_choices = 2 * torch.rand(int(piece.max()) + 1, len(OPEN), generator=generator) - 1
        return torch.cat([style[group], open_choices[piece]], dim=1)

    def loss(self, model: CompactModel, generator: torch.Generator) -> tuple[Tensor, dict[str, Tensor]]:
        """Loss of one random batch."""
        batch, size = self.draw(generator)
        clean = self.described(batch, self.styles, generator).to(model.device)
        return parts_loss(model, batch.to(model.device), clean, size.to(model.device), generator)

    @torch.no_grad()
    def validate(self, model: CompactModel) -> dict[str, float]:
        """Losses on suites of held-out styles, the same draws every time."""
        generator = torch.Generator().manual_seed(0)
        found: dict[str, list[float]] = {}
        for _ in range(4):
            batch, size = self.suites(32, generator)
            clean = self.described(batch, self.held, generator).to(model.device)
            _, parts = parts_loss(model, batch.to(model.device), clean, size.to(model.device), generator)
            for name, value in parts.items():
                found.setdefault(f"held/{name}", []).append(float(value))
        return {name: float(np.mean(values)) for name, values in found.items()}


def silenced(pairs: Pairs, silent: Tensor, graph: GraphBatch) -> Pairs:
    """The pairs without what is said of style and material in the `silent` scenes (S,)."""
    stated = pairs.stated.clone()
    width = stated.shape[1] // 2
    columns = [predicate + side for predicate in vocabulary().uniting("shape") for side in (0, width)]
    rows = silent[graph.scene[pairs.receiver]]
    for column in columns:
        stated[rows, column] = 0
    return Pairs(pairs.receiver, pairs.sender, stated, pairs.scale)
