"""Meshes of triangles, and what is asked of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import trimesh


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles: vertices (n, 3) float and faces (m, 3) int, counter-clockwise seen from outside."""

    vertices: np.ndarray
    faces: np.ndarray

    @classmethod
    def of(cls, other: Any) -> Mesh:
        """Vertices and faces of a mesh of trimesh or whoever has them."""
        return cls(np.asarray(other.vertices, float), np.asarray(other.faces))

    @cached_property
    def bounds(self) -> np.ndarray:
        """(2, 3): lower and upper corner."""
        return bounds_of(self.vertices)

    @property
    def triangles(self) -> np.ndarray:
        """(m, 3, 3): corners of the faces."""
        return self.vertices[self.faces]

    @property
    def closed(self) -> bool:
        """Whether two faces meet at every edge, as they are or once vertices at one place are one."""
        if _closed(self.faces):
            return True
        place = np.unique(self.vertices.round(8), axis=0, return_inverse=True)[1].reshape(-1)
        return _closed(place[self.faces])

    @property
    def trimesh(self) -> trimesh.Trimesh:
        """As trimesh has it, which measures and changes meshes."""
        import trimesh  # with networkx a third of a second

        return trimesh.Trimesh(self.vertices, self.faces, process=False)


def _closed(faces: np.ndarray) -> bool:
    ends = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64), axis=1)
    return bool((np.unique(ends[:, 0] * (ends.max() + 1) + ends[:, 1], return_counts=True)[1] == 2).all())


CORNERS = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
SIDES = np.array([
    (1, 3, 0), (4, 1, 0), (0, 3, 2), (2, 4, 0), (1, 7, 3), (5, 1, 4),
    (5, 7, 1), (3, 7, 2), (6, 4, 2), (2, 7, 6), (6, 5, 4), (7, 5, 6),
])  # fmt: skip


def box(low: Sequence[float] | np.ndarray, high: Sequence[float] | np.ndarray) -> Mesh:
    """A box between two corners (3,)."""
    return Mesh(np.asarray(low) + CORNERS * np.subtract(high, low), SIDES)


def cross(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """(..., 3): the vector product along the last axis of two arrays of one shape.

    Bit for bit that of `np.cross`, which takes ten times as long for the few rows of a board.
    """
    out = np.empty(one.shape, np.result_type(one, two))
    a, b, c = one[..., 0], one[..., 1], one[..., 2]
    d, e, f = two[..., 0], two[..., 1], two[..., 2]
    out[..., 0], out[..., 1], out[..., 2] = b * f - c * e, c * d - a * f, a * e - b * d
    return out


def along(one: Sequence[np.ndarray] | np.ndarray, other: Sequence[np.ndarray] | np.ndarray) -> np.ndarray:
    """(...): the scalar products of vectors whose components are planes, (3, ...) each."""
    return np.asarray(one[0] * other[0] + one[1] * other[1] + one[2] * other[2])


def unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors (3, ...) of length 1 along some (3, ...)."""
    return np.asarray(vectors / np.sqrt(np.maximum(along(vectors, vectors), 1e-18)))


def lengths(vectors: np.ndarray) -> np.ndarray:
    """(...): the lengths of vectors (..., 3), bit for bit as `np.linalg.norm` has them row by row."""
    planes = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return np.sqrt(along(planes, planes))


def bounds_of(points: np.ndarray) -> np.ndarray:
    """(2, 3): lower and upper corner of points (..., 3), for which numpy takes twenty times as long row by row."""
    planes = np.ascontiguousarray(points.reshape(-1, points.shape[-1]).T)
    return np.array((planes.min(1), planes.max(1)))


def spans_of(triangles: np.ndarray) -> np.ndarray:
    """(2, f, ...): the least and the greatest of the three corners of triangles (f, 3, ...)."""
    one, two, three = np.moveaxis(triangles, 1, 0)
    return np.stack([np.minimum(np.minimum(one, two), three), np.maximum(np.maximum(one, two), three)])


def area_normals(triangles: np.ndarray) -> np.ndarray:
    """(f, 3): normals of the triangles (f, 3, 3), twice as long as their areas."""
    return cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])


def outlines(triangles: np.ndarray, level: float) -> tuple[np.ndarray, np.ndarray]:
    """Where triangles (f, 3, 3) pass through a height: ends in plan (x, z), (k, 2, 2), and which do, (k,) int."""
    over = triangles[..., 1] > level
    which = np.flatnonzero(over.any(1) & ~over.all(1))
    start, end = triangles[which], np.roll(triangles[which], -1, axis=1)
    through = over[which] != np.roll(over[which], -1, axis=1)
    start, end = start[through], end[through]
    share = (level - start[:, 1:2]) / (end[:, 1:2] - start[:, 1:2])
    return (start + share * (end - start))[:, [0, 2]].reshape(-1, 2, 2), which


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


def joined(meshes: Sequence[Mesh]) -> Mesh:
    """Several meshes as one."""
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = [mesh.faces + start for mesh, start in zip(meshes, first, strict=False)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


def connected_pieces(faces: np.ndarray, points: int) -> np.ndarray:
    """(f,) int, the connected piece that each face (f, k) belongs to, in the order of their first points.

    Each point knows a lower one of its piece, and whom that one knows, until none lower is found (FastSV, Zhang et al.
    2020): rounds grow with the logarithm of a piece's breadth.
    """
    lowest, before = np.arange(points), None
    while before is None or not np.array_equal(lowest, before):
        before, lowest = lowest, lowest.copy()
        known = before.take(faces.T)
        least = np.tile(known.min(0), len(known))
        np.minimum.at(lowest, known.ravel(), least)
        np.minimum.at(lowest, faces.T.ravel(), least)
        lowest = lowest[lowest]
    number = np.zeros(points, int)
    number[lowest[faces[:, 0]]] = 1
    return (number.cumsum() - 1)[lowest[faces[:, 0]]]


def linked(pairs: Sequence[tuple[int, int]] | np.ndarray, count: int) -> np.ndarray:
    """(count,) int, the group of each thing, by pairs (p, 2) of one group, numbered in the order of their first."""
    alone = np.arange(count)
    links = np.concatenate([np.stack([alone, alone], 1), np.asarray(pairs, int).reshape(-1, 2)])
    return connected_pieces(links, count)[:count]


def firsts(pairs: np.ndarray, count: int) -> np.ndarray:
    """(count,) int, the first thing of each thing's group; arguments as for `linked`."""
    group = linked(pairs, count)
    return np.unique(group, return_index=True)[1][group]
