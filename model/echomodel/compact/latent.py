"""Graph encoder and manipulator: the latent graph that both branches read (EchoScene 3.2)."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from echomodel.compact.echo import EchoLayer
from echomodel.compact.learned import WordTable
from echomodel.compact.pairs import Pairs
from echomodel.config import CompactConfig


class LatentGraph(nn.Module):
    """Encodes the graph before an edit and carries its latents over to the edited graph.

    Encoder: z = GCN(category | relations). Manipulator: z' = GCN(z, touched, category | edited relations), where added
    nodes enter with z = 0 and nodes whose relations changed are marked as touched.

    Shapes:
        category (N,) int64 of the edited graph, `Pairs` over the same N nodes, added, touched (N,) -> (N, width)
    """

    def __init__(self, config: CompactConfig) -> None:
        super().__init__()
        width, layers = config.latent.width, config.latent.layers
        self.category = WordTable("categories", config.categories, width)
        self.touched = nn.Parameter(torch.randn(width) * 0.1)
        self.encoder = nn.ModuleList(EchoLayer(width, 2 * len(config.predicates)) for _ in range(layers))
        self.mix = nn.Linear(2 * width, width)
        self.manipulator = nn.ModuleList(EchoLayer(width, 2 * len(config.predicates)) for _ in range(layers))
        self.norm = nn.LayerNorm(width)

    def forward(
        self,
        category: Tensor,
        pairs: Pairs,
        *,
        before: Pairs | None = None,
        added: Tensor | None = None,
        touched: Tensor | None = None,
    ) -> Tensor:
        """Latent nodes of the edited graph.

        Arguments:
            category: (N,) int64, classes of the edited graph's nodes.
            pairs: relations of the edited graph.
            before: relations before the edit over the same nodes, None = there was no edit.
            added: (N,) bool, nodes that were not there before.
            touched: (N,) bool, nodes that were added or that an edited relation meets.
        """
        classes = self.category(category)
        z = classes
        source = pairs if before is None else before
        for layer in self.encoder:
            z = layer(z, source)
        if added is not None:
            z = z * ~added[:, None]
        known = classes if touched is None else classes + touched[:, None] * self.touched
        z = self.mix(torch.cat([z, known], dim=1))
        for layer in self.manipulator:
            z = layer(z, pairs)
        return self.norm(z)
