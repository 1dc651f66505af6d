"""Doors, windows and passages in the words of a person: `{wall: north, offset: 0.6, width: 0.9}` or `north 0.6 0.9`."""

import difflib
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from echomodel.openings import USUAL, Opening, edge_lengths, inward_normal, numbered, rectangle
from echousd.graph.consistency import GraphError
from echousd.graph.nodes import RoomSpec

LISTS = {"doors": "door", "windows": "window", "passages": "passage"}  # key of a text -> kind
FROM_WALL = 0.1  # metres from the corner to a door whose offset nobody says
# Which way (x, z) one looks from the middle of the room at the wall; north is the room's front as on drawn graphs.
WALLS = {
    **dict.fromkeys(("front", "north", "+x"), (1.0, 0.0)),
    **dict.fromkeys(("behind", "back", "south", "-x"), (-1.0, 0.0)),
    **dict.fromkeys(("left", "west", "-z"), (0.0, -1.0)),
    **dict.fromkeys(("right", "east", "+z"), (0.0, 1.0)),
}
KEYS = ("wall", "offset", "width", "height", "sill", "hinge", "swing", "name")
ALIASES = {"edge": "wall", "side": "wall", "at": "offset", "from": "offset", "hinges": "hinge", "opens": "swing"}
SAME = {"inwards": "in", "inside": "in", "inward": "in", "outwards": "out", "outside": "out", "outward": "out"}
PLACES = {"start": 0.0, "middle": 0.5, "centre": 0.5, "center": 0.5, "end": 1.0}
POSITIONS = ("wall", "offset", "width", "height")  # what bare words of a short text mean, in this order


def opening_from_words(entry: Any, kind: str, room: RoomSpec, taken: Iterable[str] = ()) -> Opening:
    """One opening as a person writes it.

    Arguments:
        entry: a mapping with `wall` (a number, north, east, south, west, or front, right, behind, left) and any of
            `offset` (metres, or start, middle, end), `width`, `height`, `sill`, `hinge`, `swing`, `name`; or a text
            such as `north 0.6 0.9 hinge=left`.
        kind: door, window or passage.
        room: whose walls they are; a floor that nobody stated is taken to become a rectangle.
        taken: names that the opening cannot have.

    Raises GraphError.
    """
    fields = _read(entry, kind)
    name = fields.get("name", None) or numbered(kind, taken)
    corners = room.corners
    if "wall" not in fields:
        raise GraphError(f"{kind} {name!r}: wall is missing, allowed: {_walls_allowed(corners)}")
    edge = _wall(fields["wall"], corners, f"{kind} {name!r}")
    values: dict[str, Any] = {**USUAL[kind]}
    for key in ("width", "height", "sill"):
        if key in fields:
            values[key] = _metres(fields[key], f"{kind} {name!r}: {key}")
    values["offset"] = _offset(fields.get("offset"), kind, values["width"], edge, corners, f"{kind} {name!r}")
    for key in ("hinge", "swing"):
        if key in fields:
            word = str(fields[key]).strip().lower()
            values[key] = SAME.get(word, word)
    try:
        return Opening(name, kind, edge, **values)
    except ValueError as error:
        raise GraphError(str(error)) from None


def _read(entry: Any, kind: str) -> dict[str, Any]:
    """The entry's fields under their own names."""
    if isinstance(entry, str | int) and not isinstance(entry, bool):
        entry = _words(str(entry), kind)
    if not isinstance(entry, Mapping):
        raise GraphError(f"{kind}: found {entry!r}, allowed: a mapping with wall, or a text such as 'north 0.6 0.9'")
    out: dict[str, Any] = {}
    for key, value in entry.items():
        name = ALIASES.get(str(key), str(key))
        if name not in KEYS:
            near = difflib.get_close_matches(name, KEYS, n=1)
            raise GraphError(
                f"{kind}: unknown field {str(key)!r}, "
                + (f"did you mean {near[0]}?" if near else f"allowed: {', '.join(KEYS)}")
            )
        out[name] = value
    return out


def _words(text: str, kind: str) -> dict[str, Any]:
    found: dict[str, Any] = {}
    bare = 0
    for word in text.replace(",", " ").split():
        key, equals, value = word.partition("=")
        if equals:
            found[key] = value
        elif bare < len(POSITIONS):
            found[POSITIONS[bare]] = word
            bare += 1
        else:
            raise GraphError(f"{kind} {text!r}: {word!r} has no meaning here, allowed: {' '.join(POSITIONS)} key=value")
    return found


def _wall(value: Any, corners: np.ndarray | None, about: str) -> int:
    """The number of a wall that is named by its number or by where it lies."""
    count = 4 if corners is None else len(corners)
    if isinstance(value, int | str) and str(value).strip().isdecimal():
        number = int(value)
        if number >= count:
            raise GraphError(f"{about}: wall {number}, allowed: {_walls_allowed(corners)}")
        return number
    way = WALLS.get(str(value).strip().lower().removesuffix(" wall"))
    if way is None:
        raise GraphError(f"{about}: wall {value!r}, allowed: {_walls_allowed(corners)}")
    outline = rectangle(1.0, 1.0) if corners is None else corners
    facing = np.array([-inward_normal(outline, edge) @ way for edge in range(len(outline))])
    lengths = np.where(facing > math.cos(math.pi / 4), edge_lengths(outline), -1.0)
    if lengths.max() < 0:
        raise GraphError(f"{about}: no wall lies {value}, allowed: {_walls_allowed(corners)}")
    return int(lengths.argmax())


def _walls_allowed(corners: np.ndarray | None) -> str:
    count = 4 if corners is None else len(corners)
    return f"0 to {count - 1}, north (front), east (right), south (behind) or west (left)"


def _offset(value: Any, kind: str, width: float, edge: int, corners: np.ndarray | None, about: str) -> float:
    if value is None and corners is None:
        raise GraphError(f"{about}: offset is missing, allowed: metres along the wall, or say the size of the room")
    usual = "start" if kind == "door" else "middle"
    place = usual if value is None else str(value).strip().lower()
    if place not in PLACES:
        return _metres(value, f"{about}: offset")
    if corners is None:
        raise GraphError(f"{about}: offset {value!r} needs the size of the room, allowed: metres, or say the size")
    free = max(float(edge_lengths(corners)[edge]) - width, 0.0)
    margin = min(FROM_WALL, free / 2)
    return round(margin + (free - 2 * margin) * PLACES[place], 4)


def _metres(value: Any, about: str) -> float:
    if isinstance(value, str):
        try:
            value = float(value.strip().removesuffix("m"))
        except ValueError:
            raise GraphError(f"{about} is {value!r}, allowed: a number, metres") from None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise GraphError(f"{about} is {value!r}, allowed: a number, metres")
    return float(value)


def listed_words(data: Mapping[str, Any], about: tuple[str | int, ...]) -> list[tuple[str, Any, tuple[str | int, ...]]]:
    """(kind, entry, where it stands) of everything under `doors`, `windows` and `passages` of a mapping."""
    found: list[tuple[str, Any, tuple[str | int, ...]]] = []
    for key, kind in LISTS.items():
        entries = data.get(key)
        if entries is None:
            continue
        if isinstance(entries, Mapping | str):
            found.append((kind, entries, (*about, key)))
        elif isinstance(entries, Sequence):
            found += [(kind, entry, (*about, key, i)) for i, entry in enumerate(entries)]
        else:
            raise GraphError(f"{key}: found {entries!r}, allowed: a list of {key}", (*about, key))
    return found
