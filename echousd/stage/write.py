"""Author a scene graph in bulk: Sdf specs within one change block, no stage needed."""

from typing import Any

from pxr import Sdf

from echomodel.openings import Opening
from echousd.graph import Node, Relation, SceneGraph
from echousd.stage import encoding as usd
from echousd.stage.pen import UNIFORM, apply_apis, relate

LAYER_DOC = """Scene graph of a room: what it holds and how its objects relate.
Directions are the room's: front is +X, behind -X, left -Z, right +Z, up +Y. Lengths are metres, angles radians.
To take a relation out, say `active = false` on its prim in a stronger layer."""


def graph_layer(graph: SceneGraph, *, root: str = "/Room", identifier: str = ".usda") -> Sdf.Layer:
    """A new anonymous layer that holds `graph` at the prim path `root` and nothing else.

    Authors: `root` (Xform, kind assembly, defaultPrim), `SceneGraph` (EchoSceneGraph) with one EchoRelation per
    relation and, below `Openings`, one EchoOpening per opening, `Objects` (Xform, kind group) with one Xform +
    EchoNodeAPI + SemanticsLabelsAPI:category per node, upAxis Y, metersPerUnit 1. `identifier` is the anonymous
    layer's tag; its extension chooses usda or usdc.
    """
    layer = Sdf.Layer.CreateAnonymous(identifier)
    layer.documentation = LAYER_DOC
    author(layer, graph, Sdf.Path(root))
    return layer


def prim_path(root: str | Sdf.Path) -> Sdf.Path:
    """`root` as an absolute prim path; raises StageError."""
    text = str(root)
    valid = Sdf.Path.IsValidPathString(text)
    if not valid or not Sdf.Path(text).IsPrimPath() or not Sdf.Path(text).IsAbsolutePath():
        raise usd.StageError(f"room {text!r} is no prim path, allowed: an absolute path of identifiers such as /Room")
    return Sdf.Path(text)


def author(layer: Sdf.Layer, graph: SceneGraph, room: Sdf.Path) -> None:
    """Author all specs of `graph` below the spec path `room` (in a variant, too); what is there already stays."""
    scene_path = room.StripAllVariantSelections()
    objects_path = scene_path.AppendChild(usd.OBJECTS_NAME)
    with Sdf.ChangeBlock():
        room_spec = define(layer, room, "Xform")
        if not room_spec.kind:
            room_spec.kind = "assembly"
        if room.IsRootPrimPath() and not layer.defaultPrim:
            layer.defaultPrim = room.name
        root = layer.pseudoRoot
        for key, value in (("metersPerUnit", 1.0), ("upAxis", "Y")):
            if room.IsRootPrimPath() and not root.HasInfo(key):
                root.SetInfo(key, value)
        graph_spec = define(layer, room.AppendChild(usd.GRAPH_NAME), usd.GRAPH_TYPE)
        relate(graph_spec, usd.ROOM, scene_path)
        for name, value in usd.room_values(graph.room).items():
            put(graph_spec, name, value)
        if graph.room.openings:
            scope = define(layer, graph_spec.path.AppendChild(usd.OPENINGS_NAME), "Scope")
            for opening in graph.room.openings:
                author_opening(scope, opening)
        taken: set[str] = set()
        ends = {name: objects_path.AppendChild(name) for r in graph.relations for name in (r.subject, r.object)}
        for relation in graph.relations:
            name = usd.relation_name(*relation.triple, taken)
            taken.add(name)
            author_relation(graph_spec, name, relation, ends[relation.subject], ends[relation.object])
        objects = define(layer, room.AppendChild(usd.OBJECTS_NAME), "Xform")
        if not objects.kind:
            objects.kind = "group"
        for node in graph.nodes:
            author_node(objects, node)


def author_opening(parent: Sdf.PrimSpec, opening: Opening) -> Sdf.PrimSpec:
    """One EchoOpening prim below `parent`, called like the opening."""
    spec = define(parent.layer, parent.path.AppendChild(opening.name), usd.OPENING_TYPE)
    for name, value in usd.opening_values(opening).items():
        put(spec, name, value)
    return spec


def author_relation(
    parent: Sdf.PrimSpec, name: str, relation: Relation, subject: Sdf.Path, object_: Sdf.Path
) -> Sdf.PrimSpec:
    """One EchoRelation prim called `name` below `parent`."""
    spec = Sdf.PrimSpec(parent, name, Sdf.SpecifierDef, usd.RELATION_TYPE)
    relate(spec, usd.SUBJECT, subject)
    relate(spec, usd.OBJECT, object_)
    put(spec, usd.PREDICATE, relation.predicate)
    if relation.confidence != 1.0:
        put(spec, usd.CONFIDENCE, float(relation.confidence))
    return spec


def author_node(parent: Sdf.PrimSpec, node: Node) -> Sdf.PrimSpec:
    """One Xform with EchoNodeAPI and SemanticsLabelsAPI:category below `parent`, called like the node."""
    spec = define(parent.layer, parent.path.AppendChild(node.name), "Xform")
    apply_apis(spec, *usd.NODE_APIS)
    for name, value in usd.node_values(node).items():
        put(spec, name, value)
    if node.title is not None:
        spec.SetInfo("displayName", node.title)
    if node.between is not None:
        relate(spec, usd.BETWEEN, *(parent.path.StripAllVariantSelections().AppendChild(name) for name in node.between))
    return spec


def define(layer: Sdf.Layer, path: Sdf.Path, type_name: str) -> Sdf.PrimSpec:
    """The prim spec at `path`, made a `def` of `type_name` unless it has a type of its own."""
    spec = layer.GetPrimAtPath(path) or Sdf.CreatePrimInLayer(layer, path)
    spec.specifier = Sdf.SpecifierDef
    if not spec.typeName:
        spec.typeName = type_name
    return spec


def put(spec: Sdf.PrimSpec, name: str, value: Any) -> None:
    """Author the default value of one property of the encoding."""
    attribute = spec.properties.get(name)
    if attribute is None:
        custom = name.startswith(usd.FREE)
        varying = Sdf.VariabilityVarying if name == usd.LABELS else UNIFORM
        attribute = Sdf.AttributeSpec(spec, name, usd.value_type(name, value), varying, custom)
    attribute.default = value
