"""Floors as padded polygons: how far points lie from the walls; of numpy and torch alike."""

import numpy as np

from echomodel.arrays import NUMPY, Array, at_least, at_most, cast, dot, kit
from echomodel.boxes2d import outline

SIDES = ((-1, -1), (0, -1), (1, -1), (1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0))  # corners and middles of a footprint
AT_WALL = 0.15  # metres between a wall and the side that stands against it


def known(floor: Array) -> Array:
    """(S,) bool, which floors are known."""
    return kit(floor).isfinite(floor[:, :1]).all(2).any(1)


def area(floor: Array) -> Array:
    """(S,) float32, square metres; 0 for corners on a line and where the floor is unknown."""
    return abs(signed_area(floor))


def signed_area(floor: Array) -> Array:
    """(S,) float32, square metres, positive where the inside lies at (-dz, dx) of a wall (dx, dz)."""
    start, end = edges(floor)
    return (start[..., 0] * end[..., 1] - start[..., 1] * end[..., 0]).sum(1) / 2


def edges(floor: Array) -> tuple[Array, Array]:
    """Start and end (S, K, 2) of the walls; padding repeats the first corner, which makes walls of no length."""
    xp, start = kit(floor), floor
    if not isinstance(floor, NUMPY) or not np.isfinite(floor).all():
        start = xp.nan_to_num(xp.where(xp.isfinite(floor), floor, floor[:, :1]))  # NaN would spoil gradients
    return start, xp.concat([start[:, 1:], start[:, :1]], 1)


def signed_distance(points: Array, floor: Array) -> Array:
    """Distance to the nearest wall in metres, positive on the floor, 0 where the floor is unknown; differentiable.

    Arguments:
        points: (M, Q, 2) float32, x and z. floor: (M, K, 2) float32, the floor that each row of points belongs to.

    Returns (M, Q) float32.
    """
    xp = kit(points)
    start, end = (wall[:, None] for wall in edges(floor))
    along, off = end - start, points[:, :, None] - start
    t = at_most(at_least(dot(off, along) / at_least(dot(along, along), 1e-9), 0.0), 1.0)
    away = off - t[..., None] * along
    distance = xp.sqrt(at_least(xp.amin(dot(away, away), -1), 1e-12))  # the square root of nought has no slope
    distance = xp.where(_inside(points, start, end), distance, -distance)
    return xp.where(known(floor)[:, None], distance, xp.zeros_like(distance))


def _inside(points: Array, start: Array, end: Array) -> Array:
    """(M, Q) bool: an odd number of walls lies to the +x side."""
    x, z = points[:, :, None, 0], points[:, :, None, 1]
    return (((start[..., 1] > z) != (end[..., 1] > z)) & (meeting(z, start, end, 1) > x)).sum(-1) % 2 > 0


def meeting(level: Array, start: Array, end: Array, axis: int) -> Array:
    """Where the walls' lines reach a value of `axis`, on the other axis."""
    run = end[..., axis] - start[..., axis]
    share = (level - start[..., axis]) / kit(run).where(run == 0, 1.0, run)
    return start[..., 1 - axis] + share * (end[..., 1 - axis] - start[..., 1 - axis])


def footprint(size: Array, position: Array, yaw: Array) -> Array:
    """Corners and middles of the sides of boxes in plan, the back left one first (`SIDES`).

    Arguments:
        size, position: (N, 3) float32, metres, as in `Boxes`. yaw: (N,) float32, radians.

    Returns (N, 8, 2) float32, x and z, metres. Walls that enter between two of these points are not met.
    """
    return outline(size[:, ::2] / 2, yaw, SIDES) + position[:, None, ::2]


class Walls:
    """The walls of a floor: starts, directions and inward normals (E, 2), lengths (E,), how far the room turns at each
    start, as a sine, below 0 at corners that point into it, and which are `inner` corners (E,).

    Arguments:
        floor: (E, 2) float, corners of the floor in either order, metres.
    """

    def __init__(self, floor: np.ndarray) -> None:
        self.start = np.array(floor, float)
        edge = np.concatenate([self.start[1:], self.start[:1]]) - self.start
        self.length = np.maximum(np.hypot(edge[:, 0], edge[:, 1]), 1e-9)
        self.along = edge / self.length[:, None]
        sign = 1.0 if signed_area(self.start[None])[0] > 0 else -1.0
        self.normal = sign * np.stack([-self.along[:, 1], self.along[:, 0]], 1)
        before = np.concatenate([self.along[-1:], self.along[:-1]])
        self.turn = sign * (before[:, 0] * self.along[:, 1] - before[:, 1] * self.along[:, 0])
        self.inner = self.turn > 0.1

    def away(self, points: Array) -> Array:
        """(..., E) distance of points (..., 2) from the line of every wall, inwards positive."""
        return dot(points[..., None, :] - cast(self.start, points), cast(self.normal, points))

    def beside(self, points: Array) -> Array:
        """(..., E) how far points (..., 2) lie from the nearer end of every wall, along it; negative: past it."""
        at = dot(points[..., None, :] - cast(self.start, points), cast(self.along, points))
        return kit(points).minimum(at, cast(self.length, points) - at)
