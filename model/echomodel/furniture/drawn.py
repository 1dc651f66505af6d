"""Styles, choices and sizes by lot."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from echomodel.furniture.style import BUILD, DRAWN, DRAWN_LAST, FAMILIES, OPEN, STYLE, Choices, Style, described
from echomodel.sizes import Z95, size_statistics


def draw_style(rng: np.random.Generator) -> Style:
    """Draw a style: first a family, then its kinds and proportions."""
    family = str(rng.choice(list(FAMILIES)))
    kinds = {name: weighted(rng, odds) for name, odds in FAMILIES[family].items()}
    slender, soft = BUILD[family]
    numbers = {name: float(rng.uniform(*ends)) for name, ends in DRAWN.items()}
    shift = tuple(rng.normal(0, 1, 3).tolist())
    numbers |= {name: float(rng.uniform(*ends)) for name, ends in DRAWN_LAST.items()}
    numbers["bulk"] *= slender
    numbers["softness"] = float(np.clip(soft + numbers["softness"], 0.05, 1))
    numbers["corner"] **= 1.5
    numbers |= {name: float(np.radians(numbers[name])) for name in ("splay", "rake")}
    drawn: dict[str, Any] = {**kinds, **numbers}
    return Style(family=family, **drawn, size_shift=shift)


def draw_choices(rng: np.random.Generator) -> Choices:
    """All open choices at random."""
    return Choices(rng.random(len(OPEN)))


def weighted(rng: np.random.Generator, odds: dict[str, float]) -> str:
    """One key of `odds`, drawn with probability in proportion to its value."""
    names = list(odds)
    share = np.array([odds[name] for name in names], float)
    return names[int(rng.choice(len(names), p=share / share.sum()))]


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

    Raises UnknownWord where the vocabulary does not know the category.
    """
    statistics = size_statistics(category)
    z = rng.standard_normal(3)
    if style is not None:
        z = np.sqrt(STYLE_SHARE) * np.asarray(style.size_shift) + np.sqrt(1 - STYLE_SHARE) * z
    z = np.clip(np.linalg.cholesky(statistics.correlation) @ z + shift, -2.33, 2.33) / Z95
    low, middle, high = np.log(statistics.low), np.log(statistics.median), np.log(statistics.high)
    return np.exp(middle + np.where(z < 0, z * (middle - low), z * (high - middle)))


def draw_styles(count: int, rng: np.random.Generator) -> np.ndarray:
    """(count, STYLE) float32: the style's share of the vector of so many styles, drawn as `draw_style` draws them."""
    rest = Choices(np.zeros(len(OPEN)))
    return np.stack([described(draw_style(rng), rest)[:STYLE] for _ in range(count)])
