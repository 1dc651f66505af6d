"""What systems are asked in an evaluation (rooms whose boxes are known, what is told of them, edits), and what a room
that they laid out scores by itself: faults by the terms of the objective, and the field's figures by its boxes.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
import torch

from echomodel.boxes2d import footprints
from echomodel.graph import GraphBatch
from echomodel.metrics.statistics import Pair
from echomodel.objective import BY_EYE, KINDS, TERMS, WALKED, faults_of, plan_of, unreached, walk
from echomodel.openings import segment, zone
from echomodel.roomboxes import RoomBoxes
from echomodel.rules import label_rooms, verdicts
from echomodel.rules.telling import stated_of_room
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
    stated: np.ndarray
    before: np.ndarray | None = None
    added: np.ndarray | None = None
    touched: np.ndarray | None = None
    rules: str = "strict"

    @property
    def graph(self) -> GraphBatch:
        """What a network is asked."""
        return self.room.graph(triplets=torch.from_numpy(self.stated))


def tasks_of(
    rooms: Sequence[RoomBoxes], seed: int, *, rules: str = "strict", stated: float | None = None, drop: float = 0.5
) -> list[Task]:
    """The rooms with what is told of them.

    Arguments:
        rooms: in the vocabulary's words (`with_known_words`). seed: of what is told.
        stated: relations an object, near pairs first, as people write; None = those that a room has, as published
            graphs do, else all that the rules find but for `drop` of them.
    """
    rng = np.random.default_rng([seed, 11])
    labels = label_rooms(rooms, rules=rules, drop=drop if stated is None else 0.0, rng=rng)
    if stated is not None:
        labels = [stated_of_room(edges, room, stated, seed) for edges, room in zip(labels, rooms, strict=True)]
    else:
        labels = [edges if r.relations is None else r.relations for edges, r in zip(labels, rooms, strict=True)]
    return [Task(room, np.asarray(edges, np.int64), rules=rules) for room, edges in zip(rooms, labels, strict=True)]


def changed(task: Task, rng: np.random.Generator) -> Task:
    """The task with one relation turned round, as it is where none can be.

    A mirrored edge that says what no longer holds stays, as in the published evaluation.
    """
    can = np.flatnonzero(np.isin(task.stated[:, 1], list(OPPOSITE)))
    none = np.zeros(len(task.room), bool)
    if not len(can):
        return replace(task, before=task.stated, added=none, touched=none)
    chosen = int(can[rng.integers(len(can))])
    subject, predicate, other = task.stated[chosen].tolist()
    after = task.stated.copy()
    after[chosen, 1] = OPPOSITE[predicate]
    touched = np.isin(np.arange(len(task.room)), [subject, other])
    return replace(task, stated=after, before=task.stated, added=none, touched=touched)


def extended(task: Task, rng: np.random.Generator) -> Task:
    """The task in which one object came in, with all that is told of it."""
    added = np.arange(len(task.room)) == int(rng.integers(len(task.room)))
    return replace(task, before=task.stated[~added[task.stated[:, [0, 2]]].any(1)], added=added, touched=added)


def kept_relations(task: Task, room: RoomBoxes) -> dict[str, Pair]:
    """Group of relations (a share a predicate), `all`, and for an edit `edited` and `rest` -> (kept, of how many).

    `room`: its boxes as a system made them.
    """
    verdict = verdicts(room.boxes(), torch.from_numpy(task.stated), rules=task.rules).numpy()
    names = np.array([vocabulary().predicates[k].name for k in task.stated[:, 1]], dtype=object)
    chosen = {group: [names == word for word in words] for group, words in GROUPS.items()}
    chosen["all"] = [np.ones(len(verdict), bool)]
    if task.touched is not None:
        edited = task.touched[task.stated[:, [0, 2]]].any(1)
        chosen |= {"edited": [edited], "rest": [~edited]}
    return {
        name: ([float((verdict[at] == 1).sum()) for at in rows], [float((verdict[at] >= 0).sum()) for at in rows])
        for name, rows in chosen.items()
    }


ROBOT = 0.2  # metres, width of SceneEval's robot
OVERHEAD = 2.0  # metres: what has its middle higher is in nobody's way there
BEFORE_WINDOW = 0.5  # metres that it wants free before a window; before a door the door's width
JUDGED = tuple(term.name for term in TERMS if term.kind in BY_EYE)
# Half of the terms chooses, the other one judges; they take turns down the table, so that both look at everything.
HALVES = (frozenset(JUDGED[::2]), frozenset(JUDGED[1::2]) | {term.name for term in WALKED})
COUNTED = {
    "faults": HALVES[0] | HALVES[1], "faults A": HALVES[0], "faults B": HALVES[1],
    "physics": frozenset(term.name for term in TERMS if term.kind == "physics"),
}  # fmt: skip


def layout_scores(task: Task, room: RoomBoxes) -> dict[str, Pair]:
    """Name -> (part, whole), whose sums over rooms are divided.

    Arguments:
        task: what was asked. room: its boxes as a system made them.

    Returns faults an object in all (`faults`), of either half of the terms (`faults A`, `faults B`), of collisions and
    the like (`physics`) and of each term that found one (`term NAME`); `faultless` rooms; `told` relations kept;
    `walkable` share of the free floor that is reached, SceneEval's `navigability` and `clearance` of openings;
    `fullness`, share of the floor that is covered.
    """
    objects = float(len(room))
    floor, openings = room.floor_polygon, room.openings
    plan = plan_of(room, room.categories, floor, openings, task.stated, height=room.height, rules=task.rules)
    found = Counter(fault.rule for fault in [*faults_of(plan, KINDS), *unreached(plan)])
    scores: dict[str, Pair] = {
        name: (float(sum(found[term] for term in terms)), objects) for name, terms in COUNTED.items()
    }
    scores |= {"faultless": (float(not scores["faults"][0]), 1.0), "told": kept_relations(task, room)["all"]}
    if len(room.floor_polygon) > 2:
        if walked := walk(plan):
            scores["walkable"] = walked.share, 1.0
        scores |= {score.__name__: score(room) for score in (navigability, clearance, fullness)}
    return scores | {f"term {name}": (float(n), objects) for name, n in found.items() if name in COUNTED["faults"]}


def navigability(room: RoomBoxes) -> Pair:
    """SceneEval's: of the floor on which a robot of 0.2 m can stand, the share of the largest connected part."""
    low = room.position[:, 1] + room.size[:, 1] / 2 <= OVERHEAD
    solid = shapely.union_all([p.buffer(ROBOT / 2, join_style="mitre") for p in _prints(room)[low]])
    free = shapely.Polygon(room.floor_polygon).buffer(-ROBOT / 2, join_style="mitre").difference(solid)
    parts = [part.area for part in getattr(free, "geoms", [free])]
    return (max(parts) / sum(parts), 1.0) if sum(parts) > 0 else (0.0, 1.0)


