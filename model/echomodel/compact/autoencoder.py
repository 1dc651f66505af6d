"""Autoencoder of truncated signed distances: a PCA of 4^3 patches, refined by convolutions over the latent grid."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from echomodel.config import CompactConfig

GRID = 64


class Autoencoder(nn.Module):
    """Grids (N, 64, 64, 64) in [-1, 1] <-> latents (N, C, G, G, G), G = 64 / patch.

    The encoder is a PCA of patches, fitted once by `initialise` and fixed: the decoder can be trained further without
    spoiling a denoiser trained on its latents. The decoder is the PCA's inverse plus residual convolutions over the
    latent grid, which see the neighbouring patches.
    """

    def __init__(self, config: CompactConfig) -> None:
        super().__init__()
        settings = config.autoencoder
        self.patch, self.channels = settings.patch, settings.channels
        voxels = self.patch**3
        self.register_buffer("basis", torch.zeros(settings.channels, voxels))
        self.register_buffer("offset", torch.zeros(settings.channels))
        self.decode_patch = nn.Linear(settings.channels, voxels)
        self.synthesis = _Refiner(settings.channels, settings.width, voxels, settings.blocks)

    basis: Tensor
    offset: Tensor

    @property
    def cells(self) -> int:
        """Cells of the latent grid along a side."""
        return GRID // self.patch

    @torch.no_grad()
    def initialise(self, grids: Tensor) -> None:
        """Fit the PCA to the patches of grids (M, X, Y, Z), scaled so that latents have unit power."""
        patches = to_patches(grids, self.patch).flatten(2).transpose(1, 2).reshape(-1, self.patch**3).double()
        mean = patches.mean(0)
        centred = patches - mean
        values, vectors = torch.linalg.eigh(centred.T @ centred / len(centred))
        basis = vectors[:, -self.channels :].flip(1)
        scale = values[-self.channels :].mean().sqrt()
        self.basis.copy_((basis / scale).T)
        self.offset.copy_(-(mean @ basis) / scale)
        self.decode_patch.weight.copy_(basis * scale)
        self.decode_patch.bias.copy_(mean)

    def encode(self, grids: Tensor) -> Tensor:
        """Latents of grids: (N, X, Y, Z) -> (N, C, X/p, Y/p, Z/p); any multiples of the patch."""
        patches = to_patches(grids, self.patch)
        return nn.functional.conv3d(patches, self.basis[:, :, None, None, None], self.offset)

    def decode(self, latent: Tensor) -> Tensor:
        """Grids of latents: (N, C, G, G, G) -> (N, 64, 64, 64) in [-1, 1]."""
        linear = self.decode_patch
        patches = nn.functional.conv3d(latent, linear.weight[:, :, None, None, None], linear.bias)
        return from_patches(patches + self.synthesis(latent), self.patch).clamp(-1, 1)

    def forward(self, grids: Tensor, noise: Tensor | float = 0.0) -> Tensor:
        """Reconstruction of grids, with noise added to the latent in between."""
        return self.decode(self.encode(grids) + noise)


class _Refiner(nn.Module):
    """Residual convolutions on the latent grid, each block seeing twice as far; the last map starts at zero.

    With two blocks a cell hears of almost the whole grid: a leg's foot of its seat, a cord of what hangs on it.
    """

    def __init__(self, inputs: int, width: int, outputs: int, blocks: int) -> None:
        super().__init__()
        self.enter = nn.Conv3d(inputs, width, 3, padding=1)
        self.blocks = nn.ModuleList(
            nn.Sequential(
                nn.SiLU(),
                nn.Conv3d(width, width, 3, padding=1),
                nn.SiLU(),
                nn.Conv3d(width, width, 3, padding=reach, dilation=reach),
            )
            for reach in (2 ** (number + 1) for number in range(blocks))
        )
        self.leave = nn.Conv3d(width, outputs, 1, bias=False)
        nn.init.zeros_(self.leave.weight)

    def forward(self, x: Tensor) -> Tensor:
        x = self.enter(x)
        for block in self.blocks:
            x = x + block(x)
        return self.leave(nn.functional.silu(x))


def to_patches(grids: Tensor, patch: int) -> Tensor:
    """Cut grids into cubes of `patch` voxels a side: (N, X, Y, Z) -> (N, patch^3, X/p, Y/p, Z/p)."""
    n, x, y, z = grids.shape
    cut = grids.reshape(n, x // patch, patch, y // patch, patch, z // patch, patch)
    return cut.permute(0, 2, 4, 6, 1, 3, 5).reshape(n, patch**3, x // patch, y // patch, z // patch)


def from_patches(patches: Tensor, patch: int) -> Tensor:
    """The inverse of `to_patches`."""
    n, _, x, y, z = patches.shape
    cut = patches.reshape(n, patch, patch, patch, x, y, z).permute(0, 4, 1, 5, 2, 6, 3)
    return cut.reshape(n, x * patch, y * patch, z * patch)
