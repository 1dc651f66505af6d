"""What the surfaces of a room throw on to one another: a coarse table of how bright they are, by place and side."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

CELL = 0.5  # metres
THROWN = 0.7  # of what surfaces of their colours would: so rooms have the contrast that photographs have


@dataclass(frozen=True, eq=False)
class Bounced:
    """How bright the surfaces of a room are: (3, cells * 6) radiance by cell of `CELL` metres and side.

    `low`: (3,) the room's corner, metres. `shape`: (3,) int, cells along x, y and z.
    """

    low: np.ndarray
    shape: np.ndarray
    radiance: np.ndarray

    @classmethod
    def dark(cls, low: np.ndarray, high: np.ndarray) -> Bounced:
        """The table of a room between two corners (3,), metres, without light."""
        shape = np.maximum(np.ceil((high - low) / CELL), 1).astype(int)
        return cls(low.astype(np.float32), shape, np.zeros((3, 6 * shape.prod()), np.float32))

    def rows(self, origin: np.ndarray, way: np.ndarray, far: np.ndarray, axis: np.ndarray) -> np.ndarray:
        """(n,) int, the rows of `radiance` where rays, `origin` and `way` (3, n), met surfaces after `far` (n,) metres.

        `axis`: (n,) int, along which of them the surfaces look.
        """
        side = 2 * axis + (way.ravel().take(axis * len(far) + np.arange(len(far))) < 0)
        before = np.maximum(far - 0.05, 0) * way + (origin - self.low[:, None])
        x, y, z = (np.clip((at / CELL).astype(int), 0, many - 1) for at, many in zip(before, self.shape, strict=True))
        return np.asarray(((x * self.shape[1] + y) * self.shape[2] + z) * 6 + side)

    def lit(self, rows: np.ndarray, thrown: np.ndarray) -> Bounced:
        """The table where surfaces throw back what some of them do, (3, n); where none is in a row, the mean of its
        side."""
        many = self.radiance.shape[1]
        total = np.stack([np.bincount(rows, channel, many) for channel in thrown])
        count = np.bincount(rows, minlength=many)
        even = total.reshape(3, -1, 6).sum(1) / np.maximum(count.reshape(-1, 6).sum(0), 1)
        mean = np.where(count > 0, total / np.maximum(count, 1), np.tile(even, many // 6))
        return replace(self, radiance=(THROWN * mean).astype(np.float32))
