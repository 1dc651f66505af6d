"""Furniture of a library, and pieces of one's own: models of other people, chosen before the layout is final."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from echousd.shapes.geometry import Geometry
from echousd.shapes.originals.loading import geometry_of
from echousd.shapes.sources.source import ShapeRequest, Shapes
from echousd.shapes.styles import EQUAL

if TYPE_CHECKING:
    from echomodel.protocols import RoomModel


class LibraryAssets:
    """The sources `library` and `own`: places what `ShapeRequest.retrieved` holds; works with every model."""

    def __init__(self, name: str, title: str) -> None:
        self.name, self.title = name, title

    def check(self, model: RoomModel | None) -> None:
        """Nothing is needed of the model."""

    def shapes(self, request: ShapeRequest) -> Shapes:
        """The chosen models; objects with one model and one size share an asset."""
        size = np.asarray(request.boxes.size, float)
        owners: dict[str, str] = {}
        geometry: dict[str, Geometry] = {}
        heads: list[int] = []
        chosen, files = request.retrieved.chosen, request.retrieved.files
        with request.timer.stage("meshes", len(request.rows)) as tell:
            for done, row in enumerate(request.rows, 1):
                node = request.graph.nodes[row]
                record = chosen[node.name]
                same = (
                    other
                    for other in heads
                    if chosen[request.graph.nodes[other].name] == record
                    and request.graph.nodes[other].category == node.category
                    and np.abs(size[other] / size[row] - 1).max() <= EQUAL
                )
                first = next(same, None)
                if first is None:
                    heads.append(row)
                    box = (float(size[row][0]), float(size[row][1]), float(size[row][2]))
                    geometry[node.name] = geometry_of(
                        files[node.name], record, node.category, box, self.name, collect=request.retrieved.collect
                    )
                owners[node.name] = node.name if first is None else request.graph.nodes[first].name
                tell(done, len(request.rows))
        return Shapes(owners, geometry)


SOURCE = LibraryAssets("library", "models of a library, with --assets")
