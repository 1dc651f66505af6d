"""Sizes of furniture: those of each class in real rooms, what pieces cover, what fitted units are built by."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np

from echomodel.vocabulary import Category, vocabulary

Z95 = 1.6449  # standard score of the 95th percentile
AT_WALL = 0.2  # metres: a class with a larger median gap does not belong at a wall
USUAL_GAPS = (0.0, 0.03, 0.06)  # metres between a back and its wall: quartiles of classes without figures
_KNOTS = {5: (-1.645, -0.674, 0.0, 0.674, 1.645), 3: (-1.645, 0.0, 1.645)}
TUCKED = 0.5  # share of a seat's footprint that counts: the rest is below its table
REACH = 0.5  # metres that a piece fills around it
TALL = 1.3  # metres: what is higher has no worktop
AISLE = 1.2  # metres between fronts that face each other, and before them
LANDING = 0.4  # metres of worktop beside a hob
TRIANGLE = (3.6, 8.0)  # metres, sum of the ways between hob, sink and fridge


@dataclass(frozen=True, eq=False)
class SizeStatistics:
    """5th percentile, median and 95th percentile of x, y, z (3,) in metres, and their correlation matrix (3, 3)."""

    low: np.ndarray
    median: np.ndarray
    high: np.ndarray
    correlation: np.ndarray


@cache
def room_statistics() -> dict:
    """What real rooms look like, as data: `data/room_statistics.json`."""
    return json.loads(resources.files("echomodel.data").joinpath("room_statistics.json").read_text("utf-8"))


@cache
def size_statistics(category: str) -> SizeStatistics:
    """Statistics of a class, or of the one that its row calls `like` where it has none; raises `UnknownWord`."""
    row = vocabulary().category(category)
    found = room_statistics()["sizes"].get(row.name)
    if found is None and not row.sizes:
        return size_statistics(row.like or row.sgfront)
    if found is None:
        low, median, high = (np.array(values) for values in row.sizes)
        return SizeStatistics(low, median, high, _correlation(0.4, 0.98 if row.round else 0.6, 0.4))
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


@dataclass(frozen=True)
class OnFloor:
    """A piece on the floor: its row, width and depth in metres."""

    kind: Category
    width: float
    depth: float


def footprint(categories: Sequence[str], sizes: Sequence[Sequence[float] | None], *, least: bool = False) -> float:
    """Square metres that furniture covers; pieces without a size count with the median of their class.

    Arguments:
        categories: words of the vocabulary; what hangs or stands on other things does not count.
        sizes: (x, y, z) extents in metres, or None.
        least: take the 5th percentile of the class instead of the median.
    """
    there = pieces(categories, sizes, least=least)
    return sum(p.width * p.depth * (TUCKED if p.kind.role == "seat" else 1.0) for p in there)


def filled_area(width: Sequence[float], depth: Sequence[float]) -> float:
    """Square metres that n pieces of these widths and depths, metres, fill with half a metre around them."""
    return sum((w + 2 * REACH) * (d + 2 * REACH) for w, d in zip(width, depth, strict=True))


def pieces(categories: Sequence[str], sizes: Sequence[Sequence[float] | None], *, least: bool = False) -> list[OnFloor]:
    """What stands on the floor, in its usual size where none is stated."""
    out = []
    for category, size in zip(categories, sizes, strict=True):
        row = vocabulary().category(category)
        if row.support != "floor":
            continue
        if size is None:
            size = _usual(row, least)
        out.append(OnFloor(row, float(size[0]), float(size[2])))
    return out


def _usual(row: Category, least: bool) -> list[float]:
    """(3,) metres: the usual size of a class, or the least one."""
    if usual := usual_range(row.name):
        return [low if least else float(np.sqrt(low * high)) for low, high in usual]
    statistics = size_statistics(row.name)
    return (statistics.low if least else statistics.median).tolist()


def _correlation(xy: float, xz: float, yz: float) -> np.ndarray:
    """Correlation matrix from its three entries, shrunk a little so that it is positive definite."""
    matrix = np.array([[1, xy, xz], [xy, 1, yz], [xz, yz, 1]])
    values, vectors = np.linalg.eigh(matrix)
    matrix = vectors @ np.diag(np.maximum(values, 1e-3)) @ vectors.T
    scale = np.sqrt(np.diag(matrix))
    return matrix / np.outer(scale, scale)


@cache
def back_gaps(category: str) -> tuple[float, float, float]:
    """Quartiles of the gap between the backs of a category at a wall and that wall, metres."""
    low, middle, high = room_statistics()["walls"].get(category, {}).get("back_gap", USUAL_GAPS)
    return (low, middle, high) if middle < AT_WALL else USUAL_GAPS


def quantile(percentiles: tuple[float, ...], z: float) -> float:
    """The value at the standard score `z` of a distribution given by 3 or 5 percentiles, linear between them."""
    knots = _KNOTS[len(percentiles)]
    z = min(max(z, -2.1), 2.1)
    if z <= knots[0] or z >= knots[-1]:
        at = 0 if z <= knots[0] else len(knots) - 2
        slope = (percentiles[at + 1] - percentiles[at]) / (knots[at + 1] - knots[at])
        return percentiles[at] + slope * (z - knots[at])
    return float(np.interp(z, knots, percentiles))
