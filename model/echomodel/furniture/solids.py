"""The solids that furniture is made of: each is a closed mesh, and a signed distance (`distances.py`); all as one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache
from math import sqrt
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

import numpy as np

from echomodel.triangles import cross

if TYPE_CHECKING:
    import trimesh

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
        gives: metres, and the most as a share of its height, that its top is less full under what lies on it.
        soft: it is filled or hangs. draped: it lies in folds, which shade as one surface.
    """

    soft: ClassVar[bool] = False
    draped: ClassVar[bool] = False
    centre: Array = field(default_factory=lambda: np.zeros(3))
    turn: Array = field(default_factory=lambda: IDENTITY)
    material: str = "wood"
    role: str = ""
    joint: Joint | None = None
    core: bool = False
    gives: tuple[float, float] = (0.015, 0.1)

    def mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        """Vertices (n, 3) in the object's frame and outward faces (m, 3) of the closed surface."""
        vertices, faces = self.local_mesh(detail)
        return vertices @ self.turn.T + self.centre, faces

    def mirrored(self, axis: int = 0) -> Self:
        """The solid on the other side of the plane x = 0 (axis 0) or z = 0 (axis 2); its own halves are alike."""
        sign = np.where(np.arange(3) == axis, -1.0, 1.0)
        turn = self.turn if self.turn is IDENTITY else sign[:, None] * self.turn * sign
        return replace(self, centre=self.centre * sign, turn=turn)

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        raise NotImplementedError

    def runs(self, vertices: Array) -> list[Array]:
        """Its vertices (n, 3) by the parts of it that are about convex."""
        return [vertices]


@dataclass(frozen=True, eq=False)
class Block(Solid):
    """A box with half extents `half` (3,), its edges and corners rounded by `radius`, metres."""

    half: Array = field(default_factory=lambda: np.ones(3))
    radius: float = 0.0

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        r = min(self.radius, *(self.half * 0.999))
        steps = min(detail, 1 if r < 0.03 else 3)
        cells = 2 * steps + 1  # on every axis: those of the rounding at either end, and one between
        vertices, faces = cube_surface(1 if r <= 0 else cells)
        if r <= 0 or not steps:
            return vertices * self.half, faces
        node = np.rint((vertices + 1) / 2 * cells) - steps
        corner = (np.minimum(node, 0) + np.maximum(node - 1, 0)) / steps
        corner = np.sign(corner) * np.tan(np.abs(corner) * np.pi / 4)
        length = np.linalg.norm(corner, axis=1, keepdims=True)
        return (np.clip(node, 0, 1) * 2 - 1) * (self.half - r) + r * corner / np.maximum(length, 1e-12), faces


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
        levels, halves = zip(*rims, strict=True)
        return loft(at_levels(outline * np.maximum(halves, 1e-4)[:, None], np.array(levels)))


