"""Light in a room with walls: windows, lamps, what surfaces throw on to one another, how bright a picture of it is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from pxr import Usd, UsdGeom, UsdLux

from echomodel.triangles import area_normals
from echousd.draw.drawables import LINEAR, image_of
from echousd.stage.lights import SHARES, emitted, level_size
from echousd.stage.units import to_metres
from echousd.stage.values import NOW

# Of what is told of the sun, by colour, as Blender has it: eyes see it brighter than a camera in the room would bear,
# and pictures of rooms have it warmer than the light of the sky.
SUN = 4 * np.array([1.12, 1.0, 0.78], np.float32)
# What is seen through windows is over-exposed, as in photographs of interiors, and rolled off as film does: how much
# brighter it is by day, the power of the sky's light by which it is less in the evening, and haze before it; the
# brightness below which it is lifted, and by which power: a tree before one window leaves it no darker than others.
THERE, DUSK, VEIL, LIFTED = 2.45, 0.5, 0.03, (0.15, 0.4)
WHITER = 0.25  # how much less coloured the light of lamps is than told: no wall is as yellow to eyes
DIM = 0.004  # radiance at every place of a room without lamps and windows, so that one sees it
# To the colour of the light, by night and by day: lamps stay warm. What so many of a hundred points of the picture are
# darker than comes to, by night and by day, and how much at most it is brightened for that.
ADAPTED, BRIGHT, SHARE, BRIGHTEST = (0.58, 0.95), (0.34, 0.62), 70, 40.0
# Power of the light's brightness that eyes take from it, and inside whoever photographs rooms gives it; and what it
# comes near to over the mean inside, where lamps are blended in from darker exposures: walls keep their look.
EVEN, LIMIT = (0.18, -0.15), (np.inf, 1.95)
PALER = 0.32  # share of how its colour differs from the mean that they take from it, too
WHITE, PAPER = 84, 0.95  # what so many of a hundred points are darker than comes to no more than that
CONTRAST, SHOULDER = 1.55, 0.8  # power about what is bright, and the share of it from where highlights are rolled off
# Share of colours that keep their hue where they are bright, which film bleaches, and how much more coloured all are,
# by night, when lamps are warm, not yellow, and by day.
HUE, CHROMA = (0.5, 0.8), (1.0, 1.18)
LUMA = np.array([0.2126, 0.7152, 0.0722], np.float32)
DAY = 0.5  # radiance of the sky by day
GREY = 0.5  # how much less coloured light from outside is than what lies there: ceilings over lawns stay white
BANDS = 64  # heights of the sky whose light is told apart
# The brightest shade over what white paper is on the average in the room, by night and by day, as eyes see it; the
# share of its light that is seen at its rim.
GLOWING, RIM = (2.4, 2.6), 0.35
# Metres around a lamp where it throws no shadow of its own, and how far from a bulb its shade may be; its places that
# light comes from, where it has no shade as far around the bulb.
OWN, SHADED, SPOTS, BULB = 0.12, 0.5, 24, 0.05


@dataclass(frozen=True, eq=False)
class Lights:
    """Lights of a stage, y up, metres."""

    sky: float  # radiance of the dome
    sun: np.ndarray | None  # (2, 3) float32, direction towards it and irradiance by colour
    bulbs: np.ndarray  # (n, k, 3) float32 places all over the shades of lamps
    power: np.ndarray  # (n, 3) float32, radiant intensity by colour
    # (q, 4, 3) float32 middle, half of the width and of the depth of panels, which shine against the product of these,
    # and their radiance by colour
    panels: np.ndarray
    tint: np.ndarray  # (3,) float32, colour of the dome
    view: np.ndarray | None  # (h, w, 3) uint8 sRGB, what lies around by latitude and longitude, the zenith first

    @property
    def day(self) -> float:
        """1 by day, 0 without light from outside."""
        return min(1.0, self.sky / DAY)

    @cached_property
    def shining(self) -> np.ndarray:
        """(n, 3) the power as a picture shows it, see `WHITER`."""
        return self.power + np.float32(WHITER) * ((self.power @ LUMA)[:, None] - self.power)

    @cached_property
    def planes(self) -> np.ndarray:
        """(3, h * w) uint8, `view` plane by plane: numpy would copy all of it wherever some is taken."""
        return np.ascontiguousarray(np.asarray(self.view).reshape(-1, 3).T)

    @cached_property
    def falling(self) -> np.ndarray:
        """(3, `BANDS`) float32 radiance of the sky by how far down it is, the zenith first."""
        down = 1 - (2 * np.arange(BANDS) + 1) / BANDS
        if self.view is None:
            color = np.clip(0.65 + 1.4 * down, 0.3, 1) * np.ones((3, 1))
        else:
            rows = (np.arccos(down) / np.pi * len(self.view)).astype(int)
            color = LINEAR.take(self.view[rows, :: max(self.view.shape[1] // BANDS, 1)]).mean(1).T
            color = color + np.float32(GREY) * (LUMA @ color - color)
        return np.asarray(self.sky * self.tint[:, None] * color, np.float32)

    def from_sky(self, way: np.ndarray) -> np.ndarray:
        """(3, n) radiance of the sky in directions (3, n)."""
        return self.falling.take(((1 - way[1]) * np.float32(BANDS / 2 - 0.01)).astype(int), 1, mode="clip")

    def below_ceiling(self) -> Lights:
        """Those of one of our rooms were it made with a ceiling, but as bright outside."""
        (sky, panel, _), (open_sky, open_panel, _) = SHARES["ceiling"], SHARES["walls"]
        darker, share = open_sky / sky, panel / open_panel if self.day >= 1 else 1.0
        panels = self.panels * np.array([1, 1, 1, darker * share], np.float32)[:, None]
        return replace(self, panels=panels, power=self.power * np.float32(darker))

    def there(self, color: np.ndarray) -> np.ndarray:
        """(3, n) how a picture shows colours (3, n) of what lies around."""
        color = VEIL + (1 - VEIL) * color * (LIFTED[0] / np.clip(LUMA @ color, 1e-3, LIFTED[0])) ** LIFTED[1]
        return np.asarray(rolled(color * (THERE * self.day**DUSK * self.tint)[:, None]), "f4")


def read_lights(stage: Usd.Stage, shades: Sequence[np.ndarray] = (), halved: int = 0) -> Lights:
    """The lights of a stage: domes, the brightest distant light, spheres; flat ones where it is dark and no lamp is.

    `shades`: of everything that glows its triangles (f, 3, 3) in the world, metres. `halved`: how often the sides of
    the picture of what lies around are.
    """
    frame, cache = to_metres(stage), UsdGeom.XformCache(NOW)
    sky, suns, bulbs, power, tint = 0.0, [], [], [], np.ones(3, np.float32)
    domes, view, panels = 0, None, list[np.ndarray]()
    for prim in stage.Traverse():
        if not prim.HasAPI(UsdLux.LightAPI) or UsdGeom.Imageable(prim).ComputeVisibility(NOW) == "invisible":
            continue
        color = emitted(prim, float(frame[0, 0])).astype(np.float32)
        world = frame @ np.array(cache.GetLocalToWorldTransform(prim)).T
        if prim.IsA(UsdLux.DomeLight):
            strength = float(color.max())
            domes, sky, tint = domes + 1, sky + strength, color / max(strength, 1e-9)
            picture = UsdLux.DomeLight(prim).GetTextureFileAttr().Get(NOW)
            if picture is not None:
                view = image_of(str(prim.GetPath()), picture.resolvedPath, halved)
        elif prim.IsA(UsdLux.DistantLight):
            towards = world[:3, 2] / max(float(np.linalg.norm(world[:3, 2])), 1e-9)
            suns.append(np.stack([towards, color]))
        elif prim.IsA(UsdLux.SphereLight):
            bulbs.append(_spots(world[:3, 3], shades))
            power.append(color / 4)  # what goes each way
        elif prim.IsA(UsdLux.RectLight) or prim.IsA(UsdLux.DiskLight):
            sides = world[:3, :2].T * np.array(level_size(prim))[:, None] / 2
            area = 4 * float(np.linalg.norm(np.cross(*sides)))
            panels.append(np.stack([world[:3, 3], *sides, color / max(area, 1e-9)]))
    sun = max(suns, key=lambda one: float(one[1].sum()), default=None)
    return Lights(
        sky=sky if domes else 1.0, sun=None if sun is None else sun.astype(np.float32),
        bulbs=np.array(bulbs, np.float32).reshape(-1, SPOTS, 3), power=np.array(power, np.float32).reshape(-1, 3),
        panels=np.array(panels, np.float32).reshape(-1, 4, 3), tint=tint, view=view,
    )  # fmt: skip


def _spots(bulb: np.ndarray, shades: Sequence[np.ndarray]) -> np.ndarray:
    """(`SPOTS`, 3) places that a lamp's light comes from: all over the shade at its bulb (3,), else around that."""
    turn = np.arange(SPOTS) * np.pi * (3 - 5**0.5)
    height = 1 - (2 * np.arange(SPOTS) + 1) / SPOTS
    around = np.sqrt(1 - height**2)
    spots = bulb + BULB * np.stack([around * np.cos(turn), height, around * np.sin(turn)], 1)
    nearest = SHADED
    for triangles in shades:
        middle = triangles.mean(1)
        away = float(np.linalg.norm(middle - bulb, axis=1).min())
        if away < nearest:
            area = np.linalg.norm(area_normals(triangles), axis=1).cumsum()
            spots, nearest = middle[np.searchsorted(area, area[-1] * (np.arange(SPOTS) + 0.5) / SPOTS)], away
    return spots


