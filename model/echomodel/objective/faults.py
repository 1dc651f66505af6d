"""What a person would point at in a room: the terms that it misses, in words, and what cannot be walked to.

From the door a robot of 0.2 m radius finds its way to every piece (grid search, as SceneEval and PhyScene).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from echomodel.objective.plan import CLEAR_HEIGHT, Plan, plan_of
from echomodel.objective.table import PRICE, TERMS
from echomodel.openings import Opening, inward_normal, segment
from echomodel.rules.geometry import BoxesLike

CELL = 0.05  # metres
ROBOT = 0.2  # metres, its radius
BEFORE = 0.35  # metres around the place before a door from which one walks
ARM = 0.4  # metres between the robot and what it can take hold of


@dataclass(frozen=True, eq=False)
class Ways:
    """What can be walked to.

    Arguments:
        reached: (n,) bool, boxes that the robot can touch.
        share: of the floor that is free for its middle, the share that it can get to; 1 where nothing is free.
    """

    reached: np.ndarray
    share: float


def ways(
    size: np.ndarray, position: np.ndarray, yaw: np.ndarray, obstacle: np.ndarray, polygon: np.ndarray,
    openings: Sequence[Opening] = (),
) -> Ways:  # fmt: skip
    """Walk from the doors and passages, or in the largest free part of the room where there are none.

    Arguments:
        size, position: (n, 3) float, metres; yaw: (n,) float, radians.
        obstacle: (n,) bool, what stands in the way.
        polygon: (k, 2) float, corners of the floor, metres.
    """
    from scipy import ndimage

    corners = polygon.dtype.char, polygon.tobytes()
    xs, zs, floor = _grid(*corners)
    boxes = np.column_stack([size[:, [0, 2]], position[:, [0, 2]], yaw])
    seen = [_beside(*corners, box.tobytes(), boxes.dtype.char) for box in boxes]
    free = floor.copy()
    for i in np.flatnonzero(obstacle):
        free[seen[i].near] &= ~seen[i].under
    room = _roomy(free)
    parts, count = ndimage.label(room)
    if not count:
        return Ways(np.zeros(len(size), bool), 1.0)
    start = _entered(parts, xs, zs, polygon, openings)
    if not start:
        areas = np.bincount(parts.ravel())[1:]
        start = {int(areas.argmax()) + 1}
    entered = np.zeros(count + 1, bool)
    entered[list(start)] = True
    walked = entered[parts]
    reached = np.array([bool((walked[one.near] & one.touched).any()) for one in seen], bool)
    return Ways(reached, float(walked.sum() / room.sum()))


def _roomy(free: np.ndarray) -> np.ndarray:
    """(x, z) bool: cells whose middles are the robot's radius, less half a cell, away from what is not free."""
    most = round(ROBOT / CELL)
    out, column, tall = free.copy(), free.copy(), 0
    for aside in range(most - 1, -1, -1):
        while aside**2 + (tall + 1) ** 2 < most**2:
            tall += 1
            column[:, tall:] &= free[:, :-tall]
            column[:, :-tall] &= free[:, tall:]
        out[aside:] &= column[: len(free) - aside]
        out[: len(free) - aside] &= column[aside:]
    return out


def _entered(
    parts: np.ndarray, xs: np.ndarray, zs: np.ndarray, polygon: np.ndarray, openings: Sequence[Opening]
) -> set[int]:
    """Numbers of the free parts that lie before a door or passage."""
    out: set[int] = set()
    for opening in openings:
        if opening.kind == "window" or opening.edge >= len(polygon):
            continue
        inside = segment(polygon, opening).mean(0) + inward_normal(polygon, opening.edge) * (ROBOT + 2 * CELL)
        x, z = (_within(each, at, BEFORE) for each, at in zip((xs, zs), inside, strict=True))
        near = np.hypot(xs[x, None] - inside[0], zs[None, z] - inside[1]) < BEFORE
        met = np.bincount(parts[x, z][near], minlength=1)
        met[0] = 0
        if met.any():
            out.add(int(met.argmax()))
    return out


def _within(places: np.ndarray, middle: float, far: float) -> slice:
    """Those of ascending places that lie no further than `far` from one."""
    return slice(*np.searchsorted(places, (middle - far, middle + far)))


