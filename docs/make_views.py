"""Makes what is seen through windows, `echousd/shapes/finishes/views/*.jpg`, by latitude and longitude.

    python docs/make_views.py [garden street ...]

Trees of branches and leaves, hedges, houses, hills and clouds are grown and built by programs from a seed and drawn by
rays through Embree; some minutes each, so the pictures ship, as weights do, and rooms only choose among them.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from outdoors import (
    BRICK,
    FIELD,
    GLASS,
    LAWN,
    LEAF,
    PAVING,
    PLAIN,
    TILE,
    WATER,
    Parts,
    bush,
    conifer,
    distant,
    fence,
    ground,
    hills,
    house,
    joined,
    part,
    quads,
    scattered,
    tree,
)
from PIL import Image, ImageFilter

from echousd.draw.rays import embree
from echousd.srgb import from_linear

FOLDER = Path(__file__).parents[1] / "echousd/shapes/finishes/views"
WIDE = 4096  # pixels around
BAND = (52.0, -42.0)  # degrees of elevation between which anything but sky and ground is
RAYS, QUALITY = 4, 55  # per pixel; of JPEG
# How much less coloured than light is: through glass and haze; how bright half of what lies about the horizon is.
PALER, ABOUT = 0.12, 0.11
SOFT = 0.8  # pixels, so that near a window none is seen: what lies around is never quite in focus indoors
SUNNY, FAR = np.array([1.55, 1.42, 1.20]), 2600.0  # what the sun gives to what faces it; metres that haze takes
HAZE = np.array([0.66, 0.76, 0.87])


GRASS, ASPHALT, STONE = (0.095, 0.142, 0.046), (0.11, 0.11, 0.115), (0.36, 0.35, 0.33)
GOLDEN = 2.39996  # radians from one thing to the next, so that none stands behind another
VIEWS: dict[str, Callable[[], tuple[list[Parts], float, float]]] = {}  # parts, the eye's height, the sun's azimuth


def view(build: Callable[[], tuple[list[Parts], float, float]]) -> Callable[[], tuple[list[Parts], float, float]]:
    """A row of `VIEWS`."""
    VIEWS[build.__name__] = build
    return build


def around(away: float, turn: float) -> tuple[float, float]:
    """(x, z) so many metres from the eye, at an angle."""
    return away * np.cos(turn), away * np.sin(turn)


def road(near: float, far: float, pavement: float, kerb: float, height: float) -> list[Parts]:
    """A road along x between two distances (z), and a pavement so wide on both sides, beyond a kerb."""
    low, high = near - kerb, far + kerb
    strips = [(ASPHALT, PLAIN, near, far, height), (STONE, PAVING, low - pavement, low, 0.03)]
    strips.append((STONE, PAVING, high, high + pavement, 0.03))
    return [ground(color, kind, (-90, start), (90, end), y) for color, kind, start, end, y in strips]


@view
def garden() -> tuple[list[Parts], float, float]:
    """A lawn with a hedge, flower beds, fruit trees, and neighbours' roofs behind it."""
    rng = np.random.default_rng(1)
    kinds = [
        tree(11, 5.2, bare=0.3, leaf=0.13),
        tree(12, 6.5, leaf=0.14),
        tree(16, 4.4, bare=0.3, leaf=0.12, green=(0.60, 0.44, 0.47)),
    ]
    out = [ground(GRASS), *distant(20, 60, 120)]
    for turn in np.arange(0, 2 * np.pi, np.pi / 18):  # hedge in a ring of straight pieces
        x, z = around(13.5, turn)
        out.append(
            bush(
                30 + int(turn * 9), (2.6, 1.35, 0.9), many=6000, leaf=0.10, square=8, green=(0.075, 0.135, 0.035)
            ).moved(x, z, np.pi / 2 - turn)
        )
    for n, turn in enumerate((0.35, 1.2, 2.0, 2.75, 3.6, 4.35, 5.1, 5.9)):
        out.append(
            kinds[n % 3].moved(
                rng.uniform(8.5, 11.5) * np.cos(turn), rng.uniform(8.5, 11.5) * np.sin(turn), n, rng.uniform(0.8, 1.15)
            )
        )
    blooms = [(0.55, 0.10, 0.22), (0.62, 0.58, 0.60), (0.30, 0.16, 0.50), (0.72, 0.42, 0.08), (0.60, 0.22, 0.30)]
    for n in range(46):
        turn, away = n * GOLDEN, rng.uniform(10.8, 12.4)
        flower = bush(
            90 + n,
            (rng.uniform(0.8, 1.6), rng.uniform(0.5, 1.0), rng.uniform(0.8, 1.3)),
            many=900,
            leaf=0.07,
            flowers=blooms[n % 5] if n % 3 else None,
        )
        out.append(flower.moved(*around(away, turn), turn))
    walls = [(0.62, 0.58, 0.50), (0.40, 0.20, 0.14), (0.66, 0.63, 0.58), (0.52, 0.44, 0.34)]
    for n, turn in enumerate(np.arange(0, 2 * np.pi, 2 * np.pi / 9) + 0.2):
        kind = BRICK if n % 4 == 1 else PLAIN
        out.append(
            house(n, wall=walls[n % 4], kind=kind, tiles=((0.24, 0.10, 0.065), (0.09, 0.09, 0.10))[n % 2]).moved(
                *around(30, turn), -np.pi / 2 - turn
            )
        )
    out += scattered(rng, [tree(14, 9.0, leaf=0.2), tree(15, 8.0, leaf=0.2)], 18, 17, 27)
    return out, 1.65, 0.6


