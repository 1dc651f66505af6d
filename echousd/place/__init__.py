"""After sampling, boxes are moved and sized as little as possible until the room keeps its graph without collisions."""

from echomodel.objective.support import allowed_overlap
from echousd.place.placing import Conflict, PlacedBoxes, PlaceResult, place, place_boxes
from echousd.place.report import Collision
from echousd.place.solver import PlaceConfig

__all__ = [
    "Collision",
    "Conflict",
    "PlaceConfig",
    "PlaceResult",
    "PlacedBoxes",
    "allowed_overlap",
    "place",
    "place_boxes",
]
