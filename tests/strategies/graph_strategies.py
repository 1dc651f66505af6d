"""Hypothesis strategies for valid scene graphs: `graphs()`, and their parts."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from echomodel.openings import Opening, edge_lengths
from echomodel.vocabulary import vocabulary
from echousd.graph import Node, Relation, RoomSpec, SceneGraph

WORDS = vocabulary()
names = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,12}", fullmatch=True)
numbers = st.floats(-1e6, 1e6, allow_nan=False)
metres = st.floats(1e-3, 1e3)
texts = st.text(st.characters(codec="utf-8", exclude_characters="\0"), min_size=1, max_size=20).filter(
    lambda text: bool(text.strip())
)
titles = st.text(st.characters(categories=["L", "N", "P", "S"]), min_size=1, max_size=20)
scalars = st.one_of(
    st.booleans(),
    st.integers(-(2**63), 2**63 - 1),
    st.floats(allow_nan=False, allow_infinity=False),
    st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=20),
)


@st.composite
def openings(draw: st.DrawFn, corners: np.ndarray | None, height: float | None) -> tuple[Opening, ...]:
    """Up to three openings, each in a third of its own of a drawn wall that is long enough."""
    lengths = np.full(4, 9.0) if corners is None else edge_lengths(corners)
    walls = draw(st.lists(st.sampled_from(range(len(lengths))), max_size=3))
    named = draw(st.lists(names, min_size=len(walls), max_size=len(walls), unique=True))
    made = []
    for third, (name, wall) in enumerate(zip(named, walls, strict=True)):
        room = float(lengths[wall]) / 3
        if room < 0.2 or (height or 1.0) < 0.3:
            continue
        width = draw(st.floats(0.1, room * 0.9))
        offset = third * room + draw(st.floats(0, (room - width) * 0.9))
        kind = draw(st.sampled_from(["door", "window", "passage"]))
        hinge, swing = draw(st.sampled_from(["left", "right"])), draw(st.sampled_from(["in", "out", "slide"]))
        sill = draw(st.floats(0, min((height or 1.0) * 0.4, 100.0))) if kind == "window" else 0.0
        top = draw(st.floats(0.1, min((height or 9) / 2, 100.0)))
        made.append(Opening(name, kind, wall, offset, width, top, sill, hinge, swing))
    return tuple(made)


@st.composite
def rooms(draw: st.DrawFn) -> RoomSpec:
    """A room with a polygon, with extents or with neither, and up to three openings."""
    kind = draw(st.sampled_from([kind.name for kind in WORDS.room_types]))
    height, style = draw(st.none() | metres), draw(st.none() | st.sampled_from([row.name for row in WORDS.styles]))
    width, depth = draw(metres), draw(metres)
    floor = draw(st.sampled_from(["none", "size", "polygon"]))
    if floor == "polygon":
        corners = ((0.0, 0.0), (width, 0.0), (width, depth), (0.0, depth))
        room = RoomSpec(kind, floor_polygon=corners, height=height, style=style)
    else:
        room = RoomSpec(kind, size=(width, depth) if floor == "size" else None, height=height, style=style)
    return room.replaced(openings=draw(openings(room.corners, height)))


@st.composite
def nodes(draw: st.DrawFn, name: str, others: tuple[str, ...] = ()) -> Node:
    """A node with any of its optional fields; it may stand between two of `others`."""
    pairs = st.permutations(others).map(lambda names: tuple(names[:2])) if len(others) > 1 else st.none()
    return Node(
        name,
        draw(st.sampled_from([category.name for category in WORDS.categories])),
        title=draw(st.none() | titles),
        place=draw(st.sampled_from([None, "against_wall", "in_corner"])),
        between=draw(st.none() | pairs),
        style=draw(st.none() | texts),
        size=draw(st.none() | st.tuples(metres, metres, metres)),
        position=draw(st.none() | st.tuples(numbers, numbers, numbers)),
        yaw=draw(st.none() | st.floats(-6.28, 6.28)),
        locked=draw(st.booleans()),
        attributes=draw(st.dictionaries(names, scalars, max_size=3)),
    )


@st.composite
def graphs(draw: st.DrawFn, min_nodes: int = 1, max_nodes: int = 7) -> SceneGraph:
    """A valid graph: in each order of the vocabulary the relations follow one drawn ranking of the nodes."""
    chosen = draw(st.lists(names, min_size=min_nodes, max_size=max_nodes, unique=True))
    orders = sorted({predicate.order for predicate in WORDS.predicates if predicate.order})
    ranking = {order: draw(st.permutations(chosen)) for order in orders}
    relations: dict[tuple[str, str, str], Relation] = {}
    if len(chosen) > 1:
        pairs = st.lists(st.sampled_from(chosen), min_size=2, max_size=2, unique=True)
        stated = st.tuples(pairs, st.sampled_from(WORDS.predicates), st.sampled_from([1.0, 0.5]) | st.floats(0, 1))
        for (subject, object_), predicate, confidence in draw(st.lists(stated, max_size=12)):
            if predicate.order:
                rank = ranking[predicate.order].index
                if (rank(subject) - rank(object_)) * predicate.rank < 0:
                    subject, object_ = object_, subject
            relation = Relation(subject, predicate.name, object_, confidence)
            relations[relation.triple] = relation
    made = tuple(draw(nodes(name, tuple(other for other in chosen if other != name))) for name in chosen)
    return SceneGraph(draw(rooms()), made, tuple(relations.values()))
