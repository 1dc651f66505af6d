"""Normal noise from one generator, or of many scenes packed together, each from a generator of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

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
    def shared(self) -> list[tuple[torch.Generator, int]]:
        """Every generator with the nodes of its scenes in a row."""
        rows = groupby(zip(self.each, self.nodes, strict=True), key=lambda row: id(row[0]))
        return [(scenes[0][0], sum(nodes for _, nodes in scenes)) for scenes in (list(row) for _, row in rows)]


Randomness = torch.Generator | SceneGenerators


def normal(
    shape: Sequence[int], source: Randomness | None, device: torch.device | str, dtype: torch.dtype = torch.float32
) -> Tensor:
    """Standard normal noise on `device`, drawn where the generator is.

    `shape`: (R, ...); with a generator a scene, R is a multiple of all nodes: so many draws behind one another.
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
        for generator, count in source.shared
    ]
    return torch.cat(drawn, dim=1).reshape(shape[0], *rest)
