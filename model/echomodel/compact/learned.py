"""What weights know of the vocabulary: the words that they name, wherever those stand in it today."""

from collections.abc import Collection

import numpy as np

from echomodel.arrays import Array, beside
from echomodel.config import CompactConfig
from echomodel.graph import GraphBatch
from echomodel.vocabulary import Vocabulary, vocabulary

Names = tuple[str, ...]
_PLACES: dict[tuple[str, Names], tuple[Vocabulary, np.ndarray]] = {}


def places(kind: str, names: Names, words: Array) -> Array:
    """Row of each of some words among those that weights name; an unknown word has that of what its row is `like`.

    Arguments:
        kind: `categories` or `room_types`. names: of the weights' rows.
        words: (...) int64, positions in the vocabulary.

    Raises ValueError for a word that the weights do not know, like nothing that they know.
    """
    table = table_of(kind, names)
    found = beside(table, words)[words]
    if (table < 0).any() and bool((found < 0).any()):
        row = getattr(vocabulary(), kind)[int(words[found < 0][0])]
        like = "" if _like(row) in ("", row.name) else f", nor {_like(row)!r}, which its row names as the nearest"
        raise ValueError(f"these weights do not know {row.name!r}{like}")
    return found


def table_of(kind: str, names: Names) -> np.ndarray:
    """(W,) int64: for every word of the vocabulary the row of weights that name `names`, -1 where there is none."""
    words = vocabulary()
    spoken, table = _PLACES.get((kind, names), (None, None))
    if spoken is not words or table is None:
        row_of = {words.name_of(kind, name): row for row, name in enumerate(names)}
        nearest = [_nearest(kind, row.name, row_of) for row in getattr(words, kind)]
        table = np.array([-1 if name is None else row_of[name] for name in nearest])
        _PLACES[kind, names] = words, table
    return table


def unlearned(graph: GraphBatch, config: CompactConfig) -> tuple[str, ...]:
    """One sentence for every word of the graph that the weights do not know, and what becomes of it."""
    lines = []
    for kind, text, held in (
        ("categories", "category", graph.category),
        ("room_types", "room type", graph.room_type),
        ("predicates", "relation", graph.triplets[:, 1]),
    ):
        known = {vocabulary().name_of(kind, name) for name in getattr(config, kind)}
        for row in (getattr(vocabulary(), kind)[number] for number in sorted(set(held.tolist()))):
            if row.name not in known:
                becomes = f"generated as {_nearest(kind, row.name, known)}"
                if kind == "predicates":
                    becomes = "guided, placed and checked, not generated"
                lines.append(f"the weights do not know the {text} {row.name}: {becomes}")
    return tuple(lines)


def _nearest(kind: str, word: str, known: Collection[str]) -> str | None:
    """The first of `known` on the way from a word to what its row is like, and so on; relations are like no other."""
    rows = {row.name: row for row in getattr(vocabulary(), kind)}
    passed: set[str] = set()
    while word not in known:
        if kind == "predicates" or word in passed or word not in rows:
            return None
        passed.add(word)
        word = _like(rows[word])
    return word


def _like(row: object) -> str:
    return getattr(row, "like", "") or getattr(row, "sgfront", "")
