"""The scene graph: frozen pydantic models that are valid or raise, with edits that return a new valid graph."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from numbers import Real
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, StrictBool, ValidationError, model_validator

from echomodel.vocabulary import vocabulary
from echousd.graph.consistency import GraphError, check_triples, listed

if TYPE_CHECKING:
    from echousd.graph.difference import GraphDiff

MAX_TEXT = 65_536  # characters in one string: what an attribute may hold before it is taken for a mistake
MAX_NAME = 100  # characters: names become file names of assets
Vector: TypeAlias = tuple[float, float, float]
Point: TypeAlias = tuple[float, float]
Scalar: TypeAlias = bool | int | float | str


def _identifier(value: Any) -> str:
    if not isinstance(value, str) or not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", value):
        raise ValueError(f"{shown(value)} is no identifier, allowed: letters, digits and _, not starting with a digit")
    if len(value) > MAX_NAME:
        raise ValueError(f"{shown(value)} has {len(value)} characters, allowed: {MAX_NAME}")
    return value


def _text(value: Any) -> str:
    if not isinstance(value, str) or not value.strip():
        raise ValueError(f"found {shown(value)}, allowed: a non-empty text")
    return _storable(value)


def _storable(value: str) -> str:
    if len(value) > MAX_TEXT:
        raise ValueError(f"a text of {len(value)} characters, allowed: {MAX_TEXT}")
    if "\0" in value or any("\ud800" <= character <= "\udfff" for character in value):
        raise ValueError(f"{shown(value)} holds a character that UTF-8 text cannot hold")
    return value


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, Real) or not math.isfinite(value):
        raise ValueError(f"found {shown(value)}, allowed: a finite number")
    return float(value)


def _positive(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, Real) or not 0 < value < math.inf:
        raise ValueError(f"found {shown(value)}, allowed: a positive number of metres")
    return float(value)


def _share(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, Real) or not 0 <= value <= 1:
        raise ValueError(f"found {shown(value)}, allowed: a number from 0 to 1")
    return float(value)


def _numbers(count: int, each: Callable[[Any], float], meaning: str) -> Callable[[Any], tuple[float, ...]]:
    def check(value: Any) -> tuple[float, ...]:
        try:
            numbers = tuple(each(number) for number in ([] if isinstance(value, str | Mapping) else value))
        except (TypeError, ValueError):
            numbers = ()
        if len(numbers) != count:
            raise ValueError(f"found {shown(value)}, allowed: {meaning}")
        return numbers

    return check


def _corners(value: Any) -> tuple[Point, ...]:
    each = _numbers(2, _number, "corners [x, z] in metres")
    if isinstance(value, str | Mapping) or not isinstance(value, Iterable):
        raise ValueError(f"found {shown(value)}, allowed: at least three corners [x, z] in metres")
    corners = tuple((x, z) for x, z in (each(corner) for corner in value))
    if len(corners) < 3 or abs(polygon_area(corners)) < 1e-6:
        raise ValueError(f"{len(corners)} corners that enclose no area, allowed: at least three corners around the floor")
    return corners


def _attributes(value: Any) -> dict[str, Scalar]:
    if not isinstance(value, Mapping):
        raise ValueError(f"found {shown(value)}, allowed: names with a text, a number or true/false each")
    checked: dict[str, Scalar] = {}
    for key, entry in value.items():
        checked[_identifier(key)] = _scalar(key, entry)
    return checked


def _scalar(key: str, value: Any) -> Scalar:
    if isinstance(value, str):
        try:
            return _storable(value)
        except ValueError as error:
            raise ValueError(f"{key} is {error}") from None
    if isinstance(value, int) and -(2**63) <= value < 2**63:  # bool is an int and stays one
        return value
    if isinstance(value, float) and math.isfinite(value):
        return value
    raise ValueError(f"{key} is {shown(value)}, allowed: a text, a finite number below 2^63 or true/false")


def _optional(check: Callable[[Any], Any]) -> BeforeValidator:
    return BeforeValidator(lambda value: None if value is None else check(value))


def _word(kind: str) -> BeforeValidator:
    def check(value: Any) -> str:
        if not isinstance(value, str):
            raise ValueError(f"found {shown(value)}, allowed: the name of a {kind.replace('_', ' ')}")
        return getattr(vocabulary(), kind)(value).name

    return BeforeValidator(check)


Name: TypeAlias = Annotated[str, BeforeValidator(_identifier)]
Size: TypeAlias = Annotated[Vector | None, _optional(_numbers(3, _positive, "three positive numbers [x, y, z], metres"))]
Place: TypeAlias = Annotated[Vector | None, _optional(_numbers(3, _number, "three finite numbers [x, y, z], metres"))]
Extent: TypeAlias = Annotated[Point | None, _optional(_numbers(2, _positive, "two positive numbers [x, z], metres"))]


class _Model(BaseModel):
    """Frozen, without unknown fields, and with errors of one line."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    def __init__(self, **fields: Any) -> None:
        try:
            super().__init__(**fields)
        except ValidationError as error:
            raise GraphError(self._complaint(fields, error)) from None

    @classmethod
    def _complaint(cls, fields: dict[str, Any], error: ValidationError) -> str:
        first = error.errors(include_url=False)[0]
        message = str(first["ctx"]["error"]) if first["type"] == "value_error" else first["msg"]
        where = ".".join(str(part) for part in first["loc"])
        if first["type"] == "extra_forbidden":
            message = f"unknown field, allowed: {', '.join(cls.model_fields)}"
        return f"{cls._title(fields)}{where + ': ' if where else ''}{message}"

    @classmethod
    def _title(cls, fields: dict[str, Any]) -> str:
        return ""

    def replaced(self, **fields: Any) -> Any:
        """A copy with other values in `fields`, validated."""
        return type(self)(**{**{name: getattr(self, name) for name in type(self).model_fields}, **fields})


