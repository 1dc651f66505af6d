"""Doors, windows and passages in the edges of a floor, and what they need in plan (numpy only)."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

import numpy as np

from echomodel.boxes2d import CORNERS

KINDS = ("door", "window", "passage")
HINGES = ("left", "right")
SWINGS = ("in", "out", "slide")
USUAL = {  # metres, where nobody says otherwise
    "door": {"width": 0.9, "height": 2.0, "sill": 0.0},
    "window": {"width": 1.4, "height": 1.3, "sill": 0.9},
    "passage": {"width": 1.2, "height": 2.1, "sill": 0.0},
}
WINDOWS = {  # by use of a room: sill, height, width at most, metres; above worktops and basins where there are such
    "": (USUAL["window"]["sill"], USUAL["window"]["height"], 2.0),
    "wet": (1.2, 1.0, 1.2),
}
WINDOW_DEPTH = 0.35  # metres before a window where nothing tall stands
STEP = 0.6  # metres before a door that a person needs to stand
SLID = 0.08  # metres before a wall that a leaf takes which slides there, and its rail
BOARD = 0.05  # metres that the board below a window is wider than it, at either end
SKIRTING = 0.012  # metres, thickness of the boards along the foot of a wall
HIGHEST = 100.0  # metres of an opening's height and sill: more than any room has
LONGEST = 10_000.0  # metres of its offset and width: longer than any wall
PROPOSED = 12.0  # metres along a wall of a floor that nobody stated: so far a proposed floor grows for its openings
TOUCH = 1e-6  # metres: neighbouring openings may share a jamb
# (2, 9, 1): along the wall and into the room, points on the arc of a swing
ARC = np.stack([way(np.linspace(0.0, np.pi / 2, 9)) for way in (np.cos, np.sin)])[..., None]


@dataclass(frozen=True)
class Opening:
    """A hole in one wall of the room.

    Arguments:
        name: unique among the room's openings.
        kind: `door`, `window` or `passage` (a hole without a leaf).
        edge: the edge of the floor polygon from corner `edge` to the next one.
        offset: from corner `edge` to the near jamb, along the edge, metres.
        width, height: of the hole, metres.
        sill: from the floor to the lower side of the hole, metres; 0 for doors and passages.
        hinge: side of a door's hinges, `left` or `right` as seen by someone inside the room who looks at it.
        swing: whether a door's leaf opens `in` to the room or `out` of it, or does `slide` before the wall, inside, to
            the side of `hinge`.

    Raises ValueError for a value that no opening has.
    """

    name: str
    kind: str
    edge: int
    offset: float
    width: float
    height: float
    sill: float = 0.0
    hinge: str = "left"
    swing: str = "in"

    def __post_init__(self) -> None:
        words = (("kind", KINDS), ("hinge", HINGES), ("swing", SWINGS))
        for field, allowed in words:
            if getattr(self, field) not in allowed:
                raise ValueError(
                    f"opening {self.name!r}: {field} is {getattr(self, field)!r}, allowed: {', '.join(allowed)}"
                )
        if isinstance(self.edge, bool) or not isinstance(self.edge, int) or self.edge < 0:
            raise ValueError(
                f"opening {self.name!r}: edge is {self.edge!r}, allowed: the number of a corner, 0 or more"
            )
        for field, least in (("offset", 0.0), ("sill", 0.0), ("width", 0.1), ("height", 0.1)):
            value = getattr(self, field)
            if isinstance(value, bool) or not isinstance(value, int | float) or not least <= value < math.inf:
                raise ValueError(f"opening {self.name!r}: {field} is {value!r}, allowed: {least:g} or more, metres")
            most = HIGHEST if field in ("height", "sill") else LONGEST
            if value > most:
                raise ValueError(f"opening {self.name!r}: {field} is {value!r}, allowed: {least:g} to {most:g}, metres")
            object.__setattr__(self, field, float(value))
        if self.kind != "window" and self.sill:
            raise ValueError(f"opening {self.name!r}: sill is {self.sill:g}, allowed: 0 for a {self.kind}")

    @property
    def end(self) -> float:
        """From corner `edge` to the far jamb, metres."""
        return self.offset + self.width

    @property
    def depth(self) -> float:
        """How deep the floor before it stays free, metres: the way of its leaf, a step, or what gets light."""
        if self.kind == "window":
            return WINDOW_DEPTH
        return self.width if (self.kind, self.swing) == ("door", "in") else STEP

    def to_json(self) -> dict[str, Any]:
        """The mapping that `opening_from_json` reads."""
        return asdict(self)


def opening_from_json(entry: Mapping[str, Any]) -> Opening:
    """The opening in a mapping of its fields; raises ValueError for one that is missing or unknown."""
    names = [field.name for field in fields(Opening)]
    for key in entry:
        if key not in names:
            raise ValueError(f"opening: unknown field {key!r}, allowed: {', '.join(names)}")
    for key in names[:6]:
        if key not in entry:
            raise ValueError(f"opening {entry.get('name', '?')!r}: {key} is missing")
    return Opening(**entry)


def check_openings(openings: Sequence[Opening], polygon: Any = None, height: float | None = None) -> None:
    """Raise ValueError at the first fault: one name for two, off the wall, higher than the room, two in one place.

    Arguments:
        openings: of one room.
        polygon: (k, 2) float, corners (x, z) of the floor in metres; None where it is unknown, then walls are taken
            to be as long as any that is proposed.
        height: of the room, metres, None where it is unknown.
    """
    lengths = None if polygon is None else edge_lengths(polygon)
    seen: dict[str, Opening] = {}
    for opening in openings:
        about = f"{opening.kind} {opening.name!r}"
        if opening.name in seen:
            raise ValueError(f"two openings are called {opening.name!r}, allowed: a name of its own for each")
        if lengths is not None:
            if opening.edge >= len(lengths):
                raise ValueError(
                    f"{about}: wall {opening.edge} of a floor with {len(lengths)} walls, "
                    f"allowed: 0 to {len(lengths) - 1}"
                )
            length = float(lengths[opening.edge])
            if opening.end > length + 1e-4:
                raise ValueError(
                    f"{about}: reaches from {opening.offset:.2f} to {opening.end:.2f} m along wall {opening.edge}, "
                    f"which is {length:.2f} m long; allowed: offset and width within it"
                )
        elif opening.end > PROPOSED:
            raise ValueError(
                f"{about}: ends at {opening.end:.2f} m along wall {opening.edge} of a floor that nobody stated, "
                f"allowed: up to {PROPOSED:g} m, or say the size of the room"
            )
        top = opening.sill + opening.height
        if height is not None and top > height + 1e-6:
            raise ValueError(f"{about}: its top is at {top:.2f} m, allowed: up to the room's height, {height:.2f} m")
        for other in seen.values():
            if overlap(opening, other) > TOUCH:
                raise ValueError(
                    f"{about} and {other.kind} {other.name!r} overlap by {overlap(opening, other):.2f} m on wall "
                    f"{opening.edge}, allowed: side by side"
                )
        seen[opening.name] = opening


def overlap(one: Opening, other: Opening) -> float:
    """Length of wall that two openings share, metres; 0 or less where they do not meet."""
    return min(one.end, other.end) - max(one.offset, other.offset) if one.edge == other.edge else 0.0


# -- plan geometry: polygon is (k, 2) float, corners (x, z) in metres, in either turn -----------------------------


def rectangle(width: float, depth: float) -> np.ndarray:
    """(4, 2) float, corners of a floor of x and z extents about the origin: wall 0 at -z, 1 at +x, 2 at +z, 3 at -x."""
    return np.array(CORNERS) * (width / 2, depth / 2)


def edge_lengths(polygon: Any) -> np.ndarray:
    """(k,) float, metres, length of the edge from each corner to the next one."""
    corners = np.asarray(polygon, float)
    return np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)


def signed_area(polygon: Any) -> float:
    """Square metres by the shoelace formula: positive where the inside is at (-dz, dx) of an edge (dx, dz)."""
    corners = np.asarray(polygon, float)
    after = corners[np.arange(1 - len(corners), 1)]  # in a tenth of the time that np.roll takes
    return float((corners[:, 0] * after[:, 1] - after[:, 0] * corners[:, 1]).sum() / 2)


def direction(polygon: Any, edge: int) -> np.ndarray:
    """(2,) float, unit vector (x, z) along an edge."""
    corners = np.asarray(polygon, float)
    along = corners[(edge + 1) % len(corners)] - corners[edge]
    return along / max(math.sqrt(along @ along), 1e-12)


def inward_normal(polygon: Any, edge: int) -> np.ndarray:
    """(2,) float, unit vector (x, z) from an edge into the room."""
    dx, dz = direction(polygon, edge)
    return np.array([-dz, dx]) * (1.0 if signed_area(polygon) > 0 else -1.0)


def segment(polygon: Any, opening: Opening) -> np.ndarray:
    """(2, 2) float, the near and the far jamb (x, z) of an opening on the inner side of its wall, metres."""
    start = np.asarray(polygon, float)[opening.edge]
    along = direction(polygon, opening.edge)
    return np.stack([start + along * opening.offset, start + along * opening.end])


def hinge_point(polygon: Any, opening: Opening) -> tuple[np.ndarray, np.ndarray]:
    """(2,) and (2,) float: the jamb with the hinges, and the unit vector from it to the other jamb."""
    near, far = segment(polygon, opening)
    left, right = (near, far) if signed_area(polygon) > 0 else (far, near)  # seen from inside, facing the wall
    hinge, other = (left, right) if opening.hinge == "left" else (right, left)
    return hinge, (other - hinge) / opening.width


def zone(polygon: Any, opening: Opening, depth: float) -> np.ndarray:
    """(4, 2) float, the rectangle of `depth` metres before an opening, inside the room."""
    near, far = segment(polygon, opening)
    inside = inward_normal(polygon, opening.edge) * depth
    return np.stack([near, far, far + inside, near + inside])


def swing_area(polygon: Any, opening: Opening) -> np.ndarray:
    """(k, 2) float, the quarter circle that a door's leaf sweeps inside the room; (0, 2) where none does."""
    if opening.kind != "door" or opening.swing != "in":
        return np.zeros((0, 2))
    hinge, closed = hinge_point(polygon, opening)
    inside = inward_normal(polygon, opening.edge)
    return np.concatenate([hinge[None], hinge + opening.width * (ARC[0] * closed + ARC[1] * inside)])


