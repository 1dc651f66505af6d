"""What pictures are worked in: how paint and ink lie on paper, whatever is drawn with them."""

from collections.abc import Mapping

import numpy as np
from PIL import Image, ImageFilter

from echousd.shapes.finishes.patterns import SIZE, noise
from echousd.srgb import to_linear

AROUND = 0.03  # heights of a sheet: what is about a place, from which rims and the sides of forms stand out
# Shares: how far colour runs as water does, and how far a brush shows.
WATERCOLOUR, GOUACHE, PRESS = (0.4, 0.0), (0.2, 0.7), (0.2, 0.0)
MEDIA: Mapping[str, tuple[float, float]] = {  # kind of a print -> its medium
    "line_art": WATERCOLOUR, "botanical": WATERCOLOUR, "silhouette": WATERCOLOUR, "still_life": GOUACHE,
    "landscape": GOUACHE, "abstract": GOUACHE, "childs": GOUACHE,
}  # fmt: skip


def worked(image: Image.Image, paper: tuple[int, int, int], medium: tuple[float, float], seed: int) -> np.ndarray:
    """(SIZE, SIZE, 3) linear RGB, what is drawn on a sheet as a medium gives it on paper of an sRGB colour."""

    def field(number: int, along: float, across: float, power: float = 3.0) -> np.ndarray:
        """Noise that all sheets have alike, each from another place on."""
        return np.roll(noise(110 + number, along, across, power), (7 * seed, 3 * seed), (0, 1))

    wet, brush = medium
    small = image.resize((SIZE, SIZE), Image.Resampling.BOX)
    soft = small.reduce(4).filter(ImageFilter.GaussianBlur(AROUND * SIZE / 4)).resize(small.size)
    # no edge is straight: places are moved
    moved = [field(number, 14.0, 14.0, 4.0) * (0.0025 * wet + 0.0015 * brush) * SIZE for number in (0, 1)]
    places = zip(np.indices((SIZE, SIZE)), moved, strict=True)
    rows, columns = (np.clip(np.rint(at + by), 0, SIZE - 1).astype(int) for at, by in places)
    # of the light that paper alone sends back, how much is taken by what is drawn, and by what is about it, by plane
    linear, sheet = to_linear(np.arange(256) / 255), to_linear(np.array(paper) / 255)
    taken = -np.log(np.maximum(linear[:, None] / sheet, 0.004)).T
    planes = (np.asarray(one).reshape(-1, 3).T.take(rows * SIZE + columns, 1) for one in (small, soft))
    load, near = (np.stack([*map(np.take, taken, drawn)]) for drawn in planes)
    # it dries in pools, lies in strokes and on the grain of the paper, and is deeper away from the light, upper left
    mean, before = near.mean(0), np.clip(np.arange(SIZE) - round(AROUND * SIZE), 0, None)
    density = 1 + wet * (0.2 * field(2, 3.0, 3.0) + 0.12 * field(3, 16.0, 16.0)) + 0.06 * noise(101, 90.0, 90.0)
    density += 0.08 * brush * field(4, 14.0, 90.0)
    density += (0.25 * wet + 0.4 * brush) * np.tanh(mean[np.ix_(before, before)] - mean)
    load = load * np.maximum(density, 0.2) + 0.35 * wet * np.maximum(load - near, 0)
    return np.minimum(sheet * np.exp(-load).transpose(1, 2, 0), 1.0)
