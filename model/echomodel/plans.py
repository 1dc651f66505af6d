"""Plans that nobody stated: extents of a floor from the room type and its furniture, doors and windows in its walls."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from echomodel.data.furniture.sizes import size_statistics
from echomodel.data.rooms.statistics import quantile, room_type_statistics
from echomodel.openings import (
    SWINGS,
    USUAL,
    Opening,
    edge_lengths,
    free_area,
    inward_normal,
    numbered,
    overlap,
    signed_area,
)
from echomodel.roomboxes import footprints
from echomodel.vocabulary import vocabulary

# Share of the floor that furniture covers in real rooms: median of each type (300 rooms), the rest like the last.
COVER = {"bedroom": 0.46, "living_room": 0.29, "dining_room": 0.26, "living_dining_room": 0.32, "study": 0.35}
FULL = 0.55  # of the floor at most in what is proposed: beyond it nobody can walk
ASPECT = {"living_dining_room": 1.55}  # long side over short side, median; others:
USUAL_ASPECT = 1.3
WAY = 0.9  # metres beside the longest piece
TUCKED = 0.5  # share of a seat's footprint that counts: the rest is below its table
GRID = 0.1  # metres between the places that are tried for an opening
CORNER = 0.1  # metres from a corner to a door
OUTWARDS = 0.7  # what a door that swings out of the room must save; rooms' doors open inwards
PIER = 0.3  # metres of wall between a window and a corner or another opening
SECOND_WINDOW, SECOND_DOOR = 16.0, 30.0  # square metres of floor


def footprint(categories: Sequence[str], sizes: Sequence[Sequence[float] | None], *, least: bool = False) -> float:
    """Square metres that furniture covers; pieces without a size count with the median of their class.

    Arguments:
        categories: words of the vocabulary; what hangs or stands on other things does not count.
        sizes: (x, y, z) extents in metres, or None.
        least: take the 5th percentile of the class instead of the median.
    """
    area = 0.0
    for category, size in zip(categories, sizes, strict=True):
        row = vocabulary().category(category)
        if row.support != "floor":
            continue
        if size is not None:
            x, z = float(size[0]), float(size[2])
        else:
            statistics = size_statistics(row.name)
            x, _, z = (statistics.low if least else statistics.median).tolist()
        area += x * z * (TUCKED if row.role == "seat" else 1.0)
    return area


def floor_extents(
    room_type: str,
    categories: Sequence[str],
    sizes: Sequence[Sequence[float] | None],
    rng: np.random.Generator,
    *,
    along_x: float = 0.5,
    openings: Sequence[Opening] = (),
) -> tuple[float, float]:
    """(x, z) extents in metres of a rectangular floor that such a room with this furniture would have.

    Arguments:
        room_type: of the vocabulary.
        categories, sizes: the furniture, see `footprint`.
        rng: of all randomness.
        along_x: probability that the long side runs along x.
        openings: those that are stated already, in the walls of a rectangle; the walls are made long enough.
    """
    statistics = room_type_statistics(room_type)
    covered = footprint(categories, sizes)
    usual = covered / COVER[room_type] * float(np.exp(0.12 * rng.standard_normal()))
    area = float(np.clip(usual, quantile(statistics.area, -0.9), quantile(statistics.area, 1.3)))
    area = max(area, covered / FULL)
    longest = [max(s[0], s[2]) if s is not None else _longest(c) for c, s in zip(categories, sizes, strict=True)]
    least = max(statistics.short[0], WAY + max(longest, default=0.0) / 2)
    aspect = float(np.clip(ASPECT.get(room_type, USUAL_ASPECT) * np.exp(0.14 * rng.standard_normal()), 1.0, 2.2))
    short = max(float(np.sqrt(area / aspect)), least)
    long = max(area / short, short, max(longest, default=0.0) + 0.1)
    short, long = round(short, 1), round(long, 1)
    x, z = (long, short) if rng.random() < along_x else (short, long)
    x = max([x, *(o.end for o in openings if o.edge % 2 == 0)])
    z = max([z, *(o.end for o in openings if o.edge % 2 == 1)])
    return x, z


def _longest(category: str) -> float:
    row = vocabulary().category(category)
    median = size_statistics(row.name).median
    return float(max(median[0], median[2])) if row.support == "floor" else 0.0


def place_openings(
    polygon: np.ndarray,
    height: float,
    rng: np.random.Generator,
    *,
    boxes: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None,
) -> tuple[Opening, ...]:
    """A door and one or two windows (two doors in halls), each where least stands in its way.

    Doors like the end of a wall with the hinges at the corner, windows the middle of another wall.

    Arguments:
        polygon: (k, 2) float, corners (x, z) of the floor, metres.
        height: of the room, metres.
        rng: decides between places that are equally good.
        boxes: size (n, 3), position (n, 3) of the bottom centre and yaw (n,) of what stands in the room.
    """
    area = abs(signed_area(polygon))
    made: list[Opening] = []
    for kind, count in (("door", 1 + (area > SECOND_DOOR)), ("window", 1 + (area > SECOND_WINDOW))):
        for _ in range(count):
            best = _best(kind, polygon, height, rng, made, boxes)
            if best is not None:
                made.append(best)
    return tuple(made)


def _best(
    kind: str,
    polygon: np.ndarray,
    height: float,
    rng: np.random.Generator,
    made: Sequence[Opening],
    boxes: tuple[np.ndarray, np.ndarray, np.ndarray] | None,
) -> Opening | None:
    """The place of least cost among a grid of places on all walls, None where no wall is long enough."""
    import shapely

    lengths = edge_lengths(polygon)
    blocks = _blocks(boxes)
    outline = shapely.Polygon(polygon).buffer(1e-6)
    best, least = None, np.inf
    name = numbered(kind, [opening.name for opening in made])
    usual = USUAL[kind]
    tall = min(usual["height"], height - usual["sill"] - 0.05)
    doors = [opening for opening in made if opening.kind == "door"]
    for edge, length in enumerate(lengths):
        margin = CORNER if kind == "door" else PIER
        width = usual["width"] if kind == "door" else float(np.clip(0.4 * length, 0.9, 2.0))
        if length < width + 2 * margin:
            continue
        shared = [opening for opening in made if opening.edge == edge]
        taste = 0.2 * rng.random() + (0.6 if kind == "window" and any(d.edge == edge for d in doors) else 0.0)
        if kind == "window" and doors:  # light from the other side than the door
            facing = inward_normal(polygon, edge) @ inward_normal(polygon, doors[0].edge)
            taste += 0.3 * (1 + float(facing)) / 2
        taste += 0.8 * len([o for o in shared if o.kind == kind]) - 0.05 * min(float(length), 6.0)
        places = np.arange(margin, length - width - margin + 1e-9, GRID)
        places = np.unique(np.round([*places, length - width - margin, (length - width) / 2], 3))
        for offset, swing in product(places, SWINGS if kind == "door" else ("in",)):
            near, far = float(offset), float(length - width - offset)
            hinge = "left" if (near <= far) == (signed_area(polygon) > 0) else "right"
            hinge = hinge if kind == "door" else "left"
            one = Opening(name, kind, edge, near, width, tall, usual["sill"], hinge, swing)
            if any(overlap(one, other) > -PIER for other in shared):
                continue
            cost = taste + (0.25 * min(near, far) if kind == "door" else 0.3 * abs(near - far) / length)
            cost += OUTWARDS * (swing == "out")
            free = shapely.Polygon(free_area(polygon, one))
            cost += 3.0 * float(free.difference(outline).area)  # into the next wall of a niche
            cost += 12.0 * sum(
                float(free.intersection(block).area) for block, top in blocks if kind != "window" or top > one.sill
            )
            cost += 2.0 * sum(float(free.intersection(shapely.Polygon(free_area(polygon, o))).area) for o in made)
            if cost < least:
                best, least = one, cost
    return best


def _blocks(boxes: tuple[np.ndarray, np.ndarray, np.ndarray] | None) -> list:
    """(footprint, top) of every box that begins below a door's height."""
    import shapely

    if boxes is None:
        return []
    out = []
    for size, position, plan in zip(*boxes[:2], footprints(*map(np.asarray, boxes)), strict=True):
        if position[1] >= USUAL["door"]["height"] - 0.05:
            continue
        out.append((shapely.Polygon(plan), float(position[1] + size[1])))
    return out
