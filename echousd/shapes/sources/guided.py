"""Models of a library that are most like the shapes that the model generates: it decides what, the library has it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from echousd.assets.choose import AssetWishes
from echousd.progress import StageTimer
from echousd.shapes.sources.library import LibraryAssets
from echousd.shapes.sources.retrieval import source_of
from echousd.shapes.sources.sdf import SOURCE as SDF
from echousd.shapes.sources.sdf import sampled_grids
from echousd.shapes.sources.source import ShapeRequest
from echousd.shapes.styles import style_groups

if TYPE_CHECKING:
    from echomodel.boxes import Boxes
    from echomodel.protocols import RoomModel
    from echousd.graph import SceneGraph


class GuidedAssets(LibraryAssets):
    """The source `guided`; needs a model with a shape branch."""

    def check(self, model: RoomModel | None) -> None:
        """Raises ValueError for a model without a shape branch."""
        SDF.check(model)


def shape_nearness(
    graph: SceneGraph,
    boxes: Boxes,
    shapes: str,
    wishes: AssetWishes,
    seed: int,
    model: RoomModel | None,
    steps: int | None,
    timer: StageTimer,
) -> Mapping[str, Mapping[str, float]] | None:
    """Object name -> id of a model -> cost of its shape against the generated one; None where nothing is guided.

    Raises ValueError for a library without descriptors. Arguments as for `retrieved` and `ShapeRequest`.
    """
    rows = [i for i, node in enumerate(graph.nodes) if source_of(node, shapes) == "guided" and node.asset is None]
    records = [record for shelf in wishes.shelves.values() for record in shelf.records]
    if not rows or not records:
        return None
    if not any(record.descriptor for record in records):
        assert wishes.library is not None
        raise ValueError(f"{wishes.library.file}: holds no descriptors; index the library with --descriptors")
    from echousd.assets.descriptor import descriptors, nearness

    grids = sampled_grids(ShapeRequest(graph, boxes, style_groups(graph), seed, model, steps, timer=timer))
    found = descriptors(model, np.asarray(grids)[rows])
    return nearness(found, [graph.names[i] for i in rows], records)


SOURCE = GuidedAssets("guided", "models of a library most like generated shapes")
