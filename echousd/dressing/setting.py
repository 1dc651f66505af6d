"""What the dressing of a room looks at, and what it decides: things in their places; no pxr here."""

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np
import shapely

from echomodel.boxes2d import outline, seen, turned
from echomodel.dressing import KINDS
from echomodel.dressing import thing as solids_of
from echomodel.openings import STEP, Opening, free_area, zone
from echomodel.triangles import bounds_of, outlines, spans_of
from echomodel.vocabulary import Category, RoomStyle, vocabulary
from echousd.dressing.stories import TABLE, Story, story
from echousd.shapes.geometry import Collider, Geometry, Origin
from echousd.shapes.hulls import rounded_hull, standing_hull
from echousd.shapes.joinery import part_of, within_budget
from echousd.shapes.matter import weighed

ORIGIN = Origin("dressing")
Recipe = tuple[str, tuple[float, ...], int, tuple[float, ...]]  # kind, extents, variant and `lie` of a `Thing`
SKIN = 1e-4  # metres that count as nothing
EDGE = 0.01  # metres that a small thing keeps from the edge of what it stands on
APART = 0.008  # metres of air between a small thing and everything else
NEARER = 0.8  # share of the distance at which two surely stand apart that is tried first
ROOMY = 25.0  # m² of floor: so much more asks for as much again on walls and floors
BESIDE = 0.04  # and between two that stand beside each other, each with its margin


@dataclass(frozen=True, eq=False)
class Thing:
    """One small thing in its place."""

    kind: str  # a word of `echomodel.dressing.KINDS`
    size: np.ndarray  # (3,) float extents, metres
    position: np.ndarray  # (3,) centre of its bottom, room frame
    yaw: float  # radians about +Y
    on: str = ""  # the object that it belongs to, "" for floor and walls
    variant: int = 0  # seed of its program
    count: int = 1  # how many things a person would count
    lie: tuple[float, ...] = ()  # of cloth: how far below its top what it lies on is, in a grid, metres

    @cached_property
    def footprint(self) -> shapely.Polygon:
        """Its box in plan."""
        return rectangle(self.position[[0, 2]], self.size[[0, 2]], self.yaw)

    @property
    def recipe(self) -> Recipe:
        """What its form follows from; things of one recipe share an asset."""
        return self.kind, tuple(np.round(self.size, 4).tolist()), self.variant, self.lie


