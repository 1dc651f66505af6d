"""How a scene graph is written in USD: type names, properties and the values they hold. The one place that knows."""

from collections.abc import Container, Mapping
from typing import Any

from pxr import Sdf, Vt

from echomodel.openings import Opening
from echousd.graph import Node, RoomSpec
from echousd.naming import free_name

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
VOCABULARY = "echo:vocabulary"
VOCABULARY_NAME = "echo-1"
ROOM_TYPE = "echo:roomType"
ROOM_STYLE = "echo:roomStyle"
RESIDENT = "echo:roomResident"
FLOOR_POLYGON = "echo:floorPolygon"
FLOOR_SIZE = "echo:floorSize"
HEIGHT = "echo:height"
WALLS = "echo:wallThickness"
ROOM_FIELDS = {
    ROOM_TYPE: "type", FLOOR_POLYGON: "floor_polygon", FLOOR_SIZE: "size", HEIGHT: "height", WALLS: "walls",
    ROOM_STYLE: "style", RESIDENT: "resident",
}  # fmt: skip

AREA, RATIO, OUTLINE, ENTRANCE = "echo:area", "echo:ratio", "echo:outline", "echo:entrance"  # of homes
HOME_FIELDS, HOME_ROOM_FIELDS = {AREA: "area", OUTLINE: "outline"}, {AREA: "area", RATIO: "ratio"}

KIND = "echo:kind"
EDGE = "echo:edge"
OFFSET = "echo:offset"
WIDTH = "echo:width"
SILL = "echo:sill"
HINGE = "echo:hinge"
SWING = "echo:swing"
WALL, FRAME, LEAF = "echo:wall", "echo:frame", "echo:leaf"  # what an opening became in the room
OPENING_FIELDS = {name: name.removeprefix("echo:") for name in (KIND, EDGE, OFFSET, WIDTH, HEIGHT, SILL, HINGE, SWING)}

SUBJECT = "echo:subject"
PREDICATE = "echo:predicate"
OBJECT = "echo:object"
CONFIDENCE = "echo:confidence"

CATEGORY = "echo:category"
STYLE = "echo:style"
SIZE = "echo:size"
POSITION = "echo:position"
YAW = "echo:yaw"
PLACE = "echo:place"
BETWEEN = "echo:between"
LOCKED = "echo:locked"
SHAPES = "echo:shapes"
ASSET = "echo:asset"
NODE_FIELDS = {
    name: name.removeprefix("echo:") for name in (CATEGORY, STYLE, SIZE, POSITION, YAW, PLACE, LOCKED, SHAPES, ASSET)
}
DRESSING = "dressing"  # the shapes of small things, which are no furniture
FREE = "echo:attributes:"  # namespace of a node's free attributes

_TYPES = Sdf.ValueTypeNames
_NAMES = (
    (
        _TYPES.Token,
        (VOCABULARY, ROOM_TYPE, ROOM_STYLE, RESIDENT, KIND, HINGE, SWING, PREDICATE, CATEGORY, STYLE, PLACE, SHAPES),
    ),
    (_TYPES.Double2Array, (FLOOR_POLYGON, OUTLINE)),
    (_TYPES.Double2, (FLOOR_SIZE,)),
    (_TYPES.Double, (HEIGHT, AREA, RATIO, OFFSET, WIDTH, SILL, CONFIDENCE, YAW)),
    (_TYPES.DoubleArray, (WALLS,)),
    (_TYPES.Int, (EDGE,)),
    (_TYPES.Double3, (SIZE, POSITION)),
    (_TYPES.Bool, (LOCKED,)),
    (_TYPES.String, (ASSET,)),
    (_TYPES.TokenArray, (LABELS,)),
)
VALUE_TYPES = {name: kind for kind, names in _NAMES for name in names}


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
    if isinstance(value, bool):
        return _TYPES.Bool
    if isinstance(value, int):
        return _TYPES.Int64
    return _TYPES.Double if isinstance(value, float) else _TYPES.String


def plain(value: Any) -> Any:
    """USD's vectors and arrays as tuples, anything else as it is."""
    if isinstance(value, str) or not hasattr(value, "__len__"):
        return value
    return tuple(plain(item) for item in value)


def relation_name(subject: str, predicate: str, object_: str, taken: Container[str] = ()) -> str:
    """The prim name of a relation; numbered where names with double underscores make two relations meet."""
    return free_name(f"{subject}__{predicate}__{object_}", taken)
