"""Scene graphs read from text: the canonical form and the short form that a person writes, each as YAML or JSON.

room: bedroom
objects: {bed: double_bed, wardrobe: wardrobe, lamp: {category: table_lamp, style: oak}}
relations: [bed left of wardrobe, lamp close by bed]
doors: [{wall: south, offset: 0.6}]
"""

from __future__ import annotations

import difflib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from echomodel.late import Late
from echomodel.vocabulary import TYPO, UnknownWord, normalised, vocabulary
from echousd.graph.consistency import MAX_ERRORS, GraphError, listed, name_faults, raise_all, unknown_ends
from echousd.graph.nodes import Node, Placed, PlainModel, Relation, RoomSpec
from echousd.graph.openings import LISTS, listed_words, opening_from_words
from echousd.graph.scene import SceneGraph, plain
from echousd.graph.titles import composed, identifier_of, is_title, name_of, with_names
from echousd.graph.values import IDENTIFIER, shown

if TYPE_CHECKING:
    from echousd.graph.syntax import Located, Path

Built = TypeVar("Built", bound=PlainModel)
Read = TypeVar("Read")
flow, parse_json, parse_yaml = (Late(f"echousd.graph.syntax:{name}") for name in ("flow", "parse_json", "parse_yaml"))
TOP_KEYS = ("room", "objects", "nodes", "relations", *LISTS)


def graph_from_text(kind: type[SceneGraph], text: str, form: Literal["json", "yaml"], source: str = "") -> SceneGraph:
    """Read a graph of class `kind` from YAML or JSON text; raises as `read_text`."""
    return read_text(partial(graph_from_plain, kind), text, form, source)


def read_text(build: Callable[[Any], Read], text: str, form: Literal["json", "yaml"], source: str = "") -> Read:
    """What `build` makes of the plain data in YAML or JSON text.

    Raises `GraphError` as `source:line: what was found, what is allowed`.
    """
    try:
        located = parse_json(text) if form == "json" else parse_yaml(text)
    except GraphError as error:
        raise GraphError(_with_source(source, str(error))) from None
    wrong = list(located.faults)
    try:
        built = build(located.data)
    except GraphError as error:
        wrong += [error, *error.others]
    if not wrong:
        return built
    lines = [_with_source(source, _with_line(located, each)) for each in wrong[:MAX_ERRORS]]
    whole = GraphError("\n".join(lines), wrong[0].about)
    whole.lines = tuple(lines)
    raise whole from None


def _with_line(located: Located, error: GraphError) -> str:
    path = _written(located, error.about)
    line = located.line(path) if path else None
    return f"line {line}: {error}" if line else str(error)


def _with_source(source: str, message: str) -> str:
    if not source:
        return message
    return f"{source}:{message.removeprefix('line ')}" if message.startswith("line ") else f"{source}: {message}"


def _written(located: Located, about: Path) -> Path:
    """Where in the text the field `about` of the graph was written: nodes may stand under `objects`, by name."""
    data = located.data
    if len(about) > 1 and about[0] == "nodes" and isinstance(data, Mapping) and "objects" in data:
        objects = data["objects"]
        keys = list(objects) if isinstance(objects, Mapping) else None
        position = about[1]
        assert isinstance(position, int)
        return ("objects", keys[position] if keys else position, *about[2:])
    return about


