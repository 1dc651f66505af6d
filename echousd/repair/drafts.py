"""The repair of `generate` for rooms as boxes, so that evaluations score what a room would get."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from torch import Tensor

from echomodel.metrics.layout_evaluation import Finish
from echomodel.roomboxes import RoomBoxes
from echomodel.rules.living import faults
from echousd.repair.repair import repair_boxes


def best_repaired(rules: str) -> Finish:
    """The repair of `generate`, for rooms as boxes: the first draft without a fault, else the one with fewest."""

    def finish(drafts: Sequence[RoomBoxes], triplets: Tensor) -> RoomBoxes:
        found: list[tuple[int, int, RoomBoxes]] = []
        for room in drafts:
            floor = room.floor_polygon if len(room.floor_polygon) else None
            done = repair_boxes(
                room.categories, room.size, room.position, room.yaw, triplets.numpy(),
                floor_polygon=floor, height=room.height, rules=rules, openings=room.openings,
            )  # fmt: skip
            made = replace(room, size=done.size, position=done.position, yaw=done.yaw)
            wrong = len(faults(made, room.categories, floor, room.openings, triplets))
            broken = int((done.verdict == 0).sum()) + len(done.collisions) + len(done.outside)
            found.append((broken, wrong, made))
            if broken + wrong == 0:
                break
        return min(found, key=lambda one: one[:2])[2]

    return finish
