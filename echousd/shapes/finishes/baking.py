"""Patterns as image files: colour tinted, roughness and normals, as bytes that are the same in every run."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cache, partial, wraps
from typing import TypeVar, cast

import numpy as np
import PIL
from PIL import Image

from echomodel.dressing.textiles import RUGS
from echomodel.files import cache_folder, digest
from echousd.shapes.finishes import patterns
from echousd.shapes.finishes.patterns import SIZE, Relief, noise
from echousd.shapes.finishes.pictures import picture, woven
from echousd.shapes.finishes.slots import HARMONIES, HERE, Color, linear
from echousd.srgb import from_linear

Bake = TypeVar("Bake", bound=Callable[..., "bytes | None"])

PATTERNS: Mapping[str, Callable[[], Relief]] = {
    made.__name__: made
    for made in (
        patterns.wood, patterns.veneer, patterns.planks, patterns.woven, patterns.knitted, patterns.linen,
        patterns.leather, patterns.plaster, patterns.wicker, patterns.leaf, patterns.stone, patterns.papered,
        patterns.carpet, patterns.tiles, patterns.brushed, patterns.bound,
        patterns.herringbone, patterns.terrazzo, patterns.boarded, patterns.brick,
    )
} | {material: partial(woven, *woven_in) for material, woven_in in RUGS.items()}  # fmt: skip
QUALITY = 86  # of JPEG; without subsampling, because normals live in the colours


@cache
def relief(name: str) -> Relief:
    """The pattern of that name; raises KeyError for unknown ones."""
    return PATTERNS[name]()


def kept(bake: Bake) -> Bake:
    """A function that bakes an image, its results kept in memory and, for later processes, in the cache on disk.

    What is found there was baked by the same code and libraries from the same arguments; what is damaged is baked anew,
    and where nothing can be written nothing is kept.
    """

    @cache
    @wraps(bake)
    def found(*asked: object) -> bytes | None:
        file = cache_folder() / "images" / digest(repr((bake.__name__, asked, _code())).encode())
        try:
            content = file.read_bytes()
        except OSError:
            content = b""
        told, image = content[:32], content[32:]
        if told != digest(image).encode():
            image = bake(*asked) or b""
            with suppress(OSError):
                file.parent.mkdir(parents=True, exist_ok=True)
                beside = file.with_name(f".{file.name}.{os.getpid()}")
                beside.write_bytes(digest(image).encode() + image)
                beside.replace(file)
        return image or None

    return cast("Bake", found)


@cache
def _code() -> str:
    """What decides on the bytes of an image besides its arguments: the programs here and the libraries."""
    sources = [*sorted(HERE.glob("*.py")), *sorted(HERE.glob("*.toml")), HERE.parents[1] / "srgb.py"]
    return digest(b"".join([*(f.read_bytes() for f in sources), np.__version__.encode(), PIL.__version__.encode()]))


def hexadecimal(color: Color) -> str:
    """Linear RGB as sRGB hex."""
    return "".join(f"{int(v * 255 + 0.5):02x}" for v in from_linear(np.clip(np.asarray(color, float), 0, 1)))


@kept
def color_image(pattern: str, color: Color, harmony: str) -> bytes:
    """A pattern in a colour (linear RGB), or a painting in the colours of a harmony, as JPEG."""
    if pattern.startswith("picture_"):
        tones = HARMONIES[harmony]
        named = ("f4efe6", tones.accent, tones.cloth, tones.wood, "2d3136")
        return _jpeg(picture([linear(c) for c in named], int(pattern.rsplit("_", 1)[1])))
    tone = relief(pattern).tone
    tone = tone[..., None] if tone.ndim == 2 else tone
    return _jpeg(np.clip(tone * np.asarray(color), 0, 1))


@kept
def normal_image(pattern: str, metres: float) -> bytes | None:
    """Tangent-space normals of a pattern that covers `metres`, +Y up as UsdPreviewSurface takes it; None if flat."""
    height = None if pattern.startswith("picture_") else relief(pattern).height
    if height is None:
        return None
    step = 2 * max(metres, 0.4) / SIZE
    across = (np.roll(height, -1, 1) - np.roll(height, 1, 1)) / step
    down = (np.roll(height, -1, 0) - np.roll(height, 1, 0)) / step
    normal = np.stack([-across, down, np.ones_like(across)], -1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return _encoded(normal / 2 + 0.5, 78)


@kept
def rough_image(pattern: str, roughness: float) -> bytes | None:
    """Roughness about a mean, grey; None where it is even."""
    rough = None if pattern.startswith("picture_") else relief(pattern).rough
    return None if rough is None else _encoded(np.clip(roughness + rough, 0.05, 1), 70)


@kept
def sky_image() -> bytes:
    """What lies around a room, for its dome light, as JPEG."""
    return _jpeg(sky())


def _jpeg(value: np.ndarray) -> bytes:
    return _encoded(from_linear(value), QUALITY)


def _encoded(value: np.ndarray, quality: int) -> bytes:
    out = io.BytesIO()
    pixels = (np.clip(value, 0, 1) * 255 + 0.5).astype(np.uint8)
    Image.fromarray(pixels).save(out, "JPEG", quality=quality, subsampling=0)
    return out.getvalue()


SKY_SIZE = (512, 1024)  # pixels: a window some metres away shows about a hundred of them
SKY = (  # elevation in degrees, linear RGB: a near lawn, fields, haze, a bright horizon, blue
    (-90.0, -25.0, -7.0, -1.5, 2.0, 12.0, 35.0, 90.0),
    ((0.14, 0.19, 0.08), (0.18, 0.24, 0.10), (0.24, 0.30, 0.14), (0.38, 0.44, 0.26), (0.84, 0.90, 0.95),
     (0.68, 0.81, 0.95), (0.58, 0.74, 0.94), (0.54, 0.71, 0.93)),
)  # fmt: skip
HILLS = (
    (3.2, 1.3, (0.40, 0.50, 0.55)),
    (1.6, 0.9, (0.30, 0.40, 0.30)),
)  # degrees high and how uneven, colour; far, near
TREES, LEAVES = (2.2, 3.4), (0.075, 0.125, 0.045)  # degrees that trees rise over the horizon, and how unevenly


def sky() -> np.ndarray:
    """`SKY_SIZE` + (3,) linear RGB by latitude and longitude, the zenith first: clouds, hills and trees over a lawn."""
    height, width = SKY_SIZE
    elevation = (90 - (np.arange(height) + 0.5) / height * 180)[:, None]
    level, tones = SKY[0], np.array(SKY[1])
    out = np.stack([np.interp(elevation, level, tone) for tone in tones.T], -1) * np.ones((1, width, 1))
    grain, puff = (np.tile(noise(141 + n, *scale), (1, 2)) for n, scale in enumerate(((60.0, 60.0), (3.0, 9.0))))
    cloud = np.clip(0.55 * puff - 0.25, 0, 0.75) * np.clip((elevation - 5) / 12, 0, 1)
    out += cloud[..., None] * (np.array([0.95, 0.96, 0.97]) - out)
    out *= np.where(elevation < 0, 1 + 0.06 * grain, 1.0)[..., None]
    ridge = noise(151, 14.0, 14.0)[:3].repeat(2, axis=1)  # smooth rows of noise, all around
    for row, (rise, uneven, color) in enumerate(HILLS):
        line = rise + uneven * ridge[row]
        out[(elevation > -2) & (elevation < line)] = color
    crown = TREES[0] + TREES[1] * np.clip(ridge[2], -1.2, 1.5) + 0.5 * grain[0]
    leaves = np.array(LEAVES) * (1 + 0.35 * grain + 0.25 * np.clip(elevation / 4, -1, 1))[..., None]
    wood = (elevation > -2.5) & (elevation < crown)
    out[wood] = np.clip(leaves, 0.01, 1)[wood]
    return np.clip(out, 0, 1)
