"""The shell of a room as prims: its parts and their surfaces, and what covers floor and walls, by the seed."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from pxr import Kind, Sdf

from echomodel.boxes2d import footprints
from echomodel.furniture.solids import Joint
from echomodel.late import Late
from echomodel.openings import Opening, edge_lengths
from echomodel.triangles import Mesh, joined
from echomodel.vocabulary import vocabulary
from echousd.dressing.walls import behind, walls_of
from echousd.layers import assets
from echousd.room import RoomData
from echousd.shapes.fittings import BEAM
from echousd.shapes.geometry import CREASE, Mass
from echousd.shapes.matter import hull_moments
from echousd.shapes.surface import Surface, surfaces
from echousd.shapes.walls import COVED, THICKNESS, ShellPart, ShellPiece, millwork, slab, wall_name, walls_of_room
from echousd.stage import encoding
from echousd.stage.paths import OPENINGS, SHELL, piece_name
from echousd.stage.pen import Pen, ops
from echousd.stage.taxonomy import ade20k

beams = Late("echousd.shapes.bays:beams")

THIRD = 3  # one room in so many has the flooring of its type
# Slots of the floorings that come in several kinds, equally often; wood where nothing else is.
FLOORS = {
    "tiles": ("tiles", "terrazzo"),
    "wood": ("floor", "floor", "herringbone", "boards_walnut", "boards_ash", "boards_grey", "herringbone_walnut"),
}
# What one wall may have, and of how many parts of all rooms; the rest has plain walls.
COVERS = {"wallpaper": 2, "paint": 3, "boarding": 2, "brick": 1, "": 5}
HOSTS = ("bed", "sofa", "board", "storage")  # roles of what stands before such a wall, the first that stands at one


def floor_slot(room: RoomData) -> str:
    """The material slot of the room's floor."""
    row, style = vocabulary().room_type(room.graph.room.type), vocabulary().known_style(room.graph.room.style)
    typical = row.flooring and (row.use or drawn(room, "floor", THIRD) == 0)
    kinds = FLOORS.get(row.flooring, (row.flooring,)) if typical else style.floors if style else FLOORS["wood"]
    return kinds[drawn(room, "kind of floor", len(kinds))]


def covered_walls(room: RoomData) -> dict[str, str]:
    """Name of a wall -> the slot of what covers it, for walls that are not plain: tiles where it is wet, `COVERS`."""
    size, position, yaw = (np.asarray(v, float) for v in (room.boxes.size, room.boxes.position, room.boxes.yaw))
    every, rows = walls_of(room.corners), [vocabulary().category(node.category) for node in room.graph.nodes]
    found = (behind(size[k], position[k], float(yaw[k]), every) for k in range(len(rows)))
    at_walls = [(row, wall_name(at[0].edge)) for row, at in zip(rows, found, strict=True) if at]
    use = vocabulary().room_type(room.graph.room.type).use
    if use == "wet" and room.options.walls:
        if any(row.task == "cook" for row, _ in at_walls):
            return {wall: "wall_tiles" for row, wall in at_walls if row.stands == "row"}
        return {wall_name(edge): "wall_tiles" for edge in range(len(room.corners))}
    style = vocabulary().known_style(room.graph.room.style)
    words = style.covers if style else [word for word, often in COVERS.items() for _ in range(often)]
    cover = words[drawn(room, "cover", len(words))] if room.options.walls and use != "outdoor" else ""
    longest = wall_name(int(edge_lengths(room.corners).argmax()))
    hosts = [wall for role in HOSTS for row, wall in at_walls if row.role == role]
    return {[*hosts, longest][0]: cover} if cover else {}


def drawn(room: RoomData, what: str, among: int) -> int:
    """A number below `among` that the seed draws for a room."""
    key = f"{room.provenance.seed} {what} {room.graph.room.type}".encode()
    return int.from_bytes(hashlib.blake2b(key, digest_size=4).digest(), "big") % among


LEAF = 320.0  # kg/m³ of a door's leaf


@dataclass(frozen=True, eq=False)
class ShellMesh:
    """One mesh of the shell, ready to be written: prim path, material, surface, whether things bump into it."""

    path: str
    look: str
    form: Surface
    solid: bool


@dataclass(frozen=True, eq=False)
class ShellPrim:
    """A part of the shell with its meshes; a door or a window stands below its wall, a leaf below its door.

    What has a joint has its origin at the joint's anchor; `mass` of it is that of its body.
    """

    path: str
    label: str
    kind: str
    meshes: tuple[ShellMesh, ...]
    extent: np.ndarray
    joint: Joint | None = None
    mass: Mass | None = None

    @property
    def at(self) -> np.ndarray:
        """(3,) float, its origin in the frame of the part above, metres."""
        return np.array(self.joint.anchor) if self.joint else np.zeros(3)


