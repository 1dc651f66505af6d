"""One echo: every node hears the merged messages of its scene and updates itself (EchoScene Eq. 1, section 3.3)."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from echomodel.compact.pairs import Pairs


class EchoLayer(nn.Module):
    """Triplet message passing with a residual, then a two-layer perceptron.

    m_i = W / sqrt(n_i) * sum_j silu(A x_i + B x_j + P p_ij),  x_i <- x_i + m_i,  x_i <- x_i + MLP(x_i),
    with x normalised before use and modulated by the noise level. As the last map of the message network is linear it
    is applied to the sum, so that no matrix product runs over pairs except the small one with the predicates.

    Arguments:
        width: channels of a node.
        told: channels of `Pairs.told`.

    Shapes:
        x (N, width), pairs of the batch, modulation (N, 2 width) or None -> (N, width)
    """

    def __init__(self, width: int, told: int) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(width)
        self.ends = nn.Linear(width, 2 * width)
        self.told = nn.Linear(told, width, bias=False)
        self.message = nn.Linear(width, width)
        self.norm_mlp = nn.LayerNorm(width)
        self.mlp = nn.Sequential(nn.Linear(width, 2 * width), nn.SiLU(), nn.Linear(2 * width, width))
        nn.init.normal_(self.told.weight, std=0.5)

    def forward(self, x: Tensor, pairs: Pairs, modulation: Tensor | None = None) -> Tensor:
        normed = self.norm(x)
        if modulation is not None:
            scale, shift = modulation.chunk(2, dim=1)
            normed = normed * (1 + scale) + shift
        ends = self.ends(normed)
        width = x.shape[1]
        heard = pair_messages(ends[:, :width], ends[:, width:], self.told(pairs.told), pairs.receiver, pairs.sender)
        x = x + self.message(heard * pairs.scale)
        return x + self.mlp(self.norm_mlp(x))


class Alone(nn.Module):
    """An echo layer's perceptron without its echo, for the ablation; as deep and a little wider."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(width)
        self.mlp = nn.Sequential(nn.Linear(width, 4 * width), nn.SiLU(), nn.Linear(4 * width, width))

    def forward(self, x: Tensor, pairs: Pairs, modulation: Tensor) -> Tensor:
        scale, shift = modulation.chunk(2, dim=1)
        return x + self.mlp(self.norm(x) * (1 + scale) + shift)


class _PairMessages(torch.autograd.Function):
    """sum_j silu(a_i + b_j + e_ij), keeping one tensor over pairs for the backward pass instead of four."""

    @staticmethod
    def forward(ctx, a: Tensor, b: Tensor, e: Tensor, receiver: Tensor, sender: Tensor) -> Tensor:  # type: ignore[override]
        u = a.index_select(0, receiver).add_(b.index_select(0, sender)).add_(e)
        ctx.save_for_backward(u, receiver, sender)
        ctx.nodes = len(a)
        return torch.zeros_like(a).index_add_(0, receiver, nn.functional.silu(u))

    @staticmethod
    def backward(ctx, grad: Tensor):  # type: ignore[override]
        u, receiver, sender = ctx.saved_tensors
        gate = torch.sigmoid(u)
        slope = gate.mul(1 - gate).mul_(u).add_(gate)
        by_pair = slope.mul_(grad.index_select(0, receiver))
        zeros = by_pair.new_zeros(ctx.nodes, by_pair.shape[1])
        return zeros.index_add(0, receiver, by_pair), zeros.index_add(0, sender, by_pair), by_pair, None, None


def pair_messages(a: Tensor, b: Tensor, e: Tensor, receiver: Tensor, sender: Tensor) -> Tensor:
    """Summed messages sum_j silu(a_i + b_j + e_ij): a, b (N, C), e (P, C), receiver, sender (P,) -> (N, C)."""
    if torch.is_grad_enabled():
        return _PairMessages.apply(a, b, e, receiver, sender)
    u = a.index_select(0, receiver).add_(b.index_select(0, sender)).add_(e)
    return torch.zeros_like(a).index_add_(0, receiver, nn.functional.silu(u, inplace=True))


def level_features(level: Tensor, count: int = 32) -> Tensor:
    """Sinusoids of a noise level in [0, 1]: (N,) -> (N, 2 count)."""
    frequencies = torch.exp(torch.linspace(math.log(1.0), math.log(200.0), count, device=level.device))
    angles = level[:, None] * frequencies
    return torch.cat([torch.cos(angles), torch.sin(angles)], dim=1)
