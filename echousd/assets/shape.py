"""What the shape of a model in the object frame tells: level surfaces that carry things, and a small picture."""

from __future__ import annotations

import numpy as np
import trimesh

from echousd.textures import encoded

LEVEL = 0.95  # least upward part of a normal
CARRIES = 0.2  # least share of the footprint at one height that things can stand on
SIDE = 96  # pixels of a thumbnail


def supports(mesh: trimesh.Trimesh) -> tuple[float, ...]:
    """Heights in metres of level surfaces, the lowest first, at most eight."""
    normals, area = np.asarray(mesh.face_normals), np.asarray(mesh.area_faces)
    up = normals[:, 1] > LEVEL
    if not up.any():
        return ()
    low, high = mesh.bounds
    footprint = float((high[0] - low[0]) * (high[2] - low[2]))
    heights = np.asarray(mesh.triangles_center)[up, 1] - low[1]
    order = np.argsort(heights)
    heights, areas = heights[order], area[up][order]
    starts = np.flatnonzero(np.diff(heights, prepend=-np.inf) > 0.02)
    found = []
    for start, end in zip(starts, [*starts[1:], len(heights)], strict=True):
        level = areas[start:end]
        if level.sum() >= CARRIES * footprint:
            height = float(np.average(heights[start:end], weights=level))
            found.append((float(level.sum()), round(height, 4)))
    return tuple(sorted(height for _, height in sorted(found, reverse=True)[:8]))


def thumbnail(mesh: trimesh.Trimesh) -> bytes:
    """PNG of a mesh in the object frame, seen from its front right above."""
    from echomodel.data.sheet import thumbnail as drawn

    return encoded(drawn(mesh, SIDE))
