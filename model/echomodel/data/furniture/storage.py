"""Storage: nightstands, dressers, sideboards, cabinets, wardrobes, bookshelves, tv and wine cabinets."""

from __future__ import annotations

import numpy as np

from echomodel.data.furniture.carpentry import Size, base, box, front
from echomodel.data.furniture.solids import Solid, Turned, rotation
from echomodel.data.furniture.style import Style

BOARD = 0.02


def carcass(
    size: Size, style: Style, foot: float, *, kind: str | None = None, solid: bool = True, back: bool = True
) -> tuple[list[Solid], tuple[float, float, float, float, float]]:
    """A case on legs or a plinth.

    Arguments:
        foot: height of the legs, metres.
        kind: legs instead of the style's own.
        solid: one closed body (for doors and drawers); otherwise an open box of boards.
        back: an open box gets a back panel.

    Returns the parts and the inner rectangle (x0, y0, x1, y1) with the plane z of its fronts.
    """
    w, h, d = size
    t = BOARD * (0.8 + 0.6 * style.bulk)
    kind = kind or style.legs
    if kind in ("trestle", "hairpin") and foot < 0.08:
        kind = "straight"
    thick = float(np.clip(0.045 * style.bulk, 0.03, 0.07)) if foot > 0.08 else 0.05
    parts = base(style, w * 0.96, d * 0.9, foot, thick, kind) if foot > 0 else []
    crown = style.family in ("classic", "rustic") and h > 0.4
    over = 0.015 + style.overhang * 0.4 if crown else 0.0
    body = w / 2 - over
    z0, z1 = -d / 2, d / 2 - (0.02 if style.fronts != "recessed" else 0.0)
    if solid:
        parts.append(box((-body, foot, z0), (body, h - (t if over else 0), z1)))
    else:
        parts += [box((s * body - (t if s > 0 else 0), foot, z0), (s * body + (t if s < 0 else 0), h, z1)) for s in (-1, 1)]
        parts += [box((-body, foot, z0), (body, foot + t, z1)), box((-body, h - t, z0), (body, h, z1))]
        if back:
            parts.append(box((-body, foot, z0), (body, h, z0 + 0.012), "accent"))
    if over:
        parts.append(box((-w / 2, h - t, -d / 2), (w / 2, h, d / 2)))
    return parts, (-body + t * 0.6, foot + t * 0.6, body - t * 0.6, h - t * 1.1, z1)


def shelves(rect: tuple, d: float, z0: float, rows: int, columns: int, style: Style) -> list[Solid]:
    """Boards that divide an open case into rows and columns."""
    x0, y0, x1, y1, z1 = rect
    t = BOARD * (0.8 + 0.5 * style.bulk)
    parts: list[Solid] = [box((x0, y - t / 2, z0), (x1, y + t / 2, z1 - 0.01)) for y in np.linspace(y0, y1, rows + 1)[1:-1]]
    parts += [box((x - t / 2, y0, z0), (x + t / 2, y1, z1 - 0.01)) for x in np.linspace(x0, x1, columns + 1)[1:-1]]
    return parts


def _foot(style: Style, h: float, most: float = 0.3) -> float:
    low = {"plinth": 0.05, "bun": 0.06}.get(style.legs, style.leg_height)
    return float(min(low, most * h))


def _fronted(size: Size, style: Style, foot: float, rows: int, columns: int, kind: str) -> list[Solid]:
    parts, (x0, y0, x1, y1, z) = carcass(size, style, foot)
    return parts + front((x0, y0), (x1, y1), z, rows, columns, kind, style)


