"""Closed surfaces that solids are meshed with: outlines, lofts through rings, and the surface of a cube as a grid."""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def superellipse(power: float, corners: int = 32) -> Array:
    """Outline (n, 2) of the unit superellipse, counted from +x towards -z so that lofts along +y face outward.

    Its points crowd where it bends: the corners of a rounded table top are round, its sides straight.
    """
    if np.isinf(power):
        return np.array([[1, -1], [-1, -1], [-1, 1], [1, 1]], float)
    angle = np.arange(corners) * (2 * np.pi / corners)
    points = np.stack([np.cos(angle), -np.sin(angle)], axis=1)
    points[np.abs(points) < 1e-12] = 0.0
    return np.sign(points) * np.abs(points) ** (2 / power)


def loft(rings: list[Array]) -> tuple[Array, Array]:
    """Closed surface through rings of equal length (k, 3): quads between neighbours, a fan over each end."""
    k, n = len(rings[0]), len(rings)
    vertices = np.concatenate([*rings, rings[0].mean(0)[None], rings[-1].mean(0)[None]])
    i = np.arange(k)
    j = (i + 1) % k
    faces = [np.stack([r * k + i, r * k + j, (r + 1) * k + j], 1) for r in range(n - 1)]
    faces += [np.stack([r * k + i, (r + 1) * k + j, (r + 1) * k + i], 1) for r in range(n - 1)]
    faces.append(np.stack([np.full(k, n * k), j, i], 1))
    faces.append(np.stack([np.full(k, n * k + 1), (n - 1) * k + i, (n - 1) * k + j], 1))
    return vertices, np.concatenate(faces)


_CUBES: dict[int, tuple[Array, Array]] = {}


def cube_surface(cells: int) -> tuple[Array, Array]:
    """Surface of the cube [-1, 1]^3 as a grid of `cells` quads an edge, vertices shared."""
    if cells not in _CUBES:
        steps = np.linspace(-1, 1, cells + 1)
        u, v = (g.ravel() for g in np.meshgrid(steps, steps, indexing="ij"))
        index = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
        a, b, c, d = index[:-1, :-1].ravel(), index[1:, :-1].ravel(), index[1:, 1:].ravel(), index[:-1, 1:].ravel()
        quads = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
        points: list[Array] = []
        faces: list[Array] = []
        for axis in range(3):
            for side in (-1.0, 1.0):
                face = np.empty((len(u), 3))
                face[:, axis], face[:, (axis + 1) % 3], face[:, (axis + 2) % 3] = side, u, v
                faces.append((quads if side > 0 else quads[:, ::-1]) + len(u) * len(points))
                points.append(face)
        vertices, inverse = np.unique(np.round(np.concatenate(points), 9), axis=0, return_inverse=True)
        _CUBES[cells] = vertices, inverse.reshape(-1)[np.concatenate(faces)]
    return _CUBES[cells]
