"""The shape denoiser with fixed weights: the same numbers as `ShapeUNet`, faster.

What is exploited, exact but for rounding: cross-attention to one token is its value path, one product for all
transformer blocks; the time's shifts are computed once per distinct step; norms' gains and consecutive linear maps are
folded; queries, keys and values are one product; repeated voxels and (where channels outweigh voxels) Winograd's
transform save multiplications; features lie channels last, so that voxels are tokens without copies.
"""

from __future__ import annotations

from typing import Any, cast

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from echomodel.packed import PackedLinear, folded_norm
from echoscene.compiled_echo import CompiledEcho, GraphIndex
from echoscene.layout import check_inputs, edge_input
from echoscene.shape import ShapeUNet
from echoscene.unet import GROUPS, Down, ResBlock, SpatialTransformer, Up, walk
from echoscene.volumes import WinogradConv, convolve_repeated

LAST = torch.channels_last_3d
WINOGRAD_VOXELS = 1024  # largest volume per object for which the transforms cost less than they save (measured)
TOKENS = 1024  # tokens of a transformer block worked on at a time, so that they stay in the cache


def _pointwise(linear: PackedLinear, h: Tensor) -> Tensor:
    """A linear map of the channels of (N, C, D, H, W), channels last in memory."""
    return linear(h.permute(0, 2, 3, 4, 1)).permute(0, 4, 1, 2, 3)


class _Direct:
    def __init__(self, conv: Any) -> None:
        self.weight = conv.weight.detach().to(memory_format=LAST)
        self.bias, self.options = conv.bias.detach(), {"stride": conv.stride, "padding": conv.padding}

    def __call__(self, h: Tensor) -> Tensor:
        return F.conv3d(h, self.weight, self.bias, **self.options)


class _Repeated:
    def __init__(self, conv: Any) -> None:
        self.weight, self.bias = conv.weight.detach(), conv.bias.detach()

    def __call__(self, h: Tensor) -> Tensor:
        return convolve_repeated(h, self.weight, self.bias, (False, True, True)).contiguous(memory_format=LAST)


def _conv(conv: Any, voxels: int, winograd: bool) -> _Direct | WinogradConv:
    """The cheaper way of a convolution over `voxels` voxels per object."""
    return WinogradConv(conv.weight, conv.bias) if winograd and voxels <= WINOGRAD_VOXELS else _Direct(conv)


class _Res:
    """A residual block; its time shift comes from the rows' columns `columns`."""

    def __init__(self, block: Any, columns: slice, voxels: int, winograd: bool) -> None:
        self.columns = columns
        self.first_norm, _, first = block.in_layers
        self.last_norm, _, _, last = block.out_layers
        self.first, self.last = _conv(first, voxels, winograd), _conv(last, voxels, winograd)
        self.skip: PackedLinear | None = None
        if not isinstance(block.skip_connection, nn.Identity):
            self.skip = PackedLinear(block.skip_connection.weight.flatten(1), block.skip_connection.bias)

    def __call__(self, h: Tensor, time: Tensor, context: Tensor) -> Tensor:
        new = self.first(F.silu(self.first_norm(h), inplace=True))
        new += time[:, self.columns, None, None, None]
        new = self.last(F.silu(self.last_norm(new), inplace=True))
        new += h if self.skip is None else _pointwise(self.skip, h)
        return new


