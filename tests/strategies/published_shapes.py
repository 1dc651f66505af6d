"""What the published code does with shapes and we do otherwise: kept to compare with (SPEC: section 10)."""

from __future__ import annotations

import numpy as np
import torch
import trimesh
from skimage import measure
from torch import Tensor

from echoscene.echo import LEVEL


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


def vertex_points(vertices: np.ndarray, count: int = 5000, seed: int = 42) -> Tensor:
    """The published object sample: `count` mesh vertices (not surface points), centred and scaled to the cube [-1, 1].

    Arguments:
        vertices: (V, 3) float, metres. count: points; drawn with replacement where the mesh has fewer vertices.
        seed: of the draw.

    Returns:
        (count, 3) float32.

    Raises:
        ValueError: no vertex, or all in one place.
    """
    vertices = np.asarray(vertices, np.float64).reshape(-1, 3)
    if not len(vertices):
        raise ValueError("mesh has no vertices")
    # The published stream is the legacy generator's; parity of the drawn subset needs the same one.
    legacy = np.random.RandomState(seed)
    enough = len(vertices) >= count
    index = legacy.permutation(len(vertices))[:count] if enough else legacy.choice(len(vertices), count)
    points = vertices[index]
    points = points - points.mean(0)
    scale = float(np.abs(points).max())
    if scale == 0:
        raise ValueError("mesh has all its vertices in one place")
    return torch.from_numpy((points / scale).astype(np.float32))


def _bottom_centre(points: np.ndarray) -> np.ndarray:
    low, high = points.min(0), points.max(0)
    return np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
