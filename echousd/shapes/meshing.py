"""Closed meshes: what a generated shape becomes, clean and of few faces, and how any mesh loses faces."""

from typing import Any

import numpy as np
import trimesh
from manifold3d import Error, Manifold, Mesh
from scipy import ndimage
from trimesh import smoothing

from echomodel.late import Late
from echousd.shapes import FACES

mesh_from_tsdf = Late("echomodel.tsdf:mesh_from_tsdf")
SMALLEST = 0.004  # solids below this share of the largest one are noise
ROUNDS, SHRINK, SWELL = 6, 0.5, 0.53  # Taubin (1995): lambda, -mu; low frequencies such as thin legs stay
LEAST_FACES = 100
FINEST, COARSENINGS = 1 / 1200, 11  # first tolerance in diagonals of the mesh; it grows to a twentieth


def mesh_from_shape(grid: Any, size: Any, *, faces: int = FACES) -> trimesh.Trimesh:
    """The mesh of one generated shape.

    `grid`: (n, n, n) float TSDF in its normalised box, negative inside, see `echomodel.tsdf`. `size`: (3,) float,
    extents of the object's box in metres; the mesh fills it on every axis, bottom centre at 0. `faces`: face budget.
    Raises ValueError for a grid without any surface and for sizes that are not positive.
    """
    extent = np.asarray(size, float)
    if extent.shape != (3,) or not (np.isfinite(extent).all() and (extent > 0).all()):
        raise ValueError(f"size is {extent.tolist()}, need three positive numbers of metres")
    if np.ndim(grid) != 3:
        raise ValueError(f"TSDF has shape {np.shape(grid)}, need a cube (n, n, n)")
    if faces < LEAST_FACES:
        raise ValueError(f"face budget is {faces}, need at least {LEAST_FACES}")
    mesh = mesh_from_tsdf(largest_solids(np.asarray(grid, np.float32)))
    smoothing.filter_taubin(mesh, SHRINK, SWELL, iterations=2 * ROUNDS)
    mesh.vertices *= extent
    mesh = decimate(mesh, faces)
    if not len(mesh.faces):
        raise ValueError(f"nothing is left of its noisy surface with {faces} faces")
    return fit(mesh, extent)


def largest_solids(grid: np.ndarray) -> np.ndarray:
    """The TSDF without small loose solids and with enclosed cavities filled, same shape and type."""
    inside = grid < 0
    parts, count = ndimage.label(inside)
    out = np.array(grid)
    if count > 1:
        volume = np.bincount(parts.ravel())[1:]
        small = np.flatnonzero(volume < SMALLEST * volume.max()) + 1
        loose = np.isin(parts, small)
        out[loose] = np.maximum(np.abs(out[loose]), 0.05)
    air, _ = ndimage.label(np.pad(out >= 0, 1, constant_values=True))
    cavity = ((air != air[0, 0, 0]) & (air > 0))[1:-1, 1:-1, 1:-1]
    out[cavity] = -np.maximum(np.abs(out[cavity]), 0.05)
    return out


def decimate(mesh: trimesh.Trimesh, faces: int) -> trimesh.Trimesh:
    """About `faces` triangles at most, closed where the mesh is: by quadric error, else by simplifying a manifold."""
    if len(mesh.faces) <= faces:
        return mesh
    reduced = quadric(mesh, faces)
    if reduced.is_watertight and reduced.is_winding_consistent and len(reduced.faces) <= 1.05 * faces:
        return reduced
    return _manifold(mesh, faces) or reduced


def quadric(mesh: trimesh.Trimesh, faces: int) -> trimesh.Trimesh:
    """About `faces` triangles by quadric error, none without an area, used vertices only; thin parts may open."""
    large = len(mesh.faces) > faces
    reduced = mesh.simplify_quadric_decimation(face_count=faces, aggression=3) if large else mesh.copy()
    reduced.merge_vertices()
    reduced.update_faces(reduced.nondegenerate_faces() & reduced.unique_faces())
    reduced.remove_unreferenced_vertices()
    return reduced


def _manifold(mesh: trimesh.Trimesh, faces: int) -> trimesh.Trimesh | None:
    """Simplified with ever larger tolerance; never opens a mesh. None where the mesh was not closed to begin with."""
    points = np.asarray(mesh.vertices, np.float32)
    solid = Manifold(Mesh(points, np.asarray(mesh.faces, np.uint32)))
    if solid.status() != Error.NoError or solid.is_empty():
        return None
    tolerance = FINEST * float(np.linalg.norm(np.ptp(points, axis=0)))
    for _ in range(COARSENINGS):
        solid = solid.simplify(tolerance)
        if solid.num_tri() <= faces:
            break
        tolerance *= 1.5
    out = solid.to_mesh()
    return trimesh.Trimesh(out.vert_properties[:, :3], out.tri_verts, process=False)


def fit(mesh: trimesh.Trimesh, size: np.ndarray) -> trimesh.Trimesh:
    """Stretched and moved to fill a box of `size` metres exactly, bottom centre at the origin, faces outwards."""
    points = np.asarray(mesh.vertices, float)
    used = points[np.asarray(mesh.faces).ravel()]
    lower, upper = used.min(0), used.max(0)
    points = (points - (lower + upper) / 2) * (size / np.maximum(upper - lower, 1e-9))
    points[:, 1] += size[1] / 2
    faces = np.asarray(mesh.faces)
    out = trimesh.Trimesh(points, faces, process=False)
    if out.volume < 0:
        out = trimesh.Trimesh(points, faces[:, ::-1], process=False)
    return out
