"""The scene graph: frozen pydantic models that are valid or raise, with edits that return a new valid graph."""

from __future__ import annotations

import json
from collections import Counter
from functools import cached_property
from typing import TYPE_CHECKING, Any

from pydantic import model_validator

from echomodel.late import Late
from echomodel.vocabulary import vocabulary
from echousd.graph import fields as field
from echousd.graph.consistency import GraphError, listed, name_faults, raise_all, triple_faults
from echousd.graph.nodes import Node, Placed, PlainModel, Relation, RoomSpec
from echousd.graph.values import shown

if TYPE_CHECKING:
    from echousd.graph.difference import GraphDiff

graph_from_text, short_text = (Late(f"echousd.graph.text:{name}") for name in ("graph_from_text", "short_text"))
steps_between = Late("echousd.graph.difference:GraphDiff.between")
name_of = Late("echousd.graph.titles:name_of")


class SceneGraph(PlainModel):
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
        if len(self.nodes) > field.MAX_NODES:
            raise ValueError(f"the graph has {len(self.nodes)} objects, allowed: {field.MAX_NODES}")
        wrong = name_faults([(node.name, node.between or ()) for node in self.nodes])
        raise_all([*wrong, *triple_faults([relation.triple for relation in self.relations], self.names)])
        return self

    def __hash__(self) -> int:
        return hash(self.names)  # equal graphs have equal ones

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

    @property
    def titles(self) -> dict[str, str]:
        """Title of every node to its name, where it means that node alone: no other has that title or that name."""
        often = Counter(node.title for node in self.nodes)
        named = {node.title: node.name for node in self.nodes if node.title is not None and often[node.title] == 1}
        return {title: name for title, name in named.items() if title not in self._by_name}

    @property
    def placements(self) -> tuple[Placed, ...]:
        """What is said of the places of single objects, in the order of the nodes."""
        return tuple(placed for node in self.nodes for placed in node.placements)

    # -- edits ---------------------------------------------------------------------------------------------------------

    def add_node(self, node: Node | str, category: str | None = None, **fields: Any) -> SceneGraph:
        """With one more node, given whole or as name, category and further fields of `Node`."""
        if not isinstance(node, Node):
            node = Node(node, node if category is None else category, **fields)
        return self.replaced(nodes=(*self.nodes, node))

    def remove_node(self, name: str) -> SceneGraph:
        """Without a node and without its relations."""
        gone = self.node(name)
        left = [node for node in self.nodes if node is not gone]
        return self.replaced(
            nodes=tuple(n.replaced(between=None) if name in (n.between or ()) else n for n in left),
            relations=tuple(r for r in self.relations if name not in (r.subject, r.object)),
        )

    def update_node(self, name: str, /, **fields: Any) -> SceneGraph:
        """With other values in `fields` of one node; a new `name` goes through all relations."""
        old = self.node(name)
        new = old.replaced(**fields)

        def renamed(end: str) -> str:
            return new.name if end == name else end

        relations, nodes = self.relations, [new if node is old else node for node in self.nodes]
        if new.name != name:
            relations = tuple(r.replaced(subject=renamed(r.subject), object=renamed(r.object)) for r in relations)
            nodes = [n.replaced(between=tuple(map(renamed, n.between))) if n.between else n for n in nodes]
        return self.replaced(nodes=tuple(nodes), relations=relations)

    def lock(self, name: str, locked: bool = True) -> SceneGraph:
        """With a node that stays as it is (or, `locked=False`, no longer has to)."""
        return self.update_node(name, locked=locked)

    def with_room(self, **fields: Any) -> SceneGraph:
        """With other values in `fields` of the room."""
        return self.replaced(room=self.room.replaced(**fields))

    def relate(self, subject: str, predicate: str, object: str, confidence: float = 1.0) -> SceneGraph:
        """With one more relation in words that files take, `relate("tv", "under", "shelf")`; raises `GraphError`."""
        ends = self._ends(subject, predicate, object)
        return self.replaced(relations=(*self.relations, Relation(*ends, confidence)))

    def _ends(self, subject: str, predicate: str, object: str) -> tuple[str, str, str]:
        """Names and predicate of a relation in somebody's words: `a under b` is `b above a`."""
        subject, object = name_of(subject, self.titles), name_of(object, self.titles)
        turned = vocabulary().swapped(predicate) if isinstance(predicate, str) else None
        return (subject, predicate, object) if turned is None else (object, turned.name, subject)

    def unrelate(self, subject: str, predicate: str, object: str) -> SceneGraph:
        """Without a relation."""
        gone = self.relation(subject, predicate, object)
        return self.replaced(relations=tuple(r for r in self.relations if r is not gone))

    def relation(self, subject: str, predicate: str, object: str) -> Relation:
        """The relation with these ends and this predicate (or alias); raises `GraphError`."""
        subject, predicate, object = self._ends(subject, predicate, object)
        wanted = (subject, vocabulary().predicate(predicate).name, object)
        found = next((r for r in self.relations if r.triple == wanted), None)
        if found is None:
            between = [str(r) for r in self.relations if {r.subject, r.object} == {subject, object}]
            hint = f"between them: {listed(between)}" if between else f"nothing relates {subject!r} and {object!r}"
            raise GraphError(f"no relation '{' '.join(wanted)}' in this graph; {hint}")
        return found

    def diff(self, other: SceneGraph) -> GraphDiff:
        """What has to change in this graph to become `other`."""
        return steps_between(self, other)

    # -- text forms and stages -----------------------------------------------------------------------------------------

    @classmethod
    def from_json(cls, text: str) -> SceneGraph:
        """Read the canonical JSON form (or the short form, as JSON); raises `GraphError` with the line at fault."""
        return graph_from_text(cls, text, "json")

    def to_json(self) -> str:
        """The canonical JSON form: fields in a fixed order, one node and one relation a line, defaults left out."""

        def line(value: Any) -> str:
            return json.dumps(value, ensure_ascii=False, allow_nan=False)

        def block(entries: list[Any]) -> str:
            return "[\n    " + ",\n    ".join(map(line, entries)) + "\n  ]" if entries else "[]"

        form = plain(self)
        return (
            f'{{\n  "room": {line(form["room"])},\n  "nodes": {block(form["nodes"])},\n'
            f'  "relations": {block(form["relations"])}\n}}\n'
        )

    @classmethod
    def from_yaml(cls, text: str) -> SceneGraph:
        """Read the short YAML form (or the canonical form, as YAML); raises `GraphError` with the line at fault."""
        return graph_from_text(cls, text, "yaml")

    def to_yaml(self) -> str:
        """The short YAML form that a person would write."""
        return str(short_text(self))


def plain(graph: SceneGraph) -> dict[str, Any]:
    """The canonical form as plain data: fields in a fixed order, those at their default left out."""

    def stated(model: PlainModel) -> dict[str, Any]:
        return model.model_dump(mode="json", exclude_defaults=True)

    return {
        "room": stated(graph.room),
        "nodes": list(map(stated, graph.nodes)),
        "relations": list(map(stated, graph.relations)),
    }
