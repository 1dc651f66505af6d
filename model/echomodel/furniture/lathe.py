"""Solids off the lathe and blades: shades, bottles, vases and bean bags by their profile, leaves by their length."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from echomodel.furniture.solids import FINEST, Array, Solid, gradient_length, loft, superellipse


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
