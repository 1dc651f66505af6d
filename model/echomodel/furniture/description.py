"""A piece of furniture as a vector: what its style says and what it leaves open, the same places in every class.

A kind is told by one number per word, +1 for the one that holds; a proportion or an open choice by one number in
[-1, 1]. Every vector is a description: of a kind the largest number counts, other numbers are cut at their ends.
"""

from __future__ import annotations

from itertools import accumulate
from typing import Any

import numpy as np

from echomodel.furniture.style import FAMILIES, KINDS, OPEN, PROPORTIONS, Choices, Style
from echomodel.rows import RoomStyle

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


def piece_of(vector: np.ndarray, told: RoomStyle | None = None) -> tuple[Style, Choices]:
    """The style and the open choices that a vector (WIDTH,) describes: kinds that a family has, or the style `told`.

    Raises ValueError for a vector of another width or with numbers that are not finite.
    """
    vector = np.asarray(vector, float)
    if vector.shape != (WIDTH,) or not np.isfinite(vector).all():
        raise ValueError(f"description is {np.shape(vector)} {vector.dtype}, expected ({WIDTH},) finite numbers")
    scores = {
        name: dict(zip(words, vector[start : start + len(words)], strict=True))
        for start, (name, words) in zip(STARTS, WORDS.items(), strict=False)
    }
    family = told.family if told else max(FAMILIES, key=scores["family"].__getitem__)
    kinds = {part: tuple(odds) for part, odds in FAMILIES[family].items()} | dict(told.kinds if told else ())
    words: dict[str, Any] = {part: max(allowed, key=scores[part].__getitem__) for part, allowed in kinds.items()}
    share = (vector[HOT:].clip(-1, 1) + 1) / 2
    numbers = _LOW + (_HIGH - _LOW) * share[: len(PROPORTIONS)]
    words |= dict(zip(PROPORTIONS, numbers.tolist(), strict=True))
    return Style(family, **words, size_shift=(0.0, 0.0, 0.0)), Choices(share[len(PROPORTIONS) :])


def draw_styles(count: int, rng: np.random.Generator) -> np.ndarray:
    """(count, STYLE) float32: the style's share of the vector of so many styles, drawn as `Style.draw` draws them."""
    rest = Choices(np.zeros(len(OPEN)))
    return np.stack([described(Style.draw(rng), rest)[:STYLE] for _ in range(count)])
