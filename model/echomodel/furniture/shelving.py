"""Open storage: bookshelves, shelves and wine cabinets."""

from dataclasses import replace

import numpy as np

from echomodel.furniture.carpentry import Size, base, both, box, core, of_role, post
from echomodel.furniture.fronts import BOARD, carcass, depth_of, foot_height, front, shelves
from echomodel.furniture.solids import Lathe, Solid, rotation
from echomodel.furniture.style import Choices, Style

BOOKS = ("book", "cushion", "blanket", "linen", "accent")  # slots that books take their colours from


ROWS, COLUMNS = 9, 14  # at most, however large the box is
CELLS = 18  # that are filled with books at most


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
    x, end = x0, x0 + (x1 - x0) * rng.uniform(0.4, 0.8)
    deep, most = min(0.21, z1 - z0), min(0.92 * (y1 - y0), 0.29)
    if deep < 0.06 or most < 0.08:
        return []
    parts: list[Solid] = []
    colours, upper = rng.choice(BOOKS, size=3), 0.0
    while True:
        wide, tall = rng.uniform(0.02, 0.05), most * rng.uniform(0.68, 1.0)
        if x + wide > end:
            break
        near = z0 + deep * rng.uniform(0.75, 1.0)
        parts.append(box((x, y0, z0), (x + wide - 0.002, y0 + tall, near), str(rng.choice(colours)), 0.0, "book"))
        x, upper = x + wide, tall
    lean, thick = 0.24, 0.026
    tall = min(0.78 * most, upper)
    reach = tall * np.sin(lean) + thick * np.cos(lean)
    if upper and x + reach < x1:  # one leans on the last of the row
        middle = np.array([x + reach / 2, y0 + (tall * np.cos(lean) + thick * np.sin(lean)) / 2, z0 + 0.42 * deep])
        leaning = box((-thick / 2, -tall / 2, -0.4 * deep), (thick / 2, tall / 2, 0.4 * deep), str(colours[0]))
        parts.append(replace(leaning, centre=middle, turn=rotation(z=lean), role="book"))
        x += reach
    left, height = x + 0.02, y0
    for _ in range(int(rng.integers(0, 4)) if x1 - left > 0.16 else 0):  # a lying pile
        wide, thick = min(0.24, x1 - left) * rng.uniform(0.85, 1.0), rng.uniform(0.02, 0.045)
        if height + thick > y0 + most:
            break
        corner = (left + wide, height + thick, z0 + deep * rng.uniform(0.7, 0.95))
        parts.append(box((left, height, z0), corner, str(rng.choice(colours)), 0.0, "book"))
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
