"""Image files of finishes: patterns, and what is printed or woven: rows of `prints.toml`, drawn by few programs.

Places on a sheet are (x, y) from its middle in heights of it, y downwards.
"""

import io
from collections.abc import Callable, Iterable, Mapping
from typing import Any
from zlib import crc32

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from echomodel.dressing import ASPECTS, PRINTS
from echousd.shapes.finishes.media import MEDIA, PRESS, worked
from echousd.shapes.finishes.patterns import SIZE, aged, carpet, noise, relief, rumpled
from echousd.shapes.finishes.slots import HARMONIES, Color
from echousd.srgb import from_linear, to_linear

FINE = 2  # times that what is drawn with a pen is larger first
STOCK = {"paper": "f4efe6", "ink": "2d3136"}  # colours that no harmony changes
# Patterns of wood; the shares of its red that green and blue of no wood are over: what is of another colour is painted,
# and so much of the grain is seen through it.
GRAINED, LIKE_WOOD, UNDER_PAINT = ("wood", "veneer"), (0.85, 0.58), 0.2
BANDS = 16  # that an image is coloured in one after the other: all of a floor's light is 25 MB
QUALITY = 86  # of JPEG, its hues `halved`: at half the places, which nobody sees; normals live in theirs
Row = Mapping[str, Any]


class Sheet:
    """What colours are laid on, in those of a harmony."""

    def __init__(self, name: str, harmony: str) -> None:
        self.row, self.tones = PRINTS[name], {**STOCK, **HARMONIES[harmony]}
        self.aspect, self.seed = ASPECTS[self.row["form"]], crc32(name.encode()) % 9973
        axis = (np.arange(SIZE) + 0.5) / SIZE - 0.5
        self.x, self.y = axis[None] * self.aspect, axis[:, None]
        self.tall = round(FINE * SIZE / self.aspect**0.5)  # pixels
        size = (round(self.tall * self.aspect), self.tall)
        self.image = Image.new("RGB", size, self.color(self.row.get("on", "paper")))
        self.draw = ImageDraw.Draw(self.image, "RGBA")

    def color(self, word: str) -> tuple[int, int, int]:
        """A word of a harmony or of `STOCK`, or an sRGB hex."""
        hexadecimal = self.tones.get(word, word)
        return int(hexadecimal[:2], 16), int(hexadecimal[2:4], 16), int(hexadecimal[4:], 16)

    def lay(self, where: np.ndarray, row: Row) -> None:
        """Colour where a share (SIZE, SIZE) says."""
        share = (255 * row.get("share", 1.0) * np.clip(where, 0, 1)).astype(np.uint8)
        mask = Image.fromarray(share).resize(self.image.size, Image.Resampling.BILINEAR)
        self.image.paste(self.color(row["color"]), (0, 0), mask)

    def pen(self, points: np.ndarray, row: Row) -> None:
        """Fill an outline (k, 2), or draw it as a line, at all its places (`at`: x, y and scale), `both` mirrored."""
        fill = (*self.color(row["color"]), round(255 * row.get("share", 1.0)))
        sides = [points, points * (-1, 1)] if row.get("both") else [points]
        for x, y, *scale in row.get("at", [[0, 0]]):
            for side in sides:
                place = (side * (scale or 1) + (x, y)) * self.tall + np.array(self.image.size) / 2
                if "line" in row:
                    self.draw.line(place.ravel().tolist(), fill, round(row["line"] * self.tall), "curve")
                else:
                    self.draw.polygon(place.ravel().tolist(), fill)


def shape(sheet: Sheet, row: Row) -> None:
    """Corners, or with `smooth` a curve by them; a `line` is open but where it is `closed`."""
    points = np.array(row["shape"], float)
    open_ = "line" in row and not row.get("closed")
    for _ in range(4 if row.get("smooth") else 0):  # Chaikin: every corner is cut
        after = points[1:] if open_ else np.roll(points, -1, 0)
        before = points[:-1] if open_ else points
        cut = np.stack([0.75 * before + 0.25 * after, 0.25 * before + 0.75 * after], 1).reshape(-1, 2)
        points = np.concatenate([points[:1], cut, points[-1:]]) if open_ else cut
    sheet.pen(points if open_ else np.concatenate([points, points[:1]]), row)


def disc(sheet: Sheet, row: Row) -> None:
    """An ellipse (x, y, half width and height); of it what is between two angles (`arc`, degrees, clockwise)."""
    x, y, wide, *high = row["disc"]
    first, last = np.radians(row.get("arc", (0, 360)))
    turn = np.linspace(first, last, 64)
    sheet.pen(np.stack([x + wide * np.cos(turn), y + (high or [wide])[0] * np.sin(turn)], 1), row)


