"""The published model as one module: encoder, both denoisers and the autoencoder, schedules of noise in the precision
in which it computes them, sampling and joint training.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
import torch
from torch import Tensor, nn

from echomodel.boxes import Boxes, BoxStatistics
from echomodel.progress import StepListener
from echomodel.randomness import Randomness, normal
from echoscene.config import ReleasedConfig, UNetConfig
from echoscene.encoder import GraphEncoder, SceneGraphTensors, TripletGCN
from echoscene.unet import UNet, packed
from echoscene.vqvae import VQVAE


class Schedule:
    """Tables of diffusion, (T,) float32 each, under the names of the published code (Ho et al. 2020, equations 4 to 7).

    Arguments:
        betas, alphas, bar: (T,) the noise of each step, one less it, and the cumulative product of that; all tables are
            computed in their precision and then rounded, as the published code does: others differ in the last digits.
    """

    def __init__(self, betas: Tensor, alphas: Tensor, bar: Tensor) -> None:
        previous = torch.cat([torch.ones(1).to(bar), bar[:-1]])
        variance = betas * (1.0 - previous) / (1.0 - bar)
        self.betas, self.alphas_cumprod, self.alphas_cumprod_prev = betas.float(), bar.float(), previous.float()
        self.sqrt_alphas_cumprod = bar.sqrt().float()
        self.sqrt_one_minus_alphas_cumprod = (1.0 - bar).sqrt().float()
        self.sqrt_recip_alphas_cumprod = (1.0 / bar).sqrt().float()
        self.sqrt_recipm1_alphas_cumprod = (1.0 / bar - 1.0).sqrt().float()
        self.posterior_variance = variance.float()
        self.posterior_log_variance_clipped = variance.clamp_min(1e-20).log().float()
        self.posterior_mean_coef1 = (betas * previous.sqrt() / (1.0 - bar)).float()
        self.posterior_mean_coef2 = ((1.0 - previous) * alphas.sqrt() / (1.0 - bar)).float()

    @classmethod
    def linear(cls, start: float = 1e-4, end: float = 2e-2, steps: int = 1000) -> Schedule:
        """The layout branch's, with linearly growing betas; only the product is taken in float64 (EchoScene, 3.3)."""
        betas = torch.from_numpy(np.linspace(start, end, steps, dtype=np.float64))
        bar = torch.from_numpy(np.cumprod(1.0 - betas.numpy()))
        return cls(betas.float(), (1.0 - betas).float(), bar.float())

    @classmethod
    def scaled_linear(cls, start: float = 0.00085, end: float = 0.012, steps: int = 1000) -> Schedule:
        """The shape branch's, whose betas have linearly growing square roots; all in float64."""
        betas = torch.linspace(start**0.5, end**0.5, steps, dtype=torch.float64) ** 2
        return cls(betas, 1.0 - betas, torch.from_numpy(np.cumprod(1.0 - betas.numpy())))

    def spaced(self, count: int) -> tuple[Schedule, Tensor]:
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
        return Schedule(1.0 - alphas, alphas, bar), steps

    def ddim(self, count: int = 100) -> tuple[Tensor, Tensor, Tensor]:
        """The steps of a deterministic DDIM run, (S,) int64, ascending, equally spaced, each one later than its
        multiple; (S,) float32 the cumulative alpha at each, and (S,) float64 after its update.

        The first of the last is alpha at step 0, not 1, so that the published sampler leaves a little noise in the end.
        Raises ValueError for an impossible count.
        """
        total = len(self.alphas_cumprod)
        if not 1 <= count <= total:
            raise ValueError(f"DDIM steps is {count}, allowed: 1..{total}")
        steps = torch.arange(1, total, total // count)
        bar = self.alphas_cumprod
        return steps, bar[steps], torch.cat([bar[:1], bar[steps[:-1]]]).double()


# -- both branches: the noise of boxes and of shape latents, each by objects and relations (EchoScene 3.3, 3.4) ------


class Denoiser(UNet):
    """A U-Net with its echo, the context of its cross-attention; parameters are named as in the published files.

    Arguments:
        config: sizes; `time_in_echo=False` and `echo=False` are rows of the paper's table 4.
        code: makes the network whose code of a node's noisy state the others hear.
        out: width of the echo's output.
        others: as for `UNet`.
    """

    names: ClassVar[tuple[str, str, str]]  # of the parameters of code, time and graph convolution

    def __init__(
        self, dims: int, config: UNetConfig, code: Callable[[], nn.Module], out: int, *, extra: int = 0
    ) -> None:
        super().__init__(dims, config, extra)
        if not config.echo:
            return
        self.pred_embeddings = nn.Embedding(config.predicates, config.predicate)
        coded, timed, convolution = self.names
        self.add_module(coded, code())
        if config.time_in_echo:
            self.add_module(timed, nn.Linear(4 * config.width, config.code))
        nodes = config.objects + config.code * (2 if config.time_in_echo else 1)
        edges = config.predicate + config.edge_features
        self.add_module(convolution, TripletGCN(nodes, edges, config.hidden, config.layers, out, config.residual))

    def echo(self, x: Tensor, objects: Tensor, triples: Tensor, embedding: Tensor, edge_attr: Tensor | None) -> Tensor:
        """Exchange of the noisy states along the relations, (N, context); `embedding` (N, 4 width) is the time's."""
        config = self.config
        if not config.echo:
            return objects
        coded, timed, convolution = self.names
        nodes = [objects, getattr(self, coded)(x)]
        if config.time_in_echo:
            nodes.append(getattr(self, timed)(embedding))
        edges = self.pred_embeddings(triples[:, 1])
        edges = edges if edge_attr is None else torch.cat([edge_attr, edges], dim=1)
        return getattr(self, convolution)(torch.cat(nodes, dim=1), edges, triples[:, [0, 2]])[0]

    def forward(
        self, x: Tensor, objects: Tensor, triples: Tensor, t: Tensor, edge_attr: Tensor | None = None
    ) -> Tensor:
        """Predict the noise in boxes or latents.

        Arguments:
            x: noisy normalised boxes (N, 8) or latents (N, 3, 16, 16, 16) of all nodes, float32, floor and `_scene_`
                included.
            objects: (N, objects) float32, node conditions.
            triples: (E, 3) int64 [subject, predicate, object].
            t: (N,) int64, step of each node, 0..999.
            edge_attr: (E, edge_features) float32, further edge features (`paper` preset).

        Returns the noise, as large as x. What the graph is was looked at by `SceneGraphTensors.check`.
        """
        embedding = self.embed_time(t)
        context = self.echo(x, objects, triples, embedding, edge_attr)
        if self.config.conditioning == "concat":
            return self.denoise(torch.cat([x, context.reshape(-1, 1, *x.shape[2:])], dim=1), embedding, None)
        return self.denoise(x, embedding, context)


class LayoutNet(Denoiser):
    """The denoiser of boxes: `config.channels` is 8, [sx, sy, sz, px, py, pz, sin, cos]."""

    names = ("box_embeddings", "box_time_emb", "box_graph_cov")

    def __init__(self, config: UNetConfig) -> None:
        if config.conditioning != "crossattn":
            raise ValueError(f"layout branch: conditioning is {config.conditioning!r}, allowed: crossattn")
        super().__init__(1, config, lambda: nn.Linear(config.channels, config.code), config.context)


class ShapeUNet(Denoiser):
    """The denoiser of shape latents, under the published names less `diffusion_net.`.

    With `conditioning="concat"` (a row of table 4) the context has grid^3 numbers and becomes one more input channel.
    """

    names = ("shape_embeddings", "shape_time_emb", "shape_code_graph_cov")

    def __init__(self, config: UNetConfig) -> None:
        concat, volume = config.conditioning == "concat", config.grid**3
        super().__init__(3, config, self._coder, volume if concat else config.context, extra=int(concat))
        if not config.echo and concat and config.objects != volume:
            raise ValueError(f"concat without echo: objects is {config.objects}, expected {volume} (grid^3)")

    def _coder(self) -> nn.Module:
        flat = 64 * (((self.config.grid // 2) - 2) // 4 + 1) ** 3
        return nn.Sequential(
            nn.Conv3d(self.config.channels, 32, 3, padding=1),
            nn.MaxPool3d(2, 2),
            nn.Conv3d(32, 64, 3, padding=1),
            nn.MaxPool3d(2, stride=4),  # the published stride: three quarters of the voxels are never looked at
            nn.Flatten(),
            nn.Linear(flat, self.config.code),
        )


STRUCTURE = ("floor", "_scene_")  # nodes that take part in both diffusions and have no shape


@dataclass(frozen=True, eq=False)
class GraphChange:
    """The graph before an edit, and what it did (EchoScene, section 3.2); see `GraphEncoder.manipulate`."""

    before: SceneGraphTensors
    added: tuple[int, ...] = ()
    touched: tuple[int, ...] = ()


Conditions = tuple[Tensor, Tensor | None, Tensor | None]  # see `ReleasedModel.conditions`


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
            self.shape_df = nn.ModuleDict({"diffusion_net": ShapeUNet(config.shape)})
        if config.vqvae is not None:
            self.vqvae = VQVAE(config.vqvae)

    @cached_property
    def layout_tables(self) -> Schedule:
        """The published schedule of the layout branch."""
        return Schedule.linear()

    @cached_property
    def shape_tables(self) -> Schedule:
        """The published schedule of the shape branch."""
        return Schedule.scaled_linear()

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
        self, graph: SceneGraphTensors, change: GraphChange | None = None, generator: Randomness | None = None
    ) -> Conditions:
        """What the denoisers of layouts and of shapes see: (N, .) float32 per node each, and (E, .) per edge or None.

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
        return nodes, self.rel_s_mlp(nodes) if self.config.shape is not None else None, edge_attr

    @torch.no_grad()
    def sample_layout(
        self, graph: SceneGraphTensors, *, generator: Randomness, steps: int | None = None,
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
        nodes, _, edge_attr = self.eval().conditions(graph, change, generator)
        tables, chosen = self.layout_tables.spaced(steps or len(self.layout_tables.betas))
        chosen = chosen.to(device)

        fast = packed(net) if device.type == "cpu" else net

        def denoise(x: Tensor, t: Tensor) -> Tensor:
            return fast(x, nodes, graph.triples, chosen[t], edge_attr)

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
        self, graph: SceneGraphTensors, *, generator: Randomness, steps: int = 100,
        change: GraphChange | None = None, progress: StepListener | None = None,
    ) -> Tensor:  # fmt: skip
        """Shape latents of all nodes by deterministic DDIM (EchoScene, section 3.4); decode them with `vqvae.decode`.

        All nodes start from one draw, as in the published code; the paper's text takes one for each.

        Arguments:
            graph: one or many scenes. generator: source of all randomness. steps: DDIM steps.
            change: as `conditions`. progress: called with (steps done, steps).

        Returns (N, 3, 16, 16, 16) float32; floor and `_scene_` nodes have latents that mean nothing.
        Raises ValueError for no shape branch, or a graph that cannot be used.
        """
        if self.config.shape is None:
            raise ValueError("this model has no shape branch")
        graph, change = graph.to(self.device), self._here(change)
        _, nodes, edge_attr = self.eval().conditions(graph, change, generator)
        count, grid = len(graph.classes), self.config.shape.grid
        drawn = normal((1, self.config.shape.channels, grid, grid, grid), generator, self.device)
        start = drawn.expand(count, -1, -1, -1, -1).contiguous()

        def denoise(x: Tensor, t: Tensor) -> Tensor:
            return self.shape_df["diffusion_net"](x, nodes, graph.triples, t, edge_attr)

        return last(ddim(denoise, start, self.shape_tables.ddim(steps)), progress, steps)

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
        for node in (~torch.isfinite(boxes)).any(1).nonzero()[:1, 0].tolist():
            raise ValueError(f"box of node {node} is not finite")
        nodes, shapes, edges = self.conditions(graph, change, generator)
        count = len(self.layout_tables.betas)
        t = torch.randint(count, (int(scene.max()) + 1,), generator=generator).to(device)[scene]
        noise = normal(boxes.shape, generator, device)
        losses = layout_loss(self.layout_net, boxes, nodes, graph.triples, t, noise, self.layout_tables, edges)
        losses["layout"] = losses["loss"]
        if latents is not None and shapes is not None:
            kept, triples = node_budget(graph.triples, scene, budget)
            inside = (graph.triples[:, 0] < kept) & (graph.triples[:, 2] < kept)
            edge_attr = None if edges is None else edges[inside]
            t = torch.randint(count, (kept,), generator=generator).to(device)
            clean = latents[:kept].to(device)
            noise = normal(clean.shape, generator, device)
            context, tables = shapes[:kept], self.shape_tables
            net = self.shape_df["diffusion_net"]
            losses["shape"] = shape_loss(net, clean, context, triples, t, noise, tables, edge_attr)
            losses["loss"] = losses["layout"] + losses["shape"]
        return losses


Denoise = Callable[[Tensor, Tensor], Tensor]  # (state (N, ...), step (N,) int64) -> noise (N, ...)


def ancestral(
    denoise: Denoise, x: Tensor, tables: Schedule, *, noise: Callable[[int], Tensor], variance: str = "posterior"
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


def ddim(denoise: Denoise, x: Tensor, grid: tuple[Tensor, Tensor, Tensor]) -> Iterator[tuple[int, Tensor]]:
    """Deterministic DDIM (Song et al. 2021, equation 12 with eta 0), as the shape branch samples.

    Arguments:
        denoise: the network with everything but state and step bound.
        x: (N, 3, d, h, w) float32, start; the published code repeats one draw for all nodes. grid: `Schedule.ddim`.

    Yields:
        (step, state after its update).
    """
    for step, alpha, previous in reversed(list(zip(*grid, strict=True))):
        predicted = denoise(x, torch.full((len(x),), int(step), dtype=torch.int64, device=x.device))
        alpha, previous = alpha.to(x), previous.to(x)
        clean = (x - (1.0 - alpha).sqrt() * predicted) / alpha.sqrt()
        x = previous.sqrt() * clean + (1.0 - previous).sqrt() * predicted
        yield int(step), x


def last(states: Iterator[tuple[int, Tensor]], progress: StepListener | None, steps: int) -> Tensor:
    """The final state of a sampler of one step or more; `progress` is called with (steps done, `steps`)."""
    for done, (_, state) in enumerate(states, start=1):  # noqa: B007
        if progress is not None:
            progress(done, steps)
    return state


def noised(clean: Tensor, t: Tensor, noise: Tensor, tables: Schedule) -> Tensor:
    """q(x_t | x_0): sqrt(abar_t) x_0 + sqrt(1 - abar_t) noise, `t` (N,) int64 per node."""
    shape = (-1,) + (1,) * (clean.ndim - 1)
    signal, spread = (
        table.to(t.device)[t].reshape(shape)
        for table in (tables.sqrt_alphas_cumprod, tables.sqrt_one_minus_alphas_cumprod)
    )
    return signal * clean + spread * noise


def layout_loss(
    net: Callable[..., Tensor], boxes: Tensor, objects: Tensor, triples: Tensor, t: Tensor, noise: Tensor,
    tables: Schedule, edge_attr: Tensor | None = None,
) -> dict[str, Tensor]:  # fmt: skip
    """Noise prediction loss of the layout branch (EchoScene, equation 4).

    Arguments:
        net: `LayoutNet`.
        boxes: (N, 8) float32, normalised boxes.
        objects, triples, edge_attr: as `LayoutNet.forward`.
        t: (N,) int64; the published training draws one step per scene.
        noise: (N, 8) float32.
        tables: schedule.

    Returns `loss`, and its parts `size`, `trans`, `angle` (scalars), each the mean over the nodes.
    """
    error = (net(noised(boxes, t, noise, tables), objects, triples, t, edge_attr) - noise).square()
    size, trans, angle = error[:, :3], error[:, 3:6], error[:, 6:]
    return {"loss": error.mean(1).mean(), "size": size.mean(), "trans": trans.mean(), "angle": angle.mean()}


def shape_loss(
    net: Callable[..., Tensor], latents: Tensor, objects: Tensor, triples: Tensor, t: Tensor, noise: Tensor,
    tables: Schedule, edge_attr: Tensor | None = None,
) -> Tensor:  # fmt: skip
    """Noise prediction loss of the shape branch (EchoScene, equation 6): mean square over everything, a scalar.

    Arguments:
        net: `ShapeUNet`.
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
