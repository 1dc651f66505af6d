"""Patterns and prints as image files: colour, normals, roughness."""

import io

import numpy as np
from PIL import Image

from echomodel.dressing import PRINTS
from echousd.shapes.finishes.patterns import aged, relief
from echousd.shapes.finishes.pictures import printed
from echousd.shapes.finishes.slots import Color
from echousd.srgb import from_linear

# Patterns of wood; the shares of its red that green and blue of no wood are over: what is of another colour is painted,
# and so much of the grain is seen through it.
GRAINED, LIKE_WOOD, UNDER_PAINT = ("wood", "veneer"), (0.85, 0.58), 0.2
QUALITY = 86  # of JPEG; without subsampling, because normals live in the colours


def color_image(pattern: str, color: Color, harmony: str, worn: float = 0.0) -> bytes:
    """A pattern in a colour (linear RGB), `aged` by a share, or what is printed in those of a harmony, as JPEG."""
    if pattern in PRINTS:
        return _jpeg(printed(pattern, harmony))
    tone = relief(pattern).tone
    if pattern in GRAINED and not (color[1] < LIKE_WOOD[0] * color[0] and color[2] < LIKE_WOOD[1] * color[0]):
        tone, worn = 1 + UNDER_PAINT * (tone - 1), UNDER_PAINT * worn
    tone = aged(tone, worn) if worn else tone
    tone = tone[..., None] if tone.ndim == 2 else tone
    return _jpeg(np.clip(tone * np.asarray(color), 0, 1))


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


def rough_image(pattern: str, roughness: float) -> bytes | None:
    """Roughness about a mean, grey; None where it is even."""
    rough = None if pattern in PRINTS else relief(pattern).rough
    return None if rough is None else _encoded(np.clip(roughness + rough, 0.05, 1), 70)


def _jpeg(value: np.ndarray) -> bytes:
    return _encoded(from_linear(value), QUALITY)


def _encoded(value: np.ndarray, quality: int) -> bytes:
    out = io.BytesIO()
    pixels = (np.clip(value, 0, 1) * 255 + 0.5).astype(np.uint8)
    Image.fromarray(pixels).save(out, "JPEG", quality=quality, subsampling=0)
    return out.getvalue()