@dataclass(frozen=True, eq=False)
class Ball(Solid):
    """A superellipsoid with half axes `half` (3,); `power` 2 is an ellipsoid, 3 to 5 a cushion."""

    half: Array = field(default_factory=lambda: np.ones(3))
    power: float = 2.0

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        vertices, faces = cube_surface(max(2, _corners(detail, float(self.half.max())) // 4))
        vertices = np.tan(vertices * np.pi / 4)
        length = (np.abs(vertices) ** self.power).sum(1, keepdims=True) ** (1 / self.power)
        return vertices / length * self.half, faces


@dataclass(frozen=True, eq=False)
class Tube(Solid):
    """A round rod of `radius` along the polyline `points` (k, 3), metres."""

    points: Array = field(default_factory=lambda: np.zeros((2, 3)))
    radius: float = 0.01

    def mirrored(self, axis: int = 0) -> Self:
        return replace(super().mirrored(axis), points=self.points * np.where(np.arange(3) == axis, -1.0, 1.0))

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        p = self.points
        tangents = np.concatenate([p[1:2] - p[:1], (p[2:] - p[:-2]) / 2, p[-1:] - p[-2:-1]])
        circle = superellipse(2.0, 4 if self.radius < 0.006 else (4, 6, 8, 12)[detail]) * self.radius
        ways = [tangent / sqrt(tangent.dot(tangent)) for tangent in tangents]
        aside = [upright(np.zeros(3), ways[0])[:, 0]]
        for way in ways:  # each turned as little as can be from the one before
            x = aside[-1] - way * (aside[-1] @ way)
            aside.append(x / sqrt(x.dot(x)))
        x, y = np.array(aside[1:]), np.array(ways)
        return loft(p[:, None] + circle[:, :1] * x[:, None] + circle[:, 1:] * cross(x, y)[:, None])


def _corners(detail: int, radius: float) -> int:
    """Corners of a round outline: fewer for what is small, more for what would show them, as a bed's arched head."""
    return ((8, 16, 28, 48) if radius > 0.3 else (8, 12, 20, 32) if radius > 0.05 else (6, 8, 12, 16))[detail]


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


def at_levels(outlines: Array, levels: Array) -> Array:
    """Rings (n, k, 3) of outlines (n, k, 2) in plan, each at a height of its own (n,)."""
    return np.stack([outlines[..., 0], levels[:, None] + 0 * outlines[..., 0], outlines[..., 1]], -1)


def loft(rings: Sequence[Array] | Array) -> tuple[Array, Array]:
    """Closed surface through rings of equal length (k, 3): quads between neighbours, a fan over each end."""
    vertices = np.concatenate([*rings, rings[0].mean(0)[None], rings[-1].mean(0)[None]])
    return vertices, _lofted(len(rings), len(rings[0]))


@lru_cache(maxsize=256)
def _lofted(n: int, k: int) -> Array:
    """Faces (f, 3) of the surface through n rings of k corners, and the middles of both ends."""
    i = np.arange(k)
    j = (i + 1) % k
    faces = [np.stack([r * k + i, r * k + j, (r + 1) * k + j], 1) for r in range(n - 1)]
    faces += [np.stack([r * k + i, (r + 1) * k + j, (r + 1) * k + i], 1) for r in range(n - 1)]
    faces.append(np.stack([np.full(k, n * k), j, i], 1))
    faces.append(np.stack([np.full(k, n * k + 1), (n - 1) * k + i, (n - 1) * k + j], 1))
    return np.concatenate(faces)


@cache
def cube_surface(cells: int) -> tuple[Array, Array]:
    """Surface of the cube [-1, 1]^3 as a grid of `cells` quads an edge, vertices shared."""
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
    return vertices, inverse.reshape(-1)[np.concatenate(faces)]


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

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        corners = _corners(detail, float(self.profile[:, 0].max()))
        circle = superellipse(2.0, corners) * [1.0, self.squash]
        rings = at_levels(circle * np.maximum(self.profile[:, :1, None], 1e-4), self.profile[:, 1])
        if not self.hollow:
            return loft(rings)
        k, n = corners, len(rings)
        i, j = np.arange(k), (np.arange(k) + 1) % k
        faces = []
        for ring in range(n):
            low, high = ring * k, (ring + 1) % n * k
            faces += [np.stack([low + i, low + j, high + j], 1), np.stack([low + i, high + j, high + i], 1)]
        return rings.reshape(-1, 3), np.concatenate(faces)

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
class MeshedSolid:
    """One solid as a closed mesh in its place: vertices (n, 3) in metres, faces (m, 3), and its joint there."""

    solid: Solid
    vertices: np.ndarray
    faces: np.ndarray
    joint: Joint | None


def pieces_of(
    solids: Sequence[Solid], size: np.ndarray | None = None, detail: int | Array = FINEST, *, round: bool = False
) -> list[MeshedSolid]:
    """Every solid meshed, all of them stretched together to fill `size`, standing on y = 0, centred in x and z.

    Arguments:
        solids: parts in the object's frame, metres.
        size: (3,) float, the box to fill, metres; None keeps the parts' own extents.
        round: fill it in width or in depth, so that what is round stays round.
        detail: 0 (boxes and hexagons) to 3, of all or of each that is seen.
    """
    seen = [solid for solid in solids if not solid.core]
    meshes = [solid.mesh(fine) for solid, fine in zip(seen, np.broadcast_to(detail, len(seen)).tolist(), strict=True)]
    lower = np.min([vertices.min(0) for vertices, _ in meshes], axis=0)
    upper = np.max([vertices.max(0) for vertices, _ in meshes], axis=0)
    stretch = np.ones(3) if size is None else np.asarray(size, float) / np.maximum(upper - lower, 1e-9)
    if round:
        stretch[[0, 2]] = stretch[[0, 2]].min()
    origin = np.array([(lower[0] + upper[0]) / 2, lower[1], (lower[2] + upper[2]) / 2])
    return [
        MeshedSolid(solid, (vertices - origin) * stretch, faces, _stretched(solid.joint, origin, stretch))
        for solid, (vertices, faces) in zip(seen, meshes, strict=True)
    ]


def _stretched(joint: Joint | None, origin: np.ndarray, stretch: np.ndarray) -> Joint | None:
    if joint is None:
        return None
    anchor = (np.asarray(joint.anchor) - origin) * stretch
    longer = float(np.linalg.norm(np.asarray(joint.axis) * stretch)) if joint.kind == "prismatic" else 1.0
    x, y, z = (float(v) for v in anchor)
    return replace(joint, anchor=(x, y, z), reach=joint.reach * longer)


def mesh_of(solids: Sequence[Solid], size: np.ndarray | None = None, *, round: bool = False) -> trimesh.Trimesh:
    """All solids as one mesh of closed parts that overlap as boards and cushions do; arguments as for `pieces_of`."""
    import trimesh

    pieces = pieces_of(solids, size, round=round)
    joined = trimesh.util.append_faces([p.vertices for p in pieces], [p.faces for p in pieces])
    return trimesh.Trimesh(*joined, process=False)
