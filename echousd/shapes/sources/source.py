"""What a source of shapes is asked, and what it answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from echousd.graph import SceneGraph
from echousd.progress import StageTimer
from echousd.shapes.geometry import Geometry
from echousd.shapes.merging import FACES
from echousd.shapes.sources.retrieval import Retrieved
from echousd.shapes.styles import shared_assets

if TYPE_CHECKING:
    from echomodel.boxes import Boxes
    from echomodel.protocols import GraphEdit, RoomModel


@dataclass(frozen=True, eq=False)
class ShapeRequest:
    """Everything that a source may look at.

    Arguments:
        graph: the whole scene graph, n nodes.
        boxes: n boxes in the room's frame, in the order of the nodes; a shape fills its box.
        styles: object name -> style, see `echousd.shapes.styles.style_groups`.
        seed: of all randomness.
        model: the model that the boxes come from; None where an edit left nothing to sample.
        steps: sampling steps, None for the model's own.
        faces: face budget of each mesh.
        wanted: names of the objects that need geometry, in the order of the nodes; None = all.
        kept: geometry of the objects that stay as they are (of an edited room).
        change: how the graph was edited, None = not at all.
        timer: is told of the stages.
        retrieved: the models of other people that were chosen for objects.
    """

    graph: SceneGraph
    boxes: Boxes
    styles: Mapping[str, str]
    seed: int = 0
    model: RoomModel | None = None
    steps: int | None = None
    faces: int = FACES
    wanted: tuple[str, ...] | None = None
    kept: Mapping[str, Geometry] = field(default_factory=dict)
    change: GraphEdit | None = None
    timer: StageTimer = field(default_factory=StageTimer)
    retrieved: Retrieved = field(default_factory=Retrieved)

    @property
    def rows(self) -> list[int]:
        """Numbers of the wanted objects."""
        names = self.graph.names
        return [i for i, name in enumerate(names) if self.wanted is None or name in self.wanted]


@dataclass(frozen=True, eq=False)
class Shapes:
    """What a source gives.

    Arguments:
        owners: every wanted object -> the wanted object whose geometry it uses, often itself; one asset per owner.
        geometry: every owner -> its geometry.
    """

    owners: Mapping[str, str]
    geometry: Mapping[str, Geometry]


def per_asset(request: ShapeRequest, make: Callable[[int], Geometry], *, alike: bool = True) -> Shapes:
    """Geometry for the first object of each group that can share an asset (`shared_assets`).

    Arguments:
        make: number of an object in the graph -> its geometry.
        alike: False gives every object geometry of its own, for comparisons.
    """
    rows, names = request.rows, request.graph.names
    chosen = [names[i] for i in rows]
    categories = [request.graph.nodes[i].category for i in rows]
    size = np.asarray(request.boxes.size, float)[rows]
    owners = (
        shared_assets(chosen, categories, request.styles, size) if alike else dict(zip(chosen, chosen, strict=True))
    )
    geometry: dict[str, Geometry] = {}
    with request.timer.stage("meshes", len(rows)) as tell:
        for done, (i, name) in enumerate(zip(rows, chosen, strict=True), 1):
            if owners[name] == name:
                geometry[name] = make(i)
            tell(done, len(rows))
    return Shapes(owners, geometry)
