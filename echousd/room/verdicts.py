"""What became of every relation that a graph states."""

from __future__ import annotations

from echomodel.boxes import Boxes
from echomodel.rules import margins, verdicts
from echousd.graph import SceneGraph
from echousd.room.room import Verdict
from echousd.room.tensors import floor_centre, graph_batch

STATES = {1: "kept", 0: "broken", -1: "unmeasured"}


def relation_verdicts(graph: SceneGraph, boxes: Boxes, *, rules: str = "strict") -> tuple[Verdict, ...]:
    """One verdict per relation of the graph, in its order."""
    if not graph.relations:
        return ()
    triplets, centre = graph_batch(graph).triplets, floor_centre(graph)[[0, 2]]
    state = verdicts(boxes, triplets, rules=rules, center=centre).tolist()
    margin = margins(boxes, triplets, rules=rules, center=centre).tolist()
    return tuple(
        Verdict(r.subject, r.predicate, r.object, STATES[s], None if s < 0 else m)
        for r, s, m in zip(graph.relations, state, margin, strict=True)
    )
