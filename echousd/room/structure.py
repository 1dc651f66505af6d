"""The shell of a room as prims: which parts it has, their surfaces, and how they are written."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Gf, Kind, Sdf, Usd, UsdGeom, UsdSemantics

from echousd.room import assets
from echousd.room.finishes.harmonies import linear
from echousd.room.looks import Look
from echousd.room.paths import SHELL, piece_name
from echousd.room.room import RoomData
from echousd.room.shell import floor_mesh
from echousd.room.surface import Surface, surface
from echousd.room.taxonomy import ade20k
from echousd.room.walls import Piece, ShellPart, ceiling, walls

LOOKS = {
    "ceiling": Look(linear("f6f4f0"), 0.95),
    "trim": Look(linear("f7f5f1"), 0.4),
    "leaf": Look(linear("efebe3"), 0.4),
    "rail": Look(linear("8e9194"), 0.35, metallic=0.85),
    "glass": Look(linear("d6e6ee"), 0.05, opacity=0.2),
}


@dataclass(frozen=True, eq=False)
class ShellMesh:
    """One mesh of the shell, ready to be written: prim path, material, surface, whether things bump into it."""

    path: str
    look: str
    form: Surface
    solid: bool


@dataclass(frozen=True, eq=False)
class ShellPrim:
    """A part of the shell with its meshes; a door or a window stands below its wall."""

    path: str
    label: str
    kind: str
    meshes: tuple[ShellMesh, ...]
    extent: np.ndarray


def shell_prims(room: RoomData) -> list[ShellPrim]:
    """All parts of a room's shell, walls before what is in them."""
    corners = room.graph.room.corners
    plan = room.floor if corners is None else corners
    slab = Piece(piece_name("Floor", "mesh"), "floor", floor_mesh(room.floor))
    parts = [ShellPart("Floor", "floor", (slab,))]
    if room.options.walls:
        parts += walls(plan, room.height, room.graph.room.openings)
    if room.options.ceiling:
        parts.append(ceiling(plan, room.height))
    return [prim for part in parts for prim in _prims(part, SHELL, Kind.Tokens.component)]


def shell_layer(built: Sequence[ShellPrim], data: Mapping[str, Any]) -> Sdf.Layer:
    """`layers/shell.usdc`: floor, walls and what is in them, as meshes; `data`: customLayerData."""
    stage = assets.new_stage("Room", ".usdc", data)
    for path in ("/Room", SHELL):
        UsdGeom.Xform.Define(stage, path)
    write_shell(stage, built)
    return stage.GetRootLayer()


def write_shell(stage: Usd.Stage, prims: Sequence[ShellPrim]) -> None:
    """Author the parts with kind, labels and extents, and their meshes."""
    for part in prims:
        prim = UsdGeom.Xform.Define(stage, part.path).GetPrim()
        Usd.ModelAPI(prim).SetKind(part.kind)
        low, high = (Gf.Vec3f(*map(float, corner)) for corner in part.extent)
        UsdGeom.ModelAPI.Apply(prim).SetExtentsHint([low, high])
        for taxonomy, word in (("category", part.label), ("ade20k", ade20k(part.label))):
            UsdSemantics.LabelsAPI.Apply(prim, taxonomy).CreateLabelsAttr([word])
        for mesh in part.meshes:
            assets.write_mesh(stage, mesh.path, mesh.form)


def _prims(part: ShellPart, above: str, kind: str) -> Iterator[ShellPrim]:
    path = f"{above}/{part.name}"
    meshes = tuple(_mesh(piece, path) for piece in part.pieces)
    inner = [prim for each in part.inner for prim in _prims(each, path, Kind.Tokens.subcomponent)]
    extents = np.stack([mesh.form.extent for mesh in meshes] + [prim.extent for prim in inner])
    yield ShellPrim(path, part.label, kind, meshes, np.stack([extents[:, 0].min(0), extents[:, 1].max(0)]))
    yield from inner


def _mesh(piece: Piece, above: str) -> ShellMesh:
    form = surface(piece.mesh, {piece.look: np.arange(len(piece.mesh.faces))})
    return ShellMesh(f"{above}/{piece.name}", piece.look, form, piece.solid)