@lru_cache(maxsize=8)
def _grid(kind: str, corners: bytes) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middles of the cells around a floor, and (len(xs), len(zs)) bool: whether they lie on it (even-odd rule)."""
    polygon = np.frombuffer(corners, kind).reshape(-1, 2)
    low, high = polygon.min(0) - CELL, polygon.max(0) + CELL
    xs, zs = (np.arange(a, b + CELL, CELL) for a, b in zip(low, high, strict=True))
    x, z = xs[:, None, None], zs[None, :, None]
    start, end = polygon, np.roll(polygon, -1, 0)
    crossed = (start[:, 1] > z) != (end[:, 1] > z)
    run = np.where(end[:, 1] == start[:, 1], 1.0, end[:, 1] - start[:, 1])
    meets = start[:, 0] + (z - start[:, 1]) / run * (end[:, 0] - start[:, 0])
    return xs, zs, (crossed & (meets > x)).sum(-1) % 2 == 1


class _Beside(NamedTuple):
    """The cells around a box: where they lie in the grid, those in its footprint, those that it is touched from."""

    near: tuple[slice, slice]
    under: np.ndarray
    touched: np.ndarray


@lru_cache(maxsize=2000)  # a search asks again and again, and moves a few boxes of a room at a time
def _beside(kind: str, corners: bytes, box: bytes, kind_of_box: str) -> _Beside:
    """What is beside a box: its width, depth, x, z and yaw as bytes; those of the floor's corners."""
    xs, zs, _ = _grid(kind, corners)
    width, depth, x, z, yaw = np.frombuffer(box, kind_of_box)
    cos, sin, far = np.cos(float(yaw)), np.sin(float(yaw)), ROBOT + ARM + CELL
    wide, deep = ((abs(cos) * a + abs(sin) * b) / 2 + far for a, b in ((width, depth), (depth, width)))
    near = _within(xs, x, wide), _within(zs, z, deep)
    dx, dz = xs[near[0], None] - x, zs[None, near[1]] - z
    lateral = np.abs(cos * dx - sin * dz) - width / 2
    forward = np.abs(sin * dx + cos * dz) - depth / 2
    away = np.hypot(np.maximum(lateral, 0.0), np.maximum(forward, 0.0))
    return _Beside(near, away <= 0, away <= ROBOT + ARM)


REACHED = "reached"
MOST = 2.0  # of a missed unit counts
BY_EYE = ("living", "composition")  # kinds of terms; relations and collisions have verdicts of their own


@dataclass(frozen=True)
class Fault:
    """Something that a person would point at.

    Arguments:
        object: number of the box; other: number of the box that it is about, -1 = none.
        rule: name of the term that is broken. margin: by how much, negative, metres, radians or a share.
        says: the sentence, with {a} and {b} for the two.
    """

    object: int
    other: int
    rule: str
    margin: float
    says: str = field(compare=False)

    def sentence(self, names: Sequence[str]) -> str:
        """The fault in words, with the names of the boxes."""
        other = names[self.other] if self.other >= 0 else "a wall"
        return self.says.replace("{a}", names[self.object]).replace("{b}", other)


def faults(
    boxes: BoxesLike, categories: Sequence[str], floor: np.ndarray | None = None, openings: Sequence[Opening] = (),
    relations: np.ndarray | Tensor | None = None, *, given: np.ndarray | None = None,
) -> list[Fault]:  # fmt: skip
    """What a person would point at in a room, in the order of the terms; see `plan_of` for the arguments.

    A term counts a box at most once. What the relations state decides whom a box attends.
    """
    plan = plan_of(boxes, categories, floor, openings, relations, given=given)
    return faults_of(plan) + unreached(plan)


def faults_of(plan: Plan, kinds: Collection[str] = BY_EYE) -> list[Fault]:
    """The faults of all terms of some kinds, for any number of rooms; numbers count through them."""
    out = []
    with torch.no_grad():
        for term in TERMS:
            if term.kind not in kinds:
                continue
            seen = term.find(plan)
            for row in (seen.margin < 0).nonzero()[:, 0].tolist():
                who, other = int(seen.who[row]), int(seen.other[row])
                if bool(plan.given[who]):
                    continue
                text = term.says[int(seen.words[row]) % len(term.says)]
                said = text.replace("{a}", "\0").replace("{b}", "\1").format(x=float(seen.measure[row]))
                said = said.replace("\0", "{a}").replace("\1", "{b}")
                out.append(Fault(who, other, term.name, float(seen.margin[row]), said))
    return out


def unreached(plan: Plan) -> list[Fault]:
    """Pieces of one room that cannot be walked to; none where the floor is unknown."""
    walked = walk(plan)
    if walked is None:
        return []
    furniture = plan.standing & plan.of("seat", "sofa", "board", "bed", "storage")
    reached = walked.reached
    attends = plan.anchor.numpy()  # a nightstand is reached from its bed, a chair with its table
    reached = reached | ((attends >= 0) & reached[attends])
    lost = np.flatnonzero(furniture.numpy() & ~reached & ~plan.given.numpy())
    return [Fault(int(i), -1, REACHED, -1.0, "{a} cannot be walked to from the door") for i in lost]


def walk(plan: Plan) -> Ways | None:
    """Where a robot gets to in a plan of one room, None where its floor is unknown."""
    corners = plan.floor[0][torch.isfinite(plan.floor[0]).all(1)].numpy()
    if len(corners) < 3:
        return None
    size, position, yaw = (value.detach().numpy() for value in (plan.size, plan.position, plan.yaw))
    in_the_way = (plan.standing & ~plan.movable).numpy() & (size[:, 1] > CLEAR_HEIGHT)
    return ways(size, position, yaw, in_the_way, corners, plan.openings[0])


def missed(plan: Plan, kinds: Collection[str] = BY_EYE, beyond: float = -math.inf) -> Tensor:
    """() float, what the missed margins of the terms of some kinds cost, differentiable.

    `beyond`: what is asked for beyond the slack of each term, in its unit; by default nothing, not even that.
    """
    total = plan.size.new_zeros(())
    for term in TERMS:
        seen = term.find(plan) if term.kind in kinds else None
        if seen is None or not len(seen.who):
            continue
        miss = (max(term.slack + beyond, 0.0) - seen.margin).clamp(0.0, MOST)
        if term.kind in BY_EYE:
            miss = miss * ~plan.given[seen.who]
        total = total + PRICE[term.kind][1] * term.weight * miss.sum()
    return total
