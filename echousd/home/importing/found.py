"""What a floor plan of somebody's holds, in the home's frame and in metres: what every reader yields."""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Annotated

import numpy as np
import shapely
from pydantic import AfterValidator, ConfigDict, Field
from pydantic.dataclasses import dataclass as checked

from echomodel.files import tables

# What takes (x, y) of a source to (x, z) of the home: north is +X, east +Z.
MAP = np.array([[0.0, 1.0], [1.0, 0.0]])  # x east, y north: maps, z-up; also x and z of Unity
SCREEN = np.array([[0.0, -1.0], [1.0, 0.0]])  # x right, y down
SNAP = 0.02  # metres that ends of walls may be apart
SMALLEST = 0.8  # square metres between walls that may be a room
CHECKED = ConfigDict(arbitrary_types_allowed=True)  # what a reader takes from a file: other types are refused


@checked(frozen=True, eq=False, config=CHECKED)
class Room:
    """A room: corners (k, 2) of its floor, and words for its kind, the surest first."""

    name: str
    words: tuple[str, ...]
    corners: np.ndarray
    height: float | None = None
    storey: str = ""


def _two_ends(ends: np.ndarray) -> np.ndarray:
    if ends.ndim != 3 or ends.shape[1:] != (2, 2) or not np.isfinite(ends).all():
        raise ValueError("found no two ends, allowed: x and z of both, finite numbers")
    return ends


@checked(frozen=True, eq=False, config=CHECKED)
class Hole:
    """A door, window or passage.

    Arguments:
        ends: (n, 2, 2) float, the two ends of the hole in plan; several where the source leaves open which it is.
        tips: (n, 2) float, where the tip of the open leaf is, whose hinge is the first of both ends; None = unknown.
        height, sill: metres, None = as usual.
    """

    name: str
    kind: Annotated[str, Field(pattern="^(door|window|passage)$")]
    ends: Annotated[np.ndarray, AfterValidator(_two_ends)]
    height: float | None = None
    sill: float | None = None
    storey: str = ""
    tips: np.ndarray | None = None


@checked(frozen=True, eq=False, config=CHECKED)
class Piece:
    """A piece of furniture.

    Arguments:
        words: for what it is. at: (3) middle of its bottom face.
        front: (2) where its front looks in plan.
        sides: of how many it is left open which is the front: 1, 2 (or the contrary), 4 (width may be depth).
        size: (3) width, height, depth, None where the source does not tell.
    """

    name: str
    words: tuple[str, ...]
    at: np.ndarray
    front: np.ndarray
    size: np.ndarray | None = None
    sides: int = 1
    storey: str = ""


@dataclass(frozen=True, eq=False)
class Drawn:
    """What was read.

    Arguments:
        frame: a sentence on units and axes. storeys: their names, the lowest first.
        lines: (k, 2) float each, the source's own drawing. ignored: what was left out, and how often.
    """

    frame: str
    rooms: Sequence[Room]
    holes: Sequence[Hole] = ()
    pieces: Sequence[Piece] = ()
    storeys: Sequence[str] = ("",)
    lines: Sequence[np.ndarray] = ()
    ignored: Counter[str] = field(default_factory=Counter)
    format: str = ""


@cache
def _words() -> dict[str, dict[str, re.Pattern[str]]]:
    rows = tables("words.toml", __file__)
    return {about: {kind: re.compile(w) for kind, w in table.items()} for about, table in rows.items()}


def kind_of(about: str, text: str) -> str | None:
    """The kind that a text in small letters tells by a table of words.toml, None where it tells none."""
    return next((kind for kind, pattern in _words()[about].items() if pattern.search(text)), None)


def span(middle: np.ndarray, along: np.ndarray, width: float) -> np.ndarray:
    """(1, 2, 2) float, the ends of a hole of that width about a middle."""
    half = np.asarray(along, float) / np.linalg.norm(along) * width / 2
    return np.array([[middle - half, middle + half]])


def long_sides(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Middle (2), unit vector along the long side, and both sides in metres, of the rectangle around points in plan."""
    box = shapely.MultiPoint(corners).minimum_rotated_rectangle
    if not isinstance(box, shapely.Polygon):
        ends = np.array(box.coords)
        length = float(np.linalg.norm(ends[-1] - ends[0]))
        return ends.mean(0), (ends[-1] - ends[0]) / max(length, 1e-9), length, 0.0
    ring = np.array(box.exterior.coords)
    sides = np.diff(ring[:3], axis=0)
    lengths = np.linalg.norm(sides, axis=1)
    longest = int(lengths.argmax())
    return ring[:4].mean(0), sides[longest] / lengths[longest], float(lengths.max()), float(lengths.min())


def rooms_between(walls: Iterable[np.ndarray]) -> list[np.ndarray]:
    """(k, 2) float each: what lines of walls, (n, 2), close in between them; thin strips are walls themselves."""
    lines = [shapely.LineString(points) for points in walls if len(points) > 1]
    if not lines:
        return []
    ends = shapely.set_precision(shapely.union_all([_longer(line) for line in lines]), SNAP / 4)
    faces = shapely.get_parts(shapely.polygonize([shapely.union_all([ends])]))
    kept = [f for f in faces if f.area > SMALLEST and f.buffer(-0.35).area > 0]
    return [np.array(face.simplify(SNAP).exterior.coords)[:-1] for face in kept]


def _longer(line: shapely.LineString) -> shapely.LineString:
    """A line a little longer at both ends, so that it meets its neighbours."""
    points = np.array(line.coords)
    for end, inner in ((0, 1), (-1, -2)):
        out = points[end] - points[inner]
        points[end] = points[end] + out / max(float(np.linalg.norm(out)), 1e-9) * SNAP
    return shapely.LineString(points)
