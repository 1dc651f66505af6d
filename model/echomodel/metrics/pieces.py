"""Whether a piece of furniture holds together: which of its solids touch nothing, told from their own distances."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from echomodel.data.furniture.solids import Solid

TOUCH = 0.006  # metres between solids that still count as joined
POINTS = 160  # on the surface of a solid


def loose_solids(solids: Sequence[Solid]) -> list[int]:
    """Numbers of the solids that no chain of touching solids joins to the largest body of the piece.

    Arguments:
        solids: of a furniture program, metres; cores do not count.
    """
    seen = [number for number, solid in enumerate(solids) if not solid.core]
    surfaces = [_surface(solids[number]) for number in seen]
    low = np.array([points.min(0) for points in surfaces]) - TOUCH
    high = np.array([points.max(0) for points in surfaces]) + TOUCH
    near = (low[:, None] <= high[None]).all(2) & (high[:, None] >= low[None]).all(2)
    joined = []
    for i, j in zip(*np.nonzero(np.triu(near, 1)), strict=True):
        one, other = solids[seen[i]], solids[seen[j]]
        if _touches(surfaces[i], other) or _touches(surfaces[j], one):
            joined.append((i, j))
    ends = np.array(joined, int).reshape(-1, 2)
    graph = coo_matrix((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(len(seen), len(seen)))
    _, group = connected_components(graph, directed=False)
    main = int(np.bincount(group).argmax())
    return [seen[number] for number in np.flatnonzero(group != main)]


def _surface(solid: Solid) -> np.ndarray:
    """Vertices of a solid and points spread evenly over its faces, metres."""
    vertices, faces = solid.mesh(2)
    corners = vertices[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    if area.sum() <= 0:
        return vertices
    share = (np.arange(POINTS) + 0.5) / POINTS
    face = corners[np.searchsorted(np.cumsum(area) / area.sum(), share).clip(max=len(faces) - 1)]
    u, v = np.sqrt((np.arange(POINTS) * 0.7548776662) % 1)[:, None], ((np.arange(POINTS) * 0.5698402910) % 1)[:, None]
    inside = (1 - u) * face[:, 0] + u * (1 - v) * face[:, 1] + u * v * face[:, 2]
    return np.concatenate([vertices, inside])


def _touches(points: np.ndarray, solid: Solid) -> bool:
    x, y, z = points.T
    return bool((solid.distance(x, y, z, np.ones(3)) <= TOUCH).any())
