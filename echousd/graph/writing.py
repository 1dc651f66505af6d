"""Scene graphs written as text: the canonical JSON form, and the short YAML form that a person would write."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import yaml

from echomodel.openings import Opening
from echousd.graph.nodes import Node, Relation, RoomSpec
from echousd.graph.openings import stated
from echousd.graph.syntax import Dumper

if TYPE_CHECKING:
    from echousd.graph.scene import SceneGraph


def plain(graph: SceneGraph) -> dict[str, Any]:
    """The canonical form as plain data: fields in a fixed order, those at their default left out."""
    return {
        "room": _stated(graph.room),
        "nodes": [_stated(node) for node in graph.nodes],
        "relations": [_stated(relation) for relation in graph.relations],
    }


def _stated(model: RoomSpec | Node | Relation) -> dict[str, Any]:
    fields = type(model).model_fields
    values = {name: getattr(model, name) for name in fields}
    return {
        name: _lists(value)
        for name, value in values.items()
        if value != fields[name].get_default(call_default_factory=True)
    }


def _lists(value: Any) -> Any:
    if isinstance(value, Opening):
        return stated(value)
    return [_lists(entry) for entry in value] if isinstance(value, tuple) else value


def graph_to_json(graph: SceneGraph) -> str:
    """The canonical JSON form with one node and one relation a line."""

    def line(value: Any) -> str:
        return json.dumps(value, ensure_ascii=False, allow_nan=False)

    def block(entries: list[Any]) -> str:
        return "[\n    " + ",\n    ".join(map(line, entries)) + "\n  ]" if entries else "[]"

    form = plain(graph)
    return (
        f'{{\n  "room": {line(form["room"])},\n  "nodes": {block(form["nodes"])},\n'
        f'  "relations": {block(form["relations"])}\n}}\n'
    )


def graph_to_yaml(graph: SceneGraph) -> str:
    """The short YAML form with one object and one relation a line."""
    form = plain(graph)
    room = form["room"]
    lines = [f"room: {_flow(room['type'] if len(room) == 1 else room)}", "objects:"]
    for node in form["nodes"]:
        name = node.pop("name")
        lines.append(f"  {_flow(name)}: {_flow(node['category'] if len(node) == 1 else node)}")
    if graph.relations:
        lines.append("relations:")
    for relation, said in zip(graph.relations, form["relations"], strict=True):
        lines.append(f"  - {relation if len(said) == 3 else _flow(said)}")
    return "\n".join(lines) + "\n"


def _flow(value: Any) -> str:
    """`value` on one line of YAML."""
    text = yaml.dump(value, Dumper=Dumper, default_flow_style=True, width=10**9, sort_keys=False, allow_unicode=True)
    return text.removesuffix("\n").removesuffix("\n...").strip()
