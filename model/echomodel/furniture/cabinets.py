"""Cabinets, dressers, sideboards and television stands, bookshelves and shelves: rows and columns of drawers, doors and
cells, closed or open.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from echomodel.furniture.carpentry import Size, base, both, box, core, of_role, post
from echomodel.furniture.fronts import BOARD, carcass, depth_of, foot_height, front, fronted, hutch, shelves
from echomodel.furniture.solids import Lathe, Solid, rotation
from echomodel.furniture.style import Choices, Style

GABLED = 1.2  # metres: on what is lower people put things, for which its top is flat
ROWS, COLUMNS = 9, 14  # at most, however large the box is
CELLS = 18  # that are filled with books at most


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
    return parts + columns(rect, d, kinds, style, [(y0 + y1) / 2] if y1 - y0 > 0.25 else [], 1 + (y1 - y0 > 0.28))


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


def _count(wished: float, most: int, least: int = 1) -> int:
    """A whole number of rows or columns."""
    return int(np.clip(round(wished), least, most))


def bookshelf(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Open rows and columns with a back or without, some cells closed, some books; or a ladder of boards."""
    w, h, d = size
    rows = _count(h / choices.between("rows", 0.3, 0.42), ROWS, 1 + (h > 0.55))
    columns = _count(w / choices.between("columns", 0.4, 0.8), COLUMNS)
    if style.family == "industrial" and choices.chance("form", 0.6):
        return _rack(size, rows, columns)
    foot = min(0.08, style.leg_height) if choices.chance("raised", 0.5) else 0.02
    kind, back = "plinth" if foot < 0.04 else None, choices.chance("back", 0.8)
    parts, rect = carcass(size, style, foot, kind=kind, solid=False, back=back)
    parts += shelves(rect, d, rows, columns, style)
    x0, y0, x1, y1, z = rect
    xs, ys = np.linspace(x0, x1, columns + 1), np.linspace(y0, y1, rows + 1)
    closed = int(rows > 2 and choices.chance("front", 0.4))  # rows behind doors
    if closed:
        parts.append(core((x0, y0, -d / 2), (x1, float(ys[1]), z)))
        parts += front((x0, y0), (x1, float(ys[1])), z, 1, max(1, columns), "door", style, depth_of(d, z))
    rng = choices.stream("pattern")
    t = BOARD * (0.8 + 0.5 * style.bulk)
    few = min(1.0, CELLS / (rows * columns))  # a library's wall would be all books and no faces left
    for i in range(columns):
        for j in range(closed, rows):
            if rng.random() < 0.8 * few:
                across = float(xs[i]) + 0.6 * t, float(xs[i + 1]) - 0.6 * t
                upwards = float(ys[j]) + t / 2, float(ys[j + 1]) - t / 2
                parts += _books(*across, *upwards, -d / 2 + 0.02, z - 0.012, rng)
    return parts


def _books(x0: float, x1: float, y0: float, y1: float, z0: float, z1: float, rng: np.random.Generator) -> list[Solid]:
    """What stands in a cell: books upright, the last one leaning, then a lying pile, or nothing.

    `x0`, `x1`, `y0`, `y1`, `z0`, `z1`: the free space of the cell, metres.
    """
    x, end = x0, x0 + (x1 - x0) * rng.uniform(0.5, 0.92)
    deep, most = min(0.21, z1 - z0), min(0.92 * (y1 - y0), 0.29)
    if deep < 0.06 or most < 0.08:
        return []
    parts: list[Solid] = []
    upper = 0.0
    while True:
        wide, tall = rng.uniform(0.02, 0.05), most * rng.uniform(0.68, 1.0)
        if x + wide > end:
            break
        near = z0 + deep * rng.uniform(0.75, 1.0)
        parts.append(box((x, y0, z0), (x + wide - 0.002, y0 + tall, near), "spines", 0.0, "book"))
        x, upper = x + wide, tall
    lean, thick = 0.24, 0.026
    tall = min(0.78 * most, upper)
    reach = tall * np.sin(lean) + thick * np.cos(lean)
    if upper and x + reach < x1:  # one leans on the last of the row
        middle = np.array([x + reach / 2, y0 + (tall * np.cos(lean) + thick * np.sin(lean)) / 2, z0 + 0.42 * deep])
        half, cover = np.array([thick, tall, 0.8 * deep]) / 2, str(rng.choice(["book_a", "book_c"]))
        parts.append(replace(box(-half, half, cover, 0.0, "book"), centre=middle, turn=rotation(z=lean)))
        x += reach
    left, height = x + 0.02, y0
    for _ in range(int(rng.integers(0, 4)) if x1 - left > 0.16 else 0):  # a lying pile
        wide, thick = min(0.24, x1 - left) * rng.uniform(0.85, 1.0), rng.uniform(0.02, 0.045)
        if height + thick > y0 + most:
            break
        corner = (left + wide, height + thick, z0 + deep * rng.uniform(0.7, 0.95))
        parts.append(box((left, height, z0), corner, "spines", 0.0, "book"))
        height += thick
    return parts


