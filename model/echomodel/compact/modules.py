"""The networks as modules of torch: what they are made of, how they begin, and what training keeps of them."""

import torch
from torch import Tensor, nn

from echomodel.compact.furniture import Furniture
from echomodel.compact.layout import BOX, PAIR_FEATURES, WALL_FEATURES, Layout
from echomodel.compact.learned import Names, places
from echomodel.compact.pairs import Echo, Latents, Pairs
from echomodel.config import CompactConfig
from echomodel.surroundings import GRID, OPENING_FEATURES, PLAN


class WordTable(nn.Embedding):
    """Vectors of words, one row for each that the weights name.

    Arguments:
        kind: `categories` or `room_types`. names: of the rows. width: of the vectors.

    Shapes:
        (...) int64, positions in today's vocabulary -> (..., width)
    """

    def __init__(self, kind: str, names: Names, width: int) -> None:
        super().__init__(len(names), width)
        self.kind, self.names = kind, names

    def forward(self, input: Tensor) -> Tensor:
        return super().forward(places(self.kind, self.names, input))


def silence(*layers: nn.Module) -> None:
    """Have layers begin with nothing to say: weights and biases of zeros."""
    for value in (value for layer in layers for value in layer.parameters()):
        nn.init.zeros_(value)


class EchoLayer(Echo, nn.Module):
    """An echo.

    Arguments:
        width: channels of a node.
        stated: channels of `Pairs.stated`.
    """

    def __init__(self, width: int, stated: int) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(width)
        self.ends = nn.Linear(width, 2 * width)
        self.told = nn.Linear(stated, width, bias=False)
        self.message = nn.Linear(width, width)
        self.norm_mlp = nn.LayerNorm(width)
        self.mlp = nn.Sequential(nn.Linear(width, 2 * width), nn.SiLU(), nn.Linear(2 * width, width))
        nn.init.normal_(self.told.weight, std=0.5)


class Alone(nn.Module):
    """An echo layer's perceptron without its echo, for the ablation; as deep and a little wider."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(width)
        self.mlp = nn.Sequential(nn.Linear(width, 4 * width), nn.SiLU(), nn.Linear(4 * width, width))

    def forward(self, x: Tensor, pairs: Pairs, modulation: Tensor) -> Tensor:
        scale, shift = modulation.chunk(2, dim=1)
        return x + self.mlp(self.norm(x) * (1 + scale) + shift)


class LatentGraph(Latents, nn.Module):
    """The latent graph."""

    def __init__(self, config: CompactConfig) -> None:
        super().__init__()
        width, layers = config.latent.width, config.latent.layers
        self.category = WordTable("categories", config.categories, width)
        self.touched = nn.Parameter(torch.randn(width) * 0.1)
        self.encoder = nn.ModuleList(EchoLayer(width, 2 * len(config.predicates)) for _ in range(layers))
        self.mix = nn.Linear(2 * width, width)
        self.manipulator = nn.ModuleList(EchoLayer(width, 2 * len(config.predicates)) for _ in range(layers))
        self.norm = nn.LayerNorm(width)


class LayoutDenoiser(Layout, nn.Module):
    """The denoiser of boxes.

    `config`: its `layout` and what it shares with the other parts.

    Raises ValueError for a negative number of drafts, or fewer layers than drafts and the last prediction need.
    """

    def __init__(self, config: CompactConfig) -> None:
        super().__init__()
        layout, width = config.layout, config.layout.width
        self.settings = layout
        each, rest = divmod(layout.layers, max(layout.drafts, 0) + 1)
        if layout.drafts < 0 or not each:
            raise ValueError(f"layout.layers {layout.layers} are too few for layout.drafts {layout.drafts}")
        self.category = WordTable("categories", config.categories, width)
        self.room_type = WordTable("room_types", config.room_types, width)
        self.rules = nn.Embedding(len(config.rules), width)
        self.floor = nn.Sequential(nn.Linear(6 + GRID**2, width), nn.SiLU(), nn.Linear(width, width))
        self.opening = nn.Sequential(nn.Linear(PLAN, width), nn.SiLU(), nn.Linear(width, width))
        self.tidy = nn.Embedding(2, width)  # the weights that ship knew shaken rooms; the second row is for others
        self.latent = nn.Linear(config.latent.width, width)
        self.box = nn.Linear(BOX * (1 + 2 * layout.frequencies), width)
        self.known = nn.Parameter(torch.randn(width) * 0.02)
        self.level = nn.Sequential(nn.Linear(64, 128), nn.SiLU())
        self.modulation = nn.Linear(128, 2 * width * layout.layers)
        measured = BOX * (1 + 2 * layout.frequencies) + WALL_FEATURES + OPENING_FEATURES
        self.rounds = nn.ModuleList(
            nn.ModuleList(
                EchoLayer(width, 2 * len(config.predicates) + PAIR_FEATURES * (n > 0)) if layout.echo else Alone(width)
                for _ in range(layers)
            )
            for n, layers in enumerate([each + rest] + [each] * layout.drafts)
        )
        self.measured = nn.ModuleList(nn.Linear(measured, width) for _ in range(layout.drafts))
        self.norms = nn.ModuleList(nn.LayerNorm(width) for _ in self.rounds)
        self.heads = nn.ModuleList(nn.Linear(width, BOX) for _ in self.rounds)
        for table in (self.category, self.room_type, self.rules):
            nn.init.normal_(table.weight, std=0.3)
        nn.init.zeros_(self.tidy.weight)
        silence(self.modulation, self.opening[-1], *self.heads)


class FurnitureDenoiser(Furniture, nn.Module):
    """The denoiser of descriptions of furniture; `config`: its `furniture` and what it shares with the other parts."""

    def __init__(self, config: CompactConfig) -> None:
        super().__init__()
        own, width = config.furniture, config.furniture.width
        values = sum(own.kinds) + own.numbers
        self.settings = own
        self.category = WordTable("categories", config.categories, width)
        self.room_type = WordTable("room_types", config.room_types, width)
        self.size = nn.Sequential(nn.Linear(3, width), nn.SiLU(), nn.Linear(width, width))
        self.latent = nn.Linear(config.latent.width, width)
        self.own = nn.Linear(values, width)
        self.level = nn.Sequential(nn.Linear(64, 128), nn.SiLU())
        self.modulation = nn.Linear(128, 2 * width * own.layers)
        stated = 2 * len(config.predicates)
        self.trust = nn.Sequential(nn.Linear(stated, 32), nn.SiLU(), nn.Linear(32, own.voices)) if own.echo else None
        self.heard = nn.Linear(own.voices * (values + 1), width) if own.echo else None
        self.layers = nn.ModuleList(
            (EchoLayer(width, stated) if own.echo else Alone(width)) for _ in range(own.layers)
        )  # fmt: skip
        self.norm = nn.LayerNorm(width)
        self.head = nn.Linear(width, values)
        for table in (self.category, self.room_type):
            nn.init.normal_(table.weight, std=0.3)
        silence(self.modulation, self.head)