def nightstand(size: Size, style: Style, rng: np.random.Generator) -> list[Solid]:
    """One to three drawers, or a drawer over an open cell, on legs or a plinth; rarely a drum."""
    w, h, d = size
    foot = _foot(style, h, 0.4)
    kind = rng.choice(["drawers", "niche", "table", "drum"], p=[0.55, 0.27, 0.13, 0.05])
    if kind == "drum" and style.profile == "round":
        body = Turned(centre=np.array([0, foot, 0]), low=(w / 2, d / 2), high=(w / 2, d / 2), height=h - foot)
        lip = Turned(centre=np.array([0, foot + (h - foot) * 0.55, 0]), low=(w * 0.515, d * 0.515),
                     high=(w * 0.515, d * 0.515), height=0.02, material="accent")  # fmt: skip
        return [body, lip, *base(style, w * 0.7, d * 0.7, foot, 0.04)]
    if kind == "niche":
        parts, rect = carcass(size, style, foot, solid=False)
        x0, y0, x1, y1, z = rect
        mid = y0 + (y1 - y0) * rng.uniform(0.4, 0.6)
        low, high = ((x0, mid), (x1, y1)) if rng.random() < 0.7 else ((x0, y0), (x1, mid))
        drawer = box((*low, -d / 2), (*high, z))
        return [*parts, drawer, *front(low, high, z, 1, 1, "drawer", style)]
    if kind == "table":
        t = style.top
        low = h - max(0.12, h * 0.25)
        legs = "straight" if style.legs in ("plinth", "bun", "trestle") else style.legs
        parts = [box((-w / 2, h - t, -d / 2), (w / 2, h, d / 2)), box((-w * 0.46, low, -d * 0.44), (w * 0.46, h - t, d * 0.44))]
        parts += front((-w * 0.46, low), (w * 0.46, h - t), d * 0.44, 1, 1, "drawer", style)
        return parts + base(style, w * 0.95, d * 0.92, low, 0.035 * style.bulk, legs)
    return _fronted(size, style, foot, int(rng.choice([1, 2, 2, 3])), 1, "drawer")


def dresser(size: Size, style: Style, rng: np.random.Generator) -> list[Solid]:
    """Rows of drawers, one to three columns; the top row sometimes split."""
    w, h, d = size
    foot = _foot(style, h, 0.2)
    rows = int(np.clip(round((h - foot) / rng.uniform(0.18, 0.26)), 2, 7))
    columns = 1 if w < 0.75 else int(rng.integers(1, 3)) if w < 1.3 else int(rng.integers(2, 4))
    parts, (x0, y0, x1, y1, z) = carcass(size, style, foot)
    if columns == 1 and w > 0.6 and rng.random() < 0.5:
        mid = y1 - (y1 - y0) / rows
        upper = front((x0, mid), (x1, y1), z, 1, 2, "drawer", style)
        return parts + upper + front((x0, y0), (x1, mid), z, rows - 1, 1, "drawer", style)
    return parts + front((x0, y0), (x1, y1), z, rows, columns, "drawer", style)


def _mixed(size: Size, style: Style, rng: np.random.Generator, foot: float, column_width: float) -> list[Solid]:
    """Columns side by side, each doors, drawers or open cells; symmetrical more often than not."""
    w, h, d = size
    parts, (x0, y0, x1, y1, z) = carcass(size, style, foot, solid=False)
    count = int(np.clip(round((x1 - x0) / column_width), 1, 6))
    odds = [0.5, 0.3, 0.2] if style.fronts != "open" else [0.35, 0.25, 0.4]
    kinds = [str(k) for k in rng.choice(["door", "drawer", "open"], size=count, p=odds)]
    if rng.random() < 0.7:
        kinds = [kinds[min(i, count - 1 - i)] for i in range(count)]
    xs = np.linspace(x0, x1, count + 1)
    t = BOARD
    for i, kind in enumerate(kinds):
        low, high = (float(xs[i]), y0), (float(xs[i + 1]), y1)
        if i:
            parts.append(box((xs[i] - t / 2, y0, -d / 2), (xs[i] + t / 2, y1, z)))
        if kind == "open":
            cells = max(1, round((y1 - y0) / 0.32))
            parts += [box((low[0], y - t / 2, -d / 2), (high[0], y + t / 2, z)) for y in np.linspace(y0, y1, cells + 1)[1:-1]]
            continue
        rows = 1 if kind == "door" else max(1, round((y1 - y0) / 0.22))
        parts.append(box((low[0], low[1], -d / 2), (high[0], high[1], z)))
        parts += front(low, high, z, rows, 1, kind, style)
    return parts


