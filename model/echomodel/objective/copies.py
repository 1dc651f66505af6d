"""Copies of one room that differ in the poses of its boxes alone: what is said of its words is said once."""

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any

import numpy as np

from echomodel.arrays import Array, at_least, kit, norm, pairs_in, repeat, rows
from echomodel.boxes2d import reach, to_frame
from echomodel.objective.plan import FAR, OF_WORDS, Found, Plan, worst
from echomodel.openings import Opening
from echomodel.vocabulary import Category


@dataclass(frozen=True, eq=False)
class Watched(Plan):
    """A plan that notes whose poses are asked for: of masks of words and pairs of them, before any pose is compared."""

    asked: Array = field(kw_only=True)

    def those(self, mask: Array) -> Array:
        self.asked[mask] = True
        return super().those(mask)

    def pairs(self, first: Array, second: Array, *, least: bool = False) -> tuple[Array, Array]:
        i, j = super().pairs(first, second)
        return self._noted(i), self._noted(j)

    def rows_of(self, predicate: str) -> Array:
        rows = super().rows_of(predicate)
        for ends in self.stated_pairs[::2]:
            self._noted(ends[rows])
        return rows

    def beside(self, i: Array, others: Array) -> tuple[Array, Array]:
        row, k = super().beside(i, others)
        return row, self._noted(k)

    def _noted(self, numbers: Array) -> Array:
        self.asked[numbers] = True
        return numbers


def looks_at(room: Plan, find: Callable[[Plan], Found]) -> Array:
    """(N,) bool, the boxes of a room whose poses decide what a term finds, whatever they are."""
    plan = Watched(**{of.name: getattr(room, of.name) for of in fields(Plan)}, asked=room.kit.zeros_like(room.fixed))
    vars(plan).update({name: getattr(room, name) for name in (*OF_WORDS, "turn")})
    find(plan)
    for whom in (room.anchor, room.group, room.carrier):
        plan.asked[whom[plan.asked & (whom >= 0)]] = True
    return plan.asked


def _repeated(name: str) -> cached_property[Array]:
    """A column of the room, the same in every copy."""
    return cached_property(lambda copies: copies._prefix(name, lambda room: copies._again(getattr(room, name))))


def _numbered(name: str) -> cached_property[Array]:
    """Numbers of boxes of the room, in every copy its own."""
    return cached_property(lambda copies: copies._prefix(name, lambda room: copies._tiled(getattr(room, name))))


