"""The graph of a home as plain data: rooms with their own graphs, relations between rooms; its text forms.

home: {area: 75, entrance: hall}
rooms: {hall: hallway, kitchen: {type: kitchen, area: 9, objects: {sink: sink_unit}}, bedroom: {type: bedroom}}
relations: [hall door kitchen, hall door bedroom, bedroom north of kitchen]
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import shapely
from pydantic import BeforeValidator, Field, model_validator

from echomodel.rooms.statistics import room_type_statistics
from echomodel.rows import HomeRelation as Row
from echomodel.vocabulary import normalised, vocabulary
from echousd.graph import GraphError, RoomSpec, SceneGraph, starting_graph
from echousd.graph import fields as field
from echousd.graph.nodes import PlainModel
from echousd.graph.openings import LISTS
from echousd.graph.scene import plain
from echousd.graph.syntax import flow
from echousd.graph.text import graph_from_plain, only_fields
from echousd.graph.values import IDENTIFIER, shown

if TYPE_CHECKING:
    import networkx


MOST_ROOMS = 40
RATIO = 2.5  # long side over short side of a room that says nothing of it
KEYS = ("home", "rooms", "relations")
OF_ROOM = ("area", "ratio")


class HomeRelation(PlainModel):
    """`subject predicate object`, such as kitchen open_to living: between two rooms, in the words of `home_relations`.

    North is the rooms' front (+X), east their right (+Z); who lies north of another has its middle beyond it.
    """

    subject: field.Name
    predicate: Annotated[str, BeforeValidator(lambda word: vocabulary().home_relation(str(word)).name)]
    object: field.Name

    def __init__(self, subject: str, predicate: str, object: str, **fields: Any) -> None:
        super().__init__(subject=subject, predicate=predicate, object=object, **fields)

    @property
    def row(self) -> Row:
        """What the vocabulary knows of its predicate."""
        return vocabulary().home_relation(self.predicate)

    @property
    def pair(self) -> tuple[str, str]:
        """(subject, object)."""
        return self.subject, self.object

    def __str__(self) -> str:
        return f"{self.subject} {self.predicate} {self.object}"


class HomeRoom(PlainModel):
    """A room of a home.

    Arguments:
        name: unique in the home. graph: of what stands in it.
        area: square metres of its floor, None = as such rooms have, in proportion. ratio: long side over short side at
            most.
    """

    name: field.Name
    graph: SceneGraph
    area: Annotated[float | None, Field(gt=0.5, le=500)] = None
    ratio: Annotated[float, Field(ge=1, le=10)] = RATIO

    def __init__(self, name: str, graph: SceneGraph, **fields: Any) -> None:
        super().__init__(name=name, graph=graph, **fields)

    @property
    def type(self) -> str:
        """Its room type."""
        return self.graph.room.type


class HomeGraph(PlainModel):
    """A home described by rooms and relations between them.

    Arguments:
        rooms: at least one. relations: between them.
        area: square metres of all floors together, None = as the rooms need.
        outline: (x, z) of the outer corners of its walls, metres, at right angles; None = free.
        entrance: the room that one enters by, None = the one that most others have their doors to.
    """

    rooms: tuple[HomeRoom, ...]
    relations: tuple[HomeRelation, ...] = ()
    area: Annotated[float | None, Field(gt=1, le=5000)] = None
    outline: field.Corners = None
    entrance: str | None = None

    def __init__(self, rooms: Sequence[HomeRoom], relations: Sequence[HomeRelation] = (), **fields: Any) -> None:
        super().__init__(rooms=tuple(rooms), relations=tuple(relations), **fields)

    @model_validator(mode="after")
    def _consistent(self) -> HomeGraph:
        names = [room.name for room in self.rooms]
        if not 0 < len(names) <= MOST_ROOMS:
            raise ValueError(f"{len(names)} rooms, allowed: 1 to {MOST_ROOMS}")
        for name in names:
            if names.count(name) > 1:
                raise GraphError(f"two rooms are called {name!r}, allowed: a name of its own for each", ("rooms",))
        for number, relation in enumerate(self.relations):
            for end in relation.pair:
                if end not in names:
                    message = f"'{relation}': {end!r} is no room of this home, allowed: {', '.join(names)}"
                    raise GraphError(message, ("relations", number))
            if relation.subject == relation.object:
                raise GraphError(f"'{relation}': a room and itself, allowed: two rooms", ("relations", number))
        if self.entrance is not None and self.entrance not in names:
            raise GraphError(f"entrance {self.entrance!r} is no room, allowed: {', '.join(names)}", ("home",))
        return self

    @classmethod
    def from_words(cls, text: str, **fields: Any) -> HomeGraph:
        """The home that `kitchen open_to living, hall door bedroom*2, balcony` describes; raises `GraphError`.

        A room's name is its type with or without a number (`bedroom_2`), it holds what such rooms do; `*2` makes two of
        it, each related so.
        """
        names: dict[str, None] = {}
        relations: list[HomeRelation] = []

        def rooms(word: str) -> list[str]:
            match = re.fullmatch(rf"({IDENTIFIER.pattern})(?:\*([1-9]|[1-3][0-9]))?", word)
            if match is None:
                raise GraphError(f"rooms: {shown(word)}, allowed: a room type, or several of it as in bedroom*2")
            many = match[2] and match[2] != "1"
            several = [f"{match[1]}_{i + 1}" for i in range(int(match[2]))] if many else [match[1]]
            names.update(dict.fromkeys(several))
            return several

        for part in filter(None, (part.strip() for part in text.split(","))):
            words = part.split()
            if len(words) == 1:
                rooms(part)
                continue
            ends = [rooms(words[0]), rooms(words[-1])] if len(words) > 2 else []
            if not ends:
                raise GraphError(f"rooms: {shown(part)}, allowed: room predicate room, such as hall door bedroom")
            middle = " ".join(words[1:-1])
            relations += [relation_of([one, middle, other]) for one in ends[0] for other in ends[1]]
        outline, kinds = fields.get("outline"), {name: _type_of(name) for name in names}
        area = fields.get("area") or (shapely.Polygon(outline).area if outline else 0.0)
        usual = {name: room_type_statistics(kind).area[2] for name, kind in kinds.items()}
        share = area / max(sum(usual.values()), 1.0)
        graphs = {name: starting_graph(RoomSpec(kind), area=share * usual[name]) for name, kind in kinds.items()}
        return cls([HomeRoom(name, graph) for name, graph in graphs.items()], relations, **fields)

    def room(self, name: str) -> HomeRoom:
        """The room called `name`; raises `GraphError`."""
        found = next((room for room in self.rooms if room.name == name), None)
        if found is None:
            listed = ", ".join(room.name for room in self.rooms)
            raise GraphError(f"no room {shown(name)} in this home, allowed: {listed}")
        return found

    @property
    def passages(self) -> networkx.Graph:
        """Rooms and the pairs that one gets through between."""
        import networkx  # a graph of one room does without

        found = networkx.Graph()
        found.add_nodes_from(room.name for room in self.rooms)
        found.add_edges_from(relation.pair for relation in self.relations if relation.row.passes)
        return found

    @property
    def entered_by(self) -> str:
        """The room that one enters by: as stated, else the one that serves the others best."""
        return self.entrance or max(self.rooms, key=lambda room: self.serves(room.name)).name

    def serves(self, name: str) -> tuple[int, int, int]:
        """How well a room serves others that have their doors to it; the greatest is best."""
        row, place = vocabulary().room_type(self.room(name).type), [room.name for room in self.rooms].index(name)
        indoors = row.use != "outdoor"
        return (row.hub if indoors else -1, self.passages.degree[name], -place)

    def connected(self) -> HomeGraph:
        """The home in which every room is reached: a door to the best room of what one enters, where none leads in."""
        import networkx

        home, start = self, self.entered_by
        while True:
            parts = list(networkx.connected_components(home.passages))
            reached = next(part for part in parts if start in part)
            rest = [room.name for room in home.rooms if room.name not in reached]
            if not rest:
                return home
            part = next(part for part in parts if rest[0] in part)
            hub, via = (max((r.name for r in home.rooms if r.name in p), key=home.serves) for p in (reached, part))
            home = home.replaced(relations=(*home.relations, HomeRelation(hub, "door", via)))

    def relate(self, sentence: str) -> HomeGraph:
        """With one more relation, `kitchen open to living`; one that says how the two are joined replaces another."""
        new = relation_of(sentence)
        kept = [one for one in self.relations if not (new.row.wall and one.row.wall and {*one.pair} == {*new.pair})]
        return self.replaced(relations=(*(one for one in kept if one != new), new))

    def unrelate(self, sentence: str) -> HomeGraph:
        """Without a relation; raises `GraphError` where it is not stated."""
        gone = relation_of(sentence)
        if gone not in self.relations:
            listed = ", ".join(f"'{relation}'" for relation in self.relations)
            raise GraphError(f"no relation '{gone}' in this home, allowed: {listed}")
        return self.replaced(relations=tuple(one for one in self.relations if one != gone))

    def to_json(self) -> str:
        """JSON that `echousd.home.files.load_home` reads."""
        rooms = {}
        for room in self.rooms:
            inside = plain(room.graph)
            del inside["room"]
            rooms[room.name] = {**_about_room(room), **inside}
        content = {"home": self._about(), "rooms": rooms, "relations": [str(relation) for relation in self.relations]}
        return json.dumps(content, ensure_ascii=False, indent=1) + "\n"

    def to_yaml(self) -> str:
        """The short YAML form that a person would write, which `echousd.home.files.load_home` reads."""
        lines = [f"home: {flow(about)}"] if (about := self._about()) else []
        lines.append("rooms:")
        for room in self.rooms:
            inside = room.graph.to_yaml().splitlines()[1:]  # what it says of the room is said here
            of_room = [f"{key}: {flow(value)}" for key, value in _about_room(room).items()]
            lines += [f"  {flow(room.name)}:", *(f"    {line}" for line in (*of_room, *inside))]
        lines += ["relations:", *(f"  - {relation}" for relation in self.relations)] if self.relations else []
        return "\n".join(lines) + "\n"

    def _about(self) -> dict[str, Any]:
        about = {"area": self.area, "outline": self.outline, "entrance": self.entrance}
        return {key: value for key, value in about.items() if value is not None}


def _about_room(room: HomeRoom) -> dict[str, Any]:
    own = {"area": room.area, "ratio": room.ratio if room.ratio != RATIO else None}
    return {**plain(room.graph)["room"], **{key: value for key, value in own.items() if value is not None}}


def relation_of(sentence: Any) -> HomeRelation:
    """The relation that `kitchen open to living` or [kitchen, open_to, living] states; raises `GraphError`."""
    words = sentence.split() if isinstance(sentence, str) else sentence
    if not isinstance(words, list) or len(words) < 3 or not all(isinstance(word, str) for word in words):
        raise GraphError(f"relation {shown(sentence)}: allowed: room predicate room, such as hall door bedroom")
    return HomeRelation(words[0], " ".join(words[1:-1]), words[-1])


def _type_of(name: str) -> str:
    return vocabulary().room_type(re.sub(r"_?[0-9]+$", "", name)).name


def home_of_plain(data: Any) -> HomeGraph:
    """The home in plain data; raises `GraphError` that says where in it."""
    if not isinstance(data, Mapping) or not isinstance(data.get("rooms"), Mapping):
        raise GraphError("rooms: allowed: a mapping of names to room types or to type, area, objects ...", ("rooms",))
    only_fields(data, KEYS, ())
    forms = {"home": (Mapping, "a mapping with area, outline, entrance"), "relations": (list, "a list of relations")}
    for key, (kind, allowed) in forms.items():
        if data.get(key) and not isinstance(data[key], kind):
            raise GraphError(f"{key}: found {shown(data[key])}, allowed: {allowed}", (key,))
    about = data.get("home") or {}
    only_fields(about, ("area", "outline", "entrance"), ("home",))
    rooms = [_room(str(name), entry) for name, entry in data["rooms"].items()]
    relations = []
    for number, entry in enumerate(data.get("relations") or ()):
        try:
            relations.append(relation_of(entry))
        except GraphError as error:
            raise GraphError(str(error), ("relations", number)) from None
    return HomeGraph(rooms, relations, **about)


def _room(name: str, entry: Any) -> HomeRoom:
    where = ("rooms", name)
    fields = {"type": entry} if isinstance(entry, str) else {} if entry is None else entry
    if not isinstance(fields, Mapping):
        raise GraphError(f"room {name!r}: found {shown(entry)}, allowed: a room type or a mapping", where)
    own = {key: fields[key] for key in OF_ROOM if key in fields}
    spec = {key: value for key, value in fields.items() if key in (*RoomSpec.model_fields, *LISTS)}
    inside = {key: value for key, value in fields.items() if key in ("objects", "nodes", "relations")}
    only_fields(fields, (*own, *spec, *inside, *RoomSpec.model_fields, *OF_ROOM, "objects", "relations", *LISTS), where)
    try:
        spec = spec if "type" in spec else {"type": _type_of(normalised(name)), **spec}
        if any(inside.values()):
            return HomeRoom(name, graph_from_plain(SceneGraph, {"room": spec, **inside}), **own)
        filled = starting_graph(RoomSpec(spec["type"])).nodes[0]  # the walls' words need a graph to be read with
        bare = graph_from_plain(SceneGraph, {"room": spec, "objects": {filled.name: filled.category}})
        return HomeRoom(name, starting_graph(bare.room, area=float(own.get("area") or 0.0)), **own)
    except ValueError as error:
        raise GraphError(f"room {name!r}: {error}", where) from None
