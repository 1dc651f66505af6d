"""Signed distances of solids, without any mesh query: what the grids of the shape branch are made of.

A distance is asked for on the box-normalised grid, where one voxel spans a different length on each axis. With `f` the
metric distance and `n` its unit gradient, the distance in voxels is `f / |S n|`, S = diag(metres per voxel): exact for
planes and first-order exact elsewhere, which is what the few voxels inside the truncation need.
"""

from functools import singledispatch

import numpy as np

from echomodel.furniture.bent import Blade, Bow, Shell
from echomodel.furniture.solids import IDENTITY, Array, Ball, Block, Lathe, Solid, Tube, Turned


def distance(solid: Solid, x: Array, y: Array, z: Array, scale: Array) -> Array:
    """Signed distance in voxels at broadcastable coordinates x, y, z (metres); `scale` (3,) metres per voxel."""
    x, y, z = x - solid.centre[0], y - solid.centre[1], z - solid.centre[2]
    if solid.turn is not IDENTITY:
        t = solid.turn
        x, y, z = (x * t[0, i] + y * t[1, i] + z * t[2, i] for i in range(3))
    # Columns: what one metre along a local axis is worth in voxel gradients.
    local = solid.turn * np.asarray(scale)[:, None]
    return local_distance(solid, x, y, z, local.T @ local)


@singledispatch
def local_distance(solid: Solid, x: Array, y: Array, z: Array, metric: Array) -> Array:
    """Distance in voxels at local coordinates; |S n| of a local direction n is sqrt(n^T metric n)."""
    raise NotImplementedError


@singledispatch
def inradius(solid: Solid, scale: Array) -> float:
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


@local_distance.register
def _from_block(solid: Block, x: Array, y: Array, z: Array, metric: Array) -> Array:
    r = min(solid.radius, *solid.half)
    q = [np.abs(c) - (h - r) for c, h in zip((x, y, z), solid.half, strict=True)]
    per_axis = np.sqrt(np.diag(metric))
    inside = np.maximum(np.maximum((q[0] - r) / per_axis[0], (q[1] - r) / per_axis[1]), (q[2] - r) / per_axis[2])
    k = [np.maximum(c, 0) for c in q]
    length = np.sqrt(k[0] * k[0] + k[1] * k[1] + k[2] * k[2])
    return np.where(length > 1e-9, (length - r) * length / gradient_length(metric, *k), inside)


@local_distance.register
def _from_bow(solid: Bow, x: Array, y: Array, z: Array, metric: Array) -> Array:
    return _from_block(solid, x, y, z + solid.bow * (1 - np.minimum((x / solid.half[0]) ** 2, 1)), metric)


@local_distance.register
def _from_turned(solid: Turned, x: Array, y: Array, z: Array, metric: Array) -> Array:
    w = np.clip(y / solid.height, 0, 1)
    a, b = (np.maximum(lo + (hi - lo) * w, 1e-4) for lo, hi in zip(solid.low, solid.high, strict=True))
    slope_a, slope_b = ((hi - lo) / solid.height for lo, hi in zip(solid.low, solid.high, strict=True))
    u, v = np.abs(x) / a, np.abs(z) / b
    if np.isinf(solid.power):
        first = u >= v
        q = np.maximum(u, v)
        gx, gz = np.where(first, 1 / a, 0), np.where(first, 0, 1 / b)
        gy = -np.where(first, u * slope_a / a, v * slope_b / b)
    else:
        p = solid.power
        q = np.maximum((u**p + v**p) ** (1 / p), 1e-6)
        wx, wz = (u / q) ** (p - 1), (v / q) ** (p - 1)
        gx, gz = wx / a, wz / b
        gy = -(wx * u * slope_a / a + wz * v * slope_b / b)
    side = (q - 1) / gradient_length(metric, np.sign(x) * gx, gy, np.sign(z) * gz)
    along = np.sqrt(metric[1, 1])
    cap = np.maximum(y - solid.height, -y) / along
    if solid.rounding <= 0:
        return intersection(side, cap)
    across = np.sqrt((metric[0, 0] + metric[2, 2]) / 2)
    k = np.maximum(side * across + solid.rounding, 0), np.maximum(cap * along + solid.rounding, 0)
    length = np.hypot(*k)
    rim = (length - solid.rounding) * length / np.sqrt((across * k[0]) ** 2 + (along * k[1]) ** 2 + 1e-16)
    return np.where((k[0] > 0) & (k[1] > 0), rim, np.maximum(side, cap))


@local_distance.register
def _from_ball(solid: Ball, x: Array, y: Array, z: Array, metric: Array) -> Array:
    p = solid.power
    u, v, w = (np.abs(c) / h for c, h in zip((x, y, z), solid.half, strict=True))
    q = np.maximum((u**p + v**p + w**p) ** (1 / p), 1e-6)
    g = (np.sign(c) * (t / q) ** (p - 1) / h for c, t, h in zip((x, y, z), (u, v, w), solid.half, strict=True))
    return (q - 1) / gradient_length(metric, *g)