def shell_prims(room: RoomData, bare: frozenset[str] = frozenset(), cuts: Sequence[Opening] = ()) -> list[ShellPrim]:
    """All parts of a room's shell, walls before what is in them; `bare`: windows that need no curtain rail, `cuts`:
    recesses of the walls."""
    parts = [slab("Floor", room.floor, -THICKNESS)]
    if room.options.walls:
        parts += walls_of_room(room.graph, room.corners, room.height, room.provenance.seed, bare, cuts)
    if room.options.ceiling:
        parts.append(slab("Ceiling", room.corners, room.height))
    if (look := millwork(room.graph, room.provenance.seed).beams) and room.options.walls and room.height >= COVED:
        size, position, yaw = (np.asarray(v, float) for v in (room.boxes.size, room.boxes.position, room.boxes.yaw))
        tall = position[:, 1] + size[:, 1] > room.height - BEAM[1]
        plans = shapely.polygons(footprints(size, position, yaw)[tall])
        bars = beams(room.corners, room.height, shapely.union_all(plans).buffer(0.05))
        if bars:
            pieces = (ShellPiece(piece_name("Beams", "mesh"), look, joined(bars)),)
            parts.append(ShellPart("Beams", "beam", pieces))
    coverings = {"Floor": floor_slot(room)} | covered_walls(room)
    forms = iter(surfaces([form for part in parts for form in _forms(part, coverings)]))
    return [prim for part in parts for prim in _prims(part, SHELL, Kind.Tokens.component, forms)]


def shell_layer(built: Sequence[ShellPrim], data: Mapping[str, Any], openings: Sequence[Opening] = ()) -> Sdf.Layer:
    """`layers/shell.usdc`: floor, walls and what is in them, as meshes, and what each opening of the graph became.

    `data`: customLayerData. `openings`: of the graph, which point to their wall, frame and leaf.
    """
    pen = Pen.blank("Room", ".usdc", data)
    for part in built:
        values: dict[str, Any] = {"float3[] extentsHint": np.asarray(part.extent, np.float32)}
        if part.joint:  # a pivot to turn
            values |= ops(translate=("double3", part.joint.anchor), rotateY=("float", 0.0))
        pen.define(part.path, "Xform", values, ["GeomModelAPI"], kind=part.kind)
        if part.label:
            pen.label(part.path, category=part.label, ade20k=ade20k(part.label))
        for mesh in part.meshes:
            assets.write_mesh(pen, mesh.path, mesh.form)
    paths = {path for part in built for path in (part.path, *(mesh.path for mesh in part.meshes))}
    for opening in openings:
        wall = wall_name(opening.edge)
        name = piece_name(wall, opening.name)
        inside = f"{SHELL}/{wall}/{name}"
        ends = {
            encoding.WALL: f"{SHELL}/{wall}",
            encoding.FRAME: f"{inside}/{piece_name(name, 'frame')}",
            encoding.LEAF: f"{inside}/{piece_name(name, 'hinge')}",
        }
        if ends[encoding.WALL] in paths:
            there = {f"rel {relationship}": target for relationship, target in ends.items() if target in paths}
            pen.over(f"{OPENINGS}/{opening.name}", there)
    return pen.layer


def _prims(part: ShellPart, above: str, kind: str, forms: Iterator[Surface]) -> Iterator[ShellPrim]:
    path = f"{above}/{part.name}"
    meshes = tuple(ShellMesh(f"{path}/{piece.name}", piece.look, next(forms), piece.solid) for piece in part.pieces)
    within = Kind.Tokens.subcomponent if kind == Kind.Tokens.component else ""  # none below a subcomponent
    inner = [list(_prims(each, path, within, forms)) for each in part.inner]
    extents = np.stack([mesh.form.extent for mesh in meshes] + [prims[0].extent + prims[0].at for prims in inner])
    extent = np.stack([extents[:, 0].min(0), extents[:, 1].max(0)])
    mass = _mass([piece for piece in part.pieces if piece.solid], np.array(part.joint.anchor)) if part.joint else None
    yield ShellPrim(path, part.label, kind, meshes, extent, part.joint, mass)
    for prims in inner:
        yield from prims


def _forms(part: ShellPart, coverings: Mapping[str, str]) -> Iterator[tuple[Mesh, Mapping[str, np.ndarray], float]]:
    """What the surfaces of a part and of those inside are made from, in their frames; `coverings`: part -> slot."""
    for piece in part.pieces:
        mesh = Mesh(piece.mesh.vertices - part.joint.anchor, piece.mesh.faces) if part.joint else piece.mesh
        slot = coverings.get(part.name, piece.look) if piece.look == part.label else piece.look
        yield mesh, {slot: np.arange(len(mesh.faces))}, CREASE
    for inner in part.inner:
        yield from _forms(inner, coverings)


def _mass(pieces: Sequence[ShellPiece], at: np.ndarray) -> Mass:
    """Of a leaf, as light as a hollow door."""
    volume, middle, tensor = hull_moments([np.concatenate([piece.mesh.vertices for piece in pieces])])
    moments, axes = np.linalg.eigh(LEAF * volume * tensor)
    return Mass(round(LEAF * volume, 2), middle - at, moments, axes)
