"""Intervals, paired tests and their power for figures that are sums over rooms."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

RESAMPLES = 2000
LEVEL, POWERED = 0.95, 2.8  # 2.8 standard errors: found at 5 % in four of five repetitions
Pair = tuple[float | Sequence[float], float | Sequence[float]]  # part and whole


@dataclass(frozen=True, eq=False)
class Counts:
    """A figure room by room: (n, k) float `part` and `whole`; it is the mean over k of their sums' ratios.

    k is 1 but for groups of relations, of which the published tables take the mean of the shares. 0 and 0 = not asked.
    """

    part: np.ndarray
    whole: np.ndarray

    @classmethod
    def of(cls, pairs: Sequence[Pair]) -> "Counts":
        """From (part, whole) of each room."""
        part, whole = np.moveaxis(np.array(pairs, float).reshape(len(pairs), 2, -1), 1, 0)
        return cls(part, whole)

    def at(self, rooms: np.ndarray) -> "Counts":
        """Of some rooms alone, (n,) bool."""
        return Counts(self.part[rooms], self.whole[rooms])

    @property
    def value(self) -> float | None:
        """None where nothing was measured."""
        return float(_ratio(self.part.sum(0), self.whole.sum(0))) if self.whole.sum() > 0 else None


@dataclass(frozen=True)
class Figure:
    """A value with its interval, and how it compares with a reference on the same rooms.

    Arguments:
        low, high: bootstrap interval of 95 % over rooms, None for one alone. rooms: in which something was measured.
        p: of a paired permutation test that nothing differs, None = not compared.
        detects: difference that four of five repetitions would find with so many rooms.
    """

    value: float | None
    low: float | None = None
    high: float | None = None
    rooms: int = 0
    p: float | None = None
    detects: float | None = None


def figure(counts: Counts, seed: int, reference: Counts | None = None) -> Figure:
    """The value of a figure, its interval, and the paired test against a reference on the same rooms."""
    asked = int((counts.whole > 0).any(1).sum())
    if counts.value is None or asked < 2:
        return Figure(counts.value, rooms=asked)
    drawn = np.random.default_rng([seed, 3]).integers(len(counts.whole), size=(RESAMPLES, len(counts.whole)))
    ratio = _ratio(counts.part[drawn].sum(1), counts.whole[drawn].sum(1))
    found = spread(counts.value, ratio, asked)
    if reference is None or reference.value is None or len(reference.whole) != len(counts.whole):
        return found
    other = _ratio(reference.part[drawn].sum(1), reference.whole[drawn].sum(1))
    return replace(found, p=paired_p(counts, reference, seed), detects=POWERED * float(np.nanstd(ratio - other)))


def paired_p(one: Counts, other: Counts, seed: int) -> float:
    """Share of exchanges of the two, room by room, after which they differ at least as much as they do."""
    swap = np.random.default_rng([seed, 5]).random((RESAMPLES, len(one.whole), 1)) < 0.5
    first, second = (
        _ratio(np.where(swap, a.part, b.part).sum(1), np.where(swap, a.whole, b.whole).sum(1))
        for a, b in ((one, other), (other, one))
    )
    apart = np.abs(first - second)
    seen = abs((one.value or 0.0) - (other.value or 0.0))
    return float((1 + (apart >= seen - 1e-12).sum()) / (1 + RESAMPLES))


def spread(value: float, drawn: Sequence[float] | np.ndarray, rooms: int) -> Figure:
    """A value with the interval of 95 % of values that were drawn for it."""
    low, high = np.nanquantile(drawn, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return Figure(value, float(low), float(high), rooms)


def mean(values: Iterable[float], seed: int) -> Figure:
    """The mean of values and its interval."""
    return figure(Counts.of([(value, 1.0) for value in values]), seed)


def _ratio(part: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """(..., k) -> (...): the mean of the ratios that there are, NaN where there is none."""
    there = whole > 0
    ratios = np.divide(part, whole, out=np.zeros_like(part), where=there).sum(-1)
    return np.divide(ratios, there.sum(-1), out=np.full_like(ratios, np.nan), where=there.any(-1))
