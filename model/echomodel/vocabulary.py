"""The words of the project: categories, predicates and room types, read from `vocabulary.json` (data, not code)."""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cache
from importlib import resources


@dataclass(frozen=True)
class Category:
    """A fine object category, its SG-FRONT classes, and what it rests on (`floor`, `table`, `wall` or `ceiling`)."""

    name: str
    coarse: str
    sgfront: str
    support: str
    aliases: tuple[str, ...] = ()


@dataclass(frozen=True)
class Predicate:
    """A relation with its SG-FRONT id and spelling and its logic.

    `inverse` is None where no predicate says the same of the swapped pair. `order` names the order that the predicate
    belongs to (left and right share one) and `rank` is 1 where the subject comes after the object, -1 where before.
    `swapped` are words that mean this predicate with subject and object exchanged; they are named in errors only.
    """

    name: str
    id: int
    sgfront: str
    inverse: str | None
    symmetric: bool
    transitive: bool
    order: str | None
    rank: int
    aliases: tuple[str, ...] = ()
    swapped: tuple[str, ...] = ()


@dataclass(frozen=True)
class RoomType:
    """A kind of room and what people call it."""

    name: str
    aliases: tuple[str, ...] = ()


class UnknownWord(ValueError):
    """A word that the vocabulary does not hold; the message names the nearest ones."""


@dataclass(frozen=True)
class Vocabulary:
    """All words in a fixed order: the position of a category is its class id in the compact model."""

    categories: tuple[Category, ...]
    structure: tuple[str, ...]
    coarse_categories: tuple[str, ...]
    predicates: tuple[Predicate, ...]
    room_types: tuple[RoomType, ...]
    unsupported: tuple[str, ...]
    _index: dict[str, dict[str, int]] = field(init=False, repr=False, compare=False, default_factory=dict)

    def __post_init__(self) -> None:
        words: dict[str, Iterable[Category | Predicate | RoomType]] = {
            "category": self.categories,
            "predicate": self.predicates,
            "room type": self.room_types,
        }
        for kind, entries in words.items():
            index = {word: i for i, entry in enumerate(entries) for word in entry.aliases}
            index.update({entry.name: i for i, entry in enumerate(entries)})
            self._index[kind] = index

    def category(self, word: str) -> Category:
        """The category called `word` (name or alias, any case, spaces or hyphens); raises `UnknownWord`."""
        return self.categories[self._find("category", word)]

    def predicate(self, word: str) -> Predicate:
        """The predicate called `word` (name, alias or SG-FRONT spelling); raises `UnknownWord`."""
        return self.predicates[self._find("predicate", word)]

    def room_type(self, word: str) -> RoomType:
        """The room type called `word` (name or alias); raises `UnknownWord`."""
        return self.room_types[self._find("room type", word)]

    def category_id(self, word: str) -> int:
        """Position of a category: its class id in the compact model."""
        return self._find("category", word)

    def predicate_id(self, word: str) -> int:
        """SG-FRONT id of a predicate, 0 (`in`) to 15."""
        return self.predicates[self._find("predicate", word)].id

    def room_type_id(self, word: str) -> int:
        """Position of a room type."""
        return self._find("room type", word)

    def _find(self, kind: str, word: str) -> int:
        index = self._index[kind]
        if word in index:  # the canonical spelling, as in most calls
            return index[word]
        key = normalised(word)
        if key in index:
            return index[key]
        if kind == "predicate":
            for predicate in self.predicates:
                if key in predicate.swapped:
                    raise UnknownWord(f"unknown predicate {word!r}: swap the two objects and say {predicate.name}")
        unsupported = kind == "category" and key in self.unsupported
        close = [] if unsupported else difflib.get_close_matches(key, index, n=3)
        close = [match for match in close if _alike(key, match) > _alike(key, close[0]) - 0.1]
        near = list(dict.fromkeys(self._name(kind, index[match]) for match in close))
        hint = f"did you mean {' or '.join(near)}?" if near else f"allowed: {', '.join(self._names(kind))}"
        known = " (seen in real rooms, not supported)" if unsupported else ""
        raise UnknownWord(f"unknown {kind} {word!r}{known}: {hint}")

    def _names(self, kind: str) -> list[str]:
        words: dict[str, tuple[Category, ...] | tuple[Predicate, ...] | tuple[RoomType, ...]] = {
            "category": self.categories,
            "predicate": self.predicates,
            "room type": self.room_types,
        }
        return [entry.name for entry in words[kind]]

    def _name(self, kind: str, position: int) -> str:
        return self._names(kind)[position]


def _alike(one: str, other: str) -> float:
    return difflib.SequenceMatcher(None, one, other).ratio()


def normalised(word: str) -> str:
    """`Night Stand` -> `night_stand`: lower case, runs of spaces and hyphens become one underscore."""
    return re.sub(r"[\s\-]+", "_", word.strip().lower())


@cache
def vocabulary() -> Vocabulary:
    """The vocabulary that ships with the package."""
    raw = json.loads(resources.files("echomodel").joinpath("vocabulary.json").read_text("utf-8"))

    def frozen(entry: dict) -> dict:
        return {key: tuple(value) if isinstance(value, list) else value for key, value in entry.items()}

    return Vocabulary(
        categories=tuple(Category(**frozen(entry)) for entry in raw["categories"]),
        structure=tuple(raw["structure"]),
        coarse_categories=tuple(raw["coarse_categories"]),
        predicates=tuple(Predicate(**frozen(entry)) for entry in raw["predicates"]),
        room_types=tuple(RoomType(**frozen(entry)) for entry in raw["room_types"]),
        unsupported=tuple(raw["unsupported"]),
    )
