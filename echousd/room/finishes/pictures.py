"""Pictures to hang, plain compositions in the colours of a room's harmony, and the sky; made by programs of ours."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from echousd.room.finishes.patterns import SIZE, noise


def painting(colors: Sequence[Sequence[float]], number: int) -> np.ndarray:
    """(SIZE, SIZE, 3) linear RGB: hills, shapes or fields of colour, by turns.

    Arguments:
        colors: five linear RGB colours: paper, three of the harmony, a dark one.
        number: which picture.
    """
    rng = np.random.default_rng([number, 7])
    paper, *rest = (np.asarray(color, float) for color in colors)
    u, v = np.meshgrid(np.arange(SIZE) / SIZE, np.arange(SIZE) / SIZE)
    out = np.broadcast_to(paper, (SIZE, SIZE, 3)).copy()
    grain = 1 + 0.03 * noise(101 + number, 90.0, 90.0)[..., None]
    if number % 3 == 0:  # hills under a sun
        sun = (u - rng.uniform(0.3, 0.7)) ** 2 + (v - 0.3) ** 2 < rng.uniform(0.09, 0.14) ** 2
        out[sun] = rest[0]
        for layer in range(4):
            line = 0.45 + 0.14 * layer + 0.06 * np.sin(2 * np.pi * (u * rng.uniform(0.6, 1.6) + rng.random()))
            shade = rest[1] * (1 - layer / 3) + rest[2] * (layer / 3)
            out[v > line] = shade
    elif number % 3 == 1:  # round shapes beside and over one another
        for color in (rest[1], rest[0], rest[2], rest[0], rest[3]):
            x, y, r = rng.uniform(0.25, 0.75), rng.uniform(0.25, 0.75), rng.uniform(0.08, 0.24)
            inside = ((u - x) / r) ** 2 + ((v - y) / (r * rng.uniform(0.7, 1.6))) ** 2 < 1
            if rng.random() < 0.5:
                inside &= v < y
            out[inside] = color
    else:  # fields with soft borders
        cuts = [0.0, *np.sort(rng.uniform(0.2, 0.8, 2)).tolist(), 1.0]
        soft = v + 0.012 * noise(131 + number, 8.0, 8.0)
        for color, top, bottom in zip((rest[0], rest[1], rest[2]), cuts, cuts[1:], strict=False):
            out[(soft > top + 0.015) & (soft < bottom - 0.015) & (u > 0.06) & (u < 0.94)] = color
    return np.clip(out * grain, 0, 1)


SKY = (  # elevation in degrees, linear RGB: fields, haze, a bright horizon, blue
    (-90.0, -25.0, -7.0, -1.5, 4.0, 30.0, 90.0),
    ((0.22, 0.27, 0.15), (0.31, 0.38, 0.21), (0.50, 0.56, 0.42), (0.76, 0.80, 0.78), (0.86, 0.90, 0.93),
     (0.62, 0.76, 0.94), (0.50, 0.68, 0.92)),
)  # fmt: skip


def sky() -> np.ndarray:
    """(128, 256, 3) linear RGB: a clear sky over fields by longitude and latitude, the zenith in the first row."""
    elevation = 90 - (np.arange(128) + 0.5) / 128 * 180
    level, tones = SKY[0], np.array(SKY[1])
    row = np.stack([np.interp(elevation, level, tone) for tone in tones.T], 1)
    return np.repeat(row[:, None], 256, axis=1)
