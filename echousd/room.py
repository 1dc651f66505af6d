"""A room that was generated from a graph as plain data: boxes, geometry, verdicts, and where it comes from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from echomodel.boxes2d import upright
from echousd.graph import SceneGraph
from echousd.options import RoomOptions
from echousd.shapes.styles import style_groups

if TYPE_CHECKING:
    import trimesh

    from echomodel.boxes import Boxes
    from echousd.place.geometry import Collision
    from echousd.shapes.geometry import Geometry


class Found:
    """What is found of a room: a dataclass that reports and manifests hold."""

    def to_json(self) -> dict[str, Any]:
        """Its fields, numbers with four digits."""
        return {name: round(value, 4) if isinstance(value, float) else value for name, value in vars(self).items()}


@dataclass(frozen=True)
class Verdict(Found):
    """What became of one relation of the graph: `kept`, `broken` or `unmeasured`, and by how much (metres or ratio)."""

    subject: str
    predicate: str
    object: str
    state: str
    margin: float | None = None

    def __str__(self) -> str:
        margin = "" if self.margin is None else f" (margin {self.margin:+.2f})"
        return f"{self.sentence} is {self.state}{margin}"

    @property
    def sentence(self) -> str:
        """The relation or placement as a sentence."""
        return " ".join(filter(None, (self.subject, self.predicate, self.object)))


@dataclass(frozen=True)
class LayoutOutcome:
    """What became of one layout: one verdict per relation and placement of the graph, the objects that collide, and, of
    a room that was simulated, a sentence for each that does not rest."""

    verdicts: tuple[Verdict, ...] = ()
    collisions: tuple[Collision, ...] = ()
    restless: tuple[str, ...] = ()

    @property
    def broken(self) -> tuple[Verdict, ...]:
        """The relations that do not hold."""
        return tuple(verdict for verdict in self.verdicts if verdict.state == "broken")

    @property
    def faults(self) -> tuple[str, ...]:
        """A sentence for every broken relation, every collision and all that does not rest."""
        return (*map(str, self.broken), *map(str, self.collisions), *self.restless)

    def counts(self) -> dict[str, int]:
        """How many relations are kept, broken and unmeasured."""
        states = [verdict.state for verdict in self.verdicts]
        return {state: states.count(state) for state in ("kept", "broken", "unmeasured")}

    def to_json(self) -> dict[str, Any]:
        """The entry of the manifest."""
        return {
            "relations": self.counts(),
            "broken": [verdict.to_json() for verdict in self.broken],
            "collisions": [hit.to_json() for hit in self.collisions],
            **({"restless": list(self.restless)} if self.restless else {}),
        }


@dataclass(frozen=True)
class Provenance:
    """Where a room comes from; written into every layer and the manifest."""

    seed: int = 0
    preset: str = "compact"
    model: str = "none"
    shapes: str = "boxes"
    source: str = ""


@dataclass(frozen=True, eq=False)
class RoomData:
    """A finished room.

    Arguments:
        name: valid identifier; file and default prim's asset name.
        graph: the graph that was asked for.
        layouts: all arrangements of the furniture, N boxes each, in the order of `graph.nodes`; at least one.
        geometry: object name -> parts and colliders in the object's frame, metres, filling its box.
        assets: object name -> name of the asset that it references; objects with one asset have one geometry.
        floor: (k, 2) float, x and z of the floor's corners, counter-clockwise seen from above.
        outcomes: what became of each layout, in their order.
        notes: what the graph asks for in vain, one sentence each.
        timings: stage of the pipeline -> seconds.
        edited: root layer of the room that it comes from, None = made anew; saved over that one it can be taken back,
            saved elsewhere it takes that one's looks along.
        carried: asset name -> its files (path -> bytes), which are written again as they are.
    """

    name: str
    graph: SceneGraph
    layouts: tuple[Boxes, ...]
    geometry: Mapping[str, Geometry]
    assets: Mapping[str, str]
    floor: np.ndarray
    outcomes: tuple[LayoutOutcome, ...] = ()
    notes: tuple[str, ...] = ()
    provenance: Provenance = Provenance()
    options: RoomOptions = field(default_factory=RoomOptions)
    timings: Mapping[str, float] = field(default_factory=dict)
    carried: Mapping[str, Mapping[str, bytes]] = field(default_factory=dict)
    edited: Path | None = None

    @property
    def boxes(self) -> Boxes:
        """The first layout."""
        return self.layouts[0]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the objects, in the order of the boxes."""
        return tuple(node.name for node in self.graph.nodes)

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """One per relation and placement of the graph, of the first layout."""
        return self.outcomes[0].verdicts if self.outcomes else ()

    @property
    def faults(self) -> tuple[str, ...]:
        """What is broken, collides or does not rest, one sentence each; says which layout if there are several."""
        several = len(self.outcomes) > 1
        return tuple(
            f"layout_{number}: {fault}" if several else fault
            for number, outcome in enumerate(self.outcomes)
            for fault in outcome.faults
        )

    @property
    def meshes(self) -> dict[str, trimesh.Trimesh]:
        """Object name -> all its parts as one mesh in the object's frame, metres, filling its box."""
        return {name: geometry.mesh.trimesh for name, geometry in self.geometry.items()}

    @cached_property
    def styles(self) -> dict[str, str]:
        """Object name -> its style, see `echousd.shapes.styles.style_groups`."""
        return style_groups(self.graph)

    @property
    def asset_users(self) -> dict[str, str]:
        """Asset name -> the first object that references it."""
        users: dict[str, str] = {}
        for name in self.names:
            users.setdefault(self.assets[name], name)
        return users

    @property
    def height(self) -> float:
        """Height of the room in metres: the graph's, and never below the highest object."""
        top = float((np.asarray(self.boxes.position)[:, 1] + np.asarray(self.boxes.size)[:, 1]).max(initial=0.0))
        return max(self.graph.room.tall, top)

    @property
    def corners(self) -> np.ndarray:
        """(k, 2) float: the floor's corners in the order in which the openings of the graph count its edges."""
        stated = self.graph.room.corners
        return np.asarray(self.floor if stated is None else stated, float)

    def pose(self, number: int, layout: int = 0) -> np.ndarray:
        """(4, 4) float: object frame -> room frame of one object in one layout."""
        boxes = self.layouts[layout]
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = upright(float(boxes.yaw[number])), np.asarray(boxes.position[number], float)
        return matrix

    def scene(self) -> trimesh.Scene:
        """All objects in their places, in the room frame."""
        import trimesh

        scene = trimesh.Scene()
        for number, name in enumerate(self.names):
            asset, pose = self.assets[name], self.pose(number)
            if asset not in scene.geometry:
                scene.geometry[asset] = self.geometry[name].mesh.trimesh
            scene.graph.update(frame_to=name, matrix=pose, geometry=asset)
        return scene
