"""What a graph says of the places of single objects, by the numbers of its nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from echomodel.rules.placements import Stated
    from echousd.graph import SceneGraph


def stated_placements(graph: SceneGraph) -> tuple[Stated, ...]:
    """The placements of a graph by the numbers of its nodes, in the order of `SceneGraph.placements`."""
    from echomodel.rules.placements import Stated

    row = {name: i for i, name in enumerate(graph.names)}
    return tuple(
        Stated(one.placement, row[one.subject], tuple(row[name] for name in one.others)) for one in graph.placements
    )
