"""Relations as merged messages, one per ordered pair of objects with its predicates multi-hot, and one echo of them.

In an echo every node hears the merged messages of its scene and updates itself (EchoScene Eq. 1, section 3.3).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from echomodel.compact.learned import table_of
from echomodel.config import names_of
from echomodel.graph import GraphBatch
from echomodel.vocabulary import vocabulary


@dataclass(frozen=True, eq=False)
class Pairs:
    """All P ordered pairs of different nodes of one scene, sorted by receiver.

    Every object hears every other object of its room, as the published graph's `in` relations to the scene node make
    possible; what a pair is told in the graph stands in `told`.

    Arguments:
        receiver, sender: (P,) int64, nodes.
        told: (P, 2R) float32, predicates that hold from receiver to sender, then from sender to receiver; a branch may
            put more channels behind them.
        scale: (N, 1) float32, 1 / sqrt(number of senders), the weight of a node's summed messages.
    """

    receiver: Tensor
    sender: Tensor
    told: Tensor
    scale: Tensor

    def to(self, device: torch.device | str) -> Pairs:
        """The same pairs on another device."""
        return Pairs(*(tensor.to(device) for tensor in (self.receiver, self.sender, self.told, self.scale)))

    def without(self, node_mask: Tensor, told: Tensor) -> Pairs:
        """The pairs between the nodes where `node_mask` (N,) bool is true, with `told` (P, 2R) in place of the old."""
        keep = (node_mask[self.receiver] & node_mask[self.sender]).nonzero()[:, 0]
        return Pairs(self.receiver[keep], self.sender[keep], told[keep], self.scale)


def ordered_pairs(counts: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Receiver (P,), sender (P,) and scale (N, 1) of all ordered pairs of scenes with `counts` (S,) int64 nodes."""
    starts = counts.cumsum(0) - counts
    per_node = counts.repeat_interleave(counts)
    receiver = torch.arange(len(per_node), device=counts.device).repeat_interleave(per_node)
    first = starts.repeat_interleave(counts).repeat_interleave(per_node)
    row = (per_node.cumsum(0) - per_node).repeat_interleave(per_node)
    sender = first + torch.arange(len(receiver), device=counts.device) - row
    different = receiver != sender
    scale = (per_node - 1).clamp_min(1).float().rsqrt()[:, None]
    return receiver[different], sender[different], scale


def pairs_of(graph: GraphBatch, predicates: tuple[str, ...] | None = None) -> Pairs:
    """The pairs of a graph, told those of its relations that are among R `predicates`, None = all that networks learn.

    Parallel triplets merge, repeated ones count once, inverses are filled in.
    """
    predicates = names_of("predicates") if predicates is None else predicates
    counts = graph.node_counts
    receiver, sender, scale = ordered_pairs(counts)
    row = table_of("predicates", predicates).to(receiver.device)[graph.triplets[:, 1]]
    graph, predicate = graph.with_triplets(graph.triplets[row >= 0]), row[row >= 0]
    index = pair_index(graph, counts)
    # an inverse relation says the same the other way round: left(a, b) = right(b, a)
    forward = torch.zeros(len(receiver), len(predicates), device=receiver.device)
    inverse = inverse_predicates(predicates).to(receiver.device)
    forward[index[0], predicate] = 1
    told_back = inverse[predicate] >= 0
    forward[index[1][told_back], inverse[predicate][told_back]] = 1
    backward = forward[reverse_pairs(receiver, sender, counts)]
    return Pairs(receiver, sender, torch.cat([forward, backward], dim=1), scale)


def pair_index(graph: GraphBatch, counts: Tensor) -> tuple[Tensor, Tensor]:
    """Numbers of the pairs (subject, object) and (object, subject) of every triplet, two (E,) int64 tensors."""
    subject, target = graph.triplets[:, 0], graph.triplets[:, 2]
    return _pair_number(subject, target, graph.scene, counts), _pair_number(target, subject, graph.scene, counts)


def reverse_pairs(receiver: Tensor, sender: Tensor, counts: Tensor) -> Tensor:
    """(P,) int64, number of the pair that goes the other way."""
    scene = torch.arange(len(counts), device=counts.device).repeat_interleave(counts)
    return _pair_number(sender, receiver, scene, counts)


def _pair_number(receiver: Tensor, sender: Tensor, scene: Tensor, counts: Tensor) -> Tensor:
    starts, before = counts.cumsum(0) - counts, (counts * (counts - 1)).cumsum(0) - counts * (counts - 1)
    of = scene[receiver]
    row, column = receiver - starts[of], sender - starts[of]
    return before[of] + row * (counts[of] - 1) + column - (column > row).long()


def inverse_predicates(predicates: tuple[str, ...]) -> Tensor:
    """(R,) int64, which of R predicates holds from object to subject where one holds, -1 where none follows."""
    words, names = vocabulary(), [vocabulary().name_of("predicates", name) for name in predicates]
    inverses = [words.predicate(name).inverse for name in names]
    return torch.tensor([names.index(name) if name in names else -1 for name in inverses])


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


def level_features(level: Tensor) -> Tensor:
    """Sinusoids of a noise level in [0, 1]: (N,) -> (N, 64)."""
    frequencies = torch.exp(torch.linspace(math.log(1.0), math.log(200.0), 32, device=level.device))
    angles = level[:, None] * frequencies
    return torch.cat([torch.cos(angles), torch.sin(angles)], dim=1)
