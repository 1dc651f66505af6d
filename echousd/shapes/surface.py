"""Surfaces ready to be shown: triangles with creased normals, texture coordinates and material groups."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from echomodel.triangles import Mesh, along, area_normals, bounds_of, connected_pieces, lengths
from echousd.shapes.finishes.slots import SLOTS, UPRIGHT, metres_of
from echousd.shapes.geometry import CREASE, DRAPED

EDGE = 0.08  # metres from the sides of cloth within which all of it hangs, and from that on to where none does
# Of a picture of rows: the share of one that is plain, at its head; metres by which boards differ that have others.
HEAD, ALIKE = 0.02, 1e-4
UP = (0.0, 1.0, 0.0)  # the normal of triangles without area
NUDGE = 4e-6  # metres between points of different boards at one place
ATLAS = 1024, 2  # texels along a side and between charts, of pieces that are unwrapped without overlaps


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles with indexed corner attributes, as UsdGeomMesh stores them."""

    points: np.ndarray  # (v, 3) float32, metres
    faces: np.ndarray  # (f, 3) int32, indices into points, counter-clockwise seen from outside
    normals: np.ndarray  # (k, 3) float32 unit vectors
    normal_index: np.ndarray  # (3 f) int32, of every face corner, or (f) int32, of every face, all of whose edges show
    st: np.ndarray  # (t, 2) float32
    st_index: np.ndarray  # (3 f) int32
    # material group -> (m,) int32 face numbers; together they name every face exactly once
    groups: Mapping[str, np.ndarray]

    @property
    def extent(self) -> np.ndarray:
        """(2, 3) float32: lower and upper corner."""
        return bounds_of(self.points).astype(np.float32)


def surfaces(forms: Sequence[tuple[Mesh, Mapping[str, np.ndarray], float]], *, atlas: bool = False) -> list[Surface]:
    """Meshes with normals and texture coordinates, all at once: of boards each alone takes several times as long.

    `forms`: triangles in metres; material group -> face numbers; neighbours that fold more sharply than this keep a
    hard edge, radians. `atlas`: unwrap without overlaps into the unit square (xatlas, extra `texture`) instead of
    projecting along the axes, see `_laid_out`.
    """
    meshes = [(np.asarray(mesh.vertices), np.asarray(mesh.faces)) for mesh, _, _ in forms]
    first = np.cumsum([0, *(len(points) for points, _ in meshes)])
    start = np.cumsum([0, *(len(faces) for _, faces in meshes)])
    points = np.concatenate([points for points, _ in meshes])
    faces = np.concatenate([faces + offset for (_, faces), offset in zip(meshes, first, strict=False)])
    owner = np.repeat(np.arange(len(forms)), np.diff(start))
    sharpest = np.repeat([np.cos(crease) for _, _, crease in forms], np.diff(start))
    board = connected_pieces(faces, len(points))
    normals = _indexed(_corner_normals(points, faces, sharpest), 4, np.repeat(owner, 3))
    if atlas:
        from echousd.shapes.charts import charts

        laid = charts([[(mesh.vertices, mesh.faces)] for mesh, _, _ in forms], *ATLAS)
        st = [(places.astype(np.float32), index.astype(np.int32).ravel()) for _, index, places in laid]
    else:
        groups = [(slot, start[n] + members) for n, (_, own, _) in enumerate(forms) for slot, members in own.items()]
        st = _indexed(
            _laid_out(points, faces, groups, owner, board, sharpest <= np.cos(DRAPED)), 5, np.repeat(owner, 3)
        )
    apart = unshared(points.astype(np.float32), faces, np.repeat(np.arange(len(forms)), np.diff(first)), board)
    return [
        Surface(
            points=apart[first[n] : first[n + 1]],
            faces=np.asarray(meshes[n][1], np.int32),
            normals=normals[n][0],
            normal_index=normals[n][1],
            st=st[n][0],
            st_index=st[n][1],
            groups={name: np.asarray(index, np.int32) for name, index in sorted(own.items()) if len(index)},
        )
        for n, (_, own, _) in enumerate(forms)
    ]


def plain(meshes: Sequence[Mesh]) -> list[Surface]:
    """Meshes in one colour, all of whose edges show: for what is there to be bumped into."""
    size = lengths(normal := area_normals(np.concatenate([mesh.triangles for mesh in meshes])))[:, None]
    unit = np.where(size > 0, normal / np.maximum(size, 1e-30), UP)
    found = _indexed(unit, 4, np.repeat(np.arange(len(meshes)), [len(mesh.faces) for mesh in meshes]))
    nowhere = np.zeros((1, 2), np.float32)
    return [
        Surface(
            np.asarray(mesh.vertices, np.float32), np.asarray(mesh.faces, np.int32), *normals,
            nowhere, np.zeros(mesh.faces.size, np.int32), {},  # MuJoCo reads no texture coordinates but of each corner
        )
        for mesh, normals in zip(meshes, found, strict=True)
    ]  # fmt: skip


