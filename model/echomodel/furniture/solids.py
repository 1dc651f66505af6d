"""The solids that furniture is made of: each is a closed mesh and, without any mesh query, a signed distance.

A distance is asked for on the box-normalised grid, where one voxel spans a different length on each axis. With `f` the
metric distance and `n` its unit gradient, the distance in voxels is `f / |S n|`, S = diag(metres per voxel): exact for
planes and first-order exact elsewhere, which is what the few voxels inside the truncation need.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, Self

import numpy as np

from echomodel.triangles import cross

Array = np.ndarray
IDENTITY = np.eye(3)
FINEST = 3  # levels of detail that a solid can be meshed in: 0 to 3


def rotation(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Array:
    """Rotation matrix (3, 3) about x, then z, then y; radians."""
    cx, sx, cy, sy, cz, sz = np.cos(x), np.sin(x), np.cos(y), np.sin(y), np.cos(z), np.sin(z)
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return about_y @ about_z @ about_x


def upright(bottom: Array, top: Array) -> Array:
    """Rotation matrix whose y axis runs from `bottom` to `top`, with x as near to the world's x as can be."""
    y = np.asarray(top, float) - bottom
    y = y / np.linalg.norm(y)
    x = IDENTITY[0] if abs(y[0]) < 0.9 else IDENTITY[2]
    x = x - y * (x @ y)
    x = x / np.linalg.norm(x)
    return np.stack([x, y, cross(x, y)], axis=1)


@dataclass(frozen=True)
class Joint:
    """How a drawer or a door moves; solids with one joint move as one body.

    Arguments:
        body: name of the body, unique in the piece.
        kind: `prismatic` slides along the axis, `revolute` turns about it.
        axis: unit vector in the object's frame. anchor: a point of the axis of a hinge, metres.
        reach: how far it moves from closed to open, metres or radians.
    """

    body: str
    kind: Literal["prismatic", "revolute"]
    axis: tuple[float, float, float]
    anchor: tuple[float, float, float]
    reach: float


@dataclass(frozen=True, eq=False)
class Solid:
    """A closed solid placed by `centre` (3,) and `turn` (3, 3) in the object's frame.

    Arguments:
        material: names its look. role: what it is in the piece: leg, top, seat, drawer, handle ...
        joint: how it moves, None = it is fixed.
        core: fills what boards enclose, so that a coarse grid sees one body; it has distances and no mesh.
    """

    centre: Array = field(default_factory=lambda: np.zeros(3))
    turn: Array = field(default_factory=lambda: IDENTITY)
    material: str = "wood"
    role: str = ""
    joint: Joint | None = None
    core: bool = False

    def mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        """Vertices (n, 3) in the object's frame and outward faces (m, 3) of the closed surface."""
        vertices, faces = self.local_mesh(detail)
        return vertices @ self.turn.T + self.centre, faces

    def distance(self, x: Array, y: Array, z: Array, scale: Array) -> Array:
        """Signed distance in voxels at broadcastable coordinates x, y, z (metres); `scale` (3,) metres per voxel."""
        x, y, z = x - self.centre[0], y - self.centre[1], z - self.centre[2]
        if self.turn is not IDENTITY:
            t = self.turn
            x, y, z = (x * t[0, i] + y * t[1, i] + z * t[2, i] for i in range(3))
        # Columns: what one metre along a local axis is worth in voxel gradients.
        local = self.turn * np.asarray(scale)[:, None]
        return self.local_distance(x, y, z, local.T @ local)

    def mirrored(self, axis: int = 0) -> Self:
        """The solid on the other side of the plane x = 0 (axis 0) or z = 0 (axis 2); its own halves are alike."""
        sign = np.where(np.arange(3) == axis, -1.0, 1.0)
        turn = self.turn if self.turn is IDENTITY else sign[:, None] * self.turn * sign
        return replace(self, centre=self.centre * sign, turn=turn)

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        raise NotImplementedError

    def local_distance(self, x: Array, y: Array, z: Array, metric: Array) -> Array:
        """Distance in voxels at local coordinates; |S n| of a local direction n is sqrt(n^T metric n)."""
        raise NotImplementedError

    def inradius(self, scale: Array) -> float:
        """Half the smallest thickness, in voxels (a lower estimate)."""
        raise NotImplementedError


