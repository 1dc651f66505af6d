"""A room whose furniture stands where it comes to rest."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch

from echomodel.boxes import Boxes
from echousd.make.finished import Room
from echousd.make.verdicts import relation_verdicts
from echousd.reproducible import rounded_boxes
from echousd.room import LayoutOutcome
from echousd.settle.settle import SettleReport, settle_layouts
from echousd.stage.paths import OBJECTS

UPRIGHT = 1.0  # degrees: what leans further at rest is no pose that a layout can hold


@dataclass(frozen=True, eq=False)
class Settled:
    """A room after it came to rest.

    Arguments:
        room: as it was, or with the poses at rest.
        moved: names of the objects that stand elsewhere now.
        restless: a sentence for every piece that still does not rest.
    """

    room: Room
    moved: tuple[str, ...]
    restless: tuple[str, ...]

    @property
    def noted(self) -> Room:
        """The room that says what was moved and what does not rest."""
        said = (*(f"{name} stands where it comes to rest" for name in self.moved), *self.restless)
        return replace(self.room, notes=(*self.room.notes, *said))


def settled(room: Room) -> Settled:
    """Simulate every layout of a room and write the poses at rest where they differ; what is locked stays.

    Pieces that topple or fall stay where they were and are named: a layout holds upright poses.

    Raises SettleUnavailable without MuJoCo (extra `sim`).
    """
    reports = settle_layouts(room.stage)
    if all(report.ok for report in reports):
        return Settled(room, (), ())
    layouts = room.layouts or (room.boxes,)
    rested = [_rested(room, boxes, report) for boxes, report in zip(layouts, reports, strict=True)]
    moved = tuple(sorted({name for _, names in rested for name in names}))
    if moved:
        found = tuple(boxes for boxes, _ in rested)
        outcomes = tuple(
            LayoutOutcome(relation_verdicts(room.graph, boxes), before.collisions)
            for boxes, before in zip(found, room.outcomes, strict=True)
        )
        room = replace(room, boxes=found[0], layouts=found, outcomes=outcomes)
        reports = settle_layouts(room.stage)
    return Settled(room, moved, tuple(sentence for report in reports for sentence in report.sentences))


def _rested(room: Room, boxes: Boxes, report: SettleReport) -> tuple[Boxes, list[str]]:
    """The boxes with the poses at rest of what moved and still stands upright, and the names of these."""
    position, yaw = np.array(boxes.position, float), np.array(boxes.yaw, float)
    rows = {f"{OBJECTS}/{node.name}": i for i, node in enumerate(room.graph.nodes)}
    names = []
    for motion in report.restless:
        row = rows.get(motion.path)
        if row is None or room.graph.nodes[row].locked or room.graph.nodes[row].position is not None:
            continue
        place = _in_room(room, motion.place)
        lean = np.degrees(np.arccos(np.clip(place[1, 1], -1, 1)))
        if lean > UPRIGHT:
            continue
        position[row] = place[:3, 3]
        yaw[row] = np.arctan2(place[0, 2], place[2, 2])
        names.append(motion.name)
    made = Boxes(boxes.size, *(torch.as_tensor(v, dtype=torch.float32) for v in (position, yaw)))
    return rounded_boxes(room.graph, made), names


def _in_room(room: Room, place: np.ndarray) -> np.ndarray:
    """(4, 4) float: a pose in the world of the room's stage, in the room's frame."""
    if room.options.up_axis == "Y":
        return place
    turn = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])  # (x, y, z) with Z up -> (x, z, -y)
    return np.asarray(turn @ place @ turn.T)
