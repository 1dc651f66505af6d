"""Which demands of a room contradict each other, where some of them could not be met."""

from dataclasses import dataclass

import numpy as np

from echousd.graph import SceneGraph
from echousd.place.constraints import COLLISION, FLOOR, RELATION
from echousd.place.problem import Problem
from echousd.place.solver import Solution


@dataclass(frozen=True)
class Conflict:
    """Demands of one room that cannot all be met, by number.

    Arguments:
        relations: rows of the triplets; pairs: objects that would collide; outside: objects that would leave the floor.
    """

    relations: tuple[int, ...]
    pairs: tuple[tuple[int, int], ...]
    outside: tuple[int, ...]


def conflicts(
    problem: Problem, found: Solution, failures: tuple[set[int], set[tuple[int, int]], set[int]]
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
        joined, members = {i for i in at.boxes_of(row) if not (problem.fixed[i] and problem.rigid[i])}, [row]
        touched = [group for group in groups if group[0] & joined]
        for boxes, rows in touched:
            joined, members = joined | boxes, rows + members
        groups = [*(group for group in groups if group not in touched), (joined, members)]

    def conflict(members: list[int]) -> Conflict:
        relations, pairs = ([at.number[r] for r in members if at.kind[r] == kind] for kind in (RELATION, COLLISION))
        beyond = {i for r in members if at.kind[r] == FLOOR for i in at.boxes_of(r)}
        rows: list[int] = problem.rows[relations].tolist()
        return Conflict(tuple(rows), tuple((i, j) for i, j in problem.pairs[pairs].tolist()), tuple(sorted(beyond)))

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