@view
def orchard() -> tuple[list[Parts], float, float]:
    """Grass under old trees, a white fence, fields and hills."""
    rng = np.random.default_rng(2)
    kinds = [
        tree(41, 6.0, bare=0.26, leaf=0.13),
        tree(43, 7.0, bare=0.26, leaf=0.14),
        tree(45, 5.0, bare=0.3, leaf=0.13),
    ]
    out = [ground((0.10, 0.155, 0.040)), *distant(50, 130, 300, 320), hills(51, 250, 2600, 150, (0.07, 0.11, 0.04))]
    for n in range(22):
        turn = n * GOLDEN
        out.append(kinds[n % 3].moved(*around(9 + 1.05 * n, turn), n, rng.uniform(0.85, 1.25)))
    for turn in np.arange(0, 2 * np.pi, np.pi / 12):
        out.append(fence(7.0).moved(*around(26, turn), np.pi / 2 - turn))
    out += scattered(
        rng,
        [
            bush(60 + n, (0.5, 0.45, 0.5), many=260, leaf=0.06, flowers=f)
            for n, f in enumerate(((0.7, 0.65, 0.6), (0.66, 0.5, 0.1), (0.3, 0.2, 0.5)))
        ],
        90,
        6,
        25,
    )
    return out, 1.6, 2.2


@view
def street() -> tuple[list[Parts], float, float]:
    """Houses over a street with pavements, front gardens and trees."""
    rng = np.random.default_rng(3)
    walls = ((0.64, 0.60, 0.52), (0.38, 0.18, 0.12), (0.70, 0.67, 0.62),
             (0.52, 0.42, 0.30), (0.44, 0.48, 0.50), (0.60, 0.46, 0.36))  # fmt: skip
    out = [ground(GRASS), *distant(70, 70, 140)]
    kinds = [tree(71, 7.0, bare=0.34, leaf=0.15), tree(72, 8.0, bare=0.34, leaf=0.15)]
    for side in range(4):  # streets on all sides, so that every window has one
        here = road(9.2, 14.8, 1.7, 0.1, 0.012 + side * 1e-3)
        for n, x in enumerate(np.arange(-34, 35, 11.5)):
            number = side * 7 + n
            kind = BRICK if number % 6 == 1 else PLAIN
            here.append(
                house(
                    number,
                    9.4,
                    8.0,
                    2 + (number % 5 == 3),
                    wall=walls[number % 6],
                    kind=kind,
                    tiles=((0.22, 0.095, 0.06), (0.10, 0.10, 0.11), (0.17, 0.10, 0.07))[number % 3],
                ).moved(x, 25.5, np.pi)
            )
            here.append(bush(number, (8.4, 0.95, 0.7), many=9000, leaf=0.10, square=8).moved(x - 0.6, 17.5))
            here.append(kinds[n % 2].moved(x + 5.6, 15.9, number, rng.uniform(0.7, 0.95)))
            here += [
                bush(
                    200 + number + k,
                    (1.3, 0.9, 1.2),
                    many=900,
                    leaf=0.07,
                    flowers=((0.6, 0.2, 0.3), (0.62, 0.58, 0.6), None)[k],
                ).moved(x - 3 + 2.6 * k, 20.4)
                for k in range(3)
            ]
        out += [each.moved(0, 0, side * np.pi / 2) for each in here]
    return out, 1.9, 3.7