def creased_normals(mesh: Mesh, crease: float = CREASE) -> tuple[np.ndarray, np.ndarray]:
    """Corner normals, smooth within `crease` radians: ((k, 3) float32 values, (3 f) int32 indices)."""
    faces = np.asarray(mesh.faces)
    total = _corner_normals(np.asarray(mesh.vertices), faces, np.full(len(faces), np.cos(crease)))
    return _indexed(total, 4, np.zeros(len(total), int))[0]


def _corner_normals(points: np.ndarray, faces: np.ndarray, sharpest: np.ndarray) -> np.ndarray:
    """(3 f, 3): normals of the corners, smooth where faces look the same way by a cosine of `sharpest` (f,) or more."""
    area_normal = area_normals(points[faces])
    unit = area_normal / np.maximum(lengths(area_normal), 1e-20)[:, None]
    corner_vertex = faces.ravel()
    corner_face = np.repeat(np.arange(len(faces)), 3)
    order = np.argsort(corner_vertex, kind="stable")
    count = np.bincount(corner_vertex, minlength=len(points))
    first = np.concatenate([[0], np.cumsum(count)[:-1]])
    # every corner meets every corner of the same vertex
    fan = count[corner_vertex]
    here = np.repeat(np.arange(len(corner_vertex)), fan)
    step = np.arange(len(here)) - np.repeat(np.cumsum(fan) - fan, fan)
    other = order[np.repeat(first[corner_vertex], fan) + step]
    face, met = corner_face.take(here), corner_face.take(other)
    near = along(unit.T.take(face, 1), unit.T.take(met, 1)) >= sharpest.take(face)
    here, met = here[near], met[near]
    weights = area_normal.T.take(met, 1)
    total = np.stack([np.bincount(here, weight, len(corner_vertex)) for weight in weights], 1)
    length = np.sqrt(along(total.T, total.T))[:, None]
    total = np.where(length > 1e-12, total / np.maximum(length, 1e-12), unit[corner_face])
    flat = np.flatnonzero(length <= 1e-12)
    total[flat[np.linalg.norm(total[flat], axis=1) < 0.5]] = UP
    return total


