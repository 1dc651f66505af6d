"""Whether a piece of furniture holds together: which of its solids touch nothing, told from their own distances."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from echomodel.furniture.solids import Array, Solid
from echomodel.triangles import area_normals

TOUCH = 0.006  # metres between solids that still count as joined
POINTS = 160  # on the surface of a solid


def loose_solids(solids: Sequence[Solid]) -> list[int]:
    """Numbers of the solids that no chain of touching solids joins to the largest body of the piece.

    Arguments:
        solids: of a furniture program, metres; cores do not count.
    """
    seen = [number for number, solid in enumerate(solids) if not solid.core]
    group, main = group_of([solids[number] for number in seen])
    return [seen[number] for number in np.flatnonzero(group != main)]


def group_of(solids: Sequence[Solid]) -> tuple[Array, int]:
    """Number (n,) of the body that each solid is part of, and which body is the largest; none may be a core."""
    surfaces = [_surface_of(solid) for solid in solids]
    low = np.array([points.min(0) for points in surfaces]) - TOUCH
    high = np.array([points.max(0) for points in surfaces]) + TOUCH
    near = (low[:, None] <= high[None]).all(2) & (high[:, None] >= low[None]).all(2)
    joined = []
    for i, j in zip(*np.nonzero(np.triu(near, 1)), strict=True):
        if _touches(surfaces[i], solids[j]) or _touches(surfaces[j], solids[i]):
            joined.append((i, j))
    ends = np.array(joined, int).reshape(-1, 2)
    graph = coo_matrix((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(len(solids), len(solids)))
    _, group = connected_components(graph, directed=False)
    return group, int(np.bincount(group).argmax())


def _surface_of(solid: Solid) -> Array:
    """Vertices of a solid and points spread evenly over its faces, metres."""
    vertices, faces = solid.mesh(2)
    corners = vertices[faces]
    area = np.linalg.norm(area_normals(corners), axis=1)
    if area.sum() <= 0:
        return vertices
    share = (np.arange(POINTS) + 0.5) / POINTS
    face = corners[np.searchsorted(np.cumsum(area) / area.sum(), share).clip(max=len(faces) - 1)]
    u, v = np.sqrt((np.arange(POINTS) * 0.7548776662) % 1)[:, None], ((np.arange(POINTS) * 0.5698402910) % 1)[:, None]
    inside = (1 - u) * face[:, 0] + u * (1 - v) * face[:, 1] + u * v * face[:, 2]
    return np.concatenate([vertices, inside])


def _touches(points: Array, solid: Solid) -> bool:
    x, y, z = points.T
    return bool((solid.distance(x, y, z, np.ones(3)) <= TOUCH).any())
