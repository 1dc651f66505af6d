"""Where objects stand, inside the floor and on something, and which of their meshes run into each other."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from echomodel.boxes2d import axes, footprints
from echomodel.dressing import SMALL
from echomodel.openings import SKIRTING, segment
from echomodel.triangles import along, area_normals, bounds_of, cross, spans_of, spread
from echomodel.vocabulary import vocabulary
from echousd.checks.reading import Reading
from echousd.graph.nodes import HEIGHT
from echousd.place.geometry import SOLID, TOUCH, Collision, Floor, depth_inside, pair_indices, separation
from echousd.room import Found
from echousd.stage.contents import RoomContents, RoomObject, Shape, Surrounding, surroundings
from echousd.stage.labels import known_category
from echousd.stage.read import RoomPrims
from echousd.stage.taxonomy import SHELL

DRESSED = "Dressing"  # name of the group that holds the small things of a room
OUTSIDE = 0.03  # metres beyond the floor's edge
FLOATING = 0.03  # metres of air below, or depth below the floor
HANGING = 0.06  # metres between a ceiling thing and the ceiling
LEANING = 0.15  # metres between a wall thing and its wall
DRAPED = 0.06  # metres of air below cloth that lies over folds
BESIDE = 0.6  # metres that a curtain or a blind may hang beside its window
SCREENS = ("tv", "television")
ACROSS = np.cos(np.radians(60))  # of the angle between a screen and what it stands on
CLOSE = 0.5  # metres before a screen that no wall stands in
LARGE, LITTLE = 4.0, 0.25  # how often as large as its kind a small thing may be: books fill their shelf


@dataclass(frozen=True)
class Misplacement(Found):
    """An object in the wrong place, `distance` in metres.

    `problem` is `outside`, `floating`, `sunk`, `empty` (nothing of it is seen), `turned` (a screen that nobody can look
    at), `off its wall`, `off its window` or `too large` and `too small` for a thing of its kind.
    """

    object: str
    problem: str
    distance: float | None = None


@dataclass(frozen=True, eq=False)
class Whole:
    """A room with all that is in it besides the nodes of its furniture's graph.

    Arguments:
        room: its furniture. small: things of its dressing. shell: what is fixed, but for floors, which carry all of it.
        strangers: other furniture.
    """

    room: RoomContents
    small: tuple[Surrounding, ...] = ()
    shell: tuple[Surrounding, ...] = ()
    strangers: tuple[Surrounding, ...] = ()

    @classmethod
    def of(cls, prims: RoomPrims, reading: Reading) -> "Whole":
        """All of a room on the stage that is read."""
        small, shell, strangers = [], [], []
        for one in surroundings(prims):
            if one.word in SMALL and one.prim.GetParent().GetName() == DRESSED:
                small.append(one)
            elif one.word in SHELL:
                shell += [one] if one.word != "floor" else []
            elif known_category(one.word) is not None:
                strangers.append(one)
        return cls(reading.contents(prims), tuple(small), tuple(shell), tuple(strangers))

    @cached_property
    def polygon(self) -> np.ndarray | None:
        """(k, 2) float, corners of its floor, None without one."""
        return None if self.room.spec is None else self.room.spec.corners

    @cached_property
    def floor(self) -> Floor | None:
        """Its floor."""
        return None if self.polygon is None else Floor(self.polygon)


class Carriers(tuple[Shape, ...]):
    """Things that others may stand on."""

    @cached_property
    def _boxes(self) -> tuple[np.ndarray, ...]:
        """In plan, (n, 2) middles and halves, and (n, 2, 2) from the room's axes to their own."""
        rows = np.array([(*one.position[[0, 2]], *one.size[[0, 2]] / 2, one.yaw) for one in self]).reshape(-1, 5)
        return rows[:, :2], rows[:, 2:4], np.stack(axes(rows[:, 4]), -1)

    def below(self, feet: np.ndarray) -> list[Shape]:
        """Those whose boxes hold one of some points (k, 2) in plan."""
        middle, half, turn = self._boxes
        local = np.abs((feet - middle[:, None]) @ turn)
        return [self[at] for at in np.flatnonzero((local <= half[:, None]).all(2).any(1))]


