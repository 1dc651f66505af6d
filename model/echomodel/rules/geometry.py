"""Geometry of pairs of boxes, many at once: extents, corners, footprints and their overlap."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from echomodel.arrays import Array, at_least, at_most, cast, dot, kit, put, rows
from echomodel.boxes2d import CORNERS, along_sides, outline, seen

TINY = 1e-12


class BoxesLike(Protocol):
    """Anything with `size (N, 3)`, `position (N, 3)` and `yaw (N,)`, arrays of one library, in metres and radians."""

    @property
    def size(self): ...
    @property
    def position(self): ...
    @property
    def yaw(self): ...


@dataclass(frozen=True, eq=False)
class Spread:
    """K boxes, or K poses of one: size and position (K, 3), yaw (K,), float, metres and radians."""

    size: Array
    position: Array
    yaw: Array

    @classmethod
    def of(cls, boxes: BoxesLike) -> "Spread":
        """Boxes as arrays of numpy, float64."""
        return cls(*(np.asarray(of, np.float64) for of in (boxes.size, boxes.position, boxes.yaw)))

    @cached_property
    def corners(self) -> Array:
        """(K, 4, 2) of the footprint: both of the back, then both of the front, in cyclic order."""
        return outline(self.size[:, ::2] / 2, self.yaw) + self.centre[:, None]

    @property
    def centre(self) -> Array:
        """(K, 2) x and z."""
        return self.position[:, ::2]


@dataclass(frozen=True)
class PairGeometry:
    """P ordered pairs of boxes (subject, object); what several rules need is computed once and on demand.

    Arguments:
        size_s, size_o: (P, 3) float, extents along x, y, z at yaw 0, metres.
        position_s, position_o: (P, 3) float, centre of the bottom face relative to the room's centre, metres.
        yaw_s, yaw_o: (P,) float, radians about +Y.
        fronts: (P,) bool, pairs in which both have a front, so that their headings count where a rule asks for them;
            None = in none.
        oriented: False reproduces the published measurements: yaw ignored, x and z extents swapped (SPEC 13.1).
    """

    size_s: Array
    size_o: Array
    position_s: Array
    position_o: Array
    yaw_s: Array
    yaw_o: Array
    oriented: bool = True
    fronts: Array | None = None

    @property
    def kit(self) -> Any:
        """The library of these arrays: `numpy` or `torch`."""
        return kit(self.yaw_s)

    @cached_property
    def offset(self) -> Array:
        """(P, 3) position of the subject minus that of the object."""
        return self.position_s - self.position_o

    @cached_property
    def flat(self) -> Array:
        """(P, 2) x and z of `offset`."""
        return self.offset[:, ::2]

    @cached_property
    def local(self) -> Array:
        """(P, 2) the subject's centre in the object's frame: along its width, along its front."""
        return seen(self.flat, self.yaw_o)

    @cached_property
    def top_s(self) -> Array:
        """(P,) height of the subject's top."""
        return self.position_s[:, 1] + self.size_s[:, 1]

    @cached_property
    def top_o(self) -> Array:
        """(P,) height of the object's top."""
        return self.position_o[:, 1] + self.size_o[:, 1]

    @cached_property
    def footprint_s(self) -> tuple[Array, Array]:
        """Half extents (P, 2) along the subject's own axes and its corners (P, 4, 2), about the object's centre."""
        half = self._half(self.size_s)
        corners = outline(half, self.yaw_s if self.oriented else self.kit.zeros_like(self.yaw_s))
        return half, corners + self.flat[:, None]

    @cached_property
    def footprint_o(self) -> tuple[Array, Array]:
        """As `footprint_s`, for the object."""
        half = self._half(self.size_o)
        return half, outline(half, self.yaw_o if self.oriented else self.kit.zeros_like(self.yaw_o))

    def _half(self, size: Array) -> Array:
        return size[:, ::2] / 2 if self.oriented else size[:, [2, 0]] / 2

    @cached_property
    def overlap_ratio(self) -> Array:
        """(P,) volume of the intersection divided by the smaller volume, 0 to 1."""
        xp = self.kit
        bottom = xp.maximum(self.position_s[:, 1], self.position_o[:, 1])
        height = at_least(xp.minimum(self.top_s, self.top_o) - bottom, 0.0)
        volume = at_least(xp.minimum(self.size_s.prod(-1), self.size_o.prod(-1)), TINY)
        return self.overlap_area * height / volume

    @cached_property
    def overlap_area(self) -> Array:
        """(P,) area of the intersection of the two footprints, square metres."""
        xp = self.kit
        if not self.oriented:
            half_s, half_o = self.footprint_s[0], self.footprint_o[0]
            reach = (half_s + half_o) - abs(self.flat)
            return at_least(xp.minimum(reach, 2 * xp.minimum(half_s, half_o)), 0.0).prod(-1)
        corners, half, yaw = self.footprint_s[1], self.footprint_o[0], self.yaw_o
        away, own, other = (xp.sqrt(dot(of, of)) for of in (self.flat, self.footprint_s[0], half))
        near, none = rows(away < own + other + 0.01), xp.zeros_like(yaw)  # others are apart whatever their heading
        return put(none, near, rectangle_overlap(corners[near], half[near], yaw[near])) if len(near) else none

    @cached_property
    def corner_distance(self) -> Array:
        """(P,) smallest distance between a corner of the subject and one of the object, metres."""
        xp = self.kit
        off = self.footprint_s[1].swapaxes(0, 1)[:, None] - self.footprint_o[1].swapaxes(0, 1)
        ends_s = xp.stack([self.position_s[:, 1], self.top_s])
        ends_o = xp.stack([self.position_o[:, 1], self.top_o])
        rise = xp.square(ends_s[:, None] - ends_o)
        return xp.sqrt(at_least(xp.amin(dot(off, off), (0, 1)) + xp.amin(rise, (0, 1)), TINY))

    @cached_property
    def footprint_penetration(self) -> Array:
        """(P,) depth by which the footprints overlap (positive) or the gap between them (negative), metres: the
        largest gap over the four edge directions (separating axes), with its sign changed."""
        along, reach = along_sides(self.flat, self.size_s[:, ::2] / 2, self.yaw_s, self.size_o[:, ::2] / 2, self.yaw_o)
        return self.kit.amin(reach - abs(along), -1)

    @cached_property
    def centre_inside(self) -> Array:
        """(P,) how far the subject's centre lies inside the object's footprint (negative: outside), metres."""
        inside = self.footprint_o[0] - abs(self.local)
        return self.kit.minimum(inside[:, 0], inside[:, 1])

    def mirror_distance(self, *, point: bool) -> Array:
        """(P,) smallest distance of the object to a mirror image of the subject in plan: about the room's x axis, its
        z axis, and (`point`) its centre, metres."""
        return self.kit.amin(self.mirror_distances[:, : 3 if point else 2], -1)

    @cached_property
    def mirror_distances(self) -> Array:
        """(P, 3) distances of the object to the subject's mirror images about x axis, z axis and centre, metres."""
        signs = cast([[-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]], self.position_s)
        off = self.position_s[:, None, ::2] * signs - self.position_o[:, None, ::2]
        return self.kit.sqrt(at_least(dot(off, off), TINY))

    @cached_property
    def mirror_likeness(self) -> Array:
        """(P, 2) cosine between the object's front and that of the subject's images with x and with z mirrored."""
        xp = self.kit
        across = xp.sin(self.yaw_s) * xp.sin(self.yaw_o)
        along = xp.cos(self.yaw_s) * xp.cos(self.yaw_o)
        return xp.stack([along - across, across - along], -1)