def gradient_length(metric: Array, x: Array, y: Array, z: Array) -> Array:
    """sqrt(n^T metric n) for directions n = (x, y, z)."""
    m = metric
    squared = m[0, 0] * x * x + m[1, 1] * y * y + m[2, 2] * z * z
    if abs(m[0, 1]) + abs(m[0, 2]) + abs(m[1, 2]) > 1e-12:
        squared = squared + 2 * (m[0, 1] * x * y + m[0, 2] * x * z + m[1, 2] * y * z)
    return np.sqrt(np.maximum(squared, 1e-16))


def intersection(a: Array, b: Array) -> Array:
    """Distance to what two solids that meet at right angles have in common."""
    return np.hypot(np.maximum(a, 0), np.maximum(b, 0)) + np.minimum(np.maximum(a, b), 0)


@dataclass(frozen=True, eq=False)
class Block(Solid):
    """A box with half extents `half` (3,), its edges and corners rounded by `radius`, metres."""

    half: Array = field(default_factory=lambda: np.ones(3))
    radius: float = 0.0

    def local_distance(self, x: Array, y: Array, z: Array, metric: Array) -> Array:
        r = min(self.radius, *self.half)
        q = [np.abs(c) - (h - r) for c, h in zip((x, y, z), self.half, strict=True)]
        per_axis = np.sqrt(np.diag(metric))
        inside = np.maximum(np.maximum((q[0] - r) / per_axis[0], (q[1] - r) / per_axis[1]), (q[2] - r) / per_axis[2])
        k = [np.maximum(c, 0) for c in q]
        length = np.sqrt(k[0] * k[0] + k[1] * k[1] + k[2] * k[2])
        outside = (length - r) * length / gradient_length(metric, *k)
        return np.where(length > 1e-9, outside, inside)

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        r = min(self.radius, *(self.half * 0.999))
        return self._rounded(r, min(detail, 1 if r < 0.008 else 3), 1)

    def _rounded(self, r: float, steps: int, flat: int) -> tuple[Array, Array]:
        """Its surface with, on every axis, `steps` cells for the rounding at either end and `flat` ones between."""
        if r <= 0 or not steps:
            vertices, faces = cube_surface(flat)
            return vertices * self.half, faces
        cells = 2 * steps + flat
        vertices, faces = cube_surface(cells)
        node = np.rint((vertices + 1) / 2 * cells) - steps
        corner = (np.minimum(node, 0) + np.maximum(node - flat, 0)) / steps
        corner = np.sign(corner) * np.tan(np.abs(corner) * np.pi / 4)
        length = np.linalg.norm(corner, axis=1, keepdims=True)
        core = np.clip(node, 0, flat) * 2 / flat - 1
        return core * (self.half - r) + r * corner / np.maximum(length, 1e-12), faces

    def inradius(self, scale: Array) -> float:
        local = self.turn * np.asarray(scale)[:, None]
        return float(min(self.half / np.linalg.norm(local, axis=0)))


@dataclass(frozen=True, eq=False)
class Pad(Block):
    """A filled cushion: every side stands out in its middle by `crown` metres over its edges."""

    crown: float = 0.02

    def puffed(self, points: Array) -> Array:
        """Points (n, 3) of the block, as far drawn in as its filling lets them be."""
        share = np.clip(1 - (points / self.half) ** 2, 0, 1)
        flat = share[:, [1, 2, 0]] * share[:, [2, 0, 1]]  # 1 in the middle of the sides of each axis
        return np.asarray(points * (1 - np.minimum(self.crown / self.half, 0.2) * (1 - flat)))

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        steps, flat = ((0, 1), (1, 1), (1, 3), (2, 3))[detail]
        vertices, faces = self._rounded(min(self.radius, *(self.half * 0.999)), steps, flat)
        return self.puffed(vertices), faces


