"""A room that was generated from a graph: boxes, meshes and verdicts, and how it is saved and shown."""

from __future__ import annotations

import tempfile
import weakref
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import trimesh

from echousd.room.manifest import check_seed
from echousd.room.styles import style_groups

if TYPE_CHECKING:
    from pxr import Usd

    from echomodel.boxes import Boxes
    from echousd.graph import SceneGraph
    from echousd.room.geometry import Geometry


@dataclass(frozen=True)
class RoomOptions:
    """How a room is written.

    Arguments:
        up_axis: `Y`, or `Z` (metadata and one rotation on the root prim; everything below stays as it is).
        walls: add walls around the floor.
        atlas: unwrap every mesh without overlaps (extra `texture`) instead of projecting along the axes.
    """

    up_axis: str = "Y"
    walls: bool = False
    atlas: bool = False

    def __post_init__(self) -> None:
        if self.up_axis not in ("Y", "Z"):
            raise ValueError(f"up axis is {self.up_axis!r}, allowed: Y, Z")


@dataclass(frozen=True)
class Verdict:
    """What became of one relation of the graph: `kept`, `broken` or `unmeasured`, and by how much (metres or ratio)."""

    subject: str
    predicate: str
    object: str
    state: str
    margin: float | None = None

    def to_json(self) -> dict[str, Any]:
        """The entry of the manifest."""
        margin = None if self.margin is None else round(self.margin, 4)
        triple = {"subject": self.subject, "predicate": self.predicate, "object": self.object}
        return {**triple, "state": self.state, "margin": margin}


@dataclass(frozen=True)
class Provenance:
    """Where a room comes from; written into every layer and into the manifest."""

    seed: int = 0
    preset: str = "compact"
    model: str = "none"
    shapes: str = "boxes"
    source: str = ""

    def __post_init__(self) -> None:
        check_seed(self.seed)