@view
def park() -> tuple[list[Parts], float, float]:
    """From a first floor: old trees on a lawn with paths."""
    rng = np.random.default_rng(4)
    kinds = [
        tree(81, 11.0, leaf=0.2, many=46),
        tree(83, 13.0, leaf=0.22, many=46),
        tree(82, 9.0, leaf=0.18),
        conifer(84, 12.0),
    ]
    out = [ground(GRASS), *distant(85, 80, 170, 340)]
    for n in range(30):
        turn, away = n * GOLDEN, 15 + 1.6 * n
        out.append(kinds[n % 4].moved(*around(away, turn), n, rng.uniform(0.8, 1.2)))
    for away in (11.0, 27.0):
        turn = np.linspace(0, 2 * np.pi, 97)
        inner, outer = (np.stack([r * np.cos(turn), 0 * turn + 0.02, r * np.sin(turn)], 1) for r in (away, away + 2.2))
        out.append(part(quads(np.stack([inner[:-1], inner[1:], outer[1:], outer[:-1]], 1)), (0.42, 0.37, 0.30), PAVING))
    out += scattered(
        rng,
        [
            bush(86 + n, (2.2, 1.4, 2.0), many=2600, leaf=0.09, flowers=(None, (0.55, 0.15, 0.3))[n % 2])
            for n in range(3)
        ],
        26,
        14.5,
        40,
    )
    return out, 4.6, 1.2


@view
def town() -> tuple[list[Parts], float, float]:
    """From a second floor: fronts over a street with trees, roofs behind them."""
    rng = np.random.default_rng(5)
    walls = ((0.62, 0.57, 0.48), (0.68, 0.64, 0.58), (0.36, 0.17, 0.12),
             (0.58, 0.48, 0.36), (0.52, 0.54, 0.55), (0.66, 0.55, 0.42))  # fmt: skip
    out = [ground((0.20, 0.20, 0.20), PLAIN)]
    kinds = [tree(91, 8.5, bare=0.34, leaf=0.16), tree(92, 9.0, bare=0.34, leaf=0.16)]
    for side in range(4):
        here = road(7.0, 14.0, 4.0, 0.0, 0.01)
        x = -46.0
        for row, deep in ((0, 19.5), (1, 42.0), (2, 66.0)):
            x = -46.0 - 14 * row
            while x < 46 + 14 * row:
                number, wide = int(rng.integers(1000)), float(rng.uniform(9, 14))
                kind, floors = BRICK if number % 6 == 2 else PLAIN, int(rng.integers(3, 6))
                here.append(
                    house(
                        number,
                        wide,
                        12,
                        floors,
                        wall=walls[number % 6],
                        kind=kind,
                        pitched=number % 3 > 0,
                        tiles=((0.21, 0.09, 0.06), (0.11, 0.11, 0.12))[number % 2],
                    ).moved(x + wide / 2, deep + 6, np.pi)
                )
                x += wide + (0.02 if row == 0 else rng.uniform(1, 6))
        here += [
            kinds[n % 2].moved(at, 15.6, n, rng.uniform(0.75, 1.0))
            for n, at in enumerate(np.arange(-38, 39, 9.5) + rng.uniform(-1, 1))
        ]
        out += [each.moved(0, 0, side * np.pi / 2) for each in here]
    return out, 8.2, 5.2


