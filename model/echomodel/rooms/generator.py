"""The generator of rooms: a floor, what it holds, and where everything stands, as `RoomBoxes`."""

import itertools
import math
from collections import Counter
from dataclasses import replace

import numpy as np

from echomodel.roomboxes import RoomBoxes
from echomodel.rooms.builder import Builder
from echomodel.rooms.floor import sample_floor
from echomodel.rooms.recipes import furnish, wanted
from echomodel.rooms.statistics import RoomTypeStatistics, room_type_statistics
from echomodel.vocabulary import vocabulary

REDRAWS = 4  # rooms in which what they are for finds no place are drawn anew so often
STYLES = 327  # of the full set of shapes, which has each of 46 categories in all of them
THREE = 0.4  # share of the halls that have a third zone
WALLS_SHARED = 0.85  # zones of one room need less floor than rooms of their own
LARGEST = 80.0  # square metres


def drawn_shares() -> dict[str, float]:
    """Room type -> its share in a mixed set of rooms, the most frequent first, as in real collections."""
    return {row.name: row.share for row in sorted(vocabulary().room_types, key=lambda row: -row.share) if row.share}


def generate_room(
    rng: np.random.Generator, room_type: str | None = None, *, styles: int = STYLES, name: str = "room",
    statistics: RoomTypeStatistics | None = None, hall: bool = False,
) -> RoomBoxes:  # fmt: skip
    """Draw one room.

    Arguments:
        rng: source of every draw; the room is a function of its state.
        room_type: word of the vocabulary, or None to draw one by `drawn_shares`.
        styles: number of style groups; objects refer to shape `s<style>_<category>`.
        name: the room's id.
        statistics: what such rooms hold, default that of the real ones.
        hall: draw a large room of two or three zones.

    Returns the room with its floor's bounding box centred at the origin, metres and radians.
    Raises ValueError for a room type that the statistics do not hold.
    """
    if room_type is None:
        shares = drawn_shares()
        room_type = list(shares)[int(np.searchsorted(np.cumsum(list(shares.values())), rng.random() * 0.999999))]
    statistics = statistics or room_type_statistics(room_type)
    for attempt in itertools.count():
        ground, zones = hall_of(statistics, rng) if hall else (statistics, [])
        builder = Builder(sample_floor(ground, rng), rng, styles)
        kinds = [room_type_statistics(zone) for zone in zones] or [statistics]
        area = builder.floor.area / len(kinds)
        total: Counter[str] = Counter()
        for kind in kinds:
            total.update(wanted(kind, area, rng))
        builder.wanted = dict(total)
        furnish(builder, room_type)
        if len(builder.items) > 1 and (not builder.lost or attempt >= REDRAWS):
            return _boxes(builder, name, room_type)
    raise AssertionError("unreachable")


def generate_rooms(
    count: int, seed: int, *, room_type: str | None = None, styles: int = STYLES, start: int = 0, halls: float = 0.0
) -> list[RoomBoxes]:
    """Draw `count` rooms; room number i depends on (seed, i) alone, so that sets can be made in pieces.

    `halls`: the share of large rooms of several zones.
    """
    out = []
    for number in range(start, start + count):
        rng = np.random.Generator(np.random.PCG64([seed, number]))
        hall = halls > 0 and np.random.Generator(np.random.PCG64([seed, number, 3])).random() < halls
        out.append(generate_room(rng, room_type, styles=styles, name=f"room_{seed}_{number:06d}", hall=hall))
    return out


def _boxes(builder: Builder, name: str, room_type: str) -> RoomBoxes:
    items = builder.items
    order = builder.rng.permutation(len(items))
    mirror = -1.0 if builder.rng.random() < 0.5 else 1.0
    turn = -1.0 if builder.rng.random() < 0.5 else 1.0

    def turned(points: np.ndarray) -> np.ndarray:
        """Mirrored and turned by half a turn at random (quarter turns come with the floor's extents)."""
        return points * [mirror * turn, turn]

    chosen = [items[k] for k in order]
    plan = turned(np.array([(item.x, item.z) for item in chosen]))
    yaw = mirror * np.array([item.yaw for item in chosen]) + (math.pi if turn < 0 else 0.0)
    openings = builder.floor.openings
    if mirror < 0:  # the corners keep their order
        openings = tuple(replace(one, hinge="left" if one.hinge == "right" else "right") for one in openings)
    return RoomBoxes(
        id=name, room_type=room_type, floor_polygon=turned(np.array(builder.floor.polygon)),
        height=builder.floor.height, categories=tuple(item.category for item in chosen),
        size=np.array([item.size for item in chosen]),
        position=np.stack([plan[:, 0], [item.y for item in chosen], plan[:, 1]], -1),
        yaw=(yaw + math.pi) % (2 * math.pi) - math.pi,
        models=tuple(f"s{item.style}_{item.category}" for item in chosen), styles=tuple(item.style for item in chosen),
        openings=openings,
    )  # fmt: skip


def hall_of(statistics: RoomTypeStatistics, rng: np.random.Generator) -> tuple[RoomTypeStatistics, list[str]]:
    """Statistics of a floor for several zones, and the room types of all zones, the room's own first."""
    names, shares = zip(*vocabulary().room_type(statistics.name).zones, strict=True)
    weights = np.cumsum(shares)
    count = 1 + int(rng.random() < THREE)
    types = [statistics.name, *(names[int(np.searchsorted(weights, rng.random() * weights[-1]))] for _ in range(count))]
    area = WALLS_SHARED * sum(room_type_statistics(name).area[2] for name in types) * float(rng.uniform(0.9, 1.5))
    area = min(area, LARGEST)
    side = (area / statistics.area[2]) ** 0.5
    return replace(
        statistics,
        area=(area,) * 5,
        short=tuple(side * value for value in statistics.short),
        long=tuple(side * value for value in statistics.long),
    ), types
