"""What fills the openings and edges the walls: door frames and leaves, windows, skirting, curtain rails, as meshes.

All in a wall's own frame: u along the wall from its first corner, v up, w outwards from its inner face; metres.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import trimesh

from echomodel.openings import Opening

WALL = 0.15  # metres, thickness of walls
CASING, PROUD = 0.06, 0.012  # width of the trim around a door, and how far it stands before the wall
LINING = 0.03
LEAF = 0.04  # thickness of a door's leaf
GAP = 0.004
FRAME = 0.055  # width of a window's frame
SKIRTING = (0.08, 0.012)  # height, thickness
RAIL = (0.12, 0.09, 0.25)  # curtain rail: above the window, before the wall, beyond its sides


def board(u: tuple[float, float], v: tuple[float, float], w: tuple[float, float]) -> trimesh.Trimesh:
    """A box between two values of each coordinate."""
    low, high = np.array([u[0], v[0], w[0]]), np.array([u[1], v[1], w[1]])
    box = trimesh.creation.box(high - low)
    box.apply_translation((low + high) / 2)
    return box


def door_frame(opening: Opening, wall: float = WALL, *, both: bool = True) -> trimesh.Trimesh:
    """Lining of the hole in a wall of this thickness, and the trim around it, on both sides or on the inner one."""
    far = wall + PROUD if both else wall
    start, end, top = opening.offset, opening.end, opening.height
    boards = [
        board((start, start + LINING), (0, top), (-PROUD, far)),
        board((end - LINING, end), (0, top), (-PROUD, far)),
        board((start + LINING, end - LINING), (top - LINING, top), (-PROUD, far)),
    ]
    for w in ((-PROUD, 0.0), (wall, far))[: 1 + both]:
        boards.append(board((start - CASING, start), (0, top + CASING), w))
        boards.append(board((end, end + CASING), (0, top + CASING), w))
        boards.append(board((start, end), (top, top + CASING), w))
    return joined(boards)


def door_leaf(opening: Opening, wall: float = WALL) -> trimesh.Trimesh:
    """The closed leaf with two panels on each side, flush with the side that it opens to."""
    start, end = opening.offset + LINING + GAP, opening.end - LINING - GAP
    low, top = 0.008, opening.height - LINING - GAP
    w = 0.0 if opening.swing == "in" else wall - LEAF
    boards = [board((start, end), (low, top), (w, w + LEAF))]
    middle = low + 0.42 * (top - low)
    for below, above in ((low + 0.14, middle - 0.06), (middle + 0.06, top - 0.12)):
        if end - start > 0.4 and above - below > 0.2:
            inner = (start + 0.12, end - 0.12)
            boards += [board(inner, (below, above), side) for side in ((w - 0.006, w), (w + LEAF, w + LEAF + 0.006))]
    return joined(boards)


def door_handle(opening: Opening, left_first: bool, wall: float = WALL) -> trimesh.Trimesh:
    """A lever on both sides of the leaf, away from the hinges.

    Arguments:
        opening: the door.
        left_first: whether someone inside who looks at the wall has its first corner on the left.
        wall: its thickness, metres.
    """
    hinge_first = _hinge_first(opening, left_first)
    at = opening.end - LINING - 0.07 if hinge_first else opening.offset + LINING + 0.07
    toward = -0.11 if hinge_first else 0.11
    w = 0.0 if opening.swing == "in" else wall - LEAF
    level = min(1.03, 0.5 * opening.height)
    boards = []
    for near, far in ((w - 0.05, w), (w + LEAF, w + LEAF + 0.05)):
        lever = (near, near + 0.016) if near < w else (far - 0.016, far)
        boards.append(board((at - 0.009, at + 0.009), (level - 0.009, level + 0.009), (near, far)))
        boards.append(board((min(at, at + toward), max(at, at + toward)), (level - 0.009, level + 0.009), lever))
    return joined(boards)


def hinge_line(opening: Opening, left_first: bool, wall: float = WALL) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(3,) each: foot of the line that a leaf turns about, and the unit vectors along it when closed and when open.

    Arguments: see `door_handle`.
    """
    first = _hinge_first(opening, left_first)
    u = opening.offset + LINING + GAP if first else opening.end - LINING - GAP
    inwards = opening.swing == "in"
    closed = np.array([1.0 if first else -1.0, 0.0, 0.0])
    return np.array([u, 0.0, 0.0 if inwards else wall]), closed, np.array([0.0, 0.0, -1.0 if inwards else 1.0])


def _hinge_first(opening: Opening, left_first: bool) -> bool:
    """Whether the hinges are at the jamb that the wall's first corner is nearer to."""
    return (opening.hinge == "left") == left_first


def window_frame(opening: Opening) -> trimesh.Trimesh:
    """The frame in the middle of the wall, with a bar in the middle of a wide window."""
    w = (0.05, 0.11)
    start, end, low, top = opening.offset, opening.end, opening.sill, opening.sill + opening.height
    boards = [
        board((start, start + FRAME), (low, top), w),
        board((end - FRAME, end), (low, top), w),
        board((start + FRAME, end - FRAME), (low, low + FRAME), w),
        board((start + FRAME, end - FRAME), (top - FRAME, top), w),
    ]
    if opening.width > 1.05:
        middle = (start + end) / 2
        boards.append(board((middle - FRAME / 2, middle + FRAME / 2), (low + FRAME, top - FRAME), w))
    return joined(boards)


def window_glass(opening: Opening) -> trimesh.Trimesh:
    """One pane behind the frame."""
    u = (opening.offset + FRAME / 2, opening.end - FRAME / 2)
    return board(u, (opening.sill + FRAME / 2, opening.sill + opening.height - FRAME / 2), (0.078, 0.084))


def window_sill(opening: Opening) -> trimesh.Trimesh:
    """The board below a window, a little into the room."""
    return board((opening.offset - 0.05, opening.end + 0.05), (opening.sill - 0.03, opening.sill), (-0.04, 0.0))


def curtain_rail(opening: Opening, length: float, height: float) -> trimesh.Trimesh | None:
    """A rail above a window with two holders, None where the ceiling is too near."""
    above, before, beyond = RAIL
    level = opening.sill + opening.height + above
    if level > height - 0.05:
        return None
    start, end = max(opening.offset - beyond, 0.02), min(opening.end + beyond, length - 0.02)
    rod = trimesh.creation.cylinder(0.012, end - start, sections=12)
    rod.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (0, 1, 0)))
    rod.apply_translation(((start + end) / 2, level, -before))
    holders = [
        board((at - 0.008, at + 0.008), (level - 0.008, level + 0.008), (-before, 0.0))
        for at in (start + 0.06, end - 0.06)
    ]
    return joined([rod, *holders])


def skirting(openings: Sequence[Opening], length: float) -> trimesh.Trimesh | None:
    """Boards along the foot of a wall, but for its doors and passages; None where nothing is left."""
    tall, thick = SKIRTING
    holes = sorted((o.offset, o.end, CASING if o.kind == "door" else 0.0) for o in openings if o.sill <= tall)
    boards, at = [], 0.0
    for start, end, trim in [*holes, (length, length, 0.0)]:
        if start - trim - at > 0.01:
            boards.append(board((at, start - trim), (0.0, tall), (-thick, 0.0)))
        at = max(at, end + trim)
    return joined(boards) if boards else None


def joined(boards: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    """Several meshes as one."""
    mesh = trimesh.util.concatenate(boards)
    assert isinstance(mesh, trimesh.Trimesh)
    return mesh
