"""Doors, passages and windows of a plan: each once, with a leaf in one room, swinging free, clear of all others."""

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import shapely

from echomodel.openings import Opening, direction, edge_lengths, free_area, inward_normal, overlap, signed_area
from echomodel.rooms.openings import place_openings, places_along
from echomodel.vocabulary import vocabulary
from echousd.home.graph import HomeGraph, HomeRelation
from echousd.naming import free_name

DOOR, FRONT_DOOR = (0.9, 2.0), (1.0, 2.1)  # metres, width and height
PASSAGE = (3.0, 2.3)  # at most
PASSAGE_SHARE = 0.6  # of the wall that two rooms share: furniture needs the rest
JAMB = 0.12  # metres from a corner to a hole
UNEVEN = 0.15  # metres that a wall may be thicker in one place than in another
STEP = 0.1  # metres between the places that are tried
ASIDE = 0.25  # what a metre between a hole and the nearest corner or other hole costs


@dataclass(frozen=True, eq=False)
class Floor:
    """A floor in the home's frame: corners (k, 2) in metres, and the thickness of the wall along each edge."""

    name: str
    corners: np.ndarray
    walls: Sequence[float]


@dataclass(frozen=True)
class Facing:
    """A stretch of wall from `low` to `high` metres along an edge of a room, which another may share, "" = none."""

    one: str
    edge: int
    low: float
    high: float
    deep: float  # metres of wall to the other floor, or to the outside
    other: str = ""
    other_edge: int = -1
    length: float = 0.0  # from the other's corner to where `low` is, against its own direction

    def across(self, opening: Opening) -> Opening:
        """The hole on the other side of the wall."""
        return replace(
            opening, kind="passage", edge=self.other_edge, offset=round(self.length - opening.end, 4), swing="in",
            hinge="left",
        )  # fmt: skip


def face_to_face(one: Floor, other: Floor) -> Iterator[Facing]:
    """The stretches of a floor's edges before which edges of another lie the other way, however far away."""
    for edge, length in enumerate(edge_lengths(one.corners)):
        along, outward = direction(one.corners, edge), -inward_normal(one.corners, edge)
        for other_edge, other_length in enumerate(edge_lengths(other.corners)):
            if outward @ inward_normal(other.corners, other_edge) < 0.999:
                continue
            start = other.corners[other_edge] - one.corners[edge]
            turned = float(direction(other.corners, other_edge) @ along)
            at = float(start @ along)
            low, high = sorted((at, at + turned * float(other_length)))
            low, high = max(low, 0.0), min(high, float(length))
            if high - low > 0.05:
                yield Facing(one.name, edge, low, high, float(start @ outward), other.name, other_edge, at)


def facings(one: Floor, other: Floor) -> Iterator[Facing]:
    """The stretches of wall that two rooms share, however they are turned."""
    for stretch in face_to_face(one, other):
        if abs(stretch.deep - one.walls[stretch.edge] - other.walls[stretch.other_edge]) <= UNEVEN:
            yield stretch


def counterpart(floor: Floor, opening: Opening, floors: Iterable[Floor]) -> tuple[str, Opening] | None:
    """The room behind an opening and the hole that must be on its side; None for one that leads outside."""
    for other in floors:
        for facing in facings(floor, other) if other.name != floor.name else ():
            within = facing.low - 0.01 <= opening.offset and opening.end <= facing.high + 0.01
            if facing.edge == opening.edge and within:
                return other.name, facing.across(opening)
    return None


def openings_of(
    home: HomeGraph, floors: Sequence[Floor], there: Mapping[str, Sequence[Opening]], done: Container[HomeRelation]
) -> dict[str, tuple[Opening, ...]]:
    """The openings of every room: doors and passages of the graph, a front door, windows in outer walls.

    Arguments:
        there: those that stay where they are; only a room without any gets windows. done: the relations that they keep,
            and if there are any, the front door.
    """
    by_name = {floor.name: floor for floor in floors}
    wanted = [r for r in home.relations if r.row.passes and r not in done]
    options = [[*_passages(home, by_name, *r.pair, r.predicate)] for r in wanted]
    if not any(there.values()):
        options.append([*_front_doors(by_name[home.entered_by], floors)])
    order = sorted(range(len(options)), key=lambda number: len(options[number]))
    fixed = [_Hole(((by_name[room], opening),), 0.0) for room, own in there.items() for opening in own]
    picked: dict[int, _Hole] = {}
    for _ in range(2):  # the second time, each knows where all the others are
        for number in order:
            others = [*fixed, *(hole for which, hole in picked.items() if which != number)]
            costs = [hole.cost + ASIDE * hole.aside(others) + sum(map(hole.meets, others)) for hole in options[number]]
            if costs:
                picked[number] = options[number][int(np.argmin(costs))]
    found = {floor.name: list(there.get(floor.name, ())) for floor in floors}
    for number in sorted(picked):
        for floor, opening in picked[number].sides:
            own = found[floor.name]
            own.append(replace(opening, name=free_name(opening.kind, [one.name for one in own])))
    for floor in floors:
        found[floor.name] += () if there.get(floor.name) else _windows(home, floor, floors, found[floor.name])
    return {name: tuple(own) for name, own in found.items()}


