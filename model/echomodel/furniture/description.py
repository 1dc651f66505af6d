"""A piece of furniture as a vector: what its style says and what it leaves open, the same places in every class.

A kind is told by one number per word, +1 for the one that holds; a proportion or an open choice by one number in
[-1, 1]. Every vector is a description: of a kind the largest number counts, other numbers are cut at their ends.
"""

from __future__ import annotations

from itertools import accumulate
from typing import Any

import numpy as np

from echomodel.furniture.style import FAMILIES, KINDS, OPEN, PROPORTIONS, Choices, Style

WORDS: dict[str, tuple[str, ...]] = {"family": tuple(FAMILIES), **KINDS}
GROUPS = tuple(len(words) for words in WORDS.values())  # numbers per kind, in order
HOT = sum(GROUPS)
STYLE = HOT + len(PROPORTIONS)
WIDTH = STYLE + len(OPEN)
STARTS = tuple(accumulate(GROUPS, initial=0))
_LOW, _HIGH = np.array(list(PROPORTIONS.values())).T


def described(style: Style, choices: Choices) -> np.ndarray:
    """(WIDTH,) float32, the vector that `piece_of` turns back."""
    out = np.full(WIDTH, -1.0, np.float32)
    for start, (name, words) in zip(STARTS, WORDS.items(), strict=False):
        out[start + words.index(getattr(style, name))] = 1.0
    numbers = np.array([getattr(style, name) for name in PROPORTIONS])
    out[HOT:STYLE] = 2 * (numbers - _LOW) / (_HIGH - _LOW) - 1
    out[STYLE:] = 2 * choices.values - 1
    return out


def piece_of(vector: np.ndarray) -> tuple[Style, Choices]:
    """The style and the open choices that a vector (WIDTH,) describes.

    Raises ValueError for a vector of another width or with numbers that are not finite.
    """
    vector = np.asarray(vector, float)
    if vector.shape != (WIDTH,) or not np.isfinite(vector).all():
        raise ValueError(f"description is {np.shape(vector)} {vector.dtype}, expected ({WIDTH},) finite numbers")
    told: dict[str, Any] = {
        name: words[int(vector[start : start + len(words)].argmax())]
        for start, (name, words) in zip(STARTS, WORDS.items(), strict=False)
    }
    share = (vector[HOT:].clip(-1, 1) + 1) / 2
    numbers = _LOW + (_HIGH - _LOW) * share[: len(PROPORTIONS)]
    told |= dict(zip(PROPORTIONS, numbers.tolist(), strict=True))
    return Style(**told, size_shift=(0.0, 0.0, 0.0)), Choices(share[len(PROPORTIONS) :])


def draw_styles(count: int, rng: np.random.Generator) -> np.ndarray:
    """(count, STYLE) float32: the style's share of the vector of so many styles, drawn as `Style.draw` draws them."""
    rest = Choices(np.zeros(len(OPEN)))
    return np.stack([described(Style.draw(rng), rest)[:STYLE] for _ in range(count)])