@local_distance.register
def _from_tube(solid: Tube, x: Array, y: Array, z: Array, metric: Array) -> Array:
    nearest: Array = np.array(np.inf)
    last = len(solid.points) - 2
    for i in range(last + 1):
        a, d = solid.points[i], solid.points[i + 1] - solid.points[i]
        projected = (x - a[0]) * d[0] + (y - a[1]) * d[1] + (z - a[2]) * d[2]
        t = np.clip(projected / max(d @ d, 1e-12), 0, 1)
        off = x - a[0] - t * d[0], y - a[1] - t * d[1], z - a[2] - t * d[2]
        length = np.sqrt(off[0] ** 2 + off[1] ** 2 + off[2] ** 2 + 1e-12)
        found = (length - solid.radius) * length / gradient_length(metric, *off)
        voxels = gradient_length(metric, *d)  # of the step d; the ends are flat, not round
        if i == 0:
            found = np.maximum(found, -projected / voxels)
        if i == last:
            found = np.maximum(found, (projected - d @ d) / voxels)
        nearest = np.minimum(nearest, found)
    return nearest


@local_distance.register
def _from_shell(solid: Shell, x: Array, y: Array, z: Array, metric: Array) -> Array:
    scale = np.sqrt(np.diag(metric))
    behind = np.maximum(-z, 0)
    walls = []
    for inset, sign in ((0.0, 1.0), (solid.thickness, -1.0)):
        a, b, p = solid.half[0] - inset, solid.half[1] - inset, solid.power
        u, v = np.abs(x) / a, behind / b
        q = np.maximum((u**p + v**p) ** (1 / p), 1e-6)
        gx, gz = (u / q) ** (p - 1) / a, (v / q) ** (p - 1) / b
        walls.append(sign * (q - 1) / gradient_length(metric, np.sign(x) * gx, 0 * gx, -gz))
    top = solid._top(np.arctan2(x / solid.half[0], behind / solid.half[1]))
    return intersection(intersection(np.maximum(*walls), z / scale[2]), np.maximum(y - top, -y) / scale[1])


@local_distance.register
def _from_lathe(solid: Lathe, x: Array, y: Array, z: Array, metric: Array) -> Array:
    radius = np.sqrt(x * x + (z / solid.squash) ** 2) + 0 * y
    outline = solid._outline()
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
    gradient = gradient_length(metric, nx * x / across, ny, nx * z / solid.squash**2 / across)
    return np.where(inside, -1.0, 1.0) * length * length / np.maximum(gradient, 1e-9)


@local_distance.register
def _from_blade(solid: Blade, x: Array, y: Array, z: Array, metric: Array) -> Array:
    points, normal, half = solid._spine(5)
    nearest: Array = np.array(np.inf)
    for k in range(len(points) - 1):
        centre, along = (points[k] + points[k + 1]) / 2, points[k + 1] - points[k]
        reach, up = float(np.linalg.norm(along)) * 0.62, (normal[k] + normal[k + 1]) / 2
        ahead = along / np.linalg.norm(along)
        wide = max(float(half[k] + half[k + 1]) * 0.6, 0.003)
        u = x - centre[0]
        v = (y - centre[1]) * up[1] + (z - centre[2]) * up[2] - 0.12 * wide
        w = (y - centre[1]) * ahead[1] + (z - centre[2]) * ahead[2]
        tall = max(solid.thick, 0.004)
        q = np.sqrt((u / wide) ** 2 + (v / tall) ** 2 + (w / reach) ** 2 + 1e-12)
        gu, gv, gw = u / wide**2 / q, v / tall**2 / q, w / reach**2 / q
        found = (q - 1) / gradient_length(metric, gu, gv * up[1] + gw * ahead[1], gv * up[2] + gw * ahead[2])
        nearest = np.minimum(nearest, found)
    return nearest


@inradius.register
def _in_ball(solid: Block | Ball, scale: Array) -> float:
    return float(min(solid.half / np.linalg.norm(solid.turn * np.asarray(scale)[:, None], axis=0)))


@inradius.register
def _in_turned(solid: Turned, scale: Array) -> float:
    local = np.linalg.norm(solid.turn * np.asarray(scale)[:, None], axis=0)
    thin = min(min(solid.low[0], solid.high[0]) / local[0], min(solid.low[1], solid.high[1]) / local[2])
    return float(min(thin, solid.height / 2 / local[1]))


@inradius.register
def _in_tube(solid: Tube, scale: Array) -> float:
    return float(solid.radius / np.max(scale))


@inradius.register
def _in_shell(solid: Shell, scale: Array) -> float:
    return float(solid.thickness / 2 / max(scale[0], scale[2]))


@inradius.register
def _in_lathe(solid: Lathe, scale: Array) -> float:
    if not solid.hollow:
        return float(np.median(solid.profile[:, 0]) / scale[0])
    outline = solid._outline()
    after = np.roll(outline, -1, axis=0)
    area = 0.5 * abs(np.sum(outline[:, 0] * after[:, 1] - after[:, 0] * outline[:, 1]))
    return float(area / np.linalg.norm(outline - np.roll(outline, -1, axis=0), axis=1).sum() / scale[0])


@inradius.register
def _in_blade(solid: Blade, scale: Array) -> float:
    return float(solid.thick / 2 / np.max(scale))