class RoomSpec(_Model):
    """The room: its type, and where known its floor (corners around it, or the extents of its bounding box) and height.

    Arguments:
        type: room type or an alias of one.
        floor_polygon: at least three corners (x, z), metres.
        size: (x, z) extents of the floor, metres; with a polygon, those of its bounding box.
        height: metres.
    """

    type: Annotated[str, _word("room_type")]
    floor_polygon: Annotated[tuple[Point, ...] | None, _optional(_corners)] = None
    size: Extent = None
    height: Annotated[float | None, _optional(_positive)] = None

    def __init__(self, type: str, **fields: Any) -> None:
        super().__init__(type=type, **fields)

    @classmethod
    def _title(cls, fields: dict[str, Any]) -> str:
        return "room: "

    @model_validator(mode="after")
    def _agrees(self) -> RoomSpec:
        if self.floor_polygon and self.size:
            found = bounding_extents(self.floor_polygon)
            if max(abs(a - b) for a, b in zip(found, self.size, strict=True)) > 1e-3:
                raise ValueError(f"size is {self.size} but floor_polygon spans {found}; leave one of them out")
        return self

    @property
    def extents(self) -> Point | None:
        """(x, z) extents of the floor's bounding box in metres, None where nothing is known."""
        return bounding_extents(self.floor_polygon) if self.floor_polygon else self.size


class Node(_Model):
    """An object of the room.

    Arguments:
        name: valid USD identifier, unique in the graph.
        category: category or an alias of one.
        style: objects with the same style group belong together.
        size: (x, y, z) extents in the object frame, metres, where fixed.
        position: (x, y, z) centre of the bottom face in the room frame, metres, where fixed.
        yaw: radians about +Y, where fixed.
        locked: the object stays as it is when the room is generated again.
        attributes: free data, identifiers to texts, numbers or booleans.
    """

    name: Name
    category: Annotated[str, _word("category")]
    style: Annotated[str | None, _optional(_text)] = None
    size: Size = None
    position: Place = None
    yaw: Annotated[float | None, _optional(_number)] = None
    locked: StrictBool = False
    attributes: Annotated[dict[str, StrictBool | int | float | str], BeforeValidator(_attributes)] = Field(
        default_factory=dict
    )

    def __init__(self, name: str, category: str, **fields: Any) -> None:
        super().__init__(name=name, category=category, **fields)

    @classmethod
    def _title(cls, fields: dict[str, Any]) -> str:
        return f"object {shown(fields['name'])}: "


