"""What a placed room still gets wrong: collisions, objects outside, and the demands that contradict each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from echomodel.objective.support import allowed_overlap
from echousd.place.constraints import COLLISION, FLOOR, RELATION
from echousd.place.geometry import beyond, separation
from echousd.place.setting import Setting
from echousd.place.solver import Solution

if TYPE_CHECKING:
    from echousd.graph import SceneGraph

TOUCH = 0.01  # metres: deeper than this into another box is a collision, further than this outside is outside


@dataclass(frozen=True)
class Collision:
    """Two objects that run into each other, by `depth` metres."""

    first: str
    second: str
    depth: float

    def __str__(self) -> str:
        return f"{self.first} and {self.second} collide by {self.depth:.2f} m"

    def to_json(self) -> dict[str, Any]:
        """The entry of the manifest, and of a check's report."""
        return {"objects": [self.first, self.second], "depth": round(self.depth, 4)}


@dataclass(frozen=True)
class Conflict:
    """Demands of one room that cannot all be met, by number.

    Arguments:
        relations: rows of the triplets; pairs: objects that would collide; outside: objects that would leave the floor.
    """

    relations: tuple[int, ...]
    pairs: tuple[tuple[int, int], ...]
    outside: tuple[int, ...]


def collisions(
    categories: Sequence[str], size: np.ndarray, position: np.ndarray, yaw: np.ndarray, pairs: np.ndarray
) -> tuple[tuple[tuple[int, int], float], ...]:
    """Pairs (p, 2) of boxes that run into each other deeper than they may, deepest first, with the excess in metres."""
    depth = -(separation(size, position, yaw, pairs) + allowed_overlap(categories, size, pairs))
    order = np.argsort(-depth, kind="stable")
    return tuple(((i, j), float(depth[p])) for p, (i, j) in zip(order, pairs[order].tolist(), strict=True)
                 if depth[p] > TOUCH)  # fmt: skip


def outside(setting: Setting, size: np.ndarray, position: np.ndarray, yaw: np.ndarray) -> tuple[tuple[int, float], ...]:
    """Objects that leave the floor, with the depth in metres."""
    if setting.outline is None:
        return ()
    depth = beyond(setting.outline, size, position, yaw)
    return tuple((i, float(depth[i])) for i in np.flatnonzero(depth > TOUCH).tolist())


def conflicts(
    setting: Setting, found: Solution, failures: tuple[set[int], set[tuple[int, int]], set[int]]
) -> tuple[Conflict, ...]:
    """Groups of demands that could not all be met: violated constraints that share objects that could have moved.

    At the least violation the contradicting constraints press against each other and share it, so that the violated
    constraints around one object are the contradiction.

    Arguments:
        failures: broken relations, colliding pairs and objects outside; a group without any is no conflict.
    """
    at = found.at
    groups: list[tuple[set[int], list[int]]] = []  # of boxes that could have moved, and of the rows around them
    for row in np.flatnonzero((at.value < -0.002) & np.isin(at.kind, (RELATION, COLLISION, FLOOR))).tolist():
        joined, members = {i for i in at.boxes_of(row) if not (setting.fixed[i] and setting.rigid[i])}, [row]
        touched = [group for group in groups if group[0] & joined]
        for boxes, rows in touched:
            joined, members = joined | boxes, rows + members
        groups = [*(group for group in groups if group not in touched), (joined, members)]

    def conflict(members: list[int]) -> Conflict:
        told, pairs = ([at.number[r] for r in members if at.kind[r] == kind] for kind in (RELATION, COLLISION))
        beyond = {i for r in members if at.kind[r] == FLOOR for i in at.boxes_of(r)}
        rows: list[int] = setting.rows[told].tolist()
        return Conflict(tuple(rows), tuple((i, j) for i, j in setting.pairs[pairs].tolist()), tuple(sorted(beyond)))

    relations, pairs, outside = failures
    return tuple(
        one
        for one in (conflict(members) for _, members in groups)
        if relations & {*one.relations} or pairs & {*one.pairs} or outside & {*one.outside}
    )


def sentence(conflict: Conflict, graph: SceneGraph) -> str:
    """The conflict in the words of the graph."""
    names = graph.names
    parts = [f"'{graph.relations[r]}'" for r in conflict.relations]
    parts += [f"{names[i]} and {names[j]} apart" for i, j in conflict.pairs]
    parts += [f"{names[i]} on the floor's area" for i in conflict.outside]
    return "cannot hold together: " + ", ".join(parts) if len(parts) > 1 else f"cannot be met: {parts[0]}"
