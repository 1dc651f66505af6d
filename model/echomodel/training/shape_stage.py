"""The shape stage, denoising codes of a scene's objects joined by echoes (EchoScene 3.4), and those beside it.

The autoencoder (recipes call it `vqvae`, after the paper) learns crops of signed distances there and back.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import torch
from torch import Tensor

from echomodel.compact.model import CompactModel
from echomodel.compact.pairs import Pairs, pairs_of
from echomodel.compact.shape import Autoencoder, ShapeDenoiser
from echomodel.config import Objective
from echomodel.data.shapeset import ShapeSet
from echomodel.graph import GraphBatch
from echomodel.metrics.pointsets import surface_scores
from echomodel.randomness import normal
from echomodel.training.layout_losses import add_noise, draw_known, output_from
from echomodel.training.rooms import PackedRooms, draw_batch, draw_levels
from echomodel.training.start import Start
from echomodel.vocabulary import vocabulary

LOWEST = 0.1  # level below which the loss weight 1 / level^2 of a predicted clean latent stops growing
BUNDLE = 4  # objects in a suite


@dataclass(frozen=True, eq=False)
class ShapeBatch:
    """Scenes with the shape of every object.

    Arguments:
        graph, pairs: N nodes. shape: (N,) int64, number of the shape in the set.
    """

    graph: GraphBatch
    pairs: Pairs
    shape: Tensor

    def to(self, device: torch.device | str) -> ShapeBatch:
        """The same batch on another device."""
        return ShapeBatch(self.graph.to(device), self.pairs.to(device), self.shape.to(device))


def shape_loss(
    model: CompactModel, batch: ShapeBatch, clean: Tensor, size: Tensor, generator: torch.Generator
) -> tuple[Tensor, dict[str, Tensor]]:
    """Denoising loss of the unknown objects' codes.

    Arguments:
        clean: (N, K) float32 codes.
        size: (N, 3) float32, metres.
    """
    objective = model.config.shape.objective
    known, level, noisy = noised(batch, clean, objective, generator)
    latent = model.latent(batch.graph.category, batch.pairs)
    context = model.shape.context(batch.graph, size, batch.pairs, latent)
    output, wanted = (output_from(of, noisy, level, objective, LOWEST)
                    for of in (model.shape(noisy, level, context).float(), clean))  # fmt: skip
    free = (~known).float()
    error = (output - wanted).square().flatten(1).mean(1)
    loss = (error * free).sum() / free.sum().clamp_min(1)
    return loss, {"shape": loss}


def noised(
    batch: ShapeBatch, clean: Tensor, objective: Objective, generator: torch.Generator
) -> tuple[Tensor, Tensor, Tensor]:
    """Which objects are known (N,) bool, the level of each (N,), noisy codes (N, K) of the clean ones."""
    scene, scenes = batch.graph.scene, batch.graph.num_scenes
    known = draw_known(scene, scenes, generator)
    level = shifted(draw_levels(scenes, generator, clean.device))[scene] * ~known
    noise = normal(clean.shape, generator, clean.device)
    # equal furniture starts from equal noise when sampled, so most of the scenes train that way
    shared = (torch.rand(scenes, generator=generator) < 0.75).to(clean.device)[scene, None]
    same = (batch.graph.scene[:, None] == batch.graph.scene) & (batch.shape[:, None] == batch.shape)
    noise = torch.where(shared, noise[same.int().argmax(1)], noise)  # of the first of its scene with the same shape
    return known, level, torch.where(known[:, None], clean, add_noise(clean, noise, level, objective))


def shifted(level: Tensor) -> Tensor:
    """Uniform levels moved towards the middle, where there is most to learn (Esser et al. 2024)."""
    normal = 0.2 + math.sqrt(2) * 1.2 * torch.erfinv((2 * level - 1).clamp(-0.9999, 0.9999))
    return torch.sigmoid(normal).clamp(0.02, 1.0)


def draw_suites(count: int, styles: Tensor, generator: torch.Generator) -> ShapeBatch:
    """Suites: `BUNDLE` objects of random categories and at most two of the `styles` (K,), told which belong together.

    Rooms hold few of the rare categories; suites hold all alike.
    """
    words = vocabulary()
    coarse = torch.tensor([words.coarse_categories.index(entry.coarse) for entry in words.categories])
    nodes = count * BUNDLE
    scene = torch.arange(count).repeat_interleave(BUNDLE)
    category = torch.randint(len(coarse), (nodes,), generator=generator)
    repeat = torch.rand(nodes, generator=generator) < 0.25
    category = torch.where(repeat, category[scene * BUNDLE], category)
    two = styles[torch.randint(len(styles), (count, 2), generator=generator)]
    style = two[scene, (torch.rand(nodes, generator=generator) < 0.3).long()]
    at, to = ((scene[:, None] == scene) & ~torch.eye(nodes, dtype=torch.bool)).nonzero(as_tuple=True)
    same_style, same_coarse = style[at] == style[to], coarse[category[at]] == coarse[category[to]]
    stated = torch.stack([same_style, same_coarse, same_style & same_coarse], dim=1)
    keep = torch.rand(count, generator=generator)[scene[at]]
    stated &= torch.rand(stated.shape, generator=generator) < keep[:, None]
    edge, predicate = stated.nonzero(as_tuple=True)
    graph = GraphBatch(
        category=category, triplets=torch.stack([at[edge], predicate + 13, to[edge]], dim=1), scene=scene,
        room_type=torch.randint(len(words.room_types), (count,), generator=generator),
        floor=torch.full((count, 4, 2), torch.nan),
    )  # fmt: skip
    return ShapeBatch(graph, pairs_of(graph), style * len(coarse) + category)


class ShapeStage:
    """What the trainer needs to know about shapes.

    Arguments:
        rooms: packed rooms, whose styles and categories name the shapes.
        shapes: the shape set in latent space.
        batch: objects per batch.
    """

    trained = saved = ("shape",)
    parts: ClassVar[tuple[str, ...]] = ("latent", "autoencoder", "shape")
    needs: ClassVar[tuple[str, ...]] = ("latent", "autoencoder")

    def __init__(self, rooms: PackedRooms, shapes: EncodedShapes, batch: int) -> None:
        self.rooms, self.shapes, self.batch = rooms, shapes, batch
        self._codes: Tensor | None = None

    @classmethod
    def open(cls, start: Start) -> ShapeStage:
        """The stage of a recipe, its shapes encoded; a new denoiser is fitted to them."""
        rooms = start.rooms(held=False)
        stage = cls(rooms, encoded_set(start.model.autoencoder, start.shapes()), start.recipe.shapes_per_batch)
        if "shape" not in start.loaded and not start.resume:
            shapes = stage.shapes  # those of the styles that are trained on
            used = shapes.styles[:, None] * shapes.categories + torch.arange(shapes.categories)
            start.model.shape.initialise(shapes.latents[used.flatten()], start.generator)
        return stage

    @torch.no_grad()
    def codes(self, model: CompactModel) -> Tensor:
        """(M, K) codes of the whole set, computed at first use, when a resumed run has its components back."""
        if self._codes is None:
            self._codes = torch.cat(
                [model.shape.codes(part.float().to(model.device)) for part in self.shapes.latents.split(256)]
            )
        return self._codes

    def draw(self, generator: torch.Generator) -> ShapeBatch:
        """Rooms on even draws, suites on odd ones."""
        if float(torch.rand(1, generator=generator)) < 0.5:
            return draw_suites(max(1, self.batch // BUNDLE), self.shapes.styles, generator)
        room = draw_batch(self.rooms, self.batch, generator)
        style = self.shapes.styles[room.style % len(self.shapes.styles)]  # of those that are trained on
        return ShapeBatch(room.graph, room.pairs, style * self.shapes.categories + room.graph.category)

    def loss(self, model: CompactModel, generator: torch.Generator) -> tuple[Tensor, dict[str, Tensor]]:
        """Loss of one random batch."""
        batch = self.draw(generator)
        return shape_loss(model, batch.to(model.device), *self.truth(model, batch), generator)

    def truth(self, model: CompactModel, batch: ShapeBatch) -> tuple[Tensor, Tensor]:
        """Codes (N, K) and sizes (N, 3) of the shapes of a batch, on the model's device."""
        return self.codes(model)[batch.shape.to(model.device)], self.shapes.sizes[batch.shape.cpu()].to(model.device)

    @torch.no_grad()
    def validate(self, model: CompactModel) -> dict[str, float]:
        """Denoising loss on suites of held-out styles, the same draws every time."""
        generator = torch.Generator().manual_seed(0)
        losses = []
        for _ in range(4):
            batch = draw_suites(8, self.shapes.held, generator)
            losses.append(shape_loss(model, batch.to(model.device), *self.truth(model, batch), generator)[0])
        return {"held/shape": float(torch.stack(losses).mean())}


