"""The tokens stage: denoising the solids of the furniture of suites one by one, joined by their echoes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import cross_entropy

from echomodel.compact.model import CompactModel
from echomodel.compact.pairs import Pairs, pairs_of
from echomodel.data.furniture import tokens as words
from echomodel.data.tokenset import TokenSet
from echomodel.graph import GraphBatch
from echomodel.objectives import add_noise, draw_levels
from echomodel.randomness import normal
from echomodel.training.layout_stage import draw_known
from echomodel.training.shape_stage import shifted
from echomodel.training.start import Start, data_folder
from echomodel.vocabulary import vocabulary

SUITE = 4  # pieces in a suite
SILENT = 0.3  # share of the suites whose graph says nothing of styles
OTHER = 0.25  # share of the pieces that are of the suite's second style
LOWEST = 0.1  # level below which the weight of an error stops growing
NUMBERS, COUNTS = 6.0, 0.1  # weights of the numbers and of how many there are against the words


@dataclass(frozen=True, eq=False)
class TokenBatch:
    """Suites with the tokens of every piece.

    Arguments:
        graph, pairs: N nodes. size: (N, 3) float32, metres. tokens: (N, M, D) float32. count: (N,) int64.
    """

    graph: GraphBatch
    pairs: Pairs
    size: Tensor
    tokens: Tensor
    count: Tensor

    def to(self, device: torch.device | str) -> TokenBatch:
        """The same batch on another device."""
        moved = [value.to(device) for value in (self.graph, self.pairs, self.size, self.tokens, self.count)]
        return TokenBatch(*moved)  # type: ignore[arg-type]


def used_numbers(clean: Tensor) -> Tensor:
    """(N, M, numbers) float32: weight of every number that the token's kind and joint use, 0 for the others."""
    out = torch.ones(*clean.shape[:2], words.WIDTH - words.HOT, device=clean.device)
    kind = clean[..., : words.GROUPS[0]].argmax(-1)
    used = torch.tensor([words.USED[name] for name in words.KINDS], device=clean.device)[kind]
    start = words.SHAPE.start - words.HOT
    out[..., start:] = 0.5 * (torch.arange(out.shape[-1] - start, device=clean.device) < used[..., None])
    joint = words.STARTS["joint"]
    moves = clean[..., joint : joint + len(words.JOINTS)].argmax(-1) > 0
    out[..., words.BODY.start - words.HOT : words.BODY.stop - words.HOT] = 0.5 * moves[..., None]
    for part, weight in ((words.CENTRE, 3.0), (words.EXTENT, 3.0)):
        out[..., part.start - words.HOT : part.stop - words.HOT] = weight
    return out


def tokens_loss(model: CompactModel, batch: TokenBatch, generator: torch.Generator) -> tuple[Tensor, dict[str, Tensor]]:
    """Denoising loss of the unknown pieces' tokens: cross entropy of the words, squares of the numbers in use."""
    settings, clean, scene = model.config.tokens, batch.tokens, batch.graph.scene
    known = draw_known(scene, batch.graph.num_scenes, generator)
    level = shifted(draw_levels(batch.graph.num_scenes, generator, clean.device))[scene] * ~known
    noise = normal(clean.shape, generator, clean.device)
    noisy = torch.where(known[:, None, None], clean, add_noise(clean, noise, level, settings.objective))
    with torch.no_grad():
        latent = model.latent(batch.graph.category, batch.pairs)
    context = model.tokens.context(batch.graph, batch.size, batch.pairs, latent, batch.count)
    there = context.mask & ~known[:, None]
    scores = model.tokens.scores(noisy, level, context).float()[there]
    true, weight = clean[there], (1 / level.clamp_min(LOWEST))[:, None].expand_as(there)[there]
    *said, numbers = scores.split([*settings.kinds, settings.numbers], dim=1)
    hot = sum(settings.kinds)
    right = true[:, :hot].split(settings.kinds, dim=1)
    surprise = [cross_entropy(s, r.argmax(1), reduction="none") for s, r in zip(said, right, strict=True)]
    use = used_numbers(clean)[there]
    off = ((numbers - true[:, hot:]).square() * use).sum(1) / use.sum(1)
    total = max(len(true), 1)
    kinds = (torch.stack(surprise).mean(0) * weight).sum() / total
    squares = (off * weight).sum() / total
    counts = cross_entropy(model.tokens.counts(context.nodes), batch.count - 1)
    loss = kinds + NUMBERS * squares + COUNTS * counts
    return loss, {"kinds": kinds, "numbers": squares, "counts": counts}


