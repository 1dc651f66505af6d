"""Triangles of a mesh that a tool gave back, found again in the mesh that it was given."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from echousd.texturing.atlas import Unwrapped

TOLERANCE = 5e-5  # of the diagonal of the object
TURNS = tuple(  # about +Y, +X and back: what exporters do with "up" and "forward"
    np.array(turn, float)
    for turn in (
        [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
        [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
        [[-1, 0, 0], [0, 1, 0], [0, 0, -1]],
        [[0, 0, 1], [0, 1, 0], [-1, 0, 0]],
        [[0, 0, -1], [0, 1, 0], [1, 0, 0]],
    )
)


def texture_coordinates(given: Unwrapped, back: Unwrapped, name: str) -> np.ndarray:
    """(t, 3, 2) float, for each corner of the mesh that was given out, where it lies in the picture that came back.

    Accepted: vertices split, joined and re-ordered, triangles re-ordered and begun at another corner, triangles without
    area or lying on an equal one left out, and the whole turned by quarters, moved and scaled evenly. Raises ValueError
    with the object's name for other triangles (remeshed, decimated, mirrored), and for coordinates outside of [0, 1].

    Arguments:
        given: what the job holds. back: what the tool made of it. name: of the object.
    """
    best, st = len(given.faces), None
    for turn in TURNS:
        found = _found(_fitted(back.triangles @ turn.T, given.triangles), given.triangles, back.corners)
        if isinstance(found, int):
            best = min(best, found)
        else:
            st = found
            break
    if st is None:
        raise ValueError(
            f"object {name!r}: {len(back.faces)} triangles came back, and {best} of the {len(given.faces)} that were "
            "given are not among them; allowed: the same triangles in any order (no remeshing, no decimation): turn "
            f"that off in the tool, bake its colours onto meshes/{name}.obj, or leave the object out with --skip {name}"
        )
    if st.min() < -1e-3 or st.max() > 1 + 1e-3:
        raise ValueError(
            f"object {name!r}: texture coordinates from {st.min():.3f} to {st.max():.3f} came back, allowed: 0 to 1"
        )
    return np.clip(st, 0.0, 1.0)


def _fitted(corners: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Corners moved and scaled evenly so that their box is that of the wanted ones."""
    low, high = corners.reshape(-1, 3).min(0), corners.reshape(-1, 3).max(0)
    first, last = wanted.reshape(-1, 3).min(0), wanted.reshape(-1, 3).max(0)
    scale = np.linalg.norm(last - first) / max(float(np.linalg.norm(high - low)), 1e-12)
    return (corners - (low + high) / 2) * scale + (first + last) / 2


def _found(corners: np.ndarray, wanted: np.ndarray, st: np.ndarray) -> np.ndarray | int:
    """Texture coordinates of the wanted triangles, (t, 3, 2), from others that lie at the same places.

    Arguments:
        corners: (s, 3, 3) triangles that came back, where the wanted ones (t, 3, 3) are. st: (s, 3, 2) of them.

    Returns how many are missing where some are, or where there are others besides.
    """
    diagonal = float(np.linalg.norm(np.ptp(wanted.reshape(-1, 3), axis=0)))
    group = _places(np.concatenate([wanted, corners]).reshape(-1, 3), TOLERANCE * max(diagonal, 1e-9)).reshape(-1, 3)
    ours, theirs = group[: len(wanted)], group[len(wanted) :]
    (mine, first), (other, start) = _turned(ours), _turned(theirs)
    both = np.unique(np.concatenate([mine, other]), axis=0, return_inverse=True)[1].reshape(-1)
    mine_key, other_key = both[: len(mine)], both[len(mine) :]
    order = np.argsort(other_key, kind="stable")
    low = np.searchsorted(other_key[order], mine_key)
    many = np.searchsorted(other_key[order], mine_key, side="right") - low
    flat = (ours == np.roll(ours, 1, axis=1)).any(1)
    missing = int(((many == 0) & ~flat).sum())
    strange = ~np.isin(other_key, mine_key) & ~(theirs == np.roll(theirs, 1, axis=1)).any(1)
    if missing or strange.any():
        return max(missing, int(strange.sum()))
    turn = np.zeros(len(mine_key), int)  # equal triangles take turns
    rows = np.argsort(mine_key, kind="stable")
    turn[rows] = np.arange(len(rows)) - np.searchsorted(mine_key[rows], mine_key[rows])
    pick = order[np.minimum(low + turn % np.maximum(many, 1), len(order) - 1)]
    corner = (np.arange(3) - first[:, None] + start[pick][:, None]) % 3
    out = st[pick][np.arange(len(pick))[:, None], corner]
    lost = (many == 0).nonzero()[0]  # without area: where their places are
    if len(lost):
        where = np.zeros((int(group.max()) + 1, 2))
        where[theirs.reshape(-1)] = st.reshape(-1, 2)
        out[lost] = where[ours[lost]]
    return out


def _turned(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles begun at the corner that makes them smallest as a row, the turn kept, and which corner that is."""
    turns = np.stack([np.roll(places, -step, axis=1) for step in range(3)], 1)  # (t, 3, 3)
    most = int(places.max(initial=0)) + 1
    first = (turns @ np.array([most**2, most, 1])).argmin(1)
    return turns[np.arange(len(places)), first], first


def _places(points: np.ndarray, near: float) -> np.ndarray:
    """(n,) int, points within `near` of each other have one number."""
    unique, index = np.unique(np.rint(points / (near / 4)).astype(np.int64), axis=0, return_inverse=True)
    pairs = cKDTree(unique * (near / 4)).query_pairs(near, output_type="ndarray")
    if not len(pairs):
        return index.reshape(-1)
    links = coo_array((np.ones(len(pairs), bool), pairs.T), shape=(len(unique), len(unique)))
    return connected_components(links, directed=False)[1][index.reshape(-1)]
