"""The published networks as they are written: every tap, query and key computed. Slow, obvious, for comparison only."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor
from torch.nn import functional as F

from echoscene.model import LayoutNet, ShapeUNet
from echoscene.unet import Down, ResBlock, SpatialTransformer, Up


def _convolve(conv: Any, h: Tensor) -> Tensor:
    return conv(h)


def _residual(block: Any, h: Tensor, embedding: Tensor) -> Tensor:
    norm, act, conv = block.in_layers
    shift = block.emb_layers(embedding)
    new = _convolve(conv, act(norm(h)))
    new = new + shift.reshape(*shift.shape, *[1] * (new.ndim - 2))
    return block.skip_connection(h) + block.out_layers(new)


def _attention(layer: Any, x: Tensor, context: Tensor) -> Tensor:
    def heads(y: Tensor) -> Tensor:
        batch, length, width = y.shape
        return y.reshape(batch, length, layer.heads, width // layer.heads).transpose(1, 2).flatten(0, 1)

    q, k, v = heads(layer.to_q(x)), heads(layer.to_k(context)), heads(layer.to_v(context))
    weights = torch.softmax(q @ k.transpose(1, 2) * q.shape[-1] ** -0.5, dim=-1)
    mixed = (weights @ v).unflatten(0, (-1, layer.heads)).transpose(1, 2).flatten(2)
    return layer.to_out(mixed)


def _transformer(part: Any, h: Tensor, context: Tensor) -> Tensor:
    x = part.proj_in(part.norm(h))
    tokens = x.flatten(2).transpose(1, 2).contiguous()
    for block in part.transformer_blocks:
        normed = block.norm1(tokens)
        tokens = tokens + _attention(block.attn1, normed, normed)
        tokens = tokens + _attention(block.attn2, block.norm2(tokens), context)
        tokens = tokens + block.ff(block.norm3(tokens))
    return part.proj_out(tokens.transpose(1, 2).reshape(h.shape).contiguous()) + h


def _block(parts: Any, h: Tensor, embedding: Tensor, context: Tensor) -> Tensor:
    for part in parts:
        if isinstance(part, ResBlock):
            h = _residual(part, h, embedding)
        elif isinstance(part, SpatialTransformer):
            h = _transformer(part, h, context)
        elif isinstance(part, Down):
            h = part.op(h)
        elif isinstance(part, Up):
            if h.ndim == 5:
                h = F.interpolate(h, (h.shape[2], 2 * h.shape[3], 2 * h.shape[4]), mode="nearest")
            h = part.conv(h)
        else:
            h = part(h)
    return h


def literal_unet(net: Any, h: Tensor, embedding: Tensor, context: Tensor) -> Tensor:
    """(N, C, ...) with one token (N, 1, context) per node -> (N, C, ...), nothing left out."""
    skips = []
    for block in net.input_blocks:
        h = _block(block, h, embedding, context)
        skips.append(h)
    h = _block(net.middle_block, h, embedding, context)
    for block in net.output_blocks:
        h = _block(block, torch.cat([h, skips.pop()], dim=1), embedding, context)
    return net.out(h)


@torch.inference_mode()
def literal_layout(net: LayoutNet, x: Tensor, objects: Tensor, triples: Tensor, t: Tensor) -> Tensor:
    """The layout branch with boxes as sequences of length one."""
    embedding = net.embed_time(t)
    context = net.echo(x, objects, triples, embedding, None)
    return literal_unet(net, x[:, :, None], embedding, context[:, None])[:, :, 0]


@torch.inference_mode()
def literal_shape(net: ShapeUNet, x: Tensor, objects: Tensor, triples: Tensor, t: Tensor) -> Tensor:
    """The shape branch with full attention to its single token."""
    embedding = net.embed_time(t)
    context = net.echo(x, objects, triples, embedding, None)
    return literal_unet(net, x, embedding, context[:, None])
