"""Shape denoiser: a small transformer per object on latent patches, joined by an echo at every step (EchoScene 3.4)."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from echomodel.compact.autoencoder import GRID, from_patches, to_patches
from echomodel.compact.echo import EchoLayer, level_features
from echomodel.compact.pairs import Pairs
from echomodel.config import CompactConfig
from echomodel.graph import GraphBatch

POOL = 4


@dataclass(frozen=True, eq=False)
class ShapeContext:
    """What stays the same over all steps: `nodes` (N, width), `echo_nodes` (N, echo width), pairs."""

    nodes: Tensor
    echo_nodes: Tensor
    pairs: Pairs


class ShapeDenoiser(nn.Module):
    """Predicts the objective's target, or the clean latent, of every object; each has its own level, 0 = known.

    Shapes:
        latents (N, C, G, G, G), level (N,) in [0, 1], `ShapeContext` -> (N, C, G, G, G)
    """

    def __init__(self, config: CompactConfig) -> None:
        super().__init__()
        shape, width, channels = config.shape, config.shape.width, config.autoencoder.channels
        self.settings = shape
        cells = GRID // config.autoencoder.patch
        tokens, values = (cells // shape.patch) ** 3, channels * shape.patch**3
        self.category = nn.Embedding(config.categories, width)
        self.size = nn.Sequential(nn.Linear(3, width), nn.SiLU(), nn.Linear(width, width))
        self.latent = nn.Linear(config.latent.width, width)
        self.level = nn.Sequential(nn.Linear(64, width), nn.SiLU(), nn.Linear(width, width))
        self.token = nn.Linear(values, width)
        self.place = nn.Parameter(torch.randn(tokens, width) * 0.02)
        echo = shape.echo_width
        self.echo_node = nn.Linear(width, echo)
        self.echo_code = nn.Linear(channels * POOL**3, echo)
        self.echo_level = nn.Linear(64, echo) if shape.echo_time else None
        self.echo_layers = nn.ModuleList(EchoLayer(echo, config.predicates) for _ in range(shape.echo_layers))
        self.echo_out = nn.Sequential(nn.LayerNorm(echo), nn.Linear(echo, width))
        self.concat = nn.Linear(2 * width, width) if shape.conditioning == "concat" else None
        self.blocks = nn.ModuleList(
            _Block(width, shape.heads, cross=shape.conditioning == "cross") for _ in range(shape.layers)
        )
        self.norm = nn.LayerNorm(width, elementwise_affine=False)
        self.scale_shift = nn.Linear(width, 2 * width)
        self.head = nn.Linear(width, values)
        nn.init.normal_(self.category.weight, std=0.3)
        for layer in (self.scale_shift, self.head):
            nn.init.zeros_(layer.weight)
            nn.init.zeros_(layer.bias)

    def context(self, graph: GraphBatch, size: Tensor, pairs: Pairs, latent: Tensor) -> ShapeContext:
        """Everything that does not depend on the step.

        Arguments:
            graph: N nodes.
            size: (N, 3) float32, extents of the boxes in metres.
            pairs: the merged relations of the graph.
            latent: (N, latent width), output of the graph manipulator.
        """
        nodes = self.category(graph.category) + self.size(size.clamp_min(0.01).log()) + self.latent(latent)
        return ShapeContext(nodes, self.echo_node(nodes), pairs)

    def forward(self, x: Tensor, level: Tensor, context: ShapeContext) -> Tensor:
        n, channels, cells = x.shape[0], x.shape[1], x.shape[2]
        patch = self.settings.patch
        sinusoids = level_features(level)
        condition = nn.functional.silu(context.nodes + self.level(sinusoids))
        heard = self._echo(x, sinusoids, context) if self.settings.echo else torch.zeros_like(context.nodes)
        cut = to_patches(x.reshape(n * channels, cells, cells, cells), patch)
        tokens = cut.reshape(n, channels * patch**3, -1).transpose(1, 2)
        h = self.token(tokens) + self.place
        if self.concat is not None:
            h = self.concat(torch.cat([h, heard[:, None].expand_as(h)], dim=2))
        told = torch.stack([heard, context.nodes, condition], dim=1)
        for block in self.blocks:
            h = block(h, condition, told)
        scale, shift = self.scale_shift(condition)[:, None].chunk(2, dim=2)
        out = self.head(self.norm(h) * (1 + scale) + shift)
        side = cells // patch
        out = out.transpose(1, 2).reshape(n * channels, patch**3, side, side, side)
        return from_patches(out, patch).reshape(x.shape)

    def _echo(self, x: Tensor, sinusoids: Tensor, context: ShapeContext) -> Tensor:
        """What each object hears of the others' current shapes: (N, width)."""
        code = nn.functional.adaptive_avg_pool3d(x, POOL).flatten(1)
        nodes = context.echo_nodes + self.echo_code(code)
        if self.echo_level is not None:
            nodes = nodes + self.echo_level(sinusoids)
        for layer in self.echo_layers:
            nodes = layer(nodes, context.pairs)
        return self.echo_out(nodes)


class _Block(nn.Module):
    """Self-attention, cross-attention to the told tokens, perceptron; all gated by the condition (Peebles 2023)."""

    def __init__(self, width: int, heads: int, *, cross: bool) -> None:
        super().__init__()
        self.heads = heads
        self.norm = nn.LayerNorm(width, elementwise_affine=False)
        self.modulation = nn.Linear(width, 6 * width)
        self.qkv = nn.Linear(width, 3 * width)
        self.attended = nn.Linear(width, width)
        self.cross_q = nn.Linear(width, width) if cross else None
        self.cross_kv = nn.Linear(width, 2 * width) if cross else None
        self.cross_out = nn.Linear(width, width) if cross else None
        self.mlp = nn.Sequential(nn.Linear(width, 4 * width), nn.GELU(approximate="tanh"), nn.Linear(4 * width, width))
        nn.init.zeros_(self.modulation.weight)
        nn.init.zeros_(self.modulation.bias)

    def forward(self, h: Tensor, condition: Tensor, told: Tensor) -> Tensor:
        scale_a, shift_a, gate_a, scale_m, shift_m, gate_m = self.modulation(condition)[:, None].chunk(6, dim=2)
        normed = self.norm(h) * (1 + scale_a) + shift_a
        q, k, v = (self._split(part) for part in self.qkv(normed).chunk(3, dim=2))
        attended = nn.functional.scaled_dot_product_attention(q, k, v)
        h = h + (1 + gate_a) * self.attended(self._merge(attended))
        if self.cross_q is not None and self.cross_kv is not None and self.cross_out is not None:
            k, v = (self._split(part) for part in self.cross_kv(told).chunk(2, dim=2))
            crossed = nn.functional.scaled_dot_product_attention(self._split(self.cross_q(self.norm(h))), k, v)
            h = h + self.cross_out(self._merge(crossed))
        return h + (1 + gate_m) * self.mlp(self.norm(h) * (1 + scale_m) + shift_m)

    def _split(self, x: Tensor) -> Tensor:
        n, t, width = x.shape
        return x.reshape(n, t, self.heads, width // self.heads).transpose(1, 2)

    def _merge(self, x: Tensor) -> Tensor:
        n, heads, t, width = x.shape
        return x.transpose(1, 2).reshape(n, t, heads * width)
