"""Read scene graphs from a composed stage: through references, instances, variants and sublayers."""

import os
import warnings
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pxr import Sdf, Usd

from echomodel.files import raising
from echomodel.late import Late
from echomodel.openings import Opening, opening_from_json
from echomodel.vocabulary import vocabulary
from echousd.graph import MAX_TEXT, GraphError, Node, Relation, RoomSpec, SceneGraph, load_graph
from echousd.graph.fields import title
from echousd.naming import TEXT_FORMS
from echousd.stage import encoding as usd
from echousd.stage import values
from echousd.stage.encoding import StageError
from echousd.stage.files import opened, source

identifier_of = Late("echousd.graph.titles:identifier_of")
foreign_graph, foreign_rooms = (Late(f"echousd.stage.foreign:{name}") for name in ("foreign_graph", "foreign_rooms"))


@dataclass
class RoomPrims:
    """The prims of one room: its own, its scene graph's, and those of its nodes, relations and openings in order.

    Small things that are nodes, and relations that one is an end of, stand apart: no graph of furniture has them.
    """

    room: Usd.Prim
    graph: Usd.Prim
    nodes: list[Usd.Prim] = field(default_factory=list)
    relations: list[Usd.Prim] = field(default_factory=list)
    openings: list[Usd.Prim] = field(default_factory=list)
    small: list[Usd.Prim] = field(default_factory=list)
    small_relations: list[Usd.Prim] = field(default_factory=list)


def read_rooms(stage: Usd.Stage | str | os.PathLike[str]) -> dict[str, SceneGraph]:
    """Every room's graph by the prim path of the room, in the stage's order; empty where there is none."""
    stage = opened(stage)  # held here: prims do not outlive their stage
    with values.reading(stage):
        return {str(prims.room.GetPath()): room_graph(prims) for prims in find_rooms(stage)}


def the_room(stage: Usd.Stage, room: str | None, rooms: list[RoomPrims] | None = None) -> RoomPrims:
    """The room at the prim path `room`, or the only one; raises StageError that lists the rooms there are."""
    rooms = find_rooms(stage) if rooms is None else rooms
    found = rooms if room is None else [prims for prims in rooms if str(prims.room.GetPath()) == str(room)]
    if len(found) == 1:
        return found[0]
    paths = ", ".join(str(prims.room.GetPath()) for prims in rooms)
    if found:
        raise StageError(f"{source(stage)}: {len(rooms)} rooms, say which one of {paths}")
    what = f"no room {str(room)!r}" if room is not None else "no scene graph (no EchoSceneGraph prim)"
    raise StageError(f"{source(stage)}: {what}" + (f", allowed: {paths}" if rooms else ""))


def is_home(stage: Usd.Stage) -> bool:
    """Whether a stage holds several rooms' graphs or the graph of a home."""
    kinds = [prim.GetTypeName() for prim in Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies())]
    return usd.HOME_TYPE in kinds or kinds.count(usd.GRAPH_TYPE) > 1


def find_rooms(stage: Usd.Stage) -> list[RoomPrims]:
    """All rooms of a stage in one traversal; a node or relation belongs to the closest room above it."""
    kinds = {usd.GRAPH_TYPE: "graphs", usd.RELATION_TYPE: "relations", usd.OPENING_TYPE: "openings"}
    found: dict[str, list[Usd.Prim]] = {kind: [] for kind in (*kinds.values(), "nodes", "small")}
    for prim in Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()):
        kind = kinds.get(prim.GetTypeName())
        if kind is None and usd.NODE_API in prim.GetPrimTypeInfo().GetAppliedAPISchemas():
            kind = "small" if values.value_of(prim.GetAttribute(usd.SHAPES)) == usd.DRESSING else "nodes"
        if kind:
            found[kind].append(prim)
    graphs = found.pop("graphs")
    rooms = {prims.room.GetPath(): prims for prims in map(_room_of, graphs)}
    if len(rooms) < len(graphs):
        raise StageError(f"{source(stage)}: two EchoSceneGraph prims describe the same room, allowed: one per room")
    by_graph = {prims.graph.GetPath(): prims for prims in rooms.values()}
    for member, prims_of_kind in found.items():
        owners = rooms if member in ("nodes", "small") else by_graph
        known: dict[Sdf.Path, RoomPrims | None] = {}  # by parent, as siblings are many
        for prim in prims_of_kind:
            parent = prim.GetPath().GetParentPath()
            if parent not in known:
                above = (*parent.GetAncestorsRange(), Sdf.Path.absoluteRootPath)
                known[parent] = next((owners[path] for path in above if path in owners), None)
            owner = known[parent]
            if owner:
                getattr(owner, member).append(prim)
    for prims in (prims for prims in rooms.values() if prims.small):
        small = {prim.GetPath() for prim in prims.small}
        ends = [{*values.targets(one, usd.SUBJECT), *values.targets(one, usd.OBJECT)} for one in prims.relations]
        prims.small_relations = [one for one, both in zip(prims.relations, ends, strict=True) if both & small]
        prims.relations = [one for one, both in zip(prims.relations, ends, strict=True) if not both & small]
    return list(rooms.values())


