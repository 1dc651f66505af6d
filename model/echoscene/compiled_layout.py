"""The layout denoiser with fixed weights: the same numbers as `LayoutNet`, several times faster.

What is exploited, all of it exact but for rounding: only the centre taps and value paths matter (see `unet`); the time
enters by additions whose summands are tabulated once for all nodes and steps; the echo's first layer sees a constant
condition and constant edges; consecutive linear maps without anything between them are one map; the contexts of all
transformer blocks are one product; weights lie packed for the processor.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from echomodel.packed import PackedLinear, folded_norm
from echoscene.compiled_echo import CompiledEcho, GraphIndex
from echoscene.layout import LayoutNet, check_inputs, edge_input
from echoscene.unet import GROUPS, Down, ResBlock, SpatialTransformer, Up, time_signal, walk


def _tap(conv: Any) -> Tensor:
    """(out, in) centre tap of a one-dimensional convolution."""
    return conv.weight[:, :, conv.weight.shape[2] // 2]


def _normalised(h: Tensor, groups: int, eps: float) -> Tensor:
    """Group norm of (N, C) without gains.

    By the published networks' own kernel: where the channels of a group are few and nearly equal, a layer norm of each
    group divides by a variance that is rounded otherwise, and ends up to three times as far from the published numbers.
    """
    return F.group_norm(h, groups, eps=eps)


@dataclass(frozen=True)
class _Norm:
    gain: Tensor
    shift: Tensor
    eps: float

    @classmethod
    def of(cls, norm: Any) -> _Norm:
        return cls(norm.weight.detach(), norm.bias.detach(), norm.eps)

    def silu(self, h: Tensor) -> Tensor:
        return F.silu(torch.addcmul(self.shift, _normalised(h, GROUPS, self.eps), self.gain), inplace=True)


class _Res:
    """A residual block; its time shift and first bias come from the table's columns `columns`."""

    def __init__(self, block: Any, columns: slice) -> None:
        self.columns = columns
        self.first_norm, self.first = _Norm.of(block.in_layers[0]), PackedLinear(_tap(block.in_layers[2]))
        self.last_norm = _Norm.of(block.out_layers[0])
        bias = block.out_layers[3].bias.double()
        self.skip: PackedLinear | None = None
        if not isinstance(block.skip_connection, nn.Identity):
            self.skip = PackedLinear(_tap(block.skip_connection))
            bias = bias + block.skip_connection.bias.double()
        self.last = PackedLinear(_tap(block.out_layers[3]), bias)

    def __call__(self, h: Tensor, time: Tensor, context: Tensor) -> Tensor:
        new = self.first(self.first_norm.silu(h))
        new += time[:, self.columns]
        new = self.last(self.last_norm.silu(new))
        new += h if self.skip is None else self.skip(h)
        return new


class _Transformer:
    """A transformer block; its cross-attention and attention biases come from the context's columns `columns`."""

    def __init__(self, part: Any, columns: slice) -> None:
        self.columns = columns
        block = part.transformer_blocks[0]
        self.width, self.eps = block.norm1.weight.shape, (part.norm.eps, block.norm1.eps, block.norm3.eps)
        self.enter = PackedLinear(*folded_norm(_tap(part.proj_in), part.proj_in.bias, part.norm))
        out, value = block.attn1.to_out[0], block.attn1.to_v
        matrix, shift = folded_norm(out.weight.double() @ value.weight.double(), out.bias, block.norm1)
        self.own, self.shift = PackedLinear(matrix), shift
        self.gate = PackedLinear(*folded_norm(block.ff.net[0].proj.weight, block.ff.net[0].proj.bias, block.norm3))
        self.feed = PackedLinear(block.ff.net[2].weight, block.ff.net[2].bias)
        self.leave = PackedLinear(_tap(part.proj_out), part.proj_out.bias)

    def __call__(self, h: Tensor, time: Tensor, context: Tensor) -> Tensor:
        x = self.enter(_normalised(h, GROUPS, self.eps[0]))
        own = self.own(F.layer_norm(x, self.width, eps=self.eps[1]))
        x += own
        x += context[:, self.columns]
        value, gate = self.gate(F.layer_norm(x, self.width, eps=self.eps[2])).chunk(2, dim=1)
        x += self.feed(F.gelu(gate).mul_(value))
        new = self.leave(x)
        new += h
        return new


class _Linear:
    def __init__(self, conv: Any) -> None:
        self.linear = PackedLinear(_tap(conv), conv.bias)

    def __call__(self, h: Tensor, time: Tensor, context: Tensor) -> Tensor:
        return self.linear(h)


