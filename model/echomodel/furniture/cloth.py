"""What is filled or hangs in folds: pillows, covers of beds."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from echomodel.furniture.solids import FINEST, IDENTITY, Array, Ball, Block, Solid, Vector, loft

PINCH = 0.09  # of half a pillow's side that its middle stands back behind the corners
SEAM = 0.04  # of half a pillow's thickness that is left at its seams


@dataclass(frozen=True, eq=False)
class Pillow(Ball):
    """Two cloths sewn together at four sides and filled, the fuller the more `power`: corners stand out, sides draw
    in; thin on its least axis.
    """

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        count = (4, 6, 8, 12)[detail]
        line = np.sin(np.linspace(-1, 1, count + 1) * np.pi / 2)
        u, v = np.meshgrid(line, line, indexing="ij")
        wrinkles = 0.07 * np.cos(9 * np.arctan2(v, u)) * (u**2 + v**2)
        full = ((1 - u**2) * (1 - v**2)) ** (1.04 / self.power) * (1 - wrinkles)
        thin = int(np.argmin(self.half))
        rings = []
        # a ring is one loop around the pillow at one u: over its front, back behind
        for i in range(count + 1):
            there, back = slice(None), slice(-2, 0, -1)
            flat = np.concatenate([v[i, there], v[i, back]])
            side = np.concatenate([full[i, there] + SEAM, -full[i, back] - SEAM])
            ring = np.empty((len(flat), 3))
            ring[:, thin] = side / (1 + SEAM)
            ring[:, (thin + 1) % 3] = u[i, 0] * (1 - PINCH * (1 - flat**2))
            ring[:, (thin + 2) % 3] = flat * (1 - PINCH * (1 - u[i, 0] ** 2))
            rings.append(ring * self.half)
        vertices, faces = loft(rings)
        return vertices, _outward(vertices, faces)


def pillow(centre: Vector, half: Vector, material: str, role: str = "", turn: Array = IDENTITY) -> Pillow:
    """A pillow about `centre` (3,) with half axes `half` (3,), metres."""
    return Pillow(np.array(centre, float), turn, material, role, half=np.array(half, float), power=4.0)


def seam(wide: float, tall: float) -> Array:
    """(k, 3): a line around the seam of a pillow that is thin on z, of half sides in metres."""
    t = np.linspace(-1, 1, 9)[:-1]
    u, v = (
        np.concatenate([t, np.ones(8), -t, -np.ones(8), t[:1]]),
        np.concatenate([-np.ones(8), t, np.ones(8), -t, -np.ones(1)]),
    )
    return np.stack([wide * u * (1 - PINCH * (1 - v**2)), tall * v * (1 - PINCH * (1 - u**2)), 0 * u], 1)


def folds(x: Array, z: Array, phase: Array) -> Array:
    """How far cloth that was thrown over a bed lies below its highest folds, 0 to 1, at places in metres.

    `phase`: (3,) radians, which one cloth has of its own.
    """
    bent = z + 0.12 * np.sin(2.3 * x + phase[2]) + 0.25 * x
    crease = 1 - np.abs(np.sin(7.4 * bent + phase[0])) ** 0.7
    other = 1 - np.abs(np.sin(5.1 * (x - 0.5 * z) + 0.8 * np.sin(4 * z + phase[1]))) ** 0.7
    return np.clip(1 - 0.65 * crease - 0.5 * other, 0, 1)


@dataclass(frozen=True, eq=False)
class Cover(Block):
    """Cloth over a mattress: a block whose top lies in folds and whose sides hang down in waves to a hem.

    `depth`: metres from the highest folds to the lowest; `phase` as of `folds`.
    """

    depth: float = 0.03
    phase: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        w, h, d = self.half
        r, steps = min(self.radius, h, w / 2, d / 2), (6, 8, 14, 18)[detail]
        arc = np.linspace(0, np.pi / 2, 4)
        over = np.linspace(w - r, r - w, steps + 1)[1:-1]
        x = np.concatenate([[w, w], w - r + r * np.cos(arc), over, r - w - r * np.sin(arc), [-w, -w]])
        y = np.concatenate([[-h, -h / 2], h - r + r * np.sin(arc), np.full(len(over), h), h - r + r * np.cos(arc)])
        y = np.concatenate([y, [-h / 2, -h]])
        hangs = np.clip((h - y) / (2 * h), 0, 1)
        rings = []
        for z in np.linspace(-d, d, max(4, round(steps * d / w) + 1)):
            rim = r - np.sqrt(max(0.0, r**2 - max(0.0, abs(z) - d + r) ** 2))  # rounded at head and foot, too
            down = self.depth * folds(x, np.full_like(x, z), np.array(self.phase)) * (1 - hangs) ** 0.5
            wave = self.depth * hangs * (0.5 + 0.5 * np.sin(19 * z + self.phase[0] + np.sign(x) * self.phase[1]))
            hem = 0.5 * self.depth * (hangs > 0.9) * (1 + np.sin(13 * z + self.phase[2] + np.sign(x)))
            rings.append(np.stack([x - np.sign(x) * wave, y - down - rim * (hangs < 0.5) + hem, np.full_like(x, z)], 1))
        vertices, faces = loft(rings)
        return vertices, _outward(vertices, faces)


def cover(low: Vector, high: Vector, material: str, radius: float, depth: float, rng: np.random.Generator) -> Solid:
    """The cover between two corners (3,), its edges rounded by `radius`, its folds `depth` deep, metres."""
    a, b = np.asarray(low, float), np.asarray(high, float)
    first, second, third = rng.uniform(0, 2 * np.pi, 3).tolist()
    made = Cover(centre=(a + b) / 2, half=(b - a) / 2, radius=radius, depth=depth, phase=(first, second, third))
    return replace(made, material=material, role="cover")


@dataclass(frozen=True, eq=False)
class Tufted(Block):
    """A padded panel whose front (+z) is drawn in every `apart` metres, in diamonds or upright channels."""

    apart: float = 0.2
    channels: bool = False

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        w, h, d = self.half
        step = self.apart / (3, 4, 4, 4)[detail]  # so that creases run through corners
        across, up = (max(4, round(2 * side / step)) for side in (w, h))
        j, rings = np.arange(up + 1), []
        y = np.linspace(-h, h, up + 1)
        for i, x in enumerate(np.linspace(-w, w, across + 1)):
            lines = (2 * i, 2 * i) if self.channels else (i + j, i - j)
            first, second = (np.abs(np.cos(np.pi * line * step / self.apart)) for line in lines)
            edge = np.minimum(1.0, 6 * np.minimum(1 - abs(x) / w, 1 - np.abs(y) / h) + 0.1) ** 0.5
            front = d * (2 * edge * (0.45 + 0.55 * (first * second) ** 0.5) - 1)
            rings.append(np.stack([np.full(up + 3, x), [*y, h, -h], [*front, -d, -d]], 1))
        vertices, faces = loft(rings)
        return vertices, _outward(vertices, faces)


def _outward(vertices: Array, faces: Array) -> Array:
    """The faces of a closed surface, turned where its volume is negative."""
    a, b, c = vertices[faces].transpose(1, 0, 2)
    return faces if np.einsum("nx,nx->", a, np.cross(b, c)) > 0 else np.ascontiguousarray(faces[:, ::-1])
