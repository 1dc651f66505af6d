"""Does what is locked leave the doors of a room free?"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from echomodel.openings import swing_area
from echomodel.roomboxes import footprints
from echousd.graph.consistency import GraphError

if TYPE_CHECKING:
    from echousd.graph.scene import SceneGraph

ALLOWED = 1e-3  # square metres of a swing that a locked object may touch


def check_doors(graph: SceneGraph) -> None:
    """Raise `GraphError` for a door that opens into a locked object whose size, position and yaw are fixed."""
    corners = graph.room.corners
    fixed = [n for n in graph.nodes if n.locked and n.size and n.position and n.yaw is not None]
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
            assert node.yaw is not None
            if node.position[1] > opening.height:
                continue
            plan = footprints(np.array([node.size]), np.array([node.position]), np.array([node.yaw]))[0]
            met = area.intersection(shapely.Polygon(plan)).area
            if met > ALLOWED:
                raise GraphError(
                    f"door {opening.name!r} opens into the locked object {node.name!r} "
                    f"({met:.2f} m² of its swing), "
                    "allowed: a free swing; move one of them, or let the door swing out",
                    ("room", "openings", number),
                )
