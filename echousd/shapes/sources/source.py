"""What a source of shapes is asked, and what it answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from echomodel.boxes import Boxes
from echomodel.progress import StageTimer
from echousd.graph import SceneGraph
from echousd.graph.arrays import floor_centre
from echousd.shapes import FACES
from echousd.shapes.geometry import Geometry
from echousd.shapes.styles import shared_assets, style_groups

if TYPE_CHECKING:
    from echomodel.graph import GraphEdit
    from echomodel.protocols import RoomModel
    from echousd.assets.model_file import ModelFile
    from echousd.assets.record import AssetRecord
    from echousd.assets.reference import Vector


@dataclass(frozen=True, eq=False)
class Retrieved:
    """What is known of the models of a room."""

    chosen: Mapping[str, AssetRecord] = field(default_factory=dict)  # object name -> model
    files: Mapping[str, ModelFile] = field(default_factory=dict)  # object name -> where it lies
    # object name -> (3) metres that the layout must give it, as the model cannot be stretched to another
    sizes: Mapping[str, Vector] = field(default_factory=dict)
    missing: tuple[str, ...] = ()  # objects that the library has nothing for
    collect: bool = False  # take models along with all that they need

    @property
    def notes(self) -> tuple[str, ...]:
        """A sentence for what could not be had."""
        if not self.missing:
            return ()
        return (f"the library has nothing for {', '.join(self.missing)}: made by the project's own programs",)


@dataclass(frozen=True, eq=False)
class ShapeRequest:
    """Everything that a source may look at."""

    graph: SceneGraph  # the whole scene graph, n nodes
    boxes: Boxes  # n boxes in the room's frame, in the order of the nodes; a shape fills its box
    seed: int = 0  # of all randomness
    model: RoomModel | None = None  # the model that the boxes come from; None where an edit left nothing to sample
    steps: int | None = None  # sampling steps, None for the model's own
    faces: int = FACES  # face budget of each mesh
    # names of the objects that need geometry, in the order of the nodes; None = all
    wanted: tuple[str, ...] | None = None
    # geometry of the objects that stay as they are (of an edited room)
    kept: Mapping[str, Geometry] = field(default_factory=dict)
    change: GraphEdit | None = None  # how the graph was edited, None = not at all
    timer: StageTimer = field(default_factory=StageTimer)  # is told of the stages
    retrieved: Retrieved = field(default_factory=Retrieved)  # the models of other people that were chosen for objects

    @cached_property
    def styles(self) -> dict[str, str]:
        """Object name -> its style."""
        return style_groups(self.graph)

    @property
    def rows(self) -> list[int]:
        """Numbers of the wanted objects."""
        names = self.graph.names
        return [i for i, name in enumerate(names) if self.wanted is None or name in self.wanted]

    @property
    def centred(self) -> Boxes:
        """The boxes about the middle of the floor, as models know them."""
        return Boxes(self.boxes.size, self.boxes.position - floor_centre(self.graph), self.boxes.yaw)

    @property
    def edited(self) -> dict[str, Any]:
        """What a model is told of an edit."""
        return {} if self.change is None else {"edit": self.change}


@dataclass(frozen=True, eq=False)
class Shapes:
    """What a source gives."""

    # every wanted object -> the wanted object whose geometry it uses, often itself; one asset per owner
    owners: Mapping[str, str]
    geometry: Mapping[str, Geometry]  # every owner -> its geometry


OTHERS = {"furniture": "--shapes sdf, --shapes boxes", "shape": "shapes 'boxes' (--shapes boxes)"}  # without a branch


def having(branch: str, model: RoomModel | None) -> RoomModel:
    """The model; raises ValueError for none, and for one without a branch."""
    if model is None or branch not in model.branches:
        raise ValueError(f"these weights have no {branch} branch; use {OTHERS[branch]} or other weights")
    return model


def per_asset(request: ShapeRequest, make: Callable[[int], Geometry]) -> Shapes:
    """Geometry for the first object of each group that can share an asset (`shared_assets`).

    `make`: number of an object in the graph -> its geometry.
    """
    rows, names = request.rows, request.graph.names
    chosen = [names[i] for i in rows]
    categories = [request.graph.nodes[i].category for i in rows]
    size = np.asarray(request.boxes.size, float)[rows]
    owners = shared_assets(chosen, categories, request.styles, size)
    geometry: dict[str, Geometry] = {}
    with request.timer.stage("meshes", len(rows)) as tell:
        for done, (i, name) in enumerate(zip(rows, chosen, strict=True), 1):
            if owners[name] == name:
                geometry[name] = make(i)
            tell(done, len(rows))
    return Shapes(owners, geometry)