def _room_of(graph: Usd.Prim) -> RoomPrims:
    targets = values.targets(graph, usd.ROOM)
    if len(targets) > 1:
        raise StageError(f"{place(graph)}: {usd.ROOM} has {len(targets)} targets, allowed: at most one")
    room = graph.GetStage().GetPrimAtPath(targets[0]) if targets else graph.GetParent()
    if not room:
        raise StageError(f"{place(graph)}: {usd.ROOM} points to <{targets[0]}>, where no prim is")
    return RoomPrims(room, graph)


def place(prim: Usd.Prim) -> str:
    """`file: <prim path>` for error messages."""
    return f"{source(prim.GetStage())}: <{prim.GetPath()}>"


def faults(where: str) -> AbstractContextManager[None]:
    """What is not valid in the graph that is built meanwhile is a fault of the stage there."""
    return raising(f"{where}:", GraphError, kind=StageError)


def room_graph(prims: RoomPrims) -> SceneGraph:
    """The graph of one room; raises StageError that names the prim at fault."""
    names = node_names(prims)
    nodes = tuple(read_node(prim, names[prim.GetPath()], names) for prim in prims.nodes)
    relations = tuple(facts(prims, names))
    with faults(place(prims.graph)):
        return SceneGraph(room=room_spec(prims), nodes=nodes, relations=relations)


class StatedTwice(UserWarning):
    """Two prims of a room state one fact; it counts once."""


def facts(prims: RoomPrims, names: dict[Sdf.Path, str]) -> Iterator[Relation]:
    """The relations of a room; what several prims state is one fact, with the confidence of the strongest layer.

    Warns `StatedTwice`; raises StageError.
    """
    for entries in stated(prims, names).values():
        strongest, relation = entries[0]
        if len(entries) == 1:
            yield relation
            continue
        others = ", ".join(f"<{prim.GetPath()}>" for prim, _ in entries[1:])
        warnings.warn(
            f"{place(strongest)}: states '{relation}' as {others} does; one fact, confidence {relation.confidence:g}",
            StatedTwice,
            stacklevel=3,
        )
        yield relation


def stated(prims: RoomPrims, names: dict[Sdf.Path, str]) -> dict[tuple[str, str, str], list[tuple[Usd.Prim, Relation]]]:
    """Triple to the prims that state it with the relation as each says it, those of stronger layers first."""
    found: dict[tuple[str, str, str], list[tuple[Usd.Prim, Relation]]] = {}
    for prim in prims.relations:
        relation = relation_of(prim, names)
        if relation:
            found.setdefault(relation.triple, []).append((prim, relation))
    for entries in found.values():
        if len(entries) > 1:
            entries.sort(key=lambda entry: _strength(entry[0]))
    return found


def _strength(prim: Usd.Prim) -> int:
    """Place of the strongest layer that speaks of a prim among the layers of its stage, 0 = strongest."""
    layers = prim.GetStage().GetLayerStack()
    own = [spec.layer for spec in prim.GetPrimStack()]
    return min((layers.index(layer) for layer in own if layer in layers), default=len(layers))


