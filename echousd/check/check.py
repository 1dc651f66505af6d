"""Check a room: relations, collisions, placement and USD validity in one report."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

from pxr import Usd

from echousd.check.collisions import Collision, find_collisions
from echousd.check.objects import RoomContents, read_contents
from echousd.check.placement import Misplacement, find_misplaced
from echousd.check.relations import Judged, judge
from echousd.check.validity import Fault, find_faults
from echousd.stage.encoding import StageError
from echousd.stage.files import opened, source
from echousd.stage.read import find_rooms


@dataclass(frozen=True)
class CheckReport:
    """What a check found.

    Arguments:
        source: the file (or layer) that was checked; rooms: prim paths of its rooms.
        relations: every relation between objects with boxes, with its verdict and margin.
        collisions, placement: what stands where it should not.
        errors, warnings: of the USD validators, ours included.
    """

    source: str
    rooms: tuple[str, ...]
    relations: tuple[Judged, ...]
    collisions: tuple[Collision, ...]
    placement: tuple[Misplacement, ...]
    errors: tuple[Fault, ...]
    warnings: tuple[Fault, ...]

    @property
    def broken(self) -> tuple[Judged, ...]:
        """The relations that do not hold."""
        return tuple(judged for judged in self.relations if not judged.kept)

    @property
    def kept(self) -> int:
        """Number of measured relations that hold."""
        return sum(judged.kept and judged.margin is not None for judged in self.relations)

    @property
    def ok(self) -> bool:
        """Nothing but warnings was found."""
        return not (self.broken or self.collisions or self.placement or self.errors)

    def to_json(self) -> dict[str, Any]:
        """The report as `echousd check --json` prints it."""
        return {
            "ok": self.ok,
            "relations": {
                "kept": self.kept,
                "broken": [judged.to_json() for judged in self.broken],
                "unmeasured": sum(judged.margin is None for judged in self.relations),
            },
            "collisions": [hit.to_json() for hit in self.collisions],
            "placement": [wrong.to_json() for wrong in self.placement],
            "usd": {
                "errors": [fault.to_json() for fault in self.errors],
                "warnings": [fault.to_json() for fault in self.warnings],
            },
        }


def check_room(stage: Usd.Stage | str | os.PathLike[str], *, rules: str = "strict") -> CheckReport:
    """Check every room on a stage.

    Arguments:
        stage: an open stage or a file.
        rules: `strict` or `sgfront`, for the relations.

    Raises:
        ValueError: the file cannot be opened, holds no room, or the rules are unknown.
    """
    from echomodel.rules import rule_set

    rule_set(rules)
    stage = opened(stage)
    errors, warnings = find_faults(stage)
    try:
        rooms = [read_contents(prims) for prims in find_rooms(stage)]
    except StageError:  # echo:EdgeTargets reports it
        rooms = []
    if not rooms and not errors:
        raise StageError(f"{source(stage)}: no room (no EchoSceneGraph prim), nothing to check")
    return CheckReport(
        source(stage),
        tuple(room.path for room in rooms),
        tuple(judged for room in rooms for judged in judge(room, rules)),
        tuple(hit for room in rooms for hit in find_collisions(room.objects)),
        tuple(wrong for room in rooms for wrong in _misplaced(room)),
        errors,
        warnings,
    )


def _misplaced(room: RoomContents) -> tuple[Misplacement, ...]:
    return find_misplaced(room) if room.objects else ()
