"""Floors as padded polygons: how far points are from the walls, and what the layout denoiser is told about a floor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from echomodel.boxes2d import CORNERS, outline

GRID = 6  # the floor's plan is told as signed distances at GRID x GRID places of its bounding box
FAR = 1e3  # metres: no wall is so far away
SIDES = ((-1, -1), (0, -1), (1, -1), (1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0))  # corners and middles of a footprint


def rectangle(width: float, depth: float) -> Tensor:
    """(4, 2) float32, corners (x, z) of a rectangular floor about the origin, metres."""
    return torch.tensor(CORNERS) * torch.tensor([width, depth]) / 2


def centred(floor: Sequence[float] | Sequence[Sequence[float]] | np.ndarray | None) -> Tensor:
    """(k, 2) float32, corners of a floor about the centre of their bounding box; four times NaN where it is unknown.

    Arguments:
        floor: None, two extents (x, z) of a rectangle, or k >= 3 corners (x, z) in any frame, metres.

    Raises ValueError for neither of these.
    """
    if floor is None:
        return torch.full((4, 2), torch.nan)
    given = torch.as_tensor(np.asarray(floor, np.float64))
    if given.shape == (2,):
        return rectangle(*given.tolist())
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


def known(floor: Tensor) -> Tensor:
    """(S,) bool, which floors are known."""
    return torch.isfinite(floor[:, :1]).all(2).any(1)


def area(floor: Tensor) -> Tensor:
    """(S,) float32, square metres; 0 for corners on a line and where the floor is unknown."""
    return signed_area(floor).abs()


def signed_area(floor: Tensor) -> Tensor:
    """(S,) float32, square metres, positive where the inside lies at (-dz, dx) of a wall (dx, dz)."""
    start, end = edges(floor)
    return (start[..., 0] * end[..., 1] - start[..., 1] * end[..., 0]).sum(1) / 2


def extents(floor: Tensor) -> Tensor:
    """(S, K, 2) corners -> (S, 2), x and z extent of the bounding box in metres, NaN where the floor is unknown."""
    there = torch.isfinite(floor)
    high = torch.where(there, floor, -torch.inf).amax(1)
    low = torch.where(there, floor, torch.inf).amin(1)
    return torch.where(there.any(1), high - low, torch.nan)


def edges(floor: Tensor) -> tuple[Tensor, Tensor]:
    """Start and end (S, K, 2) of the walls; padding repeats the first corner, which makes walls of no length."""
    start = torch.nan_to_num(torch.where(torch.isfinite(floor), floor, floor[:, :1]))  # NaN would spoil gradients
    return start, torch.roll(start, -1, 1)


def signed_distance(points: Tensor, floor: Tensor) -> Tensor:
    """Distance to the nearest wall in metres, positive on the floor, 0 where the floor is unknown; differentiable.

    Arguments:
        points: (M, Q, 2) float32, x and z. floor: (M, K, 2) float32, the floor that each row of points belongs to.

    Returns (M, Q) float32.
    """
    start, end = (wall[:, None] for wall in edges(floor))
    along, off = end - start, points[:, :, None] - start
    t = ((off * along).sum(-1) / along.square().sum(-1).clamp_min(1e-9)).clamp(0, 1)
    # the square root of nought has no slope
    distance = (off - t[..., None] * along).square().sum(-1).amin(-1).clamp_min(1e-12).sqrt()
    distance = torch.where(_inside(points, start, end), distance, -distance)
    return torch.where(known(floor)[:, None], distance, torch.zeros_like(distance))


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


def _inside(points: Tensor, start: Tensor, end: Tensor) -> Tensor:
    """(M, Q) bool: an odd number of walls lies to the +x side."""
    x, z = points[:, :, None, 0], points[:, :, None, 1]
    crossed = (start[..., 1] > z) != (end[..., 1] > z)
    return ((crossed & (_meeting(z, start, end, 1) > x)).sum(-1) % 2).bool()


def _meeting(level: Tensor, start: Tensor, end: Tensor, axis: int) -> Tensor:
    """Where the walls' lines reach a value of `axis`, on the other axis."""
    run = end[..., axis] - start[..., axis]
    share = (level - start[..., axis]) / torch.where(run == 0, 1.0, run)
    return start[..., 1 - axis] + share * (end[..., 1 - axis] - start[..., 1 - axis])


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
        ahead = _meeting(level, start, end, axis) - own
        for side in (1, -1):
            nearest = torch.where(crossed & (side * ahead > 0), side * ahead, FAR).amin(1)
            out.append(torch.where(nearest < FAR, nearest, 0.0))
    return torch.stack(out, 1)


def footprint(size: Tensor, position: Tensor, yaw: Tensor) -> Tensor:
    """Corners and middles of the sides of boxes in plan, the back left one first (`SIDES`).

    Arguments:
        size, position: (N, 3) float32, metres, as in `Boxes`. yaw: (N,) float32, radians.

    Returns (N, 8, 2) float32, x and z, metres. Walls that enter between two of these points are not met.
    """
    return outline(size[:, [0, 2]] / 2, yaw, SIDES) + position[:, None, [0, 2]]


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
