"""What a denoiser is told of floors and openings: padded floors, openings as padded rows, and features of both."""

from collections.abc import Sequence

import numpy as np

from echomodel.arrays import Array, at_least, at_most, cast, dot, full, kit, norm, picked
from echomodel.boxes import Boxes
from echomodel.boxes2d import axes
from echomodel.floors import edges, known, meeting, signed_area, signed_distance
from echomodel.openings import Opening, inward_normal, rectangle, segment

GRID = 6  # the floor's plan is told as signed distances at GRID x GRID places of its bounding box
FAR = 1e3  # metres: no wall is so far away
ROW = 10  # x0, z0, x1, z1 of the jambs, x and z of the inward normal, depth that stays free, sill, top, 1 = window
ROUND_ABOUT, NEAR, AWAY = 0.4, 0.08, 3.0  # metres: scales at which a gap is told
OPENING_FEATURES = 10 + 12
PLAN = 11


def centred(floor: Sequence[float] | Sequence[Sequence[float]] | np.ndarray | None) -> np.ndarray:
    """(k, 2) float32, corners of a floor about the centre of their bounding box; four times NaN where it is unknown.

    `floor`: None, two extents (x, z) of a rectangle, or k >= 3 corners (x, z) in any frame, metres.

    Raises ValueError for neither of these.
    """
    if floor is None:
        return np.full((4, 2), np.nan, np.float32)
    corners = np.asarray(floor, np.float64)
    if corners.shape == (2,):
        return rectangle(*corners.tolist()).astype(np.float32)
    if corners.ndim != 2 or corners.shape[1] != 2 or len(corners) < 3:
        raise ValueError(f"floor has shape {corners.shape}, expected (2,) extents or (k, 2) corners, k >= 3")
    return (corners - (corners.max(0) + corners.min(0)) / 2).astype(np.float32)


def padded(rows: Sequence[Array]) -> Array:
    """Corners or openings (s, k, c), of different numbers, behind one another, padded with NaN: (S, K, c)."""
    most, xp = max(part.shape[1] for part in rows), kit(rows[0])
    short = [full(part, (len(part), most - part.shape[1], part.shape[2]), np.nan) for part in rows]
    return xp.concat([xp.concat([part, rest], 1) for part, rest in zip(rows, short, strict=True)])


def trimmed(floor: Array) -> Array:
    """The same floors without needless padding; where all are unknown four corners remain."""
    most = int(kit(floor).isfinite(floor[..., 0]).sum(1).max()) if len(floor) else 0
    return floor[:, : most or 4]


def extents(floor: Array) -> Array:
    """(S, K, 2) corners -> (S, 2), x and z extent of the bounding box in metres, NaN where the floor is unknown."""
    xp, there = kit(floor), kit(floor).isfinite(floor)
    high = xp.amax(xp.where(there, floor, -np.inf), 1)
    low = xp.amin(xp.where(there, floor, np.inf), 1)
    return xp.where(there.any(1), high - low, np.nan)


def nearest_wall(points: Array, floor: Array) -> Array:
    """(M,) heading in radians of what stands at each point with its back to the wall nearest to it, 0 where unknown.

    Arguments:
        points: (M, 2) float32, x and z. floor: (M, K, 2) float32.
    """
    start, end = edges(floor)
    along, off = end - start, points[:, None] - start
    length = dot(along, along)
    t = at_most(at_least(dot(off, along) / at_least(length, 1e-9), 0.0), 1.0)
    away = off - t[..., None] * along
    wall = picked(along, (dot(away, away) + (length < 1e-9) * FAR**2).argmin(1))
    turn = 1.0 - 2 * cast(signed_area(floor) <= 0, floor)  # which side of the wall is inside
    return kit(floor).atan2(-wall[:, 1] * turn, wall[:, 0] * turn)


def wall_distances(points: Array, floor: Array) -> Array:
    """How far it is to the next wall along +x, -x, +z and -z in metres, 0 where there is none.

    Arguments:
        points: (M, 2) float32, x and z. floor: (M, K, 2) float32.

    Returns (M, 4) float32, 0 where the floor is unknown.
    """
    xp, (start, end) = kit(floor), edges(floor)
    out = []
    for axis in (1, 0):  # walls that cross the line through the point along the other axis
        level, own = points[:, None, axis], points[:, None, 1 - axis]
        crossed = (start[..., axis] > level) != (end[..., axis] > level)
        ahead = meeting(level, start, end, axis) - own
        for side in (1, -1):
            nearest = xp.amin(xp.where(crossed & (side * ahead > 0), side * ahead, FAR), 1)
            out.append(xp.where(nearest < FAR, nearest, 0.0))
    return xp.stack(out, 1)


