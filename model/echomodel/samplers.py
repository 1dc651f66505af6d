"""Samplers: from noise to a sample, any subset of nodes held fixed at level 0.

A sampler makes the steps of one run: `step(x, clean, start, end)` takes x (N, ...) from level `start` to level `end`,
given the clean sample that the denoiser sees in it, which `predict(x, level)` returns for a noise level per node (N,).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import torch
from torch import Tensor

from echomodel.config import Objective, Sampler
from echomodel.objectives import alpha_sigma, expand, sampling_levels
from echomodel.progress import StepListener
from echomodel.randomness import Randomness, normal

Predict = Callable[[Tensor, Tensor], Tensor]
Step = Callable[[Tensor, Tensor, float, float], Tensor]


def ddim(objective: Objective, generator: Randomness | None = None) -> Step:
    """Deterministic DDIM (Song et al. 2021, Eq. 12 with eta 0); with rectified flow this is the Euler method."""

    def step(x: Tensor, clean: Tensor, start: float, end: float) -> Tensor:
        (a, s), (b, r) = _strengths(start, objective), _strengths(end, objective)
        return b * clean + r * (x - a * clean) / s

    return step


def ancestral(objective: Objective, generator: Randomness | None = None) -> Step:
    """DDPM ancestral sampling from the posterior q(x_s | x_t, x0) (Ho et al. 2020, Eq. 7)."""

    def step(x: Tensor, clean: Tensor, start: float, end: float) -> Tensor:
        (a, s), (b, r) = _strengths(start, objective), _strengths(end, objective)
        ratio = a / b
        between = s * s - ratio * ratio * r * r
        mean = (ratio * r * r * x + b * between * clean) / (s * s)
        if end == 0:
            return mean
        noise = normal(x.shape, generator, x.device, x.dtype)
        return mean + math.sqrt(max(between, 0.0)) * r / s * noise

    return step


SAMPLERS: dict[Sampler, Callable[[Objective, Randomness | None], Step]] = {
    "ddim": ddim,
    "ancestral": ancestral,
}


def sample(
    sampler: Sampler,
    predict: Predict,
    x: Tensor,
    steps: int,
    objective: Objective,
    *,
    known: Tensor | None = None,
    known_mask: Tensor | None = None,
    generator: Randomness | None = None,
    progress: StepListener | None = None,
) -> Tensor:
    """Run a sampler by name.

    Arguments:
        x: (N, ...) start, standard normal noise.
        known, known_mask: (N, ...) values and (N,) bool, nodes that keep their values from first to last.
        generator: source of the noise that `ancestral` adds.
        progress: called with (steps done, steps) after every step.

    Raises:
        ValueError: the sampler is not known, or steps < 1.
    """
    if sampler not in SAMPLERS:
        raise ValueError(f"sampler is {sampler!r}, allowed: {', '.join(SAMPLERS)}")
    step, times = SAMPLERS[sampler](objective, generator), sampling_levels(steps).tolist()
    free = torch.ones(len(x), dtype=x.dtype, device=x.device)
    fixed = None
    if known_mask is not None and known is not None:
        free = (~known_mask).to(x.dtype)
        fixed = expand(known_mask, x)
        x = torch.where(fixed, known.to(x.dtype), x)
    for number, (start, end) in enumerate(pairwise(times)):
        moved = step(x, predict(x, free * start), start, end)
        x = moved if fixed is None else torch.where(fixed, x, moved)
        if progress is not None:
            progress(number + 1, len(times) - 1)
    return x


def _strengths(level: float, objective: Objective) -> tuple[float, float]:
    alpha, sigma = alpha_sigma(torch.tensor(level, dtype=torch.float64), objective)
    return float(alpha), float(sigma)
