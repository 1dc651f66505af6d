"""Trees, hedges, houses and hills of what is seen through windows, grown and built of triangles by programs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

PLAIN, LEAF, GLASS, LAWN, TILE, BRICK, PAVING, WATER, FIELD = range(9)  # kinds of surface


class Parts(NamedTuple):
    """Triangles (n, 3, 3), metres, their colours (n, 3), linear, and kinds (n,)."""

    triangles: np.ndarray
    color: np.ndarray
    kind: np.ndarray

    def moved(self, x: float, z: float, turn: float = 0.0, scale: float = 1.0, y: float = 0.0) -> Parts:
        """The same turned about its upright axis, scaled, and at another place."""
        cos, sin = np.cos(turn) * scale, np.sin(turn) * scale
        matrix = np.array([[cos, 0, sin], [0, scale, 0], [-sin, 0, cos]])
        return self._replace(triangles=self.triangles @ matrix.T + (x, y, z))


def part(triangles: np.ndarray, color: object, kind: int = PLAIN) -> Parts:
    """Triangles of one kind, of one colour or of one each."""
    many = len(triangles)
    return Parts(np.asarray(triangles, float), np.array(np.broadcast_to(color, (many, 3))), np.full(many, kind))


def joined(parts: list[Parts]) -> Parts:
    """All of them as one."""
    return Parts(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def quads(corners: np.ndarray) -> np.ndarray:
    """(2n, 3, 3) triangles of four-cornered faces (n, 4, 3)."""
    return corners[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3)


def block(low: object, high: object, color: object, kind: int = PLAIN) -> Parts:
    """An upright box between two corners."""
    ends = np.array([low, high], float)
    corner = np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return part(quads(corner[faces]), color, kind)


def tube(path: np.ndarray, radius: np.ndarray, sides: int = 7) -> np.ndarray:
    """(n, 3, 3) triangles around a path (k, 3) of radii (k,)."""
    way = np.gradient(path, axis=0)
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    aside = np.cross(way, (0.31, 0.17, 0.94))
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    turn = np.arange(sides) * 2 * np.pi / sides
    ring = path[:, None] + radius[:, None, None] * (
        np.cos(turn)[:, None] * aside[:, None] + np.sin(turn)[:, None] * np.cross(way, aside)[:, None]
    )
    after = np.roll(ring, -1, 1)
    return quads(np.stack([ring[:-1], after[:-1], after[1:], ring[1:]], 2).reshape(-1, 4, 3))


def leaves(rng: np.random.Generator, at: np.ndarray, size: float, color: object, droop: float = 0.3) -> Parts:
    """A leaf, four-cornered, about each place (n, 3), each of a green of its own."""
    many = len(at)
    along = rng.normal(size=(many, 3)) - (0, droop, 0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    aside = np.cross(along, rng.normal(size=(many, 3)) * (0.5, 1, 0.5) + (0, 1.2, 0))
    aside /= np.maximum(np.linalg.norm(aside, axis=1, keepdims=True), 1e-6)
    long, wide = size * rng.uniform(0.7, 1.3, (2, many, 1)) * np.array([0.5, 0.3])[:, None, None]
    corners = np.stack([at - long * along, at + wide * aside, at + long * along, at - wide * aside], 1)
    own = np.array(color) * rng.normal(1, 0.13, (many, 1)) * rng.normal(1, 0.05, (many, 3))
    return part(quads(corners), np.clip(own, 0.003, 1).repeat(2, 0), LEAF)


BARK, GREENS = (0.10, 0.075, 0.055), ((0.070, 0.135, 0.028), (0.095, 0.165, 0.034), (0.052, 0.115, 0.030))


def tree(seed: int, tall: float = 8.0, *, bare: float = 0.25, leaf: float = 0.15, many: int = 34, birch: bool = False,
         green: object = None) -> Parts:  # fmt: skip
    """A broad-leaved tree: branches that fork four times, and leaves about their ends."""
    rng = np.random.default_rng(seed)
    wood, tips = list[np.ndarray](), list[np.ndarray]()

    def grow(start: np.ndarray, way: np.ndarray, length: float, radius: float, depth: int) -> None:
        path = [start]
        for _ in range(5):
            way = way + rng.normal(0, 0.10, 3) + (0, 0.05 if not birch or depth < 2 else -0.12, 0)
            way = way / np.linalg.norm(way)
            path.append(path[-1] + length / 5 * way)
        line = np.array(path)
        wood.append(tube(line, np.linspace(radius, 0.55 * radius, 6), 7 if depth < 2 else 4))
        if depth >= 2:
            tips.append(line[2:])
        if depth == 4:
            return
        first, forks, trunk = (bare, 9, 1) if depth == 0 else (0.3, 4, 0)
        for number in range(forks):
            share = first + (1 - first) * (number + rng.uniform(0.2, 1)) / forks
            below = min(int(share * 5), 4)
            at = line[below] + (share * 5 - below) * (line[below + 1] - line[below])
            turn, out = rng.uniform(0, 2 * np.pi), rng.uniform(0.7, 1.15) * (1.1 - 0.4 * share * trunk)
            side = np.cross(way, (np.cos(turn), 0.1, np.sin(turn)))
            side /= np.linalg.norm(side)
            longer = length * rng.uniform(0.45, 0.62) * (1.15 - 0.45 * share * trunk)
            grow(at, np.cos(out) * way + np.sin(out) * side, longer, radius * 0.5, depth + 1)

    grow(np.zeros(3), np.array([0.0, 1, 0]), 0.82 * tall, 0.022 * tall, 0)
    ends = np.concatenate(tips)
    at = ends.repeat(max(1, many // 2), 0)
    at = at + rng.normal(0, 0.035 * tall, at.shape) * (1, 0.8, 1)
    own = GREENS[seed % 3] if green is None else green
    trunk, *branches = wood
    stem = part(trunk, (0.52, 0.50, 0.47) if birch else BARK)
    return joined([stem, part(np.concatenate(branches), BARK), leaves(rng, at, 0.7 * leaf, own, 0.9 if birch else 0.3)])


def conifer(seed: int, tall: float = 11.0) -> Parts:
    """A spruce: whorls of hanging branches, shorter upwards."""
    rng = np.random.default_rng(seed)
    at, wood = (
        list[np.ndarray](),
        [tube(np.array([[0, 0, 0], [0, tall / 2, 0], [0, tall, 0]]), 0.016 * tall * np.array([1, 0.6, 0.1]))],
    )
    for height in np.arange(0.08, 0.99, 0.03) * tall:
        reach = 0.27 * (tall - height) ** 0.9 + 0.1
        for turn in rng.uniform(0, 2 * np.pi, 9):
            share = np.linspace(0.1, 1, 14)[:, None] * reach * rng.uniform(0.75, 1.1)
            line = (0, height, 0) + share * (np.cos(turn), -0.30, np.sin(turn)) + (0, 0.18, 0) * share**2 / reach
            at.append(line.repeat(5, 0) + rng.normal(0, 0.045 * reach + 0.03, (70, 3)))
    green = leaves(rng, np.concatenate(at), 0.27, (0.026, 0.060, 0.026), 0.5)
    return joined([part(np.concatenate(wood), BARK), green])


def bush(seed: int, size: tuple[float, float, float], *, many: int = 5000, leaf: float = 0.09, green: object = None,
         flowers: object = None, square: float = 2.5) -> Parts:  # fmt: skip
    """A bush or, `square`, a clipped hedge: leaves at the surface of a rounded box, and a dark core."""
    rng = np.random.default_rng(seed)
    way = rng.normal(size=(many, 3))
    way[:, 1] = np.abs(way[:, 1])
    way /= (np.abs(way) ** square).sum(1, keepdims=True) ** (1 / square)
    lump = 1 + 0.10 * np.sin(7 * way @ rng.normal(size=3) * (1 if square < 5 else 4)) + rng.normal(0, 0.05, many)
    half = np.array([size[0] / 2, size[1], size[2] / 2])
    at = way * lump[:, None] * half * rng.uniform(0.86, 1.0, (many, 1))
    out = [leaves(rng, at, leaf, GREENS[seed % 3] if green is None else green, 0.0)]
    if square > 5:
        low, high = half * (-0.8, 0, -0.8), half * (0.8, 0.86, 0.8)
        out.append(block(low, high, (0.024, 0.05, 0.014)))
    if flowers is not None:
        some = at[rng.random(many) < 0.22] * 1.05
        out.append(leaves(rng, some, 1.1 * leaf, flowers, 0.0))
    return joined(out)


def roof(wide: float, deep: float, low: float, rise: float, color: object) -> Parts:
    """A gable roof over a house about the origin, its ridge along x."""
    x, z, over = wide / 2 + 0.35, deep / 2 + 0.45, low - 0.45 * rise / (deep / 2)
    front = [(-x, over, z), (x, over, z), (x, low + rise, 0), (-x, low + rise, 0)]
    back = [(x, over, -z), (-x, over, -z), (-x, low + rise, 0), (x, low + rise, 0)]
    under = [[(a, b - 0.14, c) for a, b, c in face][::-1] for face in (front, back)]
    rim = [[front[0], front[3], under[0][0], under[0][3]], [front[1], front[2], under[0][1], under[0][2]]]
    rim = [
        [(a, b, c), (a, b - 0.18, c), (d, e - 0.18, f), (d, e, f)]
        for (a, b, c), (d, e, f) in (
            (front[0], front[1]),
            (back[0], back[1]),
            (front[0], front[3]),
            (front[1], front[2]),
            (back[0], back[3]),
            (back[1], back[2]),
        )
    ]
    return joined([part(quads(np.array([front, back])), color, TILE), part(quads(np.array(rim)), (0.5, 0.48, 0.45))])


def house(seed: int, wide: float = 9.0, deep: float = 8.0, floors: int = 2, *, wall: object = (0.6, 0.56, 0.48),
          tiles: object = (0.24, 0.10, 0.065), kind: int = PLAIN, pitched: bool = True) -> Parts:  # fmt: skip
    """A house about the origin, its door towards +z: windows with frames and sills on all sides, a roof, a chimney."""
    rng = np.random.default_rng(seed)
    tall, trim = 2.9 * floors + 0.3, (0.72, 0.71, 0.68)
    out = [block((-wide / 2, 0, -deep / 2), (wide / 2, tall, deep / 2), wall, kind)]
    out.append(
        block((-wide / 2 - 0.05, 0, -deep / 2 - 0.05), (wide / 2 + 0.05, 0.4, deep / 2 + 0.05), (0.3, 0.29, 0.28))
    )
    if pitched:
        rise = 0.42 * deep
        gable = [
            [(s * wide / 2, tall, deep / 2), (s * wide / 2, tall + rise, 0), (s * wide / 2, tall, -deep / 2)]
            for s in (-1, 1)
        ]
        out += [part(np.array(gable), wall, kind), roof(wide, deep, tall, rise, tiles)]
        out.append(
            block((0.22 * wide, tall, -1.2), (0.22 * wide + 0.7, tall + rise + 0.9, -0.5), (0.30, 0.15, 0.11), BRICK)
        )
    else:
        out.append(block((-wide / 2 - 0.2, tall, -deep / 2 - 0.2), (wide / 2 + 0.2, tall + 0.35, deep / 2 + 0.2), trim))
    broad, high = rng.uniform(1.0, 1.5), rng.uniform(1.3, 1.6)
    shutters = rng.choice([0, 0, 1]) if pitched else 0
    paint = rng.choice([[0.10, 0.16, 0.17], [0.13, 0.20, 0.13], [0.22, 0.08, 0.06], [0.30, 0.34, 0.38]])
    for side, (length, out_) in enumerate(((wide, deep / 2), (deep, wide / 2), (wide, deep / 2), (deep, wide / 2))):
        columns = max(2, round(length / 2.9))
        for floor in range(floors):
            for column in range(columns):
                x, y = (column + 0.5) / columns * length - length / 2, 2.9 * floor + 1.15
                pane = [
                    block(
                        (x - broad / 2, y, out_ - 0.1),
                        (x + broad / 2, y + high, out_ + 0.012),
                        (0.03, 0.035, 0.04),
                        GLASS,
                    )
                ]
                if floor == 0 and side == 0 and column == columns // 2:
                    pane = [
                        block((x - 0.55, 0.15, out_), (x + 0.55, 2.3, out_ + 0.06), paint),
                        block((x - 1.1, 2.55, out_), (x + 1.1, 2.68, out_ + 1.1), trim),
                        block((x - 0.9, 0, out_), (x + 0.9, 0.15, out_ + 1.0), (0.4, 0.39, 0.37)),
                    ]
                else:
                    f = 0.07
                    for low, high_ in (
                        ((x - broad / 2 - f, y - f), (x + broad / 2 + f, y)),
                        ((x - broad / 2 - f, y + high), (x + broad / 2 + f, y + high + f)),
                        ((x - broad / 2 - f, y), (x - broad / 2, y + high)),
                        ((x + broad / 2, y), (x + broad / 2 + f, y + high)),
                        ((x - 0.03, y), (x + 0.03, y + high)),
                        ((x - broad / 2, y + 0.62 * high), (x + broad / 2, y + 0.62 * high + 0.05)),
                    ):
                        pane.append(block((*low, out_ - 0.02), (*high_, out_ + 0.05), trim))
                    pane.append(
                        block(
                            (x - broad / 2 - 0.12, y - 0.12, out_), (x + broad / 2 + 0.12, y - 0.06, out_ + 0.14), trim
                        )
                    )
                    if shutters:
                        for s in (-1, 1):
                            edge = sorted((x + s * (broad / 2 + 0.08), x + s * (broad / 2 + 0.58)))
                            pane.append(
                                block((edge[0], y - 0.05, out_), (edge[1], y + high + 0.05, out_ + 0.05), paint)
                            )
                out += [each.moved(0, 0, side * np.pi / 2) for each in pane]
    return joined(out)


def fence(length: float, color: object = (0.62, 0.61, 0.58), tall: float = 1.1) -> Parts:
    """Pales along x on two rails."""
    out = [
        block((x, 0, -0.012), (x + 0.09, tall + 0.05 * (n % 2), 0.012), color)
        for n, x in enumerate(np.arange(-length / 2, length / 2, 0.14))
    ]
    out += [block((-length / 2, y, -0.05), (length / 2, y + 0.08, -0.012), color) for y in (0.25, 0.8 * tall)]
    return joined(out)


def ground(
    color: object, kind: int = LAWN, low: object = (-5000, -5000), high: object = (5000, 5000), y: float = 0.0
) -> Parts:
    """A level piece of ground."""
    (x0, z0), (x1, z1) = low, high  # type: ignore[misc]
    return part(quads(np.array([[(x0, y, z0), (x0, y, z1), (x1, y, z1), (x1, y, z0)]])), color, kind)


def hills(seed: int, near: float, far: float, tall: float, colors: object, kind: int = FIELD) -> Parts:
    """Rolling land in a ring about the origin."""
    rng = np.random.default_rng(seed)
    turn, away = np.linspace(0, 2 * np.pi, 361), np.geomspace(near, far, 40)
    wave = rng.normal(size=(9, 3)) / (1 + np.arange(9)[:, None]) ** 0.8
    height = sum(
        a * np.sin((n + 2) * turn[:, None] + 6 * b + 2.5 * c * np.log(away)) for n, (a, b, c) in enumerate(wave)
    )
    height = tall * (away - near) / (far - near) * (1 + 0.32 * np.asarray(height))
    point = np.stack([away * np.cos(turn)[:, None], height - 2, away * np.sin(turn)[:, None]], -1)
    face = np.stack([point[:-1, :-1], point[:-1, 1:], point[1:, 1:], point[1:, :-1]], 2).reshape(-1, 4, 3)
    return part(quads(face), colors, kind)


def scattered(
    rng: np.random.Generator, kinds: list[Parts], many: int, near: float, far: float,
    scale: tuple[float, float] = (0.8, 1.25), y: float = 0.0,
) -> list[Parts]:  # fmt: skip
    """Some of these at so many places in a ring."""
    out = []
    for number in range(many):
        turn, away = rng.uniform(0, 2 * np.pi), np.sqrt(rng.uniform(near**2, far**2))
        at, own, size = (away * np.cos(turn), away * np.sin(turn)), rng.uniform(0, 6.3), rng.uniform(*scale)
        out.append(kinds[number % len(kinds)].moved(*at, own, size, y))
    return out


def distant(seed: int, near: float, far: float, many: int = 260) -> list[Parts]:
    """A belt of trees far away, of few large leaves."""
    rng = np.random.default_rng(seed)
    kinds = [bush(seed + n, (7.5, 10.0, 7.5), many=900, leaf=1.0, square=2.0) for n in range(3)]
    return scattered(rng, kinds, many, near, far, (0.7, 1.3))
