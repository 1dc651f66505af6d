"""A home judged as a whole: the plan against the graph, shared walls and doors, ways of a robot, then every room."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from pxr import Usd

from echomodel.openings import STEP, inward_normal, segment
from echomodel.vocabulary import vocabulary
from echousd.checks.report import CheckReport, check
from echousd.home.existing import plan_there
from echousd.home.plan import HomePlan, doorways, overlapping
from echousd.home.stages import Standing, furniture, named_rooms
from echousd.stage.files import open_stage

ROBOT = 0.15  # metres, radius of a robot that is 0.3 m wide
SLACK = 0.02  # metres that it squeezes through
AT_DOOR = 0.6  # metres around where it enters
ENDS = 0.1  # metres before both ends of a way that count as these
REACHED = 0.5  # share of a room's free floor that it must get to
LOW = 1.5  # metres below which things are in its way


@dataclass(frozen=True)
class HomeReport:
    """What a check of a home found.

    Arguments:
        faults: (kind, sentence) of the home as a whole. reached: room -> share of its free floor that a robot gets to.
        relations: how many were asked. rooms: the check of each.
    """

    faults: tuple[tuple[str, str], ...]
    reached: dict[str, float]
    relations: int
    rooms: dict[str, CheckReport]

    def good(self, *, strict: bool = False) -> bool:
        """Whether the home is whole and every room passes its own check."""
        return not self.faults and all(report.good(strict=strict) for report in self.rooms.values())

    def to_json(self) -> dict[str, Any]:
        """The report as plain data."""
        return {
            "ok": self.good(),
            "relations": self.relations,
            "faults": [{"kind": kind, "says": says} for kind, says in self.faults],
            "reached": {name: round(share, 3) for name, share in self.reached.items()},
            "rooms": {name: report.to_json() for name, report in self.rooms.items()},
        }


def check_home(
    path: Path, *, rules: str = "strict", layout: int | None = None, settle: bool = False
) -> HomeReport | None:
    """Judge the home in a file, as `echousd.check`; None for other rooms than payloads with floors side by side."""
    files = _room_files(open_stage(path))
    plan = plan_there(path) if files else None
    if plan is None or files is None:
        return None
    ground = open_ground(plan, furniture(plan, path))
    reached = walked(plan, ground)
    faults = [("broken", f"{relation}: the plan does not keep it") for relation in plan.broken()]
    for one, other, shared in overlapping(plan.floors, 0.01):
        faults.append(("walls", f"{one} and {other} share {shared:.2f} m² of floor, allowed: none"))
    faults += [("walls", says) for says in _openings(plan)]
    faults += [
        ("ways", f"{name}: a robot of 0.3 m from {plan.home.entered_by} gets to {share:.0%} of its free floor")
        for name, share in reached.items()
        if share < REACHED
    ]
    faults += [("ways", says) for says in _blocked(plan, ground)]
    rooms = {name: check(file, rules=rules, layout=layout, settle=settle) for name, file in files.items()}
    return HomeReport(tuple(faults), reached, len(plan.home.relations), rooms)


def _room_files(stage: Usd.Stage) -> dict[str, Path] | None:
    """The root layers of a home's rooms, its payloads as `echousd generate` has them; None where a room is none."""
    files = {}
    for name, prims in named_rooms(stage).items():
        listed = [(spec.layer, spec.payloadList.GetAddedOrExplicitItems()) for spec in prims.room.GetPrimStack()]
        named = [layer.ComputeAbsolutePath(payload.assetPath) for layer, payloads in listed for payload in payloads]
        if not named:
            return None
        files[name] = Path(named[0])
    return files


def _openings(plan: HomePlan) -> Iterator[str]:
    """Doors that lead into a wall, are there twice, or have no leaf or two."""
    for name, openings in plan.openings.items():
        for opening in openings:
            behind = plan.behind(name, opening)
            if behind is None:
                continue
            other, wanted = behind
            if opening.kind == "window":
                yield f"{name}: {opening.name} looks into {other}, allowed: in an outer wall"
            same = [o for o in plan.openings[other] if o.edge == wanted.edge and abs(o.offset - wanted.offset) < 5e-3]
            if opening.kind != "window" and not same:
                yield f"{name}: {opening.name} leads into the wall of {other}, allowed: the same hole on its side"
            if opening.kind == "door" and same and same[0].kind == "door" and name < other:
                yield f"{name} and {other}: two leaves in one door, allowed: one"


def open_ground(plan: HomePlan, things: Sequence[Standing]) -> shapely.Geometry:
    """Where the middle of a robot may be on a home's floors and in its doorways, with what stands in its way there."""
    floors = [shapely.Polygon(floor) for floor in plan.floors.values()]
    floors += [shapely.box(*corners.ravel()).buffer(0.02) for *_, corners in doorways(plan)]
    solid = [
        shapely.Polygon(thing.corners)
        for thing in things
        if thing.low <= LOW and vocabulary().category(thing.node.category).support == "floor"
    ]
    return shapely.union_all(floors).difference(shapely.union_all(solid)).buffer(SLACK - ROBOT)


def walked(plan: HomePlan, ground: shapely.Geometry) -> dict[str, float]:
    """Of every room the share of its free floor that a robot gets to which enters the home by its front door."""
    door = shapely.Point(_start(plan)).buffer(AT_DOOR)
    near = [part for part in shapely.get_parts(ground) if part.intersects(door)]
    here = max(near, key=lambda part: part.intersection(door).area, default=shapely.Polygon())
    out = {}
    for name, floor in plan.floors.items():
        mine = ground.intersection(shapely.Polygon(floor))
        out[name] = float(here.intersection(mine).area / mine.area) if mine.area else 0.0
    return out


def _blocked(plan: HomePlan, ground: shapely.Geometry) -> Iterator[str]:
    """Doors and passages that furniture stands in, on either side."""
    for (one, other), opening, corners in doorways(plan):
        near, inward = segment(plan.floors[one], opening), inward_normal(plan.floors[one], opening.edge)
        deep = float(np.ptp(corners, 0) @ np.abs(inward)) + STEP
        way = ground.intersection(shapely.Polygon([*(near + inward * STEP), *(near[::-1] - inward * deep)]))
        offs = [(shapely.get_coordinates(part) - near[0]) @ inward for part in shapely.get_parts(way) if part.area]
        if not any(off.max() > STEP - ENDS and off.min() < ENDS - deep for off in offs):
            yield (
                f"{opening.kind} between {one} and {other}: furniture leaves no 0.3 m to get through, "
                f"allowed: a way of {STEP} m on both sides"
            )


def _start(plan: HomePlan) -> np.ndarray:
    """(2,) float: behind the front door, or in the middle of the room that one enters by."""
    name = plan.home.entered_by
    floor = plan.floors[name]
    for opening in plan.openings[name]:
        if opening.kind == "door" and plan.behind(name, opening) is None:
            return segment(floor, opening).mean(0) + inward_normal(floor, opening.edge) * (ROBOT + ENDS)
    return np.asarray(floor.mean(0))
