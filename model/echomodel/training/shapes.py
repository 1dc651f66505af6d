"""Shape sets in training: grids drawn at random, and the latents of a whole set for the denoiser."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from echomodel.compact.autoencoder import Autoencoder
from echomodel.data.shapeset import ShapeSet


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
def encoded_set(autoencoder: Autoencoder, shapes: ShapeSet, batch: int = 16) -> EncodedShapes:
    """Encode a whole set once, so that no step of the denoiser's training has to; raises ValueError for real meshes."""
    categories = len(shapes.categories)
    numbers = shapes.style * categories + shapes.category
    if len(shapes) % categories or not np.array_equal(numbers, np.arange(len(shapes))):
        raise ValueError(f"{shapes.directory}: is no parametric shape set (every category in every style, in order)")
    device = autoencoder.basis.device
    out = [
        autoencoder.encode(read(shapes, part).to(device)).half().cpu()
        for part in np.array_split(np.arange(len(shapes)), max(1, len(shapes) // batch))
    ]
    held = torch.from_numpy(shapes.held_out.reshape(-1, categories)[:, 0])
    if bool(held.all()) or not bool(held.any()):
        held = torch.arange(len(held)) == len(held) - 1  # a tiny set: its last style is kept out
    sizes = torch.from_numpy(np.asarray(shapes.size, np.float32))
    used, kept = (~held).nonzero()[:, 0], held.nonzero()[:, 0]
    return EncodedShapes(torch.cat(out), sizes, categories, used, kept)


def read(shapes: ShapeSet, numbers: np.ndarray) -> Tensor:
    """Grids (K, 64, 64, 64) float32 of some shapes."""
    return torch.from_numpy(shapes.tsdf(numbers))


def draw_grids(shapes: ShapeSet, numbers: np.ndarray, count: int, generator: torch.Generator) -> Tensor:
    """Random shapes among `numbers`, mirrored along x at random: (count, 64, 64, 64) float32."""
    grids = read(shapes, numbers[torch.randint(len(numbers), (count,), generator=generator).numpy()])
    flip = torch.rand(count, generator=generator) < 0.5
    return torch.where(flip[:, None, None, None], grids.flip(1), grids)
