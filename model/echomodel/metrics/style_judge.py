"""A judge of style for pieces however they were made: it reads off their tokens what style a program was told."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor, nn

from echomodel.data.furniture import Choices, Style
from echomodel.data.furniture.description import GROUPS, HOT, STYLE, described
from echomodel.data.furniture.mirroring import tokens_of
from echomodel.data.furniture.solids import Solid
from echomodel.data.furniture.tokens import WIDTH
from echomodel.data.tokenset import TokenSet

BATCH = 128


class StyleJudge(nn.Module):
    """Says the style behind a piece: tokens (T, WIDTH) of N pieces, (T,) whose, (N,) classes -> (N, STYLE)."""

    def __init__(self, categories: int, width: int = 128) -> None:
        super().__init__()
        self.category = nn.Embedding(categories, width)
        self.token = nn.Sequential(nn.Linear(WIDTH, width), nn.SiLU(), nn.Linear(width, width), nn.SiLU())
        self.head = nn.Sequential(nn.Linear(3 * width, 2 * width), nn.SiLU(), nn.Linear(2 * width, STYLE))

    def forward(self, tokens: Tensor, piece: Tensor, category: Tensor) -> Tensor:
        h = self.token(tokens)
        none = h.new_zeros(len(category), h.shape[1])
        mean = none.index_add(0, piece, h) / torch.bincount(piece, minlength=len(category))[:, None]
        most = none.scatter_reduce(0, piece[:, None].expand_as(h), h, "amax", include_self=False)
        return self.head(torch.cat([mean, most, self.category(category)], dim=1))

    @torch.no_grad()
    def styles(self, pieces: Sequence[Sequence[Solid]], category: Tensor, sizes: np.ndarray) -> Tensor:
        """(N, STYLE) styles of N pieces of solids in boxes `sizes` (N, 3), metres."""
        return self(*packed([tokens_of(s, size) for s, size in zip(pieces, sizes, strict=True)]), category)


def packed(tokens: Sequence[np.ndarray]) -> tuple[Tensor, Tensor]:
    """(T, WIDTH) float32 and (T,) int64, whose they are, of N sets of tokens."""
    piece = torch.arange(len(tokens)).repeat_interleave(torch.tensor([len(one) for one in tokens]))
    return torch.from_numpy(np.concatenate(tokens)).float(), piece


def trained_judge(pieces: TokenSet, seed: int, steps: int = 1500) -> tuple[StyleJudge, dict[str, float]]:
    """A judge that learnt from a set that `build_tokens` drew with this seed, and how well it knows styles held out.

    Returns the share of the words that it names and the mean error of the numbers on [-1, 1].
    """
    torch.manual_seed(0)
    rng = np.random.default_rng(0)
    styles = int(pieces.style.max()) + 1
    rest = Choices(np.zeros(18))
    told = np.stack([described(Style.draw(np.random.default_rng([seed, n])), rest)[:STYLE] for n in range(styles)])
    starts = np.cumsum(pieces.count) - pieces.count
    held = pieces.style >= pieces.first_held
    judge = StyleJudge(int(pieces.category.max()) + 1)
    optimizer = torch.optim.AdamW(judge.parameters(), 2e-3)
    rates = torch.optim.lr_scheduler.OneCycleLR(optimizer, 2e-3, total_steps=steps)

    def batch(rows: np.ndarray) -> tuple[Tensor, Tensor]:
        tokens = [pieces.tokens[starts[n] : starts[n] + pieces.count[n]] for n in rows]
        return judge(*packed(tokens), torch.from_numpy(pieces.category[rows])), torch.from_numpy(
            told[pieces.style[rows]]
        )

    for _ in range(steps):
        said, true = batch(rng.choice(np.flatnonzero(~held), BATCH))
        loss = (said[:, HOT:] - true[:, HOT:]).square().mean()
        for word, right in zip(said[:, :HOT].split(GROUPS, 1), true[:, :HOT].split(GROUPS, 1), strict=True):
            loss = loss + nn.functional.cross_entropy(word, right.argmax(1)) / len(GROUPS)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        rates.step()
    judge.eval()
    with torch.no_grad():
        said, true = batch(np.flatnonzero(held))
    words = zip(said[:, :HOT].split(GROUPS, 1), true[:, :HOT].split(GROUPS, 1), strict=True)
    right = [float((word.argmax(1) == told.argmax(1)).float().mean()) for word, told in words]
    return judge, {"words": float(np.mean(right)), "numbers": float((said - true)[:, HOT:].abs().mean())}