class _Transformer:
    """A transformer block; its cross-attention comes from the contexts' columns `columns`."""

    def __init__(self, part: Any, columns: slice) -> None:
        self.columns = columns
        block = part.transformer_blocks[0]
        self.heads, self.width = block.attn1.heads, block.norm1.weight.shape
        self.eps = (part.norm.eps, block.norm1.eps, block.norm3.eps)
        self.enter = PackedLinear(*folded_norm(part.proj_in.weight.flatten(1), part.proj_in.bias, part.norm))
        attention = block.attn1
        triple = torch.cat([attention.to_q.weight, attention.to_k.weight, attention.to_v.weight])
        self.triple = PackedLinear(*folded_norm(triple, None, block.norm1))
        self.mix = PackedLinear(attention.to_out[0].weight, attention.to_out[0].bias)
        self.gate = PackedLinear(*folded_norm(block.ff.net[0].proj.weight, block.ff.net[0].proj.bias, block.norm3))
        self.feed = PackedLinear(block.ff.net[2].weight, block.ff.net[2].bias)
        self.leave = PackedLinear(part.proj_out.weight.flatten(1), part.proj_out.bias)

    def __call__(self, h: Tensor, time: Tensor, context: Tensor) -> Tensor:
        normed = F.group_norm(h, GROUPS, eps=self.eps[0])
        tokens = normed.permute(0, 2, 3, 4, 1).flatten(1, 3)
        chunk = max(1, TOKENS // tokens.shape[1])
        shifts = context[:, None, self.columns].split(chunk)
        done = [self._tokens(part, shift) for part, shift in zip(tokens.split(chunk), shifts, strict=True)]
        new = torch.cat(done).unflatten(1, h.shape[2:]).permute(0, 4, 1, 2, 3)
        new += h
        return new

    def _tokens(self, x: Tensor, shift: Tensor) -> Tensor:
        x = self.enter(x)
        triple = self.triple(F.layer_norm(x, self.width, eps=self.eps[1]))
        q, k, v = triple.unflatten(2, (3, self.heads, -1)).permute(2, 0, 3, 1, 4)
        x += self.mix(F.scaled_dot_product_attention(q, k, v).transpose(1, 2).flatten(2))
        x += shift
        value, gate = self.gate(F.layer_norm(x, self.width, eps=self.eps[2])).chunk(2, dim=2)
        x += self.feed(F.gelu(gate).mul_(value))
        return self.leave(x)


class _Plain:
    def __init__(self, run: _Direct | _Repeated | WinogradConv) -> None:
        self.run = run

    def __call__(self, h: Tensor, time: Tensor, context: Tensor) -> Tensor:
        return self.run(h)


class CompiledShape:
    """A shape denoiser for inference.

    Arguments:
        net: the network; batch norms act by their running statistics. Some weights are shared with it, most are
            copied in another layout: do not train it on.
        winograd: use Winograd convolutions, whose weights take 2.4 times the memory.
    """

    @torch.no_grad()
    def __init__(self, net: ShapeUNet, winograd: bool = True) -> None:
        config = net.config
        if config.conditioning != "crossattn":
            raise ValueError(f"compiled shape branch: conditioning is {config.conditioning!r}, allowed: crossattn")
        self.net, self.config, self.winograd = net, config, winograd
        self._side, self._shifts, self._contexts = config.grid, [], []  # type: ignore[var-annotated]
        self.inputs = [self._freeze(block) for block in net.input_blocks]
        self.middle = self._freeze(net.middle_block)
        self.outputs = [self._freeze(block) for block in net.output_blocks]
        norm, _, conv = net.out
        self.out_norm, self.out = norm, _Direct(conv)
        weights, biases = zip(*self._contexts, strict=True)
        self.context = PackedLinear(torch.cat(weights), torch.cat(biases))
        weights, biases = zip(*self._shifts, strict=True)
        self.shift = PackedLinear(torch.cat(weights), torch.cat(biases))
        del self._contexts, self._shifts
        self.echo: CompiledEcho | None = None
        if config.echo:
            time = net.shape_time_emb if config.time_in_echo else None
            self.echo = CompiledEcho(net.shape_code_graph_cov, config.objects, config.code, None, time)

    def _freeze(self, block: Any) -> list[_Res | _Transformer | _Plain]:
        parts: list[_Res | _Transformer | _Plain] = []
        for part in block:
            voxels = self.config.grid * self._side**2
            if isinstance(part, ResBlock):
                start = sum(len(bias) for _, bias in self._shifts)
                linear = cast(Any, part.emb_layers[1])
                self._shifts.append((linear.weight, linear.bias))
                parts.append(_Res(part, slice(start, start + len(linear.bias)), voxels, self.winograd))
            elif isinstance(part, SpatialTransformer):
                start = sum(len(bias) for _, bias in self._contexts)
                attention = cast(Any, part.transformer_blocks[0]).attn2
                out = attention.to_out[0]
                self._contexts.append((out.weight.double() @ attention.to_v.weight.double(), out.bias))
                parts.append(_Transformer(part, slice(start, start + len(out.bias))))
            elif isinstance(part, Down):
                parts.append(_Plain(_Direct(part.op)))
                self._side //= 2
            elif isinstance(part, Up):
                parts.append(_Plain(_Repeated(part.conv)))
                self._side *= 2
            else:
                parts.append(_Plain(_Direct(part)))
        return parts

    def bind(self, objects: Tensor, triples: Tensor, edge_attr: Tensor | None = None) -> BoundShape:
        """Compute what a graph fixes; arguments and errors as in `ShapeUNet.forward`."""
        return BoundShape(self, objects, triples, edge_attr)

    def denoise(self, x: Tensor, time: Tensor, context: Tensor) -> Tensor:
        """(N, 3, D, H, W) state, (N, .) time shifts and (N, .) contexts of all blocks -> (N, 3, D, H, W) noise."""
        h = x.contiguous(memory_format=LAST)
        h = walk(h, self.inputs, self.middle, self.outputs, lambda part, h: part(h, time, context))
        return self.out(F.silu(self.out_norm(h), inplace=True)).contiguous()


class BoundShape:
    """A compiled shape denoiser with its graph: `bound(x, t)` is `net(x, objects, triples, t, edge_attr)`."""

    @torch.no_grad()
    def __init__(self, compiled: CompiledShape, objects: Tensor, triples: Tensor, edge_attr: Tensor | None) -> None:
        self.compiled, self.objects = compiled, objects
        config = compiled.config
        count = len(objects)
        check_inputs(objects.new_zeros(count, config.channels), objects, triples, triples.new_zeros(count), config)
        if compiled.echo is not None:
            self.graph = GraphIndex.of(triples, count)
            self.bound = compiled.echo.bind(
                objects, edge_input(compiled.net.pred_embeddings, triples, edge_attr, config)
            )

    @torch.inference_mode()
    def __call__(self, x: Tensor, t: Tensor) -> Tensor:
        """(N, 3, D, H, W) float32 latents and (N,) int64 steps -> noise of the same shape."""
        compiled, net = self.compiled, self.compiled.net
        if len(x) != len(self.objects) or len(t) != len(x):
            raise ValueError(f"{len(x)} latents and {len(t)} steps for a graph of {len(self.objects)} nodes")
        steps, row = t.unique(return_inverse=True)
        embedding = net.embed_time(steps)
        time = compiled.shift(F.silu(embedding))[row]
        context = self.objects
        if compiled.echo is not None:
            code = net.shape_embeddings(x)
            context = compiled.echo(self.bound, code, compiled.echo.time_rows(embedding)[row], self.graph)
        return compiled.denoise(x, time, compiled.context(context))
