"""How well the colours of models go with those of a room, with what its graph says, and with each other."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache

import numpy as np

from echomodel.vocabulary import vocabulary
from echousd.assets.colors import oklab
from echousd.srgb import of_hexadecimal

GREY = 0.045  # chroma up to which a colour is a grey, which goes with everything
TONES = 0.05  # distance within which a colour is one of the room's
DARKER = 0.5  # what lightness counts for, as light and dark woods go together
LOUD = 9.0  # cost of a colour that is none of the room's, of its distance and its share
SPOTS = 0.5  # power of a share: small spots of a loud colour are seen from afar
TOLD = 4.0  # cost of another colour than the one that the graph tells
TOGETHER = 0.5  # cost of the distance of two models' main colours
MAIN = 0.2  # share from which on a colour is one that people name a model by
LIVELY = ("plant",)  # looks that may have any colour
NAMED = {  # sRGB of words for colours, of woods and cloths too
    "red": "b3261e", "crimson": "a0152a", "burgundy": "6d1f2e", "orange": "d9761f", "terracotta": "b9623f",
    "yellow": "e3b92b", "mustard": "c9962b", "gold": "c9a24a", "green": "4f7d4a", "olive": "6f7040", "sage": "a3ad90",
    "mint": "a9d3bd", "teal": "2f7377", "turquoise": "3fa7a3", "blue": "3a5f9a", "navy": "24324f", "purple": "6a4a86",
    "violet": "7353a0", "lilac": "b7a3cc", "pink": "d99aa6", "rose": "c98a8e", "magenta": "b03a86", "brown": "6f4b32",
    "tan": "b8946a", "beige": "d8c8ab", "cream": "efe6d2", "ivory": "f2ecdc", "white": "f2f2f0", "grey": "8c8c8c",
    "gray": "8c8c8c", "silver": "c0c2c4", "charcoal": "3c4044", "black": "1d1d1e", "oak": "b98f5f", "walnut": "77502f",
    "ash": "d3b88f", "birch": "dcc39a", "pine": "d2a96c", "beech": "cfa177", "maple": "d6b184", "cherry": "83523a",
    "mahogany": "5f2f22", "teak": "9a6b3f", "ebony": "2f2622", "rattan": "c39e6b", "bamboo": "d0b176",
    "brass": "b08d57", "copper": "a86a48", "chrome": "b9bcbf", "steel": "9ea3a8",
}  # fmt: skip


@cache
def told_colors(text: str) -> tuple[tuple[float, float, float], ...]:
    """OKLab of the words for colours in a text (a style, a name), as they come."""
    words = re.findall(r"[a-z]+", text.lower())
    return tuple(_of(NAMED[word]) for word in dict.fromkeys(words) if word in NAMED)


def _of(hexadecimal: str) -> tuple[float, float, float]:
    light, a, b = oklab(of_hexadecimal(hexadecimal)[None])[0].tolist()
    return light, a, b


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
        out += TOLD * np.where(np.isfinite(far), far, 0.0)
    return out


def _away(lab: np.ndarray, tones: np.ndarray) -> np.ndarray:
    """(...) distances of colours (..., 3) to the nearest of some tones (t, 3)."""
    apart = (lab[..., None, :] - tones) * (DARKER, 1.0, 1.0)
    return np.asarray(np.linalg.norm(apart, axis=-1).min(-1))


def main_colors(rows: Sequence[tuple[float, ...]]) -> np.ndarray:
    """(k, 3) OKLab of the main colours of models (`AssetRecord.colors`) that have any."""
    return np.array([row[1:4] for row in rows if row]).reshape(-1, 3)


def apart(one: tuple[float, ...], company: np.ndarray) -> float:
    """Cost of the main colour of a model among those of others (k, 3), the mean distance; 0 where one is unknown."""
    if not one or not len(company):
        return 0.0
    far = np.linalg.norm((np.array(one[1:4]) - company) * (DARKER, 1.0, 1.0), axis=1)
    return TOGETHER * float(far.mean())
