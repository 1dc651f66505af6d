"""Colours of a model, as a person would name them, and how well they go with a room, its graph and each other."""

import re
from collections.abc import Sequence
from functools import cache

import numpy as np
from PIL import Image

from echomodel.files import tables
from echomodel.vocabulary import vocabulary
from echousd.srgb import from_linear, of_hexadecimal, to_linear
from echousd.textures import FORMATS, MAX_PIXELS, TextureError, image_in

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
    try:
        with image_in(content, "the image") as image:
            return pixels(image, tint)
    except TextureError:
        return None


def pixels(image: object, tint: Sequence[float] | np.ndarray = (1.0, 1.0, 1.0)) -> np.ndarray | None:
    """The same of an image of Pillow's, which may still be undecoded."""
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


GREY = 0.045  # chroma up to which a colour is a grey, which goes with everything
TONES = 0.05  # distance within which a colour is one of the room's
DARKER = 0.5  # what lightness counts for, as light and dark woods go together
LOUD = 9.0  # cost of a colour that is none of the room's, of its distance and its share
SPOTS = 0.5  # power of a share: small spots of a loud colour are seen from afar
STATED = 4.0  # cost of another colour than the one that the graph tells
TOGETHER = 0.5  # cost of the distance of two models' main colours
MAIN = 0.2  # share from which on a colour is one that people name a model by
LIVELY = ("plant",)  # looks that may have any colour


@cache
def stated_colors(text: str) -> tuple[tuple[float, float, float], ...]:
    """OKLab of the words for colours in a text (a style, a name), as they come."""
    return tuple(_named()[word] for word in dict.fromkeys(re.findall(r"[a-z]+", text.lower())) if word in _named())


@cache
def _named() -> dict[str, tuple[float, float, float]]:
    """Word for a colour -> OKLab."""
    rows = tables("colors.toml", __file__)
    found = oklab(np.array([of_hexadecimal(row) for row in rows.values()]))
    return dict(zip(rows, map(tuple, found.tolist()), strict=True))


def table(rows: Sequence[tuple[float, ...]], most: int) -> np.ndarray:
    """(n, most, 4) shares and OKLab of models' colours (`AssetRecord.colors`); shares of 0 where there are none."""
    found = np.zeros((len(rows), most, 4))
    for row, numbers in zip(found, rows, strict=True):
        few = np.array(numbers[: 4 * most]).reshape(-1, 4)
        row[: len(few)] = few
    return found


def costs(colors: np.ndarray, category: str, palette: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """(n,) float, what the colours of models cost; 0 where nothing is known of them, or nothing of the room.

    Arguments:
        colors: (n, k, 4) as `table` gives them. category: that is wanted.
        palette: (p, 3) OKLab of the room. wanted: (w, 3) OKLab of what the graph tells of this object.
    """
    share, lab = colors[..., 0], colors[..., 1:]
    out = np.zeros(len(colors))
    tones = np.concatenate([palette.reshape(-1, 3), wanted.reshape(-1, 3)])
    if len(palette) and vocabulary().category(category).look not in LIVELY:
        grey = np.maximum(np.linalg.norm(lab[..., 1:], axis=-1) - GREY, 0)
        out += LOUD * (share**SPOTS * np.minimum(grey, np.maximum(_away(lab, tones) - TONES, 0))).sum(1)
    if len(wanted):
        far = np.where(share >= MAIN, np.maximum(_away(lab, wanted) - TONES, 0), np.inf).min(1)
        out += STATED * np.where(np.isfinite(far), far, 0.0)
    return out


def _away(lab: np.ndarray, tones: np.ndarray) -> np.ndarray:
    """(...) distances of colours (..., 3) to the nearest of some tones (t, 3)."""
    apart = (lab[..., None, :] - tones) * (DARKER, 1.0, 1.0)
    return np.asarray(np.linalg.norm(apart, axis=-1).min(-1))


def apart(one: tuple[float, ...], company: np.ndarray) -> float:
    """Cost of the main colour of a model among those of others (k, 3), the mean distance; 0 where one is unknown."""
    if not one or not len(company):
        return 0.0
    far = np.linalg.norm((np.array(one[1:4]) - company) * (DARKER, 1.0, 1.0), axis=1)
    return TOGETHER * float(far.mean())
