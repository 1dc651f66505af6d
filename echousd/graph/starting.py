"""A first graph of a room type and counts."""

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

import shapely

from echomodel.rooms.statistics import room_type_statistics
from echomodel.rows import Habit
from echomodel.sizes import footprint
from echomodel.vocabulary import vocabulary
from echousd.graph.consistency import GraphError, triple_faults
from echousd.graph.nodes import Node, Relation, RoomSpec
from echousd.graph.scene import SceneGraph

MAX_COUNT = 100
FULL, SELDOM = 0.7, 0.09  # share of what furniture covers in half of all rooms; of the rooms that hold such a piece
ONE_IS_ENOUGH = ("bed", "sofa", "screen")  # roles of which a room has one piece, if nobody says it
DEALT = ("at", "head", "before", "foot")  # slot_roles of what serves one anchor: no desk has two chairs, another none


def starting_graph(
    room: RoomSpec | str, counts: Mapping[str, int] | None = None, relations: Iterable[Relation] = (), *,
    area: float = 0.0,
) -> SceneGraph:  # fmt: skip
    """A graph to begin with: what such a room usually holds, changed by `counts`, related as such objects usually are.

    Where its floor is larger than that fills, it holds more.

    Arguments:
        room: the room, or its type. area: of its floor, square metres, where the room does not say it.
        counts: objects per category (or alias); 0 leaves out what the room would hold otherwise.
        relations: what has to hold; a usual relation that contradicts them is left out.

    Raises `GraphError` for unknown words, counts that are none and a room that is left empty.
    """
    room = RoomSpec(room) if isinstance(room, str) else room
    area = float(shapely.Polygon(room.corners).area) if room.corners is not None else area
    wanted = _filled(room.type, dict(vocabulary().room_type(room.type).contents), area)
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


def _filled(word: str, wanted: dict[str, int], area: float) -> dict[str, int]:
    """Counts by category, and of what else rooms of a type hold, most usual first, until a floor is as full as most."""
    row, kind_of = vocabulary().room_type(word), vocabulary().category
    if row.like and not row.floor:
        return wanted  # nobody knows what else such a room holds
    presence = room_type_statistics(word, requests=False).presence
    sleeps = {name for name, _ in vocabulary().room_type("bedroom").contents if kind_of(name).support == "floor"}
    common = {name for one in vocabulary().room_types for name, _ in one.contents}
    seats = sorted(
        (one for one in vocabulary().categories if one.stands == "at"), key=lambda one: one.name not in common
    )
    for name in sorted(presence, key=lambda name: (-presence[name][0], name)):
        held = [each for each, count in wanted.items() for _ in range(count)]
        if presence[name][0] < SELDOM or footprint(held, [None] * len(held)) > FULL * row.cover * area:
            break
        kind = kind_of(name)
        roles = {one.role for one in map(kind_of, wanted) if one.support == kind.support}
        again = kind.role in roles and (kind.role in ONE_IS_ENOUGH or kind.support == "ceiling")
        alone = kind.belongs_to and not {*kind.belongs_to} & {*wanted}
        asleep = (name in sleeps or kind.role == "bed") and "bed" not in roles
        if name in wanted or again or alone or asleep or kind.stands == "at":
            continue
        seat = next((one.name for one in seats if one.belongs_to[:1] == (name,)), None)
        wanted = wanted | {name: 1} | ({} if seat is None else {seat: 1 if kind.access else 4})
    return wanted


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
        slot_role, anchor = vocabulary().category(node.category).stands, anchors[0]
        if near and slot_role in DEALT:
            alike = [other for other in anchors if other.category == anchor.category]
            anchor = min(alike, key=lambda other: served[slot_role, other.name])
            served[slot_role, anchor.name] += "close_by" in habit.predicates
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