def node_names(prims: RoomPrims, *, small: bool = False) -> dict[Sdf.Path, str]:
    """Path to node name (the prim's own, spelled in ASCII), with `small` of small things too.

    Raises StageError where two prims of one room share a name.
    """
    members = (*prims.nodes, *(prims.small if small else ()))
    seen: dict[str, Sdf.Path] = {}
    for prim in members:
        path, name = prim.GetPath(), prim.GetName()
        if name in seen:
            raise StageError(
                f"{source(prim.GetStage())}: two nodes are called {name!r}: <{seen[name]}> and <{path}>, "
                "allowed: a name of its own for each node of a room"
            )
        seen[name] = path
    names = {path: name for name, path in seen.items()}
    for prim in (prim for prim in members if not prim.GetName().isascii()):
        names[prim.GetPath()] = identifier_of(prim.GetName(), _category(prim) or "", {*names.values()})
    return names


def read_opening(prim: Usd.Prim) -> Opening:
    """The opening that an EchoOpening prim states, called like the prim; raises StageError."""
    with raising(f"{place(prim)}:", kind=StageError):
        return opening_from_json({"name": prim.GetName(), **stated_fields(prim, usd.OPENING_FIELDS)})


def room_spec(prims: RoomPrims) -> RoomSpec:
    """The `RoomSpec` that an EchoSceneGraph prim and its openings hold."""
    graph = prims.graph
    words = value(graph, usd.VOCABULARY)
    if words not in (None, usd.VOCABULARY_NAME):
        raise StageError(f"{place(graph)}: {usd.VOCABULARY} is {words!r}, allowed: {usd.VOCABULARY_NAME}")
    fields: dict[str, Any] = {"type": None, **stated_fields(graph, usd.ROOM_FIELDS)}
    with faults(place(graph)):
        return RoomSpec(**fields, openings=tuple(map(read_opening, prims.openings)))


def read_node(prim: Usd.Prim, name: str, names: dict[Sdf.Path, str]) -> Node:
    """The node that a prim states; `names`: of all nodes of its room, by path. Raises StageError."""
    fields: dict[str, Any] = {"title": _title(prim), "between": _between(prim, names)}
    free: dict[str, Any] = {}
    for attribute in prim.GetAuthoredPropertyNames():
        if attribute in usd.NODE_FIELDS:
            fields[usd.NODE_FIELDS[attribute]] = value(prim, attribute)
        elif attribute.startswith(usd.FREE):
            free[attribute.removeprefix(usd.FREE)] = value(prim, attribute)
    fields = {key: found for key, found in fields.items() if found is not None}
    free = {key: found for key, found in free.items() if found is not None}
    if fields.setdefault("category", _category(prim)) is None:
        raise StageError(f"{place(prim)}: no category, allowed: {usd.CATEGORY} or {usd.LABELS} with one word")
    with faults(place(prim)):
        return Node(name, attributes=free, **fields)


def _category(prim: Usd.Prim) -> Any:
    """The category that a prim states, else its first label; None without either."""
    return value(prim, usd.CATEGORY) or next(iter(values.texts(prim.GetAttribute(usd.LABELS))), None)


def _title(prim: Usd.Prim) -> str | None:
    """The display name of a prim, None for one that is no title: any host may write what it likes there.

    Without one, a prim's name in another script than a node's is its title.
    """
    try:
        return title(prim.GetDisplayName())
    except ValueError:
        return None if prim.GetName().isascii() else prim.GetName()


def _between(prim: Usd.Prim, names: dict[Sdf.Path, str]) -> tuple[str, ...] | None:
    """Names of the two objects that a node stands between, None where nothing says so or one is deactivated."""
    if not values.targets(prim, usd.BETWEEN):
        return None
    ends = _ends(prim, usd.BETWEEN, 2, names)
    return None if None in ends else tuple(end for end in ends if end is not None)


