"""Noise schedules of the published model, in the precision in which it computes them."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TypeVar

import numpy as np
import torch
from torch import Tensor

Tables = TypeVar("Tables", "LayoutTables", "ShapeTables")


def on_device(tables: Tables, device: torch.device | str) -> Tables:
    """Tables all of whose tensors lie on a device."""
    return type(tables)(**{field.name: getattr(tables, field.name).to(device) for field in fields(tables)})


@dataclass(frozen=True, eq=False)
class LayoutTables:
    """DDPM tables of the layout branch, (T,) float32 each (EchoScene, section 3.3; Ho et al. 2020, equations 4 to 7).

    The cumulative product is taken in float64 and rounded; all the rest is computed in float32 from the rounded
    values, as the published code does: float64 tables differ in the last digits.
    """

    betas: Tensor
    alphas_cumprod: Tensor
    alphas_cumprod_prev: Tensor
    sqrt_alphas_cumprod: Tensor
    sqrt_one_minus_alphas_cumprod: Tensor
    sqrt_recip_alphas_cumprod: Tensor
    sqrt_recipm1_alphas_cumprod: Tensor
    posterior_variance: Tensor
    posterior_log_variance_clipped: Tensor
    posterior_mean_coef1: Tensor
    posterior_mean_coef2: Tensor

    @classmethod
    def linear(cls, start: float = 1e-4, end: float = 2e-2, steps: int = 1000) -> LayoutTables:
        """Tables of linearly growing betas."""
        betas64 = np.linspace(start, end, steps, dtype=np.float64)
        bar = torch.from_numpy(np.cumprod(1.0 - betas64)).float()
        betas, alphas = torch.from_numpy(betas64).float(), torch.from_numpy(1.0 - betas64).float()
        return cls._of(betas, alphas, bar)

    def to(self, device: torch.device | str) -> LayoutTables:
        """The same tables on a device."""
        return on_device(self, device)

    def spaced(self, count: int) -> tuple[LayoutTables, Tensor]:
        """Tables of `count` of these T steps, evenly spread, and which they are: (count,) int64 (Nichol and Dhariwal
        2021, section 4); raises ValueError for an impossible count."""
        total = len(self.betas)
        if not 1 <= count <= total:
            raise ValueError(f"layout steps is {count}, allowed: 1..{total}")
        if count == total:
            return self, torch.arange(total)
        steps = torch.linspace(total - 1, 0, count, dtype=torch.float64).round().long().flip(0)
        bar = self.alphas_cumprod[steps]
        alphas = bar / torch.cat([torch.ones(1), bar[:-1]])
        return self._of(1.0 - alphas, alphas, bar), steps

    @classmethod
    def _of(cls, betas: Tensor, alphas: Tensor, bar: Tensor) -> LayoutTables:
        previous = torch.cat([torch.ones(1), bar[:-1]])
        variance = betas * (1.0 - previous) / (1.0 - bar)
        return cls(
            betas=betas, alphas_cumprod=bar, alphas_cumprod_prev=previous, sqrt_alphas_cumprod=bar.sqrt(),
            sqrt_one_minus_alphas_cumprod=(1.0 - bar).sqrt(), sqrt_recip_alphas_cumprod=(1.0 / bar).sqrt(),
            sqrt_recipm1_alphas_cumprod=(1.0 / bar - 1.0).sqrt(), posterior_variance=variance,
            posterior_log_variance_clipped=variance.clamp_min(1e-20).log(),
            posterior_mean_coef1=betas * previous.sqrt() / (1.0 - bar),
            posterior_mean_coef2=(1.0 - previous) * alphas.sqrt() / (1.0 - bar),
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class ShapeTables:
    """Diffusion tables of the shape branch, (T,) float32 rounded from float64."""

    betas: Tensor
    alphas_cumprod: Tensor
    sqrt_alphas_cumprod: Tensor
    sqrt_one_minus_alphas_cumprod: Tensor

    def to(self, device: torch.device | str) -> ShapeTables:
        """The same tables on a device."""
        return on_device(self, device)

    @classmethod
    def scaled_linear(cls, start: float = 0.00085, end: float = 0.012, steps: int = 1000) -> ShapeTables:
        """Tables of betas whose square roots grow linearly."""
        betas = torch.linspace(start**0.5, end**0.5, steps, dtype=torch.float64).numpy() ** 2
        bar = np.cumprod(1.0 - betas, axis=0)
        tables = (betas, bar, np.sqrt(bar), np.sqrt(1.0 - bar))
        return cls(*(torch.from_numpy(table).float() for table in tables))


@dataclass(frozen=True, eq=False)
class DDIMGrid:
    """The steps of a deterministic DDIM run, ascending (Song et al. 2021, equation 12 with eta 0).

    Arguments:
        timesteps: (S,) int64.
        alphas: (S,) float32, cumulative alpha at each step.
        alphas_prev: (S,) float64, cumulative alpha after the update; the first is alpha at step 0, not 1, so that the
            last update of the published sampler leaves a little noise.
    """

    timesteps: Tensor
    alphas: Tensor
    alphas_prev: Tensor

    @classmethod
    def uniform(cls, tables: ShapeTables, count: int = 100) -> DDIMGrid:
        """`count` equally spaced steps, each one later than its multiple; raises ValueError for an impossible count."""
        total = len(tables.alphas_cumprod)
        if not 1 <= count <= total:
            raise ValueError(f"DDIM steps is {count}, allowed: 1..{total}")
        steps = np.arange(0, total, total // count) + 1
        steps = steps[steps < total]
        bar = tables.alphas_cumprod
        previous = np.array([float(bar[0]), *bar[torch.from_numpy(steps[:-1])].tolist()])
        return cls(torch.from_numpy(steps), bar[torch.from_numpy(steps)], torch.from_numpy(previous))
