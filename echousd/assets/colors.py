"""Colours of a model: the few that a person would name, in a space in which distances are as people see them."""

from __future__ import annotations

import io
import warnings
from collections.abc import Sequence

import numpy as np

from echousd.srgb import from_linear, to_linear
from echousd.textures import FORMATS, MAX_BYTES, MAX_PIXELS

MOST = 3  # colours of a model
TEXELS = 16  # along a side of a texture, made small
ONE = 0.09  # distance in OKLab within which colours are one
LEAST = 0.012  # share of a surface below which a colour is none of the model's
CELL = 0.05  # of OKLab, in which colours are counted

CONES = np.array(
    [
        [0.4122214708, 0.2119034982, 0.0883024619],
        [0.5363325363, 0.6806995451, 0.2817188376],
        [0.0514459929, 0.1073969566, 0.6299787005],
    ]
)
AXES = np.array(
    [
        [0.2104542553, 1.9779984951, 0.0259040371],
        [0.7936177850, -2.4285922050, 0.7827717662],
        [-0.0040720468, 0.4505937099, -0.8086757660],
    ]
)

Coat = tuple[float, np.ndarray]  # area of a surface; (k, 4) linear RGB of what covers it, with weights


def flat(color: Sequence[float] | np.ndarray, opacity: float = 1.0) -> np.ndarray:
    """(1, 4) one linear colour as what covers a surface."""
    return np.array([[*np.clip(np.asarray(color, float)[:3], 0, 1), np.clip(opacity, 0, 1)]])


def texels(content: bytes, tint: Sequence[float] | np.ndarray = (1.0, 1.0, 1.0)) -> np.ndarray | None:
    """(k, 4) linear colours of an image, made small, and how opaque they are; None for what is no image.

    Arguments:
        content: of the file. tint: (3) linear, what the image is multiplied with.
    """
    from PIL import Image

    if not 0 < len(content) <= MAX_BYTES:
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(content), formats=FORMATS) as image:
                return pixels(image, tint)
    except Exception:  # decoders fail on damaged files in every way there is
        return None


def pixels(image: object, tint: Sequence[float] | np.ndarray = (1.0, 1.0, 1.0)) -> np.ndarray | None:
    """The same of an image of Pillow's, which may still be undecoded."""
    from PIL import Image

    assert isinstance(image, Image.Image)
    if image.format not in FORMATS or image.width * image.height > MAX_PIXELS:
        return None
    image.draft("RGB", (4 * TEXELS, 4 * TEXELS))
    small = image.convert("RGBA").resize((TEXELS, TEXELS), Image.Resampling.BOX)
    found = np.asarray(small, float).reshape(-1, 4) / 255
    return np.column_stack([np.clip(to_linear(found[:, :3]) * np.asarray(tint, float)[:3], 0, 1), found[:, 3]])


def oklab(linear: np.ndarray) -> np.ndarray:
    """(n, 3) OKLab (Ottosson, 2020) of (n, 3) linear RGB: lightness 0 to 1, and two axes of hue, 0 = grey."""
    return np.asarray(np.cbrt(linear @ CONES) @ AXES)


def swatches(colors: Sequence[float]) -> list[tuple[float, tuple[int, int, int]]]:
    """(share, sRGB of 0 to 255) of the colours of a model, as `dominant` gives them."""
    found = []
    for share, *lab in np.array(colors, float).reshape(-1, 4):
        cones = (np.array(lab) @ np.linalg.inv(AXES)) ** 3
        rgb = np.clip(cones @ np.linalg.inv(CONES), 0, 1)
        red, green, blue = (round(255 * float(value)) for value in from_linear(rgb))
        found.append((float(share), (red, green, blue)))
    return found


def dominant(coats: Sequence[Coat]) -> tuple[float, ...]:
    """Share, and OKLab, of up to `MOST` colours of a surface, the largest share first; () where nothing is known."""
    shares = [area * coat[:, 3] / len(coat) for area, coat in coats]
    weight = np.concatenate(shares) if shares else np.zeros(0)
    if not np.isfinite(weight).all() or weight.sum() <= 0:
        return ()
    left = weight / weight.sum()
    lab = oklab(np.concatenate([coat[:, :3] for _, coat in coats]))
    cells, cell = np.unique(np.floor(lab / CELL).astype(int), axis=0, return_inverse=True)
    found: list[tuple[float, np.ndarray]] = []
    for _ in range(MOST):
        heavy = int(np.bincount(cell.ravel(), left, len(cells)).argmax())
        centre = np.average(lab[cell.ravel() == heavy], axis=0, weights=left[cell.ravel() == heavy] + 1e-12)
        near = np.linalg.norm(lab - centre, axis=1) <= ONE
        share = float(left[near].sum())
        if share < LEAST:
            break
        found.append((share, np.average(lab[near], axis=0, weights=left[near] + 1e-12)))
        left = np.where(near, 0.0, left)
    found.sort(key=lambda one: -one[0])
    return tuple(round(float(number), 4) + 0.0 for share, color in found for number in (share, *color))