@dataclass(frozen=True, eq=False)
class Bow(Block):
    """A board with round edges whose middle stands back (-z) by `bow` metres behind its ends at left and right."""

    bow: float = 0.03

    def local_distance(self, x: Array, y: Array, z: Array, metric: Array) -> Array:
        return super().local_distance(x, y, z + self.bow * (1 - np.minimum((x / self.half[0]) ** 2, 1)), metric)

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        w, h, t = self.half
        outline = superellipse(7.0, (4, 8, 12, 16)[detail]) * (t, h)
        r, turn = max(min(self.radius, w / 2, h / 2), 0.002), np.linspace(0, np.pi / 2, (2, 3, 3, 4)[detail])
        end, cut = 1 - r * (1 - np.sin(turn)) / w, 1 - r * (1 - np.cos(turn)) / h
        across = np.concatenate([-end[::-1], np.linspace(-end[0], end[0], (3, 4, 5, 7)[detail])[1:-1], end])
        tall = np.interp(np.abs(across), end, cut)
        rings = [np.stack([0 * outline[:, 0] + w * u, outline[:, 1] * high, outline[:, 0] - self.bow * (1 - u * u)], 1)
                 for u, high in zip(across, tall, strict=True)]  # fmt: skip
        return loft(rings)


@dataclass(frozen=True, eq=False)
class Turned(Solid):
    """A solid on a superellipse: `low` and `high` are the half widths (x, z) at its two ends, `height` apart along y.

    `power` 2 makes cylinders and cones, about 4 to 10 rounded corners, `inf` square legs and frusta. The centre is that
    of the bottom face; `rounding` rounds the rims, metres.
    """

    low: tuple[float, float] = (1.0, 1.0)
    high: tuple[float, float] = (1.0, 1.0)
    height: float = 1.0
    power: float = 2.0
    rounding: float = 0.0

    def local_distance(self, x: Array, y: Array, z: Array, metric: Array) -> Array:
        w = np.clip(y / self.height, 0, 1)
        a, b = (np.maximum(lo + (hi - lo) * w, 1e-4) for lo, hi in zip(self.low, self.high, strict=True))
        slope_a, slope_b = ((hi - lo) / self.height for lo, hi in zip(self.low, self.high, strict=True))
        u, v = np.abs(x) / a, np.abs(z) / b
        if np.isinf(self.power):
            first = u >= v
            q = np.maximum(u, v)
            gx, gz = np.where(first, 1 / a, 0), np.where(first, 0, 1 / b)
            gy = -np.where(first, u * slope_a / a, v * slope_b / b)
        else:
            p = self.power
            q = np.maximum((u**p + v**p) ** (1 / p), 1e-6)
            wx, wz = (u / q) ** (p - 1), (v / q) ** (p - 1)
            gx, gz = wx / a, wz / b
            gy = -(wx * u * slope_a / a + wz * v * slope_b / b)
        side = (q - 1) / gradient_length(metric, np.sign(x) * gx, gy, np.sign(z) * gz)
        along = np.sqrt(metric[1, 1])
        cap = np.maximum(y - self.height, -y) / along
        if self.rounding <= 0:
            return intersection(side, cap)
        across = np.sqrt((metric[0, 0] + metric[2, 2]) / 2)
        k = np.maximum(side * across + self.rounding, 0), np.maximum(cap * along + self.rounding, 0)
        length = np.hypot(*k)
        rim = (length - self.rounding) * length / np.sqrt((across * k[0]) ** 2 + (along * k[1]) ** 2 + 1e-16)
        return np.where((k[0] > 0) & (k[1] > 0), rim, np.maximum(side, cap))

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        low, high = np.asarray(self.low), np.asarray(self.high)
        outline = superellipse(self.power, _corners(detail, float(max(low.max(), high.max()))))
        r = min(self.rounding, self.height * 0.49, *(0.95 * np.maximum(low, high)))
        if r > 0:
            arc = np.linspace(0, np.pi / 2, 2 + detail)
            rims = [(r - r * np.sin(t), low - (r - r * np.cos(t))) for t in arc[::-1]]
            rims += [(self.height - r + r * np.sin(t), high - (r - r * np.cos(t))) for t in arc]
        else:
            rims = [(0.0, low), (self.height, high)]
        rings = [np.insert(outline * np.maximum(half, 1e-4), 1, y, axis=1) for y, half in rims]
        return loft(rings)

    def inradius(self, scale: Array) -> float:
        local = np.linalg.norm(self.turn * np.asarray(scale)[:, None], axis=0)
        thin = min(min(self.low[0], self.high[0]) / local[0], min(self.low[1], self.high[1]) / local[2])
        return float(min(thin, self.height / 2 / local[1]))


