"""A first graph of a room type and counts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

from echomodel.rows import Habit
from echomodel.vocabulary import vocabulary
from echousd.graph.consistency import GraphError, triple_faults
from echousd.graph.nodes import Node, Relation, RoomSpec
from echousd.graph.scene import SceneGraph

MAX_COUNT = 100
DEALT = ("at", "head", "before", "foot")  # stances of what serves one anchor: no desk has two chairs, another none


def starting_graph(
    room: RoomSpec | str, counts: Mapping[str, int] | None = None, relations: Iterable[Relation] = ()
) -> SceneGraph:
    """A graph to begin with: what such a room usually holds, changed by `counts`, related as such objects usually are.

    Arguments:
        room: the room, or its type.
        counts: objects per category (or alias); 0 leaves out what the room would hold otherwise.
        relations: what has to hold; a usual relation that contradicts them is left out.

    Raises `GraphError` for unknown words, counts that are none and a room that is left empty.
    """
    room = RoomSpec(room) if isinstance(room, str) else room
    wanted = dict(vocabulary().room_type(room.type).contents)
    for word, count in (counts or {}).items():
        if isinstance(count, bool) or not isinstance(count, int) or not 0 <= count <= MAX_COUNT:
            raise GraphError(f"count of {word}: found {count!r}, allowed: an integer from 0 to {MAX_COUNT}")
        wanted[vocabulary().category(word).name] = count
    places = dict(vocabulary().room_type(room.type).places)
    nodes: dict[str, list[Node]] = {
        category: [_node(category, i, count, places.get(category)) for i in range(count)]
        for category, count in wanted.items()
        if count
    }
    usual: list[Relation] = []
    served: Counter[tuple[str, str]] = Counter()
    for habit in vocabulary().habits:
        for category in habit.categories:
            anchors = [anchor for word in habit.anchors if word != category for anchor in nodes.get(word, ())]
            if anchors:
                usual += _related(habit, nodes.get(category, []), anchors, served)
    graph = SceneGraph(room, tuple(node for group in nodes.values() for node in group), tuple(relations))
    if not graph.relations:
        return graph.replaced(relations=tuple(usual))
    kept = list(graph.relations)
    for relation in usual:
        if not triple_faults([other.triple for other in (*kept, relation)], graph.names):
            kept.append(relation)
    stated = len(graph.relations)
    return graph.replaced(relations=(*kept[stated:], *kept[:stated]))


def _node(category: str, position: int, count: int, place: str | None) -> Node:
    """Several objects of a category are numbered and share a style; fitted units have that of the room."""
    if count == 1:
        return Node(category, category, place=place)
    fitted = vocabulary().category(category).stands in ("row", "over")
    fields: dict[str, Any] = {} if fitted else {"style": category}
    return Node(f"{category}_{position + 1}", category, place=place, **fields)


def _related(habit: Habit, nodes: list[Node], anchors: list[Node], served: Counter[tuple[str, str]]) -> list[Relation]:
    """Objects are dealt to anchors in turn where each serves one (a lamp its nightstand, a chair its desk).

    What keeps a sofa company or goes into a wall's row all goes to the first.

    Arguments:
        served: how many who stand so each anchor has, of whatever category: two kinds of chairs go to two desks.
    """
    near = bool(habit.sides or {"front", "close_by", "opposite"} & set(habit.predicates))
    relations: list[Relation] = []
    sets: dict[str, list[Node]] = {}
    for i, node in enumerate(nodes):
        stance, anchor = vocabulary().category(node.category).stands, anchors[0]
        if near and stance in DEALT:
            alike = [other for other in anchors if other.category == anchor.category]
            anchor = min(alike, key=lambda other: served[stance, other.name])
            served[stance, anchor.name] += "close_by" in habit.predicates
        elif not near:
            anchor = anchors[i % len(anchors)]
        there = sets.setdefault(anchor.name, [])
        relations += [Relation(node.name, predicate, anchor.name) for predicate in habit.predicates]
        if habit.sides:
            relations.append(Relation(node.name, habit.sides[len(there) % len(habit.sides)], anchor.name))
        if there:
            among = [word for word in habit.among if len(there) == 1 or vocabulary().predicate(word).transitive]
            relations += [Relation(node.name, predicate, there[0].name) for predicate in among]
        there.append(node)
    return relations