def sideboard(size: Size, style: Style, rng: np.random.Generator) -> list[Solid]:
    """A low row of doors, drawers and cells; tall ones carry a shelf or a glazed upper part."""
    w, h, d = size
    if h > 1.3:
        lower = 0.85
        t = BOARD
        parts = _mixed(np.array([w, lower, d]), style, rng, _foot(style, lower, 0.25), 0.5)
        inner = w * 0.92
        z1 = -d / 2 + d * 0.7
        parts += [box((s * inner / 2 - t, lower, -d / 2), (s * inner / 2 + t, h, z1)) for s in (-1, 1)]
        parts += [box((-inner / 2, y, -d / 2), (inner / 2, y + t, z1)) for y in (lower + (h - lower) * 0.5, h - t)]
        parts.append(box((-inner / 2, lower, -d / 2), (inner / 2, h, -d / 2 + 0.012), "accent"))
        return parts
    return _mixed(size, style, rng, _foot(style, h, 0.3), float(rng.uniform(0.38, 0.55)))


def cabinet(size: Size, style: Style, rng: np.random.Generator) -> list[Solid]:
    """Doors above drawers, doors only, or mixed columns; tall ones may have open shelves on top."""
    w, h, d = size
    foot = _foot(style, h, 0.22)
    if h > 1.5:
        parts, (x0, y0, x1, y1, z) = carcass(size, style, foot, solid=False)
        columns = max(1, round((x1 - x0) / 0.48))
        split = y0 + (y1 - y0) * rng.uniform(0.33, 0.5)
        low_kind, rows = ("door", 1) if rng.random() < 0.6 else ("drawer", int(rng.integers(2, 4)))
        parts.append(box((x0, y0, -d / 2), (x1, split, z)))
        parts += front((x0, y0), (x1, split), z, rows, columns, low_kind, style)
        if style.fronts == "open" or rng.random() < 0.4:
            parts += shelves((x0, split, x1, y1, z), d, -d / 2, int(rng.integers(2, 5)), columns, style)
            return parts
        parts.append(box((x0, split, -d / 2), (x1, y1, z)))
        return parts + front((x0, split), (x1, y1), z, 1, columns, "door", style)
    if rng.random() < 0.4:
        return _fronted(size, style, foot, 1, max(2, round(w / 0.45)), "door")
    return _mixed(size, style, rng, foot, float(rng.uniform(0.4, 0.6)))


def children_cabinet(size: Size, style: Style, rng: np.random.Generator) -> list[Solid]:
    """A grid of cells, some with bins or drawers, sometimes with a gabled top."""
    w, h, d = size
    gable = rng.random() < 0.3
    body = h * 0.8 if gable else h
    parts, (x0, y0, x1, y1, z) = carcass(np.array([w, body, d]), style, min(0.06, style.leg_height), kind="plinth",
                                         solid=False)  # fmt: skip
    columns, rows = max(1, round((x1 - x0) / 0.36)), max(2, round((y1 - y0) / 0.34))
    parts += shelves((x0, y0, x1, y1, z), d, -d / 2, rows, columns, style)
    xs, ys = np.linspace(x0, x1, columns + 1), np.linspace(y0, y1, rows + 1)
    for i in range(columns):
        for j in range(rows):
            if rng.random() < 0.42:
                low, high = (float(xs[i]) + 0.01, float(ys[j])), (float(xs[i + 1]) - 0.01, float(ys[j + 1]))
                parts.append(box((*low, -d / 2 + 0.03), (*high, z - 0.01)))
                parts += front(low, high, z - 0.01, 1, 1, "drawer", style)
    if gable:
        slope = np.arctan2(h - body, w / 2)
        length = np.hypot(h - body, w / 2)
        for s in (-1, 1):
            panel = box((-length / 2, -0.015, -d / 2), (length / 2, 0.015, d / 2 - 0.02))
            parts.append(_moved(panel, np.array([s * w / 4, (body + h) / 2 - 0.015, -0.01]), rotation(z=-s * slope)))
    return parts


