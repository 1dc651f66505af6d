"""What hangs in folds or gives way as a whole: pillows, covers of beds, sheets."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from echomodel.furniture.carpentry import between
from echomodel.furniture.solids import FINEST, IDENTITY, Array, Ball, Block, Solid, Vector, loft

# Of half a pillow's side that its middle stands back behind the corners, and the share of that below, where it lies.
PINCH, BELOW = 0.08, 0.2
# Of a slumped cushion's height: below the first it does not lean, about as much as the last of its foot is flat. By how
# much it is wider there.
FOOT, SPREAD, FLAT = 0.15, 0.5, 0.1
HEAD = 0.38  # of half a pillow's thickness that a head has left in its middle
SEAM = 0.025  # of half a pillow's thickness that is left at its seams
DROOP = 0.25  # of half a pillow's thickness that its corners hang down
SUNK = 0.0115  # metres below its highest folds at most that things lie on a cover: half of it is about as high
SHEET = 0.02  # metres of its folds below which a cover is a sheet
LOOSE, ROLLED = 0.055, 0.02  # metres that what hangs of a cover is in waves at most, and that its hem turns under


@dataclass(frozen=True, eq=False)
class Pillow(Ball):
    """Two cloths sewn together at four sides and filled, the fuller the more `power`: corners stand out, sides draw
    in and pucker; thin on its least axis. Power 2 is about an ellipse from seam to seam, 5 a board. Its filling has
    settled by where it lies, so that no two are alike, and its corners droop.
    """

    soft = draped = True

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        count = (4, 8, 10, 10 if self.role == "pillow" else 14)[detail]
        phase = 7.0 * float(self.centre @ (1.0, 0.3, 1.7)) + 1.0
        line = np.sin(np.linspace(-1, 1, count + 1) * np.pi / 2)
        u, v = np.meshgrid(line, line, indexing="ij")
        dent = 0.12 * np.sin(2.2 * u + phase) * np.cos(1.8 * v + 1.6 * phase)
        pulled = 0.15 * np.cos(9 * np.arctan2(v, u) + 0.4 * np.sin(phase)) * np.abs(u * v) ** 0.7
        seams = 0.12 * (np.sin(7 * v + phase) * u**6 + np.sin(6 * u + 2 * phase) * v**6)
        settled = np.where(v < 0, v**4, v**2)  # its filling, below
        full = ((1 - u**2) * (1 - settled)) ** (1.04 / self.power) * (1 + dent + pulled + seams)
        thin = int(np.argmin(self.half))
        # a ring is one loop around the pillow at one u: over its front, back behind
        u, flat = u[:, :1], np.concatenate([v, v[:, -2:0:-1]], 1)
        slept = HEAD * (self.role == "pillow") * np.exp(-((v / 0.4) ** 2) - ((u - 0.1) / 0.5) ** 2)
        side = np.concatenate([full * (1 - slept) + SEAM, -full[:, -2:0:-1] - SEAM], 1) - DROOP * (u * flat) ** 2
        side = side / max(1, np.abs(side).max())
        vertices, faces = loft(np.roll(np.stack([side, *outline(u, flat)], -1), thin, -1) * self.half)
        return vertices, outward(vertices, faces)


def outline(u: Array, v: Array) -> tuple[Array, Array]:
    """Places on a pillow, -1 to 1, as its seams draw them in."""
    return u * (1 - PINCH * (1 - v**2)), v * (1 - PINCH * (1 - u**2) * np.where(v < 0, BELOW, 1))


def pillow(centre: Vector, half: Vector, material: str, role: str = "", turn: Array = IDENTITY) -> Pillow:
    """A pillow about `centre` (3,) with half axes `half` (3,), metres."""
    return Pillow(np.array(centre, float), turn, material, role, half=np.array(half, float), power=4.0)


@dataclass(frozen=True, eq=False)
class Slumped(Solid):
    """Another solid that leans back (-z) above its foot, which is spread and flat: `lean` metres at the height `tall`;
    there it sinks `aside`, too, and its corner on that side comes down as far. Its sides are bent forward, by `bend`
    metres a metre from its middle, squared."""

    soft = draped = True

    of: Solid = field(default_factory=Solid)
    tall: float = 1.0
    lean: float = 0.0
    aside: float = 0.0
    bend: float = 0.0

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        vertices, faces = self.of.mesh(detail)
        x, y, z = vertices.T
        high = (np.hypot(np.clip(y / self.tall, 0, 1), FLAT) - FLAT) / (np.hypot(1, FLAT) - FLAT)
        back = self.lean * (np.clip(high - FOOT, 0, 1) / (1 - FOOT) - 0.5) - self.bend * x * x
        down = np.abs(self.aside) * high**2 * (0.5 + np.sign(self.aside) * x / self.tall)
        return np.stack(
            [x + self.aside * (high**2 - 0.5), self.tall * high - down, z * (1 + SPREAD * (1 - high) ** 2) - back], 1
        ), faces


def seam(half: Vector) -> Array:
    """(k, 3): a line around the seam of a pillow of `half` sides, thin on z, metres."""
    t, one = np.sin(np.linspace(-1, 1, 15) * np.pi / 2)[:-1], np.ones(14)  # as of its finest mesh
    u, v = np.concatenate([t, one, -t, -one, t[:1]]), np.concatenate([-one, t, one, -t, -one[:1]])
    return np.stack([*outline(u, v), -DROOP * (u * v) ** 2], 1) * half


@dataclass(frozen=True, eq=False)
class Cover(Block):
    """Filled cloth over a mattress: its top lies in broad folds that run from head to foot, along columns of its mesh;
    sides, and the foot (+z) where it `falls`, bend down over `radius` and hang in folds to an uneven hem; at its head
    it ends in a roll that is not straight.

    `depth`: metres from the highest folds to the lowest; `phase`: (3,) radians, which one cloth has of its own.
    """

    soft = draped = True
    depth: float = 0.03
    phase: Vector = (0.0, 0.0, 0.0)
    falls: bool = False

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        w, h, d = self.half
        r, (one, two, three) = min(self.radius, h, w / 2, d / 2), self.phase
        steps = (5, 9, 18, 27)[detail if self.depth > SHEET else min(detail, 1)]
        bend = r * np.pi / 2  # metres of cloth around an edge
        roll, hang = np.linspace(0, bend, 4), bend + np.array([0.35, 0.8, 0.95, 1.0]) * max(2 * h - r, 1e-3)
        side, over = np.concatenate([roll, hang]), np.linspace(r - w, w - r, steps + 1)[1:-1]
        across = np.concatenate([r - w - side[::-1], over, w - r + side])
        flat = np.linspace(r - d, d - r, max(2, round(0.6 * steps * d / w)) + 1)[1:-1]
        along = np.concatenate([r - d - roll[::-1], flat, d - r + (side if self.falls else roll)])
        _, t = np.meshgrid(across, along)
        (x, z), out, far, length = beyond((across, along), np.array([w - r, d - r]))
        turn, hung = np.minimum(far / max(r, 1e-9), np.pi / 2), np.clip((far - bend) / (hang[-1] - bend), 0, 1)
        line = z * out[0] ** 2 + x * out[1] ** 2 + 0.1 * out[0] * out[1]  # metres around the hem
        # how far cloth lies below its highest folds, which fade and swell along their way and are few at the head
        crease = np.abs(np.sin(7 * x + np.sin(4.1 * x + two) + one)) ** 4
        swell = np.clip(0.6 + 0.8 * np.sin(3.1 * z + 4.7 * x + three), 0, 1) * np.clip(1.8 * (t + d) - 0.8, 0.1, 1)
        low = 0.78 * crease * swell + 0.15 * np.sin(4.3 * z - 2.6 * x + one) ** 2
        wave = 1 - np.abs(np.sin(8.5 * line + one + 1.2 * np.sin(3.1 * line + two) + out[0])) ** 0.7
        wave = np.maximum(wave, 0.8 * crease * out[1] ** 2) * (0.75 + 0.25 * np.sin(2.3 * line + three))
        loose = min(self.depth, LOOSE)
        reach = (r * np.sin(turn) - loose * wave * np.sqrt(hung) - ROLLED * hung**12) * (
            1 + hung * (length / np.maximum(far, 1e-9) - 1)
        )
        y = h - r * (1 - np.cos(turn)) - hung * (2 * h - r) - self.depth * low * np.cos(turn)
        y += hung * loose * (0.5 + 0.15 * np.sin(7 * line + three))
        slack = loose * (0.5 + 0.5 * np.sin(6 * x + two)) * np.clip(1 - (t + d) / 0.25, 0, 1)
        aside = (1 - (x / (w - r)) ** 2) * (0.1 * np.sin(2.3 * z + two) + 0.3 * np.sin(three) * z)
        top = np.stack([x + out[0] * reach + aside, y, z + out[1] * reach + slack], -1)
        return closed(top, *grid(*x.shape), (0.0, -h, 0.0))


@dataclass(frozen=True, eq=False)
class Sheet(Solid):
    """Cloth: `front` and `back` (n, m, 3) float are its two sides, point for point, metres."""

    soft = draped = True
    front: Array = field(default_factory=lambda: np.zeros((2, 2, 3)))
    back: Array = field(default_factory=lambda: np.zeros((2, 2, 3)))

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        faces, border = grid(*self.front.shape[:2])
        far, after = self.front.size // 3, np.roll(border, -1)
        strip = np.stack([after, border, border + far, after, border + far, after + far], 1).reshape(-1, 3)
        vertices = np.concatenate([self.front.reshape(-1, 3), self.back.reshape(-1, 3)])
        return vertices, outward(vertices, np.concatenate([faces, faces[:, ::-1] + far, strip]))


def beyond(lines: Sequence[Array], flat: Array) -> tuple[Array, Array, Array, Array]:
    """Where places of two `lines` on a cloth leave what is `flat` (2,) to either side of its middle, (2, m, n), which
    way they lie from there, and how far (m, n): along the line that is farther out, and straight.
    """
    places = np.stack(np.meshgrid(*lines))
    edge = np.clip(places, -flat[:, None, None], flat[:, None, None])
    length = np.maximum(np.linalg.norm(places - edge, axis=0), 1e-9)
    return edge, (places - edge) / length, np.abs(places - edge).max(0), length


def grid(n: int, m: int) -> tuple[Array, Array]:
    """Triangles (f, 3) of a grid of n times m points, and the numbers of those at its border as it runs around them."""
    at = np.arange(n * m).reshape(n, m)
    a, b, c, d = (corner.ravel() for corner in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]))
    border = np.concatenate([at[0, :-1], at[:-1, -1], at[-1, :0:-1], at[:0:-1, 0]])
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]), border


def cover(
    low: Vector, high: Vector, material: str, radius: float, depth: float, rng: np.random.Generator, *,
    falls: bool = False,
) -> Solid:  # fmt: skip
    """The cover between two corners (3,), its edges rounded by `radius`, its folds `depth` deep, metres."""
    form: dict[str, Any] = {"radius": radius, "depth": depth, "phase": rng.uniform(0, 2 * np.pi, 3), "falls": falls}
    form |= {"gives": (min(0.25 * depth, SUNK), 1.0), "material": material, "role": "cover"}
    return between(Cover, low, high, **form)


def closed(points: Array, faces: Array, border: Array, end: Vector) -> tuple[Array, Array]:
    """The closed surface of a `grid` of points (n, m, 3) whose border is joined to a point."""
    vertices = np.concatenate([points.reshape(-1, 3), [end]])
    fan = np.stack([np.roll(border, -1), border, np.full(len(border), len(vertices) - 1)], 1)
    return vertices, outward(vertices, np.concatenate([faces, fan]))


def outward(vertices: Array, faces: Array) -> Array:
    """The faces of a closed surface, turned where its volume is negative."""
    a, b, c = vertices[faces].transpose(1, 0, 2)
    return faces if np.einsum("nx,nx->", a, np.cross(b, c)) > 0 else np.ascontiguousarray(faces[:, ::-1])
