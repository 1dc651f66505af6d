"""Rules on the scene graph and its objects: edges, types, labels; upright, as large and turned as it says."""

import warnings
from collections.abc import Iterator

import numpy as np
from pxr import Kind, Usd, UsdGeom

from echomodel.dressing import SMALL
from echomodel.vocabulary import UnknownWord, normalised
from echousd.checks.reading import Finding, Reading, applied, below, rule
from echousd.graph.nodes import OBSTACLE
from echousd.layers.physics import CORNERS_API, FRICTION_API
from echousd.stage import encoding as usd
from echousd.stage.boxes import read_small
from echousd.stage.contents import components, readable_names, room_frame, words_of
from echousd.stage.encoding import StageError
from echousd.stage.forms import shown
from echousd.stage.labels import LABELS_SCHEMA, is_structure, known_category, spaced
from echousd.stage.read import StatedTwice, find_rooms, node_names, relation_of, room_graph, value
from echousd.stage.taxonomy import SHELL, ade20k
from echousd.stage.values import UNREADABLE, lineage, targets, texts

UPRIGHT = 0.5  # cosine of the angle between an object's up and the room's
SIZE = 0.05, 0.1  # metres, and share of the stated size: differences below either are none
FLOOR = usd.FLOOR_SIZE, usd.FLOOR_POLYGON
TURN = np.radians(15)


@rule("echo:Upright")
def upright(reading: Reading) -> Iterator[Finding]:
    """Objects stand the right way up: their own +Y (or +Z) points upwards in the room."""
    for room in reading.rooms:
        to_room = room_frame(room.room, reading.cache)
        for prim in (*room.nodes, *components(room)):
            try:
                own = to_room @ reading.world(prim)
            except UNREADABLE:
                continue
            length = np.linalg.norm(own[:3, 1:3], axis=0)
            if (length < 1e-9).any():
                continue
            ups = own[1, 1:3] / length  # cosines of the angles between the room's up and its own +Y and +Z
            if prim in room.nodes and ups.max() < UPRIGHT:
                angle = np.degrees(np.arccos(np.clip(ups.max(), -1, 1)))
                yield Finding(prim.GetPath(), f"leans by {angle:.0f} degrees, allowed: upright")
            elif prim not in room.nodes and ups[0] < -UPRIGHT and ups[1] < UPRIGHT:
                yield Finding(prim.GetPath(), "stands on its head, allowed: its own +Y (or +Z) upwards")


@rule("echo:OneLabel", "labelled")
def one_label(reading: Reading, prim: Usd.Prim) -> Iterator[str]:
    """An object has one label of the taxonomy `category`, and it is the category that the graph states."""
    words, category = texts(prim.GetAttribute(usd.LABELS)), value(prim, usd.CATEGORY)
    if len(words) > 1:
        yield f"{usd.LABELS} is {', '.join(words)}, allowed: one word"
    elif not words or prim not in reading.nodes or words[0] == value(prim, f"{usd.FREE}{OBSTACLE}"):
        return
    elif isinstance(category, str) and known_category(words[0]) != known_category(category):
        yield f"{usd.LABELS} is {words[0]!r}, {usd.CATEGORY} {category!r}"


@rule("echo:StatedBoxes")
def stated_boxes(reading: Reading) -> Iterator[Finding]:
    """Geometry is as large and turned as the graph states."""
    for room in reading.rooms:
        stating = {prim.GetPath() for prim in room.nodes if _states(prim, (usd.SIZE, usd.YAW))}
        paths = {name: path for path, name in readable_names(room).items() if path in stating} if stating else {}
        for thing in reading.contents(room).objects if paths else ():
            node = thing.node
            if node.name not in paths or not len(thing.points):
                continue
            if node.size is not None:
                apart = np.abs(thing.size - node.size)
                if (apart > np.maximum(SIZE[0], SIZE[1] * np.array(node.size))).any():
                    message = f"{usd.SIZE} is {_shown(node.size)}, its geometry {_shown(thing.size)} metres"
                    yield Finding(paths[node.name], message)
            if node.yaw is not None:
                turn = (thing.yaw - node.yaw + np.pi) % (2 * np.pi) - np.pi
                if abs(turn) > TURN:
                    message = f"{usd.YAW} is {node.yaw:.3g}, it is turned by {thing.yaw:.3g} radians"
                    yield Finding(paths[node.name], message)


