"""After sampling, boxes are moved and sized as little as possible until the room keeps its graph without collisions."""

from echomodel.objective.support import allowed_overlap
from echousd.repair.repair import Conflict, RepairedBoxes, RepairResult, repair, repair_boxes
from echousd.repair.report import Collision
from echousd.repair.solver import RepairConfig

__all__ = [
    "Collision",
    "Conflict",
    "RepairConfig",
    "RepairResult",
    "RepairedBoxes",
    "allowed_overlap",
    "repair",
    "repair_boxes",
]