@view
def lake() -> tuple[list[Parts], float, float]:
    """Over a garden's end, water before wooded hills."""
    rng = np.random.default_rng(6)
    trees = [
        tree(101, 9.0, birch=True, leaf=0.15, many=60, bare=0.3, green=(0.10, 0.165, 0.035)),
        tree(102, 8.0, birch=True, leaf=0.15, many=60, bare=0.3, green=(0.085, 0.15, 0.034)),
        conifer(103, 10.0),
    ]
    turn = np.linspace(0, 2 * np.pi, 129)
    shore = 30 + 5 * np.sin(3 * turn) + 3 * np.sin(7 * turn + 1)
    inner, outer = (
        np.stack([r * np.cos(turn), np.full(129, y), r * np.sin(turn)], 1) for r, y in ((0 * turn, 0.0), (shore, -0.9))
    )
    out = [
        part(quads(np.stack([inner[:-1], inner[1:], outer[1:], outer[:-1]], 1)), GRASS, LAWN),
        ground((0.03, 0.06, 0.07), WATER, y=-1.0),
    ]
    out += [hills(104, 420, 1500, 210, (0.030, 0.060, 0.028)), hills(105, 1200, 4200, 620, (0.05, 0.08, 0.06))]
    out += [each.moved(0, 0, y=-1.0) for each in distant(106, 405, 470, 420)]
    for n in range(17):
        way, away = n * GOLDEN + 0.4, 13 + 0.85 * n
        out.append(trees[n % 3].moved(*around(away, way), n, rng.uniform(0.8, 1.2), -0.03 * away))
    out += scattered(rng, [bush(107 + n, (1.6, 1.0, 1.5), many=1800, leaf=0.07) for n in range(3)], 26, 19, 27, y=-0.7)
    return out, 3.0, 0.2


@view
def hillside() -> tuple[list[Parts], float, float]:
    """From high up over a valley: crowns and roofs below, hills behind hills."""
    rng = np.random.default_rng(7)
    kinds = [tree(111, 9.0, leaf=0.2), tree(112, 8.0, leaf=0.2), conifer(113, 10.0), tree(114, 7.0, leaf=0.18)]
    out = [ground((0.09, 0.135, 0.044)), *distant(115, 110, 420, 520)]
    out += [
        hills(116, 300, 1300, 130, (0.075, 0.115, 0.045)),
        hills(117, 1000, 2600, 330, (0.045, 0.085, 0.04)),
        hills(118, 2200, 4800, 700, (0.06, 0.09, 0.07)),
    ]
    out += scattered(rng, kinds, 60, 17, 90)
    for n in range(16):
        turn, away = n * GOLDEN, rng.uniform(34, 110)
        out.append(
            house(300 + n, wall=((0.66, 0.62, 0.55), (0.62, 0.55, 0.44))[n % 2], tiles=(0.22, 0.095, 0.06)).moved(
                *around(away, turn), rng.uniform(0, 6.3)
            )
        )
    return out, 11.0, 4.4


@view
def wood() -> tuple[list[Parts], float, float]:
    """A clearing in a light wood."""
    rng = np.random.default_rng(8)
    kinds = [
        tree(121, 10.0, birch=True, leaf=0.15, many=60, bare=0.3, green=(0.105, 0.17, 0.035)),
        tree(122, 11.0, birch=True, leaf=0.15, many=60, bare=0.33, green=(0.085, 0.15, 0.03)),
        conifer(123, 11.0),
        tree(124, 9.0, leaf=0.16, many=30),
    ]
    out = [ground((0.085, 0.135, 0.036)), *distant(125, 55, 100, 300)]
    for n in range(60):
        turn, away = n * GOLDEN, 9.5 + 0.62 * n
        out.append(kinds[(n * 7) % 4 if n % 3 else n % 2].moved(*around(away, turn), n, rng.uniform(0.8, 1.2)))
    out += scattered(
        rng, [bush(126 + n, (0.9, 0.6, 0.9), many=500, leaf=0.08) for n in range(3)], 120, 7, 40, (0.5, 1.2)
    )
    return out, 1.7, 2.9