def clearance(room: RoomBoxes) -> Pair:
    """SceneEval's: share of each opening before which nothing stands (a door's width deep, 0.5 m before windows)."""
    prints, free = _prints(room), 0.0
    for opening in room.openings:
        depth = BEFORE_WINDOW if opening.kind == "window" else opening.width
        before = shapely.Polygon(zone(room.floor_polygon, opening, depth))
        start, end = segment(room.floor_polygon, opening)
        along = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
        covered = []
        for k in np.flatnonzero(shapely.intersects(prints, before)):
            met = shapely.get_coordinates(prints[k].intersection(before))
            reach, low = (met - start) @ along, float(room.position[k, 1])
            covered.append(shapely.box(reach.min(), low, reach.max(), low + float(room.size[k, 1])))
        hole = shapely.box(0.0, opening.sill, opening.width, opening.sill + opening.height)
        free += 1.0 - shapely.union_all(covered).intersection(hole).area / hole.area
    return free, float(len(room.openings))


def fullness(room: RoomBoxes) -> Pair:
    """Square metres under furniture that stands, and of the floor."""
    stands = np.array([vocabulary().category(word).support == "floor" for word in room.categories], bool)
    floor = shapely.Polygon(room.floor_polygon)
    return float(shapely.union_all(_prints(room)[stands]).intersection(floor).area), float(floor.area)


def strata_of(task: Task) -> Mapping[str, str]:
    """How a room is counted: its type, how many objects, how much is told of each."""
    objects, stated = len(task.room), len(task.stated) / max(len(task.room), 1)
    return {
        "room type": task.room.room_type,
        "objects": "1 to 6" if objects <= 6 else "7 to 10" if objects <= 10 else "over 10",
        "told an object": "0 to 1" if stated < 0.95 else "1 to 5" if stated <= 5 else "over 5",
    }


def _prints(room: RoomBoxes) -> np.ndarray:
    return np.atleast_1d(shapely.polygons(footprints(np.maximum(room.size, 1e-6), room.position, room.yaw)))
