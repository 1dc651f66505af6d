"""Samplers: from noise to a sample, any subset of nodes fixed at level 0.

A sampler makes one step: it takes x (N, ...) from the strengths of one level to those of another, given the clean
sample that the denoiser sees in it, which `predict(x, level)` returns for a noise level per node (N,).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from echomodel.arrays import Array, cast, device_of, full, kit
from echomodel.config import Objective, Sampler
from echomodel.progress import StepListener
from echomodel.randomness import Randomness, normal

if TYPE_CHECKING:
    from echomodel.graph import GraphEdit


def alpha_sigma(level: Array, objective: Objective) -> tuple[Array, Array]:
    """Signal and noise strength at `level` (any shape) in [0, 1].

    Rectified flow interpolates linearly, (1 - level, level). Noise and velocity prediction use the variance-preserving
    process of DDPM's linear betas in continuous time, beta from 0.1 to 20 (Song et al. 2021, Eq. 32).
    """
    if objective == "flow":
        return 1 - level, level
    xp, log_alpha = kit(level), -0.25 * level * level * (20.0 - 0.1) - 0.5 * level * 0.1
    return xp.exp(log_alpha), xp.sqrt(-xp.expm1(2 * log_alpha))


def expand(level: Array, like: Array) -> Array:
    """(N,) -> (N, 1, ...) with as many dimensions as `like`."""
    return level.reshape(-1, *[1] * (like.ndim - 1))


def clean_from(output: Array, noisy: Array, level: Array, objective: Objective) -> Array:
    """The clean sample that a prediction of the target stands for."""
    if objective == "flow":
        return noisy - expand(level, noisy) * output
    alpha, sigma = alpha_sigma(expand(level, noisy), objective)
    if objective == "velocity":
        return alpha * noisy - sigma * output
    return (noisy - sigma * output) / alpha


@dataclass(frozen=True, eq=False)
class Sampling:
    """How a model samples and what it is given: the keyword arguments of every `sample_...` of a `RoomModel`.

    Arguments:
        generator: source of all randomness, or one a scene.
        steps: of the sampler, None = the model's own; those that there are not raise ValueError.
        known, known_mask: what is sampled (boxes, distances or descriptions) of N nodes, and (N,) bool; where true it
            is given and comes back unchanged.
        edit: what was changed in the graph, None = nothing.
        progress: called with (steps done, steps).
    """

    generator: Randomness
    steps: int | None = None
    known: Any = None
    known_mask: Array | None = None
    edit: GraphEdit | None = None
    progress: StepListener | None = None


Predict = Callable[[Array, Array], Array]
Strengths = tuple[float, float]  # of signal and noise at a level
Step = Callable[..., Array]


def ddim(
    x: Array, clean: Array, start: Strengths, end: Strengths, generator: Randomness | None, temperature: Array
) -> Array:
    """Deterministic DDIM (Song et al. 2021, Eq. 12 with eta 0); with rectified flow this is the Euler method."""
    (a, s), (b, r) = start, end
    return b * clean + r * (x - a * clean) / s


def ancestral(
    x: Array, clean: Array, start: Strengths, end: Strengths, generator: Randomness | None, temperature: Array
) -> Array:
    """DDPM ancestral sampling from the posterior q(x_s | x_t, x0) (Ho et al. 2020, Eq. 7), its noise scaled: what a
    network is unsure of is noise as well, and below one both together are no more than there should be."""
    (a, s), (b, r) = start, end
    ratio = a / b
    between = s * s - ratio * ratio * r * r
    mean = (ratio * r * r * x + b * between * clean) / (s * s)
    if r == 0:
        return mean
    noise = cast(normal(x.shape, generator, device_of(x)), x)
    return mean + temperature * math.sqrt(max(between, 0.0)) * r / s * noise


SAMPLERS: dict[Sampler, Step] = {"ddim": ddim, "ancestral": ancestral}


def sample(
    sampler: Sampler, predict: Predict, x: Array, steps: int, objective: Objective, *, known: Array | None = None,
    known_mask: Array | None = None, generator: Randomness | None = None, progress: StepListener | None = None,
    temperature: Array = 1.0,
) -> Array:  # fmt: skip
    """Run a sampler by name.

    Arguments:
        x: (N, ...) start, standard normal noise.
        known, known_mask: (N, ...) values and (N,) bool, nodes that keep their values from first to last.
        generator: source of the noise that `ancestral` adds, `temperature` times: one number, or one for each column.
        progress: called with (steps done, steps) after every step.

    Raises ValueError where the sampler is not known, or steps < 1.
    """
    if sampler not in SAMPLERS:
        raise ValueError(f"sampler is {sampler!r}, allowed: {', '.join(SAMPLERS)}")
    if steps < 1:
        raise ValueError(f"steps is {steps}, at least 1 is needed")
    free = full(x, len(x), 1.0)
    fixed = None
    if known_mask is not None and known is not None:
        free = cast(~known_mask, x)
        fixed = expand(known_mask, x)
        x = kit(x).where(fixed, cast(known, x), x)
    for number, (start, end) in enumerate(pairwise(np.linspace(1, 0, steps + 1).tolist())):
        clean, before, after = predict(x, free * start), _strengths(start, objective), _strengths(end, objective)
        moved = SAMPLERS[sampler](x, clean, before, after, generator, temperature)
        x = moved if fixed is None else kit(x).where(fixed, x, moved)
        if progress is not None:
            progress(number + 1, steps)
    return x


def _strengths(level: float, objective: Objective) -> Strengths:
    alpha, sigma = alpha_sigma(level, objective)
    return float(alpha), float(sigma)
