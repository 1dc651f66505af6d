"""Copies of one room that differ in the poses of its boxes alone: what is said of its words is said once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any

import numpy as np
import torch
from torch import Tensor

from echomodel.objective.plan import FAR, OF_WORDS, Found, Plan, worst
from echomodel.openings import Opening
from echomodel.vocabulary import Category

MANY = 80_000  # pairs of boxes in all copies from which on those that stand alike are looked at once


@dataclass(frozen=True, eq=False)
class Watched(Plan):
    """A plan that notes whose poses are asked for: of masks of words and pairs of them, before any pose is compared."""

    asked: Tensor = field(kw_only=True)

    def those(self, mask: Tensor) -> Tensor:
        self.asked.logical_or_(mask)
        return super().those(mask)

    def pairs(self, first: Tensor, second: Tensor, *, least: bool = False) -> tuple[Tensor, Tensor]:
        i, j = super().pairs(first, second)
        return self._noted(i), self._noted(j)

    def rows_of(self, predicate: str) -> Tensor:
        rows = super().rows_of(predicate)
        for ends in self.stated_pairs[::2]:
            self._noted(ends[rows])
        return rows

    def everywhere(self, number: int) -> Tensor:
        return self._noted(super().everywhere(number))

    def beside(self, i: Tensor, others: Tensor) -> tuple[Tensor, Tensor]:
        row, k = super().beside(i, others)
        return row, self._noted(k)

    def _noted(self, numbers: Tensor) -> Tensor:
        self.asked[numbers] = True
        return numbers


def looks_at(room: Plan, find: Callable[[Plan], Found]) -> tuple[Tensor, Found]:
    """(N,) bool, the boxes of a room whose poses decide what a term finds, whatever they are; and what it finds."""
    plan = Watched(**{of.name: getattr(room, of.name) for of in fields(Plan)}, asked=torch.zeros_like(room.given))
    vars(plan).update({name: getattr(room, name) for name in (*OF_WORDS, "turn")})
    seen = find(plan)
    for whom in (room.anchor, room.group, room.carrier):
        plan.asked[whom[plan.asked & (whom >= 0)]] = True
    return plan.asked, seen


def _repeated(name: str) -> cached_property[Tensor]:
    """A column of the room, the same in every copy."""
    return cached_property(lambda copies: getattr(copies.template, name).repeat(copies.count))


def _numbered(name: str) -> cached_property[Tensor]:
    """Numbers of boxes of the room, in every copy its own."""
    return cached_property(lambda copies: copies._tiled(getattr(copies.template, name)))


@dataclass(frozen=True, eq=False)
class Copies(Plan):
    """K copies of a room of N boxes, K * N boxes in all; whom each attends and stands on is as in the first.

    Arguments:
        template: the room. apart: (N,) bool, boxes that do not stand alike in all copies.
        others: as `Plan`, of all boxes.
    """

    template: Plan = field(kw_only=True)
    apart_in: Tensor = field(kw_only=True)

    @property
    def count(self) -> int:
        """How many copies there are."""
        return len(self.openings)

    @property
    def first(self) -> Plan:
        """The room itself."""
        return self.template

    @cached_property
    def moved(self) -> Tensor:
        """(K * N,) bool, boxes that do not stand alike in all copies."""
        return self.apart_in.repeat(self.count)

    @cached_property
    def _shift(self) -> Tensor:
        return torch.arange(self.count)[:, None] * len(self.template)

    def _tiled(self, number: Tensor) -> Tensor:
        """(K * P,) numbers of boxes of the room (P,), negative ones as they are, in every copy."""
        return torch.where(number[None] < 0, number[None], number[None] + self._shift).reshape(-1)

    def _mask(self, values: Any) -> Tensor:
        raise NotImplementedError("masks of copies are those of their room")

    def of(self, *roles: str) -> Tensor:
        return self._masked(("of", *roles), lambda: self.template.of(*roles))

    def stands(self, *stances: str) -> Tensor:
        return self._masked(("stands", *stances), lambda: self.template.stands(*stances))

    def _masked(self, asked: tuple[str, ...], mask: Callable[[], Tensor]) -> Tensor:
        if asked not in self._masks:
            self._masks[asked] = mask().repeat(self.count)
        return self._masks[asked]

    def which(self, asked: Callable[[Category], object]) -> Tensor:
        return self.template.which(asked).repeat(self.count)

    def column(self, asked: Callable[[Category], Any]) -> Tensor:
        one = self.template.column(asked)
        return one.repeat(self.count, *[1] * (one.ndim - 1))

    @cached_property
    def stance(self) -> tuple[str, ...]:
        return self.template.stance * self.count

    standing, movable, solid = _repeated("standing"), _repeated("movable"), _repeated("solid")
    works, dining, fronts = _repeated("works"), _repeated("dining"), _repeated("fronts")
    smaller, walled = _repeated("smaller"), _repeated("walled")
    joins, carrier, anchor, group = _numbered("joins"), _numbered("carrier"), _numbered("anchor"), _numbered("group")

    def inside(self, points: Tensor, who: Tensor) -> Tensor:
        if self.template.rectangle is None:
            return super().inside(points, who)
        middle, half = self.template.rectangle
        out = (points - middle).abs() - half
        return torch.where((out <= 0).all(-1), -out.amax(-1), -out.clamp_min(0).norm(dim=-1))

    @cached_property
    def couples(self) -> tuple[Tensor, Tensor, Tensor]:
        """As `Plan.couples`; without pairs that stand alike in all copies."""
        i, j, allowed = self.template.couples
        differ = self.apart_in[i] | self.apart_in[j]
        i, j, allowed = i[differ], j[differ], allowed[differ]
        return self._tiled(i), self._tiled(j), allowed.repeat(self.count)

    def told(self, predicate: str) -> tuple[Tensor, Tensor]:
        one, other = self.template.told(predicate)
        return self._tiled(one), self._tiled(other)

    @cached_property
    def stated_pairs(self) -> tuple[Tensor, Tensor, Tensor]:
        """As `Plan.stated_pairs`; without pairs that stand alike in all copies."""
        i, predicate, j = self.template.stated_pairs
        differ = self.apart_in[i] | self.apart_in[j]
        return self._tiled(i[differ]), predicate[differ].repeat(self.count), self._tiled(j[differ])

    def everywhere(self, number: int) -> Tensor:
        return number + self._shift[:, 0]

    @cached_property
    def rooms(self) -> list[tuple[Tensor, np.ndarray, tuple[Opening, ...]]]:
        return [(torch.arange(self.count), corners, openings) for _, corners, openings in self.template.rooms]

    @cached_property
    def walls(self) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        start, along, normal, length = (of.expand(self.count, *of.shape[1:]) for of in self.template.walls)
        return start, along, normal, length

    def pairs(self, first: Tensor, second: Tensor, *, least: bool = False) -> tuple[Tensor, Tensor]:
        """As `Plan.pairs`; `least`: what stands alike in all copies is paired in the first one alone."""
        n = len(self.template)
        together = first[:n, None] & second[None, :n]
        together.fill_diagonal_(False)
        still = self._still if least else None
        i, j = (together if still is None else together & ~still).nonzero(as_tuple=True)
        i, j = (self._shift + i).reshape(-1), (self._shift + j).reshape(-1)
        if still is None:
            return i, j
        one, other = (together & still).nonzero(as_tuple=True)
        return torch.cat([one, i]), torch.cat([other, j])

    def beside(self, i: Tensor, others: Tensor) -> tuple[Tensor, Tensor]:
        n = len(self.template)
        which = others[:n].nonzero()[:, 0]
        row = torch.arange(len(i)).repeat_interleave(len(which))
        return row, (i - i % n)[row] + which.repeat(len(i))

    @cached_property
    def _still(self) -> Tensor | None:
        """(N, N) bool, pairs that stand alike in all copies; None where it is no use to leave them out."""
        if self.count * len(self.template) ** 2 < MANY or bool(self.apart_in.all()):
            return None
        return ~(self.apart_in[:, None] | self.apart_in)

    def worst(self, who: Tensor, margin: Tensor, other: Tensor) -> tuple[Tensor, Tensor]:
        least, about = super().worst(who, margin, other)
        if self._still is None:
            return least, about
        rows = ~(self.moved[who] | self.moved[other])
        rest, of = worst(who[rows], margin[rows], other[rows], len(self.template), FAR)
        rest = rest.repeat(self.count)
        return torch.minimum(least, rest), torch.where(rest < least, self._tiled(of), about)

    @cached_property
    def _dense(self) -> tuple[Tensor, Tensor, Tensor, Tensor, Tensor]:
        """(K * N * N,) each: lateral, forward, half width and half depth of the first in the second's frame, apart."""
        n = len(self.template)
        x, z = (self.position[:, axis].reshape(-1, n) for axis in (0, 2))
        cos, sin = (turn.reshape(-1, n) for turn in self.turn)
        dx, dz = x[:, :, None] - x[:, None], z[:, :, None] - z[:, None]
        lateral = cos[:, None] * dx - sin[:, None] * dz
        forward = sin[:, None] * dx + cos[:, None] * dz
        along = (cos[:, :, None] * cos[:, None] + sin[:, :, None] * sin[:, None]).abs()
        across = (sin[:, :, None] * cos[:, None] - cos[:, :, None] * sin[:, None]).abs()
        width, depth = self.template.size[:, None, 0] / 2, self.template.size[:, None, 2] / 2
        half_width, half_depth = along * width + across * depth, across * width + along * depth
        gap = torch.maximum(lateral.abs() - half_width - width.T, forward.abs() - half_depth - depth.T)
        gap = torch.maximum(gap, gap.transpose(1, 2))
        return tuple(of.reshape(-1) for of in (lateral, forward, half_width, half_depth, gap))  # type: ignore[return-value]

    def _at(self, i: Tensor, j: Tensor) -> Tensor:
        n = len(self.template)
        return i * n + j % n

    def local(self, i: Tensor, j: Tensor) -> tuple[Tensor, Tensor]:
        at = self._at(i, j)
        return self._dense[0][at], self._dense[1][at]

    def reach(self, i: Tensor, j: Tensor) -> tuple[Tensor, Tensor]:
        at = self._at(i, j)
        return self._dense[2][at], self._dense[3][at]

    def apart(self, i: Tensor, j: Tensor) -> Tensor:
        return self._dense[4][self._at(i, j)]

    def __len__(self) -> int:
        return self.count * len(self.template)


def copies_of(room: Plan, position: Tensor, yaw: Tensor, moved: Tensor) -> Copies:
    """Copies of a plan of one room.

    Arguments:
        room: N boxes. position: (K, N, 3) float, metres; yaw: (K, N) float, radians, of the copies.
        moved: (N,) bool, boxes that do not stand alike in all of them.
    """
    count = len(yaw)
    return Copies(
        room.kinds * count, room.size.repeat(count, 1), position.reshape(-1, 3), yaw.reshape(-1),
        torch.arange(count).repeat_interleave(len(room)), room.floor.expand(count, *room.floor.shape[1:]),
        room.openings * count, room.triplets[:0], room.given.repeat(count),
        None if room.height is None else room.height.expand(count), room.rules, room.stated,
        template=room, apart_in=moved,
    )  # fmt: skip