def graph_from_plain(kind: type[SceneGraph], data: Any) -> SceneGraph:
    """The graph in plain data (mappings, lists, texts, numbers) of either form; raises `GraphError`."""
    if not isinstance(data, Mapping):
        found = "nothing" if data is None else shown(data)
        raise GraphError(f"found {found}, allowed: a mapping with {', '.join(TOP_KEYS)}")
    only_fields(data, TOP_KEYS, ())
    if "objects" in data and "nodes" in data:
        raise GraphError("both objects and nodes are given, allowed: one of them", ("nodes",))
    if "room" not in data:
        types = ", ".join(kind.name for kind in vocabulary().room_types)
        raise GraphError(f"room is missing, allowed: one of {types}, or a mapping with type")
    key = "nodes" if "nodes" in data else "objects"
    errors: list[GraphError] = []
    room = _tried(errors, _room, data)
    objects, names = _named(list(_objects(data.get(key), key)))
    entries = list(enumerate(objects))
    nodes = [_tried(errors, _node, fields, ("nodes", i)) for i, fields in entries]
    stated = data.get("relations")
    if not isinstance(stated, list | None):
        raise GraphError(
            f"relations: found {shown(stated)}, allowed: a list such as [bed left wardrobe]", ("relations",)
        )
    read = [_tried(errors, _sentence, entry, ("relations", i), names) for i, entry in enumerate(stated or ())]
    relations = [one if isinstance(one, Relation) else None for one in read]
    if errors:
        named = [(str(one["name"]), _others(one)) for one in objects if "name" in one]
        errors += name_faults(named) if len(named) == len(objects) else []
        errors += unknown_ends([None if r is None else r.triple for r in relations], dict(named))
        raise_all(errors)
    for i, one in enumerate(read):
        if isinstance(one, Placed):
            nodes = _tried(errors, _with_placement, nodes, one, ("relations", i)) or nodes
    raise_all(errors)
    rows = [i for i, one in enumerate(read) if isinstance(one, Relation)]
    try:
        return kind(room, tuple(nodes), tuple(one for one in relations if one is not None))
    except GraphError as error:
        raise _where_written(error, rows) from None


def _where_written(error: GraphError, rows: Sequence[int]) -> GraphError:
    """A fault of the graph as one of the text, in whose rows `rows` its relations stand."""
    about = error.about
    if about[:1] == ("relations",):
        about = ("relations", rows[int(about[1])], *about[2:])
    located = GraphError(str(error), about)
    located.others = tuple(_where_written(each, rows) for each in error.others)
    return located


def _with_placement(nodes: list[Node], placed: Placed, about: Path) -> list[Node]:
    """The nodes with a placement that stands among the relations."""
    at = next((i for i, node in enumerate(nodes) if node.name == placed.subject), None)
    if at is None:
        known = listed(sorted(node.name for node in nodes))
        raise GraphError(f"'{placed}': subject {placed.subject!r} is no object of this graph, allowed: {known}", about)
    fields = placed_fields(placed)
    held = {name: getattr(nodes[at], name) for name in fields}
    same = set if placed.others else str  # between a and b is between b and a
    if any(value is not None and same(value) != same(fields[name]) for name, value in held.items()):
        placement = next(one for one in nodes[at].placements if bool(one.others) == bool(placed.others))
        raise GraphError(f"'{placed}': {placement} is stated already, allowed: one of them", about)
    try:
        return [node.replaced(**fields) if i == at else node for i, node in enumerate(nodes)]
    except GraphError as error:
        raise GraphError(str(error), about) from None


def _node(fields: dict[str, Any], about: Path) -> Node:
    return _built(Node, _in_radians(fields, about), about)


def _sentence(entry: Any, about: Path, names: Mapping[str, str]) -> Relation | Placed:
    fields = fields_of_sentence(entry, about, names)
    return fields if isinstance(fields, Placed) else _built(Relation, fields, about)


def _named(objects: list[dict[str, Any]]) -> tuple[list[dict[str, Any]], dict[str, str]]:
    """The fields of the nodes with identifiers for names in other scripts, which become titles; title to name."""
    taken = {fields["name"] for fields in objects if isinstance(fields.get("name"), str)}
    names: dict[str, str] = {}
    for fields in objects:
        title = composed(fields.get("name"))
        if is_title(title) and title not in names:
            names[title] = identifier_of(title, fields.get("category", ""), taken)
            taken.add(names[title])
    out = []
    for fields in objects:
        title, name = composed(fields.get("name")), name_of(fields.get("name"), names)
        if name != fields.get("name"):
            fields = {**fields, "name": name, "title": fields.get("title", title)}
        if isinstance(fields.get("between"), list):
            fields = {**fields, "between": [name_of(one, names) for one in fields["between"]]}
        out.append(fields)
    return out, names


