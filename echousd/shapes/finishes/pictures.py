"""Pictures on walls by programs of ten kinds, and what is woven into rugs: thirteen designs in two variants."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from PIL import Image, ImageDraw

from echousd.shapes.finishes.patterns import SIZE, Relief, noise, pile

FINE = 2  # times that what is drawn with a pen is larger first


class Canvas:
    """A sheet of paper that colours are laid on.

    Arguments:
        colors: five linear RGB colours: paper, three of a harmony, a dark one.
        rng: what decides on the picture.
    """

    def __init__(self, colors: Sequence[Sequence[float]], rng: np.random.Generator, number: int) -> None:
        self.paper, *self.tones = (np.asarray(color, float) for color in colors)
        self.rng, self.number = rng, number
        axis = (np.arange(SIZE) + 0.5) / SIZE
        self.u, self.v = axis[None, :] + 0 * axis[:, None], axis[:, None] + 0 * axis[None, :]
        self.out = np.broadcast_to(self.paper, (SIZE, SIZE, 3)).copy()

    @property
    def dark(self) -> np.ndarray:
        """The colour of ink."""
        return self.tones[3]

    def lay(self, where: np.ndarray, color: np.ndarray) -> None:
        """Colour where a mask (SIZE, SIZE), bool or a share, is."""
        self.out += np.asarray(where, float)[..., None] * (color - self.out)

    def pen(self, draw: Callable[[ImageDraw.ImageDraw, float], None], color: np.ndarray) -> None:
        """Colour what is drawn on a sheet of so many pixels on each side."""
        sheet = Image.new("L", (FINE * SIZE, FINE * SIZE))
        draw(ImageDraw.Draw(sheet), float(FINE * SIZE))
        self.lay(np.asarray(sheet.resize((SIZE, SIZE), Image.Resampling.BOX), float) / 255, color)

    def fill(self, corners: np.ndarray, color: np.ndarray) -> None:
        """Colour within corners (k, 2), shares of the sheet."""
        self.pen(lambda pen, side: pen.polygon((corners * side).ravel().tolist(), 255), color)

    def tone(self) -> np.ndarray:
        """One of the three colours of the harmony."""
        return self.tones[int(self.rng.integers(3))]


def hills(canvas: Canvas) -> None:
    """Hills under a sun."""
    rng, u, v = canvas.rng, canvas.u, canvas.v
    canvas.lay((u - rng.uniform(0.3, 0.7)) ** 2 + (v - 0.3) ** 2 < rng.uniform(0.09, 0.14) ** 2, canvas.tones[0])
    for layer in range(4):
        line = 0.45 + 0.14 * layer + 0.06 * np.sin(2 * np.pi * (u * rng.uniform(0.6, 1.6) + rng.random()))
        canvas.lay(v > line, canvas.tones[1] * (1 - layer / 3) + canvas.tones[2] * (layer / 3))


def rounds(canvas: Canvas) -> None:
    """Round shapes beside and over one another."""
    rng, u, v = canvas.rng, canvas.u, canvas.v
    for which in (1, 0, 2, 0, 3):
        x, y, r = rng.uniform(0.25, 0.75), rng.uniform(0.25, 0.75), rng.uniform(0.08, 0.24)
        inside = ((u - x) / r) ** 2 + ((v - y) / (r * rng.uniform(0.7, 1.6))) ** 2 < 1
        canvas.lay(inside & (v < y) if rng.random() < 0.5 else inside, canvas.tones[which])


def fields(canvas: Canvas) -> None:
    """Fields of colour with soft borders."""
    cuts = [0.0, *np.sort(canvas.rng.uniform(0.2, 0.8, 2)).tolist(), 1.0]
    soft, wide = canvas.v + 0.006 * noise(131 + canvas.number, 8.0, 8.0), (canvas.u > 0.06) & (canvas.u < 0.94)
    for which, top, bottom in zip(range(3), cuts, cuts[1:], strict=False):
        canvas.lay((soft > top + 0.015) & (soft < bottom - 0.015) & wide, canvas.tones[which])


def line(canvas: Canvas) -> None:
    """One line drawn without lifting the pen, over a patch of colour."""
    rng, u, v = canvas.rng, canvas.u, canvas.v
    x, y = rng.uniform(0.35, 0.65, 2)
    canvas.lay((u - x) ** 2 + (v - y) ** 2 < rng.uniform(0.12, 0.22) ** 2, canvas.tone())
    turn = np.linspace(0, 2 * np.pi, 600)
    waves = [(rng.normal(0, 1 / (1 + k), 2), rng.normal(0, 1 / (1 + k), 2), k + 1) for k in range(5)]
    points = sum(np.outer(np.cos(k * turn), a) + np.outer(np.sin(k * turn), b) for a, b, k in waves)
    points = (points - points.min(0)) / np.ptp(points, 0) * 0.7 + 0.15
    canvas.pen(lambda pen, side: pen.line((points * side).ravel().tolist(), 255, round(0.009 * side)), canvas.dark)


def botanical(canvas: Canvas) -> None:
    """A twig with leaves in pairs."""
    rng = canvas.rng
    bend, wide, pairs = rng.uniform(-0.25, 0.25), rng.uniform(0.3, 0.55), int(rng.integers(4, 8))
    at = np.linspace(0.12, 0.9, pairs)
    stem = np.stack([0.5 + bend * (np.linspace(0, 1, 40) ** 2), 0.94 - 0.82 * np.linspace(0, 1, 40)], 1)
    color = canvas.tones[int(rng.integers(2))] * 0.75
    canvas.pen(lambda pen, side: pen.line((stem * side).ravel().tolist(), 255, round(0.008 * side)), color)
    turn = np.linspace(0, np.pi, 24)
    for share in at:
        foot = np.array([0.5 + bend * share**2, 0.94 - 0.82 * share])
        for side in (-1, 1):
            length, angle = wide * (0.55 - 0.4 * abs(share - 0.4)), 0.5 + 0.5 * share + rng.uniform(-0.12, 0.12)
            along = np.array([side * np.sin(np.pi / 2 - 0.5 * angle), -np.cos(np.pi / 2 - 0.8 * angle)])
            across = np.array([-along[1], along[0]])
            half = np.outer((1 - np.cos(turn)) / 2, along) * length
            leaf = np.concatenate([s * np.outer(np.sin(turn), across) * 0.2 * length + half for s in (1, -1)])
            leaf = foot + np.concatenate([leaf[:24], leaf[:23:-1]])
            canvas.fill(leaf, color)


def contours(canvas: Canvas) -> None:
    """The lines of a map of hills, one height filled in."""
    height = 4 * noise(161 + canvas.number, 2.0, 2.0, 5.0)
    slope = np.hypot(*np.gradient(height))
    canvas.lay(height > np.quantile(height, canvas.rng.uniform(0.72, 0.88)), canvas.tone())
    canvas.lay(np.clip(1.6 - np.abs((height + 0.5) % 1.0 - 0.5) / np.maximum(slope, 1e-4), 0, 1), canvas.dark)


def horizon(canvas: Canvas) -> None:
    """The sea under an evening sky, as a photograph has it."""
    level, u, v = canvas.rng.uniform(0.5, 0.72), canvas.u, canvas.v
    sky = np.clip(v / level, 0, 1)[..., None] ** 1.6
    warm = 0.5 * canvas.tones[0] + 0.5 * np.array([0.9, 0.75, 0.6])
    canvas.out = (1 - sky) * (0.6 * canvas.tones[1] + 0.25) + sky * warm
    far = np.clip((v - level) / (1 - level), 0, 1)
    ripple = 1 + 0.10 * noise(171 + canvas.number, 12.0, 90.0) * (0.3 + far)
    sea = (0.55 * warm + 0.1)[None, None] * (1 - far[..., None]) + 0.45 * canvas.tones[1] * far[..., None]
    glint = np.exp(-(((u - canvas.rng.uniform(0.3, 0.7)) / 0.09) ** 2)) * (1 - 0.7 * far) * 0.25
    shown = sea * ripple[..., None] + glint[..., None] * warm
    canvas.out = np.where((v > level)[..., None], shown, canvas.out)


def textile(canvas: Canvas) -> None:
    """Woven bars and blocks."""
    rng, rows = canvas.rng, int(canvas.rng.integers(6, 11))
    pick = rng.choice(5, (rows, 6), p=(0.34, 0.2, 0.18, 0.16, 0.12))
    shade = np.stack([canvas.paper, *canvas.tones])[pick]
    block = shade[(canvas.v * rows).astype(int), (canvas.u * 6).astype(int)]
    weave = 1 + 0.08 * np.sin(2 * np.pi * 90 * canvas.v) * np.sin(2 * np.pi * 90 * canvas.u)
    inside = (np.abs(canvas.u - 0.5) < 0.42) & (np.abs(canvas.v - 0.5) < 0.42)
    canvas.out = np.where(inside[..., None], block * weave[..., None], canvas.out)


def arches(canvas: Canvas) -> None:
    """Arches within one another, on their feet."""
    foot, wide = canvas.rng.uniform(0.78, 0.9), canvas.rng.uniform(0.34, 0.44)
    order = canvas.rng.permutation(4)
    high = foot - wide * canvas.rng.uniform(1.0, 1.4)
    for ring in range(6):
        r = wide * (1 - ring / 6)
        below = (np.abs(canvas.u - 0.5) < r) & (canvas.v > high + wide) & (canvas.v < foot)
        above = (canvas.u - 0.5) ** 2 + (canvas.v - high - wide) ** 2 < r**2
        color = canvas.paper if ring % 2 else canvas.tones[int(order[ring // 2])]
        canvas.lay(below | (above & (canvas.v <= high + wide)), color)


def cuttings(canvas: Canvas) -> None:
    """Shapes cut out of coloured paper."""
    for layer, color in enumerate(canvas.tones):
        shape = noise(181 + 7 * canvas.number + layer, 2.2, 2.2, 3.0)
        margin = np.minimum(np.minimum(canvas.u, 1 - canvas.u), np.minimum(canvas.v, 1 - canvas.v)) > 0.07
        canvas.lay((shape > 0.95 + 0.12 * layer) & margin, color)


KINDS = (hills, line, rounds, botanical, fields, contours, horizon, textile, arches, cuttings)


def picture(colors: Sequence[Sequence[float]], number: int) -> np.ndarray:
    """(SIZE, SIZE, 3) linear RGB, the picture of that number in five colours, as `Canvas` takes them."""
    canvas = Canvas(colors, np.random.default_rng([number, 7]), number)
    KINDS[number % len(KINDS)](canvas)
    return np.clip(canvas.out * (1 + 0.03 * noise(101 + number, 90.0, 90.0)[..., None]), 0, 1)


Design = Callable[[np.ndarray, np.ndarray, int], np.ndarray]


def bordered(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """Two lines along the edge."""
    edge, wide = _edge(u, v), 0.045 * (1 + 0.6 * variant)
    return np.where(
        ((edge > 0.045) & (edge < 0.06)) | ((edge > 0.075) & (edge < 0.075 + wide)), 0.72 - 0.3 * variant, 1
    )


def striped(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """Broad and narrow stripes across."""
    wave = np.sin(2 * np.pi * (5 + 4 * variant) * v)
    return np.where(wave > 0.75 - 0.6 * variant, 0.7 - 0.06 * variant, np.where(wave < -0.9, 0.85, 1.0))


def latticed(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """Lozenges between lines."""
    a, b = (np.abs((4 * u + sign * 4 * v) % 1.0 - 0.5) for sign in (1, -1))
    line = np.minimum(a, b) < 0.035
    return np.where(line | (variant * (np.maximum(a, b) < 0.12) > 0), 0.62 - 0.2 * variant, 1.0)


def medallion(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """A medallion within a border, its edge scalloped."""
    x, y = 2 * u - 1, 2 * v - 1
    reach, turn = np.hypot(1.25 * x, 1.25 * y), np.arctan2(y, x)
    wavy = reach * (1 + 0.07 * np.cos((12 + 4 * variant) * turn))
    rings = np.where(np.sin(2 * np.pi * 3.5 * wavy) > 0.2, 0.62, 0.88)
    edge = _edge(u, v)
    ground = np.where((edge > 0.05) & (edge < 0.13), 0.55 + 0.25 * (np.sin(2 * np.pi * 16 * (u + v)) > 0), 1.0)
    return np.where(wavy < 0.78, rings, ground)


def checked(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """Squares by turns."""
    many = 4 + 4 * variant
    return np.where(((many * u).astype(int) + (many * v).astype(int)) % 2 == 0, 0.68 - 0.2 * variant, 1.0)


def chevrons(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """Zigzags across."""
    across = np.abs((4 * u) % 1.0 - 0.5) * (0.5 + 0.4 * variant)
    return np.where(((6 * v + across) % 1.0) < 0.45, 0.66, 1.0)


def dotted(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """Dots, every other row between those above."""
    many = 7 + 5 * variant
    row = (many * v).astype(int)
    x, y = (many * u + 0.5 * (row % 2)) % 1.0 - 0.5, (many * v) % 1.0 - 0.5
    return np.where(np.hypot(x, y) < 0.24, 0.6, 1.0)


def scalloped(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """Rows of arcs over one another, as scales."""
    many, out = 5 + 2 * variant, np.ones_like(u)
    for row in range(2 * many, -2, -1):
        x, y = (many * u + 0.5 * (row % 2)) % 1.0 - 0.5, many * v - 0.5 * row
        reach = np.hypot(x, y)
        inside = (reach < 0.62) & (y > -0.62)
        out = np.where(inside, np.where((reach * 8).astype(int) % 2 == 0, 0.7, 1.0), out)
    return out


def broken(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """Large fields with soft, uneven borders."""
    one, other = (noise(201 + 10 * variant + k, 2.0, 2.0, 4.5) for k in range(2))
    return np.where(one > 0.5, 0.6, np.where(other > 0.6, 0.8, 1.0)) - 0.12 * (np.abs(one - 0.5) < 0.05)


def ringed(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """Rings about the middle."""
    reach = np.hypot(2 * u - 1, 2 * v - 1)
    return np.where((reach * (3 + 4 * variant)) % 1.0 < 0.32, 0.68, 1.0)


def berber(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """Thin uneven lozenges in dark wool, as hands knot them."""
    bend = 0.022 * noise(221 + variant, 6.0, 6.0, 4.0)
    many = 3 + variant
    a, b = (np.abs((many * (u + sign * 0.8 * v) + bend * 4) % 1.0 - 0.5) for sign in (1, -1))
    return np.where(np.minimum(a, b) < 0.03, 0.3, 1.0)


def shaded(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """From light to dark, from end to end or from the edge inwards."""
    share = 2 * _edge(u, v) if variant else v
    return 0.62 + 0.5 * np.clip(share + 0.04 * noise(231, 30.0, 3.0), 0, 1)


def carved(u: np.ndarray, v: np.ndarray, variant: int) -> np.ndarray:
    """One colour, with lines clipped into the pile."""
    wave = v + 0.05 * np.sin(2 * np.pi * (2 + variant) * u)
    return np.where((wave * 9) % 1.0 < 0.06, 0.8, 1.0)


DESIGNS: Mapping[str, Design] = {
    design.__name__: design
    for design in (
        bordered, striped, latticed, medallion, checked, chevrons, dotted, scalloped, broken, ringed, berber, shaded,
        carved,
    )
}  # fmt: skip


def woven(design: str, variant: int) -> Relief:
    """A rug of one of the designs, in one of two variants."""
    axis = (np.arange(SIZE) + 0.5) / SIZE
    u, v = axis[None, :] + 0 * axis[:, None], axis[:, None] + 0 * axis[None, :]
    tone = DESIGNS[design](u, v, variant) * pile().tone
    return Relief(tone / np.median(tone))


def _edge(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    return np.minimum(np.minimum(u, 1 - u), np.minimum(v, 1 - v))