@dataclass(frozen=True, eq=False)
class Copies(Plan):
    """K copies of a room of N boxes, K * N boxes in all; whom each attends and stands on is as in the first.

    Arguments:
        template: the room. apart: (N,) bool, boxes that do not stand alike in all copies.
        others: as `Plan`, of all boxes.
    """

    template: Plan = field(kw_only=True)
    apart_in: Array = field(kw_only=True)

    @cached_property
    def count(self) -> int:
        """How many copies there are."""
        return len(self.openings)

    @property
    def first(self) -> Plan:
        """The room itself."""
        return self.template

    @cached_property
    def moved(self) -> Array:
        """(K * N,) bool, boxes that do not stand alike in all copies."""
        return self._again(self.apart_in)

    @cached_property
    def _shift(self) -> Array:
        return self.kit.arange(self.count)[:, None] * len(self.template)

    def _again(self, column: Array) -> Array:
        """(K * N, ...): a column of the room (N, ...), the same in every copy."""
        return repeat(column[None], self.count).reshape(-1, *column.shape[1:])

    def _tiled(self, number: Array) -> Array:
        """(K * P,) numbers of boxes of the room (P,), negative ones as they are, in every copy."""
        return self.kit.where(number[None] < 0, number[None], number[None] + self._shift).reshape(-1)

    def _prefix(self, asked: object, spread: Callable[[Plan], Array]) -> Array:
        """What is said of the words of the room in all copies: the first of as many as there ever were."""
        kept = vars(self.template).setdefault("spread", {})
        if len(kept.get(asked, ())) < len(self):
            kept[asked] = spread(self.template)
        return kept[asked][: len(self)]

    def of(self, *roles: str) -> Array:
        asked = ("of", *roles)
        return self._kept(asked, lambda: self._prefix(asked, lambda room: self._again(room.of(*roles))))

    def stands(self, *slot_roles: str) -> Array:
        asked = ("stands", *slot_roles)
        return self._kept(asked, lambda: self._prefix(asked, lambda room: self._again(room.stands(*slot_roles))))

    def which(self, asked: Callable[[Category], object]) -> Array:
        return self._again(self.template.which(asked))

    def column(self, asked: Callable[[Category], Any]) -> Array:
        return self._again(self.template.column(asked))

    @cached_property
    def slot_role(self) -> tuple[str, ...]:
        return self.template.slot_role * self.count

    standing, movable, solid = _repeated("standing"), _repeated("movable"), _repeated("solid")
    works, dining, fronts = _repeated("works"), _repeated("dining"), _repeated("fronts")
    smaller, walled = _repeated("smaller"), _repeated("walled")
    joins, carrier, anchor, group = _numbered("joins"), _numbered("carrier"), _numbered("anchor"), _numbered("group")

    def inside(self, points: Array, who: Array) -> Array:
        if self.template.rectangle is None:
            return super().inside(points, who)
        middle, half = self.template.rectangle
        out = abs(points - middle) - half
        deepest = self.kit.maximum(out[..., 0], out[..., 1])
        return self.kit.where(deepest <= 0, -deepest, -norm(at_least(out, 0.0)))

    @cached_property
    def couples(self) -> tuple[Array, Array, Array]:
        """As `Plan.couples`; without pairs that stand alike in all copies."""
        i, j, allowed = self.template.couples
        differ = self._differ[i, j]
        i, j, allowed = i[differ], j[differ], allowed[differ]
        return self._tiled(i), self._tiled(j), self._again(allowed)

    def ends_of(self, predicate: str) -> tuple[Array, Array]:
        one, other = self.template.ends_of(predicate)
        return self._tiled(one), self._tiled(other)

    @cached_property
    def stated_pairs(self) -> tuple[Array, Array, Array]:
        """As `Plan.stated_pairs`; without pairs that stand alike in all copies."""
        i, predicate, j = self.template.stated_pairs
        differ = self._differ[i, j]
        return self._tiled(i[differ]), self._again(predicate[differ]), self._tiled(j[differ])

    @cached_property
    def rooms(self) -> list[tuple[Array, np.ndarray, tuple[Opening, ...]]]:
        return [(self.kit.arange(self.count), corners, openings) for _, corners, openings in self.template.rooms]

    @cached_property
    def walls(self) -> tuple[Array, Array, Array, Array]:
        start, along, normal, length = (_spread(of, self.count) for of in self.template.walls)
        return start, along, normal, length

    def pairs(self, first: Array, second: Array, *, least: bool = False) -> tuple[Array, Array]:
        """As `Plan.pairs`; `least`: what stands alike in all copies is paired in the first one alone."""
        n = len(self.template)
        together = first[:n, None] & second[None, :n] & ~self.kit.eye(n, dtype=self.kit.bool)
        i, j = pairs_in(together & self._differ if least else together)
        one, other = pairs_in(together & ~self._differ if least else together[:0])
        i, j = ((self._shift + of).reshape(-1) for of in (i, j))
        return self.kit.concat([one, i]), self.kit.concat([other, j])

    def beside(self, i: Array, others: Array) -> tuple[Array, Array]:
        n = len(self.template)
        which = rows(others[:n])
        row = repeat(self.kit.arange(len(i)), len(which))
        return row, (i - i % n)[row] + self.kit.tile(which, (len(i),))

    @cached_property
    def _differ(self) -> Array:
        """(N, N) bool, pairs that do not stand alike in all copies."""
        return self.apart_in[:, None] | self.apart_in

    def worst(self, who: Array, margin: Array, other: Array) -> tuple[Array, Array]:
        least, about = super().worst(who, margin, other)
        alike = ~(self.moved[who] | self.moved[other])
        if not bool(alike.any()):
            return least, about
        rest, of = worst(who[alike], margin[alike], other[alike], len(self.template), FAR)
        rest = self._again(rest)
        return self.kit.minimum(least, rest), self.kit.where(rest < least, self._tiled(of), about)

    @cached_property
    def _listed(self) -> tuple[Array, Array, Array, Array]:
        """Numbers (P,), (P,) of the pairs whose geometry is kept, those that stand alike in all copies once; and for
        each pair of the room (N * N,) where it is kept in the first copy, and how much further in the next one."""
        differ, xp = self._differ, self.kit
        i, j = pairs_in(~differ)
        one, other = pairs_in(differ)
        first, step = xp.zeros_like(differ, dtype=xp.int64), xp.where(differ, len(one), 0)
        first[i, j], first[one, other] = xp.arange(len(i)), len(i) + xp.arange(len(one))
        one, other = (self._shift + one).reshape(-1), (self._shift + other).reshape(-1)
        return xp.concat([i, one]), xp.concat([j, other]), first.reshape(-1), step.reshape(-1)

    @cached_property
    def _geometry(self) -> tuple[Array, Array, Array, Array, Array]:
        """(P,) each: lateral, forward, half width and half depth of the first in the second's frame, apart."""
        i, j, xp = *self._listed[:2], self.kit
        x, z = (self.position[i, axis] - self.position[j, axis] for axis in (0, 2))
        (cos, other_cos), (sin, other_sin) = ((turn[j], turn[i]) for turn in self.turn)
        along, across = abs(other_cos * cos + other_sin * sin), abs(other_sin * cos - other_cos * sin)
        lateral, forward = to_frame(x, z, cos, sin)
        width, depth = self.size[i, 0] / 2, self.size[i, 2] / 2
        half_width, half_depth = reach(width, depth, along, across)
        gap = xp.maximum(
            abs(lateral) - half_width - self.size[j, 0] / 2, abs(forward) - half_depth - self.size[j, 2] / 2
        )
        return lateral, forward, half_width, half_depth, xp.maximum(gap, gap[self._at(j, i)])

    def _at(self, i: Array, j: Array) -> Array:
        n, (_, _, first, step) = len(self.template), self._listed
        pair = i % n * n + j % n  # numbers below 0, of nobody, are told of whoever comes last
        return first[pair] + i // n * step[pair]

    def local(self, i: Array, j: Array) -> tuple[Array, Array]:
        at = self._at(i, j)
        return self._geometry[0][at], self._geometry[1][at]

    def reach(self, i: Array, j: Array) -> tuple[Array, Array]:
        at = self._at(i, j)
        return self._geometry[2][at], self._geometry[3][at]

    def apart(self, i: Array, j: Array) -> Array:
        return self._geometry[4][self._at(i, j)]

    def __len__(self) -> int:
        return self.count * len(self.template)


def copies_of(room: Plan, position: Array, yaw: Array, moved: Array) -> Copies:
    """Copies of a plan of one room.

    Arguments:
        room: N boxes. position: (K, N, 3) float, metres; yaw: (K, N) float, radians, of the copies.
        moved: (N,) bool, boxes that do not stand alike in all of them.
    """
    count, xp = len(yaw), room.kit
    return Copies(
        room.kinds * count, xp.tile(room.size, (count, 1)), position.reshape(-1, 3), yaw.reshape(-1),
        repeat(xp.arange(count), len(room)), _spread(room.floor, count), room.openings * count, room.triplets[:0],
        xp.tile(room.fixed, (count,)), None if room.height is None else _spread(room.height, count), room.rules,
        room.stated, template=room, apart_in=moved,
    )  # fmt: skip


def _spread(one: Array, count: int) -> Array:
    """(K, ...) the only row (1, ...) as so many, none of them copied."""
    return kit(one).broadcast_to(one, (count, *one.shape[1:]))
