"""Who follows where something is put elsewhere: what attends it, stands on it or hangs over it; and who makes way."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from echomodel.boxes import Boxes
from echomodel.boxes2d import turned
from echomodel.objective import Plan, faults_of
from echomodel.objective.support import ON_CEILING
from echousd.graph import SceneGraph
from echousd.make.reading import SavedRoom
from echousd.make.verdicts import layout_outcome
from echousd.place.living import plan_to_live_in
from echousd.place.search import LIT
from echousd.room import LayoutOutcome

STILL = 1e-3  # metres or radians: less is no other place


def attending(room: Plan) -> list[tuple[int, int]]:
    """Numbers of boxes of one room, and of what they attend, stand on or hang over; a screen is nobody's company."""
    out = [(k, i) for k, i in enumerate(room.anchor.tolist()) if i >= 0 and room.stance[k] != "opposite"]
    out += [(k, i) for k, i in enumerate(room.carrier.tolist()) if i >= 0]
    away = np.linalg.norm((room.position[:, None] - room.position)[..., ::2], axis=2)
    over = (room.carrier == ON_CEILING)[:, None] & room.standing & (away < LIT)
    return [*out, *((k, i) for k, i in np.argwhere(over).tolist())]


def carried(before: SceneGraph, after: SceneGraph, boxes: Boxes) -> tuple[Boxes, set[str]]:
    """The boxes of `before` in which who attends what `after` puts elsewhere stands to it as it did, and their names.

    What is locked, or has a place of its own, stays.
    """
    room = plan_to_live_in(before, boxes)
    pairs, free, names = attending(room), movable(after), set[str]()
    position, yaw = room.position.copy(), room.yaw.copy()
    for i, name in enumerate(before.names):
        node = after.node(name) if name in after.names else None
        if node is None or node.position is None:
            continue
        shift, turn = np.asarray(node.position) - room.position[i], 0.0 if node.yaw is None else node.yaw - room.yaw[i]
        if max(abs(shift).max(), abs(turn)) < STILL:
            continue
        group = [i]
        for one in group:
            group += [k for k, at in pairs if at == one and before.names[k] in free - names and k not in group]
        for k in group[1:]:
            away = (room.position[k] - room.position[i])[::2]
            position[k] += shift * (1, room.carrier[k] in group, 1)
            position[k, ::2] += turned(away, turn) - away
            yaw[k] += turn
            names.add(before.names[k])
    return Boxes(boxes.size, position.astype(np.float32), yaw.astype(np.float32)), names


def in_the_way(
    saved: SavedRoom, graph: SceneGraph, boxes: Boxes, outcome: LayoutOutcome, along: Collection[str],
    moving: Collection[str],
) -> set[str]:  # fmt: skip
    """Names of what is free and, with what was moved, breaks a relation or physics that held before, and its company.

    Arguments:
        saved: the room before. graph, boxes, outcome: as they are now.
        along: those who were `carried` make way for what a person would point at, too.
        moving: who was placed anew; where nobody else is in the way, those who are told of them make way.
    """

    def broken(graph: SceneGraph, room: Plan, outcome: LayoutOutcome) -> set[tuple[str, str, str]]:
        names = [*graph.names, ""]
        found = [fault for fault in faults_of(room) if names[fault.object] in along] + faults_of(room, ("physics",))
        ends = [(one.predicate, one.subject, one.object) for one in outcome.broken]
        ends += [("apart", one.first, one.second) for one in outcome.collisions]
        return {*ends, *((fault.rule, names[fault.object], names[fault.other]) for fault in found)}

    free, room = movable(graph), plan_to_live_in(graph, boxes, all_blamed=True)
    was = plan_to_live_in(saved.graph, saved.boxes, all_blamed=True)
    new = broken(graph, room, outcome) - broken(saved.graph, was, layout_outcome(saved.graph, saved.boxes))
    out = set().union(*({*ends} for _, *ends in new if {*ends} & {*moving, *along})) & free
    if out <= {*moving}:
        told = [{relation.subject, relation.object} for relation in graph.relations]
        out = out.union(*(ends for ends in told if ends & out)) & free
    pairs = [(graph.names[k], graph.names[i]) for k, i in attending(room)]
    for _ in pairs:
        out |= {name for name, at in pairs if at in out} & free
    return out - {*moving}


def movable(graph: SceneGraph) -> set[str]:
    """Names of what is neither locked nor has a place that somebody stated."""
    return {node.name for node in graph.nodes if node.position is None and not node.locked}
