"""Do openings fit walls whose height nobody stated, and does what is locked leave the doors free?"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from echomodel.openings import swing_area
from echomodel.roomboxes import footprints
from echousd.graph.consistency import GraphError
from echousd.graph.floors import HEIGHT

if TYPE_CHECKING:
    from echousd.graph.scene import SceneGraph

ALLOWED = 1e-3  # square metres of a swing that a locked object may touch
QUARTERS = (0.0, np.pi / 2)  # headings that a locked object may get which states none


def check_doors(graph: SceneGraph) -> None:
    """Raise `GraphError` for an opening that is higher than the walls of a room that states no height, and for a door
    that opens into a locked object whose size and position are stated.

    Of one that states no yaw it must be in the way however that is turned, by quarter turns.
    """
    for number, opening in enumerate(graph.room.openings):
        top = opening.sill + opening.height
        if graph.room.height is None and top > HEIGHT:
            raise GraphError(
                f"{opening.kind} {opening.name!r}: its top is at {top:.2f} m, allowed: up to {HEIGHT:.2f} m, "
                "the height of rooms that state none",
                ("room", "openings", number),
            )
    corners = graph.room.corners
    fixed = [n for n in graph.nodes if n.locked and n.size and n.position]
    if corners is None or not fixed:
        return
    import shapely

    for number, opening in enumerate(graph.room.openings):
        swept = swing_area(corners, opening)
        if not len(swept):
            continue
        area = shapely.Polygon(swept)
        for node in fixed:
            assert node.size is not None
            assert node.position is not None
            if node.position[1] > opening.height:
                continue
            yaws = QUARTERS if node.yaw is None else (node.yaw,)
            plans = footprints(np.array([node.size] * len(yaws)), np.array([node.position] * len(yaws)), np.array(yaws))
            met = min(area.intersection(shapely.Polygon(plan)).area for plan in plans)
            if met > ALLOWED:
                raise GraphError(
                    f"door {opening.name!r} opens into the locked object {node.name!r} "
                    f"({met:.2f} m² of its swing), "
                    "allowed: a free swing; move one of them, or let the door swing out",
                    ("room", "openings", number),
                )
