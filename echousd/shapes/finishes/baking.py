"""Patterns as image files: colour tinted, roughness and normals, as bytes that are the same in every run."""

from __future__ import annotations

import io
from functools import cache

import numpy as np

from echousd.shapes.finishes.harmonies import HARMONIES, Color, linear
from echousd.shapes.finishes.patterns import SIZE, relief
from echousd.shapes.finishes.pictures import painting, sky
from echousd.srgb import from_linear

QUALITY = 86  # of JPEG; without subsampling, because normals live in the colours


def hexadecimal(color: Color) -> str:
    """Linear RGB as sRGB hex."""
    return "".join(f"{int(v * 255 + 0.5):02x}" for v in from_linear(np.clip(np.asarray(color, float), 0, 1)))


@cache
def color_image(pattern: str, color: Color, harmony: str) -> bytes:
    """A pattern in a colour (linear RGB), or a painting in the colours of a harmony, as JPEG."""
    if pattern.startswith("painting_"):
        tones = HARMONIES[harmony]
        named = ("f4efe6", tones.accent, tones.cloth, tones.wood, "2d3136")
        return _jpeg(painting([linear(c) for c in named], int(pattern.rsplit("_", 1)[1])))
    tone = relief(pattern).tone
    tone = tone[..., None] if tone.ndim == 2 else tone
    return _jpeg(np.clip(tone * np.asarray(color), 0, 1))


@cache
def normal_image(pattern: str, metres: float) -> bytes | None:
    """Tangent-space normals of a pattern that covers `metres`, +Y up as UsdPreviewSurface takes it; None if flat."""
    height = None if pattern.startswith("painting_") else relief(pattern).height
    if height is None:
        return None
    step = 2 * max(metres, 0.4) / SIZE
    across = (np.roll(height, -1, 1) - np.roll(height, 1, 1)) / step
    down = (np.roll(height, -1, 0) - np.roll(height, 1, 0)) / step
    normal = np.stack([-across, down, np.ones_like(across)], -1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return _encoded(normal / 2 + 0.5, 78)


@cache
def rough_image(pattern: str, roughness: float) -> bytes | None:
    """Roughness about a mean, grey; None where it is even."""
    rough = None if pattern.startswith("painting_") else relief(pattern).rough
    return None if rough is None else _encoded(np.clip(roughness + rough, 0.05, 1), 70)


@cache
def sky_image() -> bytes:
    """What lies around a room, for its dome light, as JPEG."""
    return _jpeg(sky())


def _jpeg(value: np.ndarray) -> bytes:
    return _encoded(from_linear(value), QUALITY)


def _encoded(value: np.ndarray, quality: int) -> bytes:
    from PIL import Image

    out = io.BytesIO()
    pixels = (np.clip(value, 0, 1) * 255 + 0.5).astype(np.uint8)
    Image.fromarray(pixels).save(out, "JPEG", quality=quality, subsampling=0)
    return out.getvalue()
