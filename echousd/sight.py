"""What of the furniture an eye sees: boxes that hide one another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# points of a box of 1 m that stands on the origin
GRID = np.stack(np.meshgrid(*[np.linspace(-0.5, 0.5, 7)] * 3, indexing="ij"), -1).reshape(-1, 3) + np.array(
    [0.0, 0.5, 0.0]
)


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

    def nearness(self, eye: np.ndarray, reach: float) -> np.ndarray:
        """(n,) how near each box is to `eye` (3,): 0 at `reach` metres and beyond, 1 where the eye touches it."""
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        x, y, z = (eye - self.position - self.size * (0.0, 0.5, 0.0)).T
        local = np.stack([cos * x - sin * z, y, sin * x + cos * z], 1)
        away = np.linalg.norm(np.maximum(np.abs(local) - self.size / 2, 0.0), axis=1)
        return np.clip(1.0 - away / reach, 0.0, 1.0)

    def filled(self, view: np.ndarray, half: float, reach: float) -> float:
        """Share of a square picture that boxes nearer than `reach` metres fill, the nearer the more.

        Arguments:
            view: (4, 4) float camera to world. half: half of the picture's width at distance 1.
            reach: metres.
        """
        near = self.nearness(view[:3, 3], reach)
        share = np.zeros(len(near))
        for number in np.flatnonzero(near):
            cos, sin = np.cos(self.yaw[number]), np.sin(self.yaw[number])
            local = GRID * self.size[number]
            points = np.stack(
                [cos * local[:, 0] + sin * local[:, 2], local[:, 1], cos * local[:, 2] - sin * local[:, 0]], 1
            )
            x, y, z = ((points + self.position[number] - view[:3, 3]) @ view[:3, :3]).T
            seen = np.stack([x, y], 1)[z < -0.05] / -z[z < -0.05, None] / half
            seen = seen[(np.abs(seen) < 1.15).all(1)]
            if len(seen):
                share[number] = np.ptp(np.clip(seen, -1, 1), axis=0).prod() / 4
        return float(near @ share)

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
