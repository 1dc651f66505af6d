"""What weights have learned of the vocabulary: its first words. A graph in newer words becomes one in theirs."""

from __future__ import annotations

from dataclasses import replace

from torch import Tensor

from echomodel.config import CompactConfig
from echomodel.graph import GraphBatch
from echomodel.vocabulary import vocabulary


def in_learned_words(graph: GraphBatch, config: CompactConfig) -> GraphBatch:
    """The graph as the networks take it: newer categories and room types as what their rows say they are like (a
    category's `sgfront`, a room type's `like`), relations of newer predicates left out.

    Raises:
        ValueError: a row that names nothing the weights know.
    """
    triplets = graph.triplets[graph.triplets[:, 1] < config.predicates]
    words = vocabulary()
    category = _nearest(graph.category, config.categories, [(row.name, row.sgfront) for row in words.categories])
    room_type = _nearest(graph.room_type, config.room_types, [(row.name, row.like) for row in words.room_types])
    return replace(graph, category=category, room_type=room_type, triplets=triplets)


def unlearned(graph: GraphBatch, config: CompactConfig) -> tuple[str, ...]:
    """One sentence for every word of the graph that the weights do not know, and what becomes of it."""
    words = vocabulary()
    said = [
        f"the weights do not know the category {row.name}: generated as {row.sgfront}"
        for number, row in enumerate(words.categories)
        if number >= config.categories and bool((graph.category == number).any())
    ]
    said += [
        f"the weights do not know the room type {row.name}: generated as {row.like}"
        for number, row in enumerate(words.room_types)
        if number >= config.room_types and bool((graph.room_type == number).any())
    ]
    return tuple(said) + tuple(
        f"the weights do not know the relation {row.name}: guided, repaired and checked, not generated"
        for row in words.predicates[config.predicates :]
        if bool((graph.triplets[:, 1] == row.id).any())
    )


def _nearest(number: Tensor, known: int, rows: list[tuple[str, str]]) -> Tensor:
    """Numbers of words with those from `known` on replaced by that of the word that they are like."""
    place = {name: k for k, (name, _) in enumerate(rows)}
    out = number.clone()
    for new in number[number >= known].unique().tolist():
        name, like = rows[new]
        if place.get(like, known) >= known:
            raise ValueError(f"these weights know neither {name!r} nor {like!r}, which its row names as the nearest")
        out[number == new] = place[like]
    return out
