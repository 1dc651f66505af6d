"""What a placed room still gets wrong: collisions, and objects outside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from echomodel.objective.support import allowed_overlap
from echousd.place.geometry import beyond, separation

if TYPE_CHECKING:
    from echousd.place.setting import Setting

TOUCH = 0.01  # metres: deeper than this into another box is a collision, further than this outside is outside


@dataclass(frozen=True)
class Collision:
    """Two objects that run into each other, by `depth` metres."""

    first: str
    second: str
    depth: float

    def __str__(self) -> str:
        return f"{self.first} and {self.second} collide by {self.depth:.2f} m"

    def to_json(self) -> dict[str, Any]:
        """The entry of the manifest, and of a check's report."""
        return {"objects": [self.first, self.second], "depth": round(self.depth, 4)}


def collisions(
    categories: Sequence[str], size: np.ndarray, position: np.ndarray, yaw: np.ndarray, pairs: np.ndarray
) -> tuple[tuple[tuple[int, int], float], ...]:
    """Pairs (p, 2) of boxes that run into each other deeper than they may, deepest first, with the excess in metres."""
    depth = -(separation(size, position, yaw, pairs) + allowed_overlap(categories, size, pairs))
    order = np.argsort(-depth, kind="stable")
    return tuple(((i, j), float(depth[p])) for p, (i, j) in zip(order, pairs[order].tolist(), strict=True)
                 if depth[p] > TOUCH)  # fmt: skip


def outside(setting: Setting, size: np.ndarray, position: np.ndarray, yaw: np.ndarray) -> tuple[tuple[int, float], ...]:
    """Objects that leave the floor, with the depth in metres."""
    if setting.outline is None:
        return ()
    depth = beyond(setting.outline, size, position, yaw)
    return tuple((i, float(depth[i])) for i in np.flatnonzero(depth > TOUCH).tolist())
