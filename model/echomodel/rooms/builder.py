"""A room under construction: boxes placed so far, and where the next one may stand."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from echomodel.boxes2d import reach, to_frame
from echomodel.furniture.drawn import sample_size
from echomodel.objective.access import INTO_BED, OF_CHAIRS, OF_LAMPS
from echomodel.rooms.floor import Floor, Wall
from echomodel.rooms.statistics import QUARTILE, room_requests
from echomodel.sizes import back_gaps, size_statistics
from echomodel.vocabulary import vocabulary

HALF_PI = math.pi / 2
Size = tuple[float, float, float]
SMALLEST, LARGEST = 0.55, 1.15  # times the 5th and 95th percentile of the class
BODY = 1.8  # metres that a free zone is high
SUNK, FAR_BACK = -0.02, 0.12  # metres, ends of what a gap behind furniture at a wall is drawn from


@dataclass(slots=True)
class Item:
    """One box: position of its bottom centre, half extents of its axis-aligned hull in plan, and its style."""

    category: str
    size: Size
    x: float
    y: float
    z: float
    yaw: float
    style: int = -1
    hull_x: float = 0.0
    hull_z: float = 0.0

    def __post_init__(self) -> None:
        c, s = abs(math.cos(self.yaw)), abs(math.sin(self.yaw))
        self.hull_x, self.hull_z = reach(self.size[0] / 2, self.size[2] / 2, c, s)

    @property
    def turned(self) -> bool:
        """Whether the item stands askew to the axes."""
        return min(abs(math.cos(self.yaw)), abs(math.sin(self.yaw))) > 0.03

    def local(self, lateral: float, forward: float) -> tuple[float, float]:
        """The point `lateral` metres to its +x side and `forward` metres before it."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return self.x + c * lateral + s * forward, self.z - s * lateral + c * forward

    def seen(self, x: float, z: float) -> tuple[float, float]:
        """How far to its +x side and how far before it a point lies; the inverse of `local`."""
        return to_frame(x - self.x, z - self.z, math.cos(self.yaw), math.sin(self.yaw))


