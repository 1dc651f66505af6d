"""Where a piece of furniture must not be moved to: no-fit polygons of convex solids that slide in plan."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from echousd.shapes.hulls import hull_of

FLUSH = 0.002  # metres: what reaches less far into another from above or below stands on it
Solids = Sequence[np.ndarray]


def forbidden(moving: np.ndarray, fixed: np.ndarray) -> BaseGeometry | None:
    """Moves (x, z) in plan by which one convex solid would run into another; None where it never does.

    `moving`, `fixed`: (n, 3) float, corners in the room, metres, +Y up.

    The moves are the Minkowski difference of the two at height 0, a convex polygon.
    """
    low = max(moving[:, 1].min(), fixed[:, 1].min())
    if min(moving[:, 1].max(), fixed[:, 1].max()) - low <= FLUSH:
        return None
    hull = hull_of((fixed[:, None] - moving[None]).reshape(-1, 3))
    if hull is None:  # two parallel sheets
        return None
    start, end = hull.triangles.reshape(-1, 3), np.roll(hull.triangles, -1, axis=1).reshape(-1, 3)
    start, end = start[start[:, 1] * end[:, 1] <= 0], end[start[:, 1] * end[:, 1] <= 0]
    rise = end[:, 1] - start[:, 1]
    share = np.where(np.abs(rise) > 1e-12, -start[:, 1] / np.where(np.abs(rise) > 1e-12, rise, 1.0), 0.0)
    crossings = (start + share[:, None] * (end - start))[:, [0, 2]]
    found = shapely.convex_hull(shapely.multipoints(crossings))
    return found if isinstance(found, shapely.Polygon) else None


def forbidden_moves(moving: Solids, fixed: Solids, reach: float) -> BaseGeometry:
    """Moves by which any solid of one thing would run into any solid of another, none longer than about `reach`."""
    found = []
    boxes = [(solid.min(0) - reach, solid.max(0) + reach) for solid in fixed]
    for one in moving:
        low, high = one.min(0), one.max(0)
        for other, (below, above) in zip(fixed, boxes, strict=True):
            if (low[[0, 2]] < above[[0, 2]]).all() and (high[[0, 2]] > below[[0, 2]]).all():
                polygon = forbidden(one, other)
                if polygon is not None:
                    found.append(polygon)
    return shapely.union_all(found)


def depth(moves: BaseGeometry, at: np.ndarray) -> float:
    """Shortest way out of the forbidden moves from a move (2,) that was made, metres; 0 outside of them."""
    point = shapely.Point(at)
    return float(point.distance(moves.boundary)) if not moves.is_empty and moves.contains(point) else 0.0
