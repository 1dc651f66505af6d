"""What a person would point at in sets of rooms, and how well one walks through them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from echomodel.objective import BY_EYE, TERMS, faults_of, plan_of, unreached, walk
from echomodel.roomboxes import RoomBoxes


def living_scores(rooms: Sequence[RoomBoxes], relations: Sequence[np.ndarray]) -> dict:
    """Faults by the living rules.

    Arguments:
        rooms: in the vocabulary's words. relations: (e, 3) int of each, what its graph tells.

    Returns:
        `per_object`, faults an object; `free_of_faults`, share of rooms without any; `walkable`, mean share of the free
        floor that is reached from the door; `rules`, faults an object of every rule that found one.
    """
    found: Counter[str] = Counter()
    free, shares, objects = 0, [], 0
    for room, edges in zip(rooms, relations, strict=True):
        plan = plan_of(room, room.categories, room.floor_polygon, room.openings, edges)
        seen = faults_of(plan) + unreached(plan)
        found.update(fault.rule for fault in seen)
        free += not seen
        objects += len(room)
        walked = walk(plan)
        if walked is not None:
            shares.append(walked.share)
    return {
        "per_object": sum(found.values()) / max(objects, 1),
        "free_of_faults": free / max(len(rooms), 1),
        "walkable": float(np.mean(shares)) if shares else None,
        "rules": {name: count / max(objects, 1) for name, count in found.most_common()},
        "measured": sum(term.kind in BY_EYE for term in TERMS) + 1,
    }