def evened(light: np.ndarray, white: np.ndarray, inside: bool = True) -> np.ndarray:
    """Light (3, n) as eyes take it: less bright where it is brighter than the mean and more where it is less, so that
    walls at lamps and windows keep their colour and corners are not black; and nearer to the mean's colour, so that
    white ceilings over wooden floors and lawns stay white.

    `white`: (3,) the mean light in the room. `inside`: whether it is seen from there.
    """
    level, mean = LUMA @ light, max(float(white @ LUMA), 1e-6)
    light = light + np.float32(PALER) * ((white / mean).astype("f4")[:, None] * level - light)
    over, limit = np.maximum(level / np.float32(mean), np.float32(1e-3)), np.float32(LIMIT[inside])
    return light * over ** np.float32(-EVEN[inside]) * np.sqrt((1 + limit**-2) / (1 + np.square(over / limit)))


def exposure(color: np.ndarray, light: np.ndarray, day: float = 1.0) -> Callable[[np.ndarray], np.ndarray]:
    """How a picture's linear colours (3, n) come to [0, 1]: what is bright in the room comes to `BRIGHT`, with
    contrast about it, and what is brighter is rolled off as film does.

    `color`: (3, n) linear radiance of the picture. `light`: (3,) that of the room, to whose colour the eye adapts in
    part. `day`: 1 by day, 0 by night, see `Lights.day`.
    """
    adapted, bright, hue, chroma = (float(np.interp(day, (0, 1), ends)) for ends in (ADAPTED, BRIGHT, HUE, CHROMA))
    white = (np.maximum(light, 1e-6) / max(float(light.mean()), 1e-6)) ** adapted
    seen, most = np.maximum(np.percentile((LUMA / white).astype("f4") @ color, (SHARE, WHITE)), 1e-4)
    scale = (min(bright / seen, bright / BRIGHT[1] * PAPER / most, BRIGHTEST) / white).astype("f4")[:, None]

    def shown(color: np.ndarray) -> np.ndarray:
        color = color * scale
        level = np.maximum(LUMA @ color, np.float32(1e-6))
        color = np.maximum(level + chroma * (color - level), 0)
        mapped = _filmic(level, bright)
        kept = hue * np.sqrt(1 - mapped)
        return np.clip(kept * color * mapped / level + (1 - kept) * _filmic(color, bright), 0, 1)

    return shown