@dataclass(frozen=True, eq=False)
class EncodedShapes:
    """A parametric shape set in the autoencoder's latent space; shape number = style * categories + category.

    Arguments:
        latents: (M, C, G, G, G) float16. sizes: (M, 3) float32, metres.
        categories: classes of the vocabulary that the set was made with.
        styles, held: numbers of the styles to train on and of those kept out, int64.
    """

    latents: Tensor
    sizes: Tensor
    categories: int
    styles: Tensor
    held: Tensor


@torch.no_grad()
def encoded_set(autoencoder: Autoencoder, shapes: ShapeSet) -> EncodedShapes:
    """Encode a whole set once, so that no step of the denoiser's training has to; raises ValueError for real meshes."""
    categories = len(shapes.categories)
    numbers = shapes.style * categories + shapes.category
    if len(shapes) % categories or not np.array_equal(numbers, np.arange(len(shapes))):
        raise ValueError(f"{shapes.directory}: is no parametric shape set (every category in every style, in order)")
    device = autoencoder.basis.device
    out = [
        autoencoder.encode(torch.from_numpy(shapes.tsdf(part)).to(device)).half().cpu()
        for part in np.array_split(np.arange(len(shapes)), max(1, len(shapes) // 16))
    ]
    held = torch.from_numpy(shapes.held_out.reshape(-1, categories)[:, 0])
    if bool(held.all()) or not bool(held.any()):
        held = torch.arange(len(held)) == len(held) - 1  # a tiny set: its last style is kept out
    sizes = torch.from_numpy(np.asarray(shapes.size, np.float32))
    used, kept = (~held).nonzero()[:, 0], held.nonzero()[:, 0]
    return EncodedShapes(torch.cat(out), sizes, categories, used, kept)


def draw_grids(shapes: ShapeSet, numbers: np.ndarray, count: int, generator: torch.Generator) -> Tensor:
    """Random shapes among `numbers`, mirrored along x at random: (count, 64, 64, 64) float32."""
    picked = numbers[torch.randint(len(numbers), (count,), generator=generator).numpy()]
    grids = torch.from_numpy(shapes.tsdf(picked))
    flip = torch.rand(count, generator=generator) < 0.5
    return torch.where(flip[:, None, None, None], grids.flip(1), grids)


NOISE = 0.1  # standard deviation added to the latent, so that the decoder forgives a denoiser's small errors


def reconstruction_loss(grids: Tensor, rebuilt: Tensor) -> Tensor:
    """Mean absolute error, voxels near the surface counting up to four times as much."""
    weight = 1 + 3 * (1 - grids.abs()).clamp_min(0)
    return ((rebuilt - grids).abs() * weight).mean()


class AutoencoderStage:
    """What the trainer needs to know about the autoencoder.

    Arguments:
        shapes: shape set; its held-out part is for validation.
        batch: grids per batch.
        components: a shape branch whose principal components the decoder learns to read: a batch then is `batch` whole
            latents projected on them, which is all that a denoiser working in them can say, and half as many latents
            as they are. The decoder puts back what the projection blurs (thin legs, edges).
    """

    trained = saved = ("autoencoder",)
    parts: ClassVar[tuple[str, ...]] = saved
    needs: ClassVar[tuple[str, ...]] = ()

    def __init__(self, shapes: ShapeSet, batch: int, components: ShapeDenoiser | None = None) -> None:
        self.shapes, self.batch, self.components = shapes, batch, components
        self.used, self.held = (~shapes.held_out).nonzero()[0], shapes.held_out.nonzero()[0]
        if not len(self.held):
            self.held = self.used

    @classmethod
    def open(cls, start: Start) -> AutoencoderStage:
        """The stage of a recipe; a new autoencoder starts from the shapes' PCA."""
        stage = cls(start.shapes(), start.recipe.shapes_per_batch, start.components)
        if "autoencoder" not in start.loaded:
            start.model.autoencoder.initialise(draw_grids(stage.shapes, stage.used, 64, start.generator))
        return stage

    def loss(self, model: CompactModel, generator: torch.Generator) -> tuple[Tensor, dict[str, Tensor]]:
        """Loss of one random batch."""
        count = self.batch // (2 if self.components else 1)
        grids = draw_grids(self.shapes, self.used, count, generator).to(model.device)
        latent = model.autoencoder.encode(grids)
        noise = NOISE * normal(latent.shape, generator, latent.device)
        error = reconstruction_loss(grids, model.autoencoder.decode(latent + noise).float())
        if self.components is None:
            return error, {"reconstruction": error}
        picked = torch.randint(len(self.used), (self.batch,), generator=generator)
        whole = torch.from_numpy(self.shapes.tsdf(self.used[picked.numpy()])).to(model.device)
        blurred = self.projected(model.autoencoder.encode(whole), generator)
        projected = reconstruction_loss(whole, model.autoencoder.decode(blurred).float())
        return error + projected, {"reconstruction": error, "projected": projected}

    @torch.no_grad()
    def projected(self, latent: Tensor, generator: torch.Generator | None = None) -> Tensor:
        """Whole latents (N, C, G, G, G) as far as the components carry them, with the noise of a denoiser's errors."""
        assert self.components is not None
        codes = self.components.codes(latent.float())
        if generator is not None:
            codes = codes + NOISE * normal(codes.shape, generator, codes.device)
        return self.components.latents(codes)

    @torch.no_grad()
    def validate(self, model: CompactModel, count: int = 46) -> dict[str, float]:
        """Mean absolute error, intersection over union and one-voxel F-score on held-out shapes."""
        picked = self.held[np.linspace(0, len(self.held) - 1, min(count, len(self.held))).astype(int)]
        errors: list[Tensor] = []
        scores: list[dict[str, float]] = []
        through: list[float] = []
        for start in range(0, len(picked), 8):
            grids = torch.from_numpy(self.shapes.tsdf(picked[start : start + 8])).to(model.device)
            rebuilt = model.autoencoder(grids)
            errors.append((grids - rebuilt).abs().mean())
            scores += _scores(rebuilt, grids)
            if self.components is not None:
                rebuilt = model.autoencoder.decode(self.projected(model.autoencoder.encode(grids)))
                through += [row["f_score"] for row in _scores(rebuilt, grids)]
        found = {"held/l1": float(torch.stack(errors).mean())}
        for name, score in (("held/iou", "iou"), ("held/fscore", "f_score")):
            found[name] = float(np.mean([row[score] for row in scores]))
        return found | {"held/fscore_projected": float(np.mean(through))} if through else found


def _scores(rebuilt: Tensor, grids: Tensor) -> list[dict[str, float]]:
    """`surface_scores` of each reconstruction."""
    pairs = zip(rebuilt.cpu().numpy(), grids.cpu().numpy(), strict=True)
    return [surface_scores(ours, real) for ours, real in pairs]
