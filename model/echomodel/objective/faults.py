"""What a person would point at in a room: the terms that it misses, in words, and what cannot be walked to.

From the door a robot of 0.2 m radius finds its way to every piece (grid search, as SceneEval and PhyScene).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np
import torch
from torch import Tensor

from echomodel.objective.plan import CLEAR_HEIGHT, Plan, plan_of
from echomodel.objective.table import TERMS
from echomodel.openings import Opening, inward_normal, segment
from echomodel.rules.geometry import BoxesLike

CELL = 0.05  # metres
ROBOT = 0.2  # metres, its radius
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
    size: np.ndarray,
    position: np.ndarray,
    yaw: np.ndarray,
    obstacle: np.ndarray,
    polygon: np.ndarray,
    openings: Sequence[Opening] = (),
) -> Ways:
    """Walk from the doors and passages, or in the largest free part of the room where there are none.

    Arguments:
        size, position: (n, 3) float, metres; yaw: (n,) float, radians.
        obstacle: (n,) bool, what stands in the way.
        polygon: (k, 2) float, corners of the floor, metres.
    """
    from scipy import ndimage

    low, high = polygon.min(0) - CELL, polygon.max(0) + CELL
    xs, zs = (np.arange(a, b + CELL, CELL) for a, b in zip(low, high, strict=True))
    free = _inside(xs, zs, polygon)
    near = [_near(xs, zs, size[i], position[i], float(yaw[i])) for i in range(len(size))]
    away = [_distance(xs[x], zs[z], size[i], position[i], float(yaw[i])) for i, (x, z) in enumerate(near)]
    for i in np.flatnonzero(obstacle):
        free[near[i]] &= away[i] > 0
    # the distance to the next cell that is not free, less half of that cell
    room = (ndimage.distance_transform_edt(free) - 0.5) * CELL >= ROBOT - 0.5 * CELL
    parts, count = ndimage.label(room)
    if not count:
        return Ways(np.zeros(len(size), bool), 1.0)
    start = _entered(parts, xs, zs, polygon, openings)
    if not start:
        areas = np.bincount(parts.ravel())[1:]
        start = {int(areas.argmax()) + 1}
    walked = np.isin(parts, sorted(start))
    reached = np.array([bool((away[i][walked[near[i]]] <= ROBOT + ARM).any()) for i in range(len(size))], bool)
    return Ways(reached, float(walked.sum() / room.sum()))


def _entered(
    parts: np.ndarray, xs: np.ndarray, zs: np.ndarray, polygon: np.ndarray, openings: Sequence[Opening]
) -> set[int]:
    """Numbers of the free parts that lie before a door or passage."""
    out: set[int] = set()
    for opening in openings:
        if opening.kind == "window" or opening.edge >= len(polygon):
            continue
        inside = segment(polygon, opening).mean(0) + inward_normal(polygon, opening.edge) * (ROBOT + 2 * CELL)
        near = np.hypot(xs[:, None] - inside[0], zs[None] - inside[1]) < 0.35
        met = np.bincount(parts[near], minlength=1)
        met[0] = 0
        if met.any():
            out.add(int(met.argmax()))
    return out


def _inside(xs: np.ndarray, zs: np.ndarray, polygon: np.ndarray) -> np.ndarray:
    """(len(xs), len(zs)) bool, whether cells lie on the floor (even-odd rule)."""
    x, z = xs[:, None, None], zs[None, :, None]
    start, end = polygon, np.roll(polygon, -1, 0)
    crossed = (start[:, 1] > z) != (end[:, 1] > z)
    run = np.where(end[:, 1] == start[:, 1], 1.0, end[:, 1] - start[:, 1])
    meets = start[:, 0] + (z - start[:, 1]) / run * (end[:, 0] - start[:, 0])
    return (crossed & (meets > x)).sum(-1) % 2 == 1


def _near(xs: np.ndarray, zs: np.ndarray, size: np.ndarray, position: np.ndarray, yaw: float) -> tuple[slice, slice]:
    """The cells around a box that hold all those within reach of it."""
    cos, sin = abs(np.cos(yaw)), abs(np.sin(yaw))
    far = ROBOT + ARM + CELL
    x, z = (cos * size[0] + sin * size[2]) / 2 + far, (sin * size[0] + cos * size[2]) / 2 + far
    return (
        slice(*np.searchsorted(xs, (position[0] - x, position[0] + x))),
        slice(*np.searchsorted(zs, (position[2] - z, position[2] + z))),
    )


def _distance(xs: np.ndarray, zs: np.ndarray, size: np.ndarray, position: np.ndarray, yaw: float) -> np.ndarray:
    """(len(xs), len(zs)) float: metres from cells to a footprint, 0 inside it."""
    dx, dz = xs[:, None] - position[0], zs[None] - position[2]
    cos, sin = np.cos(yaw), np.sin(yaw)
    lateral = np.abs(cos * dx - sin * dz) - size[0] / 2
    forward = np.abs(sin * dx + cos * dz) - size[2] / 2
    return np.hypot(np.maximum(lateral, 0.0), np.maximum(forward, 0.0))


REACHED = "reached"
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
    boxes: BoxesLike,
    categories: Sequence[str],
    floor: np.ndarray | None = None,
    openings: Sequence[Opening] = (),
    relations: np.ndarray | Tensor | None = None,
    *,
    given: np.ndarray | None = None,
) -> list[Fault]:
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


def missed(plan: Plan, kinds: Collection[str] = BY_EYE) -> Tensor:
    """() float, how much of the terms of some kinds is missed, differentiable: missed margins with their weights."""
    total = plan.size.new_zeros(())
    for term in TERMS:
        if term.kind not in kinds:
            continue
        seen = term.find(plan)
        free = (~plan.given[seen.who]).to(seen.margin)
        total = total + term.weight * ((-seen.margin).clamp(min=0, max=2.0) * free).sum()
    return total
