"""Solids that are bent: boards that give to a back, walls round one, leaves."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from echomodel.furniture.solids import FINEST, Array, Block, Solid, Vector, loft, superellipse


@dataclass(frozen=True, eq=False)
class Bow(Block):
    """A board with round edges whose middle stands back (-z) by `bow` metres behind its ends at left and right."""

    bow: float = 0.03

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        w, h, t = self.half
        outline = superellipse(7.0, (4, 8, 12, 16)[detail]) * (t, h)
        r, turn = max(min(self.radius, w / 2, h / 2), 0.002), np.linspace(0, np.pi / 2, (2, 3, 3, 4)[detail])
        end, cut = 1 - r * (1 - np.sin(turn)) / w, 1 - r * (1 - np.cos(turn)) / h
        across = np.concatenate([-end[::-1], np.linspace(-end[0], end[0], (3, 4, 5, 7)[detail])[1:-1], end])
        tall = np.interp(np.abs(across), end, cut)
        rings = [np.stack([0 * outline[:, 0] + w * u, outline[:, 1] * high, outline[:, 0] - self.bow * (1 - u * u)], 1)
                 for u, high in zip(across, tall, strict=True)]  # fmt: skip
        return loft(rings)


@dataclass(frozen=True, eq=False)
class Shell(Solid):
    """A standing wall bent round the back: half a superellipse, `half` = half width and depth behind z = 0, metres.

    It is `thickness` thick, rises from y = 0 to `back` in the middle and falls to `front` at its ends; `ease` above 1
    keeps the back high for longer.
    """

    half: tuple[float, float] = (1.0, 1.0)
    thickness: float = 0.1
    back: float = 0.8
    front: float = 0.6
    power: float = 2.5
    ease: float = 3.0
    RINGS = (9, 15, 23, 35)  # by detail

    def _top(self, angle: Array) -> Array:
        return self.back + (self.front - self.back) * np.clip(np.abs(angle) / (np.pi / 2), 0, 1) ** self.ease

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        angle = np.linspace(-np.pi / 2, np.pi / 2, self.RINGS[detail] - 2)
        s, c = np.sin(angle), np.cos(angle)
        norm = (np.abs(s) ** self.power + np.abs(c) ** self.power) ** (1 / self.power)
        top, rings, back = self._top(angle), [], np.array([0, 0, 0.3 * self.thickness])
        turn = np.linspace(0, np.pi, (2, 4, 5, 6)[detail])  # over the wall's top, which is as round as it is thick
        across, down = np.array([1, 0, *(1 - np.cos(turn)) / 2]), self.thickness / 2 * (1 - np.sin(turn)) * (detail > 0)
        for sine, cosine, length, high in zip(s, c, norm, top, strict=True):
            wall = (np.array(self.half) - across[:, None] * self.thickness) * (sine, -cosine) / length
            rings.append(np.insert(wall, 1, [0, 0, *(high - down)], axis=1))
        ends = np.array([rings[0], rings[-1]])  # which are round
        first, last = (middle := ends.mean(1, keepdims=True)) + 0.7 * (ends - middle)
        return loft([first, rings[0] - back, *rings[1:-1], rings[-1] - back, last])

    def runs(self, vertices: Array) -> list[Array]:
        count = next(n for n in self.RINGS if (len(vertices) - 2) % n == 0)
        rings, ends = vertices[:-2].reshape(count, -1, 3), np.linspace(0, count - 1, 7).round().astype(int)
        return [rings[first : last + 1].reshape(-1, 3) for first, last in pairwise(ends)]


def bent(centre: Vector, half: tuple[float, float], thickness: float, back: float, front: float, **form: Any) -> Shell:
    """A wall round the back of `centre` (3,), see `Shell`: the upholstered back of a seat, unless said otherwise."""
    form = {"material": "fabric", "role": "back", **form}
    return Shell(np.array(centre, float), half=half, thickness=thickness, back=back, front=front, **form)


@dataclass(frozen=True, eq=False)
class Blade(Solid):
    """A leaf from the origin along +z: pointed at both ends, folded along its middle, its tip bent down by `bend`.

    Arguments:
        length, width, thick: metres. bend: radians from root to tip. full: where along it is widest, 0 to 1.
    """

    length: float = 0.3
    width: float = 0.1
    thick: float = 0.006
    bend: float = 0.6
    full: float = 0.45

    def _spine(self, count: int) -> tuple[Array, Array, Array]:
        """Points (n, 3) along the middle, their upward normals and half widths."""
        share = np.arange(count) * (1 / (count - 1))
        angle, (points, normal) = -self.bend * share, np.zeros((2, count, 3))
        middle, step = (angle[1:] + angle[:-1]) / 2, self.length / (count - 1)
        points[1:, 1], points[1:, 2] = np.cumsum(np.sin(middle) * step), np.cumsum(np.cos(middle) * step)
        normal[:, 1], normal[:, 2] = np.cos(angle), -np.sin(angle)
        warped = np.where(share < self.full, share / self.full / 2, 0.5 + (share - self.full) / (1 - self.full) / 2)
        return points, normal, self.width / 2 * np.sin(np.pi * warped) ** 0.8

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        points, normal, half = self._spine((3, 4, 5, 7)[detail])
        reach = np.maximum(half, 0.06 * self.width)[:, None]
        out, fold, thick = reach * [1.0, 0.0, 0.0], 0.42 * reach * normal, self.thick / 2 * normal
        return loft(np.stack([points + out + fold, points + thick, points - out + fold, points - thick], 1))