class Builder:
    """Places boxes on a floor. Methods return what they placed, or None where nothing fits.

    Arguments:
        floor: the empty room.
        rng: source of every draw.
        styles: number of style groups of the shape set that the rooms refer to.
    """

    def __init__(self, floor: Floor, rng: np.random.Generator, styles: int) -> None:
        self.floor = floor
        self.rng = rng
        self.styles = styles
        self.room_style = int(rng.integers(styles))
        self.items: list[Item] = []
        self.zones: list[tuple[Item, Item]] = []  # what stays free, and whose it is
        self.wanted: dict[str, int] = {}
        self.lost = False  # what the room is for found no place

    # -- draws ---------------------------------------------------------------------------------------------------

    def chance(self, share: float) -> bool:
        return self.rng.random() < share

    def uniform(self, low: float, high: float) -> float:
        return low + (high - low) * self.rng.random()

    def pick(self, options: list, weights: list[float]):
        """One of the options by weight."""
        mark = self.rng.random() * sum(weights)
        for option, weight in zip(options, weights, strict=True):
            mark -= weight
            if mark < 0:
                return option
        return options[-1]

    def size(self, category: str) -> Size:
        shift = room_requests()["size"].get(category, (0.0, 0.0, 0.0))
        x, y, z = sample_size(category, self.rng, shift=shift).tolist()
        return x, y, z

    def askew(self, category: str) -> float:
        """How far one of a category is turned off the axes, radians: most stand straight."""
        if not self.chance(vocabulary().category(category).askew):
            return 0.0
        return float(np.clip(self.rng.normal(0.0, 0.35), -0.7, 0.7))

    def style(self) -> int:
        """The style of a group of furniture: mostly that of the room."""
        return self.room_style if self.rng.random() < 0.65 else int(self.rng.integers(self.styles))

    def take(self, category: str) -> int:
        """How many of a category are wanted; they count as handled from now on."""
        return self.wanted.pop(category, 0)

    # -- collisions ----------------------------------------------------------------------------------------------

    def free(self, item: Item, play: float = 0.02, ignore: tuple[Item, ...] = (), doors: bool = True) -> bool:
        """Whether an item stands on the floor, clear of doors and of what is there (up to `play` metres)."""
        x0, x1, z0, z1 = item.x - item.hull_x, item.x + item.hull_x, item.z - item.hull_z, item.z + item.hull_z
        if not self.floor.holds(x0, z0, x1, z1):
            return False
        if doors and any(x0 < d[2] and x1 > d[0] and z0 < d[3] and z1 > d[1] for d in self.floor.doors):
            return False
        for w, top in self.floor.windows:
            if item.y + item.size[1] > top and x0 < w[2] and x1 > w[0] and z0 < w[3] and z1 > w[1]:
                return False
        if any(overlaps(item, other, play - crowds(item, other)) for other in self.items if other not in ignore):
            return False
        if any(overlaps(item, zone, 0.03) for zone, owner in self.zones if owner not in ignore):
            return False
        zone = front_zone(item)
        return zone is None or self.clear(zone, ignore)

    def clear(self, zone: Item, ignore: tuple[Item, ...] = ()) -> bool:
        """Whether a zone lies on the floor and nothing stands in it."""
        rectangle = (zone.x - zone.hull_x, zone.z - zone.hull_z, zone.x + zone.hull_x, zone.z + zone.hull_z)
        if not self.floor.holds(*rectangle):
            return False
        return not any(overlaps(zone, other, 0.03) for other in self.items if other not in ignore)

    def add(self, item: Item, style: int) -> Item:
        table = size_statistics(item.category)  # no side is far beyond what such furniture comes in
        x, y, z = np.clip(item.size, SMALLEST * table.low, LARGEST * table.high).tolist()
        item.style, item.size = style, (x, y, z)
        item.__post_init__()
        self.items.append(item)
        zone = front_zone(item)
        if zone is not None:
            self.zones.append((zone, item))
        return item

    def put(
        self, category: str, size: Size, x: float, z: float, yaw: float, style: int,
        *, play: float = 0.02, ignore: tuple[Item, ...] = (), doors: bool = True,
    ) -> Item | None:  # fmt: skip
        """Place one item at a given spot, if it is free."""
        item = Item(category, size, x, 0.0, z, yaw)
        return self.add(item, style) if self.free(item, play, ignore, doors) else None

    def beside(
        self, anchor: Item, category: str, size: Size, lateral: float, forward: float, turn: float, style: int,
        *, play: float = 0.02, ignore: tuple[Item, ...] = (), doors: bool = True,
    ) -> Item | None:  # fmt: skip
        """Place one item in the frame of another."""
        x, z = anchor.local(lateral, forward)
        return self.put(category, size, x, z, anchor.yaw + turn, style, play=play, ignore=ignore, doors=doors)

    def wall_spot(
        self, width: float, corner: float, margin: float = 0.0, yaw: float | None = None
    ) -> tuple[Wall, float] | None:
        """A wall that is long enough and the place along it of something `width` wide.

        Arguments:
            width: metres.
            corner: share of the draws that go into a corner.
            margin: distance in metres that the others keep from the wall's ends, where it is long enough.
            yaw: asks for walls of that direction only.
        """
        fits = [
            wall
            for wall in self.floor.walls
            if wall.length >= width - 0.02 and (yaw is None or math.cos(wall.yaw - yaw) > 0.9)
        ]
        if not fits:
            return None
        wall = self.pick(fits, [w.length for w in fits])
        free = max(wall.length - width, 0.0)
        if self.rng.random() < corner:
            along = min(abs(self.rng.normal(0.0, 0.06)), free)
            along = along if self.rng.random() < 0.5 else free - along
        else:
            margin = min(margin, free / 2)
            along = margin + (free - 2 * margin) * self.rng.random()
        return wall, along + width / 2

    def against_wall(
        self, category: str, *, size: Size | None = None, corner: float = 0.3, gap: float | None = None,
        style: int | None = None, tries: int = 12, yaw: float | None = None, margin: float = 0.0,
        near: Item | None = None, low: float = 0.0,
    ) -> Item | None:  # fmt: skip
        """Place one item with its back to a wall, `low` metres up, for `near` at the nearest of a few free places."""
        size = size or self.size(category)
        style = self.style() if style is None else style
        found: list[Item] = []
        for _ in range(tries):
            spot = self.wall_spot(size[0], corner, margin, yaw)
            if spot is None:
                return None
            wall, along = spot
            x, z = wall.point(along, (self.wall_gap(category) if gap is None else gap) + size[2] / 2)
            item = Item(category, size, x, low, z, wall.yaw)
            if self.free(item):
                found.append(item)
                if near is None or len(found) == 4:
                    break
        if not found:
            return None
        if near is not None:
            found.sort(key=lambda item: math.hypot(item.x - near.x, item.z - near.z))
        return self.add(found[0], style)

    def along_walls(self, *categories: str, **how: Any) -> None:
        """Place all that are wanted of some categories `against_wall`."""
        for category in categories:
            for _ in range(self.take(category)):
                self.against_wall(category, **how)

    def at_wall(
        self, category: str, size: Size, wall: Wall, along: float, gap: float, style: int, *, turn: float = 0.0,
        play: float = 0.02,
    ) -> Item | None:  # fmt: skip
        """Place one item at a place along a wall, its back `gap` metres off it, if that is free."""
        x, z = wall.point(along, size[2] / 2 + gap)
        return self.put(category, size, x, z, wall.yaw + turn, style, play=play)

    def wall_gap(self, category: str) -> float:
        """Gap between a back and its wall: a few centimetres, as such furniture of real rooms has."""
        low, middle, high = back_gaps(category)
        z = self.rng.normal()
        return min(max(middle + z * ((high - middle) if z > 0 else (middle - low)) / QUARTILE, SUNK), FAR_BACK)

    def somewhere(self, category: str, size: Size, style: int, clearance: float = 0.1) -> Item | None:
        """Place one item on open floor."""
        for _ in range(12):
            x = self.uniform(-self.floor.half_x, self.floor.half_x)
            z = self.uniform(-self.floor.half_z, self.floor.half_z)
            turn = self.pick([0.0, HALF_PI, math.pi, -HALF_PI], [1, 1, 1, 1])
            placed = self.put(category, size, x, z, turn, style, play=-clearance)
            if placed:
                return placed
        return None


