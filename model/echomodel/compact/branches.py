"""The parts of the compact model, each registered once under the name of its settings in `CompactConfig`.

A branch is a part that gives something of a room: boxes, shapes, furniture. A further branch is a module with its
network and its sampling, its settings in `CompactConfig`, its row here, and a training stage in `echomodel.training`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor, nn

from echomodel.compact.autoencoder import Autoencoder
from echomodel.compact.echo import EchoLayer
from echomodel.compact.furniture import FurnitureDenoiser
from echomodel.compact.layout import LayoutDenoiser
from echomodel.compact.learned import WordTable
from echomodel.compact.pairs import Pairs
from echomodel.compact.shape import ShapeDenoiser
from echomodel.config import CompactConfig, FurnitureConfig


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


MEASURES = 2  # set of measures of the drafts that this version computes


def _usable(settings: Mapping[str, Any]) -> str | None:
    return None


@dataclass(frozen=True)
class Part:
    """What weights files and the model know of a part.

    Arguments:
        module: builds it from the whole configuration.
        needs: other parts without which it gives nothing.
        branch: whether it gives something of a room.
        outdated: settings as a weights file holds them -> why this version cannot use them, None = it can.
    """

    module: Callable[[CompactConfig], nn.Module]
    needs: tuple[str, ...] = ()
    branch: bool = False
    outdated: Callable[[Mapping[str, Any]], str | None] = _usable


def _outdated_layout(settings: Mapping[str, Any]) -> str | None:
    if "drafts" not in settings:
        return "whose layout branch did not draft; train it again"
    if settings.get("measures", 1) != MEASURES:
        return "whose layout branch knew no doors and windows; start a training from it with the recipe's field 'warm'"
    return None


def _outdated_furniture(settings: Mapping[str, Any]) -> str | None:
    known = FurnitureConfig()
    told = tuple(settings.get("kinds", known.kinds)), settings.get("numbers", known.numbers)
    if told != (known.kinds, known.numbers):
        return "whose furniture was described in other words; train it again"
    return None


PARTS: dict[str, Part] = {
    "latent": Part(LatentGraph),
    "layout": Part(LayoutDenoiser, ("latent",), branch=True, outdated=_outdated_layout),
    "autoencoder": Part(Autoencoder),
    "shape": Part(ShapeDenoiser, ("latent", "autoencoder"), branch=True),
    "furniture": Part(FurnitureDenoiser, ("latent",), branch=True, outdated=_outdated_furniture),
}


def branches(parts: Iterable[str]) -> frozenset[str]:
    """Names of the branches among `parts` that have what they need beside them."""
    there = set(parts)
    return frozenset(name for name in there if PARTS[name].branch and there.issuperset(PARTS[name].needs))
