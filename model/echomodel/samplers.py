"""What a denoiser is trained to predict, and samplers: from noise to a sample, any subset of nodes fixed at level 0.

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
from echomodel.progress import StepListener
from echomodel.randomness import Randomness, normal


def alpha_sigma(level: Tensor, objective: Objective) -> tuple[Tensor, Tensor]:
    """Signal and noise strength at `level` (any shape) in [0, 1].

    Rectified flow interpolates linearly, (1 - level, level). Noise and velocity prediction use the variance-preserving
    process of DDPM's linear betas in continuous time, beta from 0.1 to 20 (Song et al. 2021, Eq. 32).
    """
    if objective == "flow":
        return 1 - level, level
    log_alpha = -0.25 * level.square() * (20.0 - 0.1) - 0.5 * level * 0.1
    return torch.exp(log_alpha), torch.sqrt(-torch.expm1(2 * log_alpha))


def sampling_levels(steps: int) -> Tensor:
    """Evenly spaced levels from 1 to 0: (steps + 1,) float64; raises ValueError for fewer than one step."""
    if steps < 1:
        raise ValueError(f"steps is {steps}, at least 1 is needed")
    return torch.linspace(1, 0, steps + 1, dtype=torch.float64)


def expand(level: Tensor, like: Tensor) -> Tensor:
    """(N,) -> (N, 1, ...) with as many dimensions as `like`."""
    return level.reshape(-1, *[1] * (like.ndim - 1))


def add_noise(clean: Tensor, noise: Tensor, level: Tensor, objective: Objective) -> Tensor:
    """Noisy samples at a level per node: clean, noise (N, ...), level (N,) -> (N, ...)."""
    alpha, sigma = alpha_sigma(expand(level, clean), objective)
    return alpha * clean + sigma * noise


def target(clean: Tensor, noise: Tensor, level: Tensor, objective: Objective) -> Tensor:
    """The training target: the noise (DDPM), alpha noise - sigma clean (v), or noise - clean (rectified flow)."""
    if objective == "noise":
        return noise
    if objective == "flow":
        return noise - clean
    alpha, sigma = alpha_sigma(expand(level, clean), objective)
    return alpha * noise - sigma * clean


def clean_from(output: Tensor, noisy: Tensor, level: Tensor, objective: Objective) -> Tensor:
    """The clean sample that a prediction of the target stands for."""
    if objective == "flow":
        return noisy - expand(level, noisy) * output
    alpha, sigma = alpha_sigma(expand(level, noisy), objective)
    if objective == "velocity":
        return alpha * noisy - sigma * output
    return (noisy - sigma * output) / alpha


def output_from(clean: Tensor, noisy: Tensor, level: Tensor, objective: Objective, floor: float = 0.05) -> Tensor:
    """The prediction that a clean sample stands for; levels below `floor` are treated as `floor` (1 / sigma grows)."""
    level = level.clamp_min(floor)
    if objective == "flow":
        return (noisy - clean) / expand(level, noisy)
    alpha, sigma = alpha_sigma(expand(level, noisy), objective)
    noise = (noisy - alpha * clean) / sigma
    return noise if objective == "noise" else alpha * noise - sigma * clean


def draw_levels(count: int, generator: torch.Generator, device: torch.device | str = "cpu") -> Tensor:
    """Training levels, one per scene, stratified over (0, 1] so that every batch sees the whole range: (count,)."""
    offset = torch.rand(1, generator=generator)
    level = (torch.arange(count) + offset) / count
    return level[torch.randperm(count, generator=generator)].clamp(1e-3, 1.0).to(device)


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


SAMPLERS: dict[Sampler, Callable[[Objective, Randomness | None], Step]] = {"ddim": ddim, "ancestral": ancestral}


def sample(
    sampler: Sampler, predict: Predict, x: Tensor, steps: int, objective: Objective, *, known: Tensor | None = None,
    known_mask: Tensor | None = None, generator: Randomness | None = None, progress: StepListener | None = None,
) -> Tensor:  # fmt: skip
    """Run a sampler by name.

    Arguments:
        x: (N, ...) start, standard normal noise.
        known, known_mask: (N, ...) values and (N,) bool, nodes that keep their values from first to last.
        generator: source of the noise that `ancestral` adds.
        progress: called with (steps done, steps) after every step.

    Raises ValueError where the sampler is not known, or steps < 1.
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
