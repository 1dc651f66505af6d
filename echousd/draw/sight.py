"""What of the furniture a camera sees: boxes that hide one another."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np

from echomodel.boxes2d import axes, upright

CUT = 3.0  # how much more what is cut off by a picture's border disturbs
ASPECT = 1.6  # of a picture from inside: its width over its height
# rays through such a picture whose half width at distance 1 is 1, and what each of these counts
SPREAD = np.arange(-6, 7) / 6
RAYS = np.stack([*(g.ravel() for g in np.meshgrid(SPREAD, SPREAD / ASPECT)), np.full(169, -1.0)], 1)
# of a box whose size is 1: points that are looked for in it, and its corners
GRID = np.stack(np.meshgrid(*[(-0.45, 0.0, 0.45)] * 3, indexing="ij"), -1).reshape(-1, 3)
CUBE = np.stack(np.meshgrid((-0.5, 0.5), (0.0, 1.0), (-0.5, 0.5), indexing="ij"), -1).reshape(-1, 3)
WEIGHTS = np.where(np.abs(RAYS[:, :2] * (1, ASPECT)).max(1) > 0.8, CUT, 1.0)
TOGETHER = 16  # pictures whose rays are run at a time: they stay in the cache


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
        turns = upright(-self.yaw)  # from the room's frame to each object's
        return np.asarray(self.position[:, None] + np.einsum("nji,nkj->nki", turns, CUBE * self.size[:, None]))

    def of(self, rows: np.ndarray) -> "Furniture":
        """Some of these boxes."""
        return Furniture(self.size[rows], self.position[rows], self.yaw[rows])

    def with_others(self, *others: "Furniture | None") -> "Furniture":
        """These boxes, then some others."""
        every = [self, *(other for other in others if other is not None)]
        return Furniture(*(np.concatenate([getattr(one, f.name) for one in every]) for f in fields(Furniture)))

    def hidden(self, eye: np.ndarray) -> np.ndarray:
        """(n,) share of points in each box that others hide from an eye (3,)."""
        turns, middle, count = upright(-self.yaw), self.position + self.size * (0.0, 0.5, 0.0), len(self.size)
        points = (middle[:, None] + np.einsum("nji,nkj->nki", turns, GRID * self.size[:, None])).reshape(-1, 3)
        way = np.einsum("bij,pj->ibp", turns, points - eye)
        start = np.einsum("bij,bj->ib", turns, eye - middle)[..., None]
        enter, leave = _crossed(start, way, 0.5 * self.size.T[..., None], -np.inf)
        met = ((enter < leave) & (leave > 0) & (enter < 1)).reshape(count, count, len(GRID))
        met[np.arange(count), np.arange(count)] = False
        return np.asarray(met.any(0).mean(1))

    def met(self, views: np.ndarray, halves: np.ndarray, nears: np.ndarray | float = 0.0) -> tuple[np.ndarray, ...]:
        """What `RAYS` through v pictures meet: along each, (v, 169), int which box is the nearest, metres to it, inf
        where there is none, and how far the ray goes where the box looks, 1 = straight at its back; of each box, (v,
        n), the share of the picture that it takes, and that it would take were nothing before it.

        `views`: (v, 4, 4) float camera to world. `halves`: (v,) half of the picture's width at distance 1. `nears`:
        (v,) metres ahead from where on things are seen.
        """
        cos, sin = (each.astype("f4")[:, None] for each in (np.cos(self.yaw), np.sin(self.yaw)))
        middle, half = self.position + self.size * (0.0, 0.5, 0.0), 0.5 * self.size.astype("f4")
        found, nears = [], np.broadcast_to(nears, len(views))
        for first in range(0, len(views), TOGETHER):
            view, wide, near = (each[first : first + TOGETHER] for each in (views, halves, nears))
            aside = RAYS * np.stack([wide, wide, np.ones(len(wide))], 1)[:, None]
            ways = aside @ view[:, :3, :3].swapaxes(1, 2)
            far = np.linalg.norm(ways, axis=2, keepdims=True)
            x, y, z = np.moveaxis((ways / far).astype("f4"), 2, 0)[:, :, None]
            begin = (near[:, None, None] * far[..., 0][:, None]).astype("f4")
            # turned to the frame of each box: (v, boxes, 1) and (v, boxes, 169)
            a, b, c = np.moveaxis((view[:, None, :3, 3] - middle).astype("f4"), 2, 0)[..., None]
            ahead = x * sin + z * cos
            start, way = (a * cos - c * sin, b, a * sin + c * cos), (x * cos - z * sin, y, ahead)
            enter, leave = _crossed(start, way, half.T[:, :, None], begin)
            away = np.where(enter < leave, enter, np.float32(np.inf))
            which, meets = away.argmin(1)[:, None], np.isfinite(away)
            nearest, along = (np.take_along_axis(each, which, 1) for each in (away, ahead))
            shares = (meets & (away == nearest)).mean(2), meets.mean(2)
            found.append((which[:, 0], nearest[:, 0], along[:, 0], *shares))
        return tuple(np.concatenate(each) for each in zip(*found, strict=True))


def filled(away: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Share of pictures that is nearer than `reach` metres: the nearer the more, and what the border cuts off `CUT`
    times; `away`, `reach`: (..., 169) metres, as `Furniture.met` has them."""
    return np.asarray((np.clip(1.0 - away / reach, 0.0, 1.0) * WEIGHTS).mean(-1))


def _crossed(start: Sequence, way: Sequence, half: np.ndarray, begin: Any) -> tuple[Any, Any]:
    """Where rays enter boxes around 0 of these half sizes, after they `begin`, and where they leave, in their lengths;
    those that enter later than they leave miss. Each of `start`, `way` and `half`: by axis."""
    enter, leave = begin, np.float32(np.inf)
    for at, along, reach in zip(start, way, half, strict=True):
        slow = 1 / np.where(np.abs(along) < 1e-9, np.float32(1e-9), along)
        through, deep = -at * slow, np.abs(reach * slow)
        enter, leave = np.maximum(enter, through - deep), np.minimum(leave, through + deep)
    return enter, leave
