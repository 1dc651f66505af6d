"""What storage is put together from: carcasses on legs, shelves inside them, columns of doors, drawers and cells."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from echomodel.furniture.carpentry import Size, base, box, core
from echomodel.furniture.choices import Choices
from echomodel.furniture.fronts import front
from echomodel.furniture.solids import Solid
from echomodel.furniture.style import Style

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
    if kind == "trestle" or (kind == "hairpin" and foot < 0.08):
        kind = "straight"
    thick = float(np.clip(0.045 * style.bulk, 0.03, 0.07)) if foot > 0.08 else 0.05
    crown = style.family in ("classic", "rustic") and h > 0.4
    over = 0.015 + style.overhang * 0.4 if crown else 0.0
    body, lid = w / 2 - over, h - (t if over else 0.0)
    parts = base(style, 2 * body * 0.96, d * 0.9, foot, thick, kind) if foot > 0 else []
    recessed = style.fronts == "recessed"
    deep = 0.022 if not recessed else 0.02 + min(0.05, 0.1 * d)  # recessed fronts stand behind the boards
    z0, z1 = -d / 2, d / 2 - deep
    edge, r = d / 2 if recessed else z1, 0.003 * style.edge
    parts += [
        box((s * body - (t if s > 0 else 0), foot, z0), (s * body + (t if s < 0 else 0), lid, edge), "wood", r, "side")
        for s in (-1, 1)
    ]
    parts.append(box((-body, foot, z0), (body, foot + t, edge), "wood", r, "bottom"))
    parts.append(box((-body, lid - t, z0), (body, lid, edge), "wood", r, "top"))
    if back or solid:
        parts.append(box((-body + t / 2, foot, z0), (body - t / 2, lid, z0 + 0.012), "accent", 0.0, "back"))
    if solid:
        parts.append(core((-body, foot, z0), (body, lid, z1)))
    if over:
        parts.append(box((-w / 2, h - t, -d / 2), (w / 2, h, d / 2), "wood", 0.25 * t * style.corner, "top"))
    return parts, (-body + t * 0.6, foot + t * 0.6, body - t * 0.6, lid - t * 0.6, z1)


def depth_of(d: float, z: float) -> float:
    """Metres between the back of a carcass `d` deep and the plane z of its fronts."""
    return z + d / 2 - 0.015


def shelves(rect: tuple, d: float, z0: float, rows: int, columns: int, style: Style) -> list[Solid]:
    """Boards that divide an open case into rows and columns."""
    x0, y0, x1, y1, z1 = rect
    t = BOARD * (0.8 + 0.5 * style.bulk)
    parts: list[Solid] = [
        box((x0, y - t / 2, z0), (x1, y + t / 2, z1 - 0.01), role="shelf") for y in np.linspace(y0, y1, rows + 1)[1:-1]
    ]
    parts += [
        box((x - t / 2, y0, z0), (x + t / 2, y1, z1 - 0.01), role="side")
        for x in np.linspace(x0, x1, columns + 1)[1:-1]
    ]
    return parts


def foot_height(style: Style, h: float, most: float = 0.3) -> float:
    low = {"plinth": 0.05, "bun": 0.06}.get(style.legs, style.leg_height)
    return float(min(low, most * h))


def fronted(size: Size, style: Style, foot: float, rows: int, columns: int, kind: str) -> list[Solid]:
    parts, (x0, y0, x1, y1, z) = carcass(size, style, foot)
    return parts + front((x0, y0), (x1, y1), z, rows, columns, kind, style, depth_of(size[2], z))


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