@dataclass(frozen=True, eq=False)
class Standing:
    """One object of the graph in its place."""

    name: str
    row: Category
    size: np.ndarray
    position: np.ndarray
    yaw: float
    geometry: Geometry

    @cached_property
    def footprint(self) -> shapely.Polygon:
        """Its box in plan."""
        return rectangle(self.position[[0, 2]], self.size[[0, 2]], self.yaw)

    @cached_property
    def pieces(self) -> list[np.ndarray]:
        """(n, 3, 3) triangles of its mesh and of each collider, in the room, metres."""
        meshes = [self.geometry.mesh, *(collider.mesh for collider in self.geometry.colliders)]
        return [self.to_room(mesh.vertices)[mesh.faces] for mesh in meshes]

    @cached_property
    def spans(self) -> np.ndarray:
        """(p, 2, 3) lower and upper corner of each of its pieces, metres."""
        return np.array([bounds_of(piece) for piece in self.pieces])

    def in_plan(self, position: np.ndarray) -> np.ndarray:
        """(2,) a point of the room (3,) in the object's frame, x and z."""
        return seen((position - self.position)[[0, 2]], self.yaw)

    @property
    def top(self) -> float:
        """Height of its highest point, metres."""
        return float(self.position[1] + self.size[1])

    def to_room(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) points of the object's frame in the room's."""
        there = np.array(points, float)
        there[:, ::2] = turned(there[:, ::2], self.yaw)
        return there + self.position

    def on_floor(self, x: float, z: float) -> np.ndarray:
        """(3,) the point of the room's floor below or above a point (x, z) of the object's frame."""
        spot = self.to_room(np.array([[x, 0.0, z]]))[0]
        spot[1] = 0.0
        return spot


@dataclass(eq=False)
class Setting:
    """The room as the rules see it, and the things placed so far."""

    objects: Mapping[str, Standing]  # what the graph put there
    floor: np.ndarray  # (k, 2) float corners, metres
    openings: tuple[Opening, ...]  # in its edges
    height: float  # of the room, metres
    walls: bool  # whether there are any to hang things on
    full: bool  # place as much as looks good, not only a little
    seed: int  # of all choices
    use: str = ""  # of the room (`echomodel.rows.RoomType`)
    story: Story = field(default_factory=story)  # of who lives there
    resident: str = ""  # who sleeps there (`echousd.graph.fields.RESIDENTS`)
    style: RoomStyle | None = None  # of the room
    own: bool = True  # whether niches may be cut into its walls: not where another room is behind them
    placed: list[Thing] = field(default_factory=list)  # the things so far
    carriers: dict[str, Standing] = field(default_factory=dict)  # those of them that others stand on
    cuts: list[Opening] = field(default_factory=list)  # of walls, for what is sunk into them
    curtained: set[str] = field(default_factory=set)  # names of the windows that have curtains

    def __post_init__(self) -> None:
        self.room = shapely.Polygon(self.floor)
        self.parts = 1 + int(self.room.area / ROOMY)  # of a large room, each with things of its own
        french = [zone(self.floor, o, STEP) for o in self.openings if o.kind == "window" and not o.sill]
        self.wider = self.room.buffer(0.005).difference(shapely.union_all([shapely.Polygon(way) for way in french]))
        self.ways = [(shapely.Polygon(free_area(self.floor, o)), o) for o in self.openings if o.kind != "window"]

    def rng(self, *words: str) -> np.random.Generator:
        """Numbers of its own for everything that is decided, so that one thing less changes no other."""
        key = "/".join((str(self.seed), "dressing", *words)).encode()
        return np.random.default_rng(int.from_bytes(hashlib.blake2b(key, digest_size=8).digest(), "big"))

    def has(self, share: float, rng: np.random.Generator) -> bool:
        """Whether this room has what a share of rooms has, and every one that is dressed in full."""
        return self.full or bool(rng.random() < share)

    def of(self, *words: str) -> list[Standing]:
        """The objects of a role or a `top`, or that a small thing goes with (`echomodel.rows.INVITES`), in order."""
        return [o for o in self.objects.values() if {o.row.role, o.row.top, *o.row.invites}.intersection(words)]

    @property
    def plants(self) -> int:
        """How many plants the graph has."""
        return sum(o.row.look == "plant" for o in self.objects.values())

    def stands(self, *slot_roles: str) -> list[Standing]:
        """The objects that stand so to what they attend, in the order of the graph."""
        return [o for o in self.objects.values() if o.row.stands in slot_roles]

    def clear(self, thing: Thing, *, host: str = "", margin: float = APART, floor: bool = True) -> bool:
        """Whether a thing stands in the room, in nobody's way, and meets neither an object but its host nor a thing."""
        plan = thing.footprint
        if floor and not self.wider.contains(plan):
            return False
        low, high = float(thing.position[1]), float(thing.position[1] + thing.size[1])
        around = plan.buffer(margin) if margin else plan
        if any(way.intersects(around) for way, o in self.ways if low < o.height):
            return False
        for other in self.objects.values():
            if other.name == host or other.top < low + 1e-4 or other.position[1] > high + margin:
                continue
            if other.footprint.intersects(around) and meets(other, low, high, around):
                return False
        return not any(
            other.footprint.intersects(around)
            for other in self.placed
            if KINDS[other.kind].name != "rug"
            and not (other.kind == "niche" and host in self.carriers)
            and other.position[1] < high
            and other.position[1] + other.size[1] > low + 1e-4
        )

    def put_first(
        self, things: Iterable[Thing], *, host: str = "", margin: float = APART, floor: bool = True
    ) -> Thing | None:
        """Place the first of some things that is clear, and give it back; None where none is.

        `things`: taken one by one, those after the first clear one not at all. Others: as `clear`.
        """
        had = {thing.kind for thing in self.placed}.intersection(TABLE["once"])
        wanted = (one for one in things if one.kind not in had)
        found = next((one for one in wanted if self.clear(one, host=host, margin=margin, floor=floor)), None)
        if found is not None:
            self.placed.append(found)
        return found