def value(prim: Usd.Prim, name: str) -> Any:
    """The value of an attribute, None where there is none; raises StageError for a text that cannot be meant."""
    found = values.value_of(prim.GetAttribute(name))
    if found is None or isinstance(found, float | bool):
        return found
    found = usd.plain(found)
    for text in found if isinstance(found, tuple) else (found,):
        if isinstance(text, str) and len(text) > MAX_TEXT:
            raise StageError(f"{place(prim)}: {name} is a text of {len(text)} characters, allowed: {MAX_TEXT}")
    return found


def stated_fields(prim: Usd.Prim, fields: Mapping[str, str]) -> dict[str, Any]:
    """What a prim states of some fields, of property -> field; raises StageError."""
    return {field: found for name, field in fields.items() if (found := value(prim, name)) is not None}


def relation_of(prim: Usd.Prim, names: dict[Sdf.Path, str]) -> Relation | None:
    """The relation that a prim states, None where one of its ends has been deactivated; raises StageError."""
    subject, object_ = (_ends(prim, name, 1, names)[0] for name in (usd.SUBJECT, usd.OBJECT))
    if subject is None or object_ is None:
        return None
    predicate, confidence = value(prim, usd.PREDICATE), value(prim, usd.CONFIDENCE)
    # Words and numbers that leave nothing to check, as the nodes are valid.
    if isinstance(predicate, str) and predicate in vocabulary().predicate_names and confidence in (None, 1.0):
        return Relation.model_construct(subject=subject, predicate=predicate, object=object_, confidence=1.0)
    if predicate is None:
        raise StageError(f"{place(prim)}: {usd.PREDICATE} has no value, allowed: one predicate")
    with faults(place(prim)):
        return Relation(subject, predicate, object_, 1.0 if confidence is None else confidence)


def _ends(prim: Usd.Prim, name: str, count: int, names: dict[Sdf.Path, str]) -> list[str | None]:
    """The nodes that a relationship points to, None for one that has been deactivated; raises StageError."""
    targets = values.targets(prim, name)
    if len(targets) != count:
        found = f"{len(targets)} targets" + (f" ({', '.join(map(str, targets))})" if targets else "")
        raise StageError(f"{place(prim)}: {name} has {found}, allowed: exactly {'one' if count == 1 else count}")
    return [_node_at(prim, name, target, names) for target in targets]


def _node_at(prim: Usd.Prim, name: str, target: Sdf.Path, names: dict[Sdf.Path, str]) -> str | None:
    node = names.get(target)
    if node is None and not _deactivated(prim.GetStage(), target):
        there = prim.GetStage().GetPrimAtPath(target)
        why = f"which is no node of this room (no {usd.NODE_API})" if there else "where no prim is"
        nearest = there or prim.GetStage().GetPrimAtPath(target.GetParentPath())
        if nearest and not nearest.IsLoaded():
            why = "whose payload is not loaded"
        raise StageError(f"{place(prim)}: {name} points to <{target}>, {why}, allowed: a node of the room")
    return node


def _deactivated(stage: Usd.Stage, path: Sdf.Path) -> bool:
    """Whether a prim at or above `path` is there but not active."""
    while path != Sdf.Path.absoluteRootPath and not path.isEmpty:
        prim = stage.GetPrimAtPath(path)
        if prim:
            return not prim.IsActive()
        path = path.GetParentPath()
    return False


def read_graph(stage: Usd.Stage | str | os.PathLike[str], room: str | None = None) -> SceneGraph:
    """The scene graph on a stage or in a file; `room` is the prim path of the room, needed where there are several.

    A YAML or JSON file is read as `echousd new --from` reads it. A stage without a scene graph becomes one all the
    same if its prims carry semantics labels and bounds (`foreign_graph`). Raises StageError for a stage, GraphError for
    a text, that is not valid, with the file's name.
    """
    if not isinstance(stage, Usd.Stage) and Path(stage).suffix.lower() in TEXT_FORMS:
        return load_graph(stage)
    stage = opened(stage)
    with values.reading(stage):
        rooms = find_rooms(stage)
        if not rooms:
            if room is None:
                return foreign_graph(stage)
            found = foreign_rooms(stage)
            if room in found:
                return found[room]
        return room_graph(the_room(stage, room, rooms))
