"""Truncated signed distances on the box-normalised 64^3 grid: from any mesh, and back by marching cubes.

The axis-aligned box of the object (+Y up, +Z front) maps to the cube of side 60/64 in the middle of the unit cube, so
that a shape fills its box on every axis and the box's size alone carries the aspect. Grids are indexed [x, y, z]; the
centre of voxel i lies at (i + 0.5)/64 - 0.5. Values are signed distances in voxels of that grid, negative inside,
divided by `TRUNCATION` and clipped to [-1, 1].
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from echomodel.furniture.distances import distance, inradius
from echomodel.furniture.solids import Solid, Tube
from echomodel.triangles import area_normals, spread

if TYPE_CHECKING:
    import trimesh

RESOLUTION = 64
FILLED = 60  # voxels that the object's box covers on each axis
TRUNCATION = 4.0  # voxels
SHELL = 0.87  # half the diagonal of a voxel: no smaller distance makes a sheet of voxels without holes
SHEET = 0.55  # half the thickness, in voxels, that an open sheet is given
THINNEST = 0.6  # half thickness in voxels below which a part is thickened, so that marching cubes still finds it
THINNEST_ROD_OR_LEAF = 1.0  # likewise: rods and leaves hold too little volume to be learnt otherwise
SURFACE_POINTS = 200_000  # at least
POINTS_PER_VOXEL = 8  # samples per voxel of area, at least; fewer leave holes in the shell
MOST_POINTS = 1_500_000


def voxels_from_points(points: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Grid coordinates of points in an object's frame.

    Arguments:
        points: (n, 3) float, metres.
        lower, upper: (3,) float, corners of the object's box, metres.

    Returns (n, 3) float; the centre of voxel i has coordinate i.
    """
    extent = np.maximum(np.asarray(upper, float) - lower, 1e-6)
    centre = (np.asarray(upper, float) + lower) / 2
    return (np.asarray(points, float) - centre) / extent * FILLED + (RESOLUTION - 1) / 2


def tsdf_from_mesh(mesh: trimesh.Trimesh) -> np.ndarray:
    """Signed distances of any triangle mesh, closed or not, by flood fill from outside.

    Voxels nearer to the surface than `SHELL` stop the flood; what it does not reach is inside. A sheet without an
    inside becomes a solid about one voxel thick.

    `mesh`: triangles in the object frame, any unit; its axis-aligned box becomes the normalised box.

    Returns (64, 64, 64) float32. Raises ValueError for a mesh without area.
    """
    if len(mesh.faces) == 0 or not np.isfinite(mesh.vertices).all():
        raise ValueError(f"mesh has {len(mesh.faces)} faces and {len(mesh.vertices)} vertices, need finite triangles")
    used = mesh.vertices[mesh.faces].reshape(-1, 3)
    lower, upper = used.min(0), used.max(0)
    if (upper - lower).max() <= 0:
        raise ValueError("mesh is a single point, need triangles with an area")
    triangles = voxels_from_points(used, lower, upper).reshape(-1, 3, 3)
    return truncated(_signed_by_flood(_distance_to_triangles(triangles)))


def tsdf_of(solids: Sequence[Solid]) -> np.ndarray:
    """Box-normalised TSDF (64, 64, 64) float32 of the solids' union, boards of at least one voxel, rods of two."""
    boxes = [solid.mesh()[0] for solid in solids]
    lower = np.min([vertices.min(0) for vertices in boxes], axis=0)
    upper = np.max([vertices.max(0) for vertices in boxes], axis=0)
    scale = np.maximum(upper - lower, 1e-6) / FILLED
    axes = [
        ((np.arange(RESOLUTION) - (RESOLUTION - 1) / 2) * scale[i] + (upper[i] + lower[i]) / 2).astype(np.float32)
        for i in range(3)
    ]
    margin = int(np.ceil(TRUNCATION))
    grid = np.full((RESOLUTION,) * 3, TRUNCATION, np.float32)
    for solid, vertices in zip(solids, boxes, strict=True):
        reach = voxels_from_points(vertices, lower, upper)
        start = np.maximum(np.floor(reach.min(0)).astype(int) - margin, 0)
        stop = np.minimum(np.ceil(reach.max(0)).astype(int) + margin + 1, RESOLUTION)
        where = tuple(slice(a, b) for a, b in zip(start, stop, strict=True))
        x, y, z = axes[0][where[0], None, None], axes[1][None, where[1], None], axes[2][None, None, where[2]]
        thinnest = THINNEST_ROD_OR_LEAF if isinstance(solid, Tube) or solid.role == "leaf" else THINNEST
        away = distance(solid, x, y, z, scale) - max(0.0, thinnest - inradius(solid, scale))
        np.minimum(grid[where], away, out=grid[where])
    return truncated(grid)


