"""Products of vectors and normals of triangles; numpy's own take ten times as long for the few rows of a board."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def cross(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """(..., 3): the vector product along the last axis of two arrays of one shape, bit for bit that of `np.cross`."""
    out = np.empty(one.shape, np.result_type(one, two))
    a, b, c = one[..., 0], one[..., 1], one[..., 2]
    d, e, f = two[..., 0], two[..., 1], two[..., 2]
    out[..., 0], out[..., 1], out[..., 2] = b * f - c * e, c * d - a * f, a * e - b * d
    return out


def area_normals(triangles: np.ndarray) -> np.ndarray:
    """(f, 3): normals of the triangles (f, 3, 3), twice as long as their areas."""
    return cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])


def distances(point: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(f,) from a point (3,) to the triangles (f, 3, 3)."""
    corner, side = triangles - point, np.roll(triangles, -1, axis=1) - triangles
    share = -(corner * side).sum(2) / np.maximum((side**2).sum(2), 1e-30)
    out = np.linalg.norm(corner + np.clip(share, 0, 1)[..., None] * side, axis=2).min(1)  # to their edges
    normal = area_normals(triangles)
    length = np.linalg.norm(normal, axis=1)
    over = (length > 0) & ((cross(corner, side) * normal[:, None]).sum(2) >= 0).all(1)
    return np.where(over, np.abs((corner[:, 0] * normal).sum(1)) / np.maximum(length, 1e-30), out)


def spread(triangles: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """(count, 3) points of triangles (f, 3, 3) that have any area, and the triangle that each is on, (count,) int.

    They lie evenly along the summed area, and on a low-discrepancy sequence inside: random ones leave holes.
    """
    area, step = np.cumsum(np.linalg.norm(area_normals(triangles), axis=1)), np.arange(count)
    face = np.searchsorted(area / area[-1], (step + 0.5) / count).clip(0, len(area) - 1)
    share = np.stack([step * 0.7548776662466927, step * 0.5698402909980532], 1) % 1
    share = np.where(share.sum(1, keepdims=True) > 1, 1 - share, share)
    corner, sides = triangles[face, :1], triangles[face, 1:]
    return corner[:, 0] + np.einsum("ne,nex->nx", share, sides - corner), face


def joined(points: Sequence[np.ndarray], faces: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) and faces (m, 3) of several meshes as those of one."""
    first = np.cumsum([0, *map(len, points)])
    moved = [mine + start for mine, start in zip(faces, first, strict=False)]
    return np.concatenate(points), np.concatenate(moved)


def connected_pieces(faces: np.ndarray, points: int) -> np.ndarray:
    """(f,) int, the connected piece that each face (f, k) belongs to, in the order of their first points.

    Each point knows a lower one of its piece, and whom that one knows, until none lower is found (FastSV, Zhang et al.
    2020): rounds grow with the logarithm of a piece's breadth.
    """
    lowest, before = np.arange(points), None
    while before is None or not np.array_equal(lowest, before):
        before, lowest = lowest, lowest.copy()
        least = np.repeat(before[faces].min(1), faces.shape[1])
        np.minimum.at(lowest, before[faces].ravel(), least)
        np.minimum.at(lowest, faces.ravel(), least)
        lowest = lowest[lowest]
    return np.unique(lowest[faces[:, 0]], return_inverse=True)[1]
