"""What a denoiser is trained on: noisy samples, and what it shall predict of them."""

from __future__ import annotations

from echomodel.arrays import Array, at_least
from echomodel.config import Objective
from echomodel.samplers import alpha_sigma, expand


def add_noise(clean: Array, noise: Array, level: Array, objective: Objective) -> Array:
    """Noisy samples at a level per node: clean, noise (N, ...), level (N,) -> (N, ...)."""
    alpha, sigma = alpha_sigma(expand(level, clean), objective)
    return alpha * clean + sigma * noise


def target(clean: Array, noise: Array, level: Array, objective: Objective) -> Array:
    """The training target: the noise (DDPM), alpha noise - sigma clean (v), or noise - clean (rectified flow)."""
    if objective == "noise":
        return noise
    if objective == "flow":
        return noise - clean
    alpha, sigma = alpha_sigma(expand(level, clean), objective)
    return alpha * noise - sigma * clean


def output_from(clean: Array, noisy: Array, level: Array, objective: Objective, floor: float = 0.05) -> Array:
    """The prediction that a clean sample stands for; levels below `floor` are treated as `floor` (1 / sigma grows)."""
    level = at_least(level, floor)
    if objective == "flow":
        return (noisy - clean) / expand(level, noisy)
    alpha, sigma = alpha_sigma(expand(level, noisy), objective)
    noise = (noisy - alpha * clean) / sigma
    return noise if objective == "noise" else alpha * noise - sigma * clean