class CompiledLayout:
    """A layout denoiser for inference; weights are copied, later changes of `net` do not reach it.

    Arguments:
        net: the network; batch norms act by their running statistics.
        steps: int64 steps that will be asked for, or None for all 1,000.
    """

    @torch.no_grad()
    def __init__(self, net: LayoutNet, steps: Tensor | None = None, count: int = 1000) -> None:
        self.config = net.config
        steps = torch.arange(count) if steps is None else steps.unique()
        self.row = torch.full((count,), -1)
        self.row[steps] = torch.arange(len(steps))
        self._shifts: list[tuple[nn.Linear, Tensor]] = []
        self._contexts: list[tuple[Tensor, Tensor]] = []
        self.inputs = [self._freeze(block) for block in net.input_blocks]
        self.middle = self._freeze(net.middle_block)
        self.outputs = [self._freeze(block) for block in net.output_blocks]
        norm, _, conv = (cast(Any, part) for part in net.out)
        self.out_norm, self.out = _Norm.of(norm), PackedLinear(_tap(conv), conv.bias)
        self.echo: CompiledEcho | None = None
        if self.config.echo:
            time = net.box_time_emb if self.config.time_in_echo else None
            self.table = net.pred_embeddings
            self.echo = CompiledEcho(net.box_graph_cov, self.config.objects, self.config.code, net.box_embeddings, time)
        self.context = PackedLinear(*(torch.cat(parts) for parts in zip(*self._contexts, strict=True)))
        self.times = torch.cat([self._time_rows(net, part) for part in steps.split(128)])

    def _freeze(self, block: Any) -> list[_Res | _Transformer | _Linear]:
        parts: list[_Res | _Transformer | _Linear] = []
        for part in block:
            if isinstance(part, ResBlock):
                start = sum(len(bias) for _, bias in self._shifts)
                linear, first = (cast(Any, m) for m in (part.emb_layers[1], part.in_layers[2]))
                bias = (linear.bias.double() + first.bias.double()).float()
                self._shifts.append((linear, bias))
                parts.append(_Res(part, slice(start, start + len(bias))))
            elif isinstance(part, SpatialTransformer):
                start = sum(len(bias) for _, bias in self._contexts)
                attention = cast(Any, part.transformer_blocks[0]).attn2
                out = attention.to_out[0]
                compiled = _Transformer(part, slice(start, start + len(out.bias)))
                matrix = out.weight.double() @ attention.to_v.weight.double()
                self._contexts.append((matrix, out.bias.double() + compiled.shift))
                parts.append(compiled)
            else:
                parts.append(
                    _Linear(part.op if isinstance(part, Down) else part.conv if isinstance(part, Up) else part)
                )
        return parts

    def _time_rows(self, net: LayoutNet, steps: Tensor) -> Tensor:
        embedding = net.time_embed(time_signal(steps, self.config.width))
        active = F.silu(embedding)
        rows = [active @ linear.weight.t() + bias for linear, bias in self._shifts]
        if self.echo is not None:
            rows.append(self.echo.time_rows(embedding))
        return torch.cat(rows, dim=1)

    def bind(self, objects: Tensor, triples: Tensor, edge_attr: Tensor | None = None) -> BoundLayout:
        """Compute what a graph fixes; arguments as in `LayoutNet.forward`, errors too (at the first call)."""
        return BoundLayout(self, objects, triples, edge_attr)

    def denoise(self, x: Tensor, time: Tensor, context: Tensor) -> Tensor:
        """(N, 8) state, (N, W) table rows and (N, C) contexts of all transformer blocks -> (N, 8) noise."""
        h = walk(x, self.inputs, self.middle, self.outputs, lambda part, h: part(h, time, context))
        return self.out(self.out_norm.silu(h))


class BoundLayout:
    """A compiled layout denoiser with its graph: `bound(x, t)` is `net(x, objects, triples, t, edge_attr)`."""

    @torch.no_grad()
    def __init__(self, compiled: CompiledLayout, objects: Tensor, triples: Tensor, edge_attr: Tensor | None) -> None:
        self.compiled, self.nodes = compiled, len(objects)
        config = compiled.config
        check_inputs(
            objects.new_zeros(len(objects), config.channels), objects, triples, triples.new_zeros(len(objects)), config
        )
        if compiled.echo is None:
            self.context = compiled.context(objects)
            return
        self.graph = GraphIndex.of(triples, len(objects))
        self.bound = compiled.echo.bind(objects, edge_input(compiled.table, triples, edge_attr, config))

    @torch.inference_mode()
    def __call__(self, x: Tensor, t: Tensor) -> Tensor:
        """(N, 8) float32 boxes and (N,) int64 steps -> (N, 8) float32 noise; ValueError for a step not prepared."""
        compiled = self.compiled
        if tuple(x.shape) != (self.nodes, compiled.config.channels) or tuple(t.shape) != (self.nodes,):
            raise ValueError(f"state is {tuple(x.shape)}, steps {tuple(t.shape)}, for a graph of {self.nodes} nodes")
        if bool(((t < 0) | (t >= len(compiled.row))).any()) or bool((compiled.row[t] < 0).any()):
            raise ValueError(f"step {int(t[0])} was not prepared: allowed are the steps given to CompiledLayout")
        rows = compiled.times[compiled.row[t]]
        if compiled.echo is None:
            return compiled.denoise(x, rows, self.context)
        width = compiled.echo.time_width
        echo_rows = rows[:, rows.shape[1] - width :]
        context = compiled.echo(self.bound, x, echo_rows, self.graph)
        return compiled.denoise(x, rows, compiled.context(context))