def truncated(voxels: np.ndarray) -> np.ndarray:
    """Signed distance in voxels -> the stored value in [-1, 1], float32."""
    return np.clip(voxels / TRUNCATION, -1, 1).astype(np.float32)


def mesh_from_tsdf(grid: Any) -> trimesh.Trimesh:
    """Surface of a TSDF by marching cubes: x, z in [-0.5, 0.5] and y in [0, 1], so that times the size places it.

    `grid`: (n, n, n) float array or tensor, negative inside; any n, laid out as the 64^3 grid is.

    Raises ValueError when the grid holds no surface.
    """
    import trimesh
    from skimage.measure import marching_cubes

    values = np.asarray(grid, np.float32)
    if values.ndim != 3 or len(set(values.shape)) != 1:
        raise ValueError(f"TSDF has shape {values.shape}, need a cube (n, n, n)")
    if not np.isfinite(values).all():
        raise ValueError("TSDF holds NaN or infinite values")
    if values.min() >= 0 or values.max() <= 0:
        side = "outside" if values.min() >= 0 else "inside"
        raise ValueError(f"TSDF holds no surface: every voxel is {side}")
    # A value of exactly zero gives triangles without area; a border of outside closes shapes that touch the edge.
    closed = np.pad(np.where(np.abs(values) < 1e-6, 1e-6, values), 1, constant_values=1.0)
    vertices, faces, _, _ = marching_cubes(closed, 0.0, gradient_direction="descent")
    n = values.shape[0]
    vertices = ((vertices - 1 + 0.5) / n - 0.5) * (RESOLUTION / FILLED)
    vertices[:, 1] += 0.5
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    mesh.merge_vertices()
    return mesh


def _distance_to_triangles(triangles: np.ndarray) -> np.ndarray:
    """Unsigned distance of every voxel centre to the triangles, exact near the surface, `inf` beyond the truncation."""
    import trimesh

    edges = area_normals(triangles)
    area = np.linalg.norm(edges, axis=1) / 2
    if area.sum() <= 0:
        raise ValueError("mesh has no area")
    keep = area > 1e-9
    triangles, area = triangles[keep], area[keep]
    points = min(max(SURFACE_POINTS, int(POINTS_PER_VOXEL * area.sum())), MOST_POINTS)
    samples, face = spread(triangles, points)
    reach = TRUNCATION + 1.0
    occupied = np.zeros((RESOLUTION,) * 3, bool)
    occupied[tuple(np.clip(np.rint(samples), 0, RESOLUTION - 1).astype(int).T)] = True
    near = ndimage.distance_transform_edt(~occupied) <= reach + 1
    centres = np.argwhere(near).astype(float)
    found, index = cKDTree(samples).query(centres, distance_upper_bound=reach + 1)
    hit = np.isfinite(found)
    # The nearest sample's own triangle gives the exact distance; samples alone err by their spacing.
    closest = trimesh.triangles.closest_point(triangles[face[index[hit]]], centres[hit])
    found[hit] = np.minimum(found[hit], np.linalg.norm(closest - centres[hit], axis=1))
    distance = np.full((RESOLUTION,) * 3, np.inf)
    distance[near] = found
    return distance


def _signed_by_flood(distance: np.ndarray) -> np.ndarray:
    """Sign for unsigned distances: what a flood from the corner reaches through voxels beyond `SHELL` is outside."""
    parts, _ = ndimage.label(np.pad(distance > SHELL, 1, constant_values=True))
    flooded = (parts == parts[0, 0, 0])[1:-1, 1:-1, 1:-1]
    # One step of the flood into the shell: outside voxels of the shell touch it, inside ones are two surfaces away.
    outside = ndimage.binary_dilation(flooded) & (distance > 0)
    signed = np.where(outside, distance, -distance)
    solid = ~outside & (distance > 0.3)
    if not solid.any():
        return distance - SHEET
    # Far from any inside the surface is a sheet: give it a thickness.
    sheet = ndimage.distance_transform_edt(~solid) > np.where(np.isfinite(distance), distance, TRUNCATION) + 1.5
    return np.where(sheet, np.where(outside, distance, 0.0) - SHEET, signed)
