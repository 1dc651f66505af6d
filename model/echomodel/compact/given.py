"""What a caller gives to a sampler, checked: how to sample, known boxes or shapes, and noise to start from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import torch
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.config import Objective, Sampler
from echomodel.graph import GraphBatch
from echomodel.protocols import Sampling
from echomodel.randomness import normal
from echomodel.samplers import Predict, sample


class SamplerSettings(Protocol):
    """What the configuration of every branch says of its sampling."""

    @property
    def sampler(self) -> Sampler: ...
    @property
    def steps(self) -> int: ...
    @property
    def objective(self) -> Objective: ...


@dataclass(frozen=True, eq=False)
class CompactSampling(Sampling):
    """How a compact model samples; what is given beside goes by these.

    Arguments:
        sampler: None = the branch's. rules: the rule set that the relations are meant in, `strict` or `sgfront`.
        relation_guidance: strength of the pull of the rules' margins on denoised boxes at every step, 0 = off, None =
            the branch's.
        noise: (N, K) starting noise in place of the generator's, taken as it is (no temperature, no candidates).
        candidates: draws of a shape, of which the most whole that bears what stands on it is kept (pieces of one class
            and style together); None = the branch's.
        styles: (N,) int64, nodes with one number of 0 or more are furniture of one style, beside those that relations
            of style join; None = nothing is known of styles.
    """

    sampler: Sampler | None = None
    rules: str = "strict"
    relation_guidance: float | None = None
    noise: Tensor | None = None
    candidates: int | None = None
    styles: Tensor | None = None

    def denoised(self, predict: Predict, noise: Tensor, settings: SamplerSettings) -> Tensor:
        """What becomes of `noise` (N, ...), by the branch's sampler and steps where none are asked for."""
        return sample(
            self.sampler or settings.sampler, predict, noise, self.steps or settings.steps, settings.objective,
            known=self.known, known_mask=self.known_mask, generator=self.generator, progress=self.progress,
        )  # fmt: skip

    def start(self, nodes: int, width: int, device: torch.device) -> Tensor:
        """The noise (nodes, width) that is given, checked, or the generator's."""
        if self.noise is None:
            return normal((nodes, width), self.generator, device)
        if tuple(self.noise.shape) != (nodes, width):
            raise ValueError(f"noise is {tuple(self.noise.shape)}, expected {(nodes, width)}")
        bad = ~torch.isfinite(self.noise).all(1)
        if bool(bad.any()):
            raise ValueError(f"noise of node {int(bad.nonzero()[0])} is not finite")
        return self.noise.to(device)


def known_values(graph: GraphBatch, known: Any, mask: Tensor | None, device: torch.device) -> tuple[Any, Tensor | None]:
    """Known values and their mask on `device`, with unknown rows replaced by something harmless."""
    if (known is None) != (mask is None):
        raise ValueError("known and known_mask belong together, one of them is missing")
    if known is None or mask is None:
        return None, None
    nodes = graph.num_nodes
    if len(known) != nodes or tuple(mask.shape) != (nodes,) or mask.dtype != torch.bool:
        found = f"{len(known)} values and a {tuple(mask.shape)} {mask.dtype} mask"
        raise ValueError(f"known: {found} for a graph of {nodes} nodes, expected one of each per node (bool)")
    known, mask = known.to(device), mask.to(device)
    if isinstance(known, Boxes):
        one = known.size.new_ones(())
        filled = Boxes(
            torch.where(mask[:, None], known.size, one),
            torch.where(mask[:, None], known.position, 0 * one),
            torch.where(mask, known.yaw, 0 * one),
        )
        filled.check()
        return filled, mask
    bad = ~torch.isfinite(known.flatten(1)).all(1) & mask
    if bool(bad.any()):
        raise ValueError(f"known shape of node {int(bad.nonzero()[0])} holds values that are not finite")
    return torch.where(mask.reshape(-1, *[1] * (known.ndim - 1)), known, torch.ones_like(known)), mask


def repeated(values: Tensor | None, count: int) -> Tensor | None:
    """(N, ...) behind itself `count` times."""
    return None if values is None else torch.cat([values] * count)
