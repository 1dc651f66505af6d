"""The floor of a room: its corners, from the graph or around the furniture, and its slab."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
import trimesh

MARGIN = 0.35  # metres of floor around the furniture where nobody said how large the floor is
THICKNESS = 0.1


def floor_polygon(
    polygon: Sequence[Sequence[float]] | None, size: Sequence[float] | None, boxes: np.ndarray
) -> np.ndarray:
    """Corners of the floor, counter-clockwise seen from above (x to the right, z towards the viewer).

    Arguments:
        polygon: (k, 2) float x and z of the corners, or None.
        size: x and z extents of a rectangle around the origin, or None; used where there is no polygon.
        boxes: (n, 2) float x and z of the furniture's corners, from which the floor comes where nothing else says.

    Raises ValueError for a polygon that crosses itself or has no area.
    """
    if polygon is not None and len(polygon):
        shape = shapely.Polygon(np.asarray(polygon, float))
        if not shape.is_valid or shape.area < 1e-4:
            reason = f"{shapely.is_valid_reason(shape)}, area {shape.area:.4f} m²"
            raise ValueError(f"floor polygon: {reason}; need a polygon that does not cross itself")
        corners = np.asarray(shape.exterior.coords)[:-1]
    else:
        if size is not None:
            half = np.asarray(size, float) / 2
            lower, upper = -half, half
        elif len(boxes):
            lower, upper = boxes.min(0) - MARGIN, boxes.max(0) + MARGIN
        else:
            lower, upper = np.full(2, -1.5), np.full(2, 1.5)
        corners = np.array([[lower[0], lower[1]], [lower[0], upper[1]], [upper[0], upper[1]], [upper[0], lower[1]]])
    return corners if _turns_left(corners) else corners[::-1].copy()


def floor_mesh(polygon: np.ndarray) -> trimesh.Trimesh:
    """The floor as a slab whose top is at height 0, metres."""
    flat = shapely.Polygon(np.stack([polygon[:, 0], -polygon[:, 1]], 1))  # x right, -z up: seen from above
    slab = trimesh.creation.extrude_polygon(flat, THICKNESS)
    slab.vertices = np.stack([slab.vertices[:, 0], slab.vertices[:, 2] - THICKNESS, -slab.vertices[:, 1]], 1)
    return slab


def _turns_left(corners: np.ndarray) -> bool:
    x, z = corners[:, 0], -corners[:, 1]
    return bool((x * np.roll(z, -1) - z * np.roll(x, -1)).sum() > 0)
