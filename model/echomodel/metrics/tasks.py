"""What systems are asked in an evaluation: rooms whose boxes are known, what is told of them, and edits of that."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from echomodel.boxes import Boxes
from echomodel.graph import GraphBatch
from echomodel.metrics.statistics import Pair
from echomodel.roomboxes import RoomBoxes
from echomodel.rules import label_rooms, verdicts
from echomodel.rules.telling import told_of_room
from echomodel.vocabulary import vocabulary

# Predicates that an evaluation changes, and into what (the four pairs of opposites of the published one).
OPPOSITE = {1: 2, 2: 1, 3: 4, 4: 3, 8: 9, 9: 8, 10: 11, 11: 10}
# The groups of the published table; `above` is ours, the published code does not measure it.
GROUPS: Mapping[str, tuple[str, ...]] = {
    "left/right": ("left", "right"), "front/behind": ("front", "behind"),
    "bigger/smaller": ("bigger_than", "smaller_than"), "taller/shorter": ("taller_than", "shorter_than"),
    "standing_on": ("standing_on",), "close_by": ("close_by",), "symmetrical_to": ("symmetrical_to",),
    "above": ("above",),
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Task:
    """One room to lay out.

    Arguments:
        room: with its true boxes, in the vocabulary's words. told: (e, 3) int64, what is told of it.
        before: (e, 3) int64, what was told before an edit, None = nothing was edited.
        added, touched: (n,) bool, objects that came in, and that an edit concerns.
        rules: of the relations.
    """

    room: RoomBoxes
    told: np.ndarray
    before: np.ndarray | None = None
    added: np.ndarray | None = None
    touched: np.ndarray | None = None
    rules: str = "strict"

    @property
    def graph(self) -> GraphBatch:
        """What a network is asked."""
        return GraphBatch.from_room(self.room, triplets=torch.from_numpy(self.told))


def tasks_of(
    rooms: Sequence[RoomBoxes], seed: int, *, rules: str = "strict", told: float | None = None, drop: float = 0.5
) -> list[Task]:
    """The rooms with what is told of them.

    Arguments:
        rooms: in the vocabulary's words (`with_known_words`). seed: of what is told.
        told: relations an object, near pairs first, as people write; None = those that a room has, as published
            graphs do, else all that the rules find but for `drop` of them.
    """
    rng = np.random.default_rng([seed, 11])
    labels = label_rooms(rooms, rules=rules, drop=drop if told is None else 0.0, rng=rng)
    if told is not None:
        labels = [told_of_room(edges, room, told, seed) for edges, room in zip(labels, rooms, strict=True)]
    else:
        labels = [edges if r.relations is None else r.relations for edges, r in zip(labels, rooms, strict=True)]
    return [Task(room, np.asarray(edges, np.int64), rules=rules) for room, edges in zip(rooms, labels, strict=True)]


def changed(task: Task, rng: np.random.Generator) -> Task:
    """The task with one relation turned round, as it is where none can be.

    A mirrored edge that says what no longer holds stays, as in the published evaluation.
    """
    can = np.flatnonzero(np.isin(task.told[:, 1], list(OPPOSITE)))
    none = np.zeros(len(task.room), bool)
    if not len(can):
        return replace(task, before=task.told, added=none, touched=none)
    chosen = int(can[rng.integers(len(can))])
    subject, predicate, other = task.told[chosen].tolist()
    after = task.told.copy()
    after[chosen, 1] = OPPOSITE[predicate]
    touched = np.isin(np.arange(len(task.room)), [subject, other])
    return replace(task, told=after, before=task.told, added=none, touched=touched)


def extended(task: Task, rng: np.random.Generator) -> Task:
    """The task in which one object came in, with all that is told of it."""
    added = np.arange(len(task.room)) == int(rng.integers(len(task.room)))
    return replace(task, before=task.told[~added[task.told[:, [0, 2]]].any(1)], added=added, touched=added)


def kept_relations(task: Task, room: RoomBoxes) -> dict[str, Pair]:
    """Group of relations (a share a predicate), `all`, and for an edit `edited` and `rest` -> (kept, of how many).

    `room`: its boxes as a system made them.
    """
    verdict = verdicts(Boxes.from_room(room), torch.from_numpy(task.told), rules=task.rules).numpy()
    names = np.array([vocabulary().predicates[k].name for k in task.told[:, 1]], dtype=object)
    chosen = {group: [names == word for word in words] for group, words in GROUPS.items()}
    chosen["all"] = [np.ones(len(verdict), bool)]
    if task.touched is not None:
        edited = task.touched[task.told[:, [0, 2]]].any(1)
        chosen |= {"edited": [edited], "rest": [~edited]}
    return {
        name: ([float((verdict[at] == 1).sum()) for at in rows], [float((verdict[at] >= 0).sum()) for at in rows])
        for name, rows in chosen.items()
    }
