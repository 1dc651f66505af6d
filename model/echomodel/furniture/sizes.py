"""Sizes of furniture, drawn so that each class has the percentiles and correlations of real rooms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from echomodel.furniture.style import Style
from echomodel.sizes import Z95, size_statistics

STYLE_SHARE = 0.5  # share of the variance of a size that the pieces of one style have in common


def sample_size(
    category: str, rng: np.random.Generator, style: Style | None = None, shift: Sequence[float] = (0.0, 0.0, 0.0)
) -> np.ndarray:
    """Draw a size (3,) in metres: width x, height y, depth z.

    Each axis passes through the class's 5th, 50th and 95th percentile (log-linear between and, cut at the 1st and 99th,
    beyond). Pieces of one style share `STYLE_SHARE` of their deviation, without changing the distribution over styles.

    Arguments:
        category: word of the vocabulary. rng: source of every draw. style: of the suite that the piece belongs to.
        shift: how many standard deviations each axis is moved by.

    Raises:
        UnknownWord: the vocabulary does not know the category.
    """
    statistics = size_statistics(category)
    z = rng.standard_normal(3)
    if style is not None:
        z = np.sqrt(STYLE_SHARE) * np.asarray(style.size_shift) + np.sqrt(1 - STYLE_SHARE) * z
    z = np.clip(np.linalg.cholesky(statistics.correlation) @ z + shift, -2.33, 2.33) / Z95
    low, middle, high = np.log(statistics.low), np.log(statistics.median), np.log(statistics.high)
    return np.exp(middle + np.where(z < 0, z * (middle - low), z * (high - middle)))
