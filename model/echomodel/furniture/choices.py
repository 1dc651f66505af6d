"""What a style leaves open about one piece: named numbers, drawn to make data, read off a description later."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

T = TypeVar("T")

# A name means much the same in all programs, so that pieces can agree on it: `rows` are rows of drawers or of shelves.
OPEN = (
    "kind",
    "form",
    "count",
    "rows",
    "columns",
    "split",
    "share",
    "spread",
    "side",
    "symmetry",
    "extra",
    "second",
    "back",
    "raised",
    "front",
    "cover",
    "pattern",
    "detail",
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

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Choices:
        """All open choices at random."""
        return cls(rng.random(len(OPEN)))

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
