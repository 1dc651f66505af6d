"""Shape sets for training: grids on disk, and latents of a whole set beside the rooms that use them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from echomodel.compact.autoencoder import GRID, Autoencoder


@dataclass(frozen=True, eq=False)
class ShapeGrids:
    """M truncated signed distances, mapped from disk; shape number = style * categories + category.

    Arguments:
        grids: (M, 64, 64, 64) int8, value * 127.
        sizes: (M, 3) float32, metres.
        categories: classes of the vocabulary that the set was made with.
    """

    grids: np.ndarray
    sizes: Tensor
    categories: int

    def __len__(self) -> int:
        return len(self.grids)

    @property
    def styles(self) -> int:
        """Number of style groups."""
        return len(self) // self.categories

    @classmethod
    def open(cls, path: Path, categories: int) -> ShapeGrids:
        """Map a .npy file of grids; raises ValueError when it holds something else."""
        try:
            grids = np.load(path, mmap_mode="r", allow_pickle=False)
        except ValueError as error:
            raise ValueError(f"{path}: not an array file ({error})") from None
        if grids.ndim != 4 or grids.shape[1:] != (GRID,) * 3 or grids.dtype != np.int8 or len(grids) % categories:
            expected = f"(styles * {categories}, 64, 64, 64) int8"
            raise ValueError(f"{path}: holds {grids.shape} {grids.dtype}, expected {expected}")
        sizes = torch.from_numpy(np.load(path.with_name(f"{path.stem}_size.npy"), allow_pickle=False)).float()
        return cls(grids, sizes, categories)

    def read(self, index: Tensor | np.ndarray) -> Tensor:
        """Grids of some shapes: (K,) -> (K, 64, 64, 64) float32 in [-1, 1]."""
        rows = np.stack([self.grids[int(i)] for i in index])
        return torch.from_numpy(rows).float() / 127


@dataclass(frozen=True, eq=False)
class EncodedShapes:
    """A shape set in the autoencoder's latent space.

    Arguments:
        latents: (M, C, G, G, G) float16. sizes: (M, 3) float32, metres.
        categories: classes of the vocabulary that the set was made with.
    """

    latents: Tensor
    sizes: Tensor
    categories: int

    @property
    def styles(self) -> int:
        """Number of style groups."""
        return len(self.latents) // self.categories


@torch.no_grad()
def encoded_set(autoencoder: Autoencoder, shapes: ShapeGrids, batch: int = 16) -> EncodedShapes:
    """Encode a whole set once, so that no step of the denoiser's training has to."""
    out = []
    for start in range(0, len(shapes), batch):
        stop = min(start + batch, len(shapes))
        out.append(autoencoder.encode(shapes.read(np.arange(start, stop))).half())
    return EncodedShapes(torch.cat(out), shapes.sizes, shapes.categories)


def crops(shapes: ShapeGrids, count: int, side: int, generator: torch.Generator) -> Tensor:
    """Random cubes of random shapes, aligned to 4 voxels, mirrored along x at random: (count, side, side, side).

    Cubes without a surface are drawn again, three times at most: most of a grid is empty air.
    """
    out = []
    for _ in range(count):
        number = int(torch.randint(len(shapes), (1,), generator=generator))
        for _ in range(3):
            x, y, z = (torch.randint((GRID - side) // 4 + 1, (3,), generator=generator) * 4).tolist()
            cube = shapes.grids[number, x : x + side, y : y + side, z : z + side]
            if cube.min() < 0 < cube.max():
                break
        out.append(torch.from_numpy(np.array(cube)).float() / 127)
    grids = torch.stack(out)
    flip = torch.rand(count, generator=generator) < 0.5
    return torch.where(flip[:, None, None, None], grids.flip(1), grids)
