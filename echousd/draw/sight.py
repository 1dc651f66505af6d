"""What of the furniture an eye sees: boxes that hide one another."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property, reduce

import numpy as np

from echomodel.boxes2d import axes, upright

CUT = 3.0  # how much more what is cut off by a picture's border disturbs
ASPECT = 1.6  # of a picture from inside: its width over its height
# rays through such a picture whose half width at distance 1 is 1, and what each of these counts
SPREAD = np.arange(-6, 7) / 6
RAYS = np.stack([*(g.ravel() for g in np.meshgrid(SPREAD, SPREAD / ASPECT)), np.full(169, -1.0)], 1)
# of a box whose size is 1: its corners, and the points that are looked for in it
CUBE = np.stack(np.meshgrid((-0.5, 0.5), (0.0, 1.0), (-0.5, 0.5), indexing="ij"), -1).reshape(-1, 3)
GRID = np.stack(np.meshgrid(*[(-0.45, 0.0, 0.45)] * 3, indexing="ij"), -1).reshape(-1, 3)
WEIGHTS = np.where(np.abs(RAYS[:, :2] * (1, ASPECT)).max(1) > 0.8, CUT, 1.0)


@dataclass(frozen=True, eq=False)
class Furniture:
    """The boxes of n objects: size and bottom centre (n, 3) float, metres, yaw (n,) float, radians."""

    size: np.ndarray
    position: np.ndarray
    yaw: np.ndarray

    @cached_property
    def facing(self) -> np.ndarray:
        """(2,) float, x and z of the mean front, weighted by volume."""
        weight = self.size.prod(1)
        front = (axes(self.yaw)[1] * weight[:, None]).sum(0)
        return front / max(float(weight.sum()), 1e-9)

    @cached_property
    def corners(self) -> np.ndarray:
        """(n, 8, 3) float, the corners of each box, metres."""
        return np.asarray(self.position[:, None] + np.einsum("nji,nkj->nki", self._turns, CUBE * self.size[:, None]))

    def of(self, rows: np.ndarray) -> Furniture:
        """Some of these boxes."""
        return Furniture(self.size[rows], self.position[rows], self.yaw[rows])

    def with_others(self, *others: Furniture | None) -> Furniture:
        """These boxes, then some others."""
        every = [self, *(other for other in others if other is not None)]
        return Furniture(*(np.concatenate([getattr(one, f.name) for one in every]) for f in fields(Furniture)))

    def met(self, view: np.ndarray, half: float, near: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(169,) int which box is the nearest along each of `RAYS` through a picture from inside, metres to it, inf
        where there is none, and how far the ray goes where the box looks, 1 = straight at its back.

        `view`: (4, 4) float camera to world. `half`: half of the picture's width at distance 1. `near`: metres ahead
        from where on things are seen.
        """
        ways = (RAYS * (half, half, 1.0)) @ view[:3, :3].T
        far = np.linalg.norm(ways, axis=1, keepdims=True)
        ways, begin = ways / far, near * far[:, 0]
        turn = self._turns
        start = np.einsum("nij,nj->ni", turn, view[:3, 3] - self.position - self.size * (0.0, 0.5, 0.0))
        way = (turn.reshape(-1, 3) @ ways.T).reshape(len(turn), 3, -1).transpose(0, 2, 1)
        enter, leave = _crossing(start[:, None], way, 0.5 * self.size[:, None])
        away = np.where((enter < leave) & (leave > begin), np.maximum(enter, begin), np.inf)
        nearest = away.argmin(0), np.arange(len(RAYS))
        return nearest[0], away[nearest], way[..., 2][nearest]

    def blocked(self, eye: np.ndarray, others: Furniture | None = None) -> tuple[np.ndarray, np.ndarray]:
        """(n, 27, 3) points in each box, metres, and (n, 27) whether another or one of `others` hides them."""
        n, boxes = len(self.size), self.with_others(others)
        turn, middle = boxes._turns, boxes.position + boxes.size * (0.0, 0.5, 0.0)
        points = middle[:n, None] + np.einsum("nji,nkj->nki", turn[:n], GRID * self.size[:, None])
        far, wide = (middle - eye)[:, ::2], np.hypot(*boxes.size.T[::2]) / 2
        share = np.clip(far[:n] @ far.T / (far[:n] ** 2).sum(1)[:, None].clip(1e-12), 0.0, 1.0)[..., None]
        beside = np.linalg.norm(far - share * far[:n, None], axis=2) - wide - wide[:n, None]  # of b from lines to a
        a, b = np.nonzero((beside < 1e-6) & ~np.eye(n, len(wide), dtype=bool))
        # every line of sight (object a, point k) in the frame of every box b
        start = np.einsum("bij,bj->bi", turn, eye - middle)[b, None]
        way = np.einsum("bij,bkj->bki", turn[b], points[a] - eye)
        enter, leave = _crossing(start, way, 0.5 * boxes.size[b, None])
        hidden = np.zeros(points.shape[:2], bool)
        np.logical_or.at(hidden, a, (enter < leave) & (leave > 0) & (enter < 1))
        return points, hidden

    @cached_property
    def _turns(self) -> np.ndarray:
        """(n, 3, 3) from the room's frame to each object's."""
        return upright(-self.yaw)


def filled(away: np.ndarray, reach: np.ndarray) -> float:
    """Share of a picture that is nearer than `reach` metres: the nearer the more, and what its border cuts off `CUT`
    times; `away`, `reach`: (169,) metres, as `Furniture.met` has them."""
    return float((np.clip(1.0 - away / reach, 0.0, 1.0) * WEIGHTS).mean())


def _crossing(start: np.ndarray, way: np.ndarray, half: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where rays enter and leave boxes around 0 of these half sizes, in its lengths; later than that, they miss."""
    way = np.where(np.abs(way) < 1e-9, 1e-9, way)
    first, second = (-half - start) / way, (half - start) / way
    enter, leave = (np.moveaxis(each, -1, 0) for each in (np.minimum(first, second), np.maximum(first, second)))
    return reduce(np.maximum, enter), reduce(np.minimum, leave)  # of three each, which numpy is slow to go through
