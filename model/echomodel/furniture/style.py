"""A style, what the pieces of one suite share, of a family of furniture making; what it leaves open; both as one
vector, a description, with the same places in every class.

A kind is told by one number per word, +1 for the one that holds; a proportion or an open choice by one number in
[-1, 1]. Every vector is a description: of a kind the largest number counts, other numbers are cut at their ends.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Any, TypeVar

import numpy as np

from echomodel.files import tables
from echomodel.rows import RoomStyle

_ROWS = tables("families.toml", __file__)
BUILD: dict[str, tuple[float, float]] = {name: (row.pop("bulk"), row.pop("soft")) for name, row in _ROWS.items()}
FAMILIES: dict[str, dict[str, dict[str, float]]] = _ROWS  # per family and part: how often each kind occurs
KINDS: dict[str, tuple[str, ...]] = {
    part: tuple(dict.fromkeys(kind for family in FAMILIES.values() for kind in family[part]))
    for part in FAMILIES["modern"]
}
# From where to where the numbers of a style are drawn, in this order; the last ones after its sizes.
DRAWN: dict[str, tuple[float, float]] = {
    "bulk": (0.85, 1.2), "splay": (5, 13), "rake": (3, 16), "taper": (0.4, 0.8), "leg_height": (0.04, 0.2),
    "softness": (-0.25, 0.3), "corner": (0.0, 1.0), "top": (0.018, 0.05), "overhang": (0.0, 0.05), "gap": (0.004, 0.01),
    "round_tops": (0.0, 1.0), "tufting": (0.0, 1.0), "contrast": (0.0, 1.0), "arm_height": (0.0, 1.0),
    "seat_depth": (0.0, 1.0),
}  # fmt: skip
DRAWN_LAST: dict[str, tuple[float, float]] = {"edge": (0.0, 1.0), "piping": (0.0, 1.0), "finish": (0.0, 1.0)}
# Least and largest value of every proportion that `drawn.draw_style` makes of them.
PROPORTIONS = DRAWN | {
    "bulk": (0.85 * 0.85, 1.3 * 1.2), "splay": (math.radians(5), math.radians(13)),
    "rake": (math.radians(3), math.radians(16)), "softness": (0.05, 1.0),
} | DRAWN_LAST  # fmt: skip


@dataclass(frozen=True)
class Style:
    """What the pieces of one suite share: kinds of parts, proportions (0 to 1 where not said otherwise) and looks.

    Lengths are metres; `bulk` scales thicknesses (about 1), `splay` and `rake` are angles in radians.
    """

    family: str
    legs: str
    profile: str
    back: str
    arms: str
    headboard: str
    fronts: str
    handles: str
    shade: str
    bulk: float
    splay: float
    rake: float
    taper: float
    leg_height: float
    softness: float
    corner: float
    top: float
    overhang: float
    gap: float
    round_tops: float
    tufting: float
    contrast: float
    arm_height: float
    seat_depth: float
    edge: float
    piping: float
    finish: float
    size_shift: tuple[float, float, float]


T = TypeVar("T")

# A name means much the same in all programs, so that pieces can agree on it: `rows` are rows of drawers or of shelves.
OPEN = (
    "kind", "form", "count", "rows", "columns", "split", "share", "spread", "side", "symmetry", "extra", "second",
    "back", "raised", "front", "cover", "pattern", "detail",
)  # fmt: skip
GRAINS = 4096  # different streams that one number can make


@dataclass(frozen=True, eq=False)
class Choices:
    """The open choices of one piece, (len(OPEN),) float in [0, 1); programs ask them by name."""

    values: np.ndarray

    def __post_init__(self) -> None:
        values = np.asarray(self.values, float)
        if values.shape != (len(OPEN),) or not np.isfinite(values).all():
            raise ValueError(f"open choices are {np.shape(self.values)}, expected ({len(OPEN)},) finite numbers")
        object.__setattr__(self, "values", values.clip(0.0, 1.0 - 1e-9))

    def number(self, name: str) -> float:
        """The number in [0, 1) behind a name of `OPEN`."""
        return float(self.values[OPEN.index(name)])

    def chance(self, name: str, share: float) -> bool:
        """True for this share of the pieces."""
        return self.number(name) < share

    def between(self, name: str, low: float, high: float) -> float:
        """A number from `low` to `high`, all alike likely."""
        return low + (high - low) * self.number(name)

    def whole(self, name: str, low: int, high: int) -> int:
        """A whole number from `low` to below `high`."""
        return low + int((high - low) * self.number(name))

    def pick(self, name: str, options: Sequence[T], weights: Sequence[float] | None = None) -> T:
        """One of the options, by weight."""
        share = np.cumsum(np.ones(len(options)) if weights is None else np.asarray(weights, float))
        return options[min(int(np.searchsorted(share / share[-1], self.number(name), "right")), len(options) - 1)]

    def stream(self, name: str) -> np.random.Generator:
        """A source of numbers that all follow from one, for what repeats: books, bins, leaves."""
        return np.random.default_rng([OPEN.index(name), int(GRAINS * self.number(name))])


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


def piece_of(vector: np.ndarray, room: RoomStyle | None = None) -> tuple[Style, Choices]:
    """The style and the open choices that a vector (WIDTH,) describes: kinds of a family, or of the style `room`.

    Raises ValueError for a vector of another width or with numbers that are not finite.
    """
    vector = np.asarray(vector, float)
    if vector.shape != (WIDTH,) or not np.isfinite(vector).all():
        raise ValueError(f"description is {np.shape(vector)} {vector.dtype}, expected ({WIDTH},) finite numbers")
    scores = {
        name: dict(zip(words, vector[start : start + len(words)], strict=True))
        for start, (name, words) in zip(STARTS, WORDS.items(), strict=False)
    }
    family = room.family if room else max(FAMILIES, key=scores["family"].__getitem__)
    kinds = {part: tuple(odds) for part, odds in FAMILIES[family].items()} | dict(room.kinds if room else ())
    words: dict[str, Any] = {part: max(allowed, key=scores[part].__getitem__) for part, allowed in kinds.items()}
    share = (vector[HOT:].clip(-1, 1) + 1) / 2
    numbers = _LOW + (_HIGH - _LOW) * share[: len(PROPORTIONS)]
    words |= dict(zip(PROPORTIONS, numbers.tolist(), strict=True))
    return Style(family, **words, size_shift=(0.0, 0.0, 0.0)), Choices(share[len(PROPORTIONS) :])
