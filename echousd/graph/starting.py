"""A first graph from a room type and counts: each object relates to the one it usually stands with, nothing more."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from echomodel.vocabulary import vocabulary
from echousd.graph.consistency import GraphError, check_triples
from echousd.graph.nodes import Node, Relation, RoomSpec
from echousd.graph.scene import SceneGraph

BEDS = ("double_bed", "single_bed", "kids_bed")
SOFAS = ("multi_seat_sofa", "l_shaped_sofa", "sofa", "loveseat_sofa", "chaise_longue_sofa")
TABLES = ("dining_table", "coffee_table")


@dataclass(frozen=True)
class Habit:
    """How objects of some categories stand to the first of `anchors` that the room holds.

    Arguments:
        categories: whose habit it is.
        anchors: categories to relate to, the preferred ones first.
        predicates: what holds between the object and its anchor.
        sides: predicates of which successive objects at one anchor get one each, in turn.
    """

    categories: tuple[str, ...]
    anchors: tuple[str, ...]
    predicates: tuple[str, ...] = ()
    sides: tuple[str, ...] = ()


# In the order in which they apply. Anchors come before what leans on them, so that the relations form a forest, which
# cannot contradict itself. Beds and sofas have their back at -X: what they face is in front of them.
HABITS = (
    Habit(("nightstand",), BEDS, ("close_by",), ("left", "right")),
    Habit(("dresser", "dressing_table", "desk"), BEDS, (), ("right", "left")),
    Habit(("wardrobe",), BEDS, ("taller_than",), ("right", "left")),
    Habit(("coffee_table",), SOFAS, ("front",)),
    Habit(("tv_stand",), ("coffee_table", *SOFAS, *BEDS), ("front",)),
    Habit(("dining_table",), SOFAS, (), ("right",)),
    Habit(("armchair", "lounge_chair", "lazy_sofa"), (*SOFAS, *TABLES), (), ("right", "left")),
    Habit(("side_table", "corner_side_table", "round_end_table"), (*SOFAS, *BEDS), ("close_by",), ("left", "right")),
    Habit(("ottoman", "bench"), (*SOFAS, *BEDS), ("front",)),
    Habit(("dining_chair", "chinese_chair"), ("dining_table", "desk"), ("close_by",), ("left", "right")),
    Habit(("office_chair", "chair"), ("desk", "dining_table"), ("front", "close_by")),
    Habit(("dressing_chair", "stool"), ("dressing_table",), ("front", "close_by")),
    Habit(("sideboard", "cabinet", "wine_cabinet"), ("dining_table", *SOFAS), (), ("front", "behind")),
    Habit(("bookshelf", "shelf"), ("desk", *SOFAS, *BEDS), ("taller_than",)),
    Habit(("pendant_lamp", "ceiling_lamp"), (*TABLES, *BEDS, "desk", *SOFAS), ("above",)),
    Habit(("table_lamp",), ("nightstand", "desk", "side_table", "sideboard", "dresser"), ("standing_on",)),
    Habit(("tv",), ("tv_stand",), ("standing_on",)),
    Habit(("floor_lamp",), ("armchair", "lounge_chair", *SOFAS, *BEDS, "desk"), ("close_by", "taller_than")),
    Habit(("plant",), ("tv_stand", "sideboard", "bookshelf", *SOFAS), ("close_by",)),
)

MAX_COUNT = 100


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
    nodes: dict[str, list[Node]] = {
        category: [_node(category, i, count) for i in range(count)] for category, count in wanted.items() if count
    }
    usual: list[Relation] = []
    for habit in HABITS:
        for category in habit.categories:
            anchors = [anchor for word in habit.anchors for anchor in nodes.get(word, ())]
            if anchors:
                usual += _related(habit, nodes.get(category, []), anchors)
    graph = SceneGraph(room, tuple(node for group in nodes.values() for node in group), tuple(relations))
    if not graph.relations:
        return graph.replaced(relations=tuple(usual))
    kept = list(graph.relations)
    for relation in usual:
        try:
            check_triples([other.triple for other in (*kept, relation)], graph.names)
        except GraphError:
            continue
        kept.append(relation)
    stated = len(graph.relations)
    return graph.replaced(relations=(*kept[stated:], *kept[:stated]))


def _node(category: str, position: int, count: int) -> Node:
    """Several objects of a category are numbered and share a style."""
    if count == 1:
        return Node(category, category)
    fields: dict[str, Any] = {"style": category}
    return Node(f"{category}_{position + 1}", category, **fields)


def _related(habit: Habit, nodes: list[Node], anchors: list[Node]) -> list[Relation]:
    """Objects are dealt to anchors in turn where each carries one (a lamp a nightstand), else all to the first."""
    dealt = not habit.sides and not {"front", "close_by"} & set(habit.predicates)
    relations = []
    for i, node in enumerate(nodes):
        anchor = anchors[i % len(anchors)] if dealt else anchors[0]
        relations += [Relation(node.name, predicate, anchor.name) for predicate in habit.predicates]
        if habit.sides:
            relations.append(Relation(node.name, habit.sides[i % len(habit.sides)], anchor.name))
    return relations
