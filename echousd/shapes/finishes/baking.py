"""Patterns as image files whose bytes are the same in every run, kept for later ones."""

import sys
from collections.abc import Callable
from functools import cache, wraps
from pathlib import Path
from typing import Any

import numpy as np
import PIL

from echomodel.dressing import TABLE
from echomodel.files import digest, from_cache
from echomodel.late import lates
from echousd.shapes.finishes.slots import HERE, Color
from echousd.srgb import from_linear


def kept(bake: Callable[..., bytes | None]) -> Callable[..., Any]:
    """A function that bakes an image, its results kept in memory and, for later processes, in the cache on disk.

    What is found there was baked by the same code and libraries from the same arguments; what is damaged is baked anew,
    and where nothing can be written nothing is kept. What the first rooms of most people need ships (`BAKED`).
    """

    @cache
    @wraps(bake)
    def found(*asked: object) -> bytes | None:
        ready = baked_file(found.__name__, asked)
        if ready.is_file():
            return ready.read_bytes() or None
        key = repr((bake.__name__, asked, _code())).encode()
        return from_cache("images", key, lambda: bake(*asked) or b"") or None

    return found


BAKED = HERE / "baked"  # as `docs/make_baked.py` bakes it; empty files where there is no image


def baked_file(name: str, asked: tuple[object, ...]) -> Path:
    """Where what a function of that name gives for these arguments ships, if it does."""
    return BAKED / f"{digest(repr((name, asked)).encode())[:16]}.jpg"


@cache
def _code() -> str:
    """What decides on the bytes of an image besides its arguments: the programs here and the libraries."""
    sources = [*sorted(HERE.glob("*.py")), *sorted(HERE.glob("*.toml")), HERE.parents[1] / "srgb.py", TABLE]
    return digest(b"".join([*(f.read_bytes() for f in sources), np.__version__.encode(), PIL.__version__.encode()]))


# What bakes them is not loaded where the cache has every image.
color_image, normal_image, rough_image = map(
    kept, lates("echousd.shapes.finishes.pictures", "color_image", "normal_image", "rough_image")
)


def let_go() -> None:
    """Forget the patterns that images were baked of: up to 60 MB, which a picture of the room wants next."""
    if patterns := sys.modules.get("echousd.shapes.finishes.patterns"):
        patterns.relief.cache_clear()


def hexadecimal(color: Color) -> str:
    """Linear RGB as sRGB hex."""
    return "".join(f"{int(v * 255 + 0.5):02x}" for v in from_linear(np.clip(np.asarray(color, float), 0, 1)))


# What lies around a room, by latitude and longitude: pictures that `docs/make_views.py` draws.
VIEWS = sorted((HERE / "views").glob("*.jpg"))
