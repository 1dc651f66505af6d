"""Padding that is drawn in: backs and headboards with buttons amid diamonds, or in channels."""

from dataclasses import dataclass

import numpy as np

from echomodel.furniture.cloth import closed, grid
from echomodel.furniture.solids import FINEST, Array, Block, loft, superellipse

BUTTON = ((0.014, -0.003), (0.015, 0.003), (0.008, 0.008))  # half widths of a button at heights over the cloth, metres


@dataclass(frozen=True, eq=False)
class Tufted(Block):
    """A padded panel whose front (+z) is drawn in every `apart` metres: to buttons amid diamonds, or along channels."""

    soft = True
    apart: float = 0.2
    channels: bool = False

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        w, h, d = self.half
        r, cells = min(0.04, 0.4 * self.apart, 0.45 * w, 0.45 * h, d), (2, 4, 4, 6)[detail]  # from a fold to the next
        (x, i, e), (y, j, f) = (_rounded_line(*line) for line in (
            (w, r, cells * max(1, round((2 + 2 * self.channels) * (w - r) / self.apart))),
            (h, r, 1 if self.channels else cells * max(1, round(2 * (h - r) / self.apart)))))  # fmt: skip
        i, edge = i[:, None], np.minimum(e[:, None], f)
        if self.channels:
            one = other = np.sqrt(np.abs(np.sin(np.pi * i / cells))) + 0 * j
        else:
            one, other = (np.abs(np.cos(np.pi * line / cells)) for line in (i + j, i - j))
        drawn = (1 - one * other) ** 2 + 0.8 * (1 - np.maximum(one, other)) ** 2
        z = d - r + r * np.sqrt(1 - (1 - edge) ** 2) - 0.44 * d * min(1.0, self.apart / 0.2) * drawn * edge
        z[edge == 0] = -d
        points = np.stack([*np.broadcast_arrays(x[:, None], y, z)], -1)
        inner = (one + other < 1e-6) & (i > 0) & (i < i.max()) & (j > 0) & (j < j.max())
        buttons = points[inner] if detail > 1 else points[:0, 0]
        faces, border = grid(*z.shape)
        # of each quad, which folds where it is deeper, as its mirror image does
        first, second = faces.reshape(2, -1, 3)
        (a, b, c), e, z = first.T.copy(), second[:, 2].copy(), z.ravel()
        gain = z[a] + z[c] - z[b] - z[e]
        other = np.where(np.abs(gain) > 1e-6, gain > 0, (points.reshape(-1, 3)[[a, c], 0].sum(0) > 0))
        first[other], second[other] = np.stack([a, b, e], 1)[other], np.stack([b, c, e], 1)[other]
        vertices, faces = closed(points, faces, border, (0.0, 0.0, -d))
        knob, sides = loft([np.insert(superellipse(2.0, 6)[::-1] * wide, 2, high, axis=1) for wide, high in BUTTON])
        more = (sides + len(knob) * np.arange(len(buttons))[:, None, None] + len(vertices)).reshape(-1, 3)
        return np.concatenate([vertices, (buttons[:, None] + knob).reshape(-1, 3)]), np.concatenate([faces, more])


def _rounded_line(half: float, r: float, cells: int) -> tuple[Array, Array, Array]:
    """Places across a panel whose edges are round, as many cells between these; which cell each is at, and how far
    in from the edge, in `r`.
    """
    near = np.array([0.0, 0.1, 0.4])
    flat = np.linspace(r - half, half - r, cells + 1)
    share = np.concatenate([near, np.ones(cells + 1), near[::-1]])
    place = np.concatenate([r * near - half, flat, half - r * near[::-1]])
    return place, np.concatenate([[0] * 3, np.arange(cells + 1), [cells] * 3]), share
