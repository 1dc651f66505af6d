"""Solids put together: meshed each in its place, or all as one mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from echomodel.furniture.solids import FINEST, Joint, Solid

if TYPE_CHECKING:
    import trimesh


@dataclass(frozen=True, eq=False)
class Piece:
    """One solid as a closed mesh in its place: vertices (n, 3) in metres, faces (m, 3), and its joint there."""

    solid: Solid
    vertices: np.ndarray
    faces: np.ndarray
    joint: Joint | None


def pieces_of(
    solids: Sequence[Solid], size: np.ndarray | None = None, detail: int = FINEST, *, round: bool = False
) -> list[Piece]:
    """Every solid meshed, all of them stretched together to fill `size`, standing on y = 0, centred in x and z.

    Arguments:
        solids: parts in the object's frame, metres.
        size: (3,) float, the box to fill, metres; None keeps the parts' own extents.
        round: fill it in width or in depth, so that what is round stays round.
        detail: 0 (boxes and hexagons) to 3.
    """
    seen = [solid for solid in solids if not solid.core]
    meshes = [solid.mesh(detail) for solid in seen]
    lower = np.min([vertices.min(0) for vertices, _ in meshes], axis=0)
    upper = np.max([vertices.max(0) for vertices, _ in meshes], axis=0)
    stretch = np.ones(3) if size is None else np.asarray(size, float) / np.maximum(upper - lower, 1e-9)
    if round:
        stretch[[0, 2]] = stretch[[0, 2]].min()
    origin = np.array([(lower[0] + upper[0]) / 2, lower[1], (lower[2] + upper[2]) / 2])
    return [
        Piece(solid, (vertices - origin) * stretch, faces, _stretched(solid.joint, origin, stretch))
        for solid, (vertices, faces) in zip(seen, meshes, strict=True)
    ]


def _stretched(joint: Joint | None, origin: np.ndarray, stretch: np.ndarray) -> Joint | None:
    if joint is None:
        return None
    anchor = (np.asarray(joint.anchor) - origin) * stretch
    longer = float(np.linalg.norm(np.asarray(joint.axis) * stretch)) if joint.kind == "prismatic" else 1.0
    x, y, z = (float(v) for v in anchor)
    return replace(joint, anchor=(x, y, z), reach=joint.reach * longer)


def mesh_of(solids: Sequence[Solid], size: np.ndarray | None = None, *, round: bool = False) -> trimesh.Trimesh:
    """All solids as one mesh of closed parts that overlap as boards and cushions do; arguments as for `pieces_of`."""
    import trimesh

    pieces = pieces_of(solids, size, round=round)
    joined = trimesh.util.append_faces([p.vertices for p in pieces], [p.faces for p in pieces])
    return trimesh.Trimesh(*joined, process=False)
