"""The words of the project: rows of `vocabulary.json` (data, not code)."""

import difflib
import json
import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache, cached_property
from importlib import resources
from typing import Any

from echomodel.rows import (
    INVITES,
    MEASURES,
    ROLES,
    STANCES,
    SUPPORTS,
    TASKS,
    UNITES,
    Category,
    Habit,
    HomeRelation,
    Placement,
    Predicate,
    PredicateKind,
    RoomStyle,
    RoomType,
)

__all__ = [
    "Category", "Predicate", "PredicateKind", "RoomStyle", "RoomType", "UnknownWord", "Vocabulary", "normalised",
    "speaking", "vocabulary",
]  # fmt: skip

ONE_OF = {"categories": "category", "predicates": "predicate", "room_types": "room type"}
TYPO = 0.72  # likeness from which a word is taken for another one with a slip: carpet is no cabinet


class UnknownWord(ValueError):
    """A word that the vocabulary does not hold; the message names the nearest ones."""


@dataclass(frozen=True)
class Vocabulary:
    """All words; the position of a category or room type and the id of a predicate are its numbers in `GraphBatch`.

    The order of rows means nothing: predicates stand by their ids, and what outlives a process names its words.

    Raises ValueError where a row names something that does not exist, or ids of predicates are not 0, 1, 2 ... each
    once.
    """

    categories: tuple[Category, ...]
    structure: tuple[str, ...]
    coarse_categories: tuple[str, ...]
    predicate_kinds: tuple[PredicateKind, ...]
    predicates: tuple[Predicate, ...]
    room_types: tuple[RoomType, ...]
    unsupported: tuple[str, ...]
    habits: tuple[Habit, ...] = ()
    placements: tuple[Placement, ...] = ()
    home_relations: tuple[HomeRelation, ...] = ()
    styles: tuple[RoomStyle, ...] = ()
    meant: dict[str, dict[str, tuple[str, ...]]] = field(default_factory=dict, hash=False)
    hints: dict[str, str] = field(default_factory=dict, hash=False)
    _index: dict[str, dict[str, int]] = field(init=False, repr=False, compare=False, default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "predicates", tuple(sorted(self.predicates, key=lambda row: row.id)))
        for kind, entries in self._rows.items():
            index = {word: i for i, entry in enumerate(entries) for word in entry.aliases}
            index.update({entry.name: i for i, entry in enumerate(entries)})
            self._index[kind] = index
        self._check()

    @property
    def _rows(self) -> dict[str, Sequence[Category | Predicate | RoomType | Placement | HomeRelation | RoomStyle]]:
        """The rows of every kind of word."""
        return {
            "category": self.categories,
            "predicate": self.predicates,
            "room type": self.room_types,
            "placement": self.placements,
            "relation of rooms": self.home_relations,
            "style": self.styles,
        }

    def category(self, word: str) -> Category:
        """The category called `word` (name or alias, any case, spaces or hyphens); raises `UnknownWord`."""
        return self.categories[self._find("category", word)]

    def known_category(self, word: str) -> Category | None:
        """As `category`, but None for a word that the vocabulary does not hold, without looking for one like it."""
        found = self._known("category", word)
        return None if found is None else self.categories[found]

    def name_of(self, kind: str, word: str) -> str:
        """The name that a word of `categories`, `predicates` or `room_types` has today; itself where it is unknown."""
        found = self._known(ONE_OF[kind], word)
        return word if found is None else getattr(self, kind)[found].name

    def predicate(self, word: str) -> Predicate:
        """The predicate called `word` (name, alias or SG-FRONT spelling); raises `UnknownWord`."""
        return self.predicates[self._find("predicate", word)]

    def room_type(self, word: str) -> RoomType:
        """The room type called `word` (name or alias); raises `UnknownWord`."""
        return self.room_types[self._find("room type", word)]

    def known_room_type(self, word: str) -> RoomType | None:
        """As `room_type`, but None for a word that the vocabulary does not hold."""
        found = self._known("room type", word)
        return None if found is None else self.room_types[found]

    def placement(self, word: str) -> Placement:
        """The placement called `word` (name or alias); raises `UnknownWord`."""
        return self.placements[self._find("placement", word)]

    def home_relation(self, word: str) -> HomeRelation:
        """The relation of two rooms called `word` (name or alias); raises `UnknownWord`."""
        return self.home_relations[self._find("relation of rooms", word)]

    def style(self, word: str) -> RoomStyle:
        """The style called `word` (name or alias); raises `UnknownWord`."""
        return self.styles[self._find("style", word)]

    def known_style(self, word: str | None) -> RoomStyle | None:
        """As `style`, but None for no word, and for one that the vocabulary does not hold."""
        found = None if word is None else self._known("style", word)
        return None if found is None else self.styles[found]

    @cached_property
    def sgfront_predicates(self) -> dict[int, str]:
        """Id and spelling of SG-FRONT's predicates, `in` (0) among them."""
        return {entry.id: entry.sgfront for entry in self.predicates if entry.sgfront is not None}

    def swapped(self, word: str) -> Predicate | None:
        """The predicate that `word` means with subject and object exchanged, such as above for under."""
        return next((entry for entry in self.predicates if normalised(word) in entry.swapped), None)

    def uniting(self, what: str) -> tuple[int, ...]:
        """Ids of the predicates whose objects have `what` (one of `UNITES`) in common."""
        return tuple(entry.id for entry in self.predicates if what in entry.unites)

    @cached_property
    def cornered(self) -> frozenset[str]:
        """Categories into whose box what stands before them may reach: the inner corner of an L."""
        before = {row.name for row in self.categories if row.stands == "before"}
        return frozenset(row.name for row in self.categories if before & {word for word, _ in row.admits})

    @cached_property
    def predicate_names(self) -> frozenset[str]:
        """The names of all predicates, without aliases."""
        return frozenset(entry.name for entry in self.predicates)

    def category_id(self, word: str) -> int:
        """Position of a category: its class id in the compact model."""
        return self._find("category", word)

    def predicate_id(self, word: str) -> int:
        """Id of a predicate, which is SG-FRONT's where SG-FRONT has it."""
        return self.predicates[self._find("predicate", word)].id

    def room_type_id(self, word: str) -> int:
        """Position of a room type."""
        return self._find("room type", word)

    def _check(self) -> None:
        categories, predicates = ({entry.name for entry in rows} for rows in (self.categories, self.predicates))
        words = {"coarse": self.coarse_categories, "support": SUPPORTS, "role": ROLES, "stands": STANCES,
                 "task": TASKS, "like": {"", *categories}}  # fmt: skip
        for row in self.categories:
            for what, allowed in words.items():
                _known(f"category {row.name}", what, (getattr(row, what),), allowed)
            _known(f"category {row.name}", "belongs_to", row.belongs_to, categories)
            _known(f"category {row.name}", "invites", row.invites, INVITES)
            _known(f"category {row.name}", "admits", (word for word, _ in row.admits), categories | set(ROLES))
        kinds = {kind.name for kind in self.predicate_kinds}
        for position, relation in enumerate(self.predicates):
            where = f"predicate {relation.name}"
            if relation.id != position:
                raise ValueError(f"{where}: id is {relation.id}, expected {position}: ids are 0, 1, 2 ... each once")
            _known(where, "kind", (relation.kind,), kinds)
            _known(where, "measures", (relation.measures,), MEASURES)
            for what in ("inverse", "mirror_x", "mirror_z"):
                _known(where, what, (getattr(relation, what),), predicates | {None})
            _known(where, "unites", relation.unites, UNITES)
        for room in self.room_types:
            _known(f"room type {room.name}", "contents", (word for word, _ in room.contents), categories)
            _known(f"room type {room.name}", "signs", room.signs, {*categories, *self.coarse_categories})
            types = {other.name for other in self.room_types}
            _known(f"room type {room.name}", "like", (room.like,), {"", *types})
            _known(f"room type {room.name}", "zones", (word for word, _ in room.zones), types)
        for habit in self.habits:
            _known("habits", "category", (*habit.categories, *habit.anchors), categories)
            _known("habits", "predicate", (*habit.predicates, *habit.sides, *habit.among), predicates)

    def _known(self, kind: str, word: str) -> int | None:
        index = self._index[kind]
        return index[word] if word in index else index.get(normalised(word))  # the canonical spelling in most calls

    def _find(self, kind: str, word: str) -> int:
        found = self._known(kind, word)
        if found is not None:
            return found
        index, key = self._index[kind], normalised(word)
        if kind == "predicate":
            for predicate in self.predicates:
                if key in predicate.swapped:
                    raise UnknownWord(f"unknown predicate {word!r}: swap the two objects and say {predicate.name}")
        unsupported = kind == "category" and key in self.unsupported
        meant = self.meant.get(kind, {}).get(key)
        allowed = f"allowed: {', '.join(row.name for row in self._rows[kind])}"
        if meant is not None:
            hint = self.hints.get(meant[0], f"nearest by meaning: {', '.join(meant)}") if meant else allowed
            raise UnknownWord(f"unknown {kind} {word!r} (not supported): {hint}")
        close = [] if unsupported else difflib.get_close_matches(key, index, n=3, cutoff=TYPO)
        close = [match for match in close if _alike(key, match) > _alike(key, close[0]) - 0.1]
        near = list(dict.fromkeys(self._rows[kind][index[match]].name for match in close))
        hint = f"did you mean {' or '.join(near)}?" if near else allowed
        known = " (seen in real rooms, not supported)" if unsupported else ""
        raise UnknownWord(f"unknown {kind} {word!r}{known}: {hint}")


