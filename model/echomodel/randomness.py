"""Normal noise from one generator, or of many scenes packed together, each from a generator of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True, eq=False)
class SceneGenerators:
    """One generator a scene, so that a scene draws the same numbers whatever it is packed with.

    Arguments:
        each: S generators; nodes: how many nodes each of the S scenes has, in the order of the pack. Scenes in a row
            that have one generator draw from it together, as they would if they were packed alone.
    """

    each: Sequence[torch.Generator]
    nodes: Sequence[int]

    def __post_init__(self) -> None:
        if len(self.each) != len(self.nodes):
            raise ValueError(f"{len(self.each)} generators for {len(self.nodes)} scenes, expected one each")

    @property
    def shared(self) -> list[tuple[torch.Generator, int, int]]:
        """Every generator with its scenes in a row and their nodes, as (generator, scenes, nodes)."""
        out: list[tuple[torch.Generator, int, int]] = []
        for generator, nodes in zip(self.each, self.nodes, strict=True):
            if out and out[-1][0] is generator:
                out[-1] = (generator, out[-1][1] + 1, out[-1][2] + nodes)
            else:
                out.append((generator, 1, nodes))
        return out


Randomness = torch.Generator | SceneGenerators


def normal(
    shape: Sequence[int], source: Randomness | None, device: torch.device | str, dtype: torch.dtype = torch.float32
) -> Tensor:
    """Standard normal noise on `device`, drawn where the generator is.

    Arguments:
        shape: (R, ...); with a generator a scene, R is a multiple of all nodes: so many draws behind one another.
    """
    if source is None or isinstance(source, torch.Generator):
        where = device if source is None else source.device
        return torch.randn(tuple(shape), generator=source, dtype=dtype, device=where).to(device)
    total, rest = sum(source.nodes), tuple(shape[1:])
    draws, left = divmod(shape[0], total)
    if left:
        raise ValueError(f"noise for {shape[0]} rows, expected a multiple of the pack's {total} nodes")
    drawn = [
        normal((draws * count, *rest), generator, device, dtype).reshape(draws, count, *rest)
        for generator, _, count in source.shared
    ]
    return torch.cat(drawn, dim=1).reshape(shape[0], *rest)


def for_scenes(source: Randomness, chosen: Tensor) -> Randomness:
    """The generators of the scenes where `chosen` (S,) bool is true; a single generator serves all."""
    if isinstance(source, torch.Generator):
        return source
    kept = [number for number, wanted in enumerate(chosen.tolist()) if wanted]
    return SceneGenerators([source.each[k] for k in kept], [source.nodes[k] for k in kept])


def uniform(scenes: int, source: Randomness) -> Tensor:
    """(S,) float32 in [0, 1), one for each scene."""
    if isinstance(source, torch.Generator):
        return torch.rand(scenes, generator=source)
    return torch.cat([torch.rand(count, generator=generator) for generator, count, _ in source.shared])


def whole_numbers(source: Randomness, scenes: int) -> list[tuple[int, int]]:
    """A seed for each scene: its number within the draw of its generator, and that draw of up to 2^62."""
    if isinstance(source, torch.Generator):
        seed = int(torch.randint(2**62, (1,), generator=source))
        return [(seed, number) for number in range(scenes)]
    return [pair for generator, count, _ in source.shared for pair in whole_numbers(generator, count)]
