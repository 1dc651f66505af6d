"""Furniture of parts as fewer meshes: one for each body that moves, or one closed surface each, without insides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import trimesh

from echousd.shapes.geometry import FRAME, Geometry, Part

if TYPE_CHECKING:
    from manifold3d import Manifold

SIMPLER = (0.0, 2e-4, 5e-4, 1e-3, 2e-3)  # metres that a closed surface may move by to keep its budget of faces


def merged(geometry: Mapping[str, Geometry], how: str, faces: int) -> dict[str, Geometry]:
    """Object name -> its geometry with fewer meshes; objects that share geometry go on sharing.

    Arguments:
        how: `parts` as they are, `bodies` one mesh for what moves together, `closed` one closed surface for it.
        faces: budget of a closed surface, which is simplified by up to 2 mm to keep it.
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

    Arguments:
        faces: the surface is simplified until it has no more, by 2 mm at most; then its smallest solids are left out.

    Raises ValueError for parts that are not closed.
    """
    from manifold3d import Error, Manifold, Mesh

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
    from manifold3d import Manifold, OpType

    whole = Manifold.batch_boolean(list(solids), OpType.Add)
    found = whole
    for tolerance in SIMPLER:
        found = whole.simplify(tolerance) if tolerance else whole
        if found.num_tri() <= faces:
            break
    return found
