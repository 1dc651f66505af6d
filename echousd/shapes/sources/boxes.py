"""Plain boxes: every object is the box that it fills."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import trimesh

from echousd.shapes.colliders import colliders_of
from echousd.shapes.geometry import Geometry, Origin, Part
from echousd.shapes.looks import material_groups
from echousd.shapes.meshing import box_mesh
from echousd.shapes.sources.source import ShapeRequest, Shapes, per_asset

if TYPE_CHECKING:
    from echomodel.protocols import RoomModel

ORIGIN = Origin("boxes")


class PlainBoxes:
    """The source `boxes`; works with every model."""

    title = "plain boxes"

    def check(self, model: RoomModel | None) -> None:
        """Nothing is needed."""

    def shapes(self, request: ShapeRequest) -> Shapes:
        """Boxes in the sizes of the boxes."""
        size = np.asarray(request.boxes.size, float)

        def make(row: int) -> Geometry:
            return solid_geometry(box_mesh(size[row]), request.graph.nodes[row].category, ORIGIN)

        return per_asset(request, make)


SOURCE = PlainBoxes()


def solid_geometry(mesh: trimesh.Trimesh, category: str, origin: Origin) -> Geometry:
    """The geometry of one mesh (object frame, metres) whose category says which materials it has where."""
    cut, slots = material_groups(mesh, category)
    return Geometry((Part("mesh", cut, slots),), colliders_of(mesh, category), origin)
