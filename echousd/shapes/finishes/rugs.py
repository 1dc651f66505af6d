"""What is woven into rugs, whole ones: thirteen designs in two variants, as how light or dark their colour is."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from echousd.shapes.finishes.patterns import SIZE, Relief, noise, pile

Design = Callable[[np.ndarray, np.ndarray, int], np.ndarray]


def bordered(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """Two lines along the edge."""
    edge, wide = _edge(u, v), 0.045 * (1 + 0.6 * variant)
    return np.where(
        ((edge > 0.045) & (edge < 0.06)) | ((edge > 0.075) & (edge < 0.075 + wide)), 0.72 - 0.3 * variant, 1
    )


def striped(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """Broad and narrow stripes across."""
    wave = np.sin(2 * np.pi * (5 + 4 * variant) * v)
    return np.where(wave > 0.75 - 0.6 * variant, 0.7 - 0.06 * variant, np.where(wave < -0.9, 0.85, 1.0))


def latticed(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """Lozenges between lines."""
    a, b = (np.abs((4 * u + sign * 4 * v) % 1.0 - 0.5) for sign in (1, -1))
    line = np.minimum(a, b) < 0.035
    return np.where(line | (variant * (np.maximum(a, b) < 0.12) > 0), 0.62 - 0.2 * variant, 1.0)


def medallion(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """A medallion within a border, its edge scalloped."""
    x, y = 2 * u - 1, 2 * v - 1
    reach, turn = np.hypot(1.25 * x, 1.25 * y), np.arctan2(y, x)
    wavy = reach * (1 + 0.07 * np.cos((12 + 4 * variant) * turn))
    rings = np.where(np.sin(2 * np.pi * 3.5 * wavy) > 0.2, 0.62, 0.88)
    edge = _edge(u, v)
    ground = np.where((edge > 0.05) & (edge < 0.13), 0.55 + 0.25 * (np.sin(2 * np.pi * 16 * (u + v)) > 0), 1.0)
    return np.where(wavy < 0.78, rings, ground)


def checked(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """Squares by turns."""
    many = 4 + 4 * variant
    return np.where(((many * u).astype(int) + (many * v).astype(int)) % 2 == 0, 0.68 - 0.2 * variant, 1.0)


def chevrons(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """Zigzags across."""
    across = np.abs((4 * u) % 1.0 - 0.5) * (0.5 + 0.4 * variant)
    return np.where(((6 * v + across) % 1.0) < 0.45, 0.66, 1.0)


def dotted(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """Dots, every other row between those above."""
    many = 7 + 5 * variant
    row = (many * v).astype(int)
    x, y = (many * u + 0.5 * (row % 2)) % 1.0 - 0.5, (many * v) % 1.0 - 0.5
    return np.where(np.hypot(x, y) < 0.24, 0.6, 1.0)


def scalloped(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """Rows of arcs over one another, as scales."""
    many, out = 5 + 2 * variant, np.ones_like(u)
    for row in range(2 * many, -2, -1):
        x, y = (many * u + 0.5 * (row % 2)) % 1.0 - 0.5, many * v - 0.5 * row
        reach = np.hypot(x, y)
        inside = (reach < 0.62) & (y > -0.62)
        out = np.where(inside, np.where((reach * 8).astype(int) % 2 == 0, 0.7, 1.0), out)
    return out


def broken(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """Large fields with soft, uneven borders."""
    one, other = (noise(201 + 10 * variant + k, 2.0, 2.0, 4.5) for k in range(2))
    return np.where(one > 0.5, 0.6, np.where(other > 0.6, 0.8, 1.0)) - 0.12 * (np.abs(one - 0.5) < 0.05)


def ringed(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """Rings about the middle."""
    reach = np.hypot(2 * u - 1, 2 * v - 1)
    return np.where((reach * (3 + 4 * variant)) % 1.0 < 0.32, 0.68, 1.0)


def berber(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """Thin uneven lozenges in dark wool, as hands knot them."""
    bend = 0.022 * noise(221 + variant, 6.0, 6.0, 4.0)
    many = 3 + variant
    a, b = (np.abs((many * (u + sign * 0.8 * v) + bend * 4) % 1.0 - 0.5) for sign in (1, -1))
    return np.where(np.minimum(a, b) < 0.03, 0.3, 1.0)


def shaded(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """From light to dark, from end to end or from the edge inwards."""
    share = 2 * _edge(u, v) if variant else v
    return 0.62 + 0.5 * np.clip(share + 0.04 * noise(231, 30.0, 3.0), 0, 1)


def carved(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """One colour, with lines clipped into the pile."""
    wave = v + 0.05 * np.sin(2 * np.pi * (2 + variant) * u)
    return np.where((wave * 9) % 1.0 < 0.06, 0.8, 1.0)


DESIGNS: Mapping[str, Design] = {
    design.__name__: design
    for design in (
        bordered, striped, latticed, medallion, checked, chevrons, dotted, scalloped, broken, ringed, berber, shaded,
        carved,
    )
}  # fmt: skip


def woven(design: str, variant: int) -> Relief:
    """A rug of one of the designs, in one of two variants."""
    axis = (np.arange(SIZE) + 0.5) / SIZE
    u, v = axis[None, :] + 0 * axis[:, None], axis[:, None] + 0 * axis[None, :]
    tone = DESIGNS[design](u, v, variant) * pile().tone
    return Relief(tone / np.median(tone))


def _edge(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    return np.minimum(np.minimum(u, 1 - u), np.minimum(v, 1 - v))
