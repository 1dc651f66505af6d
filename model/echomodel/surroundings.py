"""What a denoiser is told of floors and openings: padded floors, openings as padded rows, and features of both."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.boxes2d import axes
from echomodel.floors import edges, footprint, known, meeting, signed_area, signed_distance
from echomodel.openings import STEP, WINDOW_DEPTH, Opening, inward_normal, rectangle, segment

GRID = 6  # the floor's plan is told as signed distances at GRID x GRID places of its bounding box
FAR = 1e3  # metres: no wall is so far away
ROW = 10  # x0, z0, x1, z1 of the jambs, x and z of the inward normal, depth that stays free, sill, top, 1 = window
ROUND_ABOUT, NEAR, AWAY = 0.4, 0.08, 3.0  # metres: scales at which a gap is told
OPENING_FEATURES = 10 + 12
PLAN = 11


def centred(floor: Sequence[float] | Sequence[Sequence[float]] | np.ndarray | None) -> Tensor:
    """(k, 2) float32, corners of a floor about the centre of their bounding box; four times NaN where it is unknown.

    `floor`: None, two extents (x, z) of a rectangle, or k >= 3 corners (x, z) in any frame, metres.

    Raises ValueError for neither of these.
    """
    if floor is None:
        return torch.full((4, 2), torch.nan)
    given = torch.as_tensor(np.asarray(floor, np.float64))
    if given.shape == (2,):
        return torch.from_numpy(rectangle(*given.tolist())).float()
    if given.ndim != 2 or given.shape[1] != 2 or len(given) < 3:
        raise ValueError(f"floor has shape {tuple(given.shape)}, expected (2,) extents or (k, 2) corners, k >= 3")
    return (given - (given.amax(0) + given.amin(0)) / 2).float()


def padded(floors: Sequence[Tensor]) -> Tensor:
    """Floors (s, k, 2) of different numbers of corners behind one another, padded with NaN: (S, K, 2)."""
    most = max(floor.shape[1] for floor in floors)
    return torch.cat([torch.nn.functional.pad(f, (0, 0, 0, most - f.shape[1]), value=torch.nan) for f in floors])


def trimmed(floor: Tensor) -> Tensor:
    """The same floors without needless padding; where all are unknown four corners remain."""
    most = int(torch.isfinite(floor[..., 0]).sum(1).amax()) if len(floor) else 0
    return floor[:, : most or 4]


def extents(floor: Tensor) -> Tensor:
    """(S, K, 2) corners -> (S, 2), x and z extent of the bounding box in metres, NaN where the floor is unknown."""
    there = torch.isfinite(floor)
    high = torch.where(there, floor, -torch.inf).amax(1)
    low = torch.where(there, floor, torch.inf).amin(1)
    return torch.where(there.any(1), high - low, torch.nan)


def nearest_wall(points: Tensor, floor: Tensor) -> Tensor:
    """(M,) heading in radians of what stands at each point with its back to the wall nearest to it, 0 where unknown.

    Arguments:
        points: (M, 2) float32, x and z. floor: (M, K, 2) float32.
    """
    start, end = edges(floor)
    along, off = end - start, points[:, None] - start
    length = along.square().sum(-1)
    t = ((off * along).sum(-1) / length.clamp_min(1e-9)).clamp(0, 1)
    distance = (off - t[..., None] * along).square().sum(-1) + (length < 1e-9) * FAR**2
    wall = along.gather(1, distance.argmin(1)[:, None, None].expand(-1, 1, 2))[:, 0]
    turn = torch.where(signed_area(floor) > 0, 1.0, -1.0)  # which side of the wall is inside
    return torch.atan2(-wall[:, 1] * turn, wall[:, 0] * turn)


def wall_distances(points: Tensor, floor: Tensor) -> Tensor:
    """How far it is to the next wall along +x, -x, +z and -z in metres, 0 where there is none.

    Arguments:
        points: (M, 2) float32, x and z. floor: (M, K, 2) float32.

    Returns (M, 4) float32, 0 where the floor is unknown.
    """
    start, end = edges(floor)
    out = []
    for axis in (1, 0):  # walls that cross the line through the point along the other axis
        level, own = points[:, None, axis], points[:, None, 1 - axis]
        crossed = (start[..., axis] > level) != (end[..., axis] > level)
        ahead = meeting(level, start, end, axis) - own
        for side in (1, -1):
            nearest = torch.where(crossed & (side * ahead > 0), side * ahead, FAR).amin(1)
            out.append(torch.where(nearest < FAR, nearest, 0.0))
    return torch.stack(out, 1)


def outside(boxes: Boxes, floor: Tensor) -> Tensor:
    """How far the corners and the middles of the sides lie beyond the walls: (N, 8) metres, 0 where unknown.

    Arguments:
        boxes: N boxes; none is asked to shrink. floor: (N, K, 2) float32, corners of the floor under each.
    """
    return (-signed_distance(footprint(boxes.size.detach(), boxes.position, boxes.yaw), floor)).clamp_min(0)


def plan_features(floor: Tensor) -> Tensor:
    """What a floor looks like: (S, K, 2) -> (S, 6 + GRID^2), zeros where it is unknown.

    Extents in metres, their logarithms, whether they are known, and signed distances on a grid over the bounding box.
    """
    extent = extents(floor)
    there = known(floor)[:, None].to(floor.dtype)
    extent = torch.where(there > 0, extent, torch.ones_like(extent))
    steps = (torch.arange(GRID, device=floor.device, dtype=floor.dtype) + 0.5) / GRID - 0.5
    places = torch.cartesian_prod(steps, steps)[None] * extent[:, None]
    distance = torch.tanh(signed_distance(places, floor))
    return torch.cat([extent / 5 * there, extent.log() * there, there.expand(-1, 2), distance], dim=1)


def opening_rows(openings: Sequence[Opening], polygon: np.ndarray) -> Tensor:
    """(o, ROW) float32, metres, in the room frame of `Boxes`, whose origin is the middle of the floor's bounding box.

    Arguments:
        openings: of one room. polygon: (k, 2) float, corners (x, z) of its floor in any frame, metres.
    """
    corners = np.asarray(polygon, float)
    middle = (corners.max(0) + corners.min(0)) / 2 if len(openings) else np.zeros(2)
    rows = []
    for opening in openings:
        window = opening.kind == "window"
        depth = WINDOW_DEPTH if window else opening.width if (opening.kind, opening.swing) == ("door", "in") else STEP
        near, far = segment(corners, opening) - middle
        top = opening.sill + opening.height
        rows.append([*near, *far, *inward_normal(corners, opening.edge), depth, opening.sill, top, float(window)])
    return torch.tensor(rows, dtype=torch.float32).reshape(-1, ROW)


def padded_rows(rows: Sequence[Tensor]) -> Tensor:
    """Rows (s, o, ROW) of different numbers of openings behind one another, padded with NaN: (S, O, ROW)."""
    most = max((part.shape[1] for part in rows), default=0)
    return torch.cat([torch.nn.functional.pad(r, (0, 0, 0, most - r.shape[1]), value=torch.nan) for r in rows])


def room_features(rows: Tensor) -> tuple[Tensor, Tensor]:
    """Every opening as numbers (S, O, PLAN), zeros for padding, and which are there, (S, O) float32."""
    there = torch.isfinite(rows[..., 0])
    rows = torch.where(there[..., None], rows, torch.zeros_like(rows))
    width = (rows[..., 2:4] - rows[..., :2]).norm(dim=-1, keepdim=True)
    told = torch.cat([rows[..., :4] / 2, rows[..., 4:6], width, rows[..., 6:]], dim=-1)
    return told, there.to(rows.dtype)


def clearances(boxes: Boxes, rows: Tensor) -> Tensor:
    """How far each box keeps from the door or passage, and the window, that it comes nearest to, at several scales.

    Arguments:
        boxes: N boxes. rows: (N, O, ROW), openings of the room of each, NaN = none.

    Returns (N, OPENING_FEATURES) float32; zeros where there is no opening of the kind.
    """
    if not rows.shape[1]:
        return boxes.size.new_zeros(len(boxes), OPENING_FEATURES)
    there, window, beside, before, under = _gaps(boxes, rows)
    out = []
    for mask, gaps in ((there & ~window, (beside, before)), (there & window, (beside, before, under))):
        clear = torch.stack(gaps[:2]).amax(0)
        nearest = torch.where(mask, clear, torch.full_like(clear, AWAY * 10)).argmin(1, keepdim=True)
        some = mask.any(1, keepdim=True).to(clear.dtype)
        chosen = torch.cat([gap.gather(1, nearest) for gap in (*gaps[:2], clear)], 1)
        told = [torch.tanh(chosen / scale) for scale in (AWAY, ROUND_ABOUT, NEAR)]
        told += [torch.tanh(gap.gather(1, nearest) / s) for gap in gaps[2:] for s in (ROUND_ABOUT, NEAR)]
        out.append(torch.cat([torch.cat(told, 1) * some, some], 1))
    return torch.cat(out, 1)


def kept_free(boxes: Boxes, rows: Tensor) -> Tensor:
    """How far each box keeps out of the way of the openings of its room: the least of all, metres, differentiable.

    Arguments:
        boxes: N boxes that stand on the floor. rows: (N, O, ROW), openings of the room of each, NaN = none.

    Returns (N,) float32, negative in the way of a door or passage, or before a window and higher than its sill; `AWAY`
    where there is no opening.
    """
    if not rows.shape[1]:
        return boxes.size.new_full((len(boxes),), AWAY)
    there, window, beside, before, under = _gaps(boxes, rows)
    clear = torch.maximum(beside, before)
    clear = torch.where(window, torch.maximum(clear, under), clear)
    return torch.where(there, clear, torch.full_like(clear, AWAY)).amin(1).clamp_max(AWAY)


def _gaps(boxes: Boxes, rows: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor, Tensor]:
    """(N, O) each: which openings there are and which are windows; how far each box stands beside, before and below."""
    there = torch.isfinite(rows[..., 0])
    rows = torch.where(there[..., None], rows, torch.zeros_like(rows))
    near, far, inward = rows[..., 0:2], rows[..., 2:4], rows[..., 4:6]
    length = (far - near).square().sum(-1).clamp_min(1e-9).sqrt()
    along = (far - near) / length[..., None]
    off = boxes.position[:, None, [0, 2]] - (near + far) / 2
    half = boxes.size[:, None, [0, 2]] / 2

    def reach(direction: Tensor) -> Tensor:
        parts = [(direction * axis[:, None]).sum(-1).abs() for axis in axes(boxes.yaw)]
        return (torch.stack(parts, -1) * half).sum(-1)

    beside = (off * along).sum(-1).abs() - reach(along) - length / 2
    before = (off * inward).sum(-1) - reach(inward) - rows[..., 6]
    under = rows[..., 7] - (boxes.position[:, 1] + boxes.size[:, 1])[:, None]
    return there, rows[..., 9] > 0.5, beside, before, under
