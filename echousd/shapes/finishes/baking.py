"""Patterns as image files: colour tinted, roughness and normals, as bytes that are the same in every run."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache, wraps
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np
import PIL
from PIL import Image

from echomodel.dressing import PRINTS, TABLE
from echomodel.files import digest, from_cache, tables
from echomodel.late import Late
from echousd.shapes.finishes.slots import HERE, Color
from echousd.srgb import from_linear

if TYPE_CHECKING:
    from echousd.shapes.finishes.patterns import Relief

Bake = TypeVar("Bake", bound=Callable[..., "bytes | None"])

# What draws them is not loaded where the cache has every image.
PROGRAMS = "echousd.shapes.finishes.patterns"
aged, sky = (Late(f"{PROGRAMS}:{name}") for name in ("aged", "sky"))
printed = Late("echousd.shapes.finishes.pictures:printed")
QUALITY = 86  # of JPEG; without subsampling, because normals live in the colours


@cache
def relief(name: str) -> Relief:
    """The pattern that the function of that name there draws, its tone 1 in the mean."""
    drawn = Late(f"{PROGRAMS}:{name}")()
    return replace(drawn, tone=drawn.tone / drawn.tone.mean((0, 1)))


def kept(bake: Bake) -> Bake:
    """A function that bakes an image, its results kept in memory and, for later processes, in the cache on disk.

    What is found there was baked by the same code and libraries from the same arguments; what is damaged is baked anew,
    and where nothing can be written nothing is kept.
    """

    @cache
    @wraps(bake)
    def found(*asked: object) -> bytes | None:
        key = repr((bake.__name__, asked, _code())).encode()
        return from_cache("images", key, lambda: bake(*asked) or b"") or None

    return cast("Bake", found)


@cache
def _code() -> str:
    """What decides on the bytes of an image besides its arguments: the programs here and the libraries."""
    sources = [*sorted(HERE.glob("*.py")), *sorted(HERE.glob("*.toml")), HERE.parents[1] / "srgb.py", TABLE]
    return digest(b"".join([*(f.read_bytes() for f in sources), np.__version__.encode(), PIL.__version__.encode()]))


def hexadecimal(color: Color) -> str:
    """Linear RGB as sRGB hex."""
    return "".join(f"{int(v * 255 + 0.5):02x}" for v in from_linear(np.clip(np.asarray(color, float), 0, 1)))


@kept
def color_image(pattern: str, color: Color, harmony: str, worn: float = 0.0) -> bytes:
    """A pattern in a colour (linear RGB), `aged` by a share, or what is printed in those of a harmony, as JPEG."""
    if pattern in PRINTS:
        return _jpeg(printed(pattern, harmony))
    tone = aged(relief(pattern).tone, worn) if worn else relief(pattern).tone
    tone = tone[..., None] if tone.ndim == 2 else tone
    return _jpeg(np.clip(tone * np.asarray(color), 0, 1))


@kept
def normal_image(pattern: str, metres: float) -> bytes | None:
    """Tangent-space normals of a pattern that covers `metres`, +Y up as UsdPreviewSurface takes it; None if flat."""
    height = None if pattern in PRINTS else relief(pattern).height
    if height is None:
        return None
    step = 2 * max(metres, 0.4) / len(height)
    across = (np.roll(height, -1, 1) - np.roll(height, 1, 1)) / step
    down = (np.roll(height, -1, 0) - np.roll(height, 1, 0)) / step
    normal = np.stack([-across, down, np.ones_like(across)], -1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return _encoded(normal / 2 + 0.5, 78)


@kept
def rough_image(pattern: str, roughness: float) -> bytes | None:
    """Roughness about a mean, grey; None where it is even."""
    rough = None if pattern in PRINTS else relief(pattern).rough
    return None if rough is None else _encoded(np.clip(roughness + rough, 0.05, 1), 70)


@kept
def sky_image(kind: str) -> bytes:
    """What lies around a room, a row of `SKIES`, for its dome light, as JPEG."""
    return _jpeg(sky(SKIES[kind]))


def _jpeg(value: np.ndarray) -> bytes:
    return _encoded(from_linear(value), QUALITY)


def _encoded(value: np.ndarray, quality: int) -> bytes:
    out = io.BytesIO()
    pixels = (np.clip(value, 0, 1) * 255 + 0.5).astype(np.uint8)
    Image.fromarray(pixels).save(out, "JPEG", quality=quality, subsampling=0)
    return out.getvalue()


SKIES: Mapping[str, Any] = tables("skies.toml", __file__)
