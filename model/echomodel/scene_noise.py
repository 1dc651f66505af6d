"""Noise of many scenes packed together, each from a source of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING

from echomodel.arrays import Array, kit
from echomodel.randomness import Noise, normal

if TYPE_CHECKING:
    import torch


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

    def normal(self, shape: Sequence[int], device: torch.device | str | None) -> Array:
        """As `echomodel.randomness.normal`; raises ValueError for rows that are no multiple of the pack's nodes."""
        total, rest = sum(self.nodes), tuple(shape[1:])
        draws, left = divmod(shape[0], total)
        if left:
            raise ValueError(f"noise for {shape[0]} rows, expected a multiple of the pack's {total} nodes")
        drawn = [
            normal((draws * count, *rest), generator, device).reshape(draws, count, *rest)
            for generator, count in self.shared
        ]
        return kit(drawn[0]).concat(drawn, 1).reshape(shape[0], *rest)
