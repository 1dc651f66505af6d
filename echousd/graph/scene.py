"""The scene graph: frozen pydantic models that are valid or raise, with edits that return a new valid graph."""

from __future__ import annotations

import os
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from echomodel.openings import check_openings, rectangle
from echomodel.vocabulary import vocabulary
from echousd.graph import fields as field
from echousd.graph.consistency import GraphError, check_triples, listed

if TYPE_CHECKING:
    from echousd.graph.difference import GraphDiff


class _Model(BaseModel):
    """Frozen, without unknown fields, and with errors of one line."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    def __init__(self, **fields: Any) -> None:
        try:
            super().__init__(**fields)
        except ValidationError as error:
            raise self._explained(fields, error) from None

    @classmethod
    def _explained(cls, fields: dict[str, Any], error: ValidationError) -> GraphError:
        first = error.errors(include_url=False)[0]
        cause = first["ctx"]["error"] if first["type"] == "value_error" else None
        message = first["msg"] if cause is None else str(cause)
        where = ".".join(str(part) for part in first["loc"])
        if first["type"] == "extra_forbidden":
            message = f"unknown field, allowed: {', '.join(cls.model_fields)}"
        about = (*first["loc"], *getattr(cause, "about", ()))
        return GraphError(f"{cls._title(fields)}{where + ': ' if where else ''}{message}", about)

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
        openings: doors, windows and passages in the walls; wall i is the edge from corner i of the floor to the next,
            of a rectangle the one at -z, +x, +z and -x.
    """

    type: field.RoomTypeWord
    floor_polygon: field.Corners = None
    size: field.Extents = None
    height: field.Height = None
    openings: field.Openings = ()

    def __init__(self, type: str, **fields: Any) -> None:
        super().__init__(type=type, **fields)

    @classmethod
    def _title(cls, fields: dict[str, Any]) -> str:
        return "room: "

    @model_validator(mode="after")
    def _agrees(self) -> RoomSpec:
        if self.floor_polygon and self.size:
            found = field.bounding_extents(self.floor_polygon)
            if max(abs(a - b) for a, b in zip(found, self.size, strict=True)) > 1e-3:
                raise ValueError(f"size is {self.size} but floor_polygon spans {found}; leave one of them out")
        for position in range(len(self.openings)):
            try:
                check_openings(self.openings[: position + 1], self.corners, self.height)
            except ValueError as error:
                raise GraphError(str(error), ("openings", position)) from None
        return self

    @property
    def extents(self) -> field.Point | None:
        """(x, z) extents of the floor's bounding box in metres, None where nothing is known."""
        return field.bounding_extents(self.floor_polygon) if self.floor_polygon else self.size

    @property
    def corners(self) -> np.ndarray | None:
        """(k, 2) float, the floor's corners (x, z) in metres, None where nothing is known."""
        if self.floor_polygon:
            return np.asarray(self.floor_polygon, float)
        return rectangle(*self.size) if self.size else None


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

    name: field.Name
    category: field.CategoryWord
    style: field.Style = None
    size: field.Size = None
    position: field.Position = None
    yaw: field.Angle = None
    locked: field.Flag = False
    attributes: field.Attributes = Field(default_factory=dict)

    def __init__(self, name: str, category: str, **fields: Any) -> None:
        super().__init__(name=name, category=category, **fields)

    @classmethod
    def _title(cls, fields: dict[str, Any]) -> str:
        return f"object {field.shown(fields['name'])}: "


class Relation(_Model):
    """`subject predicate object`, such as bed left wardrobe: the bed is left of the wardrobe in the room's frame.

    Arguments:
        subject: name of a node.
        predicate: predicate or an alias of one.
        object: name of another node.
        confidence: 0 to 1.
    """

    subject: field.Name
    predicate: field.PredicateWord
    object: field.Name
    confidence: field.Confidence = 1.0

    def __init__(self, subject: str, predicate: str, object: str, confidence: float = 1.0, **fields: Any) -> None:
        super().__init__(subject=subject, predicate=predicate, object=object, confidence=confidence, **fields)

    @classmethod
    def _title(cls, fields: dict[str, Any]) -> str:
        said = " ".join(str(fields[part]) for part in ("subject", "predicate", "object"))
        return f"relation {field.shown(said)}: "

    @property
    def triple(self) -> tuple[str, str, str]:
        """(subject, predicate, object)."""
        return self.subject, self.predicate, self.object

    def __str__(self) -> str:
        return " ".join(self.triple)


class SceneGraph(_Model):
    """A room described by objects and relations, always valid; edits return a new graph or raise `GraphError`."""

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
        for position, node in enumerate(self.nodes):
            if node.name in seen:
                message = f"two objects are called {node.name!r}, allowed: a name of its own for each"
                raise GraphError(message, ("nodes", position))
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
            raise GraphError(f"no object {field.shown(name)} in this graph, allowed: {listed(sorted(self._by_name))}")
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
        """Read the graph of a stage or of the file at a path; `room` is the prim path of one room of several."""
        from echousd.stage import read_graph

        return read_graph(stage, room=room)

    def to_stage(self, path: str | os.PathLike[str]) -> None:
        """Write a stage that holds this graph; raises where `path` cannot be written."""
        from echousd.stage import graph_layer, save_layer

        save_layer(graph_layer(self), path)
