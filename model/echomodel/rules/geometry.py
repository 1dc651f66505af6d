"""Geometry of pairs of boxes in batched torch: extents, corners, footprints and their overlap."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import torch
from torch import Tensor

from echomodel.boxes2d import CORNERS, along_sides, outline, seen

TINY = 1e-12


class BoxesLike(Protocol):
    """Anything with `size (N, 3)`, `position (N, 3)` and `yaw (N,)`, arrays or tensors, in metres and radians."""

    @property
    def size(self): ...
    @property
    def position(self): ...
    @property
    def yaw(self): ...


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

    size_s: Tensor
    size_o: Tensor
    position_s: Tensor
    position_o: Tensor
    yaw_s: Tensor
    yaw_o: Tensor
    oriented: bool = True
    fronts: Tensor | None = None

    @cached_property
    def offset(self) -> Tensor:
        """(P, 3) position of the subject minus that of the object."""
        return self.position_s - self.position_o

    @cached_property
    def flat(self) -> Tensor:
        """(P, 2) x and z of `offset`."""
        return self.offset[:, ::2]

    @cached_property
    def local(self) -> Tensor:
        """(P, 2) the subject's centre in the object's frame: along its width, along its front."""
        return seen(self.flat, self.yaw_o)

    @cached_property
    def top_s(self) -> Tensor:
        """(P,) height of the subject's top."""
        return self.position_s[:, 1] + self.size_s[:, 1]

    @cached_property
    def top_o(self) -> Tensor:
        """(P,) height of the object's top."""
        return self.position_o[:, 1] + self.size_o[:, 1]

    @cached_property
    def footprint_s(self) -> tuple[Tensor, Tensor]:
        """Half extents (P, 2) along the subject's own axes and its corners (P, 4, 2), about the object's centre."""
        half = self._half(self.size_s)
        corners = outline(half, self.yaw_s if self.oriented else torch.zeros_like(self.yaw_s))
        return half, corners + self.flat[:, None]

    @cached_property
    def footprint_o(self) -> tuple[Tensor, Tensor]:
        """As `footprint_s`, for the object."""
        half = self._half(self.size_o)
        return half, outline(half, self.yaw_o if self.oriented else torch.zeros_like(self.yaw_o))

    def _half(self, size: Tensor) -> Tensor:
        return size[:, ::2] / 2 if self.oriented else size[:, [2, 0]] / 2

    @cached_property
    def overlap_ratio(self) -> Tensor:
        """(P,) volume of the intersection divided by the smaller volume, 0 to 1."""
        bottom = torch.maximum(self.position_s[:, 1], self.position_o[:, 1])
        height = (torch.minimum(self.top_s, self.top_o) - bottom).clamp_min(0)
        volume = torch.minimum(self.size_s.prod(-1), self.size_o.prod(-1)).clamp_min(TINY)
        return self.overlap_area * height / volume

    @cached_property
    def overlap_area(self) -> Tensor:
        """(P,) area of the intersection of the two footprints, square metres."""
        if not self.oriented:
            half_s, half_o = self.footprint_s[0], self.footprint_o[0]
            reach = (half_s + half_o) - self.flat.abs()
            return torch.minimum(reach, 2 * torch.minimum(half_s, half_o)).clamp_min(0).prod(-1)
        corners, half, yaw = self.footprint_s[1], self.footprint_o[0], self.yaw_o
        away, reach = self.flat.norm(dim=1), self.footprint_s[0].norm(dim=1) + half.norm(dim=1)
        near = (away < reach + 0.01).nonzero()[:, 0]  # others are apart whatever their heading
        none = torch.zeros_like(yaw)
        if not len(near):
            return none
        return none.index_copy(0, near, rectangle_overlap(corners[near], half[near], yaw[near]))

    @cached_property
    def corner_distance(self) -> Tensor:
        """(P,) smallest distance between a corner of the subject and one of the object, metres."""
        plan = (self.footprint_s[1][:, :, None] - self.footprint_o[1][:, None]).square().sum(-1).flatten(1).amin(-1)
        ends_s = torch.stack([self.position_s[:, 1], self.top_s], -1)
        ends_o = torch.stack([self.position_o[:, 1], self.top_o], -1)
        rise = (ends_s[:, :, None] - ends_o[:, None]).square().flatten(1).amin(-1)
        return (plan + rise).clamp_min(TINY).sqrt()

    @cached_property
    def footprint_penetration(self) -> Tensor:
        """(P,) depth by which the footprints overlap (positive) or the gap between them (negative), metres: the
        largest gap over the four edge directions (separating axes), with its sign changed."""
        along, reach = along_sides(self.flat, self.size_s[:, ::2] / 2, self.yaw_s, self.size_o[:, ::2] / 2, self.yaw_o)
        return (reach - along.abs()).amin(-1)

    @cached_property
    def centre_inside(self) -> Tensor:
        """(P,) how far the subject's centre lies inside the object's footprint (negative: outside), metres."""
        return (self.footprint_o[0] - self.local.abs()).amin(-1)

    def mirror_distance(self, *, point: bool) -> Tensor:
        """(P,) smallest distance of the object to a mirror image of the subject in plan: about the room's x axis, its
        z axis, and (`point`) its centre, metres."""
        return self.mirror_distances[:, : 3 if point else 2].amin(-1)

    @cached_property
    def mirror_distances(self) -> Tensor:
        """(P, 3) distances of the object to the subject's mirror images about x axis, z axis and centre, metres."""
        plan = [[-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]]
        signs = torch.tensor(plan, dtype=self.position_s.dtype, device=self.position_s.device)
        mirrored = self.position_s[:, None, [0, 2]] * signs
        return (mirrored - self.position_o[:, None, [0, 2]]).square().sum(-1).clamp_min(TINY).sqrt()

    @cached_property
    def mirror_likeness(self) -> Tensor:
        """(P, 2) cosine between the object's front and that of the subject's images with x and with z mirrored."""
        across = self.yaw_s.sin() * self.yaw_o.sin()
        along = self.yaw_s.cos() * self.yaw_o.cos()
        return torch.stack([along - across, across - along], -1)


