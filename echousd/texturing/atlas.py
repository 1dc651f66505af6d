"""Texture coordinates without overlaps in the unit square (xatlas), for one object or for all in one picture."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from echomodel.triangles import connected_pieces
from echousd.shapes.charts import charts

Corners = tuple[np.ndarray, np.ndarray]  # of a mesh: (t, 3, 3) float, metres, and (t, 3) int, its vertices
PADDING = 4  # texels between charts
DIGITS = 7  # of a texture coordinate in a job's files


@dataclass(frozen=True, eq=False)
class Unwrapped:
    """Triangles with texture coordinates, vertices split at seams.

    Arguments:
        points: (v, 3) float, metres. st: (v, 2) float in [0, 1], `DIGITS` digits. faces: (t, 3) int, in the order of
            the triangles that were unwrapped.
    """

    points: np.ndarray
    st: np.ndarray
    faces: np.ndarray

    @property
    def corners(self) -> np.ndarray:
        """(t, 3, 2) float, the texture coordinates of each triangle."""
        return self.st[self.faces]

    @property
    def triangles(self) -> np.ndarray:
        """(t, 3, 3) float, metres."""
        return self.points[self.faces]


def unwrap(objects: Sequence[Sequence[Corners]], resolution: int, *, together: bool = True) -> list[Unwrapped]:
    """Lay objects out, all in one picture or each in its own, charts apart from each other.

    Arguments:
        objects: the meshes of every object.
        resolution: texels along the picture's sides, roughly: charts may fill a part of it.

    Raises ValueError where xatlas is not installed, or does not survive the meshes.
    """
    boards = [_boards(meshes) for meshes in objects]
    scaled = [[(100 * points, faces) for points, faces, _ in pieces] for pieces in boards]  # centimetres, see `charts`
    laid = iter(charts([list(chain(*scaled))] if together else scaled, resolution, PADDING))
    out = []
    for pieces in boards:
        points, st, count = [], [], 0
        faces = np.zeros((sum(len(own) for _, own, _ in pieces), 3), int)
        for (corners, _, triangles), (origin, index, places) in zip(pieces, laid, strict=False):
            points.append(corners[origin])
            st.append(np.clip(np.round(places, DIGITS), 0.0, 1.0))
            faces[triangles] = index + count
            count += len(origin)
        out.append(Unwrapped(np.concatenate(points), np.concatenate(st), faces))
    return out


def _boards(meshes: Sequence[Corners]) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """The connected parts of an object: (v, 3) points, (f, 3) faces, and (f,) which triangles of the object they are.

    xatlas would join what touches, and lay one over the other.
    """
    out, before = [], 0
    for corners, vertices in meshes:
        flat = vertices.reshape(-1)
        _, first, index = np.unique(flat, return_index=True, return_inverse=True)
        faces = index.reshape(-1, 3)
        label = connected_pieces(faces, len(first))
        for board in np.unique(label):
            own = np.flatnonzero(label == board)
            used, local = np.unique(faces[own].ravel(), return_inverse=True)
            points = corners.reshape(-1, 3)[first[used]]
            out.append((points, local.reshape(-1, 3), own + before))
        before += len(vertices)
    return out


def layout_digest(st: np.ndarray) -> str:
    """Digest of texture coordinates, (t, 3, 2) float, to `DIGITS` digits."""
    whole = np.rint(np.asarray(st, float) * 10**DIGITS).astype("<i8")
    return hashlib.blake2b(np.ascontiguousarray(whole).tobytes(), digest_size=16).hexdigest()


def texels(st: np.ndarray, resolution: int) -> float:
    """How many texels of a square picture triangles cover, (t, 3, 2) float."""
    a, b = st[:, 1] - st[:, 0], st[:, 2] - st[:, 0]
    return float(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2) * resolution**2


def texel_faces(st: np.ndarray, resolution: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The texels whose centres lie in triangles (t, 3, 2): (n,) triangle, (n, 3) barycentric, (n, 2) int row, column.

    A texel that several triangles cover comes several times. Row 0 is the upper edge of the picture, t = 1.
    """
    corners = st * resolution - 0.5  # in texels, centres at whole numbers
    low = np.maximum(np.ceil(corners.min(1) - 1e-6), 0).astype(int)
    high = np.minimum(np.floor(corners.max(1) + 1e-6), resolution - 1).astype(int)
    span = np.maximum(high - low + 1, 0)
    count = span.prod(1)
    face = np.repeat(np.arange(len(st)), count)
    step = np.arange(len(face)) - np.repeat(np.cumsum(count) - count, count)
    column = low[face, 0] + step % np.maximum(span[face, 0], 1)
    row = low[face, 1] + step // np.maximum(span[face, 0], 1)
    bary = barycentric(corners[face], np.stack([column, row], 1))
    inside = (bary >= -1e-9).all(1)
    place = np.stack([resolution - 1 - row[inside], column[inside]], 1)
    return face[inside], bary[inside], place


def barycentric(triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(n, 3) float, barycentric coordinates of points (n, 2) in triangles (n, 3, 2); -1 where there is no area."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    u, v, w = b - a, c - a, points - a
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    safe = np.where(np.abs(area) > 1e-12, area, 1.0)
    second = (w[:, 0] * v[:, 1] - w[:, 1] * v[:, 0]) / safe
    third = (u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0]) / safe
    out = np.stack([1 - second - third, second, third], 1)
    return np.where(np.abs(area)[:, None] > 1e-12, out, -1.0)
