"""The autoencoder stage (recipes call it `vqvae`, after the paper): crops of signed distances there and back."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import torch
from torch import Tensor

from echomodel.compact.model import CompactModel
from echomodel.compact.shape import ShapeDenoiser
from echomodel.data.shapeset import ShapeSet
from echomodel.metrics.pointsets import surface_scores
from echomodel.randomness import normal
from echomodel.training.shape_stage import draw_grids, read
from echomodel.training.start import Start

NOISE = 0.1  # standard deviation added to the latent, so that the decoder forgives a denoiser's small errors


def reconstruction_loss(grids: Tensor, rebuilt: Tensor) -> Tensor:
    """Mean absolute error, voxels near the surface counting up to four times as much."""
    weight = 1 + 3 * (1 - grids.abs()).clamp_min(0)
    return ((rebuilt - grids).abs() * weight).mean()


class AutoencoderStage:
    """What the trainer needs to know about the autoencoder.

    Arguments:
        shapes: shape set; its held-out part is for validation.
        batch: grids per batch, per process.
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
        if "autoencoder" not in start.given:
            stage.initialise(start.model, start.generator)
        return stage

    def initialise(self, model: CompactModel, generator: torch.Generator) -> None:
        """Start from the PCA of patches."""
        model.autoencoder.initialise(draw_grids(self.shapes, self.used, 64, generator))

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
        whole = read(self.shapes, self.used[picked.numpy()]).to(model.device)
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
            grids = read(self.shapes, picked[start : start + 8]).to(model.device)
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
