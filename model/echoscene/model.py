"""The published model as one module: encoder, both denoisers and the autoencoder, schedules of noise in the precision
in which it computes them, sampling and joint training.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
import torch
from torch import Tensor, nn

from echomodel.boxes import Boxes, BoxStatistics
from echomodel.progress import StepListener
from echomodel.randomness import normal
from echoscene.config import ReleasedConfig
from echoscene.denoisers import LayoutNet, ShapeNet
from echoscene.encoder import GraphEncoder, SceneGraphTensors
from echoscene.unet import packed
from echoscene.vqvae import VQVAE

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


STRUCTURE = ("floor", "_scene_")  # nodes that take part in both diffusions and have no shape


@dataclass(frozen=True, eq=False)
class GraphChange:
    """The graph before an edit, and what it did (EchoScene, section 3.2); see `GraphEncoder.manipulate`."""

    before: SceneGraphTensors
    added: tuple[int, ...] = ()
    touched: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class Conditions:
    """What the denoisers see of a graph: (N, .) float32 per node for each branch, (E, .) per edge or None."""

    layout: Tensor
    shape: Tensor | None
    edge_attr: Tensor | None


class ReleasedModel(GraphEncoder):
    """The parts of the published model that `config` names, under the published parameter names.

    Arguments:
        config: sizes and preset; `config.encoder` must be there.
        classes: class names in the order of their ids; None = unknown.
        statistics: normalisation of boxes; None = unknown, boxes cannot be sampled then.

    `text_encoder` is the name of the encoder of its text features (`echomodel.text`); None = CLIP, as published.
    """

    text_encoder: str | None = None

    def __init__(
        self, config: ReleasedConfig, classes: tuple[str, ...] | None = None, statistics: BoxStatistics | None = None
    ) -> None:
        encoder = config.encoder
        if encoder is None:
            raise ValueError("released model: config.encoder is None, its object embedding conditions both branches")
        super().__init__(encoder, branches=("s", "l") if config.shape else ("l",))
        self.config, self.classes, self.statistics = config, classes, statistics
        latent = 2 * encoder.node if config.preset == "paper" else encoder.node
        if config.layout is not None:
            if config.layout.objects != latent:
                raise ValueError(f"layout branch: objects is {config.layout.objects}, the encoder gives {latent}")
            self.LayoutDiff = nn.ModuleDict({"df": nn.ModuleDict({"model": LayoutNet(config.layout)})})
        if config.shape is not None:
            out = config.shape.objects
            inner = (latent + out) // 2
            parts: list[nn.Module] = [nn.Linear(latent, inner), nn.BatchNorm1d(inner), nn.ReLU(), nn.Linear(inner, out)]
            self.rel_s_mlp = nn.Sequential(*parts)
            self.shape_df = ShapeNet(config.shape)
        if config.vqvae is not None:
            self.vqvae = VQVAE(config.vqvae)

    @cached_property
    def layout_tables(self) -> LayoutTables:
        """The published schedule of the layout branch."""
        return LayoutTables.linear()

    @cached_property
    def shape_tables(self) -> ShapeTables:
        """The published schedule of the shape branch."""
        return ShapeTables.scaled_linear()

    @property
    def layout_net(self) -> LayoutNet:
        """The layout denoiser; raises ValueError if the model has none."""
        if self.config.layout is None:
            raise ValueError("this model has no layout branch")
        return self.LayoutDiff["df"]["model"]  # type: ignore[index, return-value]

    @property
    def device(self) -> torch.device:
        """Where the weights are."""
        return next(self.parameters()).device

    def conditions(
        self, graph: SceneGraphTensors, change: GraphChange | None = None, generator: torch.Generator | None = None
    ) -> Conditions:
        """What the denoisers are conditioned on.

        `released`: the object embedding alone. The published code also runs encoder and manipulator and then
        overwrites their result, so an edit there is a fresh sample of the edited graph; `change` has no effect.
        `paper`: object embedding and manipulated latent, and text features on the edges.

        Arguments:
            graph: the graph to generate. change: the graph that it came from; None = no edit.
            generator: source of the change flags.

        Raises ValueError for a graph that cannot be used, or one without edge texts for the `paper` preset.
        """
        graph.check(self.encoder_config)
        nodes, _ = self.embed(graph)
        edge_attr = None
        if self.config.preset == "paper":
            if graph.edge_text is None:
                raise ValueError("the paper preset needs text features on edges, edge_text is None")
            edge_attr = graph.edge_text
            latent, _ = self.encode(change.before if change else graph)
            added, touched = (change.added, change.touched) if change else ((), ())
            latent, _, _ = self.manipulate(latent, graph, added=added, touched=touched, generator=generator)
            nodes = torch.cat([nodes, latent], dim=1)
        return Conditions(nodes, self.rel_s_mlp(nodes) if self.config.shape is not None else None, edge_attr)

    @torch.no_grad()
    def sample_layout(
        self, graph: SceneGraphTensors, *, generator: torch.Generator, steps: int | None = None,
        change: GraphChange | None = None, progress: StepListener | None = None,
    ) -> Boxes:  # fmt: skip
        """Boxes of all nodes by ancestral steps (EchoScene, section 3.3); sizes can come out negative.

        Arguments:
            graph: one or many scenes. generator: source of all randomness. change: as `conditions`.
            steps: how many of the published 1,000 steps, None = all.
            progress: called with (steps done, steps).

        Returns N boxes in the scene's own frame, metres and radians.
        Raises ValueError for no layout branch, no box statistics, more steps than there are, or a graph that cannot be
        used.
        """
        net, statistics = self.layout_net, self.statistics
        if statistics is None:
            raise ValueError("box statistics are missing: convert the checkpoint with --bounds FILE")
        graph, change, device = graph.to(self.device), self._here(change), self.device
        conditions = self.eval().conditions(graph, change, generator)
        tables, chosen = self.layout_tables.spaced(steps or len(self.layout_tables.betas))
        tables, chosen = tables.to(device), chosen.to(device)

        fast = packed(net) if device.type == "cpu" else net

        def denoise(x: Tensor, t: Tensor) -> Tensor:
            return fast(x, conditions.layout, graph.triples, chosen[t], conditions.edge_attr)

        shape = (len(graph.classes), net.config.channels)
        start = normal(shape, generator, device)
        # The paper's text takes sigma_t^2 = beta_t; the published code takes the posterior variance.
        variance = "beta" if self.config.preset == "paper" else "posterior"
        states = ancestral(
            denoise, start, tables, noise=lambda step: normal(shape, generator, device), variance=variance
        )
        return Boxes.decode(last(states, progress, len(chosen)), statistics.scale())

    @torch.no_grad()
    def sample_shapes(
        self, graph: SceneGraphTensors, *, generator: torch.Generator, steps: int = 100, shared_noise: bool = True,
        change: GraphChange | None = None, progress: StepListener | None = None,
    ) -> Tensor:  # fmt: skip
        """Shape latents of all nodes by deterministic DDIM (EchoScene, section 3.4); decode them with `vqvae.decode`.

        Arguments:
            graph: one or many scenes. generator: source of all randomness. steps: DDIM steps.
            shared_noise: all nodes start from one draw (published code) rather than from one each (paper).
            change: as `conditions`. progress: called with (steps done, steps).

        Returns (N, 3, 16, 16, 16) float32; floor and `_scene_` nodes have latents that mean nothing.
        Raises ValueError for no shape branch, or a graph that cannot be used.
        """
        if self.config.shape is None:
            raise ValueError("this model has no shape branch")
        graph, change = graph.to(self.device), self._here(change)
        conditions = self.eval().conditions(graph, change, generator)
        count, grid = len(graph.classes), self.config.shape.grid
        drawn = normal(
            (1 if shared_noise else count, self.config.shape.channels, grid, grid, grid), generator, self.device
        )
        start = drawn.expand(count, -1, -1, -1, -1).contiguous()

        def denoise(x: Tensor, t: Tensor) -> Tensor:
            return self.shape_df(x, conditions.shape, graph.triples, t, conditions.edge_attr)

        return last(ddim(denoise, start, DDIMGrid.uniform(self.shape_tables, steps)), progress, steps)

    def _here(self, change: GraphChange | None) -> GraphChange | None:
        return None if change is None else replace(change, before=change.before.to(self.device))

    def training_losses(
        self, graph: SceneGraphTensors, scene: Tensor, boxes: Tensor, latents: Tensor | None, *,
        generator: torch.Generator, change: GraphChange | None = None, budget: int = 64,
    ) -> dict[str, Tensor]:  # fmt: skip
        """Losses of one joint training step over both branches (EchoScene, section 3.5); `loss` is their sum.

        Arguments:
            graph: ground truth scenes, N nodes; `change.before` is the pseudo graph of the inverse strategy.
            scene: (N,) int64, scene of each node.
            boxes: (N, 8) float32, normalised. latents: (N, 3, 16, 16, 16) float32 encoder output, None = layout only.
            generator: source of steps, noise and change flags. change: as `conditions`. budget: of `node_budget`.
        """
        device = self.device
        graph, change, scene, boxes = graph.to(device), self._here(change), scene.to(device), boxes.to(device)
        conditions = self.conditions(graph, change, generator)
        count = len(self.layout_tables.betas)
        t = torch.randint(count, (int(scene.max()) + 1,), generator=generator).to(device)[scene]
        noise = normal(boxes.shape, generator, device)
        losses = layout_loss(
            self.layout_net, boxes, conditions.layout, graph.triples, t, noise, self.layout_tables.to(device),
            conditions.edge_attr,
        )  # fmt: skip
        losses["layout"] = losses["loss"]
        if latents is not None and conditions.shape is not None:
            kept, triples = node_budget(graph.triples, scene, budget)
            inside = (graph.triples[:, 0] < kept) & (graph.triples[:, 2] < kept)
            edge_attr = None if conditions.edge_attr is None else conditions.edge_attr[inside]
            t = torch.randint(count, (kept,), generator=generator).to(device)
            clean = latents[:kept].to(device)
            noise = normal(clean.shape, generator, device)
            tables = self.shape_tables.to(device)
            given = conditions.shape[:kept]
            losses["shape"] = shape_loss(self.shape_df, clean, given, triples, t, noise, tables, edge_attr)
            losses["loss"] = losses["layout"] + losses["shape"]
        return losses


Denoiser = Callable[[Tensor, Tensor], Tensor]  # (state (N, ...), step (N,) int64) -> noise (N, ...)


def ancestral(
    denoise: Denoiser, x: Tensor, tables: LayoutTables, *, noise: Callable[[int], Tensor], variance: str = "posterior"
) -> Iterator[tuple[int, Tensor]]:
    """Ancestral sampling of the layout branch (Ho et al. 2020, algorithm 2; EchoScene, section 3.3).

    Arguments:
        denoise: the network with everything but state and step bound.
        x: (N, 8) float32, state before the first step.
        tables: schedule.
        noise: draws (N, 8) float32 for a step; called at step 0 too, where its value is not used, so that the random
            stream is the published one.
        variance: `posterior` (published code) or `beta` (the paper's text).

    Yields:
        (step, state after its update).
    """
    if variance not in ("posterior", "beta"):
        raise ValueError(f"variance is {variance!r}, allowed: posterior, beta")
    log_variance = tables.posterior_log_variance_clipped if variance == "posterior" else tables.betas.log()
    for step in reversed(range(len(tables.betas))):
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
    net: Callable[..., Tensor], boxes: Tensor, objects: Tensor, triples: Tensor, t: Tensor, noise: Tensor,
    tables: LayoutTables, edge_attr: Tensor | None = None,
) -> dict[str, Tensor]:  # fmt: skip
    """Noise prediction loss of the layout branch (EchoScene, equation 4).

    Arguments:
        net: `LayoutNet`.
        boxes: (N, 8) float32, normalised boxes (or (N, 7) with the angle in radians in the last place).
        objects, triples, edge_attr: as `LayoutNet.forward`.
        t: (N,) int64; the published training draws one step per scene.
        noise: (N, 8) float32.
        tables: schedule.

    Returns `loss`, and its parts `size`, `trans`, `angle` (scalars), each the mean over the nodes.
    """
    if boxes.shape[1] == 7:
        boxes = torch.cat([boxes[:, :6], boxes[:, 6:].sin(), boxes[:, 6:].cos()], dim=1)
    error = (net(noised(boxes, t, noise, tables), objects, triples, t, edge_attr) - noise).square()
    size, trans, angle = error[:, :3], error[:, 3:6], error[:, 6:]
    return {"loss": error.mean(1).mean(), "size": size.mean(), "trans": trans.mean(), "angle": angle.mean()}


def shape_loss(
    net: Callable[..., Tensor], latents: Tensor, objects: Tensor, triples: Tensor, t: Tensor, noise: Tensor,
    tables: ShapeTables, edge_attr: Tensor | None = None,
) -> Tensor:  # fmt: skip
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

    `triples`: (E, 3) int64; scene: (N,) int64, scene of each node; budget: largest number of nodes.

    Returns the number of nodes kept and the (K, 3) triples among them. The published code stops at the first scene that
    does not fit, although a later one might.
    Raises ValueError where the first scene alone exceeds the budget.
    """
    ends = torch.bincount(scene).cumsum(0)
    if int(ends[0]) > budget:
        raise ValueError(f"first scene has {int(ends[0])} nodes, more than the budget of {budget}")
    kept = int(ends[ends <= budget][-1])
    return kept, triples[(triples[:, 0] < kept) & (triples[:, 2] < kept)]
