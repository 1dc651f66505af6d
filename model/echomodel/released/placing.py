"""From the published shape grid to a mesh in its box: marching cubes and the published fitting (SPEC: section 10)."""

from __future__ import annotations

import numpy as np
import trimesh
from skimage import measure

LEVEL = 0.02  # the published iso value of the truncated distance
RESOLUTION = 64


def mesh_from_grid(grid: np.ndarray, level: float = LEVEL) -> trimesh.Trimesh:
    """Cut a mesh from a distance grid.

    Arguments:
        grid: (R, R, R) float32, signed distances, negative inside, axes x, y, z.
        level: iso value.

    Returns:
        A mesh in the cube [-0.5, 0.5): index i stands at i / R - 0.5, as published (not at voxel centres).

    Raises:
        ValueError: the grid is not finite or never crosses the level.
    """
    grid = np.asarray(grid, np.float32)
    if grid.ndim != 3 or not np.isfinite(grid).all():
        raise ValueError(f"distance grid of shape {grid.shape} must be three-dimensional and finite")
    if not float(grid.min()) < level < float(grid.max()):
        raise ValueError(f"distance grid spans {grid.min():.3g}..{grid.max():.3g}, it never crosses {level}")
    vertices, faces, _, _ = measure.marching_cubes(grid, level, gradient_direction="descent")
    return trimesh.Trimesh(vertices / grid.shape[0] - 0.5, faces, process=False)


def fit_to_box(vertices: np.ndarray, box: np.ndarray, *, centre_first: bool = True) -> np.ndarray:
    """Place a shape in its box: front to +Z, stretched to fill it, turned, moved.

    Arguments:
        vertices: (V, 3) float, any frame with y up; its -X side becomes the front (+Z).
        box: (7,) float, [sx, sy, sz, px, py, pz, yaw]: metres, bottom centre, radians.
        centre_first: take the shape's centre before the quarter turn, as the published code does; a shape that is not
            centred at its origin then misses its box. False centres after the turn.

    Returns:
        (V, 3) float64, metres.

    Raises:
        ValueError: the shape is flat along an axis, or a number is not finite.
    """
    points, box = np.asarray(vertices, np.float64), np.asarray(box, np.float64)
    if not (np.isfinite(points).all() and np.isfinite(box).all()):
        raise ValueError(f"fitting a mesh: vertices and box must be finite, box is {box.tolist()}")
    centre = _bottom_centre(points)
    turned = np.stack([-points[:, 2], points[:, 1], points[:, 0]], axis=1)
    turned = turned - (centre if centre_first else _bottom_centre(turned))
    extents = turned.max(0) - turned.min(0)
    if (extents <= 0).any():
        raise ValueError(f"fitting a mesh: extent along {'xyz'[int(np.argmin(extents))]} is 0, it cannot fill a box")
    scaled = turned / extents * box[:3]
    cos, sin = np.cos(box[6]), np.sin(box[6])
    turn = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
    return scaled @ turn.T + box[3:6]


def box_corners(box: np.ndarray) -> np.ndarray:
    """(8, 3) float64 corners of a box [sx, sy, sz, px, py, pz, yaw], bottom centre at p, yaw in radians."""
    box = np.asarray(box, np.float64)
    signs = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (0.0, 1.0) for z in (-0.5, 0.5)])
    cos, sin = np.cos(box[6]), np.sin(box[6])
    turn = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
    return (signs * box[:3]) @ turn.T + box[3:6]


def _bottom_centre(points: np.ndarray) -> np.ndarray:
    low, high = points.min(0), points.max(0)
    return np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
