"""Check a room: relations, collisions, placement, living rules and USD validity in one report."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pxr import Usd

from echomodel.dressing import SMALL
from echousd.checks.collisions import find_collisions
from echousd.checks.living import find_living
from echousd.checks.manifests import rewritten
from echousd.checks.placement import Misplacement, find_misplaced, misplaced_screens, misplaced_small
from echousd.checks.relations import MeasuredRelation, measured_relations
from echousd.checks.validity import Fault, find_faults
from echousd.repair.living import LivingFault
from echousd.repair.report import Collision
from echousd.stage.contents import RoomContents, Surrounding, read_contents, surroundings
from echousd.stage.encoding import StageError
from echousd.stage.files import opened, source
from echousd.stage.labels import known_category
from echousd.stage.layouts import layout_names, showing_layout
from echousd.stage.read import RoomPrims, find_rooms
from echousd.stage.taxonomy import SHELL

if TYPE_CHECKING:
    from echousd.settle import SettleReport

DRESSED = "Dressing"  # name of the group that holds the small things of a room


@dataclass(frozen=True)
class LayoutReport:
    """What a check found in one layout.

    Arguments:
        name: of the variant, "" where the room has only one layout.
        relations: every relation and placement of objects with boxes, with its verdict and margin.
        collisions, placement: what stands where it should not.
        living: what a person would point at though the graph does not forbid it; warnings.
    """

    name: str
    relations: tuple[MeasuredRelation, ...]
    collisions: tuple[Collision, ...]
    placement: tuple[Misplacement, ...]
    living: tuple[LivingFault, ...]

    @property
    def broken(self) -> tuple[MeasuredRelation, ...]:
        """The relations that do not hold."""
        return tuple(relation for relation in self.relations if not relation.kept)

    @property
    def kept(self) -> int:
        """Number of measured relations that hold."""
        return sum(relation.kept and relation.margin is not None for relation in self.relations)

    @property
    def ok(self) -> bool:
        """Nothing is broken, collides or stands in the wrong place."""
        return not (self.broken or self.collisions or self.placement)

    def to_json(self) -> dict[str, Any]:
        """The entry of the report."""
        return {
            "relations": {
                "kept": self.kept,
                "broken": [relation.to_json() for relation in self.broken],
                "unmeasured": sum(relation.margin is None for relation in self.relations),
            },
            "collisions": [hit.to_json() for hit in self.collisions],
            "placement": [wrong.to_json() for wrong in self.placement],
            "living": [fault.to_json() for fault in self.living],
        }


@dataclass(frozen=True)
class CheckReport:
    """What a check found.

    Arguments:
        source: the file (or layer) that was checked; rooms: prim paths of its rooms.
        layouts: what was found in each layout, the only one of most rooms called "".
        errors, warnings: of the USD validators, ours included.
        settled: how every layout behaved under gravity, None where nobody asked.
    """

    source: str
    rooms: tuple[str, ...]
    layouts: tuple[LayoutReport, ...]
    errors: tuple[Fault, ...]
    warnings: tuple[Fault, ...]
    settled: tuple[SettleReport, ...] | None = None

    @property
    def relations(self) -> tuple[MeasuredRelation, ...]:
        """The relations of all layouts."""
        return tuple(relation for layout in self.layouts for relation in layout.relations)

    @property
    def collisions(self) -> tuple[Collision, ...]:
        """The collisions of all layouts."""
        return tuple(hit for layout in self.layouts for hit in layout.collisions)

    @property
    def placement(self) -> tuple[Misplacement, ...]:
        """What is misplaced in any layout."""
        return tuple(wrong for layout in self.layouts for wrong in layout.placement)

    @property
    def living(self) -> tuple[LivingFault, ...]:
        """What a person would point at in any layout."""
        return tuple(fault for layout in self.layouts for fault in layout.living)

    @property
    def broken(self) -> tuple[MeasuredRelation, ...]:
        """The relations that do not hold, of all layouts."""
        return tuple(relation for layout in self.layouts for relation in layout.broken)

    @property
    def ok(self) -> bool:
        """Nothing but warnings was found, and all that was simulated rests."""
        rests = all(found.ok for found in self.settled or ())
        return not self.errors and rests and all(layout.ok for layout in self.layouts)

    def good(self, *, strict: bool = False) -> bool:
        """Whether the check is passed; broken living rules fail a strict one."""
        return self.ok and not (strict and self.living)

    def to_json(self) -> dict[str, Any]:
        """The report as `echousd check --json` prints it; of several layouts, each has its entry."""
        several = len(self.layouts) > 1 or any(layout.name for layout in self.layouts)
        found = (
            {"layouts": {layout.name: {"ok": layout.ok, **layout.to_json()} for layout in self.layouts}}
            if several
            else self.layouts[0].to_json()
        )
        rest = {} if self.settled is None else {"settle": [each.to_json() for each in self.settled]}
        return {
            "ok": self.ok,
            **found,
            "usd": {
                "errors": [fault.to_json() for fault in self.errors],
                "warnings": [fault.to_json() for fault in self.warnings],
            },
            **rest,
        }


def check(
    stage: Usd.Stage | str | os.PathLike[str],
    *,
    rules: str = "strict",
    layout: int | None = None,
    settle: bool = False,
) -> CheckReport:
    """Check every room on a stage, in all of its layouts.

    Arguments:
        stage: an open stage or a file.
        rules: `strict` or `sgfront`, for the relations.
        layout: number of the only layout to check.
        settle: simulate two seconds of every layout as well, in which everything must rest.

    Raises:
        ValueError: the file cannot be opened, holds no room or no such layout, or the rules are unknown.
        SettleUnavailable: `settle` without the extra `sim`.
    """
    from echomodel.rules import rule_set

    rule_set(rules)
    stage = opened(stage)
    errors, warnings = find_faults(stage)
    names: tuple[str | int | None, ...] = (layout_names(stage) or (None,)) if layout is None else (layout,)
    found = [check_layout(stage, name, rules) for name in names]
    rooms = found[0][0]
    if not rooms and not errors:
        raise StageError(f"{source(stage)}: no room (no EchoSceneGraph prim), nothing to check")
    first = found[0][1]
    if len(rooms) == 1 and first.name in ("", "layout_0"):
        errors = (*errors, *rewritten(stage, rooms[0], first.relations))
    settled = None
    if settle:
        from echousd.settle import settle_layouts

        settled = settle_layouts(stage, layout=layout)
    return CheckReport(source(stage), rooms, tuple(report for _, report in found), errors, warnings, settled)


def check_layout(stage: Usd.Stage, layout: str | int | None, rules: str) -> tuple[tuple[str, ...], LayoutReport]:
    """Prim paths of the rooms, and what is wrong with them in one layout."""
    with showing_layout(stage, layout) as name:
        try:
            found = find_rooms(stage)
        except StageError:  # echo:EdgeTargets reports it
            found = []
        rooms = [read_contents(prims) for prims in found]
        around = [Around.of(prims) for prims in found]
        report = LayoutReport(
            "" if layout is None else name,
            tuple(relation for room in rooms for relation in measured_relations(room, rules)),
            tuple(
                hit
                for room, other in zip(rooms, around, strict=True)
                for hit in find_collisions(room.objects, other.strangers, other.small, other.shell)
            ),
            tuple(wrong for room, other in zip(rooms, around, strict=True) for wrong in _misplaced(room, other)),
            tuple(fault for room in rooms for fault in find_living(room)),
        )
        return tuple(room.path for room in rooms), report


def _misplaced(room: RoomContents, other: Around) -> tuple[Misplacement, ...]:
    if not room.objects:
        return ()
    screens = misplaced_screens(room, other.small)
    return (*find_misplaced(room), *screens, *misplaced_small(room, other.small, other.shell))


@dataclass(frozen=True)
class Around:
    """What is in a room besides the nodes of its furniture's graph: things of its dressing, its shell, and the rest."""

    small: tuple[Surrounding, ...]
    shell: tuple[Surrounding, ...]
    strangers: tuple[Surrounding, ...]

    @classmethod
    def of(cls, prims: RoomPrims) -> Around:
        """All of a room, but for floors, which carry all of it."""
        small, shell, strangers = [], [], []
        for one in surroundings(prims):
            if one.word in SMALL and one.prim.GetParent().GetName() == DRESSED:
                small.append(one)
            elif one.word in SHELL:
                shell.append(one)
            elif known_category(one.word) is not None:
                strangers.append(one)
        return cls(tuple(small), tuple(one for one in shell if one.word != "floor"), tuple(strangers))