class TokensStage:
    """What the trainer needs to know about part tokens.

    Arguments:
        pieces: the set that `echomodel.data.tokenset.build_tokens` wrote. nodes: node budget of a batch.
    """

    trained = saved = ("tokens",)
    parts: ClassVar[tuple[str, ...]] = ("latent", "tokens")
    needs: ClassVar[tuple[str, ...]] = ("latent",)

    def __init__(self, pieces: TokenSet, nodes: int) -> None:
        self.pieces, self.nodes = pieces, nodes
        self.starts = np.cumsum(pieces.count) - pieces.count
        last = int(pieces.style.max()) + 1
        self.first = np.searchsorted(pieces.style, np.arange(last + 1))
        self.train = pieces.first_held

    @classmethod
    def open(cls, start: Start) -> TokensStage:
        """The stage of a recipe."""
        return cls(TokenSet.load(data_folder(start.recipe, "tokens")), start.recipe.nodes)

    def draw(self, count: int, generator: torch.Generator, *, held: bool = False) -> TokenBatch:
        """So many suites of one style, or of two, told which belong together in most."""
        styles = np.arange(self.train, len(self.first) - 1) if held else np.arange(self.train)
        rng = np.random.default_rng(int(torch.randint(2**31, (1,), generator=generator)))
        two = rng.choice(styles, (count, 2))
        style = np.where(rng.random((count, SUITE)) < OTHER, two[:, 1:], two[:, :1]).ravel()
        piece = self.first[style] + rng.integers(0, self.first[style + 1] - self.first[style])
        scene = np.repeat(np.arange(count), SUITE)
        speaks = (rng.random(count) >= SILENT)[scene]
        at, to = np.nonzero(
            (scene[:, None] == scene) & (style[:, None] == style) & speaks & ~np.eye(len(scene), dtype=bool)
        )
        same = vocabulary().predicate_id("same_style_as")
        graph = GraphBatch(
            category=torch.from_numpy(self.pieces.category[piece]), scene=torch.from_numpy(scene),
            triplets=torch.from_numpy(np.stack([at, np.full_like(at, same), to], axis=1)),
            room_type=torch.from_numpy(rng.integers(0, len(vocabulary().room_types), count)),
            floor=torch.full((count, 4, 2), torch.nan),
        )  # fmt: skip
        tokens = np.zeros((len(piece), int(self.pieces.count[piece].max()), words.WIDTH), np.float32)
        for row, number in enumerate(piece):
            start, many = self.starts[number], self.pieces.count[number]
            tokens[row, :many] = self.pieces.tokens[start : start + many]
        size, many = torch.from_numpy(self.pieces.size[piece]), torch.from_numpy(self.pieces.count[piece])
        return TokenBatch(graph, pairs_of(graph), size, torch.from_numpy(tokens), many)

    def loss(self, model: CompactModel, generator: torch.Generator) -> tuple[Tensor, dict[str, Tensor]]:
        """Loss of one random batch."""
        return tokens_loss(model, self.draw(self.nodes // SUITE, generator).to(model.device), generator)

    @torch.no_grad()
    def validate(self, model: CompactModel) -> dict[str, float]:
        """Losses on suites of held-out styles, the same draws every time."""
        generator = torch.Generator().manual_seed(0)
        found: dict[str, list[float]] = {}
        for _ in range(4):
            _, parts = tokens_loss(model, self.draw(16, generator, held=True).to(model.device), generator)
            for name, value in parts.items():
                found.setdefault(f"held/{name}", []).append(float(value))
        return {name: float(np.mean(values)) for name, values in found.items()}
