"""Two more solids for small things: what is turned on a wheel from a profile, and cloth between two sides."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from echomodel.furniture.solids import FINEST, Array, Solid, loft, superellipse


@dataclass(frozen=True, eq=False)
class Lathe(Solid):
    """A solid of revolution about +Y: `profile` (k, 2) float holds radius and height from rim to rim, metres.

    A profile that comes back down inside makes a vessel.
    """

    profile: Array = field(default_factory=lambda: np.array([[1.0, 0.0], [1.0, 1.0]]))

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        circle = superellipse(2.0, (8, 10, 14, 20)[detail])
        return loft([np.insert(circle * max(radius, 1e-4), 1, height, axis=1) for radius, height in self.profile])


@dataclass(frozen=True, eq=False)
class Sheet(Solid):
    """Cloth: `front` and `back` (n, m, 3) float are its two sides, point for point, metres."""

    front: Array = field(default_factory=lambda: np.zeros((2, 2, 3)))
    back: Array = field(default_factory=lambda: np.zeros((2, 2, 3)))

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        n, m = self.front.shape[:2]
        index = np.arange(n * m).reshape(n, m)
        vertices = np.concatenate([self.front.reshape(-1, 3), self.back.reshape(-1, 3)])
        border = np.concatenate([index[0, :-1], index[:-1, -1], index[-1, :0:-1], index[:0:-1, 0]])
        after = np.roll(border, -1)
        far = n * m
        faces = np.concatenate(
            [
                _quads(index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]),
                _quads(index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]) + far,
                _quads(after, border, border + far, after + far),
            ]
        )
        corners = vertices[faces]
        volume = np.einsum("nx,nx->n", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum()
        return vertices, faces if volume > 0 else np.ascontiguousarray(faces[:, ::-1])


def _quads(a: Array, b: Array, c: Array, d: Array) -> Array:
    a, b, c, d = (v.ravel() for v in (a, b, c, d))
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
