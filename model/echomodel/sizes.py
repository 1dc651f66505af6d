"""Sizes of furniture: the percentiles and correlations of each class in real rooms."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

import numpy as np

from echomodel.vocabulary import vocabulary

Z95 = 1.6449  # standard score of the 95th percentile


@dataclass(frozen=True, eq=False)
class SizeStatistics:
    """5th percentile, median and 95th percentile of x, y, z (3,) in metres, and their correlation matrix (3, 3)."""

    low: np.ndarray
    median: np.ndarray
    high: np.ndarray
    correlation: np.ndarray


@cache
def _table() -> dict[str, Any]:
    """What real rooms tell of sizes, by category."""
    text = resources.files("echomodel").joinpath("data/room_statistics.json").read_text("utf-8")
    found: dict[str, Any] = json.loads(text)["sizes"]
    return found


@cache
def size_statistics(category: str) -> SizeStatistics:
    """Statistics of a class, or of the one that its row calls `like` where it has none; raises `UnknownWord`."""
    row = vocabulary().category(category)
    name = row.name
    if name not in _table() and not row.sizes:
        return size_statistics(row.like or row.sgfront)
    if name not in _table():
        low, median, high = (np.array(values) for values in row.sizes)
        return SizeStatistics(low, median, high, _correlation(0.4, 0.98 if row.round else 0.6, 0.4))
    found = _table()[name]
    c = found["correlation"]
    low, median, high = (np.array(found[key]) for key in ("p5", "median", "p95"))
    return SizeStatistics(low, median, high, _correlation(c["xy"], c["xz"], c["yz"]))


def usual_range(category: str) -> tuple[tuple[float, ...], ...]:
    """(low, high) of x, y and z in metres that most such pieces have: `Category.usual`, or that of what it is like."""
    row = vocabulary().category(category)
    return row.usual or (vocabulary().category(row.like).usual if row.like else ())


def size_score(category: str, size: np.ndarray) -> np.ndarray:
    """Standard scores (n, 3) of sizes (n, 3) in metres within their class."""
    statistics = size_statistics(category)
    deviation = np.log(size / statistics.median)
    below, above = np.log(statistics.median / statistics.low), np.log(statistics.high / statistics.median)
    return Z95 * deviation / np.where(deviation < 0, below, above)


def _correlation(xy: float, xz: float, yz: float) -> np.ndarray:
    """Correlation matrix from its three entries, shrunk a little so that it is positive definite."""
    matrix = np.array([[1, xy, xz], [xy, 1, yz], [xz, yz, 1]])
    values, vectors = np.linalg.eigh(matrix)
    matrix = vectors @ np.diag(np.maximum(values, 1e-3)) @ vectors.T
    scale = np.sqrt(np.diag(matrix))
    return matrix / np.outer(scale, scale)
