"""What a model's file says by itself: its surface, unit and axes, labels, material slots, physics and licence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh


@dataclass(frozen=True, eq=False)
class Measured:
    """A model as it was read, in its own frame and unit.

    Arguments:
        points: (v, 3) float. faces: (f, 3) int.
        metres: per unit, None where the file does not say. z_up: whether +Z points up.
        others: as in `AssetRecord`.
    """

    points: np.ndarray
    faces: np.ndarray
    metres: float | None = None
    z_up: bool = False
    prim: str = ""
    labels: tuple[str, ...] = ()
    materials: tuple[str, ...] = ()
    licence: str = ""
    author: str = ""
    joints: int = 0
    bodies: bool = False
    colliders: bool = False
    variants: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()

    def turned(self, turn: np.ndarray) -> trimesh.Trimesh:
        """The surface after a rotation (3, 3), in the model's own unit."""
        return trimesh.Trimesh(self.points @ turn.T, self.faces, process=False)