@dataclass(frozen=True, eq=False)
class Ball(Solid):
    """A superellipsoid with half axes `half` (3,); `power` 2 is an ellipsoid, 3 to 5 a cushion."""

    half: Array = field(default_factory=lambda: np.ones(3))
    power: float = 2.0

    def local_distance(self, x: Array, y: Array, z: Array, metric: Array) -> Array:
        p = self.power
        u, v, w = (np.abs(c) / h for c, h in zip((x, y, z), self.half, strict=True))
        q = np.maximum((u**p + v**p + w**p) ** (1 / p), 1e-6)
        g = (np.sign(c) * (t / q) ** (p - 1) / h for c, t, h in zip((x, y, z), (u, v, w), self.half, strict=True))
        return (q - 1) / gradient_length(metric, *g)

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        vertices, faces = cube_surface((2, 4, 6, 8)[detail] if self.half.max() > 0.04 else 2 + detail)
        vertices = np.tan(vertices * np.pi / 4)
        length = (np.abs(vertices) ** self.power).sum(1, keepdims=True) ** (1 / self.power)
        return vertices / length * self.half, faces

    def inradius(self, scale: Array) -> float:
        local = self.turn * np.asarray(scale)[:, None]
        return float(min(self.half / np.linalg.norm(local, axis=0)))


@dataclass(frozen=True, eq=False)
class Tube(Solid):
    """A round rod of `radius` along the polyline `points` (k, 3), metres."""

    points: Array = field(default_factory=lambda: np.zeros((2, 3)))
    radius: float = 0.01

    def mirrored(self, axis: int = 0) -> Self:
        return replace(super().mirrored(axis), points=self.points * np.where(np.arange(3) == axis, -1.0, 1.0))

    def local_distance(self, x: Array, y: Array, z: Array, metric: Array) -> Array:
        nearest: Array = np.array(np.inf)
        last = len(self.points) - 2
        for i in range(last + 1):
            a, d = self.points[i], self.points[i + 1] - self.points[i]
            projected = (x - a[0]) * d[0] + (y - a[1]) * d[1] + (z - a[2]) * d[2]
            t = np.clip(projected / max(d @ d, 1e-12), 0, 1)
            off = x - a[0] - t * d[0], y - a[1] - t * d[1], z - a[2] - t * d[2]
            length = np.sqrt(off[0] ** 2 + off[1] ** 2 + off[2] ** 2 + 1e-12)
            found = (length - self.radius) * length / gradient_length(metric, *off)
            voxels = gradient_length(metric, *d)  # of the step d; the ends are flat, not round
            if i == 0:
                found = np.maximum(found, -projected / voxels)
            if i == last:
                found = np.maximum(found, (projected - d @ d) / voxels)
            nearest = np.minimum(nearest, found)
        return nearest

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        tangents = np.gradient(self.points, axis=0)
        circle = superellipse(2.0, (4, 6, 8, 12)[detail]) * self.radius
        rings, x = [], None
        for point, tangent in zip(self.points, tangents, strict=True):
            y = tangent / np.linalg.norm(tangent)
            if x is None:
                x = upright(np.zeros(3), y)[:, 0]
            x = x - y * (x @ y)
            x = x / np.linalg.norm(x)
            rings.append(point + circle[:, :1] * x + circle[:, 1:] * cross(x, y))
        return loft(rings)

    def inradius(self, scale: Array) -> float:
        return float(self.radius / np.max(scale))