def find_misplaced(whole: Whole) -> tuple[Misplacement, ...]:
    """All that stands, hangs or looks where it should not; nothing in a room without furniture."""
    if not whole.room.objects:
        return ()
    return (*_furniture(whole), *_screens(whole), *_dressing(whole))


def _furniture(whole: Whole) -> Iterator[Misplacement]:
    """Objects that are outside the floor, float, sink into it, or have no geometry where others have."""
    room, floor = whole.room, whole.floor
    yield from (Misplacement(name, "empty") for name in room.missing)
    ceiling = HEIGHT if room.spec is None else room.spec.tall
    carriers = Carriers(room.objects)
    height = max([ceiling, *(float(thing.position[1] + thing.size[1]) for thing in room.objects)])
    for thing in room.objects:
        beyond = -np.inf if floor is None else _beyond(thing, floor)
        if beyond > OUTSIDE:
            yield Misplacement(thing.name, "outside", beyond)
        bottom = float(thing.position[1])
        if bottom < -FLOATING:
            yield Misplacement(thing.name, "sunk", -bottom)
        elif not thing.node.obstacle:  # such are held by what only their own stage knows
            air = _air_below(thing, carriers)
            if air > FLOATING and not _held(thing, floor, height):
                yield Misplacement(thing.name, "floating", air)


def _screens(whole: Whole) -> Iterator[Misplacement]:
    """Screens that look at a wall, or across what they stand on."""
    objects, floor = whole.room.objects, whole.floor
    screens: list[tuple[str, Shape]] = [(one.name, one) for one in objects if one.node.category in SCREENS]
    screens += [(one.name, one.shape) for one in whole.small if one.word in SCREENS and one.shape is not None]
    for name, screen in screens:
        front = axes(screen.yaw)[1]
        before = screen.position[[0, 2]] + front * (screen.size[2] / 2 + CLOSE)
        below = [one for one in objects if one is not screen and _carries(one, screen)]
        across = any(np.cos(one.yaw - screen.yaw) < ACROSS for one in below)
        if across or (floor is not None and float(depth_inside(floor, before[None])[0]) < 0):
            yield Misplacement(name, "turned")


def _carries(one: Shape, thing: Shape, hung: bool = False) -> bool:
    """Whether a thing stands on the top of another, or hangs from it."""
    local = np.abs((thing.position[[0, 2]] - one.position[[0, 2]]) @ np.stack(axes(one.yaw), 1))
    over = float(one.position[1] + one.size[1] - thing.position[1])
    held = over >= thing.size[1] if hung else abs(over) < FLOATING
    return held and bool((local <= one.size[[0, 2]] / 2).all())


def _dressing(whole: Whole) -> Iterator[Misplacement]:
    """Small things that are outside the floor, in the air, off their wall or window, hidden or of no usual size."""
    if whole.floor is None:
        return
    small, shell = ([one.shape for one in found if one.shape is not None] for found in (whole.small, whole.shell))
    carriers, windows = Carriers([*whole.room.objects, *small, *shell]), _windows(whole)  # sills carry things, too
    for one in whole.small:
        yield from (Misplacement(one.name, *why) for why in _small_faults(one, whole.floor, carriers, windows, shell))


def _small_faults(
    one: Surrounding, floor: Floor, carriers: Carriers, windows: np.ndarray, shell: Sequence[Shape] = ()
) -> Iterator[tuple[str, float | None]]:
    kind, shape = SMALL[one.word], one.shape
    if shape is None:
        yield "empty", None
        return
    times = float((shape.size / np.array(kind.high)).max())
    if times > LARGE:
        yield "too large", float(shape.size.max())
    elif float((shape.size / np.array(kind.low)).max()) < LITTLE:
        yield "too small", float(shape.size.max())
    beyond = _beyond(shape, floor)
    if beyond > OUTSIDE and not _recessed(shape, beyond, shell):
        yield "outside", beyond
        return
    bottom = float(shape.position[1])
    if bottom < -FLOATING:
        yield "sunk", -bottom
        return
    if kind.fixed and not kind.lies:
        front = axes(shape.yaw)[1]
        back = shape.position[[0, 2]] - front * shape.size[2] / 2
        off = float(depth_inside(floor, back[None])[0])
        racks = [carrier for carrier in carriers if isinstance(carrier, RoomObject)]
        if off > LEANING and not any(_carries(rack, shape, hung=True) for rack in racks):
            yield "off its wall", off
        elif one.word in ("curtain", "blind") and len(windows):
            beside = _beside(shape, windows)
            if beside > BESIDE:
                yield "off its window", beside
        return
    air = _air_below(shape, carriers, draped=kind.lies)
    if air > (DRAPED if kind.lies else FLOATING):
        yield "floating", air