def _known(where: str, what: str, words: Iterable[str | None], allowed: Collection[str | None]) -> None:
    for word in words:
        if word not in allowed:
            raise ValueError(f"{where}: {what} is {word!r}, allowed: {', '.join(sorted(map(str, allowed)))}")


def _alike(one: str, other: str) -> float:
    return difflib.SequenceMatcher(None, one, other).ratio()


def normalised(word: str) -> str:
    """`Night Stand` -> `night_stand`: lower case, runs of spaces and hyphens become one underscore."""
    return re.sub(r"[\s\-]+", "_", word.strip().lower())


def vocabulary() -> Vocabulary:
    """The vocabulary that is spoken: the one that ships with the package, but within `speaking`."""
    return _spoken[-1] if _spoken else _shipped()


@contextmanager
def speaking(words: Vocabulary) -> Iterator[Vocabulary]:
    """Within the block, `vocabulary()` is `words`: how a new row is tried out."""
    _spoken.append(words)
    try:
        yield words
    finally:
        _spoken.pop()


_spoken: list[Vocabulary] = []


@cache
def _shipped() -> Vocabulary:
    raw = json.loads(resources.files("echomodel").joinpath("vocabulary.json").read_text("utf-8"))

    def fixed(value: Any) -> Any:
        return tuple(fixed(v) for v in value) if isinstance(value, list) else value

    kinds: dict[str, Any] = {
        "categories": Category, "predicate_kinds": PredicateKind, "predicates": Predicate, "room_types": RoomType,
        "habits": Habit, "placements": Placement, "home_relations": HomeRelation, "styles": RoomStyle,
    }  # fmt: skip
    rows: dict[str, Any] = {
        name: tuple(kind(**{key: fixed(value) for key, value in entry.items()}) for entry in raw[name])
        for name, kind in kinds.items()
    }
    words = {name: tuple(raw[name]) for name in ("structure", "coarse_categories", "unsupported")}
    meant = {kind: {word: tuple(near) for word, near in words_of.items()} for kind, words_of in raw["meant"].items()}
    return Vocabulary(**rows, **words, hints=raw["hints"], meant=meant)
