"""What a model's file says by itself: its surface, unit and axes, labels, material slots, physics and licence."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import trimesh

from echousd.assets.colors import Coat


@dataclass(frozen=True, eq=False)
class Measured:
    """A model as it was read, in its own frame and unit.

    Arguments:
        points: (v, 3) float. faces: (f, 3) int.
        metres: per unit, None where the file does not say. z_up: whether +Z points up.
        above: (4, 4) float, from the frame above its root prim to its own frame, as only a prim below others has one.
        yaw: radians by which a prim of a stage stands turned about its up axis, counter-clockwise seen from above.
        coats: areas of its surface with what covers them (`echousd.assets.colors.Coat`), where they were asked for.
        others: as in `AssetRecord`.
    """

    points: np.ndarray
    faces: np.ndarray
    metres: float | None = None
    z_up: bool = False
    prim: str = ""
    above: np.ndarray = field(default_factory=lambda: np.eye(4))
    yaw: float = 0.0
    labels: tuple[str, ...] = ()
    materials: tuple[str, ...] = ()
    licence: str = ""
    author: str = ""
    joints: int = 0
    bodies: bool = False
    colliders: bool = False
    variants: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    coats: tuple[Coat, ...] = ()

    def turned(self, turn: np.ndarray) -> trimesh.Trimesh:
        """The surface after a rotation (3, 3), in the model's own unit."""
        return trimesh.Trimesh(self.points @ turn.T, self.faces, process=False)
