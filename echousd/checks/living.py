"""What a person would point at in a room on a stage."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from echousd.graph import SceneGraph
from echousd.graph.consistency import GraphError
from echousd.graph.floors import check_extents
from echousd.repair.living import LivingFault, living_faults
from echousd.stage.contents import RoomContents


@dataclass(frozen=True, eq=False)
class _Boxes:
    size: np.ndarray
    position: np.ndarray
    yaw: np.ndarray


def find_living(room: RoomContents) -> tuple[LivingFault, ...]:
    """Every living rule that an object breaks; none in a room whose graph contradicts itself, which others report."""
    if not room.objects or room.spec is None:
        return ()
    things = room.objects
    try:
        check_extents(room.spec.extents)
    except GraphError as error:
        warnings.warn(f"<{room.path}>: {error}; nobody's ways are looked for on it", stacklevel=2)
        return ()
    try:
        graph = SceneGraph(room.spec, tuple(thing.node for thing in things), room.relations)
    except GraphError:
        return ()
    boxes = _Boxes(
        np.array([thing.size for thing in things]),
        np.array([thing.position for thing in things]),
        np.array([float(thing.yaw) for thing in things]),
    )
    return living_faults(graph, boxes)