def _recessed(shape: Shape, beyond: float, shell: Sequence[Shape]) -> bool:
    """Whether a thing that reaches beyond the floor stands in a recess: no deeper than walls, and inside none."""
    within = 0.98 * shape.points + 0.02 * shape.points.mean(0)
    return beyond < LEANING and bool(shell) and not any(inside_solid(within, wall)[0].any() for wall in shell)


def _windows(whole: Whole) -> np.ndarray:
    """(n, 2, 2) float: both ends of every window, in plan."""
    openings = () if whole.room.spec is None or whole.polygon is None else whole.room.spec.openings
    return np.array([segment(whole.polygon, one) for one in openings if one.kind == "window"]).reshape(-1, 2, 2)


def _beside(shape: Shape, windows: np.ndarray) -> float:
    """Metres in plan between the middle of a thing and the nearest window."""
    start, along = windows[:, 0], windows[:, 1] - windows[:, 0]
    away = shape.position[[0, 2]] - start
    share = np.clip((away * along).sum(1) / np.maximum((along**2).sum(1), 1e-9), 0, 1)
    return float(np.linalg.norm(away - share[:, None] * along, axis=1).min())


def _beyond(thing: Shape, floor: Floor) -> float:
    points = thing.points[:, [0, 2]] if len(thing.points) else _footprint(thing)
    return float(-depth_inside(floor, points).min())


def _footprint(thing: Shape) -> np.ndarray:
    return footprints(thing.size[None], thing.position[None], np.array([thing.yaw]))[0]


def _air_below(thing: Shape, others: Carriers, *, draped: bool = False) -> float:
    """Height of the bottom over the floor or over the nearest surface below the middle or a corner of the object.

    `draped`: it hangs lower than it lies, and counts from where it lies there. What is pressed into a seat has no air.
    """
    feet = np.concatenate((thing.position[None, [0, 2]], 0.5 * (_footprint(thing) + thing.position[[0, 2]])))
    bottom = _surface_gap(feet, 0.0, thing) if draped and len(thing.points) else float(thing.position[1])
    air = abs(bottom)
    for other in (other for other in others.below(feet) if other is not thing):
        air = min(air, abs(bottom - float(other.position[1] + other.size[1])))
        # Things stand on shelves and seats, below the top of the whole box.
        if len(other.points):
            air = min(air, _surface_gap(feet, bottom, other))
    return air


def _surface_gap(feet: np.ndarray, bottom: float, other: Shape) -> float:
    low, high = other.spans[:, :, [0, 2]]
    best = np.inf
    for foot in feet:
        above = ((low <= foot) & (foot <= high)).all(1)
        if above.any():
            best = min(best, float(np.abs(bottom - other.triangles[above, :, 1] + PRESSED / 2).min()) - PRESSED / 2)
    return best


def _held(thing: RoomObject, floor: Floor | None, height: float) -> bool:
    row = vocabulary().category(thing.node.category)
    top = float(thing.position[1] + thing.size[1])
    if row.support == "ceiling":
        return height - top <= HANGING
    if row.support == "wall" or row.hangs:
        return floor is None or float(depth_inside(floor, _footprint(thing)).min()) <= LEANING
    return False


IN_WALL = SKIRTING + 0.003  # metres: furniture stands at the wall behind its skirting
PRESSED = 0.04  # metres: cushions and blankets press into what they lie on
NEAR = 0.05  # metres between two boxes that are one
SAMPLES = 600  # points per surface and pair
PAIRS = 20_000  # of points and triangles that are compared in one go, which stay in the cache