@dataclass(frozen=True, eq=False)
class Shell(Solid):
    """A standing wall bent round the back: half a superellipse, `half` = half width and depth behind z = 0, metres.

    It is `thickness` thick, rises from y = 0 to `back` in the middle and falls to `front` at its ends; `ease` above 1
    keeps the back high for longer.
    """

    half: tuple[float, float] = (1.0, 1.0)
    thickness: float = 0.1
    back: float = 0.8
    front: float = 0.6
    power: float = 2.5
    ease: float = 3.0

    def _top(self, angle: Array) -> Array:
        return self.back + (self.front - self.back) * np.clip(np.abs(angle) / (np.pi / 2), 0, 1) ** self.ease

    def local_distance(self, x: Array, y: Array, z: Array, metric: Array) -> Array:
        scale = np.sqrt(np.diag(metric))
        behind = np.maximum(-z, 0)
        walls = []
        for inset, sign in ((0.0, 1.0), (self.thickness, -1.0)):
            a, b, p = self.half[0] - inset, self.half[1] - inset, self.power
            u, v = np.abs(x) / a, behind / b
            q = np.maximum((u**p + v**p) ** (1 / p), 1e-6)
            gx, gz = (u / q) ** (p - 1) / a, (v / q) ** (p - 1) / b
            walls.append(sign * (q - 1) / gradient_length(metric, np.sign(x) * gx, 0 * gx, -gz))
        top = self._top(np.arctan2(x / self.half[0], behind / self.half[1]))
        upright_part = np.maximum(y - top, -y) / scale[1]
        return intersection(intersection(np.maximum(*walls), z / scale[2]), upright_part)

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        angle = np.linspace(-np.pi / 2, np.pi / 2, (9, 13, 21, 33)[detail])
        s, c = np.sin(angle), np.cos(angle)
        norm = (np.abs(s) ** self.power + np.abs(c) ** self.power) ** (1 / self.power)
        top, rings = self._top(angle), []
        outside, inside = np.array(self.half), np.array(self.half) - self.thickness
        for sine, cosine, length, high in zip(s, c, norm, top, strict=True):
            (ox, oz), (ix, iz) = (np.array([sine, -cosine]) * half / length for half in (outside, inside))
            rings.append(np.array([[ix, 0, iz], [ox, 0, oz], [ox, high, oz], [ix, high, iz]]))
        return loft(rings)

    def inradius(self, scale: Array) -> float:
        return float(self.thickness / 2 / max(scale[0], scale[2]))


def _corners(detail: int, radius: float) -> int:
    """Corners of a round outline: fewer for what is small."""
    return ((8, 12, 20, 32) if radius > 0.05 else (6, 8, 12, 16))[detail]


def superellipse(power: float, corners: int = 32) -> Array:
    """Outline (n, 2) of the unit superellipse, counted from +x towards -z so that lofts along +y face outward.

    Its points crowd where it bends: the corners of a rounded table top are round, its sides straight.
    """
    if np.isinf(power):
        return np.array([[1, -1], [-1, -1], [-1, 1], [1, 1]], float)
    angle = np.arange(corners) * (2 * np.pi / corners)
    points = np.stack([np.cos(angle), -np.sin(angle)], axis=1)
    points[np.abs(points) < 1e-12] = 0.0
    return np.sign(points) * np.abs(points) ** (2 / power)


def loft(rings: list[Array]) -> tuple[Array, Array]:
    """Closed surface through rings of equal length (k, 3): quads between neighbours, a fan over each end."""
    k, n = len(rings[0]), len(rings)
    vertices = np.concatenate([*rings, rings[0].mean(0)[None], rings[-1].mean(0)[None]])
    i = np.arange(k)
    j = (i + 1) % k
    faces = [np.stack([r * k + i, r * k + j, (r + 1) * k + j], 1) for r in range(n - 1)]
    faces += [np.stack([r * k + i, (r + 1) * k + j, (r + 1) * k + i], 1) for r in range(n - 1)]
    faces.append(np.stack([np.full(k, n * k), j, i], 1))
    faces.append(np.stack([np.full(k, n * k + 1), (n - 1) * k + i, (n - 1) * k + j], 1))
    return vertices, np.concatenate(faces)


_CUBES: dict[int, tuple[Array, Array]] = {}


def cube_surface(cells: int) -> tuple[Array, Array]:
    """Surface of the cube [-1, 1]^3 as a grid of `cells` quads an edge, vertices shared."""
    if cells not in _CUBES:
        steps = np.linspace(-1, 1, cells + 1)
        u, v = (g.ravel() for g in np.meshgrid(steps, steps, indexing="ij"))
        index = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
        a, b, c, d = index[:-1, :-1].ravel(), index[1:, :-1].ravel(), index[1:, 1:].ravel(), index[:-1, 1:].ravel()
        quads = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
        points: list[Array] = []
        faces: list[Array] = []
        for axis in range(3):
            for side in (-1.0, 1.0):
                face = np.empty((len(u), 3))
                face[:, axis], face[:, (axis + 1) % 3], face[:, (axis + 2) % 3] = side, u, v
                faces.append((quads if side > 0 else quads[:, ::-1]) + len(u) * len(points))
                points.append(face)
        vertices, inverse = np.unique(np.round(np.concatenate(points), 9), axis=0, return_inverse=True)
        _CUBES[cells] = vertices, inverse.reshape(-1)[np.concatenate(faces)]
    return _CUBES[cells]


