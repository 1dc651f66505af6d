"""A room whose furniture stands where it comes to rest."""

from dataclasses import replace

import numpy as np

from echomodel.boxes import Boxes
from echousd.graph.arrays import rounded_boxes
from echousd.make.finished import Room
from echousd.make.verdicts import relation_verdicts
from echousd.settle.settle import SettleReport, settle_layouts
from echousd.stage.paths import OBJECTS, ROOM

UPRIGHT = 1.0  # degrees: what leans further at rest is no pose that a layout can hold


def settled(room: Room) -> Room:
    """The room with its poses at rest where they differ, told in its notes; what is locked stays.

    Every layout is simulated. Pieces that topple or fall stay where they were, since a layout holds upright poses: they
    are faults of the outcome, as is all that still does not rest.

    Raises SettleUnavailable without MuJoCo (extra `sim`).
    """
    reports = settle_layouts(_as_ours(room).stage)
    if all(report.ok for report in reports):
        return room
    rested = [_rested(room, boxes, report) for boxes, report in zip(room.layouts, reports, strict=True)]
    moved = sorted({name for _, names in rested for name in names})
    if moved:
        found = tuple(boxes for boxes, _ in rested)
        outcomes = tuple(
            replace(before, verdicts=relation_verdicts(room.graph, boxes))
            for boxes, before in zip(found, room.outcomes, strict=True)
        )
        notes = (*room.notes, *(f"{name} stands where it comes to rest" for name in moved))
        room = replace(room, layouts=found, outcomes=outcomes, notes=notes)
        reports = settle_layouts(_as_ours(room).stage)
    sentences = [replace(report, layout="").sentences for report in reports]
    outcomes = tuple(replace(one, restless=each) for one, each in zip(room.outcomes, sentences, strict=True))
    return replace(room, outcomes=outcomes)


def _as_ours(room: Room) -> Room:
    """The room in metres, with +Y up, at `/Room`, whatever its files shall have."""
    return replace(room, options=room.options.replaced(meters_per_unit=1.0, up_axis="Y", room_path=ROOM))


def _rested(room: Room, boxes: Boxes, report: SettleReport) -> tuple[Boxes, list[str]]:
    """The boxes with the poses at rest of what moved and still stands upright, and the names of these."""
    position, yaw = np.array(boxes.position, float), np.array(boxes.yaw, float)
    rows = {f"{OBJECTS}/{node.name}": i for i, node in enumerate(room.graph.nodes)}
    names = []
    for motion in report.restless:
        row = rows.get(motion.path)
        if row is None or room.graph.nodes[row].locked or room.graph.nodes[row].position is not None:
            continue
        place = motion.place
        lean = np.degrees(np.arccos(np.clip(place[1, 1], -1, 1)))
        if lean > UPRIGHT:
            continue
        position[row] = place[:3, 3]
        yaw[row] = np.arctan2(place[0, 2], place[2, 2])
        names.append(motion.name)
    made = Boxes(boxes.size, *(v.astype(np.float32) for v in (position, yaw)))
    return rounded_boxes(room.graph, made), names
