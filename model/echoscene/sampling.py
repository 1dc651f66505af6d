"""Sampling and training objectives of the published model, as pure functions."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import torch
from torch import Tensor

from echomodel.progress import StepListener
from echoscene.tables import DDIMGrid, LayoutTables, ShapeTables

Denoiser = Callable[[Tensor, Tensor], Tensor]  # (state (N, ...), step (N,) int64) -> noise (N, ...)


def ancestral(
    denoise: Denoiser,
    x: Tensor,
    tables: LayoutTables,
    *,
    noise: Callable[[int], Tensor],
    start: int | None = None,
    stop: int = 0,
    variance: str = "posterior",
) -> Iterator[tuple[int, Tensor]]:
    """Ancestral sampling of the layout branch (Ho et al. 2020, algorithm 2; EchoScene, section 3.3).

    Arguments:
        denoise: the network with everything but state and step bound.
        x: (N, 8) float32, state before the first step.
        tables: schedule.
        noise: draws (N, 8) float32 for a step; called at step 0 too, where its value is not used, so that the random
            stream is the published one.
        start, stop: first and last step, both included; default T - 1 and 0.
        variance: `posterior` (published code) or `beta` (the paper's text).

    Yields:
        (step, state after its update).
    """
    if variance not in ("posterior", "beta"):
        raise ValueError(f"variance is {variance!r}, allowed: posterior, beta")
    log_variance = tables.posterior_log_variance_clipped if variance == "posterior" else tables.betas.log()
    start = len(tables.betas) - 1 if start is None else start
    for step in range(start, stop - 1, -1):
        predicted = denoise(x, torch.full((len(x),), step, dtype=torch.int64, device=x.device))
        # No clamp: the published sampler leaves the estimate of the clean box unbounded.
        clean = tables.sqrt_recip_alphas_cumprod[step] * x - tables.sqrt_recipm1_alphas_cumprod[step] * predicted
        mean = tables.posterior_mean_coef1[step] * clean + tables.posterior_mean_coef2[step] * x
        drawn = noise(step)
        x = mean + torch.exp(0.5 * log_variance[step]) * drawn if step else mean
        yield step, x


def ddim(denoise: Denoiser, x: Tensor, grid: DDIMGrid) -> Iterator[tuple[int, Tensor]]:
    """Deterministic DDIM (Song et al. 2021, equation 12 with eta 0), as the shape branch samples.

    Arguments:
        denoise: the network with everything but state and step bound.
        x: (N, 3, d, h, w) float32, start; the published code repeats one draw for all nodes.
        grid: steps.

    Yields:
        (step, state after its update).
    """
    for number in range(len(grid.timesteps) - 1, -1, -1):
        step = int(grid.timesteps[number])
        predicted = denoise(x, torch.full((len(x),), step, dtype=torch.int64, device=x.device))
        alpha = torch.full((1,) * x.ndim, float(grid.alphas[number]), device=x.device)
        previous = torch.full((1,) * x.ndim, float(grid.alphas_prev[number]), device=x.device)
        clean = (x - (1.0 - alpha).sqrt() * predicted) / alpha.sqrt()
        x = previous.sqrt() * clean + (1.0 - previous).sqrt() * predicted
        yield step, x


def last(states: Iterator[tuple[int, Tensor]], progress: StepListener | None = None, steps: int = 0) -> Tensor:
    """The final state of a sampler; `progress` is called with (steps done, `steps`)."""
    final = None
    for done, (_, state) in enumerate(states, start=1):
        final = state
        if progress is not None:
            progress(done, steps)
    if final is None:
        raise ValueError("sampler made no step")
    return final


def noised(clean: Tensor, t: Tensor, noise: Tensor, tables: LayoutTables | ShapeTables) -> Tensor:
    """q(x_t | x_0): sqrt(abar_t) x_0 + sqrt(1 - abar_t) noise, `t` (N,) int64 per node."""
    shape = (-1,) + (1,) * (clean.ndim - 1)
    signal = tables.sqrt_alphas_cumprod[t].reshape(shape)
    return signal * clean + tables.sqrt_one_minus_alphas_cumprod[t].reshape(shape) * noise


def layout_loss(
    net: Callable[..., Tensor],
    boxes: Tensor,
    objects: Tensor,
    triples: Tensor,
    t: Tensor,
    noise: Tensor,
    tables: LayoutTables,
    edge_attr: Tensor | None = None,
) -> dict[str, Tensor]:
    """Noise prediction loss of the layout branch (EchoScene, equation 4).

    Arguments:
        net: `LayoutNet`.
        boxes: (N, 8) float32, normalised boxes (or (N, 7) with the angle in radians in the last place).
        objects, triples, edge_attr: as `LayoutNet.forward`.
        t: (N,) int64; the published training draws one step per scene.
        noise: (N, 8) float32.
        tables: schedule.

    Returns:
        `loss`, and its parts `size`, `trans`, `angle` (scalars), each the mean over the nodes.
    """
    if boxes.shape[1] == 7:
        boxes = torch.cat([boxes[:, :6], boxes[:, 6:].sin(), boxes[:, 6:].cos()], dim=1)
    error = (net(noised(boxes, t, noise, tables), objects, triples, t, edge_attr) - noise).square()
    size, trans, angle = error[:, :3], error[:, 3:6], error[:, 6:]
    return {"loss": error.mean(1).mean(), "size": size.mean(), "trans": trans.mean(), "angle": angle.mean()}


def shape_loss(
    net: Callable[..., Tensor],
    latents: Tensor,
    objects: Tensor,
    triples: Tensor,
    t: Tensor,
    noise: Tensor,
    tables: ShapeTables,
    edge_attr: Tensor | None = None,
) -> Tensor:
    """Noise prediction loss of the shape branch (EchoScene, equation 6): mean square over everything, a scalar.

    Arguments:
        net: `ShapeNet`.
        latents: (N, 3, 16, 16, 16) float32, encoder output before quantisation, not scaled.
        t: (N,) int64; the published training draws one step per object.
        others: as `layout_loss`.
    """
    return (net(noised(latents, t, noise, tables), objects, triples, t, edge_attr) - noise).square().mean()


def node_budget(triples: Tensor, scene: Tensor, budget: int = 64) -> tuple[int, Tensor]:
    """The shape branch's batch: whole scenes in order while their nodes fit (EchoScene, supplement on batch size).

    Arguments:
        triples: (E, 3) int64; scene: (N,) int64, scene of each node; budget: largest number of nodes.

    Returns:
        The number of nodes kept and the (K, 3) triples among them. The published code stops at the first scene that
        does not fit, although a later one might.

    Raises:
        ValueError: the first scene alone exceeds the budget.
    """
    ends = torch.bincount(scene).cumsum(0)
    if int(ends[0]) > budget:
        raise ValueError(f"first scene has {int(ends[0])} nodes, more than the budget of {budget}")
    kept = int(ends[ends <= budget][-1])
    return kept, triples[(triples[:, 0] < kept) & (triples[:, 2] < kept)]