class Relation(_Model):
    """`subject predicate object`, such as bed left wardrobe: the bed is left of the wardrobe in the room's frame.

    Arguments:
        subject: name of a node.
        predicate: predicate or an alias of one.
        object: name of another node.
        confidence: 0 to 1.
    """

    subject: Name
    predicate: Annotated[str, _word("predicate")]
    object: Name
    confidence: Annotated[float, BeforeValidator(_share)] = 1.0

    def __init__(self, subject: str, predicate: str, object: str, confidence: float = 1.0, **fields: Any) -> None:
        super().__init__(subject=subject, predicate=predicate, object=object, confidence=confidence, **fields)

    @classmethod
    def _title(cls, fields: dict[str, Any]) -> str:
        said = " ".join(str(fields[part]) for part in ("subject", "predicate", "object"))
        return f"relation {shown(said)}: "

    @property
    def triple(self) -> tuple[str, str, str]:
        """(subject, predicate, object)."""
        return self.subject, self.predicate, self.object

    def __str__(self) -> str:
        return " ".join(self.triple)


class SceneGraph(_Model):
    """A room described by objects and relations, always valid; every edit returns a new graph or raises `GraphError`."""

    room: RoomSpec
    nodes: tuple[Node, ...]
    relations: tuple[Relation, ...] = ()

    def __init__(
        self, room: RoomSpec | str, nodes: tuple[Node, ...] = (), relations: tuple[Relation, ...] = (), **fields: Any
    ) -> None:
        room = RoomSpec(room) if isinstance(room, str) else room
        super().__init__(room=room, nodes=nodes, relations=relations, **fields)

    @model_validator(mode="after")
    def _consistent(self) -> SceneGraph:
        if not self.nodes:
            raise ValueError("the graph is empty, allowed: at least one object")
        seen: set[str] = set()
        for node in self.nodes:
            if node.name in seen:
                raise ValueError(f"two objects are called {node.name!r}, allowed: a name of its own for each")
            seen.add(node.name)
        check_triples([relation.triple for relation in self.relations], seen)
        return self

    @cached_property
    def _by_name(self) -> dict[str, Node]:
        return {node.name: node for node in self.nodes}

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all nodes in order."""
        return tuple(node.name for node in self.nodes)

    def node(self, name: str) -> Node:
        """The node called `name`; raises `GraphError`."""
        if name not in self._by_name:
            raise GraphError(f"no object {shown(name)} in this graph, allowed: {listed(sorted(self._by_name))}")
        return self._by_name[name]

    def relations_of(self, name: str) -> tuple[Relation, ...]:
        """The relations that `name` takes part in, as subject or object."""
        self.node(name)
        return tuple(r for r in self.relations if name in (r.subject, r.object))

    # -- edits ---------------------------------------------------------------------------------------------------------

    def add_node(self, node: Node | str, category: str | None = None, **fields: Any) -> SceneGraph:
        """With one more node, given whole or as name, category and further fields of `Node`."""
        if not isinstance(node, Node):
            node = Node(node, node if category is None else category, **fields)
        return self.replaced(nodes=(*self.nodes, node))

    def remove_node(self, name: str) -> SceneGraph:
        """Without a node and without its relations."""
        gone = self.node(name)
        return self.replaced(
            nodes=tuple(node for node in self.nodes if node is not gone),
            relations=tuple(r for r in self.relations if name not in (r.subject, r.object)),
        )

    def update_node(self, name: str, /, **fields: Any) -> SceneGraph:
        """With other values in `fields` of one node; a new `name` goes through all relations."""
        old = self.node(name)
        new = old.replaced(**fields)

        def renamed(end: str) -> str:
            return new.name if end == name else end

        relations = self.relations
        if new.name != name:
            relations = tuple(r.replaced(subject=renamed(r.subject), object=renamed(r.object)) for r in relations)
        return self.replaced(nodes=tuple(new if node is old else node for node in self.nodes), relations=relations)

    def rename_node(self, name: str, new_name: str) -> SceneGraph:
        """With a node, and the relations it takes part in, under another name."""
        return self.update_node(name, name=new_name)

    def relabel_node(self, name: str, category: str) -> SceneGraph:
        """With another category for a node."""
        return self.update_node(name, category=category)

    def lock(self, name: str, locked: bool = True) -> SceneGraph:
        """With a node that stays as it is (or, `locked=False`, no longer has to)."""
        return self.update_node(name, locked=locked)

    def relate(self, subject: str, predicate: str, object: str, confidence: float = 1.0) -> SceneGraph:
        """With one more relation."""
        return self.replaced(relations=(*self.relations, Relation(subject, predicate, object, confidence)))

    def unrelate(self, subject: str, predicate: str, object: str) -> SceneGraph:
        """Without a relation."""
        gone = self.relation(subject, predicate, object)
        return self.replaced(relations=tuple(r for r in self.relations if r is not gone))

    def change_relation(
        self, subject: str, predicate: str, object: str, new_predicate: str, confidence: float | None = None
    ) -> SceneGraph:
        """With another predicate (and confidence, where given) for one relation."""
        old = self.relation(subject, predicate, object)
        new = Relation(subject, new_predicate, object, old.confidence if confidence is None else confidence)
        return self.replaced(relations=tuple(new if r is old else r for r in self.relations))

    def relation(self, subject: str, predicate: str, object: str) -> Relation:
        """The relation with these ends and this predicate (or alias); raises `GraphError`."""
        wanted = (subject, vocabulary().predicate(predicate).name, object)
        found = next((r for r in self.relations if r.triple == wanted), None)
        if found is None:
            between = [str(r) for r in self.relations if {r.subject, r.object} == {subject, object}]
            hint = f"between them: {listed(between)}" if between else f"nothing relates {subject!r} and {object!r}"
            raise GraphError(f"no relation '{' '.join(wanted)}' in this graph; {hint}")
        return found

    def diff(self, other: SceneGraph) -> GraphDiff:
        """What has to change in this graph to become `other`."""
        from echousd.graph.difference import GraphDiff

        return GraphDiff.between(self, other)

    # -- text forms and stages -----------------------------------------------------------------------------------------

    @classmethod
    def from_json(cls, text: str) -> SceneGraph:
        """Read the canonical JSON form (or the short form, as JSON); raises `GraphError` with the line at fault."""
        from echousd.graph.text import graph_from_text

        return graph_from_text(text, "json")

    def to_json(self) -> str:
        """The canonical JSON form: fields in a fixed order, one node and one relation a line, defaults left out."""
        from echousd.graph.text import graph_to_json

        return graph_to_json(self)

    @classmethod
    def from_yaml(cls, text: str) -> SceneGraph:
        """Read the short YAML form (or the canonical form, as YAML); raises `GraphError` with the line at fault."""
        from echousd.graph.text import graph_from_text

        return graph_from_text(text, "yaml")

    def to_yaml(self) -> str:
        """The short YAML form that a person would write."""
        from echousd.graph.text import graph_to_yaml

        return graph_to_yaml(self)

    @classmethod
    def from_stage(cls, stage: Any, room: str | None = None) -> SceneGraph:
        """Read the graph of a stage or of the file at a path; `room` is the prim path of the room where there are several."""
        from echousd.stage import read_graph

        return read_graph(stage, room=room)

    def to_stage(self, path: str | os.PathLike[str]) -> None:
        """Write a stage that holds this graph; raises where `path` cannot be written."""
        from echousd.stage import graph_layer, save_layer

        save_layer(graph_layer(self), path)


def bounding_extents(corners: tuple[Point, ...]) -> Point:
    """(x, z) extents of the bounding box of `corners`, metres."""
    xs, zs = [x for x, _ in corners], [z for _, z in corners]
    return max(xs) - min(xs), max(zs) - min(zs)


def polygon_area(corners: tuple[Point, ...]) -> float:
    """Signed area of a polygon in square metres (shoelace formula)."""
    pairs = zip(corners, (*corners[1:], corners[0]), strict=True)
    return sum(x0 * z1 - x1 * z0 for (x0, z0), (x1, z1) in pairs) / 2


def shown(value: Any, most: int = 60) -> str:
    """`repr(value)` cut to `most` characters: what an error message shows of a value."""
    text = repr(value[: most + 1] if isinstance(value, str) else value)
    return text if len(text) <= most + 2 else f"{text[: most - 3]}...{text[0] if text[0] in chr(34) + chr(39) else ''}"
