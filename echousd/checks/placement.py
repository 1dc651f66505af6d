"""Where objects stand: inside the floor, on something, at the ceiling or a wall."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echomodel.roomboxes import footprints
from echomodel.vocabulary import vocabulary
from echousd.repair.geometry import Floor, axes, floor_from_polygon, inside
from echousd.repair.repair import DEFAULT_HEIGHT, floor_of_room
from echousd.stage.contents import RoomContents, RoomObject

OUTSIDE = 0.03  # metres beyond the floor's edge
FLOATING = 0.03  # metres of air below, or depth below the floor
HANGING = 0.06  # metres between a ceiling thing and the ceiling
LEANING = 0.15  # metres between a wall thing and its wall


@dataclass(frozen=True)
class Misplacement:
    """An object in the wrong place: `problem` is `outside`, `floating`, `sunk` or `empty`, `distance` in metres."""

    object: str
    problem: str
    distance: float | None = None

    def to_json(self) -> dict:
        """The entry of the report."""
        return {
            "object": self.object,
            "problem": self.problem,
            "distance": None if self.distance is None else round(self.distance, 4),
        }


def find_misplaced(room: RoomContents) -> tuple[Misplacement, ...]:
    """Every object that is outside the floor, floats, sinks into it, or has no geometry where others have."""
    polygon = None if room.spec is None else floor_of_room(room.spec)
    floor = None if polygon is None else floor_from_polygon(polygon)
    told = DEFAULT_HEIGHT if room.spec is None or room.spec.height is None else room.spec.height
    height = max([told, *(float(thing.position[1] + thing.size[1]) for thing in room.objects)])
    found = [Misplacement(name, "empty") for name in room.missing] if room.objects else []
    for thing in room.objects:
        if floor is not None:
            beyond = _beyond(thing, floor)
            if beyond > OUTSIDE:
                found.append(Misplacement(thing.node.name, "outside", beyond))
        bottom = float(thing.position[1])
        if bottom < -FLOATING:
            found.append(Misplacement(thing.node.name, "sunk", -bottom))
            continue
        if thing.node.obstacle:  # held by what only its own stage knows
            continue
        air = _air_below(thing, room.objects)
        if air > FLOATING and not _held(thing, floor, height):
            found.append(Misplacement(thing.node.name, "floating", air))
    return tuple(found)


def _beyond(thing: RoomObject, floor: Floor) -> float:
    points = thing.points[:, [0, 2]] if len(thing.points) else _footprint(thing)
    return float(-inside(floor, points)[0].min())


def _footprint(thing: RoomObject) -> np.ndarray:
    return footprints(thing.size[None], thing.position[None], np.array([thing.yaw]))[0]


def _air_below(thing: RoomObject, others: Sequence[RoomObject]) -> float:
    """Height of the bottom over the floor or over the nearest surface below the middle or a corner of the object."""
    bottom = float(thing.position[1])
    air = abs(bottom)
    feet = np.concatenate((thing.position[None, [0, 2]], 0.5 * (_footprint(thing) + thing.position[[0, 2]])))
    for other in others:
        if other is thing:
            continue
        local = np.abs((feet - other.position[[0, 2]]) @ axes(np.array([other.yaw]))[0].T)
        if (local <= other.size[[0, 2]] / 2).all(1).any():
            air = min(air, abs(bottom - float(other.position[1] + other.size[1])))
            # Things stand on shelves and seats, below the top of the whole box.
            if len(other.points):
                air = min(air, _surface_gap(feet, bottom, other))
    return air


def _surface_gap(feet: np.ndarray, bottom: float, other: RoomObject) -> float:
    plan = other.points[other.faces][:, :, [0, 2]]
    low, high = plan.min(1), plan.max(1)
    best = np.inf
    for foot in feet:
        above = ((low <= foot) & (foot <= high)).all(1)
        if above.any():
            best = min(best, float(np.abs(other.points[other.faces[above]][:, :, 1] - bottom).min()))
    return best


def _held(thing: RoomObject, floor: Floor | None, height: float) -> bool:
    row = vocabulary().category(thing.node.category)
    top = float(thing.position[1] + thing.size[1])
    if row.support == "ceiling":
        return height - top <= HANGING
    if row.support == "wall" or row.hangs:
        return floor is None or float(inside(floor, _footprint(thing))[0].min()) <= LEANING
    return False
