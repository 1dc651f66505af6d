"""What a person would point at in a room: the terms that it misses, in words."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np
import torch
from torch import Tensor

from echomodel.objective.plan import CLEAR_HEIGHT, Plan, plan_of
from echomodel.objective.table import TERMS
from echomodel.objective.ways import Ways, ways
from echomodel.openings import Opening
from echomodel.rules.geometry import BoxesLike

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
