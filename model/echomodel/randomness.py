"""Normal noise by a seed.

It is drawn without torch, and yet, of sixteen numbers and more, as torch's generator of the same seed draws it on
a CPU, but for rounding.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from echomodel.arrays import Array, on_device

if TYPE_CHECKING:
    import torch

    from echomodel.scene_noise import SceneGenerators

BLOCK = 16  # numbers that are made of as many random ones at once
BITS = 24  # of each random number


class Noise:
    """Normal noise without end by a seed: Mersenne twister, Box-Muller on blocks of sixteen numbers."""

    def __init__(self, seed: int) -> None:
        self._twister = np.random.RandomState(seed % 2**32)

    def draw(self, count: int) -> np.ndarray:
        """(count,) float32."""
        uniform = self._uniform(max(count, BLOCK))
        out = _normal(uniform[: len(uniform) // BLOCK * BLOCK])
        if len(out) < count:  # the last sixteen are a block of their own, drawn anew
            out = np.concatenate([out[: count - BLOCK], _normal(self._uniform(BLOCK))])
        return out[:count]

    def normal(self, shape: Sequence[int], device: torch.device | str | None) -> Array:
        """Noise of a shape, float32, on a device, None = of numpy."""
        return on_device(self.draw(int(np.prod(shape))).reshape(shape), device)

    def _uniform(self, count: int) -> np.ndarray:
        """(count,) float64 in [0, 1)."""
        return (self._twister.randint(0, 2**32, count, np.uint32) & (2**BITS - 1)) / 2.0**BITS


def _normal(uniform: np.ndarray) -> np.ndarray:
    """Normal numbers, float32, of as many in [0, 1): halves of blocks are lengths and directions."""
    length, direction = uniform.reshape(-1, 2, BLOCK // 2).swapaxes(0, 1)
    radius, angle = np.sqrt(-2 * np.log(1 - length)), 2 * np.pi * direction
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], 1).ravel().astype(np.float32)


Randomness: TypeAlias = "Noise | torch.Generator | SceneGenerators"


def normal(shape: Sequence[int], source: Randomness | None, device: torch.device | str | None) -> Array:
    """Standard normal noise (float32) on `device`, None = of numpy, drawn where the source is; without one of torch's.

    `shape`: (R, ...); with a source a scene, R is a multiple of all nodes: so many draws behind one another.
    """
    if source is not None and hasattr(source, "normal"):
        return source.normal(shape, device)
    import torch

    generator: torch.Generator | None = source  # type: ignore[assignment]
    where = device if generator is None else generator.device
    return on_device(torch.randn(tuple(shape), generator=generator, device=where), device)
