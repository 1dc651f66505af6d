"""What a caller gives to a sampler, checked: how to sample, known boxes or shapes, and noise to start from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import torch
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.config import Objective, Sampler
from echomodel.graph import GraphBatch
from echomodel.progress import StepListener
from echomodel.randomness import Randomness, normal
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
class Sampling:
    """How nodes are sampled, whatever the branch; fields as the arguments of `EchoModel.sample_layout`.

    Arguments:
        known, known_mask: (N, ...) in the numbers that are denoised, and (N,) bool.
    """

    generator: Randomness
    steps: int | None = None
    sampler: Sampler | None = None
    known: Tensor | None = None
    known_mask: Tensor | None = None
    guidance: float = 1.0
    progress: StepListener | None = None

    def denoised(self, predict: Predict, noise: Tensor, settings: SamplerSettings) -> Tensor:
        """What becomes of `noise` (N, ...), by the branch's sampler and steps where none are asked for."""
        return sample(
            self.sampler or settings.sampler, predict, noise, self.steps or settings.steps, settings.objective,
            known=self.known, known_mask=self.known_mask, generator=self.generator, progress=self.progress,
        )  # fmt: skip


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


def starting_noise(shape: tuple[int, ...], generator: Randomness, noise: Tensor | None, device: torch.device) -> Tensor:
    """The noise that is given, checked, or the generator's, of that shape."""
    if noise is None:
        return normal(shape, generator, device)
    if tuple(noise.shape) != shape:
        raise ValueError(f"noise is {tuple(noise.shape)}, expected {shape}")
    bad = ~torch.isfinite(noise).all(1)
    if bool(bad.any()):
        raise ValueError(f"noise of node {int(bad.nonzero()[0])} is not finite")
    return noise.to(device)


def repeated(values: Tensor | None, count: int) -> Tensor | None:
    """(N, ...) behind itself `count` times."""
    return None if values is None else torch.cat([values] * count)