def _rack(size: Size, rows: int, columns: int) -> list[Solid]:
    """Metal uprights and wooden boards without a back."""
    w, h, d = size
    t = 0.014
    xs = np.linspace(-w / 2 + t, w / 2 - t, min(columns, 3) + 1)
    parts = [part for x in xs for part in both(post(x, d / 2 - t, t, 0, h, "metal"), axis=2)]
    ys = np.linspace(min(0.12, 0.2 * h), h - 0.02, rows + 1)
    boards: list[Solid] = [box((-w / 2, y - 0.018, -d / 2), (w / 2, y + 0.018, d / 2)) for y in ys]
    return of_role("side", parts) + of_role("shelf", boards)


def shelf(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Lighter than a bookshelf: boards on uprights, a ladder on posts, or boards round one post."""
    w, h, d = size
    rows = _count(h / choices.between("rows", 0.3, 0.45), ROWS)
    kind = choices.pick("kind", ["rack", "boards", "ladder", "steps"])
    if (kind == "ladder" and (h < 1.2 or d < 0.22)) or (kind == "steps" and rows < 3):
        kind = "boards"  # too low to lean or to climb
    if kind == "rack" or style.family == "industrial":
        return _rack(size, rows, max(1, round(w / 0.9)))
    t = BOARD * (0.8 + 0.5 * style.bulk)
    ys = np.linspace(0.08 * min(1, h), h - t, rows + 1)
    if kind == "boards":
        parts = both(box((w / 2 - t, 0, -d / 2), (w / 2, h, d / 2), role="side"))
        return parts + [box((-w / 2, y, -d / 2), (w / 2, y + t, d / 2), role="shelf") for y in ys]
    if kind == "ladder":
        lean = np.arctan2(d * 0.6, h)
        half = h / 2 / np.cos(lean) - t * np.tan(lean)  # their lowest and highest corners end with the posts
        rail = replace(box((-t, -half, -t), (t, half, t)), centre=np.array([w / 2 - t, h / 2, -d * 0.1]))
        rails = both(replace(rail, turn=rotation(x=-lean)))
        posts = both(box((w / 2 - t - t, 0, -d / 2), (w / 2 - t + t, h, -d / 2 + 2 * t)))
        deep = [max(d / 2 - (d * 0.6) * y / h, -d / 2 + 0.12) for y in ys]
        boards = [box((-w / 2, y, -d / 2), (w / 2, y + t, z1)) for y, z1 in zip(ys, deep, strict=True)]
        return of_role("side", rails + posts) + of_role("shelf", boards)
    xs = np.linspace(-w / 2, w / 2, rows + 2)
    parts = [box((-w / 2, y, -d / 2), (w / 2, y + t, d / 2), role="shelf") for y in ys]
    ends: list[Solid] = []
    for i in range(rows):
        for x in (float(xs[1 + (i * 2) % rows]), (w / 2 - t) * (-1 if i % 2 else 1)):
            ends.append(box((x - t / 2, ys[i], -d / 2), (x + t / 2, ys[i + 1], d / 2)))
    return [*parts, *of_role("side", ends), *base(style, w * 0.9, d * 0.9, float(ys[0]), 0.035, "straight")]


def wine_cabinet(size: Size, style: Style, choices: Choices) -> list[Solid]:
    """Closed below; above a lattice for bottles, glass doors or shelves."""
    _w, h, d = size
    parts, (x0, y0, x1, y1, z) = carcass(size, style, foot_height(style, h, 0.12), solid=False)
    split = y0 + (y1 - y0) * choices.between("split", 0.3, 0.45)
    columns = _count((x1 - x0) / 0.45, COLUMNS)
    glazed = choices.chance("second", 0.45)
    parts.append(core((x0, y0, -d / 2), (x1, split, z)))
    parts.append(box((x0, split - 0.01, -d / 2), (x1, split + 0.01, z), role="shelf"))
    parts += front((x0, y0), (x1, split), z, 1, columns, "door", style, depth_of(d, z))
    bays = np.linspace(x0, x1, columns + 1)
    rng, lattice = choices.stream("pattern"), choices.whole("side", 0, columns)
    for i in range(columns):
        a, b = float(bays[i]), float(bays[i + 1])
        if i:
            parts.append(box((a - 0.01, split, -d / 2), (a + 0.01, y1, z), role="side"))
        if i == lattice or rng.random() < 0.3:
            top_y = min(y1, split + 1.2 * (b - a))
            cx, cy = (a + b) / 2, (split + top_y) / 2
            reach = np.hypot(b - a, top_y - split) / 2
            tilt = np.arctan2(top_y - split, b - a)
            near = z - 0.012  # behind the doors, where there are some
            bar = box((-reach, -0.012, -d / 2), (reach, 0.012, near), role="shelf")
            middle = np.array([cx, cy, (near - d / 2) / 2])
            parts += [replace(bar, centre=middle, turn=rotation(z=s * tilt)) for s in (-1, 1)]
            parts.append(box((a, top_y - 0.01, -d / 2), (b, top_y + 0.01, z - 0.01), role="shelf"))
            rest = top_y
            parts += _bottles(cx, cy, (b - a) / 2, (top_y - split) / 2, d, rng)
        else:
            rest = split
        cells = _count((y1 - rest) / 0.34, ROWS)
        levels = np.linspace(rest, y1, cells + 1)[1:-1]
        parts += [box((a, y - 0.01, -d / 2), (b, y + 0.01, z - 0.01), role="shelf") for y in levels]
    if glazed:
        parts += front((x0, split), (x1, y1), z, 1, columns, "door", style, glazed=True)
    return parts


def _bottles(x: float, y: float, half: float, tall: float, d: float, rng: np.random.Generator) -> list[Solid]:
    """Bottles that lie in a lattice, their necks to the front: a row on its floor, three in the crossing above.

    Arguments:
        x, y: where the two bars cross. half, tall: half its width and its half height, metres.
    """
    r, bar = 0.038, 0.012
    outline = np.array([(r, 0.0), (r, 0.18), (r * 0.8, 0.2), (r * 0.38, 0.225), (r * 0.34, 0.29)])
    outline[:, 1] *= min(1.0, (d - 0.05) / 0.3)
    slope = np.arctan2(tall, half)
    first = (r + bar) / np.cos(slope)
    second = max((r + bar + r * np.sin(slope)) / np.cos(slope), first + 3**0.5 * r)
    count = int(max(half - r / np.tan(slope / 2) - 0.02, 0) / (2 * r))
    places = [(2 * r * k, r - tall + 0.012) for k in range(-count, count + 1)] if tall > 3 * r else []
    if second + r < tall:
        places += [(0.0, first), (-r, second), (r, second)]
    lying, found = rotation(x=np.pi / 2), []
    for px, py in places:
        place, colour = np.array([x + px, y + py, -d / 2 + 0.02]), str(rng.choice(["leaf", "book"]))
        bottle = Lathe(centre=place, turn=lying, profile=outline, material=colour, role="bottle")
        if rng.random() < 0.85 or py > 0:
            found.append(bottle)
    return list(found)
