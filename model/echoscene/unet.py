"""The U-Net of both branches, under the published parameter names, computed by the shortest exact way.

In the layout branch (one dimension) a node is a sequence of length one, so a convolution acts through its centre tap
only, self-attention over one token is its value path, and down- and upsampling keep the length. In both branches the
context is a single token, so cross-attention is its value path, broadcast. The parameters that therefore never matter
(outer taps, queries and keys, `norm2`) are kept: files hold them and training decays them.
"""

import math
from collections import OrderedDict
from copy import deepcopy
from functools import cache
from typing import TypeVar

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from echoscene.config import UNetConfig

GROUPS = 32
Net = TypeVar("Net", bound=nn.Module)


def time_signal(t: Tensor, width: int) -> Tensor:
    """(N,) int64 steps -> (N, width) float32, cosines then sines of geometrically spaced frequencies."""
    half = width // 2
    frequencies = torch.exp(-math.log(10000) * torch.arange(half, dtype=torch.float32, device=t.device) / half)
    angles = t[:, None].float() * frequencies
    return torch.cat([angles.cos(), angles.sin()], dim=1)


def _conv(dims: int, cin: int, cout: int, kernel: int, **options: object) -> nn.Module:
    return (nn.Conv1d if dims == 1 else nn.Conv3d)(cin, cout, kernel, padding=kernel // 2, **options)  # type: ignore[arg-type]


def convolve(conv: nn.Module, h: Tensor) -> Tensor:
    """The centre tap of a one-dimensional convolution on (N, C), the whole of a three-dimensional one."""
    return F.linear(h, _tap(conv), conv.bias) if isinstance(conv, nn.Conv1d) else conv(h)


def _tap(conv: nn.Conv1d) -> Tensor:
    """(out, in) centre tap."""
    return conv.weight[:, :, conv.kernel_size[0] // 2]


def packed(net: Net) -> Net:
    """A copy of a one-dimensional network for inference on a CPU, its centre taps and linear maps laid out once.

    The same numbers; a layout step of 12 nodes takes 0.4 of the time.
    """
    fast = deepcopy(net)
    for module in list(fast.modules()):
        for name, part in list(module.named_children()):
            if isinstance(part, nn.Conv1d | nn.Linear):
                weight = _tap(part) if isinstance(part, nn.Conv1d) else part.weight
                setattr(module, name, PackedLayer(weight, part.bias))
    return fast


class ResBlock(nn.Module):
    """Two normalised convolutions around a shift that depends on the time, with a skip connection."""

    def __init__(self, dims: int, cin: int, cout: int, embedding: int) -> None:
        super().__init__()
        self.in_layers = nn.Sequential(nn.GroupNorm(GROUPS, cin), nn.SiLU(), _conv(dims, cin, cout, 3))
        self.emb_layers = nn.Sequential(nn.SiLU(), nn.Linear(embedding, cout))
        last = _conv(dims, cout, cout, 3)
        nn.init.zeros_(last.weight), nn.init.zeros_(last.bias)  # type: ignore[arg-type]
        self.out_layers = nn.Sequential(nn.GroupNorm(GROUPS, cout), nn.SiLU(), nn.Dropout(0.0), last)
        self.skip_connection = nn.Identity() if cin == cout else _conv(dims, cin, cout, 1)

    def forward(self, h: Tensor, embedding: Tensor) -> Tensor:
        """(N, cin, ...) features and (N, embedding) -> (N, cout, ...)."""
        norm, act, conv = self.in_layers
        shift = self.emb_layers(embedding)
        new = convolve(conv, act(norm(h))) + shift.reshape(*shift.shape, *[1] * (h.ndim - 2))
        norm, act, _, conv = self.out_layers
        new = convolve(conv, act(norm(new)))
        return new + (h if isinstance(self.skip_connection, nn.Identity) else convolve(self.skip_connection, h))


class Attention(nn.Module):
    """Multi-head attention without biases on queries, keys and values."""

    def __init__(self, width: int, context: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.to_q = nn.Linear(width, width, bias=False)
        self.to_k = nn.Linear(context, width, bias=False)
        self.to_v = nn.Linear(context, width, bias=False)
        self.to_out = nn.Sequential(nn.Linear(width, width), nn.Dropout(0.0))

    def value(self, token: Tensor) -> Tensor:
        """Attention to one token (N, context): its value path, (N, width)."""
        return self.to_out(self.to_v(token))

    def forward(self, x: Tensor) -> Tensor:
        """Self-attention over (N, L, width)."""
        q, k, v = (f(x).unflatten(-1, (self.heads, -1)).transpose(1, 2) for f in (self.to_q, self.to_k, self.to_v))
        return self.to_out(F.scaled_dot_product_attention(q, k, v).transpose(1, 2).flatten(2))


class _Gate(nn.Module):
    def __init__(self, width: int, inner: int) -> None:
        super().__init__()
        self.proj = nn.Linear(width, 2 * inner)

    def forward(self, x: Tensor) -> Tensor:
        value, gate = self.proj(x).chunk(2, dim=-1)
        return value * F.gelu(gate)


class TransformerBlock(nn.Module):
    """Self-attention, cross-attention to one token, gated feed-forward, each normalised and added.

    `context` 0 leaves the cross-attention out (concat conditioning).
    """

    def __init__(self, width: int, context: int, heads: int) -> None:
        super().__init__()
        self.attn1 = Attention(width, width, heads)
        feed = nn.Sequential(_Gate(width, 4 * width), nn.Dropout(0.0), nn.Linear(4 * width, width))
        self.ff = nn.Sequential(OrderedDict(net=feed))
        self.norm1, self.norm3 = nn.LayerNorm(width), nn.LayerNorm(width)
        if context:
            self.attn2, self.norm2 = Attention(width, context, heads), nn.LayerNorm(width)

    def forward(self, x: Tensor, context: Tensor | None) -> Tensor:
        """(N, width), one token each, or (N, L, width); `context` (N, context)."""
        normed = self.norm1(x)
        x = x + (self.attn1.value(normed) if x.ndim == 2 else self.attn1(normed))
        if context is not None and hasattr(self, "attn2"):
            token = self.attn2.value(context)
            x = x + (token if x.ndim == 2 else token[:, None])
        return x + self.ff(self.norm3(x))


class SpatialTransformer(nn.Module):
    """A transformer block over the positions of a feature map."""

    def __init__(self, dims: int, width: int, context: int, heads: int) -> None:
        super().__init__()
        self.norm = nn.GroupNorm(GROUPS, width, eps=1e-6)
        self.proj_in = _conv(dims, width, width, 1)
        self.transformer_blocks = nn.ModuleList([TransformerBlock(width, context, heads)])
        self.proj_out = _conv(dims, width, width, 1)
        nn.init.zeros_(self.proj_out.bias)  # type: ignore[arg-type]

    def forward(self, h: Tensor, context: Tensor | None) -> Tensor:
        """(N, width, ...) and (N, context) -> (N, width, ...)."""
        x = convolve(self.proj_in, self.norm(h))
        tokens = x if h.ndim == 2 else x.flatten(2).transpose(1, 2)
        for block in self.transformer_blocks:
            tokens = block(tokens, context)
        x = tokens if h.ndim == 2 else tokens.transpose(1, 2).unflatten(2, h.shape[2:])
        return convolve(self.proj_out, x) + h


class Down(nn.Module):
    """Halves the last two axes of a volume; keeps a sequence of length one."""

    def __init__(self, dims: int, width: int) -> None:
        super().__init__()
        self.op = _conv(dims, width, width, 3, stride=2 if dims == 1 else (1, 2, 2))

    def forward(self, h: Tensor) -> Tensor:
        """(N, width, ...) -> the same with half the height and width."""
        return convolve(self.op, h)


class Up(nn.Module):
    """Doubles the last two axes of a volume by repetition, then convolves; keeps a sequence of length one."""

    def __init__(self, dims: int, width: int) -> None:
        super().__init__()
        self.conv = _conv(dims, width, width, 3)

    def forward(self, h: Tensor) -> Tensor:
        """(N, width, ...) -> the same with twice the height and width."""
        if h.ndim == 5:
            h = F.interpolate(h, scale_factor=(1.0, 2.0, 2.0))
        return convolve(self.conv, h)


class UNet(nn.Module):
    """Noise prediction from a noisy state, a time and one context token per node.

    Arguments:
        dims: 1 for vectors (N, C), 3 for volumes (N, C, D, H, W).
        config: sizes.
        extra: further input channels (concat conditioning).
    """

    def __init__(self, dims: int, config: UNetConfig, extra: int = 0) -> None:
        super().__init__()
        self.config = config
        width, embedding = config.width, 4 * config.width
        context = config.context if config.conditioning == "crossattn" else 0
        self.time_embed = nn.Sequential(nn.Linear(width, embedding), nn.SiLU(), nn.Linear(embedding, embedding))

        def parts(cin: int, cout: int, factor: int) -> list[nn.Module]:
            attends = [SpatialTransformer(dims, cout, context, config.heads)] if factor in config.attention else []
            return [ResBlock(dims, cin, cout, embedding), *attends]

        levels = [width * m for m in config.mult]
        inputs = [nn.ModuleList([_conv(dims, config.channels + extra, width, 3)])]
        skips, current, factor = [width], width, 1
        for level, cout in enumerate(levels):
            for _ in range(config.blocks):
                inputs.append(nn.ModuleList(parts(current, cout, factor)))
                current = cout
                skips.append(current)
            if level < len(levels) - 1:
                inputs.append(nn.ModuleList([Down(dims, current)]))
                skips.append(current)
                factor *= 2
        self.input_blocks = nn.ModuleList(inputs)
        middle = SpatialTransformer(dims, current, context, config.heads)
        self.middle_block = nn.ModuleList(
            [ResBlock(dims, current, current, embedding), middle, ResBlock(dims, current, current, embedding)]
        )
        outputs = []
        for level, cout in reversed(list(enumerate(levels))):
            for number in range(config.blocks + 1):
                block = parts(current + skips.pop(), cout, factor)
                current = cout
                if level and number == config.blocks:
                    block.append(Up(dims, current))
                    factor //= 2
                outputs.append(nn.ModuleList(block))
        self.output_blocks = nn.ModuleList(outputs)
        last = _conv(dims, current, config.channels, 3)
        nn.init.zeros_(last.weight), nn.init.zeros_(last.bias)  # type: ignore[arg-type]
        self.out = nn.Sequential(nn.GroupNorm(GROUPS, current), nn.SiLU(), last)

    def embed_time(self, t: Tensor) -> Tensor:
        """(N,) int64 -> (N, 4 width) float32."""
        return self.time_embed(time_signal(t, self.config.width))

    def denoise(self, h: Tensor, embedding: Tensor, context: Tensor | None) -> Tensor:
        """(N, channels, ...) state, (N, 4 width) time, (N, context) token -> (N, channels, ...) noise."""

        def call(part: nn.Module, h: Tensor) -> Tensor:
            if isinstance(part, ResBlock):
                return part(h, embedding)
            if isinstance(part, SpatialTransformer):
                return part(h, context)
            return part(h) if isinstance(part, Down | Up) else convolve(part, h)

        def run(block: nn.Module, h: Tensor) -> Tensor:
            for part in block.children():
                h = call(part, h)
            return h

        skips = []
        for block in self.input_blocks:
            h = run(block, h)
            skips.append(h)
        h = run(self.middle_block, h)
        for block in self.output_blocks:
            h = run(block, torch.cat([h, skips.pop()], dim=1))
        norm, act, conv = self.out
        return convolve(conv, act(norm(h)))


class PackedLayer(nn.Module):
    """A linear map of float32 on a CPU, for inference alone, in this process.

    The weight goes into oneDNN's blocked layout, which reads it two to three times faster than a plain product does for
    a handful of rows; where torch lacks the operator, it is an ordinary linear map.
    """

    def __init__(self, weight: Tensor, bias: Tensor | None) -> None:
        super().__init__()
        self._product = weight.detach().float().contiguous()
        self._added = None if bias is None else bias.detach().float()
        self._packed = packing_available()
        if self._packed:
            self._product = torch.ops.mkldnn._reorder_linear_weight(self._product, None)

    def forward(self, x: Tensor) -> Tensor:
        """(..., in) float32 -> (..., out)."""
        if not self._packed:
            return F.linear(x, self._product, self._added)
        return torch.ops.mkldnn._linear_pointwise(x, self._product, self._added, "none", [], "")


@cache
def packing_available() -> bool:
    """Whether this build of torch multiplies with oneDNN-packed weights, tried once on a small product."""
    try:
        with torch.inference_mode():
            x, weight = torch.eye(8), torch.arange(64.0).reshape(8, 8)
            packed = torch.ops.mkldnn._reorder_linear_weight(weight, None)
            return torch.equal(torch.ops.mkldnn._linear_pointwise(x, packed, None, "none", [], ""), weight.t())
    except (RuntimeError, AttributeError, NotImplementedError):
        return False
