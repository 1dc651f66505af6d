"""What of the furniture an eye sees: boxes that hide one another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echomodel.roomboxes import footprints

SIDEWAYS = 0.7  # cosine of the angle to which a wide picture reaches


@dataclass(frozen=True, eq=False)
class Furniture:
    """The boxes of n objects: size and bottom centre (n, 3) float, metres, yaw (n,) float, radians."""

    size: np.ndarray
    position: np.ndarray
    yaw: np.ndarray

    @property
    def facing(self) -> np.ndarray:
        """(2,) float, x and z of the mean front, weighted by volume."""
        weight = self.size.prod(1)
        front = np.array([(np.sin(self.yaw) * weight).sum(), (np.cos(self.yaw) * weight).sum()])
        return front / max(float(weight.sum()), 1e-9)

    @property
    def centre(self) -> np.ndarray:
        """(2,) float, x and z of the middle of all footprints, metres."""
        weight = self.size[:, [0, 2]].prod(1)
        return np.asarray(weight @ self.position[:, [0, 2]] / max(float(weight.sum()), 1e-9))

    def crowding(self, eye: np.ndarray, reach: float, way: np.ndarray | None = None) -> float:
        """How much stands right before `eye` (3,): a box nearer than `reach` metres counts 0 (there) to 2 (here).

        Where `way` (2,), x and z of a look, is given, only what is in a wide picture of it counts.
        """
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        x, y, z = (eye - self.position - self.size * (0.0, 0.5, 0.0)).T
        local = np.stack([cos * x - sin * z, y, sin * x + cos * z], 1)
        away = np.linalg.norm(np.maximum(np.abs(local) - self.size / 2, 0.0), axis=1)
        near = 2.0 * np.clip(1.0 - away / reach, 0.0, 1.0)
        if way is not None:
            corners = footprints(self.size, self.position, self.yaw) - eye[[0, 2]]
            along = (corners @ way) / np.maximum(np.linalg.norm(corners, axis=-1) * np.linalg.norm(way), 1e-9)
            near = near * (along.max(1) > SIDEWAYS)
        return float(near.sum())

    def hidden(self, eye: np.ndarray) -> float:
        """How many objects are hidden behind others from `eye` (3,): shares of 27 points in each box, summed."""
        n = len(self.size)
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        turn = np.zeros((n, 3, 3))  # object frame -> room frame
        turn[:, 0, 0], turn[:, 0, 2], turn[:, 1, 1], turn[:, 2, 0], turn[:, 2, 2] = cos, sin, 1.0, -sin, cos
        middle = self.position + self.size * (0.0, 0.5, 0.0)
        grid = np.stack(np.meshgrid(*[(-0.45, 0.0, 0.45)] * 3, indexing="ij"), -1).reshape(-1, 3)
        points = middle[:, None] + np.einsum("nij,nkj->nki", turn, grid * self.size[:, None])
        # every line of sight (object a, point k) in the frame of every box b
        start = np.einsum("bij,bi->bj", turn, eye - middle)[:, None, None]
        way = np.einsum("bij,aki->bakj", turn, points - eye)
        way = np.where(np.abs(way) < 1e-9, 1e-9, way)
        half = 0.5 * self.size[:, None, None]
        first, second = (-half - start) / way, (half - start) / way
        enter, leave = np.minimum(first, second).max(-1), np.maximum(first, second).min(-1)
        blocked = (enter < leave) & (leave > 0) & (enter < 1)
        blocked[np.arange(n), np.arange(n)] = False
        return float(blocked.any(0).mean(1).sum())
