"""The steps from one scene graph to another."""

from dataclasses import dataclass
from typing import Any

from echomodel.openings import Opening
from echousd.graph.nodes import Node, Relation, RoomSpec
from echousd.graph.scene import SceneGraph


@dataclass(frozen=True)
class GraphDiff:
    """The steps from one graph to another; changed things come as (before, after).

    Arguments:
        room: the room where it changed, else None.
        added, removed: nodes that only one of the graphs holds, matched by name.
        changed: nodes of one name whose fields differ.
        related, unrelated: relations that only one of the graphs holds, matched by subject, predicate and object.
        reweighted: relations whose confidence differs.
    """

    room: tuple[RoomSpec, RoomSpec] | None = None
    added: tuple[Node, ...] = ()
    removed: tuple[Node, ...] = ()
    changed: tuple[tuple[Node, Node], ...] = ()
    related: tuple[Relation, ...] = ()
    unrelated: tuple[Relation, ...] = ()
    reweighted: tuple[tuple[Relation, Relation], ...] = ()

    @classmethod
    def between(cls, before: SceneGraph, after: SceneGraph) -> "GraphDiff":
        """The steps from `before` to `after`; another order of the same nodes or relations is no step."""
        old, new = {n.name: n for n in before.nodes}, {n.name: n for n in after.nodes}
        was, will = {r.triple: r for r in before.relations}, {r.triple: r for r in after.relations}
        return cls(
            room=None if before.room == after.room else (before.room, after.room),
            added=tuple(node for node in after.nodes if node.name not in old),
            removed=tuple(node for node in before.nodes if node.name not in new),
            changed=tuple(
                (node, new[node.name]) for node in before.nodes if node.name in new and not same(node, new[node.name])
            ),
            related=tuple(relation for relation in after.relations if relation.triple not in was),
            unrelated=tuple(relation for relation in before.relations if relation.triple not in will),
            reweighted=tuple(
                (relation, will[relation.triple])
                for relation in before.relations
                if relation.triple in will and relation != will[relation.triple]
            ),
        )

    def __bool__(self) -> bool:
        return self != GraphDiff()

    @property
    def touched(self) -> frozenset[str]:
        """Names of the nodes that are new, gone or changed, or whose relations changed."""
        nodes = [*self.added, *self.removed, *(node for node, _ in self.changed)]
        relations = [*self.related, *self.unrelated, *(relation for relation, _ in self.reweighted)]
        return frozenset([n.name for n in nodes] + [end for r in relations for end in (r.subject, r.object)])

    def lines(self) -> list[str]:
        """One readable line a step: `+` new, `-` gone, `~` changed."""
        out = _room_lines(*self.room) if self.room else []
        out += [f"- object {node.name} ({node.category})" for node in self.removed]
        out += [f"+ object {node.name} ({node.category})" for node in self.added]
        out += [f"~ object {old.name}: {_fields(old, new)}" for old, new in self.changed]
        out += [f"- relation {relation}" for relation in self.unrelated]
        out += [f"+ relation {relation}" for relation in self.related]
        return out + [f"~ relation {old}: {_fields(old, new)}" for old, new in self.reweighted]


def same(one: Node, other: Node) -> bool:
    """Equal in every field, where the attributes 1, 1.0 and true are three different things."""
    kinds = [{key: type(value) for key, value in node.attributes.items()} for node in (one, other)]
    return one == other and kinds[0] == kinds[1]


def _room_lines(old: RoomSpec, new: RoomSpec) -> list[str]:
    fields = _fields(old, new, but=("openings",))
    lines = [f"~ room: {fields}"] if fields else []
    was, will = {o.name: o for o in old.openings}, {o.name: o for o in new.openings}
    lines += [f"- {sentence(o)}" for name, o in was.items() if name not in will]
    lines += [f"+ {sentence(o)}" for name, o in will.items() if name not in was]
    lines += [f"~ {sentence(was[n])} -> {sentence(o)}" for n, o in will.items() if n in was and was[n] != o]
    return lines or ["~ room: another order of the openings"]


def _fields(old: Any, new: Any, but: tuple[str, ...] = ()) -> str:
    names = [name for name in type(old).model_fields if name not in but]
    pairs = [(name, getattr(old, name), getattr(new, name)) for name in names]
    return ", ".join(f"{name} {_short(a)} -> {_short(b)}" for name, a, b in pairs if a != b or repr(a) != repr(b))


def _short(value: Any) -> str:
    return "none" if value is None else str(round(value, 4) if isinstance(value, float) else value)


def sentence(opening: Opening) -> str:
    """What an opening is, for a person: `door 'door' in wall 0 at 0.6 m, 0.9 x 2 m`."""
    text = f"{opening.kind} {opening.name!r} in wall {opening.edge} at {opening.offset:.4g} m"
    text += f", {opening.width:.4g} x {opening.height:.4g} m"
    if opening.sill:
        text += f", sill {opening.sill:.4g} m"
    if opening.kind == "door":
        text += f", hinge {opening.hinge}, swings {opening.swing}"
    return text
