"""What a light of a stage gives, whoever wrote it: UsdLux has its size within or without its intensity, in any unit."""

from functools import partial

import numpy as np
from pxr import Usd, UsdGeom, UsdLux

from echousd.stage import values

MAX_STOPS = 60  # of exposure, either way
# What our rooms tell of sky, panel and sun: without walls, with walls, which throw back what they get, and below a
# ceiling, where the sky is seen through the windows alone. The sun is its irradiance: through windows alone a white
# surface that faces it gains 0.6, about what the sky gives; over walls without a ceiling, which have the sky already,
# so much would leave them blank.
SHARES = {"open": (1.0, 1.0, 0.55), "walls": (1.4, 0.12, 0.55), "ceiling": (4.8, 0.54, 1.9)}


def emitted(prim: Usd.Prim, metres: float) -> np.ndarray:
    """(3,) float by colour: a dome's radiance, a distant light's irradiance, else radiance times surface in m²; zeros
    for kinds without a known surface.

    `metres`: in the stage's unit. Source: UsdLux.LightAPI, `inputs:normalize`. Raises StageError for what is no number.
    """

    number = partial(_number, prim)
    light = UsdLux.LightAPI(prim)
    color = np.array(values.value_of(light.GetColorAttr()) or (1, 1, 1), float)
    if values.value_of(light.GetEnableColorTemperatureAttr()):
        color = color * UsdLux.BlackbodyTemperatureAsRgb(number("colorTemperature"))
    color = np.clip(color, 0.0, None) * number("intensity") * 2.0 ** np.clip(number("exposure"), -MAX_STOPS, MAX_STOPS)
    if prim.IsA(UsdLux.DomeLight):
        return color
    whole = bool(values.value_of(light.GetNormalizeAttr()))
    if prim.IsA(UsdLux.DistantLight):
        disc = np.pi * np.sin(np.radians(number("angle")) / 2) ** 2
        return color if whole or disc == 0 else color * disc
    scale = np.array(UsdGeom.Imageable(prim).ComputeLocalToWorldTransform(values.NOW))[:3, :3]
    level = float(np.linalg.norm(np.cross(scale[0], scale[1])))  # of what lies in its x and y
    if prim.IsA(UsdLux.SphereLight):
        surface = 4 * np.pi * number("radius") ** 2 * float(abs(np.linalg.det(scale))) ** (2 / 3)
    elif prim.IsA(UsdLux.DiskLight) or prim.IsA(UsdLux.RectLight):
        surface = float(np.prod(level_size(prim))) * level
    else:
        return np.zeros(3)
    return color * metres**2 * (1.0 if whole else surface)  # whole, also of a point without any


def level_size(prim: Usd.Prim) -> tuple[float, float]:
    """Width and height of a flat light, in its own frame; of a disc that of a square as large."""
    if prim.IsA(UsdLux.DiskLight):
        return (_number(prim, "radius") * np.pi**0.5,) * 2
    return _number(prim, "width"), _number(prim, "height")


def _number(prim: Usd.Prim, name: str) -> float:
    return values.number(prim.GetAttribute(f"inputs:{name}"), 0.0)