def find_collisions(whole: Whole) -> tuple[Collision, ...]:
    """All pairs whose meshes reach into each other, deepest first; boxes may: a chair stands under its table."""
    strangers, little, fixed = (
        [(one.name, one.shape) for one in part if one.shape is not None]
        for part in (whole.strangers, whole.small, whole.shell)
    )
    things: list[tuple[str, Shape]] = [*((one.name, one) for one in whole.room.objects), *strangers]
    found = _hits(things, None, SOLID) + _hits(things, fixed, IN_WALL)
    found += _hits(things, little, PRESSED) + _hits(little, None, IN_WALL)
    return tuple(sorted(found, key=lambda hit: -hit.depth))


def _hits(
    first: Sequence[tuple[str, Shape]], second: Sequence[tuple[str, Shape]] | None, deep: float
) -> list[Collision]:
    """Pairs of the first and the second, or of the first alone, that reach further than `deep` into each other."""
    things = [*first, *(second or ())]
    if second is None:
        pairs = pair_indices(len(first))
    else:
        pairs = np.stack(np.meshgrid(np.arange(len(first)), len(first) + np.arange(len(second)), indexing="ij"), -1)
        pairs = pairs.reshape(-1, 2)
    if not len(pairs):
        return []
    size, position = np.array([one.size for _, one in things]), np.array([one.position for _, one in things])
    overlap = -separation(size, position, np.array([one.yaw for _, one in things]), pairs)
    found = []
    for (i, j), depth in zip(pairs[overlap > TOUCH].tolist(), overlap[overlap > TOUCH], strict=True):
        one, other = things[i][1], things[j][1]
        if len(one.faces) and len(other.faces):
            reach = max(mesh_depth(one, other, deep), depth if _one_place(one, other) else 0.0)
        else:
            reach = depth if second is None else 0.0
        if reach > deep:
            found.append(Collision(things[i][0], things[j][0], float(reach)))
    return found


def _one_place(one: Shape, other: Shape) -> bool:
    """Whether two things fill one box: surfaces that are the same reach nowhere into one another."""
    near = np.abs(one.position - other.position).max() < NEAR
    return bool(near and np.abs(one.size - other.size).max() < NEAR)


def mesh_depth(first: Shape, second: Shape, deep: float = SOLID) -> float:
    """How deep one surface reaches into the other solid in metres, no more than `deep` where that is not deeper."""
    return max(_reach(first, second, deep), _reach(second, first, deep))


