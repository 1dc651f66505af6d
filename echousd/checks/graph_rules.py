"""Rules on the scene graph and on what tells tools what things are: edges, types, semantics."""

from __future__ import annotations

import warnings
from collections.abc import Iterator

from pxr import Usd, UsdGeom

from echousd.checks.findings import Finding, applied, rule
from echousd.checks.reading import Reading
from echousd.shapes.joints import FRICTION_API
from echousd.stage import encoding as usd
from echousd.stage.boxes import read_small
from echousd.stage.encoding import StageError
from echousd.stage.read import StatedTwice, find_rooms, node_names, relation_of, room_graph
from echousd.stage.values import targets

LABELS_PREFIX = "SemanticsLabelsAPI:"
# Known to this package even in a process that opened a stage before it could register the schema plugin.
OURS = frozenset((*usd.TYPES, usd.NODE_API, usd.ROOM_API))
WRITTEN = OURS | {FRICTION_API}


@rule("echo:EdgeTargets")
def edge_targets(reading: Reading) -> Iterator[Finding]:
    """Every relation has one subject, one known predicate and one object, all in its own room."""
    try:
        rooms = reading.rooms or find_rooms(reading.stage)
    except StageError as error:
        yield Finding(reading.stage.GetPseudoRoot().GetPath(), str(error))
        return
    owned = set()
    for room in rooms:
        try:
            names = node_names(room, small=True)
        except StageError as error:
            yield Finding(room.graph.GetPath(), str(error))
            continue
        for prim in (*room.relations, *room.small_relations):
            owned.add(prim.GetPath())
            try:
                relation = relation_of(prim, names)
            except StageError as error:
                yield Finding(prim.GetPath(), _without_place(str(error), prim))
                continue
            if relation is None:
                gone = [
                    str(end) for name in (usd.SUBJECT, usd.OBJECT) for end in targets(prim, name) if end not in names
                ]
                yield Finding(prim.GetPath(), f"does not count: <{gone[0]}> is deactivated", warning=True)
    for prim in reading.prims:
        if prim.GetTypeName() == usd.RELATION_TYPE and prim.GetPath() not in owned:
            if prim.GetParent().GetTypeName() == usd.HOME_TYPE:  # between rooms: `echousd.home` judges them
                continue
            yield Finding(
                prim.GetPath(), f"a relation outside every scene graph, allowed: below an {usd.GRAPH_TYPE} prim"
            )


@rule("echo:ConsistentGraph")
def consistent_graph(reading: Reading) -> Iterator[Finding]:
    """The relations of a room do not contradict each other, and its words are those of the vocabulary."""
    if any(not found.warning for found in edge_targets(reading)):
        return
    for room in reading.rooms:
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always", StatedTwice)
            try:
                room_graph(room)
            except StageError as error:
                yield Finding(room.graph.GetPath(), _without_place(str(error), room.graph))
        for prim in room.small:
            try:
                read_small(prim)
            except StageError as error:
                yield Finding(prim.GetPath(), _without_place(str(error), prim))
        for hint in told:
            message = str(hint.message)
            yield Finding(room.graph.GetPath(), message.split(": ", 1)[-1], warning=True)


@rule("echo:KnownTypes", "prims")
def known_types(_reading: Reading, prim: Usd.Prim) -> Iterator[str]:
    """Every prim type and applied API schema is known to this OpenUSD."""
    registry, name = Usd.SchemaRegistry(), prim.GetTypeName()
    if name and not registry.FindConcretePrimDefinition(name) and name not in OURS:
        yield f"unknown prim type {name!r}: no registered schema defines it"
    for schema in applied(prim):
        base = Usd.SchemaRegistry.GetTypeNameAndInstance(schema)[0]
        if not registry.FindAppliedAPIPrimDefinition(base) and base not in WRITTEN:
            yield f"unknown API schema {schema!r}: no registered schema defines it"


@rule("echo:Semantics")
def semantics(reading: Reading) -> Iterator[Finding]:
    """All visible geometry carries semantics labels, itself or through a prim above it."""
    told: set = set()
    for prim in reading.prims:
        if not prim.IsA(UsdGeom.Gprim) or reading.is_guide(prim) or _labelled(prim):
            continue
        owner = _component(prim)
        if owner.GetPath() not in told:
            told.add(owner.GetPath())
            yield Finding(
                owner.GetPath(), "no semantics labels, allowed: SemanticsLabelsAPI on the geometry or above it"
            )


def _labelled(prim: Usd.Prim) -> bool:
    while prim and not prim.IsPseudoRoot():
        for schema in applied(prim):
            if schema.startswith(LABELS_PREFIX):
                attribute = prim.GetAttribute(f"semantics:labels:{schema.removeprefix(LABELS_PREFIX)}")
                if attribute and attribute.Get():
                    return True
        prim = prim.GetParent()
    return False


def _component(prim: Usd.Prim) -> Usd.Prim:
    above = prim
    while above and not above.IsPseudoRoot():
        if Usd.ModelAPI(above).GetKind() == "component":
            return above
        above = above.GetParent()
    return prim


def _without_place(message: str, prim: Usd.Prim) -> str:
    return message.split(f"<{prim.GetPath()}>: ", 1)[-1]
