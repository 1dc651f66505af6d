"""Graphs written to any stage, changed where they stand (only the prims that differ), and layers to files.

A change puts all questions to the composed stage first, then makes all edits as Sdf specs in the edit target's layer.
"""

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from pxr import Sdf, Tf, Usd

from echomodel.files import whole_file
from echomodel.openings import Opening
from echousd.graph import Node, Relation, SceneGraph
from echousd.naming import LAYER_FORMS
from echousd.stage import encoding as usd
from echousd.stage import write
from echousd.stage.encoding import StageError
from echousd.stage.files import layer_there, usd_error
from echousd.stage.pen import apply_apis, relate
from echousd.stage.read import RoomPrims, find_rooms, node_names, place, read_node, relation_of, stated, the_room, value
from echousd.stage.values import targets

Edit = Callable[[], Any]
_OWN_INFO = {"specifier", "typeName", "apiSchemas", "active", "displayName"}


def write_graph(graph: SceneGraph, target: Sdf.Layer | Usd.Stage | str | os.PathLike[str], room: str = "/Room") -> None:
    """Author `graph` at the prim path `room` of a layer, of a stage's edit target (a variant's, too) or of a new file.

    Where `room` holds a graph already it is changed into `graph`, and only where the two differ (`update_graph`); a
    file at a path is replaced. Raises StageError for a room that is no absolute prim path and for a path that cannot be
    written or is of a layer over others, such as a room's root, nothing authored.
    """
    path = write.prim_path(room)
    if isinstance(target, str | os.PathLike):
        if (there := layer_there(Path(target))) and there.subLayerPaths:
            allowed = "another file, the layer itself, opened, or of a room an edit"
            raise StageError(f"{target}: has sublayers, which a new file would lose; allowed: {allowed}")
        save_layer(write.graph_layer(graph, root=room), target)
        return
    stage = target if isinstance(target, Usd.Stage) else Usd.Stage.Open(target)
    if target.GetPrimAtPath(path) and any(prims.room.GetPath() == path for prims in find_rooms(stage)):
        update_graph(target, graph, room=room)
    elif isinstance(target, Usd.Stage):
        edit_target = target.GetEditTarget()
        write.author(edit_target.GetLayer(), graph, edit_target.MapToSpecPath(path))
    else:
        write.author(target, graph, path)


def save_layer(layer: Sdf.Layer, path: str | os.PathLike[str]) -> None:
    """Write a layer to `path` (.usd, .usda or .usdc) by a temporary file beside it and a rename.

    A layer of this process that was loaded from `path` is reloaded. Raises StageError, `path` left as it was.
    """
    path = Path(path)
    if path.suffix not in LAYER_FORMS:
        raise StageError(f"{path}: extension {path.suffix!r}, allowed: {', '.join(LAYER_FORMS)}")
    if not path.parent.is_dir():
        raise StageError(f"{path}: the folder {path.parent} does not exist")
    try:
        with whole_file(path, path.suffix) as beside:
            if not layer.Export(str(beside)):
                raise StageError(f"{path}: cannot be written")
    except (OSError, Tf.ErrorException) as error:
        why = usd_error(error) if isinstance(error, Tf.ErrorException) else error.strerror
        raise StageError(f"{path}: cannot be written ({why})") from None
    loaded = Sdf.Layer.Find(str(path.absolute()))
    if loaded:  # a stage of this process has the file open: let it follow
        loaded.Reload(force=True)


def update_graph(target: Usd.Stage | Sdf.Layer, graph: SceneGraph, room: str | None = None) -> None:
    """Make the graph of a room equal to `graph`, by edits in the stage's edit target (or in the layer).

    Nodes and relations that are equal already are not touched. What goes is deleted if the layer alone holds it and
    nothing but the graph's own properties is on the prim, and deactivated otherwise; what was deactivated comes back.
    Raises StageError, nothing edited, if the room is not found, is an instance's, or is out of the edit target's reach.
    """
    stage = target if isinstance(target, Usd.Stage) else Usd.Stage.Open(target)
    prims = the_room(stage, room)
    editor = _Editor(stage, prims)
    edits = editor.value_edits(prims.graph, usd.room_values(graph.room), tuple(usd.ROOM_FIELDS))
    edits += [*editor.opening_edits(graph), *editor.node_edits(graph), *editor.relation_edits(graph)]
    with Sdf.ChangeBlock():
        for edit in edits:
            edit()
    editor.order(graph)


