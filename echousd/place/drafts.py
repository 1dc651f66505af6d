"""The placing of `generate` for rooms as boxes, so that evaluations score what a room would get."""

from __future__ import annotations

from dataclasses import replace

from torch import Tensor

from echomodel.metrics.layout_evaluation import Finish
from echomodel.objective import faults
from echomodel.roomboxes import RoomBoxes
from echousd.place.placing import place_boxes


def placed(rules: str) -> Finish:
    """The placing of `generate`, for rooms as boxes; how much is broken or collides, and the living faults."""

    def finish(room: RoomBoxes, triplets: Tensor) -> tuple[RoomBoxes, tuple[int, ...]]:
        floor = room.floor_polygon if len(room.floor_polygon) else None
        done = place_boxes(
            room.categories, room.size, room.position, room.yaw, triplets.numpy(),
            floor_polygon=floor, height=room.height, rules=rules, openings=room.openings,
        )  # fmt: skip
        made = replace(room, size=done.size, position=done.position, yaw=done.yaw)
        wrong = len(faults(made, room.categories, floor, room.openings, triplets))
        return made, (int((done.verdict == 0).sum()) + len(done.collisions) + len(done.outside), wrong)

    return finish
