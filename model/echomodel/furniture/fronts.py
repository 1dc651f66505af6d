"""What storage is put together from: fronts that open, with drawers and handles, carcasses, shelves."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np

from echomodel.furniture.carpentry import Size, base, both, box, core, framed
from echomodel.furniture.solids import Joint, Solid, ball, rotation, tube, turned
from echomodel.furniture.style import Style

Point = tuple[float, float]
PANEL, SHEET = 0.018, 0.01  # metres: thickness of a front, and of the boards of a drawer
OPEN = math.radians(100)  # of a hinged door
PULL = 0.75  # share of its depth that a drawer comes out
ENOUGH, TALL = 0.12, 1.5  # metres of depth that a drawer needs; of height, from which on a door is a wardrobe's
# tufting up to which doors as tall as that are in frames, and from which on of boards; how far these stand out, metres
FRAMED, BOARDED, PROUD = 0.35, 0.5, {"": 0.0, "framed": 0.012, "boarded": 0.006}
GROOVE = 0.014  # metres between a frame and the panel in it, and of the panel's bevel
SHELVES, HANGING = 0.38, 1.35  # metres between shelves behind doors; doors from this height on hide a rail


def front(
    low: Point, high: Point, z: float, rows: int, columns: int, kind: str, style: Style, depth: float = 0.0,
    *, glazed: bool = False,
) -> list[Solid]:  # fmt: skip
    """Drawer fronts or doors that fill the rectangle `low` to `high` (x, y) on the plane z, gaps between, with handles.

    Arguments:
        kind: `drawer` or `door`; thickness and frames follow the style.
        depth: metres behind the plane that are free; drawers get boxes there, doors hide shelves or a rail.
        glazed: a pane in a frame instead of a panel.
    """
    parts: list[Solid] = []
    tall = kind == "door" and high[1] - low[1] > rows * TALL
    made_of = "framed" if style.fronts == "framed" or (tall and style.tufting < FRAMED) else ""
    made_of = "" if glazed else "boarded" if tall and style.tufting > BOARDED and not made_of else made_of
    face = PANEL + PROUD[made_of]
    xs = np.linspace(low[0], high[0], columns + 1).tolist()
    ys = np.linspace(low[1], high[1], rows + 1).tolist()
    for i in range(columns):
        for j in range(rows):
            x0, x1 = xs[i] + style.gap / 2, xs[i + 1] - style.gap / 2
            y0, y1 = ys[j] + style.gap / 2, ys[j + 1] - style.gap / 2
            left = i % 2 == 0 if columns > 1 else style.contrast < 0.7
            joint = Joint("drawer", "prismatic", (0.0, 0.0, 1.0), (0.0, 0.0, z), PULL * max(depth, ENOUGH))
            if kind == "door":  # about the front edge, so that it swings away from its neighbour
                place, axis = (x0 if left else x1, y0, z + face), (0.0, -1.0 if left else 1.0, 0.0)
                joint = Joint("door", "revolute", axis, place, OPEN)
            made: list[Solid] = [box((x0, y0, z - 0.004), (x1, y1, z + PANEL), "accent", 0.002 * style.edge, kind)]
            if glazed:
                b = min(0.045, 0.2 * (x1 - x0))
                one, other = (x0 + b / 2, y0 + b / 2, z + 0.006), (x1 - b / 2, y1 - b / 2, z + 0.01)
                made = [box(one, other, "glass", 0.0, kind)]
                made += framed((x0, y0, z), (x1, y1, z + PANEL), b, "accent", kind)
            elif made_of == "framed":
                wide, y = max(0.02, 0.15 * min(x1 - x0, y1 - y0)), y0 + 0.42 * (y1 - y0)
                for a, b in ((y0, y), (y, y1)) if tall else ((y0, y1),):
                    made += framed((x0, a, z + face - 0.016), (x1, b, z + face), wide, "accent", kind)
                    hole = (x1 - x0) / 2 - wide, (b - a) / 2 - wide
                    made += _panel((x0 + x1) / 2, (a + b) / 2, z + face - 0.002, *hole, kind)
            elif made_of == "boarded":
                edges = np.linspace(x0, x1, max(2, round((x1 - x0) / 0.11)) + 1).tolist()
                made += [box((a, y0, z), (b - 0.006, y1, z + face), "accent", 0.002, kind) for a, b in pairwise(edges)]
            made += _handle(x0, x1, y0, y1, z + PANEL, PROUD[made_of], kind, hinge_left=left, style=style)
            if kind == "drawer" and depth > ENOUGH:
                made += _drawer(x0, x1, y0, y1, z - depth, z)
            parts += [replace(part, joint=joint) for part in made]
    if kind == "door" and depth > ENOUGH:
        parts += _inside(low, high, z - depth, z - 0.02)
    return parts


def _panel(x: float, y: float, z: float, wide: float, high: float, kind: str) -> list[Solid]:
    """A panel in a frame's hole of these half sides, up to the plane z, its edges bevelled, which light tells apart."""
    low, form = (wide - GROOVE, high - GROOVE), {"power": np.inf, "turn": rotation(x=np.pi / 2), "material": "accent"}
    field = low[0] - GROOVE, low[1] - GROOVE
    return [turned((x, y, z - 0.016), low, 0.016, field, role=kind, **form)] if min(field) > GROOVE else []