class _Editor:
    """The edits that lead from the graph of one room to another one, as functions to be called together."""

    def __init__(self, stage: Usd.Stage, prims: RoomPrims) -> None:
        if prims.graph.IsInstanceProxy():
            raise StageError(f"{place(prims.graph)}: the room is an instance, allowed: rooms with instanceable = false")
        self.stage, self.prims = stage, prims
        self.target = stage.GetEditTarget()
        self.layer = self.target.GetLayer()
        self.names = node_names(prims)
        self.nodes = {self.names[prim.GetPath()]: prim for prim in prims.nodes}
        self.paths = {name: path for path, name in self.names.items()}
        self.objects = prims.room.GetPath().AppendChild(usd.OBJECTS_NAME)
        if prims.nodes and not stage.GetPrimAtPath(self.objects):
            self.objects = prims.nodes[0].GetPath().GetParentPath()
        self.spec_path(prims.graph.GetPath())

    def spec_path(self, path: Sdf.Path) -> Sdf.Path:
        mapped = self.target.MapToSpecPath(path)
        if mapped.isEmpty:
            raise StageError(f"<{path}> is out of reach of the edit target {self.layer.identifier}")
        return mapped

    def spec(self, path: Sdf.Path) -> Sdf.PrimSpec:
        """The prim spec in the edit target's layer, an `over` where there was none."""
        return Sdf.CreatePrimInLayer(self.layer, self.spec_path(path))

    # -- the room and its nodes ----------------------------------------------------------------------------------------

    def opening_edits(self, graph: SceneGraph) -> list[Edit]:
        wanted = {opening.name: opening for opening in graph.room.openings}
        held = {prim.GetName(): prim for prim in self.prims.openings}
        edits: list[Edit] = [self.removal(prim) for name, prim in held.items() if name not in wanted]
        for name, opening in wanted.items():
            values = usd.opening_values(opening)
            path = self.prims.graph.GetPath().AppendChild(usd.OPENINGS_NAME).AppendChild(name)
            prim = held.get(name) or self.stage.GetPrimAtPath(path)
            if prim:
                edits += [*self.value_edits(prim, values, tuple(usd.OPENING_FIELDS)), *self.activation(prim)]
            else:
                edits.append(partial(self.new_opening, path, opening))
        return edits

    def new_opening(self, path: Sdf.Path, opening: Opening) -> None:
        write.author_opening(write.define(self.layer, self.spec_path(path.GetParentPath()), "Scope"), opening)

    def node_edits(self, graph: SceneGraph) -> list[Edit]:
        wanted = {node.name: node for node in graph.nodes}
        edits: list[Edit] = []
        for name, prim in self.nodes.items():
            if name not in wanted:
                edits.append(self.removal(prim))
            elif (old := read_node(prim, name, self.names)) != wanted[name]:
                edits += self.changed_node(prim, old, wanted[name])
        for name, node in wanted.items():
            if name not in self.nodes:
                edits += self.new_node(node)
        return edits

    def changed_node(self, prim: Usd.Prim, old: Node | None, new: Node) -> list[Edit]:
        values = usd.node_values(new)
        if old is not None and old.category == new.category:
            del values[usd.CATEGORY]
            if old.obstacle == new.obstacle:
                del values[usd.LABELS]
        free = [a.GetName() for a in prim.GetAuthoredPropertiesInNamespace(usd.FREE[:-1])]
        edits = self.value_edits(prim, values, (*[name for name in usd.NODE_FIELDS if name != usd.CATEGORY], *free))
        path, was = prim.GetPath(), Node(new.name, new.category) if old is None else old
        if was.title != new.title:
            edits.append(lambda: self.spec(path).SetInfo("displayName", new.title or ""))
        if was.between != new.between:
            edits.append(
                lambda: relate(self.spec(path), usd.BETWEEN, *(self.paths[name] for name in new.between or ()))
            )
        return edits

    def new_node(self, node: Node) -> list[Edit]:
        path = self.paths[node.name] = self.objects.AppendChild(node.name)
        prim = self.stage.GetPrimAtPath(path)
        if not prim:
            return [lambda: self.author(node)]
        edits = [lambda: apply_apis(self.spec(path), *usd.NODE_APIS), *self.changed_node(prim, None, node)]
        if not prim.IsDefined() or not prim.GetTypeName():
            edits.append(lambda: write.define(self.layer, self.spec_path(path), "Xform"))
        return [*edits, *self.activation(prim)]

    def author(self, node: Node) -> None:
        spec = write.author_node(write.define(self.layer, self.spec_path(self.objects), "Xform"), node)
        if node.between:
            relate(spec, usd.BETWEEN, *(self.paths[name] for name in node.between))

    # -- relations -----------------------------------------------------------------------------------------------------

    def relation_edits(self, graph: SceneGraph) -> list[Edit]:
        facts = stated(self.prims, self.names)
        held = {triple: entries[0] for triple, entries in facts.items()}
        wanted = {relation.triple: relation for relation in graph.relations}
        gone = {triple: entry for triple, entry in held.items() if triple not in wanted}
        taken = {child.GetName() for child in self.prims.graph.GetAllChildren()}
        asleep = self.sleeping_relations()
        edits: list[Edit] = []
        for triple, relation in wanted.items():
            if triple in held:
                edits += self.confidence_edits(held[triple][0], held[triple][1].confidence, relation)
                continue
            replaced = next((old for old in gone if (old[0], old[2]) == (triple[0], triple[2])), None)
            if triple in asleep:
                prim = asleep[triple]
                edits += [*self.activation(prim), *self.confidence_edits(prim, None, relation)]
            elif replaced:
                edits += self.other_predicate(*gone.pop(replaced), relation, taken)
            else:
                edits.append(self.new_relation(relation, taken))
        again = [prim for triple, entries in facts.items() if triple not in wanted for prim, _ in entries[1:]]
        return [*map(self.removal, [*(prim for prim, _ in gone.values()), *again]), *edits]

    def sleeping_relations(self) -> dict[tuple[str, str, str], Usd.Prim]:
        """Relations of which somebody has deactivated the prim or an end, by triple: they come back as they are."""
        found: dict[tuple[str, str, str], Usd.Prim] = {}
        ends = {path: name for name, path in self.paths.items()}
        for prim in self.prims.graph.GetAllChildren():
            if prim.GetTypeName() == usd.RELATION_TYPE:
                subjects, objects = (targets(prim, name) for name in (usd.SUBJECT, usd.OBJECT))
                if len(subjects) == len(objects) == 1 and subjects[0] in ends and objects[0] in ends:
                    found[ends[subjects[0]], value(prim, usd.PREDICATE), ends[objects[0]]] = prim
        return found

    def confidence_edits(self, prim: Usd.Prim, old: float | None, relation: Relation) -> list[Edit]:
        if old == relation.confidence:
            return []
        values = {} if relation.confidence == 1.0 else {usd.CONFIDENCE: float(relation.confidence)}
        return self.value_edits(prim, values, (usd.CONFIDENCE,))

    def other_predicate(self, prim: Usd.Prim, old: Relation, new: Relation, taken: set[str]) -> list[Edit]:
        edits = self.value_edits(prim, {usd.PREDICATE: new.predicate}, (usd.PREDICATE,))
        edits += self.confidence_edits(prim, old.confidence, new)
        if self.only_here(prim) and prim.GetName() == usd.relation_name(*old.triple):
            name = usd.relation_name(*new.triple, taken)
            taken.add(name)
            path = prim.GetPath()
            edits.append(lambda: setattr(self.spec(path), "name", name))
        return edits

    def new_relation(self, relation: Relation, taken: set[str]) -> Edit:
        name = usd.relation_name(*relation.triple, taken)
        taken.add(name)
        subject, object_ = self.paths[relation.subject], self.paths[relation.object]
        parent = self.prims.graph.GetPath()
        return lambda: write.author_relation(self.spec(parent), name, relation, subject, object_)

    # -- one prim ------------------------------------------------------------------------------------------------------

    def value_edits(self, prim: Usd.Prim, values: dict[str, Any], names: tuple[str, ...]) -> list[Edit]:
        """Edits after which the attributes `names` of a prim hold `values`, those that are not in `values` nothing."""
        path = prim.GetPath()
        edits: list[Edit] = [
            partial(self.put, path, name, new) for name, new in values.items() if value(prim, name) != usd.plain(new)
        ]
        for name in names:
            attribute = prim.GetAttribute(name)
            if name not in values and attribute and attribute.HasAuthoredValue():
                edits.append(partial(self.clear, attribute))
        return edits

    def put(self, path: Sdf.Path, name: str, new: Any) -> None:
        write.put(self.spec(path), name, new)

    def clear(self, attribute: Usd.Attribute) -> None:
        """Take an attribute's value away: its spec where this layer alone holds it, else by a block over the others."""
        prim_path, name = attribute.GetPrim().GetPath(), attribute.GetName()
        own = self.layer.GetAttributeAtPath(self.spec_path(attribute.GetPath()))
        others = [spec for spec in attribute.GetPropertyStack() if spec != own and spec.HasInfo("default")]
        if own and not others:
            owner = self.layer.GetPrimAtPath(self.spec_path(prim_path))
            owner.RemoveProperty(own)
        else:
            spec = self.spec(prim_path)
            own = own or Sdf.AttributeSpec(spec, name, attribute.GetTypeName(), Sdf.VariabilityUniform)
            own.default = Sdf.ValueBlock()

    def removal(self, prim: Usd.Prim) -> Edit:
        path = self.spec_path(prim.GetPath())
        if self.only_here(prim) and _holds_nothing_foreign(self.layer.GetPrimAtPath(path)):
            return lambda: self.layer.GetPrimAtPath(path.GetParentPath()).nameChildren.__delitem__(path.name)
        return lambda: setattr(Sdf.CreatePrimInLayer(self.layer, path), "active", False)

    def activation(self, prim: Usd.Prim) -> list[Edit]:
        if prim.IsActive():
            return []
        path = self.spec_path(prim.GetPath())
        own = self.layer.GetPrimAtPath(path)
        others = [spec for spec in prim.GetPrimStack() if spec != own and spec.HasInfo("active")]
        if own and not others:
            return [own.ClearActive]
        return [lambda: setattr(Sdf.CreatePrimInLayer(self.layer, path), "active", True)]

    def only_here(self, prim: Usd.Prim) -> bool:
        """Whether the edit target's layer holds the only opinions about a prim."""
        stack = prim.GetPrimStack()
        return len(stack) == 1 and stack[0] == self.layer.GetPrimAtPath(self.spec_path(prim.GetPath()))

    def order(self, graph: SceneGraph) -> None:
        """Bring nodes and relations in the graph's order, where they are not, by `reorder nameChildren`."""
        prims = next(prims for prims in find_rooms(self.stage) if prims.room == self.prims.room)
        names = node_names(prims)
        called = {name: path.name for path, name in names.items()}
        related: dict[tuple[str, str, str], Usd.Prim] = {}
        for prim in prims.relations:
            relation = relation_of(prim, names)
            if relation:
                related.setdefault(relation.triple, prim)
        wanted = (
            (prims.nodes, prims.nodes, [called[name] for name in graph.names]),
            ([*related.values()], prims.relations, [related[r.triple].GetName() for r in graph.relations]),
            (prims.openings, prims.openings, [opening.name for opening in graph.room.openings]),
        )
        for have, siblings, want in wanted:
            parents = {prim.GetParent().GetPath() for prim in siblings}
            if [prim.GetName() for prim in have] != want and len(parents) == 1:
                self.spec(parents.pop()).nameChildrenOrder = want


def _holds_nothing_foreign(spec: Sdf.PrimSpec) -> bool:
    """Whether a prim spec holds what this project authors for a node or a relation and nothing else."""
    own = {*usd.VALUE_TYPES, usd.SUBJECT, usd.OBJECT, usd.BETWEEN}
    return (
        not spec.nameChildren
        and set(spec.ListInfoKeys()) <= _OWN_INFO
        and {*spec.GetInfo("apiSchemas").GetAddedOrExplicitItems()} <= {*usd.NODE_APIS}
        and all(name in own or name.startswith(usd.FREE) for name in spec.properties.keys())  # noqa: SIM118
    )
