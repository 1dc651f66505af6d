"""Sentences that people write about the objects of a room: `bed left of wardrobe`, `plant in corner`, `table between
sofa and armchair`."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from echomodel.vocabulary import TYPO, UnknownWord, normalised, vocabulary
from echousd.graph.consistency import GraphError
from echousd.graph.fields import shown
from echousd.graph.nodes import Placed, Relation
from echousd.graph.syntax import Path
from echousd.graph.titles import composed, name_of, with_names

if TYPE_CHECKING:
    from echousd.graph.scene import SceneGraph


def fields_of_sentence(entry: Any, about: Path, names: Mapping[str, str] | None = None) -> dict[str, Any] | Placed:
    """The fields of a relation, or a placement, from `bed left of wardrobe`, [bed, left, wardrobe] or a mapping.

    Arguments:
        about: where in the file it stands, for errors. names: titles of objects and the names they go by.
    """
    known = names or {}
    if isinstance(entry, Mapping):
        return {k: name_of(v, known) if k in ("subject", "object") else v for k, v in entry.items()}
    words = with_names(composed(entry), known).split() if isinstance(entry, str) else entry
    listed = isinstance(words, list) and all(isinstance(word, str) for word in words)
    if listed:
        words = [name_of(word, known) for word in words]
        placed = _placed(words, about)
        if placed is not None:
            return placed
    if not listed or len(words) < 3:
        raise GraphError(
            f"relation {shown(entry)}: allowed: subject predicate object, such as bed left wardrobe", about
        )
    subject, predicate, object_ = words[0], " ".join(words[1:-1]), words[-1]
    _refuse_slip(words, about)
    turned = vocabulary().swapped(predicate)  # "table under lamp" is "lamp above table"
    if turned is not None:
        subject, predicate, object_ = object_, turned.name, subject
    return {"subject": subject, "predicate": predicate, "object": object_}


def _placed(words: list[str], about: Path) -> Placed | None:
    """The placement that words state, None where they state none; raises `GraphError` for two others that are not."""
    if len(words) < 2:
        return None
    alone = _placement(" ".join(words[1:]))
    if alone is not None:
        return Placed(words[0], alone)
    pair = [word for word in words if normalised(word) not in ("and", "&")]
    named = _placement(" ".join(pair[1:-2])) if len(pair) > 3 else _placement(" ".join(pair[1:-1]))
    if named is None:
        return None
    others = tuple(word.strip(",") for word in pair[-2:])
    if len(pair) < 4:
        said = " ".join(words)
        raise GraphError(f"'{said}': found one other object, allowed: two, such as table {named} sofa and chair", about)
    return Placed(words[0], named, others)


def _refuse_slip(words: list[str], about: Path) -> None:
    """Raise `GraphError` for words that are no predicate but nearly a placement: `e agaist wall`."""
    try:
        vocabulary().predicate(" ".join(words[1:-1]))
    except UnknownWord:
        said = {word: row for row in vocabulary().placements for word in (row.name, *row.aliases)}
        whole, first = normalised(" ".join(words[1:])), normalised(words[1])
        alone = [word for word, row in said.items() if not row.others]
        near = difflib.get_close_matches(whole, alone, n=1, cutoff=TYPO)
        if "and" in words[2:]:
            near = near or difflib.get_close_matches(first, [w for w in said if w not in alone], n=1, cutoff=TYPO)
        if near:
            text = f"relation '{' '.join(words)}': did you mean {said[near[0]].name.replace('_', ' ')}?"
            raise GraphError(text, about) from None


def _placement(words: str) -> str | None:
    try:
        row = vocabulary().placement(words) if words else None
    except UnknownWord:
        return None
    exact = row is not None and normalised(words) in (row.name, *row.aliases)
    return row.name if row is not None and exact else None


def sentence(text: str, names: Mapping[str, str] | None = None) -> Relation | Placed:
    """What a sentence states; raises `GraphError`."""
    said = fields_of_sentence(text, (), names)
    return said if isinstance(said, Placed) else Relation(**said)


def placed_fields(placed: Placed) -> dict[str, Any]:
    """The field of a node that states a placement."""
    return {"between": placed.others} if placed.others else {"place": placed.placement}


def stating(graph: SceneGraph, text: str) -> SceneGraph:
    """The graph in which a sentence holds as well; raises `GraphError`."""
    said = sentence(text, graph.titles)
    if isinstance(said, Placed):
        return graph.update_node(said.subject, **placed_fields(said))
    return graph.relate(said.subject, said.predicate, said.object)


def without(graph: SceneGraph, text: str) -> SceneGraph:
    """The graph without what a sentence states; raises `GraphError` where it does not."""
    said = sentence(text, graph.titles)
    if isinstance(said, Relation):
        return graph.unrelate(said.subject, said.predicate, said.object)
    held = graph.node(said.subject).placements
    if not any(one.placement == said.placement and set(one.others) == set(said.others) for one in held):
        told = ", ".join(map(str, held)) or "nothing"
        raise GraphError(f"'{said}' is not stated in this graph; of the place of {said.subject}: {told}")
    return graph.update_node(said.subject, **dict.fromkeys(placed_fields(said)))
