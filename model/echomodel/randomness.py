"""Normal noise from one source, or of many scenes packed together, each from a source of its own.

Noise is drawn without torch, and yet, of sixteen numbers and more, as torch's generator of the same seed draws it on
a CPU, but for rounding.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from echomodel.arrays import Array, kit, on_device

if TYPE_CHECKING:
    import torch

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

    def _uniform(self, count: int) -> np.ndarray:
        """(count,) float64 in [0, 1)."""
        return (self._twister.randint(0, 2**32, count, np.uint32) & (2**BITS - 1)) / 2.0**BITS


def _normal(uniform: np.ndarray) -> np.ndarray:
    """Normal numbers, float32, of as many in [0, 1): halves of blocks are lengths and directions."""
    length, direction = uniform.reshape(-1, 2, BLOCK // 2).swapaxes(0, 1)
    radius, angle = np.sqrt(-2 * np.log(1 - length)), 2 * np.pi * direction
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], 1).ravel().astype(np.float32)


@dataclass(frozen=True, eq=False)
class SceneGenerators:
    """One source a scene, so that a scene draws the same numbers whatever it is packed with.

    Arguments:
        each: S sources; nodes: how many nodes each of the S scenes has, in the order of the pack. Scenes in a row
            that have one source draw from it together, as they would if they were packed alone.
    """

    each: Sequence[Noise | torch.Generator]
    nodes: Sequence[int]

    def __post_init__(self) -> None:
        if len(self.each) != len(self.nodes):
            raise ValueError(f"{len(self.each)} generators for {len(self.nodes)} scenes, expected one each")

    @property
    def shared(self) -> list[tuple[Noise | torch.Generator, int]]:
        """Every source with the nodes of its scenes in a row."""
        rows = groupby(zip(self.each, self.nodes, strict=True), key=lambda row: id(row[0]))
        return [(scenes[0][0], sum(nodes for _, nodes in scenes)) for scenes in (list(row) for _, row in rows)]


Randomness: TypeAlias = "Noise | torch.Generator | SceneGenerators"


def normal(shape: Sequence[int], source: Randomness | None, device: torch.device | str | None) -> Array:
    """Standard normal noise (float32) on `device`, None = of numpy, drawn where the source is; without one of torch's.

    `shape`: (R, ...); with a source a scene, R is a multiple of all nodes: so many draws behind one another.
    """
    if isinstance(source, Noise):
        return on_device(source.draw(int(np.prod(shape))).reshape(shape), device)
    if not isinstance(source, SceneGenerators):
        import torch

        where = device if source is None else source.device
        return on_device(torch.randn(tuple(shape), generator=source, device=where), device)
    total, rest = sum(source.nodes), tuple(shape[1:])
    draws, left = divmod(shape[0], total)
    if left:
        raise ValueError(f"noise for {shape[0]} rows, expected a multiple of the pack's {total} nodes")
    drawn = [
        normal((draws * count, *rest), generator, device).reshape(draws, count, *rest)
        for generator, count in source.shared
    ]
    return kit(drawn[0]).concat(drawn, 1).reshape(shape[0], *rest)