def pairs(
    boxes: BoxesLike, subject: Array, object_: Array, centre: Array, *, oriented: bool, fronts: Array | None = None
) -> PairGeometry:
    """The geometry of the pairs (subject[i], object_[i]).

    Arguments:
        boxes: N boxes as floating-point arrays.
        subject, object_: (P,) int64 indices of nodes.
        centre: (N, 3) float, centre of each node's room.
        oriented: see `PairGeometry`.
        fronts: (N,) bool, boxes that have a front; None = none.
    """
    position = boxes.position - centre
    size, yaw = boxes.size, boxes.yaw
    return PairGeometry(
        size[subject], size[object_], position[subject], position[object_], yaw[subject], yaw[object_], oriented,
        None if fronts is None else fronts[subject] & fronts[object_],
    )  # fmt: skip


def rectangle_overlap(corners: Array, half: Array, yaw: Array) -> Array:
    """Area of the intersection of rectangles `corners` (P, 4, 2) with rectangles centred at the origin.

    Green's theorem: the boundary of the intersection is what lies of each one's edges inside the other, so the area is
    half the sum of the cross products of the clipped edges; no sorting of points and differentiable.

    Arguments:
        corners: (P, 4, 2) float, in cyclic order, relative to the other rectangle's centre, metres.
        half: (P, 2) float, half extents of the centred rectangles.
        yaw: (P,) float, their yaw in radians.
    """
    # Edges that coincide would count twice or not at all: a hair of growth makes one of the two the inner one.
    half = abs(half) + 7.3e-6
    a = seen(corners, yaw[:, None])
    winding = kit(a).sign(_cross(a[:, 1] - a[:, 0], a[:, 2] - a[:, 1]))
    b = half[:, None] * cast(CORNERS, half)
    total = winding * _clipped_cross(a, b) + _clipped_cross(b, a, winding)
    return at_least(total / 2, 0.0)


def _clipped_cross(edges: Array, clip: Array, winding: Array | None = None) -> Array:
    """Sum of cross(p, q) over the pieces pq of the polygon `edges` inside the convex polygon `clip` (P, 4, 2)."""
    xp, start, direction = kit(edges), edges, _next(edges) - edges
    side = _next(clip) - clip
    inward = xp.stack([-side[..., 1], side[..., 0]], -1)
    if winding is not None:
        inward = inward * winding[:, None, None]
    # Liang-Barsky: keep t with value + t * slope >= 0 for each of the four half planes.
    clip, inward = (of.swapaxes(0, 1)[:, :, None] for of in (clip, inward))
    value, slope = dot(start - clip, inward), dot(direction, inward)
    level, ahead = abs(slope) < TINY, slope > 0
    t = -value / xp.where(level, 1.0, slope)
    enter = xp.amax(xp.where(level, (value < 0) * 2.0, xp.where(ahead, t, 0.0)), 0)
    leave = xp.amin(xp.where(level | ahead, 1.0, t), 0)
    length = at_least(at_most(leave, 1.0) - at_least(enter, 0.0), 0.0)
    return (_cross(start, direction) * length).sum(-1)


def _next(corners: Array) -> Array:
    return kit(corners).concat([corners[:, 1:], corners[:, :1]], 1)


def _cross(a: Array, b: Array) -> Array:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