Vector = Sequence[float] | Array  # (3,)
Wide = float | tuple[float, float]  # half widths along x and z, one number where they are equal


def ball(
    centre: Vector, half: float | Vector, material: str = "wood", role: str = "", power: float = 2.0,
    turn: Array = IDENTITY,
) -> Ball:  # fmt: skip
    """A ball or cushion about `centre` (3,) with half axes `half`, (3,) or one number."""
    axes = np.array(np.broadcast_to(half, 3), float)
    return Ball(np.array(centre, float), turn, material, role, half=axes, power=power)


def turned(centre: Vector, low: Wide, height: float, high: Wide | None = None, **form: Any) -> Turned:
    """What stands on `centre` (3,), with half widths `low` below and `high` (None = as below) above."""
    below, above = (wide if isinstance(wide, tuple) else (wide, wide) for wide in (low, low if high is None else high))
    return Turned(np.array(centre, float), low=below, high=above, height=height, **form)


def tube(points: Sequence[Vector] | Array, radius: float, material: str = "wood", role: str = "") -> Tube:
    """A round rod along a polyline (k, 3)."""
    return Tube(material=material, role=role, points=np.array(points, float), radius=radius)


def bent(centre: Vector, half: tuple[float, float], thickness: float, back: float, front: float, **form: Any) -> Shell:
    """A wall round the back of `centre` (3,), see `Shell`: the upholstered back of a seat, unless said otherwise."""
    form = {"material": "fabric", "role": "back", **form}
    return Shell(np.array(centre, float), half=half, thickness=thickness, back=back, front=front, **form)


@dataclass(frozen=True, eq=False)
class Lathe(Solid):
    """A profile turned about the y axis; `squash` is depth (z) over width (x).

    Arguments:
        profile: (k, 2) float, radius and height in metres, from below upwards on the outside. With `hollow` it closes
            on itself, as a shade's wall does; without, its two ends are joined to the axis.
    """

    profile: Array = field(default_factory=lambda: np.array([[1.0, 0.0], [1.0, 1.0]]))
    squash: float = 1.0
    hollow: bool = False

    def local_distance(self, x: Array, y: Array, z: Array, metric: Array) -> Array:
        radius = np.sqrt(x * x + (z / self.squash) ** 2) + 0 * y
        outline = self._outline()
        nearest = np.full(np.broadcast(radius, y).shape, np.inf)
        nx, ny = np.zeros(nearest.shape), np.zeros(nearest.shape)
        inside = np.zeros(nearest.shape, bool)
        for a, b in zip(outline, np.roll(outline, -1, axis=0), strict=True):
            d = b - a
            t = np.clip(((radius - a[0]) * d[0] + (y - a[1]) * d[1]) / max(d @ d, 1e-12), 0, 1)
            off_r, off_y = radius - a[0] - t * d[0], y - a[1] - t * d[1]
            length = off_r * off_r + off_y * off_y
            if a[0] > 0 or b[0] > 0:  # the axis itself is no surface
                closer = length < nearest
                nearest = np.where(closer, length, nearest)
                nx, ny = np.where(closer, off_r, nx), np.where(closer, off_y, ny)
            crosses = ((a[1] <= y) & (y < b[1])) | ((b[1] <= y) & (y < a[1]))
            if abs(d[1]) > 1e-12:
                inside ^= crosses & (radius < a[0] + (y - a[1]) / d[1] * d[0])
        length = np.sqrt(nearest)
        across = np.maximum(radius, 1e-9)
        gradient = gradient_length(metric, nx * x / across, ny, nx * z / self.squash**2 / across)
        return np.where(inside, -1.0, 1.0) * length * length / np.maximum(gradient, 1e-9)

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        largest = float(self.profile[:, 0].max())
        corners = ((8, 12, 20, 32) if largest > 0.05 else (6, 8, 10, 14))[detail]
        circle = superellipse(2.0, corners) * [1.0, self.squash]
        rings = [np.insert(circle * max(r, 1e-4), 1, y, axis=1) for r, y in self.profile]
        if not self.hollow:
            return loft(rings)
        k, n = corners, len(rings)
        i, j = np.arange(k), (np.arange(k) + 1) % k
        faces = []
        for ring in range(n):
            low, high = ring * k, (ring + 1) % n * k
            faces += [np.stack([low + i, low + j, high + j], 1), np.stack([low + i, high + j, high + i], 1)]
        return np.concatenate(rings), np.concatenate(faces)

    def inradius(self, scale: Array) -> float:
        if not self.hollow:
            return float(np.median(self.profile[:, 0]) / scale[0])
        outline = self._outline()
        after = np.roll(outline, -1, axis=0)
        area = 0.5 * abs(np.sum(outline[:, 0] * after[:, 1] - after[:, 0] * outline[:, 1]))
        length = np.linalg.norm(outline - np.roll(outline, -1, axis=0), axis=1).sum()
        return float(area / length / scale[0])

    def _outline(self) -> Array:
        if self.hollow:
            return self.profile
        first, last = self.profile[0], self.profile[-1]
        return np.concatenate([[[0.0, first[1]]], self.profile, [[0.0, last[1]]]])


