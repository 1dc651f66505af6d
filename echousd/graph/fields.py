"""The fields of nodes, relations and rooms: what each may hold, checked with a message that says what is allowed."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Callable, Iterable, Mapping
from numbers import Real
from typing import Annotated, Any, TypeAlias

from pydantic import BeforeValidator, Field, StrictBool, WithJsonSchema

from echomodel.openings import Opening, opening_from_json, signed_area
from echomodel.vocabulary import vocabulary

MAX_TEXT = 65_536  # characters in one string: what an attribute may hold before it is taken for a mistake
MAX_NODES = 5000  # of a graph
MAX_CORNERS = 500  # of a floor: the work on walls and furniture grows with their square
MAX_NAME = 100  # characters: names become file names of assets
SHAPES = ("parts", "sdf", "boxes", "library", "guided", "own")  # of the geometry of one object
# what `echousd.dressing` has stories of
RESIDENTS = ("child", "teen", "couple", "senior", "student", "office", "guest")
IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")

Point: TypeAlias = tuple[float, float]
Vector: TypeAlias = tuple[float, float, float]
Scalar: TypeAlias = StrictBool | int | float | str


def checked_identifier(value: Any) -> str:
    """A valid USD identifier of at most `MAX_NAME` characters; raises ValueError."""
    if not isinstance(value, str) or not IDENTIFIER.fullmatch(value):
        raise ValueError(f"{shown(value)} is no identifier, allowed: letters, digits and _, not starting with a digit")
    if len(value) > MAX_NAME:
        raise ValueError(f"{shown(value)} has {len(value)} characters, allowed: {MAX_NAME}")
    return value


def _text(value: Any) -> str:
    if not isinstance(value, str) or not value.strip():
        raise ValueError(f"found {shown(value)}, allowed: a non-empty text")
    return _storable(value)


def title(value: Any) -> str:
    """A text that people may call an object by; raises ValueError for any other value."""
    if not isinstance(value, str) or not value.strip() or not value.isprintable() or len(value) > MAX_NAME:
        raise ValueError(f"found {shown(value)}, allowed: a text of at most {MAX_NAME} printable characters")
    return unicodedata.normalize("NFC", value)


def _one_of(words: tuple[str, ...]) -> tuple[BeforeValidator, WithJsonSchema]:
    """One of some words, or None."""

    def check(value: Any) -> str:
        if not isinstance(value, str) or value not in words:
            raise ValueError(f"found {shown(value)}, allowed: {', '.join(words)}")
        return value

    return _optional(check), WithJsonSchema({"anyOf": [{"enum": list(words)}, {"type": "null"}]})


def _storable(value: str) -> str:
    if len(value) > MAX_TEXT:
        raise ValueError(f"a text of {len(value)} characters, allowed: {MAX_TEXT}")
    if "\0" in value or any("\ud800" <= character <= "\udfff" for character in value):
        raise ValueError(f"{shown(value)} holds a character that a USD file cannot hold")
    return value


def _converted(value: Any) -> float:
    try:
        return math.nan if isinstance(value, bool) or not isinstance(value, Real) else float(value)
    except OverflowError:
        return math.inf


def _real(allowed: str, test: Callable[[float], bool] = math.isfinite) -> Callable[[Any], float]:
    def check(value: Any) -> float:
        number = value if type(value) is float else _converted(value)
        if not (math.isfinite(number) and test(number)):
            raise ValueError(f"found {shown(value)}, allowed: {allowed}")
        return number

    return check


_number = _real("a finite number")
_positive = _real("a positive number, metres", lambda number: number > 0)
_share = _real("a number from 0 to 1", lambda number: 0 <= number <= 1)


ANGLE_TEXT = re.compile(r"\s*([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(deg|degrees?|°|rad|radians?)\s*")


def angle(value: Any) -> float:
    """Radians from a number of radians or a text with its unit, such as `90 deg`; raises ValueError."""
    degrees = value
    if isinstance(value, str):
        match = ANGLE_TEXT.fullmatch(value)
        try:
            value = float(match[1]) * (1.0 if match[2].startswith("rad") else math.pi / 180) if match else math.nan
        except ValueError:
            value = math.nan
    number = _converted(value)
    if not math.isfinite(number):
        raise ValueError(f"found {shown(degrees)}, allowed: radians, or degrees as in 90 deg")
    if abs(number) > 2 * math.pi + 1e-6:
        hint = f"; {degrees:g} degrees are written {degrees:g} deg" if isinstance(degrees, int | float) else ""
        raise ValueError(f"found {shown(degrees)}, allowed: -2 pi to 2 pi radians{hint}")
    return number


def _numbers(count: int, each: Callable[[Any], float], allowed: str) -> Callable[[Any], tuple[float, ...]]:
    def check(value: Any) -> tuple[float, ...]:
        try:
            numbers = tuple(each(number) for number in _items(value))
        except ValueError:
            numbers = ()
        if len(numbers) != count:
            raise ValueError(f"found {shown(value)}, allowed: {allowed}")
        return numbers

    return check


def _items(value: Any) -> Iterable[Any]:
    if isinstance(value, str | bytes | Mapping) or not isinstance(value, Iterable):
        raise ValueError(f"found {shown(value)}, allowed: a list")
    return value


_corner = _numbers(2, _number, "corners [x, z], metres")


def _corners(value: Any) -> tuple[Point, ...]:
    entries = tuple(_items(value))
    if len(entries) > MAX_CORNERS:
        raise ValueError(f"{len(entries)} corners, allowed: {MAX_CORNERS}")
    corners = tuple((x, z) for x, z in (_corner(corner) for corner in entries))
    from shapely import Polygon, is_valid_reason

    reason = is_valid_reason(Polygon(corners)) if len(corners) > 3 else "Valid Geometry"
    flat = len(corners) < 3 or abs(signed_area(corners)) < 1e-6
    if flat and not reason.startswith("Self-intersection"):
        raise ValueError(f"{len(corners)} corners that enclose no area, allowed: at least three around the floor")
    if reason != "Valid Geometry":
        text = re.sub(r"-?\d+(\.\d+)?", lambda number: f"{float(number[0]):.2f}", reason)
        raise ValueError(
            f"{text.replace('[', ' at (').replace(']', ')')}, allowed: an outline that does not cross itself"
        )
    return corners


def _openings(value: Any) -> tuple[Opening, ...]:
    found = []
    for entry in _items(value):
        if not isinstance(entry, Opening | Mapping):
            raise ValueError(f"found {shown(entry)}, allowed: an opening with name, kind, edge, offset, width, height")
        opening = entry if isinstance(entry, Opening) else opening_from_json(entry)
        checked_identifier(opening.name)
        found.append(opening)
    return tuple(found)


def _attributes(value: Any) -> dict[str, Any]:
    if not isinstance(value, Mapping):
        raise ValueError(f"found {shown(value)}, allowed: names with a text, a number or true/false each")
    return {checked_identifier(key): _scalar(key, entry) for key, entry in value.items()}


def _scalar(key: str, value: Any) -> bool | int | float | str:
    if isinstance(value, str):
        try:
            return _storable(value)
        except ValueError as error:
            raise ValueError(f"{key} is {error}") from None
    if isinstance(value, int) and -(2**63) <= value < 2**63:  # bool is an int and stays one
        return value
    if isinstance(value, float) and math.isfinite(value):
        return value
    raise ValueError(f"{key} is {shown(value)}, allowed: a text, true, false or a finite number, integers below 2^63")


def _place(value: Any) -> str:
    single = [row.name for row in vocabulary().placements if not row.others]
    word = vocabulary().placement(value).name if isinstance(value, str) else ""
    if word not in single:
        raise ValueError(f"found {shown(value)}, allowed: {', '.join(single)}")
    return word


def _two_names(value: Any) -> tuple[str, ...]:
    names = tuple(_items(value))
    if len(names) != 2 or names[0] == names[1]:
        raise ValueError(f"found {shown(value)}, allowed: the names of two other objects")
    return tuple(map(checked_identifier, names))


def _flag(value: Any) -> bool:
    if not isinstance(value, bool):
        raise ValueError(f"found {shown(value)}, allowed: true or false")
    return value


def _optional(check: Callable[[Any], Any]) -> BeforeValidator:
    return BeforeValidator(lambda value: None if value is None else check(value))


def _word(kind: str, table: str) -> tuple[Callable[[Any], str], WithJsonSchema]:
    """A word of the vocabulary, canonicalised; the JSON schema offers the names and lets aliases pass."""

    def check(value: Any) -> str:
        if not isinstance(value, str):
            raise ValueError(f"found {shown(value)}, allowed: the name of a {kind.replace('_', ' ')}")
        return getattr(vocabulary(), kind)(value).name

    names = [entry.name for entry in getattr(vocabulary(), table)]
    known = {"enum": names, "description": f"{kind.replace('_', ' ')} of the vocabulary"}
    return check, WithJsonSchema({"anyOf": [known, {"type": "string", "description": "or an alias"}]})


_category, _predicate = _word("category", "categories"), _word("predicate", "predicates")
_room_type, _style = _word("room_type", "room_types"), _word("style", "styles")

Name: TypeAlias = Annotated[
    str, BeforeValidator(checked_identifier), Field(pattern=f"^{IDENTIFIER.pattern}$", max_length=MAX_NAME)
]
CategoryWord: TypeAlias = Annotated[str, BeforeValidator(_category[0]), _category[1]]
PredicateWord: TypeAlias = Annotated[str, BeforeValidator(_predicate[0]), _predicate[1]]
RoomTypeWord: TypeAlias = Annotated[str, BeforeValidator(_room_type[0]), _room_type[1]]
Style: TypeAlias = Annotated[str | None, _optional(_text)]
RoomStyleWord: TypeAlias = Annotated[str | None, _optional(_style[0]), _style[1]]
_shapes, _resident = map(_one_of, (SHAPES, RESIDENTS))
Shapes: TypeAlias = Annotated[str | None, _shapes[0], _shapes[1]]
Resident: TypeAlias = Annotated[str | None, _resident[0], _resident[1]]
Place: TypeAlias = Annotated[
    str | None,
    _optional(_place),
    WithJsonSchema(
        {"anyOf": [{"enum": [row.name for row in vocabulary().placements if not row.others]}, {"type": "null"}]}
    ),
]
Two: TypeAlias = Annotated[tuple[str, str] | None, _optional(_two_names)]
Title: TypeAlias = Annotated[str | None, _optional(title)]
AssetName: TypeAlias = Annotated[str | None, _optional(_text)]
Size: TypeAlias = Annotated[
    Vector | None, _optional(_numbers(3, _positive, "three positive numbers [x, y, z], metres"))
]
Position: TypeAlias = Annotated[Vector | None, _optional(_numbers(3, _number, "three numbers [x, y, z], metres"))]
Angle: TypeAlias = Annotated[
    float | None,
    _optional(angle),
    WithJsonSchema(
        {"anyOf": [{"type": "number"}, {"type": "string", "description": "such as 90 deg"}, {"type": "null"}]}
    ),
]
Confidence: TypeAlias = Annotated[float, BeforeValidator(_share), Field(ge=0, le=1)]
Attributes: TypeAlias = Annotated[dict[str, Scalar], BeforeValidator(_attributes)]
Flag: TypeAlias = Annotated[bool, BeforeValidator(_flag)]
Extents: TypeAlias = Annotated[Point | None, _optional(_numbers(2, _positive, "two positive numbers [x, z], metres"))]
Corners: TypeAlias = Annotated[tuple[Point, ...] | None, _optional(_corners)]
Thicknesses: TypeAlias = Annotated[
    tuple[float, ...], BeforeValidator(lambda value: tuple(_positive(each) for each in _items(value)))
]
Openings: TypeAlias = Annotated[tuple[Opening, ...], BeforeValidator(_openings)]
Height: TypeAlias = Annotated[float | None, _optional(_positive)]


def bounding_extents(corners: tuple[Point, ...]) -> Point:
    """(x, z) extents of the bounding box of `corners`, metres."""
    xs, zs = [x for x, _ in corners], [z for _, z in corners]
    return max(xs) - min(xs), max(zs) - min(zs)


def shown(value: Any, most: int = 60) -> str:
    """`repr(value)` cut to about `most` characters: what an error message shows of a value."""
    text = repr(value[: most + 1] if isinstance(value, str) else value)
    return text if len(text) <= most + 2 else f"{text[:most]}..."