def twig(sheet: Sheet, row: Row) -> None:
    """A stem between two points, bent, with `leaves` pairs (or `single`) as long and wide as `leaf`, at `angle`."""
    foot, tip = np.array(row["twig"], float).reshape(2, 2)
    along, count, (long, wide) = tip - foot, row["leaves"], row["leaf"]
    across = np.array([-along[1], along[0]]) * row.get("bend", 0.0)

    def on(share: np.ndarray) -> np.ndarray:
        return foot + np.outer(share, along) + np.outer(np.sin(np.pi * share), across)

    sheet.pen(on(np.linspace(0, 1, 30)), {"line": 0.006, **row})
    s = np.linspace(0, 1, 14)
    for k, share in enumerate(np.linspace(row.get("first", 0.2), 1.0, count)):
        here, there = on(np.array([share - 0.02, share]))
        heading = np.arctan2(*(there - here)[::-1])
        for side in (-1, 1) if not row.get("single") else ((-1) ** k,):
            turn = heading + side * np.radians(row.get("angle", 50)) * (1 if share < 1 else 0.4)
            size = long * (1 - row.get("taper", 0.5) * share)
            half = size * wide * np.sin(np.pi * s ** row.get("tip", 1.0)) / 2
            leaf = np.stack([np.concatenate([s, s[::-1]]) * size, np.concatenate([half, -half[::-1]])], 1)
            spin = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
            sheet.pen(leaf @ spin + there, {k: v for k, v in row.items() if k != "line"})


def text(sheet: Sheet, row: Row) -> None:
    """Letters `high` about each of their places."""
    font, fill = ImageFont.load_default(row["high"] * sheet.tall), sheet.color(row["color"])
    for x, y, *_ in row.get("at", [[0, 0]]):
        place = (x * sheet.tall + sheet.image.width / 2, y * sheet.tall + sheet.image.height / 2)
        sheet.draw.text(place, row["text"], fill, font, "mm")


def fade(sheet: Sheet, row: Row) -> None:
    """From colour to colour downwards: heights (0 to 1) and their colours; from a share of the sheet to its foot."""
    level, words = row["fade"], row["colors"]
    tones = np.array([sheet.color(word) for word in words], float)
    rows = [np.interp(np.linspace(0, 1, SIZE), level, tone) for tone in tones.T]
    image = np.repeat(np.stack(rows, -1)[:, None], SIZE, 1).astype(np.uint8)
    mask = np.repeat((sheet.y + 0.5 >= level[0]) * 255, SIZE, 1).astype(np.uint8)
    big = [Image.fromarray(one).resize(sheet.image.size) for one in (image, mask)]
    sheet.image.paste(big[0], (0, 0), big[1])


def ridge(sheet: Sheet, row: Row) -> None:
    """What lies below a line: its height on the sheet, how uneven it is, how jagged (0 = hills, 1 = peaks)."""
    level, uneven, jagged = row["ridge"]
    rng, x = np.random.default_rng([sheet.seed, round(1000 * level) + 1000]), sheet.x[0]
    line = sum(np.sin(x * rate + rng.uniform(0, 6)) / rate * 4 for rate in rng.uniform(4, 9, 2))
    line = line + jagged * sum(np.abs((x * rate + rng.random()) % 2 - 1) * 3 / rate for rate in (5.0, 11.0, 23.0, 47.0))
    sheet.lay((sheet.y - level - uneven * (line - line.mean())) * SIZE, row)


def cloud(sheet: Sheet, row: Row) -> None:
    """Where noise with so many features along and across is above a share of itself (`over`), or its `lines`."""
    field = noise(sheet.seed + row.get("seed", 0), *map(float, row["cloud"]))
    if "lines" in row:
        field = field * row["lines"]
        slope = np.hypot(*np.gradient(field))
        where = 1.7 - np.abs((field + 0.5) % 1 - 0.5) / np.maximum(slope, 1e-4)
    else:
        where = (field - np.quantile(field, row["over"])) * row.get("hard", 30)
    sheet.lay(where * _within(sheet, row), row)


def motif(sheet: Sheet, row: Row) -> None:
    """Where a measure of each cell's place lies `between` two numbers: 0 in its middle, 1 at its sides.

    Cells are `repeat`ed across and down, every other row shifted (`brick`), or every other cell left out (`every`); a
    measure is `round`, `square`, `lozenge`, a `bar` across or a `post`; in `steps`, with `petals`, `zig` and `rough`.
    """
    turn, (across, down) = np.radians(row.get("turn", 0)), row.get("repeat", (1, 1))
    x, y = sheet.x, sheet.y  # a row and a column, as long as nothing mixes them
    if turn:
        x, y = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
    p, q = (x / sheet.aspect + 0.5) * across, (y + 0.5) * down
    if "zig" in row:
        deep, many = row["zig"]
        q = q + deep * np.abs((p * many) % 2 - 1)
    if "rough" in row:
        q = q + row["rough"] * noise(sheet.seed + 1, 5.0, 5.0, 3.5)
        p = p + row["rough"] * noise(sheet.seed + 2, 5.0, 5.0, 3.5)
    if row.get("brick"):
        p = p + 0.5 * (np.floor(q) % 2)
    a, b = 2 * (p - np.floor(p)) - 1, 2 * (q - np.floor(q)) - 1
    if "steps" in row:
        a, b = (np.round(one * row["steps"]) / row["steps"] for one in (a, b))
    far = {"round": np.hypot, "square": np.maximum, "lozenge": np.add}.get(row["motif"])  # a bar and a post are even
    measure = far(np.abs(a), np.abs(b)) if far else np.abs(b if row["motif"] == "bar" else a)
    if "petals" in row:
        deep, many = row["petals"]
        measure = measure * (1 + deep * np.cos(many * np.arctan2(b, a)))
    low, high = row.get("between", (0, 1))
    where = np.clip(0.5 + np.minimum(measure - low, high - measure) * SIZE / (2 * max(across, down)), 0, 1)
    if row.get("every"):
        where = where * ((np.floor(p) + np.floor(q)) % 2)
    sheet.lay(where * _within(sheet, row), row)


