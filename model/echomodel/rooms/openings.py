"""Doors and windows that nobody stated: where in the walls of a floor they go, before or after it is furnished."""

from collections.abc import Sequence
from itertools import product

import numpy as np
import shapely

from echomodel.boxes2d import footprints
from echomodel.openings import USUAL, WINDOWS, Opening, edge_lengths, free_area, inward_normal, numbered, signed_area

GRID = 0.1  # metres between the places that are tried for an opening
CORNER = 0.1  # metres from a corner to a door
OUTWARDS = 0.7  # what a door that swings out of the room must save; rooms' doors open inwards
PIER = 0.3  # metres of wall between a window and a corner or another opening
SECOND_WINDOW, SECOND_DOOR = 16.0, 30.0  # square metres of floor
NARROWEST, SLIGHT = 0.5, 0.4  # metres, of a window, and as low; what one costs that is half as wide as usual


def place_openings(
    polygon: np.ndarray, height: float, rng: np.random.Generator, *,
    boxes: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None, stated: Sequence[Opening] = (), use: str = "",
    spans: Sequence[tuple[int, float, float]] | None = None,
) -> tuple[Opening, ...]:  # fmt: skip
    """A door and one or two windows (two doors in halls), each where least stands in its way.

    Doors like the end of a wall with the hinges at the corner, windows the middle of another wall.

    Arguments:
        polygon: (k, 2) float, corners (x, z) of the floor, metres.
        height: of the room, metres.
        rng: decides between places that are equally good.
        boxes: size (n, 3), position (n, 3) of the bottom centre and yaw (n,) of what stands in the room.
        stated: openings that are there, which come first in what is returned; doors among them are all that there are,
            windows likewise.
        use: of the room, one of `WINDOWS`.
        spans: edge, and from where to where along it, metres, of walls that windows may be in; None = in all.
    """
    area, made = abs(signed_area(polygon)), list(stated)
    for kind, count in (("door", 1 + (area > SECOND_DOOR)), ("window", 1 + (area > SECOND_WINDOW))):
        for _ in range(count if not stated or (kind == "window" and kind not in {o.kind for o in stated}) else 0):
            best = _best(kind, polygon, height, rng, made, boxes, use, spans if kind == "window" else None)
            if best is not None:
                made.append(best)
    return tuple(made)


def _best(
    kind: str, polygon: np.ndarray, height: float, rng: np.random.Generator, made: Sequence[Opening],
    boxes: tuple[np.ndarray, np.ndarray, np.ndarray] | None, use: str,
    spans: Sequence[tuple[int, float, float]] | None,
) -> Opening | None:  # fmt: skip
    """The place of least cost among a grid of places on walls, or some spans; None where no wall is large enough."""
    lengths, spare = edge_lengths(polygon), spans is not None and any(one.kind == kind for one in made)
    name = numbered(kind, [opening.name for opening in made])
    sill, tall, wide = WINDOWS[use] if kind == "window" else (0.0, USUAL[kind]["height"], USUAL[kind]["width"])
    tall = min(tall, height - sill - 0.05)
    doors = [opening for opening in made if opening.kind == "door"]
    turned = signed_area(polygon) > 0
    places: list[tuple[int, float, float, str, str]] = []  # edge, offset, width, hinge and swing
    tastes: list[float] = []
    step = GRID if boxes is not None and len(boxes[0]) else 3 * GRID
    for edge, low, high in [(edge, 0.0, np.inf) for edge in range(len(lengths))] if spans is None else spans:
        margin, length = CORNER if kind == "door" else PIER, lengths[edge]
        most = min(high, length) - low - 2 * margin
        widths = [wide] if kind == "door" else [round(float(np.clip(0.4 * (most + 2 * margin), 0.9, wide)), 4)]
        if spans is not None:
            widths = [max(min(widths[0] * share, most), NARROWEST) for share in (1.0, 0.5)]
        if most < widths[-1] or tall < NARROWEST:
            continue
        shared = [opening for opening in made if opening.edge == edge]
        taste = 0.2 * rng.random() + (0.6 if kind == "window" and any(d.edge == edge for d in doors) else 0.0)
        if kind == "window" and doors:  # light from the other side than the door
            facing = inward_normal(polygon, edge) @ inward_normal(polygon, doors[0].edge)
            taste += 0.3 * (1 + float(facing)) / 2
        taste += 0.8 * len([o for o in shared if o.kind == kind]) - 0.05 * min(float(length), 6.0)
        found = [(width, near) for width in widths for near in places_along(low + margin, most, width, step).tolist()]
        for (width, near), swing in product(found, ("in", "out") if kind == "door" else ("in",)):
            far = float(length - width - near)
            hinge = "left" if kind != "door" or (near <= far) == turned else "right"
            if any(min(near + width, other.end) - max(near, other.offset) > -PIER for other in shared):
                continue
            places.append((edge, near, width, hinge, swing))
            cost = 0.25 * min(near, far) if kind == "door" else 0.3 * abs(near - far) / length
            tastes.append(taste + cost + OUTWARDS * (swing == "out") + SLIGHT * (width < widths[0]))
    room = shapely.Polygon(polygon).buffer(1e-6)
    blocks = shapely.STRtree(_blocks(boxes, sill if kind == "window" else -np.inf))
    others = [shapely.Polygon(free_area(polygon, other)) for other in made]
    chosen: Opening | None = None
    best, least = len(places), np.inf
    for number in np.argsort(tastes, kind="stable").tolist():
        if tastes[number] > least:  # what stands in the way of the others only makes them dearer
            break
        edge, offset, width, hinge, swing = places[number]
        one = Opening(name, kind, edge, offset, width, tall, sill, hinge, swing)
        free = shapely.Polygon(free_area(polygon, one))
        cost = tastes[number] + 3.0 * shapely.area(shapely.difference(free, room))  # into the next wall of a niche
        for block in blocks.geometries[np.sort(blocks.query(free, "intersects"))]:
            cost += 12.0 * shapely.area(shapely.intersection(free, block))
        for other in others:
            cost += 2.0 * shapely.area(shapely.intersection(free, other))
        if (cost, number) < (least, best) and not (spare and cost > tastes[number] + SLIGHT):
            chosen, best, least = one, number, cost
    return chosen


def places_along(low: float, span: float, width: float, step: float) -> np.ndarray:
    """Offsets of a hole in a span of wall that begins at `low`, metres: every step, both ends and the middle."""
    last = low + span - width
    found = [*np.arange(low, last + 1e-9, step), last, (low + last) / 2]
    return np.unique(np.round(found if last > low - 1e-6 else [], 3))


def _blocks(boxes: tuple[np.ndarray, np.ndarray, np.ndarray] | None, above: float) -> np.ndarray:
    """The footprints of the boxes that begin below a door's height and end above another one, metres."""
    if boxes is None:
        return np.array([])
    size, position, yaw = map(np.asarray, boxes)
    low = position[:, 1] < USUAL["door"]["height"] - 0.05
    return np.asarray(shapely.polygons(footprints(size, position, yaw)[low & (position[:, 1] + size[:, 1] > above)]))
