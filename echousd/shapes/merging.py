"""Closed meshes: furniture of parts as one for each body that moves, without insides; a TSDF as one, clean."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import trimesh
from manifold3d import Error, Manifold, Mesh, OpType
from scipy import ndimage
from trimesh import smoothing

from echomodel.tsdf import mesh_from_tsdf
from echousd.shapes.geometry import FRAME, Geometry, Part

SIMPLER = (0.0, 2e-4, 5e-4, 1e-3, 2e-3)  # metres that a closed surface may move by to keep its budget of faces


def merged(geometry: Mapping[str, Geometry], how: str, faces: int) -> dict[str, Geometry]:
    """Object name -> its geometry with fewer meshes; objects that share geometry go on sharing.

    `how`: `parts` as they are, `bodies` one mesh for what moves together, `closed` one closed surface for it. `faces`:
    budget of a closed surface, which is simplified by up to 2 mm to keep it.
    """
    if how == "parts":
        return dict(geometry)
    made: dict[int, Geometry] = {}
    for found in geometry.values():
        if id(found) not in made:
            made[id(found)] = found if found.original is not None else _fewer(found, how, faces)
    return {name: made[id(found)] for name, found in geometry.items()}


def _fewer(geometry: Geometry, how: str, faces: int) -> Geometry:
    share = faces / max(geometry.faces, 1)
    parts = [_one(body, own, how, share) for body, own in _bodies(geometry.parts).items()]
    coarse = [_one(body, own, how, share) for body, own in _bodies(geometry.coarse).items()]
    return replace(geometry, parts=tuple(parts), coarse=tuple(coarse))


def _bodies(parts: Sequence[Part]) -> dict[str, list[Part]]:
    out: dict[str, list[Part]] = {}
    for part in parts:
        out.setdefault(part.body, []).append(part)
    return out


def _one(body: str, parts: Sequence[Part], how: str, share: float) -> Part:
    """The parts of one body as one part; `share` is how many faces it may have over those they have."""
    name = f"{body}_mesh" if body not in ("", FRAME) else "mesh"
    if how == "closed":
        mesh, slot = closed_surface(parts, int(share * sum(len(part.mesh.faces) for part in parts)))
    else:
        mesh, slot = _side_by_side(parts)
    slots = {word: np.flatnonzero(slot == word) for word in sorted(set(slot.tolist()))}
    return Part(name, mesh, slots, parts[0].crease, body)


def _side_by_side(parts: Sequence[Part]) -> tuple[trimesh.Trimesh, np.ndarray]:
    """All parts as one mesh, and the material slot of every face."""
    starts = np.cumsum([0] + [len(part.mesh.vertices) for part in parts])
    faces = np.concatenate([part.mesh.faces + start for part, start in zip(parts, starts, strict=False)])
    points = np.concatenate([part.mesh.vertices for part in parts])
    return trimesh.Trimesh(points, faces, process=False), np.concatenate([_slot_of_faces(part) for part in parts])


def _slot_of_faces(part: Part) -> np.ndarray:
    slot = np.empty(len(part.mesh.faces), dtype=object)
    for word, members in part.slots.items():
        slot[members] = word
    return slot


def closed_surface(parts: Sequence[Part], faces: int) -> tuple[trimesh.Trimesh, np.ndarray]:
    """The union of all closed solids of some parts, and the material slot of every face.

    `faces`: the surface is simplified until it has no more, by 2 mm at most; then its smallest solids are left out.
    Raises ValueError for parts that are not closed.
    """
    whole, slot = _side_by_side(parts)
    solids, word_of = [], {}
    points = np.asarray(whole.vertices, np.float32)
    for members in trimesh.graph.connected_components(whole.face_adjacency, nodes=np.arange(len(whole.faces))):
        used, index = np.unique(np.asarray(whole.faces)[members], return_inverse=True)
        made = Manifold(Mesh(points[used], index.reshape(-1, 3).astype(np.uint32)))
        if made.status() != Error.NoError:
            raise ValueError(
                f"part {parts[0].name!r} is no closed solid ({made.status().name}); leave out merge=closed"
            )
        made = made.as_original()
        word_of[made.original_id()] = slot[members[0]]
        solids.append(made)
    found = _union(solids, faces)
    while found.num_tri() > faces and len(solids) > 1:
        solids = sorted(solids, key=lambda solid: -solid.volume())[: int(0.85 * len(solids))]
        found = _union(solids, faces)
    mesh = found.to_mesh()
    triangles = np.asarray(mesh.tri_verts, int)
    starts = np.asarray(mesh.run_index, int) // 3
    slots = np.empty(len(triangles), dtype=object)
    for number, start, stop in zip(mesh.run_original_id, starts[:-1], starts[1:], strict=True):
        slots[start:stop] = word_of[int(number)]
    corners = np.asarray(mesh.vert_properties, float)[:, :3]
    low, high = corners.min(0), corners.max(0)
    share = (corners - low) / np.maximum(high - low, 1e-9)  # the box stays filled
    corners = points.min(0) + share * (points.max(0) - points.min(0))
    return trimesh.Trimesh(corners, triangles, process=False), slots


def _union(solids: Sequence[Manifold], faces: int) -> Manifold:
    """All solids as one, as plain as its budget asks for."""
    whole = Manifold.batch_boolean(list(solids), OpType.Add)
    found = whole
    for tolerance in SIMPLER:
        found = whole.simplify(tolerance) if tolerance else whole
        if found.num_tri() <= faces:
            break
    return found


SMALLEST = 0.004  # solids below this share of the largest one are noise
ROUNDS, SHRINK, SWELL = 6, 0.5, 0.53  # Taubin (1995): lambda, -mu; low frequencies such as thin legs stay
FACES, LEAST_FACES = 5000, 100
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
    reduced = _quadric(mesh, faces)
    if reduced.is_watertight and reduced.is_winding_consistent and len(reduced.faces) <= 1.05 * faces:
        return reduced
    return _manifold(mesh, faces) or reduced


def _quadric(mesh: trimesh.Trimesh, faces: int) -> trimesh.Trimesh:
    """Simplified by quadric error; thin parts may open."""
    import fast_simplification

    points, triangles = np.asarray(mesh.vertices, np.float32), np.asarray(mesh.faces, np.int32)
    p, t = fast_simplification.simplify(points, triangles, target_count=faces, agg=3)
    reduced = trimesh.Trimesh(p, t, process=False)
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


def box_mesh(size: Any) -> trimesh.Trimesh:
    """A plain box of (3,) `size` metres standing on the origin."""
    extent = np.asarray(size, float)
    mesh = trimesh.creation.box(extent)
    mesh.apply_translation((0, extent[1] / 2, 0))
    return mesh
