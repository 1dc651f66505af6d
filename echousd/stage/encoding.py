"""How a scene graph is written in USD: type names, properties and the values they hold. The one place that knows."""

from collections.abc import Container, Mapping
from typing import Any

from pxr import Sdf, Vt

from echomodel.openings import Opening
from echousd.graph import Node, RoomSpec
from echousd.naming import free_name
from echousd.plugin import plugin_path

GRAPH_TYPE = "EchoSceneGraph"
RELATION_TYPE = "EchoRelation"
OPENING_TYPE = "EchoOpening"
HOME_TYPE = "EchoHomeGraph"
TYPES = (GRAPH_TYPE, RELATION_TYPE, OPENING_TYPE, HOME_TYPE)
ROOM_API = "EchoRoomAPI"
NODE_API = "EchoNodeAPI"
LABELS_API = "SemanticsLabelsAPI:category"
NODE_APIS = (NODE_API, LABELS_API)
LABELS = "semantics:labels:category"

GRAPH_NAME = "SceneGraph"
OBJECTS_NAME = "Objects"
OPENINGS_NAME = "Openings"

ROOM = "echo:room"
VOCABULARY, VOCABULARY_NAME = "echo:vocabulary", "echo-1"
FLOOR_POLYGON, FLOOR_SIZE = "echo:floorPolygon", "echo:floorSize"
ROOM_FIELDS = {
    "echo:roomType": "type", FLOOR_POLYGON: "floor_polygon", FLOOR_SIZE: "size", "echo:height": "height",
    "echo:wallThickness": "walls", "echo:roomStyle": "style", "echo:roomResident": "resident",
}  # fmt: skip

AREA, RATIO, ENTRANCE = "echo:area", "echo:ratio", "echo:entrance"  # of homes
HOME_FIELDS, HOME_ROOM_FIELDS = {AREA: "area", "echo:outline": "outline"}, {AREA: "area", RATIO: "ratio"}

OPENING_FIELDS = {
    f"echo:{field}": field for field in ("kind", "edge", "offset", "width", "height", "sill", "hinge", "swing")
}
SILL, HINGE, SWING = "echo:sill", "echo:hinge", "echo:swing"
WALL, FRAME, LEAF = "echo:wall", "echo:frame", "echo:leaf"  # what an opening became in the room

SUBJECT = "echo:subject"
PREDICATE = "echo:predicate"
OBJECT = "echo:object"
CONFIDENCE = "echo:confidence"

CATEGORY, SIZE, YAW, SHAPES, BETWEEN = "echo:category", "echo:size", "echo:yaw", "echo:shapes", "echo:between"
NODE_FIELDS = {
    f"echo:{field}": field
    for field in ("category", "style", "size", "position", "yaw", "place", "locked", "shapes", "asset")
}
DRESSING = "dressing"  # the shapes of small things, which are no furniture
FREE = "echo:attributes:"  # namespace of a node's free attributes

_TYPES = Sdf.ValueTypeNames
_SCHEMA = Sdf.Layer.FindOrOpen(str(plugin_path() / "generatedSchema.usda"))  # which says what type each property has
VALUE_TYPES = {one.name: one.typeName for prim in _SCHEMA.rootPrims for one in prim.attributes} | {
    LABELS: _TYPES.TokenArray
}


class StageError(ValueError):
    """A stage, layer or prim does not hold what it should; one line with what was found, where and what is allowed."""


def values_of(thing: object, fields: Mapping[str, str]) -> dict[str, Any]:
    """What a thing says of some fields, by property and in USD's types; what it leaves open is left out."""
    every = {name: getattr(thing, field, None) for name, field in fields.items()}
    held = {name: value for name, value in every.items() if value is not None and value is not False and value != ()}
    kinds = {name: type(VALUE_TYPES[name].defaultValue) for name in held}
    return {name: kinds[name](value) if isinstance(value, tuple) else value for name, value in held.items()}


def room_values(room: RoomSpec) -> dict[str, Any]:
    """The authored properties of an EchoSceneGraph, in USD's types, for the `RoomSpec` `room`."""
    return {VOCABULARY: VOCABULARY_NAME, **values_of(room, ROOM_FIELDS)}


def opening_values(opening: Opening) -> dict[str, Any]:
    """The authored properties of an EchoOpening; what is at its default and says nothing of the kind is left out."""
    unsaid = {SILL: 0.0, **({} if opening.kind == "door" else {HINGE: "left", SWING: "in"})}
    return {name: value for name, value in values_of(opening, OPENING_FIELDS).items() if unsaid.get(name) != value}


def node_values(node: Node) -> dict[str, Any]:
    """The authored properties of a node's prim, in USD's types, for the `Node` `node`."""
    values: dict[str, Any] = {CATEGORY: node.category, LABELS: Vt.TokenArray([node.obstacle or node.category])}
    free = {FREE + key: value for key, value in node.attributes.items()}
    return values | values_of(node, NODE_FIELDS) | free


def value_type(name: str, value: Any) -> Sdf.ValueTypeName:
    """The type that the property `name` is authored with; free attributes are bool, int64, double or string."""
    known = VALUE_TYPES.get(name)
    if known is not None:
        return known
    kinds = ((bool, _TYPES.Bool), (int, _TYPES.Int64), (float, _TYPES.Double))  # a bool is an int, too
    return next((kind for python, kind in kinds if isinstance(value, python)), _TYPES.String)


def plain(value: Any) -> Any:
    """USD's vectors and arrays as tuples, anything else as it is."""
    if isinstance(value, str) or not hasattr(value, "__len__"):
        return value
    return tuple(plain(item) for item in value)


def relation_name(subject: str, predicate: str, object_: str, taken: Container[str] = ()) -> str:
    """The prim name of a relation; numbered where names with double underscores make two relations meet."""
    return free_name(f"{subject}__{predicate}__{object_}", taken)
