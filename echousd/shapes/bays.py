"""What the shell of few rooms has: beams below the ceiling, a window that stands out, doors of glass or that slide."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from echomodel.openings import SLID, Opening, zone
from echomodel.triangles import Mesh, joined
from echousd.shapes.fittings import BEAM, TRACK, WALL, board, leaf_of, lights_of, upright, window_frame, window_glass

BAY = (0.35, 0.45)  # of a bay window: along the wall to where its front begins, and how far that is before it
BETWEEN = 1.0  # metres from one beam to the next
BROAD = 1.3  # metres, width of windows from which on one may stand out before its wall


def stands_out(polygon: np.ndarray, openings: Sequence[Opening]) -> Opening | None:
    """The widest window that can stand out before its wall."""
    around = shapely.Polygon(polygon).buffer(WALL, join_style="mitre")
    windows = [one for one in openings if one.kind == "window" and one.sill and one.width >= BROAD]
    free = [shapely.Polygon(zone(polygon, one, -WALL - BAY[1])).difference(around).area for one in windows]
    can = [one for one, area in zip(windows, free, strict=True) if area > 0.98 * one.width * BAY[1]]
    return max(can, key=lambda one: one.width, default=None)


def beams(polygon: np.ndarray, height: float, below: shapely.Geometry) -> list[Mesh]:
    """Beams along the shorter side of a room, where nothing is `below` that reaches up to them."""
    room, (low, high) = shapely.Polygon(polygon), (polygon.min(0), polygon.max(0))
    long, (wide, deep) = int(np.ptp(polygon, axis=0).argmax()), BEAM
    usual, free = max(round(float((high - low)[long]) / BETWEEN), 2), list[shapely.Geometry]()
    for count in (usual, usual + 1, usual - 1):
        strips = list[shapely.Geometry]()
        for middle in low[long] + (np.arange(count) + 0.5) / count * (high - low)[long]:
            ends = np.array([low, high])
            ends[:, long] = middle - wide / 2, middle + wide / 2
            cut = room.intersection(shapely.box(*ends.ravel()))
            strips += [one for one in getattr(cut, "geoms", [cut]) if one.area > 0]
        free = [one for one in strips if not one.intersects(below)]
        if len(free) == len(strips):
            break
    return [upright(np.array(one.exterior.coords)[:-1], height - deep, height) for one in free]


def bay_window(opening: Opening, kind: str, wall: float = WALL) -> tuple[Mesh, list[Mesh], Mesh, Mesh]:
    """Frame, panes, board, and what is below and above, of a window on three sides before a wall of some thickness."""
    lean, out = min(BAY[0], opening.width / 4), wall + BAY[1]
    start, end, low, top = opening.offset, opening.end, opening.sill, opening.sill + opening.height
    corners = np.array([(start, wall), (start + lean, out), (end - lean, out), (end, wall)])
    frames, panes = list[Mesh](), list[Mesh]()
    for corner, side in zip(corners, np.diff(corners, axis=0), strict=False):
        width = float(np.linalg.norm(side))
        (x, z), one = side / width, replace(opening, offset=0.0, width=width)
        turn, middle = np.array([(x, 0, z), (0, 1, 0), (-z, 0, x)]), np.array([0.0, 0.0, 0.08])
        for mesh, made in ((window_frame(one, kind), frames), (window_glass(one), panes)):
            made.append(Mesh((mesh.vertices - middle) @ turn + (corner[0], 0.0, corner[1]), mesh.faces))
    over = corners + np.array([(-0.05, 0.0), (-0.05, 0.05), (0.05, 0.05), (0.05, 0.0)])
    below = [upright(over, -0.1, low), upright(over, top, top + 0.12)]
    within = upright(np.array([(start, 0.0), *corners, (end, 0.0)]), low, low + 0.02)
    return joined(frames), panes, within, joined(below)


def door_glass(opening: Opening, wall: float = WALL) -> Mesh:
    """The pane of a glazed leaf."""
    start, end, low, top, (near, far) = leaf_of(opening, wall)
    return board(*lights_of(start, end, low, top), ((near + far) / 2 - 0.003, (near + far) / 2 + 0.003))


def door_track(opening: Opening, way: float) -> Mesh:
    """What a leaf slides below, as long as its `way` (`slid`)."""
    start, end, _, top, _ = leaf_of(opening, WALL)
    return board((start + min(way, 0.0), end + max(way, 0.0)), (top + 0.02, top + TRACK), (0.005 - SLID, 0.0))
