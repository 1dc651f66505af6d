"""Oriented boxes, pairs of boxes and the floor as signed distances with gradients (numpy, vectorised over pairs).

A box is (size, bottom-centre position, yaw about +Y). Gradients are taken with respect to the six free
numbers of a box, in the order of `COLUMNS`: position x, y, z in metres and the logarithms of the sizes x, y, z.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from echomodel.roomboxes import footprints

COLUMNS = 6


@dataclass(frozen=True, eq=False)
class Rows:
    """Signed distances that should be >= 0 and their gradients.

    Arguments:
        value: (r,) float, metres.
        gradient: (r, k, 6) float, derivative of each value by the numbers of each of the k boxes that it is about.
        who: (r, k) int, these boxes.
    """

    value: np.ndarray
    gradient: np.ndarray
    who: np.ndarray

    def take(self, rows: np.ndarray) -> Rows:
        """The same of some of the rows."""
        return Rows(self.value[rows], self.gradient[rows], self.who[rows])


def axes(yaw: np.ndarray) -> np.ndarray:
    """(n, 2, 2) float: unit vectors in (x, z) of the width axis [:, 0] and of the front [:, 1]."""
    c, s = np.cos(yaw), np.sin(yaw)
    out = np.empty((len(yaw), 2, 2), c.dtype)
    out[:, 0, 0], out[:, 0, 1], out[:, 1, 0], out[:, 1, 1] = c, -s, s, c
    return out


def spread(gradient: np.ndarray, who: np.ndarray, n: int) -> np.ndarray:
    """(r, n, 6) float: gradients by the k boxes of each row, (r, k, 6), put at the rows' boxes `who` (r, k) int."""
    out = np.zeros((len(who), n, COLUMNS))
    r = np.arange(len(who))
    for column in range(who.shape[1]):
        out[r, who[:, column]] += gradient[:, column]
    return out


def spread_sparsely(gradient: np.ndarray, who: np.ndarray, n: int) -> sparse.csr_array:
    """(r, n * 6): `spread` of very many boxes."""
    rows, columns = np.arange(len(who)).repeat(who.shape[1] * COLUMNS), who[..., None] * COLUMNS + np.arange(COLUMNS)
    return sparse.csr_array((gradient.ravel(), (rows, columns.ravel())), shape=(len(who), n * COLUMNS))


def pair_indices(n: int) -> np.ndarray:
    """(n (n - 1) / 2, 2) int: every pair once."""
    return np.stack(np.triu_indices(n, 1), -1)


