"""Noise schedules over a continuous level in [0, 1]: x_level = alpha x0 + sigma noise."""

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
