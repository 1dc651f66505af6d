"""Pieces of the furniture programs as part tokens in one file, for the training that denoises tokens."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from echomodel.data.furniture import Choices, Style, sample_size, solids
from echomodel.data.furniture.mirroring import tokens_of
from echomodel.data.furniture.tokens import WIDTH
from echomodel.files import whole_file
from echomodel.vocabulary import vocabulary

NAME = "tokens.npz"
HELD = 0.05  # share of the styles that are for validation


@dataclass(frozen=True, eq=False)
class TokenSet:
    """P pieces; those of one style lie behind one another.

    Arguments:
        tokens: (sum of T, WIDTH) float16. count: (P,) int64, tokens of each piece.
        category: (P,) int64. size: (P, 3) float32, metres. style: (P,) int64, its number.
    """

    tokens: np.ndarray
    count: np.ndarray
    category: np.ndarray
    size: np.ndarray
    style: np.ndarray

    @classmethod
    def load(cls, folder: Path) -> TokenSet:
        """The set that `build_tokens` wrote; raises ValueError for a folder without one."""
        try:
            with np.load(folder / NAME, allow_pickle=False) as held:
                found = cls(**{name: held[name] for name in ("tokens", "count", "category", "size", "style")})
        except (OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile) as error:
            raise ValueError(f"{folder / NAME}: no set of part tokens ({error})") from None
        if found.tokens.shape != (found.count.sum(), WIDTH):
            raise ValueError(
                f"{folder / NAME}: tokens are {found.tokens.shape}, expected (.., {WIDTH}); build it again"
            )
        return found

    @property
    def first_held(self) -> int:
        """The first style that is for validation, as all behind it are: at least one."""
        styles = int(self.style.max()) + 1
        return styles - max(1, round(HELD * styles))


def build_tokens(folder: Path, styles: int, pieces: int, seed: int) -> None:
    """Write a set: so many styles, of each so many pieces of different classes, sizes by `sample_size`."""
    words = [category.name for category in vocabulary().categories]
    rows: dict[str, list] = {name: [] for name in ("tokens", "count", "category", "size", "style")}
    for number in range(styles):
        rng = np.random.default_rng([seed, number])
        style = Style.draw(rng)
        for category in rng.permutation(len(words))[:pieces]:
            size = sample_size(words[category], rng, style)
            tokens = tokens_of(solids(words[category], style, Choices.draw(rng), size), size)
            for name, value in zip(rows, (tokens, len(tokens), category, size, number), strict=True):
                rows[name].append(value)
    folder.mkdir(parents=True, exist_ok=True)
    with whole_file(folder / NAME) as beside, beside.open("wb") as out:
        np.savez(
            out, tokens=np.concatenate(rows["tokens"]).astype(np.float16), count=np.array(rows["count"]),
            category=np.array(rows["category"]), size=np.array(rows["size"], np.float32), style=np.array(rows["style"]),
        )  # fmt: skip
