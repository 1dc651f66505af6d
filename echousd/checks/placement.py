"""Where objects stand, inside the floor and on something, and which of their meshes run into each other."""

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from echomodel.boxes2d import axes, footprints
from echomodel.dressing import SMALL
from echomodel.openings import segment
from echomodel.vocabulary import vocabulary
from echousd.checks.reading import Reading
from echousd.graph.nodes import HEIGHT
from echousd.make.collisions import hits, inside_solid
from echousd.place.geometry import IN_WALL, SOLID, Collision, Floor, depth_inside, pair_indices
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
    """All that stands, hangs or looks where it should not; nothing in a room without furniture, of which it warns."""
    if not whole.room.objects:
        if whole.room.missing:
            warnings.warn(f"<{whole.room.path}>: no object has geometry yet; its graph alone is checked", stacklevel=2)
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


PRESSED = 0.04  # metres: cushions and blankets press into what they lie on


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
    every = pair_indices(len(things))
    pairs = every if second is None else every[(every[:, 0] < len(first)) & (every[:, 1] >= len(first))]
    return hits(things, pairs, deep, boxes=second is None)