def _moved(block, centre: np.ndarray, turn: np.ndarray):
    from dataclasses import replace

    return replace(block, centre=centre, turn=turn)


def wardrobe(size: Size, style: Style, rng: np.random.Generator) -> list[Solid]:
    """Full-height doors, one to five, hinged or sliding; drawers below or an open column in some."""
    w, h, d = size
    foot = 0.05 if style.family in ("modern", "scandinavian", "industrial") else 0.09
    kind = "plinth" if style.legs not in ("bun", "turned") else "bun"
    parts, (x0, y0, x1, y1, z) = carcass(size, style, foot, kind=kind)
    doors = int(np.clip(round((x1 - x0) / rng.uniform(0.42, 0.58)), 1, 6))
    choice = rng.choice(["doors", "drawers", "sliding", "open"], p=[0.45, 0.25, 0.15, 0.15])
    if choice == "sliding" and w > 1.2:
        count = 2 if w < 2.0 else 3
        xs = np.linspace(x0, x1, count + 1)
        for i in range(count):
            step = 0.025 * (i % 2)
            panel = (xs[i] - 0.015, y0, z - 0.005 + step), (xs[i + 1] + 0.015, y1, z + 0.02 + step)
            parts.append(box(*panel, "glass" if rng.random() < 0.3 else "accent"))
        return parts
    if choice == "drawers":
        split = y0 + (y1 - y0) * rng.uniform(0.2, 0.32)
        rows = int(rng.integers(1, 3))
        parts += front((x0, y0), (x1, split), z, rows, max(1, doors // 2), "drawer", style)
        return parts + front((x0, split), (x1, y1), z, 1, doors, "door", style)
    if choice == "open" and doors >= 3:
        edge = x1 - (x1 - x0) / doors
        case, (_, cy0, _, cy1, cz) = carcass(size, style, foot, kind=kind, solid=False)
        case.append(box((x0, cy0, -d / 2), (edge, cy1, z)))
        case += shelves((edge, cy0, x1, cy1, cz), d, -d / 2, int(rng.integers(4, 7)), 1, style)
        return case + front((x0, y0), (edge, y1), z, 1, doors - 1, "door", style)
    return parts + front((x0, y0), (x1, y1), z, 1, doors, "door", style)


def bookshelf(size: Size, style: Style, rng: np.random.Generator) -> list[Solid]:
    """Open rows and columns with a back or without, some cells closed, some books; or a ladder of boards."""
    w, h, d = size
    rows, columns = max(1, round(h / rng.uniform(0.3, 0.42))), max(1, round(w / rng.uniform(0.4, 0.8)))
    if style.family == "industrial" and rng.random() < 0.6:
        return _rack(size, rows, columns)
    foot = min(0.08, style.leg_height) if rng.random() < 0.5 else 0.02
    parts, rect = carcass(size, style, foot, kind="plinth" if foot < 0.04 else None, solid=False, back=rng.random() < 0.8)
    parts += shelves(rect, d, -d / 2, rows, columns, style)
    x0, y0, x1, y1, z = rect
    xs, ys = np.linspace(x0, x1, columns + 1), np.linspace(y0, y1, rows + 1)
    if rows > 2 and rng.random() < 0.4:
        parts.append(box((x0, y0, -d / 2), (x1, float(ys[1]), z)))
        parts += front((x0, y0), (x1, float(ys[1])), z, 1, max(1, columns), "door", style)
    for i in range(columns):
        for j in range(1, rows):
            if rng.random() < 0.4:
                parts += _books(float(xs[i]) + 0.02, float(xs[i + 1]) - 0.02, float(ys[j]) + 0.01, float(ys[j + 1]), d, rng)
    return parts


def _books(x0: float, x1: float, y0: float, y1: float, d: float, rng: np.random.Generator) -> list[Solid]:
    room = x1 - x0
    count = int(np.clip(room / 0.12, 1, 4))
    x, parts = x0, []
    for _ in range(count):
        wide = room / count * rng.uniform(0.55, 0.95)
        tall = (y1 - y0) * rng.uniform(0.55, 0.85)
        parts.append(box((x, y0, -d / 2 + 0.02), (x + wide, y0 + tall, d / 2 * rng.uniform(0.2, 0.7)), "fabric"))
        x += wide
        if rng.random() < 0.3:
            break
    return parts


def _rack(size: Size, rows: int, columns: int) -> list[Solid]:
    """Metal uprights and wooden boards without a back."""
    w, h, d = size
    t = 0.014
    xs = np.linspace(-w / 2 + t, w / 2 - t, min(columns, 3) + 1)
    parts: list[Solid] = [box((x - t, 0, s * (d / 2 - t) - t), (x + t, h, s * (d / 2 - t) + t), "metal") for x in xs for s in (-1, 1)]
    ys = np.linspace(0.12, h - 0.02, rows + 1)
    return parts + [box((-w / 2, y - 0.018, -d / 2), (w / 2, y + 0.018, d / 2)) for y in ys]


def shelf(size: Size, style: Style, rng: np.random.Generator) -> list[Solid]:
    """Lighter than a bookshelf: boards on uprights, a ladder, or boards round one post."""
    w, h, d = size
    rows = max(1, round(h / rng.uniform(0.3, 0.45)))
    kind = rng.choice(["rack", "boards", "ladder", "steps"])
    if kind == "rack" or style.family == "industrial":
        return _rack(size, rows, max(1, round(w / 0.9)))
    t = BOARD * (0.8 + 0.5 * style.bulk)
    ys = np.linspace(0.08 * min(1, h), h - t, rows + 1)
    if kind == "boards":
        parts: list[Solid] = [box((s * w / 2 - (t if s > 0 else 0), 0, -d / 2), (s * w / 2 + (t if s < 0 else 0), h, d / 2))
                              for s in (-1, 1)]  # fmt: skip
        return parts + [box((-w / 2, y, -d / 2), (w / 2, y + t, d / 2)) for y in ys]
    if kind == "ladder":
        lean = np.arctan2(d * 0.6, h)
        rails = [_moved(box((-t, -h / 2 / np.cos(lean), -t), (t, h / 2 / np.cos(lean), t)),
                        np.array([s * (w / 2 - t), h / 2, -d * 0.2 + d * 0.1]), rotation(x=-lean)) for s in (-1, 1)]  # fmt: skip
        boards = []
        for y in ys:
            z1 = d / 2 - (d * 0.6) * y / h
            boards.append(box((-w / 2, y, -d / 2), (w / 2, y + t, max(z1, -d / 2 + 0.12))))
        return rails + boards
    xs = np.linspace(-w / 2, w / 2, rows + 2)
    parts = [box((-w / 2, y, -d / 2), (w / 2, y + t, d / 2)) for y in ys]
    for i in range(rows):
        x = float(xs[1 + (i * 2) % rows]) if rows > 1 else 0.0
        parts.append(box((x - t / 2, ys[i], -d / 2), (x + t / 2, ys[i + 1], d / 2)))
        parts += [box((s * (w / 2 - t) - t / 2, ys[i], -d / 2), (s * (w / 2 - t) + t / 2, ys[i + 1], d / 2)) for s in (-1, 1) if (i + (s > 0)) % 2]
    return [*parts, *base(style, w * 0.9, d * 0.9, float(ys[0]), 0.035, "straight")]


def tv_stand(size: Size, style: Style, rng: np.random.Generator) -> list[Solid]:
    """Long and low: drawers, flaps and open cells in a row, on legs, a plinth or floating low."""
    w, h, d = size
    if h > 0.8 and rng.random() < 0.5:
        low = np.array([w, 0.45, d])
        parts = _mixed(low, style, rng, _foot(style, 0.45, 0.3), 0.5)
        panel = box((-w / 2, 0.45, -d / 2), (w / 2, h, -d / 2 + 0.03), "accent")
        return [*parts, panel, box((-w * 0.4, h * 0.82, -d / 2), (w * 0.4, h * 0.82 + 0.025, 0))]
    foot = _foot(style, h, 0.45)
    parts, (x0, y0, x1, y1, z) = carcass(size, style, foot, solid=False)
    count = max(2, round(w / rng.uniform(0.42, 0.62)))
    kinds = [str(k) for k in rng.choice(["drawer", "open", "door"], size=count, p=[0.45, 0.35, 0.2])]
    if rng.random() < 0.75:
        kinds = [kinds[min(i, count - 1 - i)] for i in range(count)]
    xs = np.linspace(x0, x1, count + 1)
    for i, kind in enumerate(kinds):
        low_corner, high_corner = (float(xs[i]), y0), (float(xs[i + 1]), y1)
        if i:
            parts.append(box((xs[i] - 0.01, y0, -d / 2), (xs[i] + 0.01, y1, z)))
        if kind == "open":
            if y1 - y0 > 0.25:
                middle = (y0 + y1) / 2
                parts.append(box((xs[i], middle - 0.01, -d / 2), (xs[i + 1], middle + 0.01, z)))
            continue
        rows = 2 if kind == "drawer" and y1 - y0 > 0.28 else 1
        parts.append(box((*low_corner, -d / 2), (*high_corner, z)))
        parts += front(low_corner, high_corner, z, rows, 1, kind, style)
    return parts


def wine_cabinet(size: Size, style: Style, rng: np.random.Generator) -> list[Solid]:
    """Closed below; above a lattice for bottles, glass doors or shelves."""
    w, h, d = size
    parts, (x0, y0, x1, y1, z) = carcass(size, style, _foot(style, h, 0.12), solid=False)
    split = y0 + (y1 - y0) * rng.uniform(0.3, 0.45)
    columns = max(1, round((x1 - x0) / 0.45))
    parts.append(box((x0, y0, -d / 2), (x1, split, z)))
    parts += front((x0, y0), (x1, split), z, 1, columns, "door", style)
    bays = np.linspace(x0, x1, columns + 1)
    lattice = int(rng.integers(0, columns))
    for i in range(columns):
        a, b = float(bays[i]), float(bays[i + 1])
        if i:
            parts.append(box((a - 0.01, split, -d / 2), (a + 0.01, y1, z)))
        if i == lattice or rng.random() < 0.3:
            top_y = min(y1, split + 1.2 * (b - a))
            cx, cy = (a + b) / 2, (split + top_y) / 2
            reach = np.hypot(b - a, top_y - split) / 2
            tilt = np.arctan2(top_y - split, b - a)
            bar = box((-reach, -0.012, -d / 2), (reach, 0.012, d / 2 - 0.03))
            parts += [_moved(bar, np.array([cx, cy, -0.015]), rotation(z=s * tilt)) for s in (-1, 1)]
            parts.append(box((a, top_y - 0.01, -d / 2), (b, top_y + 0.01, z - 0.01)))
            rest = top_y
        else:
            rest = split
        cells = max(1, round((y1 - rest) / 0.34))
        parts += [box((a, y - 0.01, -d / 2), (b, y + 0.01, z - 0.01)) for y in np.linspace(rest, y1, cells + 1)[1:-1]]
    return parts