def pairs(
    boxes: BoxesLike, subject: Tensor, object_: Tensor, centre: Tensor, *, oriented: bool, fronts: Tensor | None = None
) -> PairGeometry:
    """The geometry of the pairs (subject[i], object_[i]).

    Arguments:
        boxes: N boxes as floating-point tensors.
        subject, object_: (P,) int64 indices of nodes.
        centre: (N, 3) float, centre of each node's room.
        oriented: see `PairGeometry`.
        fronts: (N,) bool, boxes that have a front; None = none.
    """
    position = boxes.position - centre
    size, yaw = boxes.size, boxes.yaw
    return PairGeometry(
        size.index_select(0, subject), size.index_select(0, object_),
        position.index_select(0, subject), position.index_select(0, object_),
        yaw.index_select(0, subject), yaw.index_select(0, object_), oriented,
        None if fronts is None else fronts[subject] & fronts[object_],
    )  # fmt: skip


def rectangle_overlap(corners: Tensor, half: Tensor, yaw: Tensor) -> Tensor:
    """Area of the intersection of rectangles `corners` (P, 4, 2) with rectangles centred at the origin.

    Green's theorem: the boundary of the intersection is what lies of each one's edges inside the other, so the area is
    half the sum of the cross products of the clipped edges; no sorting of points and differentiable.

    Arguments:
        corners: (P, 4, 2) float, in cyclic order, relative to the other rectangle's centre, metres.
        half: (P, 2) float, half extents of the centred rectangles.
        yaw: (P,) float, their yaw in radians.
    """
    # Edges that coincide would count twice or not at all: a hair of growth makes one of the two the inner one.
    half = half.abs() + 7.3e-6
    a = seen(corners, yaw[:, None])
    winding = torch.sign(_cross(a[:, 1] - a[:, 0], a[:, 2] - a[:, 1]))
    b = half[:, None] * a.new_tensor(CORNERS)
    total = winding * _clipped_cross(a, b) + _clipped_cross(b, a, winding)
    return (total / 2).clamp_min(0)


def _clipped_cross(edges: Tensor, clip: Tensor, winding: Tensor | None = None) -> Tensor:
    """Sum of cross(p, q) over the pieces pq of the polygon `edges` inside the convex polygon `clip` (P, 4, 2)."""
    start, direction = edges, edges.roll(-1, 1) - edges
    side = clip.roll(-1, 1) - clip
    inward = torch.stack([-side[..., 1], side[..., 0]], -1)
    if winding is not None:
        inward = inward * winding[:, None, None]
    # Liang-Barsky: keep t with value + t * slope >= 0 for each of the four half planes.
    value = ((start[:, :, None] - clip[:, None]) * inward[:, None]).sum(-1)
    slope = (direction[:, :, None] * inward[:, None]).sum(-1)
    level = slope.abs() < TINY
    t = -value / torch.where(level, torch.ones_like(slope), slope)
    enter = torch.where(level, (value < 0) * 2.0, torch.where(slope > 0, t, torch.zeros_like(t))).amax(-1)
    leave = torch.where(level | (slope > 0), torch.ones_like(t), t).amin(-1)
    enter, leave = enter.clamp(0, 1), leave.clamp(0, 1)
    length = (leave - enter).clamp_min(0)
    return (_cross(start, direction) * length).sum(-1)


def _cross(a: Tensor, b: Tensor) -> Tensor:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
