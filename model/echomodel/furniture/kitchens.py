"""Kitchens: fitted units on a plinth below one worktop, cut to the length of their run, and what is built in.

Heights after DIN EN 1116: worktops at 0.9 m, 0.6 m deep, units in steps of 0.1 or 0.15 m.
"""

from itertools import pairwise

import numpy as np

from echomodel.furniture.carpentry import Size, around, box, core, of_role
from echomodel.furniture.fronts import boards, front
from echomodel.furniture.solids import Solid, rotation, tube, turned
from echomodel.furniture.style import Choices, Style

PLINTH, WORKTOP = 0.1, 0.04  # metres: height of the plinth, thickness of the worktop
SPOUT = 0.0094  # metres that a tap is thick over its line
TAP = 0.27  # metres over the worktop
GRIP = 0.04  # metres that the worktop covers of the handles
RECESS = 0.05  # metres that the plinth stands back, for feet
SIDE, PANEL, BACK = 0.018, 0.022, 0.015  # metres: boards, what fronts need before them, and a back
Span = tuple[float, float]
UNIT = 0.6  # metres: a usual width; wider runs are divided into such units


def base_unit(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Doors or drawers on a plinth below a worktop; long runs in several units."""
    w, h, d = size
    parts = _worktop(size)
    for low, high in _units(w):
        kind = choices.pick("kind", ["door", "drawer", "both"], [0.45, 0.3, 0.25])
        parts += _unit(low, high, (PLINTH, h - WORKTOP), _deep(d), kind, style)
    return parts


def wall_unit(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Cupboards above a worktop: doors, some of glass, or an open shelf at one end."""
    w, h, d = size
    parts: list[Solid] = []
    units = _units(w)
    for number, (low, high) in enumerate(units):
        glazed = choices.chance("front", 0.25)
        if len(units) > 1 and number == len(units) - 1 and choices.chance("extra", 0.35):
            parts += _shell(low, high, (0.0, h), _deep(d))
            parts.append(box((low, h / 2 - 0.009, -d / 2), (high, h / 2 + 0.009, _deep(d)[1]), role="shelf"))
        else:
            parts += _unit(low, high, (0.0, h), _deep(d), "glass" if glazed else "door", style)
    return parts


def tall_unit(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A larder of two doors, or one with an oven at the height of one's hands."""
    w, h, d = size
    if not choices.chance("kind", 0.5):
        split = 0.55 * h
        return [*_plinth(size), *_unit(-w / 2, w / 2, (PLINTH, split), _deep(d), "door", style),
                *_unit(-w / 2, w / 2, (split, h), _deep(d), "door", style)]  # fmt: skip
    low, high = 0.35 * h, 0.35 * h + 0.6
    return [
        *_plinth(size), *_unit(-w / 2, w / 2, (PLINTH, low), _deep(d), "drawer", style),
        *_oven(-w / 2, w / 2, (low, high), _deep(d)), *_unit(-w / 2, w / 2, (high, h), _deep(d), "door", style),
    ]  # fmt: skip


def sink_unit(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A basin let into the worktop, with a tap behind it and doors below."""
    w, _, d = size
    h = float(size[1]) - TAP
    half, deep = min(0.27, 0.4 * w), 0.18
    x0, x1, z0, z1 = -half, half, -0.16, d / 2 - 0.09
    parts = _worktop(np.array([w, h, d]), hole=(x0, x1, z0, z1))
    parts += basin((x0, x1, z0, z1), h, deep, "steel")
    parts += spout(0.0, h, (z0 - d / 2) / 2, TAP, 0.16)
    y, top, (back, z) = h - WORKTOP - deep - 0.01, h - WORKTOP, _deep(d)
    parts += [box((x, y, back), (x + SIDE, top + 0.002, z), role="side") for x in (-w / 2, w / 2 - SIDE)]
    parts.append(box((-w / 2, y + 0.003, z - 0.004), (w / 2, top, z + 0.018), "accent", 0.001, "panel"))
    for low, high in _units(w):
        parts += _unit(low, high, (PLINTH, y), (back, z), "door", style)
    return parts


def hob_unit(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A glass hob with four rings on the worktop, the oven below it."""
    w, h, d = size
    half = min(0.29, 0.45 * w)
    parts = _worktop(size, hole=(-half, half, -0.24, 0.26))
    parts.append(box((-half, h - WORKTOP, -0.24), (half, h - 0.002, 0.26), "screen", 0.0, "hob"))
    for x, z, radius in ((-0.14, -0.1, 0.08), (0.14, -0.1, 0.1), (-0.14, 0.13, 0.1), (0.14, 0.13, 0.08)):
        parts.append(turned((x * half / 0.29, h - 0.0035, z), radius, 0.0035, material="steel", role="hob"))
    side = (w - UNIT) / 2
    low, high = (-w / 2, w / 2) if side < 0.15 else (-UNIT / 2, UNIT / 2)
    parts += _oven(low, high, (PLINTH, h - WORKTOP), _deep(d))
    if side >= 0.15:
        for left, right in ((-w / 2, low), (high, w / 2)):
            parts += _unit(left, right, (PLINTH, h - WORKTOP), _deep(d), "drawer", style)
    return parts


def dishwasher(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A front like its neighbours', with a bar of switches, that tips down."""
    w, h, d = size
    parts = _worktop(size)
    _, z = _deep(d)
    parts += _shell(-w / 2, w / 2, (PLINTH, h - WORKTOP), _deep(d), closed=True)
    panel = h - WORKTOP - 0.11
    parts.append(box((-w / 2, panel + 0.003, z - 0.004), (w / 2, h - WORKTOP, z + 0.018), "steel", 0.002, "switches"))
    return parts + front((-w / 2, PLINTH), (w / 2, panel), z, 1, 1, "door", style)


def fridge(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A cold body of steel or enamel with two doors above each other, tall handles at one side."""
    w, h, d = size
    material = choices.pick("cover", ["steel", "enamel"], [0.5, 0.5])
    z, foot = d / 2 - 0.06, 0.05
    split = foot + (h - foot) * choices.pick("split", [0.36, 0.62])
    parts: list[Solid] = [
        box((-w / 2, foot, -d / 2), (w / 2, h, z), material, 0.006, "cold"),
        box((-w / 2 + 0.02, 0, -d / 2 + 0.03), (w / 2 - 0.02, foot + 0.002, z - 0.03), "screen", 0.0, "plinth"),
    ]
    for low, high in ((foot, split), (split, h)):
        parts.append(box((-w / 2, low + 0.004, z - 0.002), (w / 2, high - 0.004, z + 0.045), material, 0.01, "front"))
        y0 = high - 0.5 if high == split else low + 0.12
        y1 = high - 0.12 if high == split else low + 0.5
        grip = [[w * 0.4, y, z + out] for y, out in ((y0, 0.04), (y0, 0.06), (y1, 0.06), (y1, 0.04))]
        parts.append(tube(grip, 0.009, "steel", "handle"))
    return parts


def range_hood(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A steel hood: a slab below a chimney, or a hood that slopes up to it."""
    w, h, d = size
    lip = 0.06
    chimney = box((-0.15, lip, -d / 2), (0.15, h, -d / 2 + 0.26), "steel", 0.002, "chimney")
    slab = box((-w / 2, 0, -d / 2), (w / 2, lip, d / 2), "steel", 0.004, "hood")
    if choices.chance("kind", 0.5):
        return [slab, chimney]
    slope = turned((0, lip - 0.002, 0.0), (w / 2 * 0.98, d / 2 * 0.98), max(0.1, 0.35 * h), (0.2, d * 0.22),
                   power=np.inf, material="steel", role="hood")  # fmt: skip
    return [slab, slope, chimney]


def kitchen_island(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Units whose worktop reaches over at the back, where one sits on high stools."""
    w, h, d = size
    over = min(0.3, 0.35 * d)
    z0 = over - d / 2
    parts: list[Solid] = [
        box((-w / 2, h - WORKTOP, -d / 2), (w / 2, h, d / 2), "worktop", 0.0, "worktop"),
        box((0.02 - w / 2, 0, z0 + RECESS), (w / 2 - 0.02, PLINTH, d / 2 - RECESS - GRIP), "accent", 0.0, "plinth"),
    ]
    kind = choices.pick("kind", ["door", "drawer"])
    for low, high in _units(w - 0.04):
        parts += _unit(low, high, (PLINTH, h - WORKTOP), (z0, _deep(d)[1]), kind, style)
    return parts


def _units(w: float) -> list[tuple[float, float]]:
    """The left and right ends of equal units, about 0.6 m wide, that fill a width."""
    return list(pairwise(np.linspace(-w / 2, w / 2, max(1, round(w / UNIT)) + 1).tolist()))


def _plinth(size: Size) -> list[Solid]:
    w, _, d = size
    low, high = (-w / 2, 0, -d / 2 + 0.02), (w / 2, PLINTH + 0.002, d / 2 - RECESS - GRIP)
    return [box(low, high, "accent", 0.0, "plinth")]


def _worktop(size: Size, hole: tuple[float, float, float, float] | None = None) -> list[Solid]:
    """A plinth and a worktop, with a hole (x0, x1, z0, z1) in it."""
    w, h, d = size
    x, z, low = w / 2, d / 2, h - WORKTOP
    if hole is None:
        return [*_plinth(size), box((-x, low, -z), (x, h, z), "worktop", 0.0, "worktop")]
    return [*_plinth(size), *around((-x, x, -z, z), hole, low, h, "worktop", "worktop")]


def _deep(d: float) -> Span:
    """The planes of the back and of the fronts of a unit."""
    return -d / 2, d / 2 - PANEL - GRIP


def _shell(low: float, high: float, span: Span, deep: Span, *, closed: bool = False) -> list[Solid]:
    """The boards of a unit between two x, two y and two z, open in front."""
    corners = (low, span[0], deep[0]), (high, span[1], deep[1])
    parts = boards(*corners, SIDE, 0.01)
    return [*parts, core(*corners)] if closed else parts


def _unit(low: float, high: float, span: Span, deep: Span, kind: str, style: Style) -> list[Solid]:
    """One unit with its fronts: `door`, `glass`, `drawer`, or `both` (a drawer above doors)."""
    (y0, y1), z = span, deep[1]
    parts = _shell(low, high, span, deep, closed=kind != "glass")
    columns, depth = 2 if high - low > 0.75 else 1, z - deep[0] - BACK
    if kind == "drawer":
        return parts + front((low, y0), (high, y1), z, 3 if y1 - y0 > 0.6 else 2, 1, "drawer", style, depth)
    if kind == "both":
        split = y1 - 0.17
        upper = front((low, split), (high, y1), z, 1, columns, "drawer", style, depth)
        return [*parts, *upper, *front((low, y0), (high, split), z, 1, columns, "door", style, depth)]
    return parts + front((low, y0), (high, y1), z, 1, columns, "door", style, depth, glazed=kind == "glass")


def _oven(low: float, high: float, span: Span, deep: Span) -> list[Solid]:
    """A steel oven in its niche: a dark pane with a bar to pull, knobs above."""
    (y0, y1), z = span, deep[1]
    top = y1 - 0.11
    parts = _shell(low, high, span, deep, closed=True)
    parts += [
        box((low + 0.003, y0 + 0.003, z - 0.004), (high - 0.003, top, z + 0.016), "steel", 0.002, "oven"),
        box((low + 0.06, y0 + 0.07, z + 0.012), (high - 0.06, top - 0.1, z + 0.0185), "screen", 0.001, "pane"),
        box((low + 0.003, top + 0.003, z - 0.004), (high - 0.003, y1 - 0.003, z + 0.016), "steel", 0.002, "switches"),
    ]
    y = top - 0.045
    ends = (low + 0.07, 0.012), (low + 0.07, 0.045), (high - 0.07, 0.045), (high - 0.07, 0.012)
    parts.append(tube([[x, y, z + out] for x, out in ends], 0.007, "steel", "handle"))
    for x in np.linspace(low + 0.1, high - 0.1, 4):
        place, ahead = (x, (top + y1) / 2, z + 0.014), rotation(x=np.pi / 2)
        parts.append(turned(place, 0.016, 0.02, 0.014, turn=ahead, material="screen", role="knob"))
    return parts


def basin(rect: tuple[float, float, float, float], rim: float, deep: float, material: str) -> list[Solid]:
    """An open trough of five sheets below a rim, over a rectangle (x0, x1, z0, z1)."""
    (x0, x1, z0, z1), y, t = rect, rim - deep, 0.008
    over = x0 - 0.012, x1 + 0.012, z0 - 0.012, z1 + 0.012  # over the worktop's edge, so that it rests on it
    sheets = around(over, (x0 + t, x1 - t, z0 + t, z1 - t), y, rim + 0.002, material, "basin")
    return [box((x0, y, z0), (x1, y + t, z1), material, 0.0, "basin"), *sheets]


def spout(x: float, y: float, z: float, high: float, reach: float) -> list[Solid]:
    """A spout that bends forward over the basin, `high` in all, and its lever."""
    high -= SPOUT
    bend = np.array([[0, 0, 0], [0, 0.75 * high, 0], [0, 0.95 * high, 0.12 * reach], [0, high, 0.42 * reach],
                     [0, high, 0.58 * reach], [0, 0.93 * high, 0.9 * reach], [0, 0.8 * high, reach]])  # fmt: skip
    lever = np.array([[0, 0.2 * high, 0], [0.06, 0.28 * high, 0]])
    at, foot = np.array([x, y, z]), turned((x, y - 0.003, z), 0.024, 0.015)
    return of_role("tap", [foot, tube(bend + at, 0.011), tube(lever + at, 0.007)], material="metal")
