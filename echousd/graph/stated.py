"""Fields that few graphs state: headings in degrees, outlines of floors, attributes, places and what is between."""

import math
import re
from collections.abc import Mapping
from typing import Any

from echomodel.openings import signed_area
from echomodel.vocabulary import vocabulary
from echousd.graph.values import (
    MAX_CORNERS,
    Point,
    checked_identifier,
    converted,
    finite,
    items,
    numbers_of,
    shown,
    storable,
)

ANGLE_TEXT = re.compile(r"\s*([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(deg|degrees?|°|rad|radians?)\s*")
_corner = numbers_of(2, finite, "corners [x, z], metres")


def angle(value: Any) -> float:
    """Radians from a number of radians or a text with its unit, such as `90 deg`; raises ValueError."""
    degrees = value
    if isinstance(value, str):
        match = ANGLE_TEXT.fullmatch(value)
        try:
            value = float(match[1]) * (1.0 if match[2].startswith("rad") else math.pi / 180) if match else math.nan
        except ValueError:
            value = math.nan
    number = converted(value)
    if not math.isfinite(number):
        raise ValueError(f"found {shown(degrees)}, allowed: radians, or degrees as in 90 deg")
    if abs(number) > 2 * math.pi + 1e-6:
        hint = f"; {degrees:g} degrees are written {degrees:g} deg" if isinstance(degrees, int | float) else ""
        raise ValueError(f"found {shown(degrees)}, allowed: -2 pi to 2 pi radians{hint}")
    return number


def corners(value: Any) -> tuple[Point, ...]:
    """Corners of an outline that does not cross itself and encloses an area; raises ValueError."""
    entries = tuple(items(value))
    if len(entries) > MAX_CORNERS:
        raise ValueError(f"{len(entries)} corners, allowed: {MAX_CORNERS}")
    found = tuple((x, z) for x, z in (_corner(corner) for corner in entries))
    from shapely import Polygon, is_valid_reason

    reason = is_valid_reason(Polygon(found)) if len(found) > 3 else "Valid Geometry"
    flat = len(found) < 3 or abs(signed_area(found)) < 1e-6
    if flat and not reason.startswith("Self-intersection"):
        raise ValueError(f"{len(found)} corners that enclose no area, allowed: at least three around the floor")
    if reason != "Valid Geometry":
        text = re.sub(r"-?\d+(\.\d+)?", lambda number: f"{float(number[0]):.2f}", reason)
        text = text.replace("[", " at (").replace("]", ")")
        raise ValueError(f"{text}, allowed: an outline that does not cross itself")
    return found


def attributes(value: Any) -> dict[str, Any]:
    """Names with a text, a number or a truth each; raises ValueError."""
    if not isinstance(value, Mapping):
        raise ValueError(f"found {shown(value)}, allowed: names with a text, a number or true/false each")
    return {checked_identifier(key): _scalar(key, entry) for key, entry in value.items()}


def _scalar(key: str, value: Any) -> bool | int | float | str:
    if isinstance(value, str):
        try:
            return storable(value)
        except ValueError as error:
            raise ValueError(f"{key} is {error}") from None
    if isinstance(value, int) and -(2**63) <= value < 2**63:  # bool is an int and stays one
        return value
    if isinstance(value, float) and math.isfinite(value):
        return value
    raise ValueError(f"{key} is {shown(value)}, allowed: a text, true, false or a finite number, integers below 2^63")


def place(value: Any) -> str:
    """The word of a place that names no other object; raises ValueError."""
    single = [row.name for row in vocabulary().placements if not row.others]
    word = vocabulary().placement(value).name if isinstance(value, str) else ""
    if word not in single:
        raise ValueError(f"found {shown(value)}, allowed: {', '.join(single)}")
    return word


def two_names(value: Any) -> tuple[str, ...]:
    """The names of two objects; raises ValueError."""
    names = tuple(items(value))
    if len(names) != 2 or names[0] == names[1]:
        raise ValueError(f"found {shown(value)}, allowed: the names of two other objects")
    return tuple(map(checked_identifier, names))