def sliding(low: Point, high: Point, z: float, count: int, material: str) -> list[Solid]:
    """Doors that slide along x before one another."""
    xs = np.linspace(low[0], high[0], count + 1).tolist()
    wide = (high[0] - low[0]) / count
    parts: list[Solid] = []
    for i in range(count):
        near, axis = z + 0.026 * (i % 2), (1.0 if i == 0 else -1.0, 0.0, 0.0)
        joint = Joint("door", "prismatic", axis, (xs[i], low[1], near), wide - 0.04)
        corners = (xs[i] - 0.015, low[1], near - 0.003), (xs[i + 1] + 0.015, high[1], near + 0.019)
        panel: list[Solid] = [box(*corners, material, 0.0, "door")]
        for x in (xs[i] + 0.02, xs[i + 1] - 0.02):
            if i % 2 or material != "accent":
                corners = (x - 0.035, low[1], near + 0.012), (x + 0.015, high[1], near + 0.0235)
                panel.append(box(*corners, "metal", 0.0, "handle"))
        parts += [replace(part, joint=joint) for part in panel]
    return parts


def drawers(low: Point, high: Point, z: float, rows: int, columns: int, style: Style) -> list[Solid]:
    """Drawers in a case that fills a rectangle (x, y) from the plane -z to the plane z, open in front, with a core."""
    body = [core((*low, -z), (*high, z)), *boards((*low, -z), (*high, z), 0.016, 0.008)]
    return body + front(low, high, z, rows, columns, "drawer", style, 0.95 * 2 * z)


def boards(low: tuple, high: tuple, t: float, back: float) -> list[Solid]:
    """Four boards `t` thick about a case between two corners (3,), open in front, and its back."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    return [
        box((x0, y0, z0), (x0 + t, y1, z1), role="side"),
        box((x1 - t, y0, z0), (x1, y1, z1), role="side"),
        box((x0, y0, z0), (x1, y0 + t, z1), role="bottom"),
        box((x0, y1 - t, z0), (x1, y1, z1), role="top"),
        box((x0, y0, z0), (x1, y1, z0 + back), role="back"),
    ]


def _drawer(x0: float, x1: float, y0: float, y1: float, z0: float, z1: float) -> list[Solid]:
    """The box behind a drawer's front."""
    t, inset = SHEET, 0.012
    a, b, low, high = x0 + inset, x1 - inset, y0 + 0.014, y0 + max(0.05, 0.7 * (y1 - y0))
    return [
        box((a, low, z0), (b, low + t, z1), role="drawer"),
        box((a, low, z0), (a + t, high, z1), role="drawer"),
        box((b - t, low, z0), (b, high, z1), role="drawer"),
        box((a, low, z0), (b, high, z0 + t), role="drawer"),
    ]


def _inside(low: Point, high: Point, z0: float, z1: float) -> list[Solid]:
    """What stands behind doors: shelves, or a shelf above a rail for clothes."""
    (x0, y0), (x1, y1), tall = low, high, high[1] - low[1]
    if tall > HANGING:
        y, z = y1 - 0.3, (z0 + z1) / 2
        rail = tube([[x0, y - 0.07, z], [x1, y - 0.07, z]], 0.012, "metal", "rail")
        return [box((x0, y, z0), (x1, y + 0.018, z1), role="shelf"), rail]
    heights = np.linspace(y0, y1, int(np.clip(round(tall / SHELVES), 1, 6)) + 1)[1:-1]
    return [box((x0, y - 0.009, z0), (x1, y + 0.009, z1), role="shelf") for y in heights]


