"""What a person would point at in a room, in the words of its graph."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echomodel.objective import Plan, faults, plan_of
from echomodel.objective.faults import MOST
from echomodel.objective.sizes import size_range
from echomodel.rules.geometry import BoxesLike, Spread
from echousd.graph import SceneGraph
from echousd.graph.arrays import triplets_of
from echousd.room import Found


@dataclass(frozen=True)
class LivingFault(Found):
    """An object that breaks a living rule, perhaps about another one, by a margin (metres, radians or a share)."""

    object: str
    rule: str
    other: str | None
    margin: float
    says: str


def living_faults(
    graph: SceneGraph, boxes: BoxesLike, floor: np.ndarray | None = None, *, all_blamed: bool = False
) -> tuple[LivingFault, ...]:
    """Every living rule that an object breaks; obstacles and objects whose place the graph states are not blamed.

    Arguments:
        graph: N objects, their relations, the room with its openings.
        boxes: N boxes in its order, metres and radians.
        floor: (k, 2) float, corners where the graph states none, metres; None = no rule of walls.
        all_blamed: objects whose place the graph states, too.
    """
    names = list(graph.names)
    return tuple(
        LivingFault(names[f.object], f.rule, names[f.other] if f.other >= 0 else None, f.margin, f.sentence(names))
        for f in faults(plan_to_live_in(graph, boxes, floor, all_blamed=all_blamed))
    )


def plan_to_live_in(
    graph: SceneGraph, boxes: BoxesLike, floor: np.ndarray | None = None, *, all_blamed: bool = False
) -> Plan:
    """The plan that `living_faults` judges; arguments as there."""
    corners = graph.room.corners
    return plan_of(
        Spread.of(boxes),
        [node.category for node in graph.nodes],
        floor if corners is None else np.asarray(corners, float),  # openings count the edges of the stated floor
        graph.room.openings if corners is not None else (),
        triplets_of(graph),
        fixed=np.array([bool(n.obstacle) or (n.position is not None and not all_blamed) for n in graph.nodes]),
    )


def severity(faults: Sequence[LivingFault]) -> float:
    """How bad some faults are: one for each, and as much as it misses, at most `MOST` of its unit."""
    return sum(1.0 + min(-fault.margin, MOST) for fault in faults)


def unusual(graph: SceneGraph) -> tuple[str, ...]:
    """A sentence for each stated size that no such furniture has, and for each stated place beside the floor."""
    import shapely

    lines = []
    for node in graph.nodes:
        if node.size is None or node.obstacle or node.asset:
            continue
        for word, side, low, high in zip(("wide", "high", "deep"), node.size, *size_range(node.category), strict=True):
            if not 0.999 * low <= side <= 1.001 * high:
                lines.append(f"{node.name} is {side:.3g} m {word} as stated; such furniture: {low:.3g} to {high:.3g} m")
    if graph.room.corners is not None:
        floor = shapely.Polygon(graph.room.corners).buffer(1e-3)
        there = [(node.name, *node.position) for node in graph.nodes if node.position is not None]
        beside = [(name, x, z) for name, x, _, z in there if not floor.covers(shapely.Point(x, z))]
        lines += [f"{name} is stated to stand at ({x:.2f}, {z:.2f}) m, beside the floor" for name, x, z in beside]
    return tuple(lines)