def front_zone(item: Item) -> Item | None:
    """What must stay free before an item, as an item; None where it has no front to open."""
    depth = vocabulary().category(item.category).left_free
    if not depth or item.y > 0:
        return None
    x, z = item.local(0.0, item.size[2] / 2 + depth / 2)
    return Item("", (0.9 * item.size[0], BODY, depth), x, 0.0, z, item.yaw)


def crowds(a: Item, b: Item) -> float:
    """Metres that a plant keeps from a bed, a floor lamp or a chair; of others none."""
    if (a.category == "plant") == (b.category == "plant"):
        return 0.0
    other = vocabulary().category(b.category if a.category == "plant" else a.category)
    return {"bed": INTO_BED, "light": OF_LAMPS}.get(other.role, OF_CHAIRS * (other.stands == "at"))


def overlaps(a: Item, b: Item, play: float) -> bool:
    """Whether two items run into each other by more than `play` metres (in plan and in height)."""
    if a.y >= b.y + b.size[1] or b.y >= a.y + a.size[1]:
        return False
    if abs(a.x - b.x) >= a.hull_x + b.hull_x - play or abs(a.z - b.z) >= a.hull_z + b.hull_z - play:
        return False
    return not (a.turned or b.turned) or not (_separated(a, b, play) or _separated(b, a, play))


def _separated(a: Item, b: Item, play: float) -> bool:
    """Whether an edge of `a` parts the two (separating axes of a)."""
    turn_c, turn_s = abs(math.cos(b.yaw - a.yaw)), abs(math.sin(b.yaw - a.yaw))
    lateral, forward = map(abs, a.seen(b.x, b.z))
    half_x, half_z = b.size[0] / 2, b.size[2] / 2
    return (
        lateral >= a.size[0] / 2 + turn_c * half_x + turn_s * half_z - play
        or forward >= a.size[2] / 2 + turn_s * half_x + turn_c * half_z - play
    )