def _laid_out(
    points: np.ndarray, faces: np.ndarray, groups: Sequence[tuple[str, np.ndarray]], owner: np.ndarray,
    board: np.ndarray, draped: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """(3 f, 2): texture coordinates of the corners for the patterns of our material slots.

    Along the axis that each face looks at most, divided by the metres that one picture of its slot covers; u runs along
    the longer side of every board (fibres do; bricks lie, however narrow a wall is), and boards begin at different
    places of the picture. Boards of slots whose picture is of the whole get all of it, or a row, on the side they show.

    `groups`: slots and the faces of each, of one mesh. `owner`, `board`: (f,) int, the numbers of each face's mesh and
    connected piece. `draped`: (f,) bool, whether it is cloth, which where it hangs has its picture from its front.
    """
    axis, way = facing_axis(points[faces])
    low, high = _corners(points[faces], board)
    extent = (high - low)[board]
    hangs = draped & ((thin := extent.argmin(1)) != 1)
    lies = draped & ~hangs
    axis[hangs], way[hangs] = thin[hangs], 1.0
    axis[lies], way[lies] = 1, 1.0
    st = _projected(points[faces], axis, way)
    hung, one, other = points[faces[lies]], low[board[lies], None], high[board[lies], None]
    away = hung - (one + other) / 2  # the picture of what lies runs on over its edges
    near = np.clip((np.abs(away) - (other - one) / 2) / EDGE + 2, 0, 1) * np.sign(away)
    st[lies] += (near * (other - hung)[..., 1:2])[..., [0, 2]] * (1, -1)
    every = np.arange(len(faces))
    across, along = np.array([2, 0, 0])[axis], np.array([1, 2, 1])[axis]
    turned = extent[every, along] > 1.05 * extent[every, across]
    for slot, members in groups:
        turned[members] &= slot not in UPRIGHT
    st[turned] = np.stack([st[turned][..., 1], -st[turned][..., 0]], -1)
    least = np.full(int(owner.max(initial=0)) + 1, len(board))
    np.minimum.at(least, owner, board)
    number = board - least[owner]  # among the boards of its mesh
    st += (np.stack([0.37 * number, 0.61 * number], 1) % 1.0)[:, None]
    for slot, members in groups:
        metres = metres_of(slot)
        if metres:
            st[members] /= metres
            continue
        own = extent[members, None]
        x, y, z = np.moveaxis((points[faces[members]] - low[board[members], None]) / np.maximum(own, 1e-9), -1, 0)
        if (rows := SLOTS[slot].rows) == 1:  # what lies shows its upper side, what hangs its front
            st[members] = np.stack([x, np.where(own.argmin(2) == 1, 1 - z, y)], -1)
        else:  # along the longer side of its front; its other sides have what is at the head
            upright = own[..., 1] > own[..., 0]
            down = np.where(upright, 1 - y, x) * np.where(axis[members, None] == 2, 1, HEAD)
            which = np.floor(own.sum(2) / ALIKE) % rows
            st[members] = np.stack([down, (which + np.where(upright, x, y)) / rows], -1)
    return st.reshape(-1, 2)


def unshared(points: np.ndarray, faces: np.ndarray, owner: np.ndarray, piece: np.ndarray) -> np.ndarray:
    """The points (v, 3) float32, where boards meet a few micrometres apart: validators take equal points for a fault.

    What lies at one place and belongs to several connected pieces of one mesh (`owner`: (v,) int) moves towards the
    middle of its own (`piece`: (f,) int, of each face); what belongs to one piece (both ends of a cord around a
    cushion) moves inwards, against its own faces.
    """
    rows = np.column_stack([points, owner])
    order = np.lexsort(rows.T)  # np.unique(axis=0) takes ten times as long
    place = np.zeros(len(points), int)
    place[order[1:]] = np.cumsum((rows[order[1:]] != rows[order[:-1]]).any(1))
    count = np.bincount(place)
    shared = np.flatnonzero(count[place] > 1)
    if not len(shared):
        return points
    board = np.full(len(points), -1)
    board[faces] = piece[:, None]
    (low, high), used = _corners(points[faces].astype(float), piece), board >= 0
    out = points.astype(float)
    seen: dict[int, list[int]] = {}
    times: Counter[tuple[int, int]] = Counter()
    for vertex in shared[used[shared]].tolist():
        boards = seen.setdefault(int(place[vertex]), [])
        if board[vertex] not in boards:
            boards.append(board[vertex])
        inwards = (low[board[vertex]] + high[board[vertex]]) / 2 - out[vertex]
        out[vertex] += NUDGE * boards.index(board[vertex]) * np.sign(inwards)
        again = (int(place[vertex]), int(board[vertex]))
        if times[again]:
            one, two, three = np.moveaxis(points[faces[(faces == vertex).any(1)]].astype(float), 1, 0)
            outwards = np.cross(two - one, three - one).sum(0)
            out[vertex] -= NUDGE * times[again] * outwards / max(float(np.linalg.norm(outwards)), 1e-20)
        times[again] += 1
    return out.astype(np.float32)


def _corners(triangles: np.ndarray, piece: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corners (p, 3) of the pieces that triangles (f, 3, 3) belong to, all from 0 on, (f,) int."""
    order = np.argsort(piece, kind="stable")
    first = 3 * np.searchsorted(piece[order], np.arange(piece.max(initial=-1) + 1))
    planes = np.ascontiguousarray(triangles[order].reshape(-1, 3).T)
    return np.minimum.reduceat(planes, first, 1).T, np.maximum.reduceat(planes, first, 1).T


def facing_axis(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(f,) int, the axis that each triangle (f, 3, 3) looks at most, and (f,) float, 1 or -1: which way."""
    normal = area_normals(triangles)
    axis = np.abs(normal).argmax(1)
    return axis, np.where(normal[np.arange(len(normal)), axis] < 0, -1.0, 1.0)


def box_projection(mesh: Mesh) -> np.ndarray:
    """(f, 3, 2) float: texture coordinates in metres along the axis that each face looks at most."""
    return _projected(mesh.triangles, *facing_axis(mesh.triangles))


def _projected(triangles: np.ndarray, axis: np.ndarray, way: np.ndarray) -> np.ndarray:
    facing = way[:, None]
    x, y, z = triangles[..., 0], triangles[..., 1], triangles[..., 2]
    u = np.choose(axis[:, None], [-z * facing, x, x * facing])
    v = np.choose(axis[:, None], [y, -z * facing, y])
    return np.stack([u, v], -1)


def _indexed(values: np.ndarray, digits: int, owner: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """For each owner of rows (n,) int: the different ones of its `values`, rounded, in lexicographic order, and for
    every row the number of its value.
    """
    whole = np.stack([owner, *np.rint(values.T * 10.0**digits).astype(np.int64)])
    low = whole.min(1)
    span = whole.max(1) - low + 1
    if float(np.prod(span.astype(float))) > 2**62:  # rows as one number each sort ten times as fast
        unique, index = np.unique(whole.T, axis=0, return_inverse=True)
    else:
        keys = np.ravel_multi_index(tuple(whole - low[:, None]), tuple(span))
        found, index = np.unique(keys, return_inverse=True)
        unique = np.stack(np.unravel_index(found, tuple(span)), 1) + low
    mine, rows = (np.searchsorted(each, np.arange(owner.max() + 2)) for each in (unique[:, 0], owner))
    number = (index.reshape(-1) - mine[owner]).astype(np.int32)
    value = (unique[:, 1:] / 10.0**digits).astype(np.float32)
    return [(value[mine[n] : mine[n + 1]], number[rows[n] : rows[n + 1]]) for n in range(len(mine) - 1)]
