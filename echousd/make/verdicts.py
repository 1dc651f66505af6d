"""What became of every relation that a graph states, and which boxes collide."""

import warnings

import numpy as np

from echomodel.late import Late
from echomodel.objective.faults import ROUNDING
from echomodel.rules import fronts, judged, margins
from echomodel.rules.geometry import BoxesLike, Spread
from echousd.graph import SceneGraph
from echousd.graph.arrays import floor_centre, stated_placements, triplets_of
from echousd.place.geometry import Collision, collisions, pair_indices
from echousd.room import LayoutOutcome, RoomData, Verdict

placement_margins = Late("echomodel.rules.placements:placement_margins")
STATES = {1: "kept", 0: "broken", -1: "unmeasured"}


class RoomWarning(UserWarning):
    """A room is finished but does not keep its graph, or its furniture collides."""


def layout_outcome(graph: SceneGraph, boxes: BoxesLike) -> LayoutOutcome:
    """What became of one layout, whether it was placed or not."""
    return LayoutOutcome(relation_verdicts(graph, boxes), colliding(graph, boxes))


def colliding(graph: SceneGraph, boxes: BoxesLike) -> tuple[Collision, ...]:
    """Pairs of boxes that run into each other deeper than they may, deepest first."""
    size, position, yaw = (np.asarray(v, float) for v in (boxes.size, boxes.position, boxes.yaw))
    names, words = graph.names, [node.category for node in graph.nodes]
    found = collisions(words, size, position, yaw, pair_indices(len(names)))
    return tuple(Collision(names[i], names[j], depth) for (i, j), depth in found)


def warn_of_faults(room: RoomData) -> None:
    """A `RoomWarning` with what is wrong with a finished room, if anything is."""
    if faults := room.faults:
        more = f" and {len(faults) - 3} more" if len(faults) > 3 else ""
        warnings.warn(f"the room has faults: {'; '.join(faults[:3])}{more}", RoomWarning, stacklevel=3)


def relation_verdicts(graph: SceneGraph, boxes: BoxesLike, *, rules: str = "strict") -> tuple[Verdict, ...]:
    """One verdict per relation of the graph, in its order, then one per placement."""
    if not graph.relations:
        return _placement_verdicts(graph, boxes)
    triplets, headed = triplets_of(graph), fronts(node.category for node in graph.nodes)
    found = margins(Spread.of(boxes), triplets, rules=rules, center=floor_centre(graph)[::2], fronts=headed)
    state, margin = judged(found, triplets, rules).tolist(), found.tolist()
    return tuple(
        Verdict(r.subject, r.predicate, r.object, STATES[s or int(m > -ROUNDING)], None if s < 0 else m)
        for r, s, m in zip(graph.relations, state, margin, strict=True)
    ) + _placement_verdicts(graph, boxes)


def unbroken(graph: SceneGraph, boxes: BoxesLike) -> set[int]:
    """Numbers of the relations that are not broken."""
    return {row for row, verdict in enumerate(relation_verdicts(graph, boxes)) if verdict.state != "broken"}


def _placement_verdicts(graph: SceneGraph, boxes: BoxesLike) -> tuple[Verdict, ...]:
    if not graph.placements:
        return ()
    categories = [node.category for node in graph.nodes]
    margin = placement_margins(Spread.of(boxes), stated_placements(graph), graph.room.corners, categories).tolist()
    return tuple(
        Verdict(*placed.triple, STATES[-1 if m != m else int(m > -ROUNDING)], None if m != m else m)
        for placed, m in zip(graph.placements, margin, strict=True)
    )
