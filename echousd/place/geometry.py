"""Oriented boxes, pairs of boxes and the floor as signed distances (numpy, vectorised over pairs).

A box is (size, bottom-centre position, yaw about +Y).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

COLUMNS = 6  # numbers of a box: its position x, y, z and its sides
PLAN, SIDES = slice(0, 3, 2), slice(3, 6, 2)  # columns of x and z and of width and depth


def axes(yaw: np.ndarray) -> np.ndarray:
    """(n, 2, 2) float: unit vectors in (x, z) of the width axis [:, 0] and of the front [:, 1]."""
    c, s = np.cos(yaw), np.sin(yaw)
    out = np.empty((len(yaw), 2, 2), c.dtype)
    out[:, 0, 0], out[:, 0, 1], out[:, 1, 0], out[:, 1, 1] = c, -s, s, c
    return out


def pair_indices(n: int) -> np.ndarray:
    """(n (n - 1) / 2, 2) int: every pair once."""
    return np.stack(np.triu_indices(n, 1), -1)


def parting(axis: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """(p, 5, 2, 2, 6) float: the gap between the two of each pair as a sum of their positions and sides.

    Along the two sides of the first, the two of the second and upright (separating axis theorem); where the second is
    ahead along that, and where it is behind; by the numbers of the first, and of the second.

    Arguments:
        axis: (n, 2, 2) float, `axes` of the boxes. pairs: (p, 2) int.
    """
    out = np.zeros((len(pairs), 5, 2, 2, COLUMNS))
    along = axis[pairs].reshape(-1, 4, 2)
    reach = np.abs(np.einsum("pad,pbsd->pabs", along, axis[pairs])) / 2
    for side, ahead in enumerate((1.0, -1.0)):
        out[:, :4, side, 0, PLAN], out[:, :4, side, 1, PLAN] = -ahead * along, ahead * along
        lower, upper = side, 1 - side
        out[:, 4, side, upper, 1], out[:, 4, side, lower, 1], out[:, 4, side, lower, 4] = 1.0, -1.0, -1.0
    out[:, :4, :, :, SIDES] = -reach[:, :, None]
    return out


def separation(size: np.ndarray, position: np.ndarray, yaw: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """(p,) float: distance of each pair along its best axis in metres, negative = depth of penetration."""
    by, state = parting(axes(yaw), pairs), np.concatenate([position, size], 1)[pairs]
    return np.einsum("pasbc,pbc->pas", by, state).max((1, 2), initial=-np.inf)


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


def depth_inside(floor: Floor, points: np.ndarray) -> np.ndarray:
    """(m,) float: metres from points (m, 2) to the floor's border, negative beyond it."""
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


def _within(floor: Floor, points: np.ndarray) -> np.ndarray:
    """(m,) bool: which points lie in the polygon (even-odd rule)."""
    x, z = points[:, :1] - floor.polygon[:, 0], points[:, 1:] - floor.polygon[:, 1]
    above = (z < 0) != (z < floor.edge[:, 1])
    return (above & (x < z * floor.slope)).sum(1) % 2 == 1