def _within(sheet: Sheet, row: Row) -> np.ndarray:
    """Where a row may draw: between two distances from the edge (`inset`), heights of the sheet."""
    if "inset" not in row:
        return np.ones((SIZE, SIZE))
    if sheet.row["form"] in ("round", "oval"):
        edge = 0.5 - np.hypot(sheet.x / sheet.aspect, sheet.y)
    else:
        edge = np.minimum(sheet.aspect / 2 - np.abs(sheet.x), 0.5 - np.abs(sheet.y))
    low, high = row["inset"]
    return np.clip(np.minimum(edge - low, high - edge) * SIZE + 0.5, 0, 1)


PROGRAMS: Mapping[str, Callable[[Sheet, Row], None]] = {
    program.__name__: program for program in (shape, disc, twig, text, fade, ridge, cloud, motif)
}


def printed(name: str, harmony: str) -> np.ndarray:
    """(SIZE, SIZE, 3) linear RGB, a row of `prints.toml` in the colours of a harmony."""
    sheet = Sheet(name, harmony)
    for row in sheet.row["of"]:
        PROGRAMS[next(iter(row))](sheet, row)
    if "kind" in sheet.row:
        return worked(sheet.image, sheet.color("paper"), MEDIA.get(sheet.row["kind"], PRESS), sheet.seed)
    drawn = to_linear(np.arange(256) / 255)[np.asarray(sheet.image.resize((SIZE, SIZE), Image.Resampling.BOX))]
    cloth = rumpled if name.startswith("cushion_") else carpet
    return np.clip(drawn * cloth().tone[..., None], 0, 1)


def color_image(pattern: str, color: Color, harmony: str, worn: float = 0.0) -> bytes:
    """A pattern in a colour (linear RGB), `aged` by a share, or what is printed in those of a harmony, as JPEG."""
    if pattern in PRINTS:
        return _encoded([from_linear(printed(pattern, harmony))], QUALITY, halved=True)
    tone = relief(pattern).tone
    if pattern in GRAINED and not (color[1] < LIKE_WOOD[0] * color[0] and color[2] < LIKE_WOOD[1] * color[0]):
        tone, worn = 1 + UNDER_PAINT * (tone - 1), UNDER_PAINT * worn
    tone = aged(tone, worn) if worn else tone
    tone = tone[..., None] if tone.ndim == 2 else tone
    light = (np.clip(band * np.asarray(color), 0, 1) for band in np.array_split(tone, BANDS))
    return _encoded(map(from_linear, light), QUALITY, halved=True)


def normal_image(pattern: str, metres: float) -> bytes | None:
    """Tangent-space normals of a pattern that covers `metres`, +Y up as UsdPreviewSurface takes it; None if flat."""
    cloth = "rumpled" if pattern.startswith("cushion_") else pattern
    height = None if cloth in PRINTS else relief(cloth).height
    if height is None:
        return None
    step = 2 * max(metres, 0.6) / len(height)
    across, down = ((np.roll(height, -1, axis) - np.roll(height, 1, axis)) / step for axis in (1, 0))
    normal = np.stack([-across, down, np.ones_like(across)], -1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return _encoded([normal / 2 + 0.5], 78)


def rough_image(pattern: str, roughness: float) -> bytes | None:
    """Roughness about a mean, grey; None where it is even."""
    rough = None if pattern in PRINTS else relief(pattern).rough
    return None if rough is None else _encoded([np.clip(roughness + rough, 0.05, 1)], 70)


def _encoded(bands: Iterable[np.ndarray], quality: int, *, halved: bool = False) -> bytes:
    out = io.BytesIO()
    pixels = np.concatenate([(np.clip(band, 0, 1) * 255 + 0.5).astype(np.uint8) for band in bands])
    Image.fromarray(pixels).save(out, "JPEG", quality=quality, subsampling=2 * halved, optimize=True)
    return out.getvalue()
