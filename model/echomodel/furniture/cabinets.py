"""Cabinets, dressers, sideboards and television stands: rows and columns of drawers, doors and cells."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from echomodel.furniture.carpentry import Size, both, box, core
from echomodel.furniture.fronts import BOARD, carcass, depth_of, foot_height, front, fronted, hutch, shelves
from echomodel.furniture.solids import Solid, rotation
from echomodel.furniture.style import Choices, Style

GABLED = 1.2  # metres: on what is lower people put things, for which its top is flat


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


def pattern(choices: Choices, count: int, odds: dict[str, float], symmetry: float) -> list[str]:
    """What fills each of `count` columns, the words of `odds`; the same from both sides with this probability."""
    kinds = choices.stream("pattern").choice(list(odds), size=count, p=list(odds.values()))
    alike = choices.chance("symmetry", symmetry)
    return [str(kinds[min(i, count - 1 - i) if alike else i]) for i in range(count)]


def columns(rect: tuple, d: float, kinds: list[str], style: Style, levels: Iterable[float], rows: int) -> list[Solid]:
    """Columns side by side in an open case `d` deep: with shelves at `levels`, of rows of drawers, or behind a door."""
    x0, y0, x1, y1, z = rect
    xs, t = np.linspace(x0, x1, len(kinds) + 1), BOARD
    parts: list[Solid] = []
    for i, kind in enumerate(kinds):
        low, high = (float(xs[i]), y0), (float(xs[i + 1]), y1)
        if i:
            parts.append(box((xs[i] - t / 2, y0, -d / 2), (xs[i] + t / 2, y1, z), role="side"))
        if kind == "open":
            parts += [box((low[0], y - t / 2, -d / 2), (high[0], y + t / 2, z), role="shelf") for y in levels]
            continue
        parts.append(core((*low, -d / 2), (*high, z)))
        parts += front(low, high, z, rows if kind == "drawer" else 1, 1, kind, style, depth_of(d, z))
    return parts


def mixed(size: Size, style: Style, choices: Choices, foot: float, column_width: float) -> list[Solid]:
    """Columns side by side, each doors, drawers or open cells; symmetrical more often than not."""
    parts, rect = carcass(size, style, foot, solid=False)
    x0, y0, x1, y1, _ = rect
    count = int(np.clip(round((x1 - x0) / column_width), 1, 6))
    door, drawer, free = [0.5, 0.3, 0.2] if style.fronts != "open" else [0.35, 0.25, 0.4]
    kinds = pattern(choices, count, {"door": door, "drawer": drawer, "open": free}, 0.7)
    cells, rows = (int(np.clip(round((y1 - y0) / each), 1, 8)) for each in (0.32, 0.22))
    return parts + columns(rect, size[2], kinds, style, np.linspace(y0, y1, cells + 1)[1:-1], rows)
