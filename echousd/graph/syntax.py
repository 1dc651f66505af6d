"""YAML and JSON as plain data that remembers the line of each value, strict where PyYAML guesses.

Words such as on, no and 12:30 stay text (YAML 1.2), keys may not repeat, aliases are refused, nesting is bounded.
"""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import yaml

from echousd.graph.consistency import GraphError
from echousd.graph.values import shown

Path = tuple[str | int, ...]
DEEPEST = 64  # lists and mappings within each other
_RESOLVERS = {
    "null": (r"~|null|Null|NULL|", "~nN\0"),
    "bool": (r"true|True|TRUE|false|False|FALSE", "tTfF"),
    "int": (r"[-+]?[0-9]+", "-+0123456789"),
    "float": (
        r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)",
        "-+.0123456789",
    ),
}


class _Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]  # libyaml's where it is built in
    """The safe loader with YAML 1.2's core schema."""

    yaml_implicit_resolvers: ClassVar[dict] = {}  # type: ignore[misc]


class Dumper(yaml.SafeDumper):
    """The safe dumper that quotes whatever `_Loader` would not read as text."""

    yaml_implicit_resolvers: ClassVar[dict] = {}  # type: ignore[misc]


for _kind, (_pattern, _first) in _RESOLVERS.items():
    for _class in (_Loader, Dumper):
        first = ["" if character == "\0" else character for character in _first]
        _class.add_implicit_resolver(f"tag:yaml.org,2002:{_kind}", re.compile(f"^(?:{_pattern})$"), first)


def _text(dumper: yaml.SafeDumper, text: str) -> yaml.Node:
    style = None if text.isprintable() else '"'  # only in double quotes do all characters come back
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


Dumper.add_representer(str, _text)


@dataclass(frozen=True)
class Located:
    """Plain data with the line (from 1) of every value, by its path of keys and positions.

    `faults` are keys that stand twice, of which the first counts.
    """

    data: Any
    lines: Mapping[Path, int]
    faults: tuple[GraphError, ...] = ()

    def line(self, path: Path) -> int | None:
        """Line of the value at `path`, or of the closest one around it."""
        while path and path not in self.lines:
            path = path[:-1]
        return self.lines.get(path)


def parse_yaml(text: str) -> Located:
    """Read one YAML document; raises `GraphError` that starts with the line of the fault."""
    try:
        _check_depth(text)
        root = yaml.compose(text, Loader=_Loader)
        lines: dict[Path, int] = {}
        twice: list[GraphError] = []
        return Located(None if root is None else _value(root, (), lines, set(), twice), lines, tuple(twice))
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"line {mark.line + 1}: " if mark else ""
        what = " ".join(part for part in (error.context, error.problem) if part)
        raise GraphError(f"{where}not YAML: {what}") from None
    except yaml.YAMLError as error:  # a character that YAML does not allow
        raise GraphError(f"not YAML: {' '.join(str(error).split())}") from None
    except RecursionError:
        raise GraphError("nested too deeply for a scene graph") from None


def _check_depth(text: str) -> None:
    """Raises `GraphError` for nesting beyond `DEEPEST`, on which libyaml's loader would end the process."""
    depth = 0
    for event in yaml.parse(text, Loader=_Loader):
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > DEEPEST:
            raise GraphError("nested too deeply for a scene graph")


def parse_json(text: str) -> Located:
    """Read a JSON document; raises `GraphError` that starts with the line of the fault."""
    repeated: list[str] = []

    def distinct(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found = dict(pairs)
        if len(found) < len(pairs):
            repeated.extend(key for i, (key, _) in enumerate(pairs) if key in dict(pairs[:i]))
        return found

    try:
        data = json.loads(text, object_pairs_hook=distinct)
    except json.JSONDecodeError as error:
        raise GraphError(f"line {error.lineno}: not JSON: {error.msg}") from None
    except RecursionError:
        raise GraphError("nested too deeply for a scene graph") from None
    try:
        as_yaml = parse_yaml(text)  # JSON is YAML but for tabs; the lines are there for messages alone
    except GraphError:
        return Located(data, {}, tuple(GraphError(f"key {shown(key)} stands twice") for key in repeated))
    return Located(data, as_yaml.lines, as_yaml.faults)


def _value(node: yaml.Node, path: Path, lines: dict[Path, int], seen: set[int], twice: list[GraphError]) -> Any:
    if id(node) in seen:
        raise GraphError(
            f"line {node.start_mark.line + 1}: YAML aliases (*name) are not read here, write the value out"
        )
    seen.add(id(node))
    lines[path] = node.start_mark.line + 1
    if isinstance(node, yaml.SequenceNode):
        return [_value(item, (*path, i), lines, seen, twice) for i, item in enumerate(node.value)]
    if isinstance(node, yaml.MappingNode):
        found: dict[str, Any] = {}
        for key_node, value_node in node.value:
            key = _scalar(key_node)
            if key in found:
                twice.append(GraphError(f"line {key_node.start_mark.line + 1}: key {shown(key)} stands twice"))
                continue
            found[key] = _value(value_node, (*path, key), lines, seen, twice)
            lines[(*path, key)] = key_node.start_mark.line + 1
        return found
    return _scalar(node)


def _scalar(node: yaml.Node) -> Any:
    text, line = node.value, node.start_mark.line + 1
    if not isinstance(node, yaml.ScalarNode):
        raise GraphError(f"line {line}: a key that is a list or a mapping, allowed: text")
    kind = node.tag.removeprefix("tag:yaml.org,2002:")
    try:
        match kind:
            case "str":
                return text
            case "null":
                return None
            case "bool":
                return {"true": True, "false": False}[text.lower()]
            case "int":
                return int(text)
            case "float":
                return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))
    except (KeyError, ValueError):
        raise GraphError(f"line {line}: {shown(text)} is no {kind}") from None
    raise GraphError(f"line {line}: YAML tag {node.tag!r} is not read here, allowed: plain values")


def flow(value: Any) -> str:
    """`value` on one line of YAML."""
    text = yaml.dump(value, Dumper=Dumper, default_flow_style=True, width=10**9, sort_keys=False, allow_unicode=True)
    return text.removesuffix("\n").removesuffix("\n...").strip()
