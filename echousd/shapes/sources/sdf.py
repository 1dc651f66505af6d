"""Shapes of the model's shape branch: signed distances on a grid, meshed, cleaned and fitted in their boxes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from echomodel.boxes import Boxes
from echousd.reproducible import one_thread, rounded_grids
from echousd.shapes.geometry import Geometry, Origin
from echousd.shapes.meshing import LEAST_FACES, mesh_from_shape
from echousd.shapes.sources.boxes import solid_geometry
from echousd.shapes.sources.source import ShapeRequest, Shapes, per_asset
from echousd.tensors import floor_centre, graph_batch, seeded

if TYPE_CHECKING:
    from echomodel.protocols import RoomModel

ORIGIN = Origin("sdf")
TRIES = 6  # simplifications until the cut mesh is within its budget


class SignedDistances:
    """The source `sdf` (EchoScene 3.4); needs a model with a shape branch."""

    title = "shapes from the model"

    def check(self, model: RoomModel | None) -> None:
        """Raises ValueError for a model without a shape branch."""
        if model is None or "shape" not in model.branches:
            raise ValueError("these weights have no shape branch; use shapes 'boxes' (--shapes boxes) or other weights")

    def shapes(self, request: ShapeRequest) -> Shapes:
        """Meshes of sampled shapes; objects of an edited graph that stay are sampled along, the others hear them."""
        grids = sampled_grids(request)
        size = np.asarray(request.boxes.size, float)

        def make(row: int) -> Geometry:
            node = request.graph.nodes[row]
            try:
                return within_budget(grids[row], size[row], node.category, request.faces)
            except ValueError as error:
                raise ValueError(f"shape of {node.name!r}: {error}; try another seed or shapes 'boxes'") from None

        return per_asset(request, make)


def within_budget(grid: np.ndarray, size: np.ndarray, category: str, faces: int) -> Geometry:
    """The geometry of a shape with at most `faces` triangles once it is cut along the borders of its materials.

    Arguments: as for `mesh_from_shape`, raises what it raises. A budget of a few hundred may be too small for the cuts
    alone; the best that was found is given then.
    """
    asked, best = faces, None
    for _ in range(TRIES):
        found = solid_geometry(mesh_from_shape(grid, size, faces=asked).mesh, category, ORIGIN)
        best = found if best is None or found.faces < best.faces else best
        if found.faces <= faces or asked == LEAST_FACES:
            break
        asked = max(LEAST_FACES, int(0.99 * asked * faces / found.faces))
    assert best is not None
    return best


def sampled_grids(request: ShapeRequest) -> np.ndarray:
    """(n, 64, 64, 64) float32 TSDFs of all objects; raises ValueError for a model without a shape branch."""
    SOURCE.check(request.model)
    assert request.model is not None
    graph, boxes = request.graph, request.boxes
    centred = Boxes(boxes.size, boxes.position - floor_centre(graph), boxes.yaw)
    extra: dict[str, Any] = {} if request.change is None else {"edit": request.change}
    with request.timer.stage("shapes") as tell, one_thread():
        grids = request.model.sample_shapes(
            graph_batch(graph), centred,
            generator=seeded(request.seed, "shapes"), steps=request.steps, progress=tell, **extra,
        )  # fmt: skip
        return rounded_grids(grids.numpy(force=True))


SOURCE = SignedDistances()
