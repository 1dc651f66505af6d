"""Single values of graphs: numbers, texts, names and lists, checked with a message that says what is allowed."""

import math
import re
from collections.abc import Callable, Iterable, Mapping
from numbers import Real
from typing import Any, TypeAlias

MAX_TEXT = 65_536  # characters in one string: what an attribute may hold before it is taken for a mistake
MAX_CORNERS = 500  # of a floor: the work on walls and furniture grows with their square
MAX_NAME = 100  # characters: names become file names of assets
IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")

Point: TypeAlias = tuple[float, float]
Vector: TypeAlias = tuple[float, float, float]


def shown(value: Any, most: int = 60) -> str:
    """`repr(value)` cut to about `most` characters: what an error message shows of a value."""
    text = repr(value[: most + 1] if isinstance(value, str) else value)
    return text if len(text) <= most + 2 else f"{text[:most]}..."


def checked_identifier(value: Any) -> str:
    """A valid USD identifier of at most `MAX_NAME` characters; raises ValueError."""
    if not isinstance(value, str) or not IDENTIFIER.fullmatch(value):
        raise ValueError(f"{shown(value)} is no identifier, allowed: letters, digits and _, not starting with a digit")
    if len(value) > MAX_NAME:
        raise ValueError(f"{shown(value)} has {len(value)} characters, allowed: {MAX_NAME}")
    return value


def storable(value: str) -> str:
    """A text that a USD file can hold; raises ValueError."""
    if len(value) > MAX_TEXT:
        raise ValueError(f"a text of {len(value)} characters, allowed: {MAX_TEXT}")
    if "\0" in value or any("\ud800" <= character <= "\udfff" for character in value):
        raise ValueError(f"{shown(value)} holds a character that a USD file cannot hold")
    return value


def converted(value: Any) -> float:
    """A number, not a number where the value is none."""
    try:
        return math.nan if isinstance(value, bool) or not isinstance(value, Real) else float(value)
    except OverflowError:
        return math.inf


def real(allowed: str, test: Callable[[float], bool] = math.isfinite) -> Callable[[Any], float]:
    """A check for a real number that passes a test, `allowed` in words."""

    def check(value: Any) -> float:
        number = value if type(value) is float else converted(value)
        if not (math.isfinite(number) and test(number)):
            raise ValueError(f"found {shown(value)}, allowed: {allowed}")
        return number

    return check


finite = real("a finite number")


def numbers_of(count: int, each: Callable[[Any], float], allowed: str) -> Callable[[Any], tuple[float, ...]]:
    """A check for so many numbers, `allowed` in words."""

    def check(value: Any) -> tuple[float, ...]:
        try:
            numbers = tuple(each(number) for number in items(value))
        except ValueError:
            numbers = ()
        if len(numbers) != count:
            raise ValueError(f"found {shown(value)}, allowed: {allowed}")
        return numbers

    return check


def items(value: Any) -> Iterable[Any]:
    """What a list holds; raises ValueError for anything else."""
    if isinstance(value, str | bytes | Mapping) or not isinstance(value, Iterable):
        raise ValueError(f"found {shown(value)}, allowed: a list")
    return value