def _states(prim: Usd.Prim, names: tuple[str, ...]) -> bool:
    """Whether a prim has a value for one of some attributes."""
    return any(prim.GetAttribute(name).HasAuthoredValue() for name in names if prim.HasAttribute(name))


@rule("echo:Floor")
def floors(reading: Reading) -> Iterator[Finding]:
    """Every room with objects has a floor, stated by its graph or as labelled geometry; nobody switched it off."""
    for prim in reading.inactive:
        word = next(iter(words_of(prim)), "")
        if word in SHELL:
            yield Finding(prim.GetPath(), f"the {word} is deactivated", warning=word != "floor")
    for room in reading.rooms:
        stated = _states(room.graph, FLOOR)
        floor = any("floor" in words_of(prim) for prim in below(room.room))
        off = any("floor" in words_of(prim) for prim in reading.inactive)  # which is told already
        if stated and any("wall" in words_of(prim) for prim in components(room)) and not (floor or off):
            yield Finding(room.room.GetPath(), "the room has walls, but no floor")
        if room.nodes and not stated and not floor:
            allowed = f"{' or '.join(FLOOR)}, or geometry labelled 'floor'"
            yield Finding(room.graph.GetPath(), f"the room has no floor, allowed: {allowed}")


@rule("echo:SomeLabel", "distinct")
def some_label(_reading: Reading, prim: Usd.Prim) -> Iterator[str]:
    """A prim that carries semantics labels has one of each taxonomy that it applies."""
    for schema in applied(prim):
        kind, taxonomy = Usd.SchemaRegistry.GetTypeNameAndInstance(schema)
        attribute = prim.GetAttribute(f"semantics:labels:{taxonomy}")
        if kind == "SemanticsLabelsAPI" and not (attribute and attribute.Get()):
            yield f"semantics:labels:{taxonomy} is empty, allowed: a word"


@rule("echo:Kinds")
def kinds(reading: Reading) -> Iterator[Finding]:
    """Kinds are known; components lie below groups and not in one another; furniture is components."""
    nodes = {prim.GetPath() for prim in reading.nodes}
    modelled = any(_kind(prim) == "component" for prim in reading.nodes)
    groups = {prim.GetParent() for prim in reading.prims if _kind(prim) == "component"}
    groups = {prim for prim in groups if _kind(prim) == "group"}
    for prim in reading.prims:
        kind = _kind(prim)
        node = prim.GetPath() in nodes
        above = prim.GetParent()
        if not kind:
            if (node and modelled) or (prim.IsA(UsdGeom.Xform) and above in groups):
                yield Finding(prim.GetPath(), "has no kind, allowed among components: component")
            continue
        if not Kind.Registry.HasKind(kind):
            yield Finding(prim.GetPath(), f"kind is {kind!r}, allowed: component, subcomponent, group, assembly")
        elif Kind.Registry.IsA(kind, "model") and not prim.IsModel():
            while _kind(above) in ("group", "assembly"):
                above = above.GetParent()
            found = _kind(above) or "none"
            if not any(above.GetPath().HasPrefix(room.room.GetPath()) for room in reading.rooms):
                continue  # a room below the prims of others
            yield Finding(
                prim.GetPath(), f"kind is {kind!r} below <{above.GetPath()}> of kind {found!r}, allowed: group"
            )
        elif node and prim.IsGroup() and not any(each.IsModel() and not each.IsGroup() for each in below(prim)):
            yield Finding(prim.GetPath(), f"kind is {kind!r} of an object, allowed: component")


