"""Which relations of a room's graph its objects keep, measured on their boxes by the rules of `echomodel.rules`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from echomodel.vocabulary import vocabulary
from echousd.graph import Placed, Relation
from echousd.repair.repair import floor_of_room
from echousd.stage.contents import RoomContents

if TYPE_CHECKING:
    from echomodel.boxes import Boxes


@dataclass(frozen=True)
class MeasuredRelation:
    """A relation or placement with its signed margin (metres or ratio, >= 0 = kept), None where it is not measured."""

    relation: Relation | Placed
    kept: bool
    margin: float | None

    def to_json(self) -> dict:
        """The entry of the report."""
        subject, predicate, object_ = self.relation.triple
        margin = None if self.margin is None else round(self.margin, 4)
        return {"subject": subject, "predicate": predicate, "object": object_, "margin": margin}


def measured_relations(room: RoomContents, rules: str = "strict") -> tuple[MeasuredRelation, ...]:
    """Every relation and placement of objects with boxes; raises ValueError for unknown rules."""
    import torch

    from echomodel.boxes import Boxes
    from echomodel.rules import fronts, margins, verdicts

    words = vocabulary()
    index = {thing.node.name: i for i, thing in enumerate(room.objects)}
    triplets = torch.tensor(
        [[index[r.subject], words.predicate_id(r.predicate), index[r.object]] for r in room.relations],
        dtype=torch.int64,
    ).reshape(-1, 3)
    size = np.array([thing.size for thing in room.objects]).reshape(-1, 3)
    position = np.array([thing.position for thing in room.objects]).reshape(-1, 3)
    yaw = np.array([thing.yaw for thing in room.objects])
    boxes = Boxes(*(torch.tensor(v, dtype=torch.float64) for v in (size, position, yaw)))
    polygon = None if room.spec is None else floor_of_room(room.spec)
    centre = np.zeros(2) if polygon is None else (polygon.max(0) + polygon.min(0)) / 2
    center = torch.as_tensor(centre)
    headed = fronts(thing.node.category for thing in room.objects)
    verdict = verdicts(boxes, triplets, rules=rules, center=center, fronts=headed).tolist()
    margin = margins(boxes, triplets, rules=rules, center=center, fronts=headed).tolist()
    # Meshes are stored in single precision: a relation that holds to a tenth of a millimetre holds.
    return tuple(
        MeasuredRelation(relation, bool(found != 0 or value > -1e-4), None if found < 0 else float(value))
        for relation, found, value in zip(room.relations, verdict, margin, strict=True)
    ) + _measured_placements(room, boxes, polygon)


def _measured_placements(room: RoomContents, boxes: Boxes, floor: np.ndarray | None) -> tuple[MeasuredRelation, ...]:
    from echomodel.rules.placements import Stated, placement_margins

    index = {thing.node.name: i for i, thing in enumerate(room.objects)}
    told = [one for thing in room.objects for one in thing.node.placements if set(one.others) <= index.keys()]
    stated = [Stated(one.placement, index[one.subject], tuple(index[name] for name in one.others)) for one in told]
    margin = placement_margins(boxes, stated, floor, [thing.node.category for thing in room.objects]).tolist()
    return tuple(
        MeasuredRelation(one, value != value or value > -1e-4, None if value != value else value)
        for one, value in zip(told, margin, strict=True)
    )
