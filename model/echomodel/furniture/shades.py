"""What lamps are made of: shades with what glows in them, discs and cones."""

from dataclasses import replace

import numpy as np

from echomodel.furniture.carpentry import box
from echomodel.furniture.solids import Lathe, Solid, Turned, ball, turned, wall
from echomodel.furniture.style import Style

RIM = 0.012  # metres, height of a rim's binding


def disc(
    x: float, y: float, z: float, a: float, b: float, h: float, material: str = "metal", high: float = 1.0,
    role: str = "stem",
) -> Turned:  # fmt: skip
    """A disc or cone with its lower face at y: half widths a and b, `high` times that above."""
    low, up = (a, b), (a * high, b * high)
    return turned((x, y, z), low, h, up, material=material, role=role)


def shade(kind: str, x: float, y: float, z: float, a: float, b: float, h: float, style: Style) -> list[Solid]:
    """A shade between y and y + h, half widths a (x) and b (z), with what glows in it.

    Cones, drums and cylinders are open above and below, domes below; a sphere glows itself.
    """
    place = np.array([x, y, z])
    if kind == "sphere":
        half = np.minimum([a, min(a, b), b], h / 2)
        return [ball((x, y + h - half[1], z), half, "shade", "shade")]
    thick, squash = min(0.006, 0.1 * a), b / a
    if kind == "dome":
        turn = np.linspace(0, np.pi / 2, 8)
        outline = [(a * max(float(np.cos(t)), 0.05), h * float(np.sin(t))) for t in turn]
    else:
        narrow = {"cone": 0.35 + 0.25 * style.taper, "drum": 0.85, "cylinder": 1.0}.get(kind, 0.9)
        outline = [(a, 0.0), (a * narrow, h)]
    neck = outline[-1][0]
    inner = max(thick, neck - thick)
    reach = a + 0.9 * (neck - a) - 0.5 * thick
    high = 0.985 if kind == "dome" else 0.93
    bulb = min(0.045, 0.4 * inner, 0.3 * h)
    skin = Lathe(centre=place, profile=wall(outline, thick), squash=squash, hollow=True, material="shade", role="shade")
    body = replace(skin, profile=np.array(outline), hollow=False, core=True)  # a coarse grid sees a full shade
    light = ball((x, y + 0.45 * h, z), bulb, "shade", "bulb")
    low = y + 0.45 * h + 0.7 * bulb
    socket = disc(x, low, z, 0.45 * bulb, 0.45 * bulb, y + high * h - low, role="bulb")
    arms: list[Solid] = []
    if kind != "dome":
        low, up = y + 0.9 * h, y + 0.9 * h + 0.005
        bars = (reach, 0.003), (0.003, reach * squash)
        arms = [box((x - i, low, z - k), (x + i, up, z + k), "metal", 0.0, "shade") for i, k in bars]
        for r, e in ((a, 0.0), (neck, h - RIM)) if a > 0.08 else ():  # the bindings of its rims do not glow
            rim = wall([(r + 0.001, e), (r + 0.001, e + RIM)], thick + 0.002)
            arms.append(replace(skin, profile=rim, material="linen"))
    return [skin, body, light, socket, *arms]


def kind_of(style: Style, *without: str) -> str:
    """The kind of a single shade, a drum for what has several parts and for kinds that do not fit."""
    return style.shade if style.shade not in ("ring", "arms", *without) else "drum"


def one_shade(style: Style, wide: float, tall: float, most: float) -> tuple[str, float]:
    """Kind and height of a single shade of this width: a globe is as high as wide, where there is so much height."""
    kind = kind_of(style, *(("sphere",) if wide > most else ()))
    return kind, wide if kind == "sphere" else tall