def _filmic(level: np.ndarray, middle: float) -> np.ndarray:
    """Contrast about a middle tone, and a shoulder."""
    return rolled(middle * (np.maximum(level, 0) / np.float32(middle)) ** np.float32(CONTRAST), BRIGHT[1])


def rolled(level: np.ndarray, knee: float = 0.76) -> np.ndarray:
    """Bright values rolled off towards 1 from a knee on instead of clipped, so that shades stay apart to eyes."""
    shown = knee ** (1 / 2.2)
    over = np.maximum(level / np.float32(knee), 1) ** np.float32(-SHOULDER * shown / (1 - shown) / 2.2)
    return np.where(level > knee, (1 - np.float32(1 - shown) * over) ** np.float32(2.2), level)


CELL = 0.5  # metres


@dataclass(frozen=True, eq=False)
class Bounced:
    """How bright the surfaces of a room are: (3, cells * 6) radiance by cell of `CELL` metres and side.

    `low`: (3,) the room's corner, metres. `shape`: (3,) int, cells along x, y and z.
    """

    low: np.ndarray
    shape: np.ndarray
    radiance: np.ndarray

    @classmethod
    def dark(cls, low: np.ndarray, high: np.ndarray) -> Bounced:
        """The table of a room between two corners (3,), metres, without light."""
        shape = np.maximum(np.ceil((high - low) / CELL), 1).astype(int)
        return cls(low.astype(np.float32), shape, np.zeros((3, 6 * shape.prod()), np.float32))

    def rows(self, origin: np.ndarray, way: np.ndarray, far: np.ndarray, axis: np.ndarray) -> np.ndarray:
        """(n,) int, the rows of `radiance` where rays, `origin` and `way` (3, n), met surfaces after `far` (n,) metres.

        `axis`: (n,) int, along which of them the surfaces look.
        """
        side = 2 * axis + (way.ravel().take(axis * len(far) + np.arange(len(far))) < 0)
        before = np.maximum(far - 0.05, 0) * way + (origin - self.low[:, None])
        x, y, z = (np.clip((at / CELL).astype(int), 0, many - 1) for at, many in zip(before, self.shape, strict=True))
        return np.asarray(((x * self.shape[1] + y) * self.shape[2] + z) * 6 + side)

    def lit(self, rows: np.ndarray, thrown: np.ndarray) -> Bounced:
        """The table where surfaces throw back what some of them do, (3, n); where none is in a row, the mean of its
        side."""
        many = self.radiance.shape[1]
        total = np.stack([np.bincount(rows, channel, many) for channel in thrown])
        count = np.bincount(rows, minlength=many)
        even = total.reshape(3, -1, 6).sum(1) / np.maximum(count.reshape(-1, 6).sum(0), 1)
        mean = np.where(count > 0, total / np.maximum(count, 1), np.tile(even, many // 6))
        return replace(self, radiance=mean.astype(np.float32))