def free_area(polygon: Any, opening: Opening) -> np.ndarray:
    """(k, 2) float, what must stay free: a door's swing, the step before other doors and passages, where a leaf slides,
    a window's zone, where only what is higher than the sill is in the way.
    """
    swing = swing_area(polygon, opening)
    if len(swing):
        return swing
    if opening.swing == "slide":
        (hinge, closed), inside = hinge_point(polygon, opening), inward_normal(polygon, opening.edge)
        way = np.array([(1, 0), (1, STEP), (0, STEP), (0, SLID), (-1, SLID), (-1, 0)])
        return hinge + opening.width * way[:, :1] * closed + way[:, 1:] * inside
    return zone(polygon, opening, opening.depth)


def sliding(polygon: np.ndarray, door: Opening, openings: Sequence[Opening]) -> Opening:
    """A door with a leaf that slides to a side where the wall is free of all openings; else the opening itself."""
    length, turned = float(edge_lengths(polygon)[door.edge]), signed_area(polygon) > 0
    for start, hinge in ((door.end, HINGES[turned]), (door.offset - door.width, HINGES[not turned])):
        rest = replace(door, offset=max(start, 0.0))
        within = door.kind == "door" and start > 0.05 and rest.end < length - 0.05
        if within and not any(overlap(rest, other) > 0.0 for other in openings if other is not door):
            return replace(door, swing="slide", hinge=hinge)
    return door


def numbered(kind: str, taken: Iterable[str]) -> str:
    """A name for one more opening: its kind, numbered from the second on."""
    names, number, name = set(taken), 2, kind
    while name in names:
        name, number = f"{kind}_{number}", number + 1
    return name