def plan_features(floor: Array) -> Array:
    """What a floor looks like: (S, K, 2) -> (S, 6 + GRID^2), zeros where it is unknown.

    Extents in metres, their logarithms, whether they are known, and signed distances on a grid over the bounding box.
    """
    xp, extent = kit(floor), extents(floor)
    there = cast(known(floor), floor)[:, None]
    extent = xp.where(there > 0, extent, xp.ones_like(extent))
    steps = [(number + 0.5) / GRID - 0.5 for number in range(GRID)]
    places = cast([(x, z) for x in steps for z in steps], floor)[None] * extent[:, None]
    distance = xp.tanh(signed_distance(places, floor))
    return xp.concat([extent / 5 * there, xp.log(extent) * there, there, there, distance], 1)


def opening_rows(openings: Sequence[Opening], polygon: np.ndarray) -> np.ndarray:
    """(o, ROW) float32, metres, in the room frame of `Boxes`, whose origin is the middle of the floor's bounding box.

    Arguments:
        openings: of one room. polygon: (k, 2) float, corners (x, z) of its floor in any frame, metres.
    """
    corners = np.asarray(polygon, float)
    middle = (corners.max(0) + corners.min(0)) / 2 if len(openings) else np.zeros(2)
    rows = []
    for opening in openings:
        near, far = segment(corners, opening) - middle
        top, window = opening.sill + opening.height, float(opening.kind == "window")
        rows.append([*near, *far, *inward_normal(corners, opening.edge), opening.depth, opening.sill, top, window])
    return np.array(rows, np.float32).reshape(-1, ROW)


def room_features(rows: Array) -> tuple[Array, Array]:
    """Every opening as numbers (S, O, PLAN), zeros for padding, and which are there, (S, O) float32."""
    xp, there = kit(rows), kit(rows).isfinite(rows[..., 0])
    rows = xp.where(there[..., None], rows, xp.zeros_like(rows))
    width = norm(rows[..., 2:4] - rows[..., :2])[..., None]
    features = xp.concat([rows[..., :4] / 2, rows[..., 4:6], width, rows[..., 6:]], -1)
    return features, cast(there, rows)


def clearances(boxes: Boxes, rows: Array) -> Array:
    """How far each box keeps from the door or passage, and the window, that it comes nearest to, at several scales.

    Arguments:
        boxes: N boxes. rows: (N, O, ROW), openings of the room of each, NaN = none.

    Returns (N, OPENING_FEATURES) float32; zeros where there is no opening of the kind.
    """
    if not rows.shape[1]:
        return full(boxes.size, (len(boxes), OPENING_FEATURES), 0.0)
    there, window, beside, before, under = opening_gaps(boxes, rows)
    xp, out = kit(rows), []
    for mask, gaps in ((there & ~window, (beside, before)), (there & window, (beside, before, under))):
        clear = xp.maximum(*gaps[:2])
        nearest = xp.where(mask, clear, xp.full_like(clear, AWAY * 10)).argmin(1)
        some = cast(mask.any(1), clear)[:, None]
        chosen = xp.stack([picked(gap, nearest) for gap in (*gaps[:2], clear)], 1)
        features = [xp.tanh(chosen / scale) for scale in (AWAY, ROUND_ABOUT, NEAR)]
        features += [xp.tanh(picked(gap, nearest)[:, None] / s) for gap in gaps[2:] for s in (ROUND_ABOUT, NEAR)]
        out.append(xp.concat([xp.concat(features, 1) * some, some], 1))
    return xp.concat(out, 1)


def opening_gaps(boxes: Boxes, rows: Array) -> tuple[Array, Array, Array, Array, Array]:
    """(N, O) each: which openings there are and which are windows; how far each box stands beside, before and below."""
    xp, there = kit(rows), kit(rows).isfinite(rows[..., 0])
    rows = xp.where(there[..., None], rows, xp.zeros_like(rows))
    near, far, inward = rows[..., 0:2], rows[..., 2:4], rows[..., 4:6]
    length = xp.sqrt(at_least(dot(far - near, far - near), 1e-9))
    along = (far - near) / length[..., None]
    off = boxes.position[:, None, ::2] - (near + far) / 2
    half = boxes.size[:, None, ::2] / 2

    def reach(direction: Array) -> Array:
        return sum(abs(dot(direction, axis[:, None])) * half[..., side] for side, axis in enumerate(axes(boxes.yaw)))

    beside = abs(dot(off, along)) - reach(along) - length / 2
    before = dot(off, inward) - reach(inward) - rows[..., 6]
    under = rows[..., 7] - (boxes.position[:, 1] + boxes.size[:, 1])[:, None]
    return there, rows[..., 9] > 0.5, beside, before, under
