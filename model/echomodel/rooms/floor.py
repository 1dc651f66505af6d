"""Floors: a rectangle with corners cut away, its walls, doors and windows."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from echomodel.boxes2d import CORNERS
from echomodel.openings import WINDOWS, Opening, numbered, overlap, zone
from echomodel.rooms.statistics import RoomTypeStatistics
from echomodel.sizes import quantile
from echomodel.vocabulary import vocabulary

Rectangle = tuple[float, float, float, float]  # x0, z0, x1, z1
SHARED_JAMB = 0.1  # metres of wall between two openings
OUTWARDS, PASSAGES = 0.15, 0.12  # shares of the doors that open out of the room, and that have no leaf
OVER_SILL = 0.28  # metres; what is higher does not stand before a window
FRENCH = 0.15  # share of the windows that reach down to the floor
ARM = 0.3  # share of the larger rooms' outlines that have a corridor as an arm
CORRIDOR = 1.0  # what a cut must leave of a side


@dataclass(frozen=True)
class Wall:
    """A straight wall: start (x, z), unit direction, length, and the yaw of something that stands with its back to it.

    The inward normal is (sin yaw, cos yaw); `edge` is the number of the polygon's corner at its start.
    """

    x: float
    z: float
    dx: float
    dz: float
    length: float
    yaw: float
    edge: int

    def point(self, along: float, away: float) -> tuple[float, float]:
        """The point `along` metres from the start and `away` metres into the room."""
        return (
            self.x + self.dx * along + math.sin(self.yaw) * away,
            self.z + self.dz * along + math.cos(self.yaw) * away,
        )


@dataclass(frozen=True)
class Floor:
    """Half extents of the bounding rectangle (centred at the origin), the corners cut away, walls and openings.

    Arguments:
        half_x, half_z: metres.
        cuts: rectangles outside the room.
        walls: the sides of the polygon.
        openings: doors, passages and windows.
        doors: rectangles that must stay free.
        windows: rectangles before which nothing may stand that is higher than the number behind each, metres.
        height: metres.
    """

    half_x: float
    half_z: float
    polygon: tuple[tuple[float, float], ...]
    height: float
    cuts: tuple[Rectangle, ...] = ()
    walls: tuple[Wall, ...] = ()
    openings: tuple[Opening, ...] = ()
    doors: tuple[Rectangle, ...] = ()
    windows: tuple[tuple[Rectangle, float], ...] = ()
    area: float = field(default=0.0)

    @property
    def in_the_way(self) -> tuple[tuple[np.ndarray, float, float, bool], ...]:
        """What fitted units keep clear of (`echomodel.rooms.runs.Site`)."""
        rows = [(rectangle, 0.0, False) for rectangle in self.doors]
        rows += [(rectangle, top, True) for rectangle, top in self.windows]
        return tuple(
            (np.array([(x0, z0), (x1, z0), (x1, z1), (x0, z1)]), bottom, math.inf, glass)
            for (x0, z0, x1, z1), bottom, glass in rows
        )

    def holds(self, x0: float, z0: float, x1: float, z1: float, play: float = 0.04) -> bool:
        """Whether a rectangle lies on the floor, up to `play` metres."""
        if x0 < -self.half_x - play or x1 > self.half_x + play or z0 < -self.half_z - play or z1 > self.half_z + play:
            return False
        return not any(
            x0 < c[2] - play and x1 > c[0] + play and z0 < c[3] - play and z1 > c[1] + play for c in self.cuts
        )

    def opposite(self, wall: Wall, along: float) -> float:
        """Distance from a point of a wall straight across the room, metres, inf where no wall is met."""
        x, z = wall.point(along, 0.0)
        nx, nz = math.sin(wall.yaw), math.cos(wall.yaw)
        best = math.inf
        for other in self.walls:
            if math.cos(other.yaw - wall.yaw) > -0.5:
                continue
            distance = (other.x - x) * nx + (other.z - z) * nz
            reach = (x - other.x) * other.dx + (z - other.z) * other.dz
            if 0.1 < distance < best and -1e-6 <= reach <= other.length + 1e-6:
                best = distance
        return best


def cut_rectangle(half_x: float, half_z: float, cuts: Sequence[Sequence[float]]) -> tuple[tuple[float, float], ...]:
    """The corners of such a floor that has a piece of this width and depth cut from each corner, (0, 0) = none."""
    points: list[tuple[float, float]] = []
    for (sx, sz), (width, depth) in zip(CORNERS, cuts, strict=True):
        x, z, inner_x, inner_z = sx * half_x, sz * half_z, sx * (half_x - width), sz * (half_z - depth)
        step = [(inner_x, z), (inner_x, inner_z), (x, inner_z)] if width else [(x, z)]
        points += step if sx == -sz else step[::-1]
    return tuple(points)


def sample_floor(statistics: RoomTypeStatistics, rng: np.random.Generator) -> Floor:
    """Draw the floor of a room of the given kind: extents, cut corners, height, one or two doors, a window."""
    target = math.log(quantile(statistics.area, rng.standard_normal()))
    rectangular = rng.random() < statistics.rectangular
    best, half_x, half_z, sizes = math.inf, 0.0, 0.0, [(0.0, 0.0)] * 4
    for _ in range(5):  # of several outlines, the one whose area is nearest to the drawn one
        short = round(quantile(statistics.short, rng.standard_normal()) / 2, 2)
        long = max(round(quantile(statistics.long, rng.standard_normal()) / 2, 2), short)
        x, z = (long, short) if rng.random() < 0.45 else (short, long)
        cuts = [(0.0, 0.0)] * 4 if rectangular else _cuts(x, z, statistics.cuts, rng)
        area = 4 * x * z - sum(w * d for w, d in cuts)
        if abs(math.log(area) - target) < best:
            best, half_x, half_z, sizes = abs(math.log(area) - target), x, z, cuts
    polygon = cut_rectangle(half_x, half_z, sizes)
    removed = tuple(
        _cut(half_x, half_z, sx, sz, *size) for (sx, sz), size in zip(CORNERS, sizes, strict=True) if size[0]
    )
    walls = walls_of(polygon)
    area = 4 * half_x * half_z - sum(w * d for w, d in sizes)
    height = float(np.round(quantile(statistics.height, rng.standard_normal()), 2))
    openings: list[Opening] = []
    for _ in range(1 + (area > 18) + (area > 30)):
        _open(openings, "passage" if openings and rng.random() < PASSAGES else "door", walls, height, rng)
    for _ in range(1 + (area > 25)):
        _open(openings, "window", walls, height, rng, vocabulary().room_type(statistics.name).use)
    before = {o: zone(polygon, o, o.depth) for o in openings}
    free = {o: (*area.min(0).tolist(), *area.max(0).tolist()) for o, area in before.items()}
    return Floor(
        half_x, half_z, polygon, height, removed, walls, tuple(openings),
        tuple(free[o] for o in openings if o.kind != "window"),
        tuple((free[o], o.sill + OVER_SILL) for o in openings if o.kind == "window"), area,
    )  # fmt: skip


def _cuts(half_x: float, half_z: float, counts: tuple[float, ...], rng: np.random.Generator) -> list:
    """Width and depth of the piece cut from each corner, (0, 0) where none is."""
    sizes = [(0.0, 0.0)] * 4
    if counts[0] < 0.5 and rng.random() < ARM:
        return _arm(half_x, half_z, rng)
    number = 1 + int(np.searchsorted(np.cumsum(counts), rng.random()))
    for corner in rng.permutation(4)[:number]:
        sx, sz = CORNERS[corner]
        along_x = next(i for i, c in enumerate(CORNERS) if c == (-sx, sz))
        along_z = next(i for i, c in enumerate(CORNERS) if c == (sx, -sz))
        room_x = 2 * half_x - sizes[along_x][0] - CORRIDOR
        room_z = 2 * half_z - sizes[along_z][1] - CORRIDOR
        if rng.random() < 0.3:
            width, depth = rng.uniform(0.1, 0.6), rng.uniform(0.1, 0.6)
        else:
            width, depth = 2 * half_x * rng.uniform(0.15, 0.65), 2 * half_z * rng.uniform(0.12, 0.55)
        opposite = sizes[(corner + 2) % 4]
        overlap = width + opposite[0] > 2 * half_x - CORRIDOR and depth + opposite[1] > 2 * half_z - CORRIDOR
        if width < room_x and depth < room_z and not overlap:
            sizes[corner] = (round(width, 2), round(depth, 2))
    return sizes


def _arm(half_x: float, half_z: float, rng: np.random.Generator) -> list:
    """Cut both corners of one side, so that a corridor of it stays."""
    along_x = rng.random() < 0.5
    side, across = (2 * half_z, 2 * half_x) if along_x else (2 * half_x, 2 * half_z)
    deep = round(across * rng.uniform(0.12, 0.4), 2)
    corridor = rng.uniform(CORRIDOR, 1.7)
    first = round((side - corridor) * rng.random(), 2)
    second = round(side - corridor - first, 2)
    pieces = {1.0: (first if first > 0.3 else 0.0), -1.0: (second if second > 0.3 else 0.0)}
    sign = 1 if rng.random() < 0.5 else -1
    sizes = [(0.0, 0.0)] * 4
    for k, (sx, sz) in enumerate(CORNERS):
        if along_x and sx == sign and pieces[sz]:
            sizes[k] = (deep, pieces[sz])
        elif not along_x and sz == sign and pieces[sx]:
            sizes[k] = (pieces[sx], deep)
    return sizes


def _cut(half_x: float, half_z: float, sx: float, sz: float, width: float, depth: float) -> Rectangle:
    x = sorted((sx * half_x, sx * (half_x - width)))
    z = sorted((sz * half_z, sz * (half_z - depth)))
    # What is cut away reaches outwards, so that furniture cannot slip through a thin gap behind it.
    return (x[0] - (sx < 0), z[0] - (sz < 0), x[1] + (sx > 0), z[1] + (sz > 0))


def walls_of(polygon: tuple[tuple[float, float], ...]) -> tuple[Wall, ...]:
    """The sides of an outline, whose inside lies where its turn goes."""
    walls = []
    for edge, ((x0, z0), (x1, z1)) in enumerate(zip(polygon, (*polygon[1:], polygon[0]), strict=True)):
        length = math.hypot(x1 - x0, z1 - z0)
        if length < 1e-6:
            continue
        dx, dz = (x1 - x0) / length, (z1 - z0) / length
        walls.append(Wall(x0, z0, dx, dz, length, math.atan2(-dz, dx), edge))  # inside is where the turn goes
    return tuple(walls)


def _open(
    openings: list[Opening], kind: str, walls: tuple[Wall, ...], height: float, rng: np.random.Generator, use: str = ""
) -> None:
    """Add a door, passage or window at a random free place, or nothing where no wall is long enough."""
    width = {"door": rng.uniform(0.8, 1.0), "passage": rng.uniform(0.9, 1.6), "window": rng.uniform(1.0, 2.0)}[kind]
    sill, top = 0.0, 2.0 if kind == "door" else 2.1
    if kind == "window":
        top = rng.uniform(2.0, 2.3)
        sill = 0.0 if rng.random() < FRENCH else rng.uniform(0.8, 1.0)
        sill = WINDOWS[use][0] if use == "wet" else sill
    width, sill, top = round(width, 2), round(sill, 2), round(min(top, height - 0.1), 2)
    hinge, swing = ("left", "right")[rng.integers(2)], "out" if rng.random() < OUTWARDS else "in"
    fits = [wall for wall in walls if wall.length > width + 0.1]
    if not fits:
        return
    weights = np.cumsum([wall.length for wall in fits])
    for _ in range(6):
        wall = fits[int(np.searchsorted(weights, rng.random() * weights[-1]))]
        free = wall.length - width
        # Doors and windows like the end of a wall.
        start = free * rng.random() if rng.random() < 0.25 else (0.08 if rng.random() < 0.5 else free - 0.08)
        name = numbered(kind, [other.name for other in openings])
        one = Opening(name, kind, wall.edge, round(start, 3), width, round(top - sill, 2), sill, hinge, swing)
        if all(overlap(one, other) < -SHARED_JAMB for other in openings if other.edge == one.edge):
            openings.append(one)
            return