@dataclass(frozen=True)
class _Hole:
    """A hole in a wall as the one or two rooms have it, and what speaks against it."""

    sides: tuple[tuple[Floor, Opening], ...]
    cost: float

    @cached_property
    def ways(self) -> list[shapely.Polygon]:
        """What must stay free on each of its sides."""
        return [shapely.Polygon(free_area(floor.corners, opening)) for floor, opening in self.sides]

    def aside(self, others: Sequence["_Hole"]) -> float:
        """Metres of wall from it to the nearest corner or other hole, in both rooms: furniture needs whole walls."""
        out = 0.0
        for floor, mine in self.sides:
            there = [one for hole in others for same, one in hole.sides if same is floor and one.edge == mine.edge]
            low = max([0.0, *(one.end for one in there if one.offset < mine.offset)])
            high = min([float(edge_lengths(floor.corners)[mine.edge]), *(o.offset for o in there if o.end > mine.end)])
            out += max(min(mine.offset - low, high - mine.end), 0.0)
        return out

    def meets(self, other: "_Hole") -> float:
        """What speaks against two holes together: swings that cross, holes in one place."""
        out = 0.0
        for number, (floor, mine) in enumerate(self.sides):
            for side, (same, theirs) in enumerate(other.sides):
                if floor is same:
                    if overlap(mine, theirs) > -2 * JAMB:
                        out += 100.0
                    out += 30.0 * self.ways[number].intersection(other.ways[side]).area
        return out


def _passages(home: HomeGraph, floors: dict[str, Floor], one: str, other: str, predicate: str) -> Iterator[_Hole]:
    """All holes that a relation could be kept by."""
    for facing in facings(floors[one], floors[other]) if predicate == "open_to" else ():
        span = facing.high - facing.low - 2 * JAMB
        width = min(span, PASSAGE[0], max(PASSAGE_SHARE * span, DOOR[0] + JAMB))
        ends = (facing.low + JAMB, facing.high - JAMB - width)  # which leaves one whole wall beside it
        for offset in ends if width > 0.8 else ():
            mine = Opening("passage", "passage", facing.edge, round(offset, 3), round(width, 3), PASSAGE[1])
            yield _Hole(((floors[one], mine), (floors[other], facing.across(mine))), -width)
    for near, far in ((one, other), (other, one)) if predicate != "open_to" else ():  # into the first of which it opens
        floor, hub = floors[near], vocabulary().room_type(home.room(near).type).hub
        room = shapely.Polygon(floor.corners).buffer(1e-3)
        for side, mine in ((one, door) for one in facings(floor, floors[far]) for door in _doors(floor, one, *DOOR)):
            outside = shapely.Polygon(free_area(floor.corners, mine)).difference(room).area
            yield _Hole(((floor, mine), (floors[far], side.across(mine))), 0.3 * hub + 50.0 * outside)


def _front_doors(floor: Floor, floors: Sequence[Floor]) -> Iterator[_Hole]:
    for side in outer_spans(floor, floors):
        for door in _doors(floor, side, *FRONT_DOOR):
            yield _Hole(((floor, door),), 0.05 * float(edge_lengths(floor.corners)[side.edge]))


def _doors(floor: Floor, side: Facing, width: float, height: float) -> Iterator[Opening]:
    """Doors in a stretch of wall, hinged at the nearer corner."""
    length = float(edge_lengths(floor.corners)[side.edge])
    for offset in places_along(side.low + JAMB, side.high - side.low - 2 * JAMB, width, STEP):
        near, far = float(offset), float(length - width - offset)
        hinge = "left" if (near <= far) == (signed_area(floor.corners) > 0) else "right"
        yield Opening("door", "door", side.edge, near, width, height, hinge=hinge)


def outer_spans(floor: Floor, floors: Sequence[Floor]) -> Iterator[Facing]:
    """The stretches of a room's walls that have no other room behind them."""
    met = [facing for other in floors if other.name != floor.name for facing in facings(floor, other)]
    for edge, length in enumerate(edge_lengths(floor.corners)):
        inner = sorted((one.low, one.high) for one in met if one.edge == edge)
        at = 0.0
        for low, high in [*inner, (float(length), float(length))]:
            if low - at > 0.5:
                yield Facing(floor.name, edge, at, low, floor.walls[edge])
            at = max(at, high)


def _windows(home: HomeGraph, floor: Floor, floors: Sequence[Floor], there: Sequence[Opening]) -> tuple[Opening, ...]:
    """Windows in outer walls, where daylight is wanted or water splashed."""
    row, tall = vocabulary().room_type(home.room(floor.name).type), home.room(floor.name).graph.room.tall
    if row.use == "outdoor" or not (row.daylight or row.use == "wet"):
        return ()
    spans = [(side.edge, side.low, side.high) for side in outer_spans(floor, floors)]
    made = place_openings(floor.corners, tall, np.random.default_rng(0), stated=there, use=row.use, spans=spans)
    return tuple(one for one in made[len(there) :] if one.kind == "window")