def pair_gaps(
    size: np.ndarray, position: np.ndarray, yaw: np.ndarray, pairs: np.ndarray, order: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gap of every pair along its candidate separating axes (separating axis theorem for upright boxes).

    Arguments:
        size, position: (n, 3) float, metres; yaw: (n,) float, radians; pairs: (p, 2) int.
        order: (p, 2) float, sign that (second - first) must have in x and in z, 0 = either; an axis that runs along
            x or z then counts as separating on that side only.

    Returns: gap (p, 5) float, metres: along the two horizontal axes of the first box, the two of the second, and
        the vertical; direction (p, 4, 2) float: horizontal axis pointing from the first box to the second;
        reach (p, 4, 2, 2) float: how much of the half width and half depth of each of the two boxes counts.
    """
    i, j = pairs[:, 0], pairs[:, 1]
    u = axes(yaw)
    axis = np.concatenate((u[i], u[j]), 1)
    offset = (position[j] - position[i])[:, [0, 2]]
    along = np.einsum("pad,pd->pa", axis, offset)
    sign = np.where(along < 0, -1.0, 1.0)
    if order is not None:
        for d in (0, 1):
            wanted = np.where(np.abs(axis[..., d]) > 0.9, np.sign(axis[..., d]) * order[:, None, d], 0.0)
            sign = np.where(wanted != 0, wanted, sign)
    direction = axis * sign[..., None]
    reach = np.stack((np.abs(np.einsum("pad,pkd->pak", axis, u[i])), np.abs(np.einsum("pad,pkd->pak", axis, u[j]))), 2)
    half = 0.5 * np.stack((size[i][:, [0, 2]], size[j][:, [0, 2]]), 1)
    horizontal = sign * along - np.einsum("pabk,pbk->pa", reach, half)
    top = position[:, 1] + size[:, 1]
    vertical = np.maximum(position[j, 1] - top[i], position[i, 1] - top[j])
    return np.concatenate((horizontal, vertical[:, None]), 1), direction, reach


def separation(size: np.ndarray, position: np.ndarray, yaw: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """(p,) float: distance of each pair along its best axis in metres, negative = depth of penetration."""
    return pair_gaps(size, position, yaw, pairs)[0].max(1) if len(pairs) else np.zeros(0)


def separation_rows(
    size: np.ndarray,
    position: np.ndarray,
    yaw: np.ndarray,
    pairs: np.ndarray,
    order: np.ndarray,
    handicap: np.ndarray,
) -> tuple[Rows, np.ndarray]:
    """Separation of each pair along the axis that is best after subtracting a handicap.

    Arguments:
        size, position, yaw, pairs, order: as in `pair_gaps`.
        handicap: (p, 5) float, metres by which an axis must be better to be chosen (inf = never).

    Returns: the rows, and the chosen axis (p,) int.
    """
    gap, direction, reach = pair_gaps(size, position, yaw, pairs, order)
    chosen = (gap - handicap).argmax(1)
    p = np.arange(len(pairs))
    value = gap[p, chosen]
    gradient = np.zeros((len(pairs), 2, COLUMNS))
    flat = np.minimum(chosen, 3)
    horizontal = chosen < 4
    i, j = pairs[:, 0], pairs[:, 1]
    push = direction[p, flat] * horizontal[:, None]
    for end, column, sign in ((i, 0, -1.0), (j, 1, 1.0)):
        gradient[:, column, 0] = sign * push[:, 0]
        gradient[:, column, 2] = sign * push[:, 1]
        shrink = -0.5 * reach[p, flat, column] * size[end][:, [0, 2]] * horizontal[:, None]
        gradient[:, column, 3] = shrink[:, 0]
        gradient[:, column, 5] = shrink[:, 1]
    first_below = position[j, 1] + 0.5 * size[j, 1] >= position[i, 1] + 0.5 * size[i, 1]
    lower, upper = np.where(first_below, 0, 1), np.where(first_below, 1, 0)
    up = np.flatnonzero(~horizontal)
    gradient[up, upper[up], 1] = 1.0
    gradient[up, lower[up], 1] = -1.0
    gradient[up, lower[up], 4] = -size[pairs[up, lower[up]], 1]
    return Rows(value, gradient, pairs), chosen


@dataclass(frozen=True, eq=False)
class Floor:
    """The floor polygon, counter-clockwise seen with z up on paper.

    Arguments:
        polygon: (k, 2) float, x and z of the corners, metres.
        normal: (k, 2) float, unit vector into the room for the wall from corner i to corner i + 1.
        reflex: (m, 2) float, corners that point into the room.
    """

    polygon: np.ndarray
    normal: np.ndarray
    reflex: np.ndarray

    @cached_property
    def edge(self) -> np.ndarray:
        """(k, 2) float: from each corner to the following one, metres."""
        return np.roll(self.polygon, -1, 0) - self.polygon

    @cached_property
    def slope(self) -> np.ndarray:
        """(k,) float: how far each wall goes along x for a metre along z; 0 for walls along x."""
        x, z = self.edge.T
        return np.divide(x, z, out=np.zeros(len(x)), where=z != 0)

    @cached_property
    def rectangle(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Middle (2,) and half extents (2,), metres, of a floor that is a rectangle along x and z, else None."""
        low, high = self.polygon.min(0), self.polygon.max(0)
        at_corners = ((self.polygon == low) | (self.polygon == high)).all()
        return ((low + high) / 2, (high - low) / 2) if len(self.polygon) == 4 and at_corners else None


def floor_from_polygon(polygon: np.ndarray) -> Floor:
    """The floor with its walls' normals; raises ValueError for fewer than three corners or no area."""
    polygon = np.asarray(polygon, float).reshape(-1, 2)
    keep = np.linalg.norm(polygon - np.roll(polygon, -1, 0), axis=1) > 1e-6
    polygon = polygon[keep]
    following = np.roll(polygon, -1, 0)
    area = 0.5 * float((polygon[:, 0] * following[:, 1] - polygon[:, 1] * following[:, 0]).sum())
    if len(polygon) < 3 or abs(area) < 1e-6:
        raise ValueError(f"floor polygon with {len(polygon)} different corners and area {abs(area):g} m2: not a floor")
    if area < 0:
        polygon = polygon[::-1].copy()
    edge = np.roll(polygon, -1, 0) - polygon
    edge /= np.linalg.norm(edge, axis=1, keepdims=True)
    before = np.roll(edge, 1, 0)
    turn = before[:, 0] * edge[:, 1] - before[:, 1] * edge[:, 0]
    return Floor(polygon, np.stack((-edge[:, 1], edge[:, 0]), -1), polygon[turn < -1e-6])


def inside(floor: Floor, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Signed distance of points to the floor's border, positive inside.

    Arguments:
        points: (m, 2) float, x and z, metres.

    Returns: distance (m,) float; gradient (m, 2) float, the direction in which it grows.
    """
    depth, away, nearest = _border(floor, points)
    sign = np.where(_within(floor, points), 1.0, -1.0)
    gradient = np.where(
        depth[:, None] > 1e-9,
        sign[:, None] * away / np.maximum(depth, 1e-9)[:, None],
        floor.normal[nearest],
    )
    return sign * depth, gradient


def depth_inside(floor: Floor, points: np.ndarray) -> np.ndarray:
    """(m,) float: the distance of `inside` alone."""
    if floor.rectangle is not None:
        middle, half = floor.rectangle
        out = np.abs(points - middle) - half
        return -np.where((out <= 0).all(1), out.max(1), np.linalg.norm(np.maximum(out, 0.0), axis=1))
    (x0, z0), (ex, ez) = floor.polygon.T, floor.edge.T
    x, z = points[:, :1] - x0, points[:, 1:] - z0
    t = np.clip((x * ex + z * ez) / (ex * ex + ez * ez), 0.0, 1.0)
    x -= t * ex
    z -= t * ez
    depth = np.sqrt((x * x + z * z).min(1))
    return np.where(_within(floor, points), depth, -depth)


def _border(floor: Floor, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distance (m,) to the border, the way (m, 2) from its nearest point, and the number (m,) of the wall there."""
    start, edge = floor.polygon, floor.edge
    offset = points[:, None] - start
    t = np.clip((offset * edge).sum(-1) / (edge * edge).sum(-1), 0.0, 1.0)
    away = offset - t[..., None] * edge
    distance = np.linalg.norm(away, axis=-1)
    nearest = distance.argmin(1)
    m = np.arange(len(points))
    return distance[m, nearest], away[m, nearest], nearest


def _within(floor: Floor, points: np.ndarray) -> np.ndarray:
    """(m,) bool: which points lie in the polygon (even-odd rule)."""
    x, z = points[:, :1] - floor.polygon[:, 0], points[:, 1:] - floor.polygon[:, 1]
    above = (z < 0) != (z < floor.edge[:, 1])
    return (above & (x < z * floor.slope)).sum(1) % 2 == 1


def floor_rows(floor: Floor, size: np.ndarray, position: np.ndarray, yaw: np.ndarray) -> Rows:
    """Every footprint corner inside the floor and every reflex corner of the floor outside the footprints."""
    n, u = len(size), axes(yaw)
    corner = footprints(size, position, yaw)
    distance, gradient = inside(floor, corner.reshape(-1, 2))
    who = np.repeat(np.arange(n), 4)
    lever = corner.reshape(-1, 2) - position[who][:, [0, 2]]
    local = np.einsum("rkd,rd->rk", u[who], lever)
    rows = np.zeros((len(who), 1, COLUMNS))
    rows[:, 0, 0], rows[:, 0, 2] = gradient[:, 0], gradient[:, 1]
    pull = np.einsum("rkd,rd->rk", u[who], gradient) * local
    rows[:, 0, 3], rows[:, 0, 5] = pull[:, 0], pull[:, 1]
    if not len(floor.reflex):
        return Rows(distance, rows, who[:, None])
    offset = floor.reflex[None] - position[:, None, [0, 2]]
    local = np.einsum("nkd,nmd->nmk", u, offset)
    excess = np.abs(local) - 0.5 * size[:, None, [0, 2]]
    axis = excess.argmax(-1)
    value = np.take_along_axis(excess, axis[..., None], -1)[..., 0]
    who2 = np.repeat(np.arange(n), len(floor.reflex))
    axis, sign = axis.ravel(), np.sign(np.take_along_axis(local, axis[..., None], -1)).ravel()
    rows2 = np.zeros((len(who2), 1, COLUMNS))
    r = np.arange(len(who2))
    direction = -sign[:, None] * u[who2, axis]
    rows2[:, 0, 0], rows2[:, 0, 2] = direction[:, 0], direction[:, 1]
    rows2[r, 0, 3 + 2 * axis] = -0.5 * size[who2, 2 * axis]
    every = np.concatenate((who, who2))[:, None]
    return Rows(np.concatenate((distance, value.ravel())), np.concatenate((rows, rows2)), every)
