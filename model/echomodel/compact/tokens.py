"""Token denoiser: the parts of all pieces of a scene, one by one; at every step each piece hears the others (3.4).

The second way to furniture made of parts: not a program's description is denoised but the solids themselves, up to 64
of a piece (`echomodel.data.furniture.tokens`), in one order, with attention in the piece and an echo between pieces.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from echomodel.compact.echo import EchoLayer, level_features
from echomodel.compact.pairs import Pairs
from echomodel.compact.pieces import PieceDenoiser
from echomodel.config import CompactConfig
from echomodel.graph import GraphBatch


@dataclass(frozen=True, eq=False)
class TokenContext:
    """What stays the same over all steps: `nodes` (N, width), pairs, and `mask` (N, M) bool of the tokens there are."""

    nodes: Tensor
    pairs: Pairs
    mask: Tensor


class TokenDenoiser(PieceDenoiser):
    """Says the clean tokens of every object in noisy ones; each object has its own level, 0 = known.

    Shapes:
        tokens (N, M, D), level (N,) in [0, 1], `TokenContext` -> (N, M, D), zeros where there is no token
    """

    reach = 1.3

    def __init__(self, config: CompactConfig) -> None:
        own, width = config.tokens, config.tokens.width
        super().__init__(config, own)
        self.counts = nn.Sequential(nn.LayerNorm(width), nn.Linear(width, width), nn.SiLU(), nn.Linear(width, own.most))
        self.own = nn.Linear(self.values, width)
        self.place = nn.Embedding(own.most, width)
        self.share = nn.Linear(32, width)
        self.level = nn.Sequential(nn.Linear(64, width), nn.SiLU(), nn.Linear(width, width))
        self.blocks = nn.ModuleList(_Block(width, own.heads) for _ in range(own.layers))
        self.summary = nn.ModuleList(nn.Linear(width, width) for _ in range(own.layers))
        told = 2 * config.predicates
        self.echoes = nn.ModuleList(EchoLayer(width, told) for _ in range(own.layers)) if own.echo else None
        self.norm = nn.LayerNorm(width)
        self.head = nn.Linear(width, self.values)
        for table in (self.category, self.room_type, self.place):
            nn.init.normal_(table.weight, std=0.3)
        nn.init.zeros_(self.head.weight)
        nn.init.zeros_(self.head.bias)

    def context(self, graph: GraphBatch, size: Tensor, pairs: Pairs, latent: Tensor, count: Tensor) -> TokenContext:
        """Everything that does not depend on the step.

        Arguments:
            graph: N nodes. size: (N, 3) float32, metres. pairs: of the graph. count: (N,) int64 tokens of each piece.
            latent: (N, latent width), output of the graph manipulator.
        """
        mask = torch.arange(int(count.max()), device=count.device) < count[:, None]
        return TokenContext(self.nodes(graph, size, latent), pairs, mask)

    def forward(self, x: Tensor, level: Tensor, context: TokenContext) -> Tensor:
        return self.clean(self.scores(x, level, context)) * context.mask[:, :, None]

    def scores(self, x: Tensor, level: Tensor, context: TokenContext) -> Tensor:
        """Logarithms of the words' odds, and the numbers as they are: (N, M, D)."""
        mask = context.mask
        piece, place = mask.nonzero(as_tuple=True)
        count = mask.sum(1)
        share = level_features((place + 0.5) / count[piece], 16)
        h = self.own(x[piece, place]) + self.place(place) + self.share(share)
        node = context.nodes + self.level(level_features(level))
        for number, block in enumerate(self.blocks):
            mean = torch.zeros_like(node).index_add(0, piece, h) / count[:, None]
            node = node + self.summary[number](mean)
            if self.echoes is not None:
                node = self.echoes[number](node, context.pairs)
            h = block(h, node, piece, place, mask)
        out = x.new_zeros(*mask.shape, self.values, dtype=h.dtype)
        return out.index_put((piece, place), self.head(self.norm(h)))


class _Block(nn.Module):
    """Attention among the tokens of each piece and a perceptron, both modulated by the piece's node."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.modulation = nn.Sequential(nn.LayerNorm(width), nn.SiLU(), nn.Linear(width, 4 * width))
        self.norms = nn.ModuleList(nn.LayerNorm(width, elementwise_affine=False) for _ in range(2))
        self.ends = nn.Linear(width, 3 * width)
        self.merge = nn.Linear(width, width)
        self.mlp = nn.Sequential(nn.Linear(width, 3 * width), nn.SiLU(), nn.Linear(3 * width, width))

    def forward(self, h: Tensor, node: Tensor, piece: Tensor, place: Tensor, mask: Tensor) -> Tensor:
        a, b, c, d = self.modulation(node)[piece].chunk(4, dim=1)
        ends = self.ends(self.norms[0](h) * (1 + a) + b)
        padded = ends.new_zeros(*mask.shape, ends.shape[1]).index_put((piece, place), ends)
        q, k, v = padded.unflatten(2, (3, self.heads, -1)).permute(2, 0, 3, 1, 4)
        heard = nn.functional.scaled_dot_product_attention(q, k, v, attn_mask=mask[:, None, None, :])
        h = h + self.merge(heard.transpose(1, 2).flatten(2)[piece, place])
        return h + self.mlp(self.norms[1](h) * (1 + c) + d)
