"""The fields of nodes, relations and rooms: what each may hold, checked with a message that says what is allowed."""

import unicodedata
from collections.abc import Callable, Mapping
from typing import Annotated, Any, TypeAlias

from pydantic import BeforeValidator, Field, StrictBool, WithJsonSchema

from echomodel.late import lates
from echomodel.openings import Opening, opening_from_json
from echomodel.vocabulary import vocabulary
from echousd.graph.values import (
    IDENTIFIER,
    MAX_NAME,
    Point,
    Vector,
    checked_identifier,
    finite,
    items,
    numbers_of,
    real,
    shown,
    storable,
)  # fmt: skip

MAX_NODES = 5000  # of a graph
SHAPES = ("parts", "sdf", "boxes", "library", "guided", "own")  # of the geometry of one object
# what `echousd.dressing` has stories of
RESIDENTS = ("child", "teen", "couple", "senior", "student", "office", "guest")
angle, attributes, corners, place, two_names = lates(
    "echousd.graph.stated", "angle", "attributes", "corners", "place", "two_names"
)

Scalar: TypeAlias = StrictBool | int | float | str


def _text(value: Any) -> str:
    if not isinstance(value, str) or not value.strip():
        raise ValueError(f"found {shown(value)}, allowed: a non-empty text")
    return storable(value)


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


_positive = real("a positive number, metres", lambda number: number > 0)
_share = real("a number from 0 to 1", lambda number: 0 <= number <= 1)


def _openings(value: Any) -> tuple[Opening, ...]:
    found = []
    for entry in items(value):
        if not isinstance(entry, Opening | Mapping):
            raise ValueError(f"found {shown(entry)}, allowed: an opening with name, kind, edge, offset, width, height")
        opening = entry if isinstance(entry, Opening) else opening_from_json(entry)
        checked_identifier(opening.name)
        found.append(opening)
    return tuple(found)


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
_places = {"enum": [row.name for row in vocabulary().placements if not row.others]}
Place: TypeAlias = Annotated[str | None, _optional(place), WithJsonSchema({"anyOf": [_places, {"type": "null"}]})]
Two: TypeAlias = Annotated[tuple[str, str] | None, _optional(two_names)]
Title: TypeAlias = Annotated[str | None, _optional(title)]
AssetName: TypeAlias = Annotated[str | None, _optional(_text)]
Size: TypeAlias = Annotated[
    Vector | None, _optional(numbers_of(3, _positive, "three positive numbers [x, y, z], metres"))
]
Position: TypeAlias = Annotated[Vector | None, _optional(numbers_of(3, finite, "three numbers [x, y, z], metres"))]
_angles = [{"type": "number"}, {"type": "string", "description": "such as 90 deg"}, {"type": "null"}]
Angle: TypeAlias = Annotated[float | None, _optional(angle), WithJsonSchema({"anyOf": _angles})]
Confidence: TypeAlias = Annotated[float, BeforeValidator(_share), Field(ge=0, le=1)]
Attributes: TypeAlias = Annotated[
    dict[str, Scalar], BeforeValidator(lambda value: {} if value == {} else attributes(value))
]
Flag: TypeAlias = Annotated[bool, BeforeValidator(_flag)]
Extents: TypeAlias = Annotated[Point | None, _optional(numbers_of(2, _positive, "two positive numbers [x, z], metres"))]
Corners: TypeAlias = Annotated[tuple[Point, ...] | None, _optional(corners)]
Thicknesses: TypeAlias = Annotated[
    tuple[float, ...], BeforeValidator(lambda value: tuple(_positive(each) for each in items(value)))
]
Openings: TypeAlias = Annotated[tuple[Opening, ...], BeforeValidator(_openings)]
Height: TypeAlias = Annotated[float | None, _optional(_positive)]


def bounding_extents(corners: tuple[Point, ...]) -> Point:
    """(x, z) extents of the bounding box of `corners`, metres."""
    xs, zs = [x for x, _ in corners], [z for _, z in corners]
    return max(xs) - min(xs), max(zs) - min(zs)
