"""Oriented boxes, pairs of boxes and the floor as signed distances (numpy, vectorised over pairs); what collides.

A box is (size, bottom-centre position, yaw about +Y).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from echomodel.arrays import norm
from echomodel.boxes2d import outline, seen, to_frame
from echomodel.floors import Walls, signed_distance
from echomodel.objective.support import allowed_overlap
from echomodel.openings import SKIRTING, edge_lengths, signed_area

if TYPE_CHECKING:
    from echousd.place.problem import Problem

COLUMNS = 6  # numbers of a box: its position x, y, z and its sides
PLAN, SIDES = slice(0, 3, 2), slice(3, 6, 2)  # columns of x and z and of width and depth


def pair_indices(n: int) -> np.ndarray:
    """(n (n - 1) / 2, 2) int: every pair once."""
    return np.stack(np.triu_indices(n, 1), -1)


def parting(axis: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """(p, 5, 2, 2, 6) float: the gap between the two of each pair as a sum of their positions and sides.

    Along the two sides of the first, the two of the second and upright (separating axis theorem); where the second is
    ahead along that, and where it is behind; by the numbers of the first, and of the second.

    Arguments:
        axis: (n, 2, 2) float, unit vectors in (x, z) to the side and to the front of the boxes. pairs: (p, 2) int.
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
    i, j = pairs.T
    return gaps(size[i], position[i], yaw[i], size[j], position[j], yaw[j])


def depths(
    size: np.ndarray, at: np.ndarray, turn: np.ndarray, others: np.ndarray, position: np.ndarray, yaw: np.ndarray
) -> np.ndarray:
    """(..., m) float: how deep boxes run into m others, 0 where they do not, metres.

    Arguments:
        size, at: (..., 3) and turn: (...) float, of the boxes; their sizes may be those of one.
        others, position: (m, 3) float, sizes and places of the others; yaw: (m,) float.
    """
    size = np.broadcast_to(size, at.shape)
    reach = (np.hypot(size[..., 0], size[..., 2])[..., None] + np.hypot(others[:, 0], others[:, 2])) / 2
    x, z = (position[:, axis] - at[..., None, axis] for axis in (0, 2))
    *k, j = np.nonzero(x * x + z * z < reach * reach)  # of the few that are near the depth is asked for
    out, box = np.zeros(x.shape), tuple(k)
    out[(*box, j)] = np.maximum(-gaps(size[box], at[box], turn[box], others[j], position[j], yaw[j]), 0.0)
    return out


def gaps(
    size: np.ndarray, at: np.ndarray, turn: np.ndarray, others: np.ndarray, position: np.ndarray, yaw: np.ndarray
) -> np.ndarray:
    """(...) float: metres between boxes (..., 3) and (...), and others, along the axis that parts them best."""
    cos, sin, c, s = np.cos(turn), np.sin(turn), np.cos(yaw), np.sin(yaw)
    x, z = position[..., 0] - at[..., 0], position[..., 2] - at[..., 2]
    like, across = np.abs(cos * c + sin * s), np.abs(sin * c - cos * s)  # of the axes of both
    width, deep, reach, length = size[..., 0] / 2, size[..., 2] / 2, others[..., 0] / 2, others[..., 2] / 2
    (lateral, forward), (aside, ahead) = to_frame(x, z, cos, sin), to_frame(x, z, c, s)
    gap: np.ndarray = np.abs(lateral) - (width + like * reach + across * length)
    np.maximum(gap, np.abs(forward) - (deep + across * reach + like * length), out=gap)
    np.maximum(gap, np.abs(aside) - (reach + like * width + across * deep), out=gap)
    np.maximum(gap, np.abs(ahead) - (length + across * width + like * deep), out=gap)
    np.maximum(gap, position[..., 1] - at[..., 1] - size[..., 1], out=gap)
    np.maximum(gap, at[..., 1] - position[..., 1] - others[..., 1], out=gap)
    return gap


