"""The shell of a room: its floor, and walls with doors and windows, solid between mitred corners."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from echomodel.furniture.solids import Joint
from echomodel.late import lates
from echomodel.openings import Opening, direction, edge_lengths, inward_normal, signed_area
from echomodel.triangles import Mesh, joined
from echomodel.vocabulary import vocabulary
from echousd.graph import SceneGraph
from echousd.shapes import fittings
from echousd.shapes.fittings import DADO, NICHE, PLAIN, WALL, Millwork, millwork_of
from echousd.stage.paths import piece_name

bay_window, door_glass, door_track, stands_out = lates(
    "echousd.shapes.bays", "bay_window", "door_glass", "door_track", "stands_out"
)

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
    inner: "tuple[ShellPart, ...]" = ()  # parts that belong to it
    joint: Joint | None = None  # how it moves against the part that it belongs to, None = not at all

    @property
    def everything(self) -> tuple[ShellPiece, ...]:
        """Its meshes and those of all parts that belong to it."""
        return sum((part.everything for part in self.inner), self.pieces)


def walls(
    polygon: np.ndarray, height: float, openings: Sequence[Opening] = (), bare: frozenset[str] = frozenset(),
    *, outdoor: bool = False, thickness: Sequence[float] = (), millwork: Millwork = PLAIN, cuts: Sequence[Opening] = (),
) -> list[ShellPart]:  # fmt: skip
    """`Wall_1` ... for the edges of the floor, with skirting, and a part for every door and window in it.

    Arguments:
        polygon: (k, 2) float, corners (x, z) of the floor, metres, in the turn that the openings count edges in.
        height: of the room, metres.
        openings: in these walls. bare: names of the windows that have no curtain rail.
        outdoor: walls without an opening are parapets.
        thickness: of the wall along each edge, metres; those of a home, which has other rooms behind them.
        millwork: how doors, windows and mouldings are made. cuts: `NICHE` deep into these walls.
    """
    deep = np.array(thickness or [WALL] * len(polygon))
    bay, parts = stands_out(polygon, openings) if millwork.bay and not outdoor else None, []
    for edge, length in enumerate(edge_lengths(polygon).tolist()):
        if length < 1e-3:
            continue
        name = wall_name(edge)
        here = [opening for opening in openings if opening.edge == edge]
        frame = wall_frame(polygon, edge)
        tall = min(height, PARAPET) if outdoor and not here else height
        sunk, below = [cut for cut in cuts if cut.edge == edge], -THICKNESS
        pieces, boards = list[ShellPiece](), {"skirting": fittings.skirting(here, length, millwork.skirting)}
        if millwork.dado:
            below = DADO[1]
            mesh = _wall(polygon, edge, (-THICKNESS, below), here, deep, sunk)
            pieces.append(ShellPiece(piece_name(name, "dado"), millwork.dado, _placed(mesh, frame)))
            boards["dado_rail"] = fittings.skirting([*here, *sunk], length, *DADO[::-1])
        mesh = _wall(polygon, edge, (below, tall), here, deep, sunk)
        pieces.append(ShellPiece(piece_name(name, "mesh"), "wall", _placed(mesh, frame)))
        for what, made in ((what, made) for what, made in boards.items() if made is not None):
            pieces.append(ShellPiece(piece_name(name, what), "trim", _placed(made, frame), solid=False))
        if millwork.cornice and tall == height >= COVED:
            coving = _cornice(polygon, edge, height, millwork.cornice)
            pieces.append(ShellPiece(piece_name(name, "cornice"), "trim", coving, solid=False))
        inner = []
        for opening in here:
            own, rail = replace(millwork, bay=opening == bay), 0.0 if opening.name in bare else height
            inner.append(_filled(name, opening, frame, length, rail, float(deep[edge]), own, both=not thickness))
        parts.append(ShellPart(name, "wall", tuple(pieces), tuple(inner)))
    return parts


def walls_of_room(
    graph: SceneGraph, corners: np.ndarray, height: float, seed: int, bare: frozenset[str] = frozenset(),
    cuts: Sequence[Opening] = (),
) -> list[ShellPart]:  # fmt: skip
    """The `walls` of a room as its seed makes them; `corners`: (k, 2) float of its floor, metres."""
    spec, outdoor = graph.room, vocabulary().room_type(graph.room.type).use == "outdoor"
    made, deep = millwork(graph, seed), spec.walls
    return walls(corners, height, spec.openings, bare, outdoor=outdoor, thickness=deep, millwork=made, cuts=cuts)


def millwork(graph: SceneGraph, seed: int) -> Millwork:
    """How the doors and windows of a room are made, as its seed draws it; in a home all are alike."""
    if graph.room.walls:
        return PLAIN
    slept = any(vocabulary().category(node.category).role == "bed" for node in graph.nodes)
    use = vocabulary().room_type(graph.room.type).use
    made = millwork_of(seed, graph.room.style, private=slept or use == "wet")
    return replace(made, dado="") if use else made


def wall_name(edge: int) -> str:
    """Name of the prim of the wall along an edge of the floor."""
    return f"Wall_{edge + 1}"


def slab(name: str, polygon: np.ndarray, bottom: float) -> ShellPart:
    """A floor or ceiling `THICKNESS` thick from a height upwards, labelled by its name."""
    mesh = fittings.upright(polygon, bottom, bottom + THICKNESS)
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


def _wall(
    polygon: np.ndarray, edge: int, span: tuple[float, float], openings: Sequence[Opening], thickness: np.ndarray,
    cuts: Sequence[Opening],
) -> Mesh:  # fmt: skip
    """The wall between two heights with its holes and recesses, in its own frame."""
    length = float(edge_lengths(polygon)[edge])
    face = shapely.box(0.0, span[0], length, span[1])
    for opening in openings:
        low = opening.sill if opening.sill > 0 else 0.0
        face = face.difference(shapely.box(opening.offset, low, opening.end, min(low + opening.height, span[1])))
    backs = []
    for cut in cuts:
        low, high = np.clip((cut.sill, cut.sill + cut.height), *span).tolist()
        if high > low:
            face = face.difference(shapely.box(cut.offset, low, cut.end, high))
            backs.append(fittings.board((cut.offset, cut.end), (low, high), (NICHE, float(thickness[edge]))))
    pieces = [p for p in getattr(face, "geoms", [face]) if p.area > 1e-6]
    mesh = joined([*(fittings.extruded(p, thickness[edge]) for p in pieces), *backs])
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
    wall: str, opening: Opening, frame: np.ndarray, length: float, height: float, deep: float, millwork: Millwork,
    *, both: bool,
) -> ShellPart:  # fmt: skip
    """What stands in an opening; passages have a frame and nothing else.

    `height`: below which a rail must be. `deep`: thickness of the wall. `both`: trim on its far side, too.
    """
    name = f"{wall}_{opening.name}"

    def made(what: str, look: str, mesh: Mesh | None, solid: bool = True) -> tuple[ShellPiece, ...]:
        return () if mesh is None else (ShellPiece(piece_name(name, what), look, _placed(mesh, frame), solid),)

    if opening.kind == "window":
        look, glass = "trim" if millwork.boxed else "rail", [fittings.window_glass(opening)]
        panes, board, body = fittings.window_frame(opening, millwork.window), None, None
        if millwork.bay:
            panes, glass, board, body = bay_window(opening, millwork.window, deep)
        pieces = (
            *made("frame", "trim", panes),
            *made("board", "trim", board),
            *made("body", "wall", body),
            *(one for number, pane in enumerate(glass) for one in made(f"glass{number or ''}", "glass", pane)),
            *made("sill", "trim", fittings.window_sill(opening) if opening.sill else None),
            *made("rail", look, fittings.curtain_rail(opening, length, height, boxed=millwork.boxed), solid=False),
        )
        return ShellPart(name, "window", pieces)
    if opening.kind != "door":
        return ShellPart(name, "door", made("frame", "trim", fittings.door_frame(opening, deep, both=both)))
    hinge_first = (opening.hinge == "left") == (np.linalg.det(frame[:3, :3]) < 0)
    way = fittings.slid(opening, hinge_first, length)
    leaf = made("leaf", "door_leaf", fittings.door_leaf(opening, deep, millwork.door))
    if millwork.door == "glazed":
        leaf += made("pane", "glass", door_glass(opening, deep), solid=False)
    handle = made("handle", "rail", fittings.door_handle(opening, hinge_first, deep), solid=False)
    joint = _joint(opening, frame, hinge_first, deep, way)
    hinge = ShellPart(piece_name(name, "hinge"), "", (*leaf, *handle), joint=joint)
    frames = made("frame", "trim", fittings.door_frame(opening, deep, both=both))
    switch = made("switch", "trim", fittings.light_switch(opening, hinge_first, length), solid=False)
    track = made("track", "rail", door_track(opening, way) if way else None)
    return ShellPart(name, "door", (*frames, *switch, *track), (hinge,))


def _joint(opening: Opening, frame: np.ndarray, hinge_first: bool, deep: float, way: float) -> Joint:
    """How a door's leaf turns about its edge, by a right angle to the side that it opens to, or slides its `way`."""
    out, inset = opening.swing == "out", fittings.LINING + fittings.GAP
    u = opening.offset + inset if hinge_first else opening.end - inset
    anchor = tuple((frame[:3, :3] @ (u, 0.0, deep if out else 0.0) + frame[:3, 3]).round(6).tolist())
    if way:
        return Joint("hinge", "prismatic", tuple((np.sign(way) * frame[:3, 0]).round(6).tolist()), anchor, abs(way))
    turn = np.sign(np.linalg.det(frame[:3, :3])) * (1.0 if hinge_first != out else -1.0)  # from closed to open
    return Joint("hinge", "revolute", (0.0, float(turn), 0.0), anchor, np.pi / 2)


def _placed(mesh: Mesh, frame: np.ndarray) -> Mesh:
    """The mesh in the room's frame; a frame of the other hand turns the faces back."""
    inside_out = np.linalg.det(frame[:3, :3]) < 0
    return Mesh(mesh.vertices @ frame[:3, :3].T + frame[:3, 3], mesh.faces[:, ::-1] if inside_out else mesh.faces)
