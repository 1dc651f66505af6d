"""Geometry of furniture that is known as one solid: cut along the borders of its materials, with colliders."""

from __future__ import annotations

import trimesh

from echousd.shapes.colliders import colliders_of
from echousd.shapes.geometry import Geometry, Origin, Part
from echousd.shapes.looks import material_groups


def solid_geometry(mesh: trimesh.Trimesh, category: str, origin: Origin) -> Geometry:
    """The geometry of one mesh (object frame, metres) whose category says which materials it has where."""
    cut, slots = material_groups(mesh, category)
    return Geometry((Part("mesh", cut, slots),), colliders_of(mesh, category), origin)