def wall(profile: list[tuple[float, float]], thick: float) -> Array:
    """The closed profile of a wall: out along `profile` (radius, height) and back `thick` metres further inside."""
    outer = np.array(profile, float)
    inner = outer[::-1] * [1.0, 1.0]
    inner[:, 0] = np.maximum(inner[:, 0] - thick, 0.002)
    return np.concatenate([outer, inner])


@dataclass(frozen=True, eq=False)
class Blade(Solid):
    """A leaf from the origin along +z: pointed at both ends, folded along its middle, its tip bent down by `bend`.

    Arguments:
        length, width, thick: metres. bend: radians from root to tip. full: where along it is widest, 0 to 1.
    """

    length: float = 0.3
    width: float = 0.1
    thick: float = 0.006
    bend: float = 0.6
    full: float = 0.45

    def _spine(self, count: int) -> tuple[Array, Array, Array]:
        """Points (n, 3) along the middle, their upward normals and half widths."""
        share = np.linspace(0, 1, count)
        angle = -self.bend * share
        step = self.length / (count - 1)
        middle = (angle[1:] + angle[:-1]) / 2
        z = np.concatenate([[0], np.cumsum(np.cos(middle) * step)])
        y = np.concatenate([[0], np.cumsum(np.sin(middle) * step)])
        normal = np.stack([0 * angle, np.cos(angle), -np.sin(angle)], 1)
        warped = np.where(share < self.full, share / self.full / 2, 0.5 + (share - self.full) / (1 - self.full) / 2)
        half = self.width / 2 * np.sin(np.pi * warped) ** 0.8
        return np.stack([0 * z, y, z], 1), normal, half

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        points, normal, half = self._spine((3, 4, 5, 7)[detail])
        side = np.array([1.0, 0.0, 0.0])
        rings = []
        for point, up, reach in zip(points, normal, np.maximum(half, 0.06 * self.width), strict=True):
            out, fold, thick = reach * side, 0.25 * reach * up, self.thick / 2 * up
            rings.append(np.array([point + out + fold, point + thick, point - out + fold, point - thick]))
        return loft(rings)

    def local_distance(self, x: Array, y: Array, z: Array, metric: Array) -> Array:
        points, normal, half = self._spine(5)
        nearest: Array = np.array(np.inf)
        for k in range(len(points) - 1):
            centre, along = (points[k] + points[k + 1]) / 2, points[k + 1] - points[k]
            reach, up = float(np.linalg.norm(along)) * 0.62, (normal[k] + normal[k + 1]) / 2
            ahead = along / np.linalg.norm(along)
            wide = max(float(half[k] + half[k + 1]) * 0.6, 0.003)
            u = x - centre[0]
            v = (y - centre[1]) * up[1] + (z - centre[2]) * up[2] - 0.12 * wide
            w = (y - centre[1]) * ahead[1] + (z - centre[2]) * ahead[2]
            tall = max(self.thick, 0.004)
            q = np.sqrt((u / wide) ** 2 + (v / tall) ** 2 + (w / reach) ** 2 + 1e-12)
            gu, gv, gw = u / wide**2 / q, v / tall**2 / q, w / reach**2 / q
            found = (q - 1) / gradient_length(metric, gu, gv * up[1] + gw * ahead[1], gv * up[2] + gw * ahead[2])
            nearest = np.minimum(nearest, found)
        return nearest

    def inradius(self, scale: Array) -> float:
        return float(self.thick / 2 / np.max(scale))
