"""The shell of a room: its floor, and walls with doors and windows, solid between mitred corners."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import shapely

from echomodel.furniture.solids import Joint
from echomodel.openings import Opening, direction, edge_lengths, inward_normal, signed_area
from echomodel.triangles import Mesh, joined
from echousd.shapes import fittings
from echousd.shapes.fittings import PLAIN, WALL, Millwork
from echousd.stage.paths import piece_name

THICKNESS = 0.1  # metres, of floor and ceiling
COVED = 2.5  # metres, height of rooms from which on there may be a cornice
PARAPET = 1.05  # metres, height of a wall outdoors that nothing opens


@dataclass(frozen=True, eq=False)
class ShellPiece:
    """One mesh of the shell in the room's frame: its prim's name, its material, whether things bump into it."""

    name: str
    look: str
    mesh: Mesh
    solid: bool = True


@dataclass(frozen=True, eq=False)
class ShellPart:
    """A floor, wall, ceiling, door or window, or what of one moves."""

    name: str  # of its prim
    label: str  # what it is, "" for a part of what is labelled
    pieces: tuple[ShellPiece, ...]  # its meshes
    inner: tuple[ShellPart, ...] = ()  # parts that belong to it
    joint: Joint | None = None  # how it moves against the part that it belongs to, None = not at all


def walls(
    polygon: np.ndarray, height: float, openings: Sequence[Opening] = (), bare: frozenset[str] = frozenset(),
    *, outdoor: bool = False, thickness: Sequence[float] = (), millwork: Millwork = PLAIN,
) -> list[ShellPart]:  # fmt: skip
    """`Wall_1` ... for the edges of the floor, with skirting, and a part for every door and window in it.

    Arguments:
        polygon: (k, 2) float, corners (x, z) of the floor, metres, in the turn that the openings count edges in.
        height: of the room, metres.
        openings: in these walls. bare: names of the windows that have no curtain rail.
        outdoor: walls without an opening are parapets.
        thickness: of the wall along each edge, metres; those of a home, which has other rooms behind them.
        millwork: how doors, windows and mouldings are made.
    """
    corners = np.ascontiguousarray(polygon, float)
    return list(_walls(corners.tobytes(), height, tuple(openings), bare, outdoor, tuple(thickness), millwork))


@lru_cache(maxsize=4)  # furniture is moved away from them before they are written
def _walls(
    corners: bytes, height: float, openings: tuple[Opening, ...], bare: frozenset[str], outdoor: bool,
    thickness: tuple[float, ...], millwork: Millwork,
) -> tuple[ShellPart, ...]:  # fmt: skip
    polygon = np.frombuffer(corners).reshape(-1, 2)
    lengths = edge_lengths(polygon)
    deep = np.array(thickness or [WALL] * len(polygon))
    parts = []
    for edge, length in enumerate(lengths):
        if length < 1e-3:
            continue
        name = wall_name(edge)
        here = [opening for opening in openings if opening.edge == edge]
        frame = wall_frame(polygon, edge)
        tall = min(height, PARAPET) if outdoor and not here else height
        pieces = [ShellPiece(piece_name(name, "mesh"), "wall", _placed(_wall(polygon, edge, tall, here, deep), frame))]
        if (boards := fittings.skirting(here, float(length), millwork.skirting)) is not None:
            pieces.append(ShellPiece(piece_name(name, "skirting"), "trim", _placed(boards, frame), solid=False))
        if millwork.cornice and tall == height >= COVED:
            coving = _cornice(polygon, edge, height, millwork.cornice)
            pieces.append(ShellPiece(piece_name(name, "cornice"), "trim", coving, solid=False))
        left_first = signed_area(polygon) > 0
        inner = [
            _filled(
                name, opening, frame, float(length), 0.0 if opening.name in bare else height, left_first,
                float(deep[edge]), millwork, both=not thickness,
            )
            for opening in here
        ]  # fmt: skip
        parts.append(ShellPart(name, "wall", tuple(pieces), tuple(part for part in inner if part.pieces)))
    return tuple(parts)


def wall_name(edge: int) -> str:
    """Name of the prim of the wall along an edge of the floor."""
    return f"Wall_{edge + 1}"


def ceiling(polygon: np.ndarray, height: float) -> ShellPart:
    """A slab over the room, from the ceiling upwards."""
    return _slab("Ceiling", polygon, height)


def floor(polygon: np.ndarray) -> ShellPart:
    """A slab whose top is at height 0."""
    return _slab("Floor", polygon, -THICKNESS)


def _slab(name: str, polygon: np.ndarray, bottom: float) -> ShellPart:
    flat = shapely.Polygon(np.stack([polygon[:, 0], -polygon[:, 1]], 1))  # x right, -z up: seen from above
    slab = fittings.extruded(flat, THICKNESS)
    mesh = Mesh(slab.vertices[:, [0, 2, 1]] * (1, 1, -1) + (0, bottom, 0), slab.faces)
    return ShellPart(name, name.lower(), (ShellPiece(piece_name(name, "mesh"), name.lower(), mesh),))


def outline(polygon: np.ndarray, thickness: Sequence[float] | np.ndarray = ()) -> np.ndarray:
    """(k, 2) float, the outer corners of the walls: offsets of the edges by their thickness (k, metres) meet there."""
    count = len(polygon)
    deep = np.array(thickness if len(thickness) else [WALL] * count)[:, None]
    normals = np.array([-inward_normal(polygon, edge) for edge in range(count)])
    before = np.roll(normals, 1, axis=0)
    bisector = normals + before
    cosine = 1.0 + (normals * before).sum(1, keepdims=True)
    mitre = bisector / np.maximum(cosine, 0.35)  # very sharp corners are cut off
    own, last = deep, np.roll(deep, 1, axis=0)
    turn = np.maximum(2.0 - cosine, 0.35)  # walls of two thicknesses
    return np.asarray(polygon + (own + last) / 2 * mitre + (own - last) / 2 * (normals - before) / turn, float)


def wall_frame(polygon: np.ndarray, edge: int) -> np.ndarray:
    """(4, 4) float: a wall's own frame (u along, v up, w outwards) to the room's."""
    frame = np.eye(4)
    along, outward = direction(polygon, edge), -inward_normal(polygon, edge)
    frame[[0, 2], 0], frame[[0, 2], 2], frame[[0, 2], 3] = along, outward, polygon[edge]
    return frame


def _wall(polygon: np.ndarray, edge: int, height: float, openings: Sequence[Opening], thickness: np.ndarray) -> Mesh:
    """The wall with its holes, in its own frame."""
    length = float(edge_lengths(polygon)[edge])
    face = shapely.box(0.0, -THICKNESS, length, height)
    for opening in openings:
        low = opening.sill if opening.sill > 0 else 0.0
        face = face.difference(shapely.box(opening.offset, low, opening.end, min(low + opening.height, height)))
    pieces = [p for p in getattr(face, "geoms", [face]) if p.area > 1e-6]
    mesh = joined([fittings.extruded(p, thickness[edge]) for p in pieces])
    outer = outline(polygon, thickness)
    along = direction(polygon, edge)
    first = float((outer[edge] - polygon[edge]) @ along)
    last = float((outer[(edge + 1) % len(polygon)] - polygon[edge]) @ along)
    vertices = mesh.vertices
    far = vertices[:, 2] > thickness[edge] / 2
    vertices[far & (vertices[:, 0] < 1e-6), 0] = first
    vertices[far & (vertices[:, 0] > length - 1e-6), 0] = last
    return mesh


def _cornice(polygon: np.ndarray, edge: int, height: float, tall: float) -> Mesh:
    """A cove in the corner of a wall and the ceiling, mitred with those of the walls beside it."""
    turn, ends = np.linspace(0.0, np.pi / 2, 6), [edge, (edge + 1) % len(polygon)]
    cove = 1.0 - np.stack([0.85 * np.sin(turn), np.cos(turn)], 1)
    prism = fittings.extruded(shapely.Polygon([(0.0, 0.0), *cove, (0.0, 1.0)]), 1.0)
    into, down, end = prism.vertices.T  # shares of its width, height and length
    outer, inner = polygon[ends], outline(polygon, [-0.8 * tall] * len(polygon))[ends]
    flat = (outer + into[:, None, None] * (inner - outer))[np.arange(len(end)), end.astype(int)]
    faces = prism.faces if signed_area(polygon) > 0 else prism.faces[:, ::-1]
    return Mesh(np.insert(flat, 1, height - tall * down, axis=1), faces)


def _filled(
    wall: str, opening: Opening, frame: np.ndarray, length: float, height: float, left_first: bool, deep: float,
    millwork: Millwork, *, both: bool,
) -> ShellPart:  # fmt: skip
    """What stands in an opening; passages have a frame and nothing else.

    `height`: below which a rail must be. `deep`: thickness of the wall. `both`: trim on its far side, too.
    """
    name = f"{wall}_{opening.name}"

    def made(what: str, look: str, mesh: Mesh | None, solid: bool = True) -> tuple[ShellPiece, ...]:
        return () if mesh is None else (ShellPiece(piece_name(name, what), look, _placed(mesh, frame), solid),)

    if opening.kind == "window":
        look = "trim" if millwork.boxed else "rail"
        pieces = (
            *made("frame", "trim", fittings.window_frame(opening, millwork.window)),
            *made("glass", "glass", fittings.window_glass(opening)),
            *made("sill", "trim", fittings.window_sill(opening)),
            *made("rail", look, fittings.curtain_rail(opening, length, height, boxed=millwork.boxed), solid=False),
        )
        return ShellPart(name, "window", pieces)
    if opening.kind != "door":
        return ShellPart(name, "door", made("frame", "trim", fittings.door_frame(opening, deep, both=both)))
    leaf = made("leaf", "door_leaf", fittings.door_leaf(opening, deep, millwork.door))
    if millwork.door == "glazed":
        leaf += made("pane", "glass", fittings.door_glass(opening, deep), solid=False)
    handle = made("handle", "rail", fittings.door_handle(opening, left_first, deep), solid=False)
    hinge = ShellPart(piece_name(name, "hinge"), "", (*leaf, *handle), joint=_hinge(opening, frame, left_first, deep))
    frames = made("frame", "trim", fittings.door_frame(opening, deep, both=both))
    switch = made("switch", "trim", fittings.light_switch(opening, left_first, length), solid=False)
    return ShellPart(name, "door", (*frames, *switch), (hinge,))


def _hinge(opening: Opening, frame: np.ndarray, left_first: bool, deep: float) -> Joint:
    """How a door's leaf turns about its edge, by a right angle to the side that it opens to."""
    at, closed, opened = fittings.hinge_line(opening, left_first, deep)
    anchor = frame[:3, :3] @ at + frame[:3, 3]
    up = np.cross(frame[:3, :3] @ closed, frame[:3, :3] @ opened)  # from closed to open it turns about this
    return Joint("hinge", "revolute", (0.0, float(np.sign(up[1])), 0.0), tuple(anchor.round(6).tolist()), np.pi / 2)


def _placed(mesh: Mesh, frame: np.ndarray) -> Mesh:
    """The mesh in the room's frame; a frame of the other hand turns the faces back."""
    inside_out = np.linalg.det(frame[:3, :3]) < 0
    return Mesh(mesh.vertices @ frame[:3, :3].T + frame[:3, 3], mesh.faces[:, ::-1] if inside_out else mesh.faces)
