"""Beds of children: cots, houses, lofts and bunks."""

import numpy as np

from echomodel.furniture.beds import bed
from echomodel.furniture.carpentry import Size, both, box, four, of_role, post
from echomodel.furniture.cloth import cover, pillow
from echomodel.furniture.fronts import front
from echomodel.furniture.household import cot
from echomodel.furniture.solids import Block, Solid, rotation
from echomodel.furniture.style import Choices, Style


def kids_bed(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A cot when small, a bunk when tall, otherwise a small bed with rails, drawers or a gabled headboard."""
    w, h, d = size
    if w < 0.85 or d < 1.4:
        return cot(size, style, choices)
    if h > 1.55:
        return _bunk(size, style)
    if h > 1.2 and choices.chance("kind", 0.45):
        return _loft(size)
    house = h > 1.25 and choices.chance("extra", 0.7)
    parts = bed(np.array([w, min(h, 1.0) if house else h, d]), style, choices, 1)
    if house:
        return parts + _house(w, h, d)
    y0, y1 = 0.3, min(h * 0.85, 0.72)
    side = -1 if choices.chance("side", 0.5) else 1
    x, high = side * w / 2, y1 + 0.04
    guard: list[Solid] = [
        box((x - 0.02, y - 0.035, -d * 0.48), (x + 0.02, y + 0.035, d * 0.1)) for y in np.linspace(y0 + 0.12, y1, 2)
    ]
    guard += [box((x - 0.025, y0 - 0.1, z - 0.03), (x + 0.025, high, z + 0.03)) for z in (-d * 0.2, d * 0.08)]
    return parts + of_role("guard", guard)


def _made_up(x0: float, x1: float, y: float, d: float, inset: float) -> list[Solid]:
    """A thin mattress on a deck at y from x0 to x1, a pillow at its rear end and a blanket over the rest."""
    thick, rng = 0.14, np.random.default_rng(int(1000 * y))
    middle, wide = (x0 + x1) / 2, x1 - x0
    rear, near = -d / 2 + inset, d / 2 - inset
    low, high = (x0 + 0.045, y + 0.05, -d * 0.12), (x1 - 0.045, y + thick + 0.04, near + 0.01)
    place, half = (middle, y + thick + 0.045, rear + 0.22), (min(0.32, 0.36 * wide), 0.075, 0.18)
    return [
        box((x0 + 0.05, y, rear), (x1 - 0.05, y + thick, near), "linen", 0.04, "mattress"),
        pillow(place, half, "linen", "pillow"),
        cover(low, high, "blanket", 0.04, 0.025, rng),
    ]


def _house(w: float, h: float, d: float) -> list[Solid]:
    """Posts and rafters in the outline of a house."""
    t, eaves = 0.03, h * 0.72
    parts = four(post(w / 2 - t, d / 2 - t, t, 0, eaves))
    slope, length = np.arctan2(h - eaves, w / 2), np.hypot(h - eaves, w / 2)
    for z in (-(d / 2 - t), d / 2 - t):
        centre = np.array([w / 4, (eaves + h) / 2 - t, z])
        parts += both(Block(centre, rotation(z=-slope), role="board", half=np.array([length / 2, t, t])))
    parts.append(box((-t, h - 2 * t, -d / 2), (t, h, d / 2)))
    return of_role("house", parts)


def _loft(size: Size) -> list[Solid]:
    """One high deck on four posts with a rail round it, a ladder in front, and a chest of shelves below."""
    w, h, d = size
    t, deck = 0.035, h - 0.45
    parts = four(post(w / 2 - t, d / 2 - t, t, 0, h - 0.05, role="leg"))
    parts.append(box((-w / 2, deck, -d / 2), (w / 2, deck + 0.1, d / 2), role="rail"))
    parts += _made_up(-w / 2, w / 2, deck + 0.08, d, 0.05)
    guard: list[Solid] = []
    for y in (deck + 0.26, h - 0.09):
        guard += both(box((w / 2 - 0.018, y, -d / 2), (w / 2 + 0.018, y + 0.07, d / 2)))
        guard.append(box((-w / 2, y, -d / 2), (w / 2, y + 0.07, -d / 2 + 0.03)))
        guard.append(box((-w / 2, y, d / 2 - 0.03), (w * 0.1, y + 0.07, d / 2)))
    parts += of_role("guard", guard)
    parts += _ladder((w * 0.14, w * 0.42), (d / 2 - 0.03, d / 2 + 0.01), deck, h - 0.05)
    x0, x1, z0, z1 = -w * 0.45, -w * 0.1, -d * 0.45, d * 0.2
    chest: list[Solid] = [box((x0, y, z0), (x1, y + 0.02, z1)) for y in (0.03, deck * 0.36, deck * 0.7)]
    chest += [box((x - 0.01, 0, z0), (x + 0.01, deck, z1)) for x in (x0, x1)]
    return parts + of_role("shelf", chest)


def _ladder(across: tuple[float, float], deep: tuple[float, float], deck: float, high: float) -> list[Solid]:
    """Two uprights `high` and the steps up to a deck between them, along the longer side of a rectangle in plan."""
    (x0, x1), (z0, z1), t = across, deep, 0.02
    ends = ((x, x, z0, z1) for x in across) if x1 - x0 > z1 - z0 else ((x0, x1, z, z) for z in deep)
    sides = [box((a - t, 0, c - t), (b + t, high, d + t)) for a, b, c, d in ends]
    steps = np.linspace(0.25, deck, max(3, round(deck / 0.265)))
    return of_role("ladder", [*sides, *(box((x0, y, z0), (x1, y + 0.035, z1)) for y in steps)])


def _bunk(size: Size, style: Style) -> list[Solid]:
    """Two decks on four posts, a rail above and a ladder or stairs with drawers."""
    w, h, d = size
    stairs = w > 1.9
    wide = w - 0.5 if stairs else w
    x0 = -w / 2
    t = 0.04
    upper = h - 0.42
    parts: list[Solid] = []
    for x in (x0 + t, x0 + wide - t):
        parts += both(post(x, d / 2 - t, t, 0, h - 0.08, role="leg"), axis=2)
    for y in (0.22, upper):
        parts.append(box((x0, y, -d / 2), (x0 + wide, y + 0.12, d / 2), role="rail"))
        parts += _made_up(x0, x0 + wide, y + 0.1, d, 0.06)
    guard: list[Solid] = []
    heights = upper + 0.22, h - 0.08
    for x, end in ((x0 + 0.015, d / 2), (x0 + wide - 0.015, d / 2 * 0.55)):
        guard += [box((x - 0.015, y, -d / 2), (x + 0.015, y + 0.08, end)) for y in heights]
    z = d / 2 - 0.015
    for y in heights:
        guard += both(box((x0, y, z - 0.015), (x0 + wide, y + 0.08, z + 0.015)), axis=2)
    parts += of_role("guard", guard)
    if stairs:
        for i in range(4):
            z, y = d / 2 - (i + 1) * 0.36, upper * (i + 1) / 4.5
            parts.append(box((x0 + wide, 0, z), (w / 2, y, z + 0.36), role="stairs"))
            parts += front((x0 + wide, 0.02), (w / 2, y), z + 0.36, 1, 1, "drawer", style) if i == 0 else []
        return parts
    return parts + _ladder((w / 2 - 0.02, w / 2 + 0.02), (d * 0.2, d * 0.42), upper, h - 0.05)
