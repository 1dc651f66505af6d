"""Shapes of the model's shape branch without an echo: each object from its category alone, as if it stood by itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from echomodel.boxes import Boxes
from echomodel.graph import GraphBatch
from echousd.reproducible import one_thread, rounded_grids
from echousd.shapes.geometry import Geometry, Origin
from echousd.shapes.meshing import mesh_from_shape
from echousd.shapes.sources.boxes import solid_geometry
from echousd.shapes.sources.sdf import SOURCE as SDF
from echousd.shapes.sources.source import ShapeRequest, Shapes, per_asset
from echousd.tensors import floor_centre, graph_batch, seeded

if TYPE_CHECKING:
    from echomodel.protocols import RoomModel

ORIGIN = Origin("independent")


class IndependentShapes:
    """The source `independent`, for comparisons (the paper's rows of layout + class-to-shape generation)."""

    title = "shapes from the model, each by itself"

    def check(self, model: RoomModel | None) -> None:
        """Raises ValueError for a model without a shape branch."""
        SDF.check(model)

    def shapes(self, request: ShapeRequest) -> Shapes:
        """Meshes of shapes that were sampled one by one: no object hears of another."""
        graph, boxes, size = request.graph, request.boxes, np.asarray(request.boxes.size, float)
        assert request.model is not None
        alone = [graph.replaced(nodes=(node,), relations=()) for node in graph.nodes]
        centred = Boxes(boxes.size, boxes.position - floor_centre(graph), boxes.yaw)
        batch = GraphBatch.pack([graph_batch(one) for one in alone])
        with request.timer.stage("shapes") as tell, one_thread():
            generator = seeded(request.seed, "independent")
            found = request.model.sample_shapes(
                batch, centred, generator=generator, steps=request.steps, progress=tell
            )  # fmt: skip
            grids = rounded_grids(np.asarray(found))

        def make(row: int) -> Geometry:
            node = graph.nodes[row]
            try:
                mesh = mesh_from_shape(grids[row], size[row], faces=request.faces).mesh
            except ValueError as error:
                raise ValueError(f"shape of {node.name!r}: {error}; try another seed or shapes 'boxes'") from None
            return solid_geometry(mesh, node.category, ORIGIN)

        return per_asset(request, make, alike=False)


SOURCE = IndependentShapes()
