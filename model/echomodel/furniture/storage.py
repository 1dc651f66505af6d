"""Closed storage of bedrooms: nightstands and wardrobes."""

import numpy as np

from echomodel.furniture.carpentry import Size, base, box, core
from echomodel.furniture.fronts import BOARD, carcass, depth_of, drawers, foot_height, front, fronted, shelves, sliding
from echomodel.furniture.solids import Solid, turned
from echomodel.furniture.style import Choices, Style


def nightstand(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """One to three drawers, or a drawer over an open cell, on legs or a plinth; rarely a drum."""
    w, h, d = size
    foot = foot_height(style, h, 0.4)
    kind = choices.pick("kind", ["drawers", "niche", "table", "drum"], [0.55, 0.27, 0.13, 0.05])
    if kind == "drum" and style.profile == "round":
        body = turned((0, foot, 0), (w / 2, d / 2), h - foot, role="side")
        lip = turned((0, foot + (h - foot) * 0.55, 0), (w * 0.515, d * 0.515), 0.02, material="accent", role="side")
        return [body, lip, *base(style, w * 0.7, d * 0.7, foot, 0.04)]
    if kind == "niche":
        parts, rect = carcass(size, style, foot, solid=False)
        x0, y0, x1, y1, z = rect
        mid = y0 + (y1 - y0) * choices.between("split", 0.4, 0.6)
        low, high = ((x0, mid), (x1, y1)) if choices.chance("side", 0.7) else ((x0, y0), (x1, mid))
        shelf = box((x0, mid - BOARD / 2, -d / 2), (x1, mid + BOARD / 2, z), role="shelf")
        drawer = core((*low, -d / 2), (*high, z))
        return [*parts, drawer, shelf, *front(low, high, z, 1, 1, "drawer", style, depth_of(d, z))]
    if kind == "table":
        t = style.top
        low = h - max(0.12, h * 0.25)
        legs = "straight" if style.legs in ("plinth", "bun", "trestle") else style.legs
        parts = [box((-w / 2, h - t, -d / 2), (w / 2, h, d / 2), role="top")]
        parts += drawers((-w * 0.46, low), (w * 0.46, h - t), d * 0.44, 1, 1, style)
        return parts + base(style, w * 0.95, d * 0.92, low, 0.035 * style.bulk, legs)
    return fronted(size, style, foot, choices.pick("rows", [1, 2, 2, 3]), 1, "drawer")


def wardrobe(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Full-height doors, one to five, hinged or sliding; drawers below or an open column in some."""
    w, _h, d = size
    foot = 0.05 if style.family in ("modern", "scandinavian", "industrial") else 0.09
    kind = "plinth" if style.legs not in ("bun", "turned") else "bun"
    parts, (x0, y0, x1, y1, z) = carcass(size, style, foot, kind=kind)
    doors = int(np.clip(round((x1 - x0) / choices.between("columns", 0.42, 0.58)), 1, 6))
    choice = choices.pick("kind", ["doors", "drawers", "sliding", "open"], [0.45, 0.25, 0.15, 0.15])
    if choice == "sliding" and w > 1.2:
        count = 2 if w < 2.0 else 3
        return parts + sliding((x0, y0), (x1, y1), z, count, "mirror" if choices.chance("second", 0.3) else "accent")
    if choice == "drawers":
        split = y0 + (y1 - y0) * choices.between("split", 0.2, 0.32)
        rows = choices.whole("rows", 1, 3)
        parts += front((x0, y0), (x1, split), z, rows, max(1, doors // 2), "drawer", style, depth_of(d, z))
        parts.append(box((x0, split - BOARD / 2, -d / 2), (x1, split + BOARD / 2, z), role="shelf"))
        return parts + front((x0, split), (x1, y1), z, 1, doors, "door", style, depth_of(d, z))
    if choice == "open" and doors >= 3:
        edge = x1 - (x1 - x0) / doors
        cabin, (_, cy0, _, cy1, cz) = carcass(size, style, foot, kind=kind, solid=False)
        cabin.append(core((x0, cy0, -d / 2), (edge, cy1, z)))
        cabin.append(box((edge - BOARD / 2, cy0, -d / 2), (edge + BOARD / 2, cy1, z), role="side"))
        cabin += shelves((edge, cy0, x1, cy1, cz), d, choices.whole("rows", 4, 7), 1, style)
        return cabin + front((x0, y0), (edge, y1), z, 1, doors - 1, "door", style, depth_of(d, z))
    return parts + front((x0, y0), (x1, y1), z, 1, doors, "door", style, depth_of(d, z))