def noise(seed: int, power: float, many: int = 1024) -> np.ndarray:
    """(many, many) periodic noise of deviation 1."""
    rng = np.random.default_rng(seed)
    v, u = np.meshgrid(np.fft.fftfreq(many) * many, np.fft.rfftfreq(many) * many, indexing="ij")
    weight = 1 / np.maximum(np.hypot(u, v), 1) ** power
    weight[0, 0] = 0
    out = np.fft.irfft2(np.fft.rfft2(rng.normal(size=(many, many))) * weight, s=(many, many))
    return np.asarray(out / out.std())


PUFF, GRAIN = noise(1, 1.75), noise(2, 0.7)


def taken(table: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Values of a periodic table between its pixels, at places in its widths."""
    n = len(table)
    x, y = x % 1 * n, y % 1 * n
    i, j = x.astype(int), y.astype(int)
    x, y = x - i, y - j
    k, m = (i + 1) % n, (j + 1) % n
    i, j = i % n, j % n
    return np.asarray(
        (1 - y) * ((1 - x) * table[j, i] + x * table[j, k]) + y * ((1 - x) * table[m, i] + x * table[m, k])
    )


def sky(way: np.ndarray, sun: np.ndarray, seed: int, clouds: bool = True) -> np.ndarray:
    """(n, 3) radiance of ways (n, 3) that meet nothing: blue upwards, haze at the horizon, heaps of cloud."""
    up = np.clip(way[:, 1], 0, 1)[:, None]
    out = np.array([0.20, 0.37, 0.66]) + (np.array([0.74, 0.83, 0.92]) - (0.20, 0.37, 0.66)) * np.exp(-up / 0.24)
    out += 0.35 * np.clip(way @ sun, 0, 1)[:, None] ** 24
    if not clouds:
        return out + 0.12
    height = 1 / (way[:, 1] + 0.09)
    x, y = 0.055 * way[:, 0] * height + 0.137 * seed, 0.055 * way[:, 2] * height + 0.311 * seed
    dense = taken(PUFF, x, y) - 0.45
    lit = np.clip(dense - (taken(PUFF, x + 0.006 * sun[0], y + 0.006 * sun[2]) - 0.45), -0.5, 0.5)
    share = np.clip(1.6 * dense, 0, 1)[:, None] ** 1.3 * np.clip(way[:, 1] / 0.10, 0, 1)[:, None]
    white = np.clip(0.96 + 0.55 * lit - 0.13 * np.clip(dense - 0.5, 0, 2), 0.68, 1.05)[:, None] * (0.97, 0.985, 1.0)
    return np.asarray(out + share * (white - out))


def painted(color: np.ndarray, kind: np.ndarray, point: np.ndarray, away: np.ndarray) -> np.ndarray:
    """(n, 3) colours of surfaces with their pattern."""
    x, y, z = point.T
    tone = np.ones(len(x))
    lawn = kind == LAWN
    coarse, fine = taken(GRAIN, x / 40, z / 40), taken(GRAIN, x / 3.1, z / 3.1)
    tone = np.where(lawn, np.clip(1 + 0.10 * coarse + 0.16 * fine / (1 + away / 25), 0.4, 1.8), tone)
    plots = taken(PUFF, x / 1900, z / 1900)
    tone = np.where(
        kind == FIELD, np.clip(1 + 0.35 * np.sign(plots) + 0.25 * taken(GRAIN, x / 300, z / 300), 0.35, 2), tone
    )
    tone = np.where(
        kind == TILE, np.where((y / 0.23) % 1 < 0.16, 0.62, 1.0) * (1 + 0.09 * taken(GRAIN, (x + z) / 9, y / 9)), tone
    )
    along = (x + z) / 0.28 + 0.5 * (np.floor(y / 0.085) % 2)
    joint = ((y / 0.085) % 1 < 0.14) | (along % 1 < 0.05)
    tone = np.where(
        kind == BRICK,
        np.where(joint & (away < 40), 1.5, 1 + 0.12 * np.sin(91 * np.floor(along) + 57 * np.floor(y / 0.085))),
        tone,
    )
    slab = (x / 0.5 % 1 < 0.03) | (z / 0.5 % 1 < 0.03)
    tone = np.where(kind == PAVING, np.where(slab, 0.75, 1 + 0.05 * fine), tone)
    tone = np.where(kind == PLAIN, 1 + 0.035 * coarse, tone)
    return np.asarray(color * tone[:, None])


def drawn(name: str) -> np.ndarray:
    """(WIDE / 2, WIDE, 3) linear RGB of one of `VIEWS`."""
    parts, eye, azimuth = VIEWS[name]()
    scene = joined(parts)
    flat = np.cross(scene.triangles[:, 1] - scene.triangles[:, 0], scene.triangles[:, 2] - scene.triangles[:, 0])
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-12)
    tree_ = embree(scene.triangles)
    seed, high = list(VIEWS).index(name), np.radians(47)
    sun = np.array([np.cos(high) * np.cos(azimuth), np.sin(high), np.cos(high) * np.sin(azimuth)])
    rng = np.random.default_rng(seed)

    def met(origin: np.ndarray, way: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        hit = tree_.run(origin.astype(np.float32), way.astype(np.float32), output=1)
        return hit["primID"], hit["tfar"]

    def clear(origin: np.ndarray, way: np.ndarray) -> np.ndarray:
        far = np.full(len(way), 1e4, np.float32)
        return tree_.run(origin.astype(np.float32), way.astype(np.float32), dists=far, query="OCCLUDED") != 0

    def lit(way: np.ndarray) -> np.ndarray:
        face, far = met(np.broadcast_to((0.0, eye, 0.0), way.shape), way)
        there, out = np.flatnonzero(face >= 0), np.zeros((len(way), 3))
        out[face < 0] = sky(way[face < 0], sun, seed)
        way, face, far = way[there], face[there], far[there].astype(float)
        kind, normal = scene.kind[face], flat[face]
        normal = normal * -np.sign((normal * way).sum(1, keepdims=True))
        point = (0.0, eye, 0.0) + far[:, None] * way
        color = painted(scene.color[face], kind, point, far)
        leafy = (kind == LEAF)[:, None]
        start = point + 2e-3 * normal + 0.02 * far[:, None] ** 0.5 * 0.05 * normal
        facing = normal @ sun
        shaded = np.zeros(len(face))
        ask = np.flatnonzero((facing > 0) | leafy[:, 0])
        towards = sun + 0.012 * rng.normal(size=(len(ask), 3))
        begin = np.where(facing[ask, None] > 0, start[ask], point[ask] - 4e-3 * normal[ask])
        shaded[ask] = clear(begin, towards / np.linalg.norm(towards, axis=1, keepdims=True))
        through = np.array([1.15, 1.25, 0.45])  # light that comes through a leaf is yellower
        sunny = np.where(facing > 0, facing, 0)[:, None] + leafy * np.clip(-facing, 0, 1)[:, None] * 0.75 * through
        around = rng.normal(size=(len(face), 3))
        around = normal + around / np.linalg.norm(around, axis=1, keepdims=True)
        around /= np.maximum(np.linalg.norm(around, axis=1, keepdims=True), 1e-9)
        soft = 0.62 * sky(around, sun, seed, clouds=False)
        blocked = ~clear(start, around)
        soft[blocked] = (0.2 + 1.2 * scene.color[face[blocked]]) * 0.62
        result = color * (shaded[:, None] * sunny * SUNNY + soft)
        shiny = np.flatnonzero((kind == GLASS) | (kind == WATER))
        if len(shiny):
            upright = kind[shiny] == GLASS
            wave = normal[shiny] + np.where(upright, 0.0, 0.004)[:, None] * rng.normal(size=(len(shiny), 3))
            back = way[shiny] - 2 * (way[shiny] * wave).sum(1, keepdims=True) * wave
            back[:, 1] = np.where(upright, back[:, 1], np.abs(back[:, 1]))
            seen, _ = met(start[shiny], back)
            bright = sky(back, sun, seed)
            bright[seen >= 0] = 0.75 * scene.color[seen[seen >= 0]]
            share = 0.05 + 0.95 * (1 - np.clip(-(way[shiny] * normal[shiny]).sum(1), 0, 1)) ** 5
            result[shiny] += np.where(upright, np.maximum(share, 0.28), share)[:, None] * bright
        gloss = leafy * 0.035 * shaded[:, None]
        result += gloss
        hazy = 1 - np.exp(-far / FAR)[:, None]
        out[there] = result + hazy * (HAZE - result)
        return out

    height = WIDE // 2
    top, bottom = (round((90 - each) / 180 * height) for each in BAND)
    rows, _ = np.mgrid[0:height, 0:WIDE]
    total = np.zeros((height * WIDE, 3))
    ends = np.flatnonzero((rows.ravel() < top) | (rows.ravel() >= bottom))
    middle = np.flatnonzero((rows.ravel() >= top) & (rows.ravel() < bottom))
    for pixels, often in ((ends, 1), (middle, RAYS)):
        for ray in range(often):
            shift = (np.array([0.7548776662, 0.5698402910]) * (ray + 1)) % 1
            for start in range(0, len(pixels), 60_000):
                here = pixels[start : start + 60_000]
                up = np.pi * (0.5 - (here // WIDE + shift[0]) / height)
                turn = 2 * np.pi * ((here % WIDE + shift[1]) / WIDE - 0.5)
                way = np.stack([np.cos(up) * np.sin(turn), np.sin(up), np.cos(up) * np.cos(turn)], 1)
                total[here] += np.clip(lit(way), 0, 4) / often
    return total.reshape(height, WIDE, 3)


def developed(light: np.ndarray) -> np.ndarray:
    """Linear RGB in [0, 1] of radiance (h, w, 3): bright, what lies about the horizon, too, a little paler, what is
    brighter rolled off, shadows opened a little."""
    level = (light @ (0.2126, 0.7152, 0.0722))[..., None]
    bright = max(1.12, ABOUT / np.median(level[2 * len(level) // 5 : 3 * len(level) // 5]))
    light, level = bright * light, bright * level
    opened = (light + PALER * (level - light)) * np.maximum(level, 1e-4) ** -0.10
    return np.where(opened < 0.55, opened, 0.55 + 0.45 * (1 - np.exp(-(opened - 0.55) / 0.45)))


def softened(pixels: np.ndarray) -> Image.Image:
    """The image of (h, w, 3) uint8 pixels, out of focus by `SOFT`, also over its seam."""
    beyond = round(4 * SOFT)
    wide = Image.fromarray(np.pad(pixels, ((0, 0), (beyond, beyond), (0, 0)), mode="wrap"))
    return wide.filter(ImageFilter.GaussianBlur(SOFT)).crop((beyond, 0, beyond + pixels.shape[1], len(pixels)))


def main() -> None:
    """Draw those that are named, or all."""
    FOLDER.mkdir(exist_ok=True)
    for name in sys.argv[1:] or VIEWS:
        pixels = (np.clip(from_linear(developed(drawn(name))), 0, 1) * 255 + 0.5).astype(np.uint8)
        out = io.BytesIO()
        softened(pixels).save(out, "JPEG", quality=QUALITY, optimize=True)
        (FOLDER / f"{name}.jpg").write_bytes(out.getvalue())


if __name__ == "__main__":
    main()
