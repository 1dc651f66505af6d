"""What a denoiser is trained to predict, and how a clean sample follows from its prediction."""

from __future__ import annotations

import torch
from torch import Tensor

from echomodel.config import Objective


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