def _kind(prim: Usd.Prim) -> str:
    return str(prim.GetMetadata("kind") or "")


@rule("echo:Hidden", "nodes")
def hidden(_reading: Reading, prim: Usd.Prim) -> Iterator[str]:
    """Something is seen of an object that has surfaces at all."""
    surfaces = [found for found in below(prim) if found.IsA(UsdGeom.Gprim)]
    if surfaces and not any(map(shown, surfaces)):
        yield "nothing of it is seen: its surfaces are invisible or guides"


@rule("echo:Strangers")
def strangers(reading: Reading) -> Iterator[Finding]:
    """Furniture that no graph knows stands in no room that has one."""
    for room in reading.rooms:
        for prim in components(room) if room.nodes else ():
            word = next(iter(words_of(prim)), "")
            if word not in SMALL and word not in SHELL and known_category(word) is not None:
                yield Finding(prim.GetPath(), f"a {word} that is no node of the graph", warning=True)


def _shown(size: object) -> str:
    return " x ".join(f"{length:.3g}" for length in np.asarray(size))


CLASSES = "semantics:labels:ade20k"


@rule("echo:LabelsAgree", "prims")
def agreeing_labels(reading: Reading, prim: Usd.Prim) -> Iterator[Finding | str]:
    """Labels of walls, floors, ceilings, doors and windows are what their names say; two taxonomies say the same."""
    words, classes = texts(prim.GetAttribute(usd.LABELS)), texts(prim.GetAttribute(CLASSES))
    if len(words) != 1:
        return
    word = normalised(words[0])
    named = spaced(prim.GetName()).split("_")
    meant = named[-1]  # a wall clock is none, and a ceiling lamp neither, whichever word comes last
    shared = not {each.removesuffix("s") for each in word.split("_")}.isdisjoint({*named, SHELL.get(meant, meant)})
    other = meant in SHELL and not shared
    if other and not any(prim.GetPath().HasPrefix(node.GetPath()) for node in reading.nodes):
        known = is_structure(word) or known_category(word) is not None
        message = f"{usd.LABELS} is {words[0]!r}, its name says {meant!r}"
        yield Finding(prim.GetPath(), message, warning=not known)
    if len(classes) == 1:
        try:
            same = ade20k(word)
        except UnknownWord:
            return
        if normalised(classes[0]) != normalised(same):
            yield f"{CLASSES} is {classes[0]!r}, allowed with {words[0]!r}: {same!r}"


# Known to this package even in a process that opened a stage before it could register the schema plugin.
OURS = frozenset((*usd.TYPES, usd.NODE_API, usd.ROOM_API))
WRITTEN = OURS | {CORNERS_API, FRICTION_API}


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
        with warnings.catch_warnings(record=True) as caught:
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
        for hint in caught:
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
    reported: set = set()
    for prim in reading.prims:
        if not prim.IsA(UsdGeom.Gprim) or reading.is_guide(prim) or _labelled(prim):
            continue
        owner = next((above for above in lineage(prim) if _kind(above) == "component"), prim)
        if owner.GetPath() not in reported:
            reported.add(owner.GetPath())
            yield Finding(
                owner.GetPath(), "no semantics labels, allowed: SemanticsLabelsAPI on the geometry or above it"
            )


def _labelled(prim: Usd.Prim) -> bool:
    taxonomies = (
        (above, name.removeprefix(LABELS_SCHEMA))
        for above in lineage(prim) for name in applied(above) if name.startswith(LABELS_SCHEMA)
    )  # fmt: skip
    found = (above.GetAttribute(f"semantics:labels:{taxonomy}") for above, taxonomy in taxonomies)
    return any(attribute and attribute.Get() for attribute in found)


def _without_place(message: str, prim: Usd.Prim) -> str:
    return message.split(f"<{prim.GetPath()}>: ", 1)[-1]
