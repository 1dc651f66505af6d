"""Closed storage: nightstands, dressers, sideboards, cabinets, wardrobes and television stands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from echomodel.furniture.carpentry import Size, base, both, box, core
from echomodel.furniture.fronts import (
    BOARD,
    carcass,
    columns,
    depth_of,
    drawers,
    foot_height,
    front,
    fronted,
    hutch,
    mixed,
    pattern,
    shelves,
    sliding,
)
from echomodel.furniture.solids import Solid, rotation, turned
from echomodel.furniture.style import Choices, Style

GABLED = 1.2  # metres: on what is lower people put things, for which its top is flat


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


def dresser(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Rows of drawers, one to three columns; the top row sometimes split."""
    w, h, d = size
    foot = foot_height(style, h, 0.2)
    rows = int(np.clip(round((h - foot) / choices.between("rows", 0.18, 0.26)), 2, 7))
    columns = 1 if w < 0.75 else choices.whole("columns", 1, 3) if w < 1.3 else choices.whole("columns", 2, 4)
    parts, (x0, y0, x1, y1, z) = carcass(size, style, foot)
    if columns == 1 and w > 0.6 and choices.chance("form", 0.5):
        mid = y1 - (y1 - y0) / rows
        upper = front((x0, mid), (x1, y1), z, 1, 2, "drawer", style, depth_of(d, z))
        return parts + upper + front((x0, y0), (x1, mid), z, rows - 1, 1, "drawer", style, depth_of(d, z))
    return parts + front((x0, y0), (x1, y1), z, rows, columns, "drawer", style, depth_of(d, z))


def sideboard(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A low row of doors, drawers and cells; tall ones carry a shelf or a glazed upper part."""
    w, h, d = size
    if h > 1.3:
        parts = mixed(np.array([w, 0.85, d]), style, choices, foot_height(style, 0.85, 0.25), 0.5)
        return parts + hutch(w * 0.92, 0.85, h, -d / 2, 0.2 * d, 1, 2)
    return mixed(size, style, choices, foot_height(style, h, 0.3), choices.between("columns", 0.38, 0.55))


def cabinet(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Doors above drawers, doors only, or mixed columns; tall ones may have open shelves on top."""
    w, h, d = size
    foot = foot_height(style, h, 0.22)
    if h > 1.5:
        parts, (x0, y0, x1, y1, z) = carcass(size, style, foot, solid=False)
        columns = int(np.clip(round((x1 - x0) / 0.48), 1, 8))
        split = y0 + (y1 - y0) * choices.between("split", 0.33, 0.5)
        low_kind, rows = ("door", 1) if choices.chance("front", 0.6) else ("drawer", choices.whole("rows", 2, 4))
        parts.append(core((x0, y0, -d / 2), (x1, split, z)))
        parts.append(box((x0, split - BOARD / 2, -d / 2), (x1, split + BOARD / 2, z), role="shelf"))
        parts += front((x0, y0), (x1, split), z, rows, columns, low_kind, style, depth_of(d, z))
        if style.fronts == "open" or choices.chance("extra", 0.4):
            parts += shelves((x0, split, x1, y1, z), d, choices.whole("count", 2, 5), columns, style)
            return parts
        parts.append(core((x0, split, -d / 2), (x1, y1, z)))
        return parts + front((x0, split), (x1, y1), z, 1, columns, "door", style, depth_of(d, z))
    if choices.chance("kind", 0.4):
        return fronted(size, style, foot, 1, int(np.clip(round(w / 0.45), 2, 8)), "door")
    return mixed(size, style, choices, foot, choices.between("columns", 0.4, 0.6))


def children_cabinet(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """A grid of cells, some with bins or drawers, a high one sometimes with a gabled top."""
    w, h, d = size
    gable = h > GABLED and choices.chance("form", 0.3)
    body = h * 0.8 if gable else h
    foot = min(0.06, style.leg_height)
    parts, (x0, y0, x1, y1, z) = carcass(np.array([w, body, d]), style, foot, kind="plinth", solid=False)
    columns, rows = int(np.clip(round((x1 - x0) / 0.36), 1, 8)), int(np.clip(round((y1 - y0) / 0.34), 2, 7))
    parts += shelves((x0, y0, x1, y1, z), d, rows, columns, style)
    xs, ys = np.linspace(x0, x1, columns + 1), np.linspace(y0, y1, rows + 1)
    rng = choices.stream("pattern")
    for i in range(columns):
        for j in range(rows):
            if rng.random() < 0.42:
                low, high = (float(xs[i]) + 0.01, float(ys[j])), (float(xs[i + 1]) - 0.01, float(ys[j + 1]))
                parts.append(core((*low, -d / 2 + 0.03), (*high, z - 0.01)))
                parts += front(low, high, z - 0.01, 1, 1, "drawer", style, depth_of(d, z) - 0.01)
    if gable:
        slope = np.arctan2(h - body, w / 2)
        length = np.hypot(h - body, w / 2)
        panel = box((-length / 2, -0.015, -d / 2), (length / 2, 0.015, d / 2 - 0.02), role="roof")
        middle = np.array([w / 4, (body + h) / 2 - 0.015, -0.01])
        parts += both(replace(panel, centre=middle, turn=rotation(z=-slope)))
    return parts


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
        material = "mirror" if choices.chance("second", 0.3) else "accent"
        return parts + sliding((x0, y0), (x1, y1), z, count, material)
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


def tv_stand(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Long and low: drawers, flaps and open cells in a row, on legs, a plinth or floating low."""
    w, h, d = size
    if h > 0.8 and choices.chance("form", 0.5):
        low = np.array([w, 0.45, d])
        parts = mixed(low, style, choices, foot_height(style, 0.45, 0.3), 0.5)
        panel = box((-w / 2, 0.45, -d / 2), (w / 2, h, -d / 2 + 0.03), "accent", 0.0, "back")
        return [*parts, panel, box((-w * 0.4, h * 0.82, -d / 2), (w * 0.4, h * 0.82 + 0.025, 0), role="shelf")]
    parts, rect = carcass(size, style, foot_height(style, h, 0.45), solid=False)
    count = int(np.clip(round(w / choices.between("columns", 0.42, 0.62)), 2, 6))
    kinds, (_, y0, _, y1, _) = pattern(choices, count, {"drawer": 0.45, "open": 0.35, "door": 0.2}, 0.75), rect
    middle = [(y0 + y1) / 2] if y1 - y0 > 0.25 else []
    return parts + columns(rect, d, kinds, style, middle, 1 + (y1 - y0 > 0.28))
