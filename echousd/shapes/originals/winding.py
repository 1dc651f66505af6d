"""Surfaces that their authors left inside out, turned when they are converted; models in USD stay as they are."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

CLOSED = 0.9  # share of a piece's edges with a neighbour on the other side, from which on it has an inside
SAME = 1e-6  # of the extent: points nearer than that are one, as texture coordinates cut surfaces apart


def outward(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(f, 3) int, the faces with every piece turned that is nearly closed, evenly wound and inside out.

    Arguments:
        points: (v, 3) float. faces: (f, 3) int, counter-clockwise seen from outside.
    """
    extent = float(np.ptp(points, axis=0).max()) or 1.0
    place = np.unique(np.rint(points / (SAME * extent)).astype(np.int64), axis=0, return_inverse=True)[1].ravel()
    corner = place[faces]
    count = int(place.max()) + 1
    start, end = corner[:, [0, 1, 2]].ravel(), corner[:, [1, 2, 0]].ravel()
    piece = connected_components(coo_array((np.ones(len(start)), (start, end)), shape=(count, count)), directed=False)[
        1
    ]
    forth, back = start * count + end, end * count + start
    known, often = np.unique(forth, return_counts=True)
    once = often[np.searchsorted(known, forth)] == 1
    paired = np.isin(back, known)
    of_edge, of_face, pieces = piece[start], piece[corner[:, 0]], int(piece.max()) + 1
    edges = np.maximum(np.bincount(of_edge, minlength=pieces), 1)
    even = np.bincount(of_edge, once, pieces) == edges
    closed = np.bincount(of_edge, paired, pieces) >= CLOSED * edges
    sums = np.stack([np.bincount(of_face, points[faces].mean(1)[:, axis], pieces) for axis in range(3)], 1)
    middle = sums / np.maximum(np.bincount(of_face, minlength=pieces), 1)[:, None]
    a, b, c = (points[faces[:, k]] - middle[of_face] for k in range(3))
    volume = np.bincount(of_face, np.einsum("ij,ij->i", a, np.cross(b, c)), pieces)
    wrong = (even & closed & (volume < 0))[of_face]
    return np.where(wrong[:, None], faces[:, ::-1], faces)
