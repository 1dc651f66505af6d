"""The curve of sRGB (IEC 61966-2-1), between colours as images keep them and light as renderers add it."""

import numpy as np


def to_linear(srgb: np.ndarray) -> np.ndarray:
    """Linear light of sRGB colours, both 0 to 1, in any shape."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def from_linear(light: np.ndarray) -> np.ndarray:
    """sRGB colours of linear light, both 0 to 1, in any shape."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def of_hexadecimal(text: str) -> np.ndarray:
    """(3) float linear light of a colour such as `b98f5f`."""
    return to_linear(np.array([int(text[i : i + 2], 16) for i in (0, 2, 4)]) / 255)
