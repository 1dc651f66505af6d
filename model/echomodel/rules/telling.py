"""Which relations a person would write down: of near pairs first, one for each, places before sizes."""

import numpy as np
import torch
from torch import Tensor

from echomodel.roomboxes import RoomBoxes
from echomodel.rules.geometry import BoxesLike
from echomodel.vocabulary import vocabulary

SELDOM = 0.3  # weight of sizes and styles among the relations that are told
PLAIN = ("comparison", "likeness")  # kinds of predicates that say nothing of places
JITTER = 0.3  # largest share by which a gap is taken for larger than it is


def near_first(
    holds: Tensor, boxes: BoxesLike, receiver: Tensor, sender: Tensor, counts: Tensor, generator: torch.Generator
) -> Tensor:
    """(M, 2) int64, pair and predicate of every relation that holds, scene by scene, the nearest pairs' first.

    All unordered pairs are told one relation before any is told a second; which one is drawn.

    Arguments:
        holds: (P, predicates) bool over the ordered pairs `receiver`, `sender` (P,) int64 of scenes with `counts` (S,)
            nodes.
        boxes: N boxes, metres and radians. generator: source of the draws.
    """
    found = holds.nonzero()
    if not len(found):
        return found
    position, size = torch.as_tensor(boxes.position).float(), torch.as_tensor(boxes.size).float()
    pair, predicate = found.unbind(1)
    one, other = receiver[pair], sender[pair]
    joined = torch.minimum(one, other) * len(size) + torch.maximum(one, other)
    plain = torch.tensor([row.kind in PLAIN for row in vocabulary().predicates])
    weight = torch.where(plain[predicate], SELDOM, 1.0)
    luck = torch.rand(len(found), generator=generator) ** (1 / weight)
    order = torch.argsort(luck, descending=True)
    order = order[torch.argsort(joined[order], stable=True)]
    new = torch.ones(len(order), dtype=torch.bool)
    new[1:] = joined[order][1:] != joined[order][:-1]
    place = torch.arange(len(order))
    turn = place - torch.where(new, place, torch.zeros_like(place)).cummax(0).values
    apart = (position[one] - position[other])[:, [0, 2]].norm(dim=1)
    reach = size[:, [0, 2]].amin(1) / 2
    gap = (apart - reach[one] - reach[other]).clamp_min(0)[order] * (1 + JITTER * luck[order])
    scene = torch.arange(len(counts)).repeat_interleave(counts)[one[order]]
    key = scene.double() * 1e4 + turn.clamp(max=40) * 1e2 + gap.clamp(max=90)
    return found[order[torch.argsort(key)]]


def stated_relations(relations: Tensor, boxes: BoxesLike, per_object: float, generator: torch.Generator) -> Tensor:
    """Of the relations of one room so many as a person would write: (e, 3) int64.

    Arguments:
        relations: (E, 3) int64, [subject, predicate, object], all that hold.
        boxes: the n boxes of the room. per_object: relations an object. generator: source of the draws.
    """
    count = len(torch.as_tensor(boxes.yaw))
    holds = torch.zeros(count * count, len(vocabulary().predicates), dtype=torch.bool)
    holds[relations[:, 0] * count + relations[:, 2], relations[:, 1]] = True
    number = torch.arange(count * count)
    one, other = number // count, number % count
    ranked = near_first(holds, boxes, one, other, torch.tensor([count]), generator)[: round(per_object * count)]
    return torch.stack([one[ranked[:, 0]], ranked[:, 1], other[ranked[:, 0]]], 1)


def stated_of_room(relations: np.ndarray | Tensor, room: RoomBoxes, per_object: float, seed: int = 0) -> np.ndarray:
    """`stated_relations` of a room's boxes as (e, 3) int64 numpy; `seed` of the draws."""
    luck = torch.Generator().manual_seed(seed)
    return np.asarray(stated_relations(torch.as_tensor(relations), room.boxes(), per_object, luck))
