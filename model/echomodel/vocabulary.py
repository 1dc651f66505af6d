"""The words of the project: categories, predicates and room types, read from `vocabulary.json` (data, not code)."""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import Any

SUPPORTS = ("floor", "table", "wall", "ceiling")
ROLES = ("seat", "sofa", "board", "bed", "storage", "light", "screen", "decor")  # boards are tables and desks
# at a table or desk, before a sofa, at a bed's head, at a foot end, beside, opposite, in the company of a sofa, on top
STANCES = ("", "at", "before", "head", "foot", "beside", "opposite", "company", "on", "near")


@dataclass(frozen=True)
class Category:
    """Everything that the product knows of a fine object category; code asks the row and lists no words of its own.

    Arguments:
        coarse, sgfront: its SG-FRONT classes, simple and fine.
        support: what it rests on, one of `SUPPORTS`.
        role: what people use it for, one of `ROLES`.
        look: how its materials are laid out (`echousd.room.looks.BANDS`).
        density: mass over the volume of the whole box, kg/m³ (furniture is mostly hollow).
        ade20k: its name among the 150 classes of ADE20K.
        colour: of its boxes in pictures of graphs, `#rrggbb`.
        wall: it stands with its back to a wall (in at least four of five real rooms).
        carries: a lamp, a television or a plant may stand on its top.
        hangs: it may also hang on a wall.
        solid: its collider may be one hull; everything else has room below or inside that other things need.
        access: metres in front that must stay free, so that it can be opened or used.
        belongs_to: categories that it attends, the likeliest first.
        stands: how it stands to them, one of `STANCES`.
        admits: (category or role, share): how far such a thing's box may reach into this one's, as a share of that
            thing's smaller horizontal side.
        aliases: what people call it.
    """

    name: str
    coarse: str
    sgfront: str
    support: str
    role: str
    look: str
    density: float
    ade20k: str
    colour: str = "#eeeeee"
    wall: bool = False
    carries: bool = False
    hangs: bool = False
    solid: bool = False
    access: float = 0.0
    belongs_to: tuple[str, ...] = ()
    stands: str = ""
    admits: tuple[tuple[str, float], ...] = ()
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
        for row in self.categories:
            self._check(row)

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

    def _check(self, row: Category) -> None:
        """Raise ValueError where a row names something that does not exist."""
        names = {entry.name for entry in self.categories}
        for what, words, allowed in (
            ("coarse", (row.coarse,), set(self.coarse_categories)),
            ("support", (row.support,), set(SUPPORTS)),
            ("role", (row.role,), set(ROLES)),
            ("belongs_to", row.belongs_to, names),
            ("admits", tuple(word for word, _ in row.admits), names | set(ROLES)),
        ):
            for word in words:
                if word not in allowed:
                    raise ValueError(f"category {row.name}: {what} is {word!r}, allowed: {', '.join(sorted(allowed))}")

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

    def fixed(value: Any) -> Any:
        return tuple(fixed(v) for v in value) if isinstance(value, list) else value

    def frozen(entry: dict) -> dict:
        return {key: fixed(value) for key, value in entry.items()}

    return Vocabulary(
        categories=tuple(Category(**frozen(entry)) for entry in raw["categories"]),
        structure=tuple(raw["structure"]),
        coarse_categories=tuple(raw["coarse_categories"]),
        predicates=tuple(Predicate(**frozen(entry)) for entry in raw["predicates"]),
        room_types=tuple(RoomType(**frozen(entry)) for entry in raw["room_types"]),
        unsupported=tuple(raw["unsupported"]),
    )
