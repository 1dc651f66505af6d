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

from echomodel.dressing.prints import PRINTS, TABLE
from echomodel.files import digest, from_cache, tables
from echomodel.late import Late
from echousd.shapes.finishes.slots import HERE, Color
from echousd.srgb import from_linear

if TYPE_CHECKING:
    from echousd.shapes.finishes.patterns import Relief

Bake = TypeVar("Bake", bound=Callable[..., "bytes | None"])

# What draws them is not loaded where the cache has every image.
PROGRAMS = "echousd.shapes.finishes.patterns"
aged, noise = (Late(f"{PROGRAMS}:{name}") for name in ("aged", "noise"))
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
    return _jpeg(sky(kind))


def _jpeg(value: np.ndarray) -> bytes:
    return _encoded(from_linear(value), QUALITY)


def _encoded(value: np.ndarray, quality: int) -> bytes:
    out = io.BytesIO()
    pixels = (np.clip(value, 0, 1) * 255 + 0.5).astype(np.uint8)
    Image.fromarray(pixels).save(out, "JPEG", quality=quality, subsampling=0)
    return out.getvalue()


SKY_SIZE = (512, 1024)  # pixels: a window some metres away shows about a hundred of them
SKIES: Mapping[str, Any] = tables("skies.toml", __file__)
SOFT = 0.5  # degrees that outlines take


def sky(kind: str) -> np.ndarray:
    """`SKY_SIZE` + (3,) linear RGB by latitude and longitude, the zenith first: clouds, and a row of `SKIES`."""
    height, width = SKY_SIZE
    elevation, around = 90 - (np.arange(height) + 0.5)[:, None] / height * 180, np.arange(width) / width * 360
    level, *tones = np.array(SKIES[kind]["tones"]).T
    out = np.stack([np.interp(elevation, level, tone) for tone in tones], -1) * np.ones((1, width, 1))
    grain, puff = (np.tile(noise(141 + n, *scale), (1, 2)) for n, scale in enumerate(((60.0, 60.0), (3.0, 9.0))))
    cloud = np.clip(0.55 * puff - 0.25, 0, 0.75) * np.clip((elevation - 5) / 12, 0, 1)
    out += cloud[..., None] * (np.array([0.95, 0.96, 0.97]) - out)
    out *= np.where(elevation < 0, 1 + 0.06 * grain, 1.0)[..., None]
    ridge = noise(151, 14.0, 14.0).repeat(2, axis=1)  # smooth rows of noise, all around
    rng = np.random.default_rng(7)
    for row, form in enumerate(SKIES[kind]["forms"]):
        wide, leaves = form.get("wide", 360), form.get("grain", 0)
        own = rng.integers(len(form["colors"]), size=360 // wide), rng.uniform(-1, 1, 360 // wide)
        hue, tall = (values[(around / wide).astype(int)] for values in own)
        top = form["rise"] + form["uneven"] * (tall if "wide" in form else np.clip(ridge[row], -1.2, 1.5))
        here = slice(*np.searchsorted(-elevation[:, 0], (-top.max() - 3 * leaves, -form.get("foot", -2.5))))
        up, leaf = elevation[here], leaves * grain[here]
        shade = 1 + 0.45 * np.clip(leaf, -2, 2) + 0.1 * tall
        if "wide" in form:
            pane, eaves = form["pane"], top - form["roof"]
            top = top - form["roof"] * np.abs(2 * (around / wide % 1) - 1)
            across, level = around / pane % 1, (eaves - up) / (1.4 * pane) % 1
            panes = (np.abs(across - 0.5) < 0.2) & (np.abs(level - 0.55) < 0.25) & (up < eaves)
            shade = np.where(panes, 0.35, np.where((up > eaves) & (form["roof"] > 0), 0.4, shade))
        share = np.clip((top + leaf - up) / SOFT, 0, 1)[..., None]
        out[here] += share * (np.array(form["colors"])[hue] * np.clip(shade, 0.1, 2)[..., None] - out[here])
    return np.clip(out, 0, 1)
