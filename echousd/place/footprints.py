"""How two upright boxes overlap, approach and surround each other, with gradients in closed form (numpy).

Every function returns values (p,) and their gradients (p, 2, 6): by the six numbers of the first and of the second box,
in the columns of `geometry`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echousd.place.geometry import COLUMNS, axes

FIRST, SECOND = 0, 1
PLAN = [0, 2]  # columns of x and z
SIDES = np.array([-1.0, 1.0])
HAIR = 1e-9  # metres by which the second footprint grows, so that of two edges that coincide only one counts
TINY = 1e-6  # metres
NO_SLOPES = np.zeros((0, 2, COLUMNS))  # in place of gradients that nobody asks for

Values = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True, eq=False)
class Pairs:
    """p pairs of boxes; the second axis of each array is the first and the second box.

    Arguments:
        size, position: (p, 2, 3) float, metres.
        axis: (p, 2, 2, 2) float, the two horizontal unit vectors (x, z) along each footprint's sides.
        half: (p, 2, 2) float, metres, half of the side along each of them.
        columns: columns of the gradient that hold the logarithms of these two sides.
        fronts: (p,) bool, pairs in which both have a front; None = in none.
        slopes: False where nobody asks for gradients; those that take time are `NO_SLOPES` then.
    """

    size: np.ndarray
    position: np.ndarray
    axis: np.ndarray
    half: np.ndarray
    columns: tuple[int, int]
    fronts: np.ndarray | None = None
    slopes: bool = True

    def __len__(self) -> int:
        return len(self.size)

    def take(self, rows: np.ndarray) -> Pairs:
        """The pairs of these numbers."""
        fronts = None if self.fronts is None else self.fronts[rows]
        size, position, axis, half = (value[rows] for value in (self.size, self.position, self.axis, self.half))
        return Pairs(size, position, axis, half, self.columns, fronts, self.slopes)

    def swapped(self) -> Pairs:
        """The same pairs, the second box first."""
        size, position, axis, half = (value[:, ::-1] for value in (self.size, self.position, self.axis, self.half))
        return Pairs(size, position, axis, half, self.columns, self.fronts, self.slopes)

    def flat(self) -> np.ndarray:
        """(p, 2) float: in x and z from the second box to the first, metres."""
        return self.position[:, FIRST, PLAN] - self.position[:, SECOND, PLAN]

    def top(self) -> np.ndarray:
        """(p, 2) float: height of the tops, metres."""
        return self.position[..., 1] + self.size[..., 1]

    def zeros(self) -> np.ndarray:
        """(p, 2, 6) float, a gradient to be filled."""
        return np.zeros((len(self), 2, COLUMNS)) if self.slopes else NO_SLOPES


def pairs_of(
    size: np.ndarray,
    position: np.ndarray,
    yaw: np.ndarray,
    ends: np.ndarray,
    *,
    oriented: bool,
    fronts: np.ndarray | None = None,
) -> Pairs:
    """The pairs `ends` (p, 2) of n boxes.

    Arguments:
        size, position: (n, 3) float, metres; yaw: (n,) float, radians.
        oriented: False reads footprints as the published measurements do: yaw ignored, width and depth exchanged.
        fronts: (n,) bool, boxes that have a front; None = none.
    """
    half = 0.5 * size[:, PLAN if oriented else PLAN[::-1]]
    axis = axes(yaw if oriented else np.zeros_like(yaw))
    both = None if fronts is None else fronts[ends].all(1)
    return Pairs(size[ends], position[ends], axis[ends], half[ends], (3, 5) if oriented else (5, 3), both)


def overlap_ratio(pair: Pairs) -> Values:
    """Volume of the intersection divided by the smaller volume."""
    ratio, gradient = np.zeros(len(pair)), pair.zeros()
    # Only footprints whose circles meet can overlap.
    reach = np.linalg.norm(pair.half, axis=-1).sum(1)
    near = np.flatnonzero(np.linalg.norm(pair.flat(), axis=1) < reach)
    pair = pair.take(near)
    area, by_area = overlap_area(pair)
    r = np.arange(len(near))
    top, bottom, volume = pair.top(), pair.position[..., 1], pair.size.prod(-1)
    lid, base, small = top.argmin(1), bottom.argmax(1), volume.argmin(1)
    height = np.maximum(top[r, lid] - bottom[r, base], 0.0)
    rise = np.where(height > 0, area, 0.0)
    by_area *= height[:, None, None]
    by_area[r, lid, 1] += rise
    by_area[r, lid, 4] += rise * pair.size[r, lid, 1]
    by_area[r, base, 1] -= rise
    by_area[r, small, 3:] -= (area * height)[:, None]
    ratio[near] = area * height / volume[r, small]
    gradient[near] = by_area / volume[r, small, None, None]
    return ratio, gradient


def overlap_area(pair: Pairs) -> Values:
    """Area of the intersection of the footprints, square metres.

    Divergence theorem: the area is half the sum of length x distance to the origin over the pieces of the edges that
    bound it; an edge that moves outwards sweeps the length of its piece.
    """
    flat, half = pair.flat(), pair.half + np.array([[0.0], [HAIR]])
    area, gradient = np.zeros(len(pair)), pair.zeros()
    for own, other, offset in ((FIRST, SECOND, flat), (SECOND, FIRST, -flat)):
        length = _clipped(offset, pair.axis[:, own], half[:, own], pair.axis[:, other], half[:, other])
        whole = length.sum(-1) * half[:, own]
        push = np.einsum("pk,pkd->pd", length @ SIDES, pair.axis[:, own])
        gradient[:, own, PLAN], gradient[:, own, pair.columns] = push, whole
        area += 0.5 * whole.sum(1)
        if own == FIRST:  # the origin is the centre of the second
            area += 0.5 * (push * flat).sum(1)
    return np.maximum(area, 0.0), gradient


def _clipped(
    offset: np.ndarray, axis: np.ndarray, half: np.ndarray, other_axis: np.ndarray, other_half: np.ndarray
) -> np.ndarray:
    """(p, 2, 2) float: length of a rectangle's edges inside another one, by normal of the edge and side (-, +).

    Arguments:
        offset: (p, 2) float, from the other rectangle's centre to this one's, metres.
        axis, other_axis: (p, 2, 2) float, unit vectors; half, other_half: (p, 2) float, metres.
    """
    # Last axis: the other rectangle's own two directions, between whose sides an edge start + t * along is clipped.
    turned = np.einsum("pkd,pmd->pkm", axis, other_axis)
    start = np.einsum("pd,pmd->pm", offset, other_axis)[:, None, None]
    start = start + SIDES[:, None] * (half[..., None] * turned)[:, :, None]
    along = turned[:, ::-1, None]
    along = np.where(np.abs(along) < 1e-12, 1e-12, along)
    side = other_half[:, None, None]
    one, two = (side - start) / along, (-side - start) / along
    limit = half[:, ::-1, None]
    enter = np.maximum(np.minimum(one, two).max(-1), -limit)
    leave = np.minimum(np.maximum(one, two).min(-1), limit)
    return np.maximum(leave - enter, 0.0)


def corner_distance(pair: Pairs) -> Values:
    """Smallest distance between a corner of the first box and one of the second, metres."""
    r = np.arange(len(pair))
    signs = np.array([(-1, -1), (-1, 1), (1, -1), (1, 1)], float)
    corner = pair.position[:, :, None, PLAN] + (signs * pair.half[:, :, None]) @ pair.axis
    apart = corner[:, FIRST, :, None] - corner[:, SECOND, None]
    best = np.square(apart).sum(-1).reshape(-1, 16).argmin(1)
    chosen = np.stack(np.divmod(best, 4), 1)
    heights = np.stack((pair.position[..., 1], pair.top()), -1)
    rise = heights[:, FIRST, :, None] - heights[:, SECOND, None]
    level = np.stack(np.divmod(np.abs(rise).reshape(-1, 4).argmin(1), 2), 1)
    away = np.empty((len(pair), 3))
    away[:, PLAN] = apart[r, chosen[:, 0], chosen[:, 1]]
    away[:, 1] = rise[r, level[:, 0], level[:, 1]]
    distance = np.maximum(np.linalg.norm(away, axis=1), TINY)
    if not pair.slopes:
        return distance, NO_SLOPES
    away /= distance[:, None]
    gradient = pair.zeros()
    for end, sign in ((FIRST, 1.0), (SECOND, -1.0)):
        gradient[:, end, :3] = sign * away
        lever = signs[chosen[:, end]] * pair.half[:, end]
        gradient[:, end, pair.columns] = sign * np.einsum("pkd,pd->pk", pair.axis[:, end], away[:, PLAN]) * lever
        gradient[:, end, 4] = sign * away[:, 1] * level[:, end] * pair.size[:, end, 1]
    return distance, gradient


def penetration(pair: Pairs) -> Values:
    """Depth by which the footprints overlap (positive) or the gap between them (negative), metres.

    The gap is the largest over the four directions of the sides (separating axis theorem).
    """
    r = np.arange(len(pair))
    axis = pair.axis.reshape(-1, 4, 2)
    along = np.einsum("pad,pd->pa", axis, pair.flat())
    cosine = np.abs(np.einsum("pad,pekd->paek", axis, pair.axis))
    reach = (cosine * pair.half[:, None]).sum((2, 3))
    best = (np.abs(along) - reach).argmax(1)
    if not pair.slopes:
        return (reach - np.abs(along))[r, best], NO_SLOPES
    push = np.where(along[r, best] < 0, 1.0, -1.0)[:, None] * axis[r, best]
    gradient = pair.zeros()
    gradient[:, FIRST, PLAN], gradient[:, SECOND, PLAN] = push, -push
    gradient[..., pair.columns] = cosine[r, best] * pair.half
    return (reach - np.abs(along))[r, best], gradient


def centre_inside(pair: Pairs) -> Values:
    """How far the first box's centre lies inside the second's footprint (negative: outside), metres."""
    r = np.arange(len(pair))
    local = np.einsum("pkd,pd->pk", pair.axis[:, SECOND], pair.flat())
    room = pair.half[:, SECOND] - np.abs(local)
    best = room.argmin(1)
    if not pair.slopes:
        return room[r, best], NO_SLOPES
    push = -np.sign(local[r, best])[:, None] * pair.axis[r, SECOND, best]
    gradient = pair.zeros()
    gradient[:, FIRST, PLAN], gradient[:, SECOND, PLAN] = push, -push
    gradient[r, SECOND, np.array(pair.columns)[best]] = pair.half[r, SECOND, best]
    return room[r, best], gradient


def mirror_distance(pair: Pairs, *, images: Sequence[int]) -> Values:
    """Smallest distance in plan of the second box to a mirror image of the first, metres.

    Arguments:
        pair: their positions are relative to the room's centre.
        images: which mirrors may be used: 0 turns x around, 1 turns z around, 2 both.
    """
    r = np.arange(len(pair))
    signs = np.array([(-1, 1), (1, -1), (-1, -1)], float)[list(images)]
    plan = pair.position[:, :, None, PLAN]
    away = plan[:, FIRST] * signs - plan[:, SECOND]
    best = np.square(away).sum(-1).argmin(1)
    away = away[r, best]
    distance = np.maximum(np.linalg.norm(away, axis=1), TINY)
    if not pair.slopes:
        return distance, NO_SLOPES
    away /= distance[:, None]
    gradient = pair.zeros()
    gradient[:, FIRST, PLAN], gradient[:, SECOND, PLAN] = signs[best] * away, -away
    return distance, gradient


def mirror_likeness(pair: Pairs) -> np.ndarray:
    """(2, p) cosine between the second box's front and that of the first one's images with x and with z turned."""
    first, second = pair.axis[:, FIRST, 1], pair.axis[:, SECOND, 1]
    across, along = (first * second).T
    return np.stack([along - across, across - along])
