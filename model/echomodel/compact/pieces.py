"""What both denoisers of furniture share: what they know of a piece before its noise, and how they say words."""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import Tensor, nn

from echomodel.config import CompactConfig, FurnitureConfig, TokensConfig
from echomodel.graph import GraphBatch


class PieceDenoiser(nn.Module):
    """Knows class, box, room and latent of every piece; says words as probabilities, and numbers up to `reach`.

    Arguments:
        config: of the model. own: of the branch.
    """

    reach: ClassVar[float] = 1.0

    def __init__(self, config: CompactConfig, own: FurnitureConfig | TokensConfig) -> None:
        super().__init__()
        width = own.width
        self.kinds, self.numbers = own.kinds, own.numbers
        self.values = sum(own.kinds) + own.numbers
        self.category = nn.Embedding(config.categories, width)
        self.room_type = nn.Embedding(config.room_types, width)
        self.size = nn.Sequential(nn.Linear(3, width), nn.SiLU(), nn.Linear(width, width))
        self.latent = nn.Linear(config.latent.width, width)

    def nodes(self, graph: GraphBatch, size: Tensor, latent: Tensor) -> Tensor:
        """(N, width) of N nodes, boxes of (N, 3) metres and the graph manipulator's output (N, latent width)."""
        nodes = self.category(graph.category) + self.size(size.clamp_min(0.01).log()) + self.latent(latent)
        return nodes + self.room_type(graph.room_type)[graph.scene]

    def clean(self, scores: Tensor) -> Tensor:
        """(..., D) that scores (..., D) stand for: each word's probability on [-1, 1], numbers cut."""
        *words, numbers = scores.split([*self.kinds, self.numbers], dim=-1)
        said = [2 * torch.softmax(part, dim=-1) - 1 for part in words]
        return torch.cat([*said, numbers.clamp(-self.reach, self.reach)], dim=-1)
