"""Sizes of furniture: the percentiles and correlations of each class in real rooms."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from importlib import resources

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


# Classes that the statistics do not hold: low, median, high of x, y, z as sold; "like" borrows another class.
ASSUMED: dict[str, tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]] | str] = {
    "chaise_longue_sofa": ((0.65, 0.65, 1.4), (0.8, 0.82, 1.65), (1.1, 1.0, 1.95)),
    "children_cabinet": ((0.5, 0.6, 0.3), (0.85, 1.1, 0.42), (1.5, 1.8, 0.55)),
    "chinese_chair": ((0.52, 0.8, 0.48), (0.62, 1.0, 0.55), (0.75, 1.2, 0.66)),
    "console_table": ((0.8, 0.7, 0.28), (1.2, 0.8, 0.36), (1.7, 0.95, 0.46)),
    "corner_side_table": ((0.35, 0.42, 0.35), (0.5, 0.55, 0.48), (0.68, 0.7, 0.65)),
    "dressing_chair": ((0.38, 0.42, 0.36), (0.46, 0.6, 0.46), (0.58, 0.85, 0.56)),
    "lazy_sofa": ((0.65, 0.55, 0.65), (0.88, 0.75, 0.92), (1.15, 0.95, 1.2)),
    "round_end_table": ((0.35, 0.4, 0.35), (0.48, 0.54, 0.48), (0.65, 0.66, 0.65)),
    "single_bed": ((0.95, 0.7, 1.95), (1.2, 0.98, 2.12), (1.45, 1.3, 2.35)),
    "sofa": "multi_seat_sofa",
    "table": "dining_table",
    "wine_cabinet": ((0.5, 0.9, 0.3), (0.95, 1.7, 0.38), (1.8, 2.3, 0.48)),
    "table_lamp": ((0.18, 0.35, 0.18), (0.3, 0.52, 0.3), (0.45, 0.72, 0.45)),
    "wall_lamp": ((0.1, 0.18, 0.1), (0.18, 0.32, 0.16), (0.4, 0.55, 0.28)),
    "bench": ((0.8, 0.4, 0.33), (1.2, 0.46, 0.42), (1.6, 0.55, 0.55)),
    "tv": ((0.9, 0.53, 0.04), (1.25, 0.74, 0.08), (1.7, 1.0, 0.22)),
}
# Round from above, as sold: width equals depth.
ROUND = {"round_end_table", "lazy_sofa", "table_lamp"}


@cache
def size_statistics(category: str) -> SizeStatistics:
    """Statistics of a class, or of its SG-FRONT class where it has none of its own; raises `UnknownWord`."""
    row = vocabulary().category(category)
    name = row.name
    table = json.loads(resources.files("echomodel").joinpath("data/room_statistics.json").read_text("utf-8"))["sizes"]
    if name not in table:
        assumed = ASSUMED.get(name, row.sgfront)
        if isinstance(assumed, str):
            return size_statistics(assumed)
        low, median, high = (np.array(values) for values in assumed)
        return SizeStatistics(low, median, high, _correlation(0.4, 0.98 if name in ROUND else 0.6, 0.4))
    c = table[name]["correlation"]
    low, median, high = (np.array(table[name][key]) for key in ("p5", "median", "p95"))
    return SizeStatistics(low, median, high, _correlation(c["xy"], c["xz"], c["yz"]))


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