def around(first: Thing, size: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(24, 2) ways (x, z) from the middle of a thing to that of another of extents (3,) beside it, the near first."""
    reach = np.repeat((NEARER, 1.0), 12) * ((max(first.size[[0, 2]]) + max(size[[0, 2]])) / 2 + BESIDE)
    angle = rng.uniform(0, 2 * np.pi) + np.linspace(0, 4 * np.pi, 24, endpoint=False)
    return (reach * [np.cos(angle), np.sin(angle)]).T


def standing(
    name: str, category: str, size: np.ndarray, position: np.ndarray, yaw: float, geometry: Geometry
) -> Standing:
    """An object with its row of the vocabulary."""
    row = vocabulary().category(category)
    return Standing(name, row, np.asarray(size, float), np.asarray(position, float), float(yaw), geometry)


def rectangle(centre: np.ndarray, size: np.ndarray, yaw: float) -> shapely.Polygon:
    """A rectangle in plan (x, z), `size` along its own x and z, turned by `yaw` about +Y."""
    return shapely.polygons(outline(size / 2, np.asarray(yaw)) + centre)


def meets(thing: Standing, low: float, high: float, plan: shapely.Geometry) -> bool:
    """Whether what an object covers in plan between two heights, the hull of its mesh there and its colliders, meets a
    shape; a foot that stands at the lower height reaches over it.
    """
    least, most = np.array(plan.bounds).reshape(2, 2)
    near = (thing.spans[:, 0, [0, 2]] <= most).all(1) & (thing.spans[:, 1, [0, 2]] >= least).all(1)
    near &= (thing.spans[:, 0, 1] < high) & (thing.spans[:, 1, 1] > low)
    return any(_section(thing, n, low + SKIN, high - SKIN).intersects(plan) for n in np.flatnonzero(near).tolist())


@lru_cache(maxsize=64)  # along a wall each place asks for that of the same pieces
def _section(thing: Standing, number: int, low: float, high: float) -> shapely.Geometry:
    """The hull in plan of one of a thing's `pieces` between two heights."""
    corners = thing.pieces[number]
    least, most = spans_of(corners[..., 1])
    corners = corners[(most > low) & (least < high)]
    points, through = corners.reshape(-1, 3), (outlines(corners, level)[0].reshape(-1, 2) for level in (low, high))
    inside = np.concatenate([points[(points[:, 1] > low) & (points[:, 1] < high)][:, [0, 2]], *through])
    # a line has the hull of its points and is one object rather than thousands
    return shapely.convex_hull(shapely.linestrings(np.concatenate([inside, inside[:1]])))


@lru_cache(maxsize=100)  # a room that is edited keeps most of its things
def geometry_of(kind: str, size: tuple[float, ...], variant: int, lie: tuple[float, ...] = ()) -> Geometry:
    """The geometry of a thing, with one hull to bump into that stands; a niche holds things, and has one a board."""
    solids = solids_of(kind, np.array(size), np.random.default_rng(variant), **({"lie": lie} if lie else {}))
    pieces = within_budget(solids, np.array(size), KINDS[kind].faces)
    part = part_of("mesh", pieces)
    boards = [rounded_hull(piece.vertices) for piece in pieces] if kind == "niche" else []
    hulls = [Collider(f"collider_{n}", hull, "convexHull") for n, hull in enumerate(boards)]
    return Geometry((part,), (*hulls,) or (standing_hull(part.mesh, KINDS[kind].gives),), ORIGIN, weighed(pieces))