@dataclass(frozen=True, eq=False)
class Room:
    """A finished room.

    Arguments:
        name: valid identifier; file and default prim's asset name.
        graph: the graph that was asked for.
        boxes: N boxes in the order of `graph.nodes`.
        geometry: object name -> parts and colliders in the object's frame, metres, filling its box.
        assets: object name -> name of the asset that it references; objects with one asset have one geometry.
        floor: (k, 2) float, x and z of the floor's corners, counter-clockwise seen from above.
        verdicts: one per relation of the graph.
        layouts: all arrangements of the same furniture; the first is `boxes`.
        notes: what the graph asks for in vain, one sentence each.
        timings: stage of the pipeline -> seconds.
        carried: asset name -> its files (path -> bytes), which are written again as they are.
    """

    name: str
    graph: SceneGraph
    boxes: Boxes
    geometry: Mapping[str, Geometry]
    assets: Mapping[str, str]
    floor: np.ndarray
    verdicts: tuple[Verdict, ...] = ()
    layouts: tuple[Boxes, ...] = ()
    notes: tuple[str, ...] = ()
    provenance: Provenance = Provenance()
    options: RoomOptions = RoomOptions()
    timings: Mapping[str, float] = field(default_factory=dict)
    carried: Mapping[str, Mapping[str, bytes]] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the objects, in the order of the boxes."""
        return tuple(node.name for node in self.graph.nodes)

    @property
    def meshes(self) -> dict[str, trimesh.Trimesh]:
        """Object name -> all its parts as one mesh in the object's frame, metres, filling its box."""
        return {name: geometry.mesh for name, geometry in self.geometry.items()}

    @cached_property
    def styles(self) -> dict[str, str]:
        """Object name -> its style, see `echousd.room.styles.style_groups`."""
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
        """Height of the room in metres: the graph's, else 2.8, and never below the highest object."""
        top = float((np.asarray(self.boxes.position)[:, 1] + np.asarray(self.boxes.size)[:, 1]).max(initial=0.0))
        return max(float(self.graph.room.height or 2.8), top)

    def pose(self, number: int, layout: int = 0) -> np.ndarray:
        """(4, 4) float: object frame -> room frame of one object in one layout."""
        boxes = self.layouts[layout] if self.layouts else self.boxes
        yaw = float(boxes.yaw[number])
        matrix = np.eye(4)
        matrix[0, 0] = matrix[2, 2] = np.cos(yaw)
        matrix[0, 2], matrix[2, 0] = np.sin(yaw), -np.sin(yaw)
        matrix[:3, 3] = np.asarray(boxes.position[number], float)
        return matrix

    def scene(self) -> trimesh.Scene:
        """All objects in their places, in the room frame."""
        scene = trimesh.Scene()
        for number, name in enumerate(self.names):
            asset, pose = self.assets[name], self.pose(number)
            if asset not in scene.geometry:
                scene.geometry[asset] = self.geometry[name].mesh
            scene.graph.update(frame_to=name, matrix=pose, geometry=asset)
        return scene

    def save(self, folder: str | Path, *, force: bool = False, preview: bool = True, wait: bool = False) -> Path:
        """Write the layered room and return the path of its root layer.

        Arguments:
            folder: created if need be, its name names the room; a room of ours in it is regenerated under the name
                that it has. Files that somebody else wrote or edited stay, if need be under another name that a warning
                tells.
            force: also write into a folder that holds other things than a room of ours.
            preview: draw `<name>.png` (needs the extra `render`; left out without it).
            wait: for another process that writes this folder, instead of raising.

        Raises:
            ValueError: the folder is not ours, is being written by another process, cannot be written, or the disk is
                full; nothing is half-written.
        """
        from echousd.room.save import save_room

        return save_room(self, Path(folder), force=force, preview=preview, wait=wait)

    @property
    def stage(self) -> Usd.Stage:
        """The room as a composed stage (written to a temporary folder that lives as long as the room)."""
        if not hasattr(self, "_stage"):
            from pxr import Usd

            folder = tempfile.TemporaryDirectory(prefix="echousd-")
            root = self.save(Path(folder.name) / self.name, preview=False)
            object.__setattr__(self, "_stage", Usd.Stage.Open(str(root)))
            weakref.finalize(self, folder.cleanup)
        return self._stage  # type: ignore[attr-defined]

    def image(self, *, size: int = 512, view: str = "perspective") -> Any:
        """A picture of the room (PIL image); needs the extra `render`."""
        from echousd.render import render_stage

        return render_stage(self.stage, view=view, size=size)

    def _repr_png_(self) -> bytes | None:
        import io

        try:
            picture = self.image(size=360)
        except ValueError:  # without embreex a notebook shows the table alone
            return None
        out = io.BytesIO()
        picture.save(out, "PNG")
        return out.getvalue()

    def _repr_html_(self) -> str:
        import base64

        kept = sum(v.state == "kept" for v in self.verdicts)
        measured = sum(v.state != "unmeasured" for v in self.verdicts)
        size = [" × ".join(f"{v:.2f}" for v in row) for row in self.boxes.size.tolist()]
        position = [", ".join(f"{v:.2f}" for v in row) for row in self.boxes.position.tolist()]
        cells = [(n.name, n.category, s, p) for n, s, p in zip(self.graph.nodes, size, position, strict=True)]
        rows = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in cells)
        head = "".join(f"<th>{title}</th>" for title in ("object", "category", "size (m)", "position (m)"))
        count = f"{len(self.names)} objects, {kept} of {measured} measured relations kept"
        png = self._repr_png_()
        picture = f'<img width="360" src="data:image/png;base64,{base64.b64encode(png).decode()}">' if png else ""
        return f"<div><b>{self.name}</b>: {count}<br>{picture}<table><tr>{head}</tr>{rows}</table></div>"

    def __repr__(self) -> str:
        count = f"{len(self.names)} objects, {len(self.verdicts)} relations"
        return f"Room({self.name!r}, {count}, seed {self.provenance.seed})"
