"""Cameras that belong to a room: a view from above and one from a corner."""

from collections.abc import Sequence

import numpy as np
from pxr import Gf

from echomodel.late import Late
from echomodel.openings import inward_normal, segment
from echomodel.triangles import bounds_of
from echomodel.vocabulary import vocabulary
from echousd.draw.sight import ASPECT, Furniture
from echousd.draw.views import APERTURE, FOCAL_LENGTH, MARGIN, inside_view, shifted
from echousd.room import RoomData
from echousd.shapes import walls
from echousd.stage.pen import Pen, ops

perspective_views = Late("echousd.draw.outside:perspective_views")
FAR = 10.0  # widths of the room that the camera above is away: heights hardly show
TENTHS = 0.01  # what a millimetre is in USD's lens unit, tenths of a scene unit, here of a metre
MAIN = ("bed", "sofa", "board", "screen", "cook")  # roles, a task: what a picture is about, the first that is there


def main_piece(room: str, categories: Sequence[str], furniture: Furniture) -> int | None:
    """Row of the largest bed, else sofa, table, screen or hob, what the room is known by first; None without one."""
    signs = vocabulary().room_type(room).signs
    kinds = [vocabulary().category(word) for word in categories]
    found = [
        (not {kind.name, kind.coarse}.intersection(signs), number, -furniture.size[row].prod(), row)
        for row, kind in enumerate(kinds) for number, word in enumerate(MAIN) if word in (kind.role, kind.task)
    ]  # fmt: skip
    return min(found)[-1] if found else None


def opening_boxes(room: RoomData, *, windows: bool) -> Furniture:
    """Windows, or doors and passages, as boxes of 2 cm at the inner side of their walls."""
    rows = []
    for opening in (one for one in room.graph.room.openings if (one.kind == "window") is windows):
        x, z = segment(room.corners, opening).mean(0)
        yaw = np.arctan2(*inward_normal(room.corners, opening.edge))
        rows.append((opening.width, opening.height, 0.02, x, opening.sill, z, yaw))
    table = np.array(rows, float).reshape(-1, 7)
    return Furniture(table[:, :3], table[:, 3:6], table[:, 6])


def write_cameras(
    pen: Pen, points: np.ndarray, furniture: Furniture, walled: np.ndarray | None = None,
    hung: Furniture | None = None, openings: tuple[Furniture | None, Furniture | None] = (None, None),
    main: int | None = None,
) -> None:  # fmt: skip
    """Author `/Room/Cameras/top` (from afar, the front, +X, up in the picture) and `/Room/Cameras/perspective`.

    Arguments:
        pen: writes the cameras.
        points: what is seen, see `room_points`. furniture: as of `perspective_views`.
        walled: corners of the floor of a room with walls; its perspective camera stands inside.
        hung: what hangs or stands at the walls and must not fill that camera's picture.
        openings: boxes of windows, and of doors. main: row of the furniture that this camera has whole in its picture.
    """
    pen.define("/Room/Cameras", "Scope")
    # from afar rather than orthographic, whose width Blender takes for ten times what it is
    lower, upper = bounds_of(points)
    centre = (lower + upper) / 2
    width = float((upper - lower)[[0, 2]].max()) * MARGIN
    height = float(upper[1]) + FAR * width
    above = (float(centre[0]), height, float(centre[2]))
    top = {
        "float focalLength": FAR * APERTURE * TENTHS, "float horizontalAperture": APERTURE * TENTHS,
        "float verticalAperture": APERTURE * TENTHS, "float focusDistance": height,
        "float2 clippingRange": (0.5 * FAR * width, height + 1.0),
        **ops(translate=("double3", above), rotateY=("float", -90.0), rotateX=("float", -90.0)),
    }  # fmt: skip
    pen.define("/Room/Cameras/top", "Camera", top)
    if walled is not None:
        matrix, lens, near = inside_view(walled, furniture, float(upper[1]), hung, *openings, main)
    else:
        matrix, lens, near = perspective_views(points, furniture)[0], FOCAL_LENGTH, 0.0
    side, slope = (-float(matrix[:3, 0] @ matrix[:3, 2]), float(matrix[:3, 1] @ matrix[:3, 2]))  # 0 without a shift
    sharp = centre if main is None else furniture.corners[main].mean(0)
    camera = {
        **ops(transform=("matrix4d", Gf.Matrix4d(np.ascontiguousarray(shifted(matrix, -slope, -side).T)))),
        "float focalLength": lens * TENTHS, "float horizontalApertureOffset": side * lens * TENTHS,
        "float verticalApertureOffset": -slope * lens * TENTHS,
        "float horizontalAperture": APERTURE * TENTHS,
        "float verticalAperture": APERTURE * TENTHS / (1.0 if walled is None else ASPECT),
        "float focusDistance": float(np.linalg.norm(matrix[:3, 3] - sharp)),
        "float2 clippingRange": (max(near, 0.05), 4 * float(np.linalg.norm(matrix[:3, 3] - centre)) + 10.0),
    }  # fmt: skip
    pen.define("/Room/Cameras/perspective", "Camera", camera)


def room_points(room: RoomData) -> np.ndarray:
    """(n, 3) float, metres: corners of the floor (and the walls) and of all boxes, in the frame of `/Room`."""
    boxes = (room.boxes.size, room.boxes.position, room.boxes.yaw)
    points = [Furniture(*(np.asarray(values, float) for values in boxes)).corners.reshape(-1, 3)]
    points += [np.insert(room.floor, 1, height, axis=1) for height in (-walls.THICKNESS, 0.0)]
    if room.options.walls:
        outer = walls.outline(room.corners, room.graph.room.walls)
        points += [np.insert(outer, 1, height, axis=1) for height in (-walls.THICKNESS, room.height)]
    if room.options.ceiling:
        points.append(np.insert(room.floor, 1, room.height + walls.THICKNESS, axis=1))
    return np.concatenate(points)