def _handle(
    x0: float, x1: float, y0: float, y1: float, z: float, proud: float, kind: str, *, hinge_left: bool, style: Style
) -> list[Solid]:
    w, h, door = x1 - x0, y1 - y0, kind == "door"
    if style.handles == "none" and h < TALL:  # the doors of a wardrobe have a grip along their edge
        return []
    x = (x1 - min(0.12 * w, 0.05) if hinge_left else x0 + min(0.12 * w, 0.05)) if door else (x0 + x1) / 2
    y = (y0 + y1) / 2 if h < TALL else y0 + min(1.0, 0.5 * h)
    z, deep = z + proud, 0.004 + proud  # a frame stands out, its panel does not; metres that a handle reaches in
    if style.handles == "knob":
        r = 0.016
        places = [-0.28 * w, 0.28 * w] if not door and w > 0.75 else [0.0]
        stem = np.array([[0, 0, -deep], [0, 0, r]])
        parts: list[Solid] = []
        for dx in places:
            parts.append(tube(np.array([x + dx, y, z]) + stem, 0.006, "metal", "handle"))
            parts.append(ball((x + dx, y, z + r + 0.004), (r, r, r * 0.8), "metal", "handle"))
        return parts
    if style.handles in ("edge", "none"):
        low, high = (x0 + 0.1 * w, y1 - 0.02), (x1 - 0.1 * w, y1 - 0.004)
        if door:
            low, high = (x - 0.008, y0 + 0.1 * h), (x + 0.008, y1 - 0.1 * h)
        return [box((*low, z - deep), (*high, z + 0.02), "metal", 0.003, "handle")]
    length = min(0.3, 0.45 * h) / 2 if door else min(0.25, 0.4 * w) / 2
    along = np.array([0.0, length, 0.0]) if door else np.array([length, 0.0, 0.0])
    grip, out = np.array([x, y, z]), np.array([0.0, 0.0, 0.026])
    bar, sunk = tube([grip + out - along, grip + out + along], 0.0055, "metal", "handle"), np.array([0, 0, deep])
    ends = grip - 0.85 * along, grip + 0.85 * along
    return [bar, *(tube([end - sunk, end + out], 0.005, "metal", "handle") for end in ends)]


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
    parts += both(box((body - t, foot, z0), (body, lid, edge), "wood", r, "side"))
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


def shelves(rect: tuple, d: float, rows: int, columns: int, style: Style) -> list[Solid]:
    """Boards that divide an open case, `d` deep, into rows and columns."""
    x0, y0, x1, y1, z1 = rect
    t, z0, z1 = BOARD * (0.8 + 0.5 * style.bulk), -d / 2, z1 - 0.01
    ys, xs = np.linspace(y0, y1, rows + 1)[1:-1], np.linspace(x0, x1, columns + 1)[1:-1]
    parts: list[Solid] = [box((x0, y - t / 2, z0), (x1, y + t / 2, z1), role="shelf") for y in ys]
    return parts + [box((x - t / 2, y0, z0), (x + t / 2, y1, z1), role="side") for x in xs]


def hutch(w: float, low: float, high: float, z0: float, z1: float, columns: int, rows: int) -> list[Solid]:
    """Open shelves on top of something, from the height `low` to `high`, with a back."""
    xs, ys = np.linspace(BOARD - w / 2, w / 2 - BOARD, columns + 1), np.linspace(low, high - BOARD, rows + 1)
    parts: list[Solid] = [box((x - BOARD / 2, low, z0), (x + BOARD / 2, high, z1), role="side") for x in xs]
    parts += [box((-w / 2, y, z0), (w / 2, y + BOARD, z1), role="shelf") for y in ys[1:]]
    return [*parts, box((BOARD - w / 2, low, z0), (w / 2 - BOARD, high, z0 + 0.012), "accent", 0.0, "back")]


def foot_height(style: Style, h: float, most: float = 0.3) -> float:
    return float(min({"plinth": 0.05, "bun": 0.06}.get(style.legs, style.leg_height), most * h))


def fronted(size: Size, style: Style, foot: float, rows: int, columns: int, kind: str) -> list[Solid]:
    parts, (x0, y0, x1, y1, z) = carcass(size, style, foot)
    return parts + front((x0, y0), (x1, y1), z, rows, columns, kind, style, depth_of(size[2], z))