def distances(point: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(f,) from a point (3,), or of each its own (f, 1, 3), to the triangles (f, 3, 3)."""
    corner, side = triangles - point, np.roll(triangles, -1, axis=1) - triangles
    share = -(corner * side).sum(2) / np.maximum((side**2).sum(2), 1e-30)
    out = np.linalg.norm(corner + np.clip(share, 0, 1)[..., None] * side, axis=2).min(1)  # to their edges
    normal = area_normals(triangles)
    length = np.linalg.norm(normal, axis=1)
    over = (length > 0) & ((cross(corner, side) * normal[:, None]).sum(2) >= 0).all(1)
    return np.where(over, np.abs((corner[:, 0] * normal).sum(1)) / np.maximum(length, 1e-30), out)


def _reach(surface: Shape, solid: Shape, deep: float) -> float:
    points = surface_points(surface, solid)
    within, at_most = inside_solid(points, solid, deep)
    points, at_most = points[within & (at_most > deep)], at_most[within & (at_most > deep)]
    if not len(points):
        return 0.0
    triangles, (low, high) = solid.triangles, solid.spans.transpose(0, 2, 1)[:, :, None]
    skin = np.concatenate((solid.points, _scatter(solid.points, solid.faces, 4000))).T
    deepest = 0.0
    # A sample of the skin is further away than the skin itself: deepest first, until no point can be deeper.
    ways = (skin - point[:, None] for point in points)
    at_most = np.minimum(at_most, np.sqrt([along(way, way).min() for way in ways]))
    order, step = np.argsort(-at_most), max(1, PAIRS // len(triangles))
    for some in (order[start : start + step] for start in range(0, len(order), step)):
        if at_most[some[0]] <= max(deepest, deep):
            break
        point, away = points[some].T[..., None], at_most[some]
        way = np.maximum(np.maximum(low - point, point - high), 0.0)  # to the boxes around the triangles
        number, face = np.nonzero(along(way, way) <= (away[:, None] + 1e-9) ** 2)
        np.minimum.at(away, number, distances(points[some[number], None], triangles[face]))
        deepest = max(deepest, float(away.max()))
    return deepest


def surface_points(surface: Shape, solid: Shape) -> np.ndarray:
    """(s, 3) float: vertices and scattered points of a surface that lie in the other object's box."""
    near = surface.faces[_touches(surface.triangles, solid)]
    if not len(near):
        return np.zeros((0, 3))
    points = np.concatenate((surface.points[near].reshape(-1, 3), _scatter(surface.points, near, 4 * SAMPLES)))
    points = points[(np.abs(_local(points, solid)) <= solid.size / 2).all(-1)]
    if len(points) <= SAMPLES:
        return points
    return points[np.random.default_rng(0).choice(len(points), SAMPLES, replace=False)]


def _scatter(points: np.ndarray, faces: np.ndarray, count: int) -> np.ndarray:
    """(count, 3) points of the triangles, as many everywhere; none of what has no area."""
    triangles = points[faces]
    return spread(triangles, count)[0] if area_normals(triangles).any() else np.zeros((0, 3))


def _local(points: np.ndarray, solid: Shape) -> np.ndarray:
    u = np.stack(axes(solid.yaw))
    offset = points - solid.position
    plan = offset[..., [0, 2]] @ u.T
    return np.stack((plan[..., 0], offset[..., 1] - solid.size[1] / 2, plan[..., 1]), -1)


def _touches(triangles: np.ndarray, solid: Shape) -> np.ndarray:
    low, high = spans_of(_local(triangles, solid))
    return np.asarray(((low <= solid.size / 2) & (high >= -solid.size / 2)).all(-1))


def inside_solid(points: np.ndarray, solid: Shape, deep: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """(s,) bool: whether points (s, 3) are inside a solid, of those that may be deeper; (s,) float: how deep at most.

    Around its closed pieces nothing turns but within their boxes, so that most points are compared with few triangles;
    from within a piece the way out of its box meets its surface.
    """
    low, high = bounds_of(solid.points)
    at_most = np.full(len(points), np.inf)
    inside = ((points >= low) & (points <= high)).all(1)
    if not inside.any():
        return inside, at_most
    loose, closed = solid.pieces
    turns = winding_number(points, loose) if len(loose) else np.zeros(len(points))
    (low, high), planes = solid.closed_spans.transpose(0, 2, 1)[..., None], points.T[:, None].copy()
    out = np.minimum(planes - low, high - planes).min(0)  # (k, s) of the boxes around the pieces
    for number in np.flatnonzero((out >= deep).any(1)).tolist():
        some = np.flatnonzero(out[number] >= deep)
        turn = winding_number(points[some], closed[number])
        turns[some] += turn
        at_most[some] = np.minimum(at_most[some], np.where(turn > 0.5, out[number, some], np.inf))
    return turns > 0.5, at_most


def winding_number(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(s,) float: generalised winding number of a soup of triangles (f, 3, 3) around points (s, 3), 1 inside, 0
    outside (Jacobson 2013)."""
    out = np.zeros(len(points))
    step = max(1, PAIRS // max(len(triangles), 1))
    corners, places = (np.moveaxis(values.astype(np.float32), 0, -1).copy() for values in (triangles, points))
    for start in range(0, len(points), step):  # each number of all pairs lies in one plane
        some = slice(start, start + step)
        a, b, c = corners[:, :, None] - places[:, some, None]
        la, lb, lc = (np.sqrt(along(v, v)) for v in (a, b, c))
        triple = along(a, (b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]))
        below = la * lb * lc + along(a, b) * lc + along(b, c) * la + along(c, a) * lb
        out[some] = np.arctan2(triple, below).sum(-1) / (2 * np.pi)
    return out