def _others(fields: Mapping[str, Any]) -> list[str]:
    """The names that an object stands between, as far as they are some."""
    stated = fields.get("between")
    return [name for name in stated if isinstance(name, str)] if isinstance(stated, list) else []


def _tried(errors: list[GraphError], build: Callable[..., Any], *words: Any) -> Any:
    """What a function builds; its `GraphError` is added to `errors`, so that all of a file are told at once."""
    try:
        return build(*words)
    except GraphError as error:
        errors.append(error)
        return None


def _room(data: Mapping[str, Any]) -> RoomSpec:
    """The room with its doors, windows and passages, which may stand beside it or within it."""
    fields = _fields(data["room"], "type", ("room",))
    words = [*listed_words(fields, ("room",)), *listed_words(data, ())]
    room = _built(RoomSpec, {key: value for key, value in fields.items() if key not in LISTS}, ("room",))
    for kind, entry, about in words:
        try:
            room = with_openings(room, [(kind, entry)])
        except GraphError as error:
            raise GraphError(str(error), about) from None
    return room


def with_openings(room: RoomSpec, words: Iterable[tuple[str, Any]]) -> RoomSpec:
    """The room with more openings, each as (kind, what a person writes); raises `GraphError`."""
    for kind, entry in words:
        one = opening_from_words(entry, kind, room, [opening.name for opening in room.openings])
        room = room.replaced(openings=(*room.openings, one))
    return room


def _built(model: type[Built], fields: dict[str, Any], about: Path) -> Built:
    needed = [name for name, info in model.model_fields.items() if info.is_required()]
    only_fields(fields, tuple(model.model_fields), about)
    for name in needed:
        if name not in fields:
            first = next(iter(fields.values()), None)
            named = f" {shown(first)}" if isinstance(first, str) else ""
            raise GraphError(f"{'.'.join(map(str, about))}{named}: {name} is missing", about)
    try:
        return model(**fields)
    except GraphError as error:
        raise GraphError(str(error), (*about, *error.about)) from None


def only_fields(fields: Mapping[str, Any], allowed: tuple[str, ...], about: Path) -> None:
    """Raise `GraphError` for a field that is not allowed."""
    for key in fields:
        if key not in allowed:
            near = difflib.get_close_matches(str(key), allowed, n=1)
            hint = f"did you mean {near[0]}?" if near else f"allowed: {', '.join(allowed)}"
            raise GraphError(f"unknown field {shown(key)}: {hint}", (*about, key))


def _fields(entry: Any, short: str, about: Path) -> dict[str, Any]:
    """The fields of `entry`, which may be just the value of the field `short`."""
    if isinstance(entry, Mapping):
        return dict(entry)
    if isinstance(entry, str):
        return {short: entry}
    where = ".".join(str(part) for part in about)
    raise GraphError(f"{where}: found {shown(entry)}, allowed: a {short} or a mapping with {short}", about)


def _objects(entries: Any, key: str) -> Iterator[dict[str, Any]]:
    """The fields of each node: from a mapping of names, or from a list of mappings and of bare categories."""
    if entries is None:
        return
    if isinstance(entries, Mapping):
        for i, (name, entry) in enumerate(entries.items()):
            fields = _fields(name if entry is None else entry, "category", ("nodes", i))
            if "name" in fields:
                raise GraphError(f"object {shown(name)}: a second name, allowed: the key alone", ("nodes", i, "name"))
            yield {"name": name, **fields}
        return
    if not isinstance(entries, list):
        raise GraphError(f"{key}: found {shown(entries)}, allowed: a mapping of names to categories, or a list", (key,))
    often = Counter(_own_name(entry) for entry in entries if isinstance(entry, str))
    names = (entry.get("name") for entry in entries if isinstance(entry, Mapping))
    taken = {name for name in names if isinstance(name, str)}
    counted: Counter[str] = Counter()
    for i, entry in enumerate(entries):
        fields = _fields(entry, "category", ("nodes", i))
        if isinstance(entry, str):
            name = _own_name(entry)
            if often[name] > 1 or name in taken:
                counted[name] += 1
                while f"{name}_{counted[name]}" in taken:
                    counted[name] += 1
                name = f"{name}_{counted[name]}"
            fields["name"] = name
        yield fields