class Floor(Walls):
    """The floor polygon, counter-clockwise seen with z up on paper.

    Arguments:
        polygon: (k, 2) float, x and z of the corners in either order, metres; those at one place count once.

    `reflex`: (m, 2) float, corners that point into the room. Raises ValueError for fewer than three corners or no area.
    """

    def __init__(self, polygon: np.ndarray) -> None:
        polygon = np.asarray(polygon, float).reshape(-1, 2)
        polygon = polygon[edge_lengths(polygon) > 1e-6]
        area = signed_area(polygon)
        if len(polygon) < 3 or abs(area) < 1e-6:
            told = f"floor polygon with {len(polygon)} different corners and area {abs(area):g} m2"
            raise ValueError(f"{told}: not a floor")
        super().__init__(polygon if area > 0 else polygon[::-1])
        self.polygon, self.reflex = self.start, self.start[self.turn < -1e-6]

    @cached_property
    def rectangle(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Middle (2,) and half extents (2,), metres, of a floor that is a rectangle along x and z, else None."""
        low, high = self.polygon.min(0), self.polygon.max(0)
        at_corners = ((self.polygon == low) | (self.polygon == high)).all()
        return ((low + high) / 2, (high - low) / 2) if len(self.polygon) == 4 and at_corners else None


def depth_inside(floor: Floor, points: np.ndarray) -> np.ndarray:
    """(m,) float: metres from points (m, 2) to the floor's border, negative beyond it."""
    if floor.rectangle is not None:
        middle, half = floor.rectangle
        out = np.abs(points - middle) - half
        deepest = np.maximum(out[:, 0], out[:, 1])
        return -np.where(deepest <= 0, deepest, norm(np.maximum(out, 0.0)))
    return np.asarray(signed_distance(points[None], floor.polygon[None])[0])


def beyond(floor: Floor, size: np.ndarray, at: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """(...) float: how far boxes (..., 3), or one box, leave the floor at (..., 3) and turn (...), metres."""
    half = np.broadcast_to(size, at.shape)[..., ::2] / 2
    corner = outline(half, turn) + at[..., None, ::2]
    out: np.ndarray = -depth_inside(floor, corner.reshape(-1, 2)).reshape(corner.shape[:-1]).min(-1)
    if len(floor.reflex):
        away: np.ndarray = seen(floor.reflex - at[..., None, ::2], turn[..., None])
        out = np.maximum(out, -(np.abs(away) - half[..., None, :]).max(-1).min(-1))
    return out


TOUCH = 0.01  # metres: deeper than this into another box is a collision, further than this outside is outside
SOLID = 0.006  # metres: where boxes do, a point of one solid this far inside another is a collision
IN_WALL = SKIRTING + 0.003  # metres, of what a wall holds: furniture stands at the wall behind its skirting


@dataclass(frozen=True)
class Collision:
    """Two objects that run into each other, by `depth` metres."""

    first: str
    second: str
    depth: float

    def __str__(self) -> str:
        return f"{self.first} and {self.second} collide by {self.depth:.3f} m"

    def to_json(self) -> dict[str, Any]:
        """The entry of the manifest, and of a check's report."""
        return {"objects": [self.first, self.second], "depth": round(self.depth, 4)}


def collisions(
    categories: Sequence[str], size: np.ndarray, position: np.ndarray, yaw: np.ndarray, pairs: np.ndarray
) -> tuple[tuple[tuple[int, int], float], ...]:
    """Pairs (p, 2) of boxes that run into each other deeper than they may, deepest first, with the excess in metres."""
    depth = -(separation(size, position, yaw, pairs) + allowed_overlap(categories, size, pairs))
    order = np.argsort(-depth, kind="stable")
    return tuple(((i, j), float(depth[p])) for p, (i, j) in zip(order, pairs[order].tolist(), strict=True)
                 if depth[p] > TOUCH)  # fmt: skip


def outside(problem: Problem, size: np.ndarray, position: np.ndarray, yaw: np.ndarray) -> tuple[tuple[int, float], ...]:
    """Objects that leave the floor, with the depth in metres."""
    if problem.outline is None:
        return ()
    depth = beyond(problem.outline, size, position, yaw)
    return tuple((i, float(depth[i])) for i in np.flatnonzero(depth > TOUCH).tolist())