def _in_radians(fields: dict[str, Any], about: Path) -> dict[str, Any]:
    """The fields with `yaw` for `yaw_degrees`."""
    if "yaw_degrees" not in fields:
        return fields
    if "yaw" in fields:
        raise GraphError("both yaw and yaw_degrees are given, allowed: one of them", (*about, "yaw_degrees"))
    degrees = fields["yaw_degrees"]
    if isinstance(degrees, bool) or not isinstance(degrees, int | float) or not abs(degrees) <= 360:
        raise GraphError(f"yaw_degrees: found {shown(degrees)}, allowed: -360 to 360", (*about, "yaw_degrees"))
    return {**{key: value for key, value in fields.items() if key != "yaw_degrees"}, "yaw": f"{degrees} deg"}


def _own_name(category: str) -> str:
    """The name of an object that is listed by its category alone."""
    name = normalised(category)
    return name if IDENTIFIER.fullmatch(name) else vocabulary().category(category).name


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
        text = " ".join(words)
        raise GraphError(f"'{text}': found one other object, allowed: two, such as table {named} sofa and chair", about)
    return Placed(words[0], named, others)


def _refuse_slip(words: list[str], about: Path) -> None:
    """Raise `GraphError` for words that are no predicate but nearly a placement: `e agaist wall`."""
    try:
        vocabulary().predicate(" ".join(words[1:-1]))
    except UnknownWord:
        rows = {word: row for row in vocabulary().placements for word in (row.name, *row.aliases)}
        whole, first = normalised(" ".join(words[1:])), normalised(words[1])
        alone = [word for word, row in rows.items() if not row.others]
        near = difflib.get_close_matches(whole, alone, n=1, cutoff=TYPO)
        if "and" in words[2:]:
            near = near or difflib.get_close_matches(first, [w for w in rows if w not in alone], n=1, cutoff=TYPO)
        if near:
            text = f"relation '{' '.join(words)}': did you mean {rows[near[0]].name.replace('_', ' ')}?"
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
    fields = fields_of_sentence(text, (), names)
    return fields if isinstance(fields, Placed) else Relation(**fields)


def placed_fields(placed: Placed) -> dict[str, Any]:
    """The field of a node that states a placement."""
    return {"between": placed.others} if placed.others else {"place": placed.placement}


def stating(graph: SceneGraph, text: str) -> SceneGraph:
    """The graph in which a sentence holds as well; raises `GraphError`."""
    stated = sentence(text, graph.titles)
    if isinstance(stated, Placed):
        return graph.update_node(stated.subject, **placed_fields(stated))
    return graph.relate(stated.subject, stated.predicate, stated.object)


def without(graph: SceneGraph, text: str) -> SceneGraph:
    """The graph without what a sentence states; raises `GraphError` where it does not."""
    stated = sentence(text, graph.titles)
    if isinstance(stated, Relation):
        return graph.unrelate(stated.subject, stated.predicate, stated.object)
    held = graph.node(stated.subject).placements
    if not any(one.placement == stated.placement and set(one.others) == set(stated.others) for one in held):
        listed = ", ".join(map(str, held)) or "nothing"
        raise GraphError(f"'{stated}' is not stated in this graph; of the place of {stated.subject}: {listed}")
    return graph.update_node(stated.subject, **dict.fromkeys(placed_fields(stated)))


def short_text(graph: SceneGraph) -> str:
    """The short YAML form of a graph, which a person would write."""
    form = plain(graph)
    room = form["room"]
    lines = [f"room: {flow(room['type'] if len(room) == 1 else room)}", "objects:"]
    for node in form["nodes"]:
        name = node.pop("name")
        lines.append(f"  {flow(name)}: {flow(node['category'] if len(node) == 1 else node)}")
    if graph.relations:
        lines.append("relations:")
    for relation, entry in zip(graph.relations, form["relations"], strict=True):
        lines.append(f"  - {relation if len(entry) == 3 else flow(entry)}")
    return "\n".join(lines) + "\n"
