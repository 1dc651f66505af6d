"""What a scene graph consists of: the room, its nodes, its relations, each frozen and checked when it is made."""

from __future__ import annotations

import re
from dataclasses import dataclass
from inspect import Parameter, Signature, signature
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from pydantic import BaseModel, Field, ValidationError, model_validator

from echomodel.openings import check_openings, rectangle
from echousd.graph import fields as field
from echousd.graph.consistency import GraphError
from echousd.graph.values import Point, shown

if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass
else:
    ModelMetaclass = type(BaseModel)

HEIGHT = 2.8  # metres of a room where nobody says
OBSTACLE = "obstacle"  # attribute of what stands in the way and is no furniture that we know


class _Plain(ModelMetaclass):
    """The class of our models: `dir` and `help` show their own names, not the hundred that pydantic brings along."""

    def __dir__(cls) -> list[str]:
        own = (vars(kind) for kind in cls.__mro__ if isinstance(kind, _Plain))
        return sorted({name for names in own for name in names if not name.startswith("_")} - {"model_config"})


class PlainModel(BaseModel, metaclass=_Plain, frozen=True, extra="forbid"):
    """Frozen, without unknown fields, and with errors of one line."""

    def __init__(self, **fields: Any) -> None:
        fault = None
        try:
            super().__init__(**fields)
        except ValidationError as error:
            fault = self._explained(fields, error)
        if fault is not None:  # raised above, the two would hold each other, which pydantic's has no way to tell
            raise fault

    @classmethod
    def _explained(cls, fields: dict[str, Any], error: ValidationError) -> ValueError:
        first = error.errors(include_url=False)[0]
        cause = first["ctx"]["error"] if first["type"] == "value_error" else None
        found = f"found {first['input']!r:.100}, allowed: "
        message = re.sub("^Input should be ", found, first["msg"]) if cause is None else str(cause)
        where = ".".join(str(part) for part in first["loc"])
        if first["type"] == "extra_forbidden":
            message = f"unknown field, allowed: {', '.join(cls.model_fields)}"
        about = (*first["loc"], *getattr(cause, "about", ()))
        fault = GraphError(f"{cls._title(fields)}{where + ': ' if where else ''}{message}", about)
        fault.others = getattr(cause, "others", ())
        return fault

    @classmethod
    def _title(cls, fields: dict[str, Any]) -> str:
        return ""

    def __dir__(self) -> list[str]:
        return sorted({*dir(type(self)), *type(self).model_fields})

    def replaced(self, **fields: Any) -> Self:
        """A copy with other values in `fields`, validated."""
        return type(self)(**{**{name: getattr(self, name) for name in type(self).model_fields}, **fields})

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        whole = signature(cls)  # whose annotations are a page of validators
        plain = [one.replace(annotation=Parameter.empty) for one in whole.parameters.values()]
        cls.__signature__ = whole.replace(parameters=plain, return_annotation=Signature.empty)


class RoomSpec(PlainModel):
    """The room: its type, and where known its floor (corners around it, or the extents of its bounding box) and height.

    Arguments:
        type: room type or an alias of one.
        floor_polygon: at least three corners (x, z), metres.
        size: (x, z) extents of the floor, metres; with a polygon, those of its bounding box.
        height: metres.
        openings: doors, windows and passages in the walls; wall i is the edge from corner i of the floor to the next,
            of a rectangle the one at -z, +x, +z and -x.
        walls: thickness of each wall, metres; of a room of a home, whose openings are all stated.
        style: word of a style, such as industrial, to which furniture, colours, walls, doors and windows keep.
        resident: who lives there, which small things tell; None = as the furniture suggests.
    """

    type: field.RoomTypeWord
    floor_polygon: field.Corners = None
    size: field.Extents = None
    height: field.Height = None
    openings: field.Openings = ()
    walls: field.Thicknesses = ()
    style: field.RoomStyleWord = None
    resident: field.Resident = None

    def __init__(self, type: str, **fields: Any) -> None:
        super().__init__(type=type, **fields)

    @property
    def tall(self) -> float:
        """Its height in metres, which is 2.8 where nobody says."""
        return self.height or HEIGHT

    @classmethod
    def _title(cls, fields: dict[str, Any]) -> str:
        return "room: "

    @model_validator(mode="after")
    def _agrees(self) -> RoomSpec:
        if self.floor_polygon and self.size:
            found = field.bounding_extents(self.floor_polygon)
            if max(abs(a - b) for a, b in zip(found, self.size, strict=True)) > 1e-3:
                raise ValueError(f"size is {self.size} but floor_polygon spans {found}; leave one of them out")
        if self.walls and (self.corners is None or len(self.walls) != len(self.corners)):
            edges = 0 if self.corners is None else len(self.corners)
            raise GraphError(f"{len(self.walls)} thicknesses of {edges} walls, allowed: one each", ("walls",))
        for position in range(len(self.openings)):
            try:
                check_openings(self.openings[: position + 1], self.corners, self.height)
            except ValueError as error:
                raise GraphError(str(error), ("openings", position)) from None
        return self

    @property
    def extents(self) -> Point | None:
        """(x, z) extents of the floor's bounding box in metres, None where nothing is known."""
        return field.bounding_extents(self.floor_polygon) if self.floor_polygon else self.size

    @property
    def corners(self) -> np.ndarray | None:
        """(k, 2) float, the floor's corners (x, z) in metres, None where nothing is known."""
        if self.floor_polygon:
            return np.asarray(self.floor_polygon, float)
        return rectangle(*self.size) if self.size else None


@dataclass(frozen=True)
class Placed:
    """A placement of one object, such as lamp in corner, or table between sofa and armchair.

    Arguments:
        subject: name of the node. placement: name of its row in the vocabulary. others: names of the nodes it names.
    """

    subject: str
    placement: str
    others: tuple[str, ...] = ()

    @property
    def triple(self) -> tuple[str, str, str]:
        """(subject, placement, the others as text), as relations have it."""
        return self.subject, self.placement, " and ".join(self.others)

    def __str__(self) -> str:
        return " ".join(filter(None, self.triple))


class Node(PlainModel):
    """An object of the room.

    Arguments:
        name: valid USD identifier, unique in the graph.
        category: category or an alias of one.
        title: what people call it, in any script; None = as its name.
        style: objects with the same style group belong together.
        size: (x, y, z) extents in the object frame, metres, where fixed.
        position: (x, y, z) centre of the bottom face in the room frame, metres, where fixed.
        yaw: radians about +Y, where fixed (a text may be in degrees, such as `90 deg`); at 0 the front looks along +Z.
        place: where it stands in the room, against_wall or in_corner.
        between: names of two other objects that it stands between.
        locked: the object stays as it is when the room is generated again.
        shapes: where its geometry comes from, one of `echousd.graph.fields.SHAPES`; None = as the room's.
        asset: a model of one's own (a file, relative to that of the graph) or the id of one in a library.
        attributes: free data, identifiers to texts, numbers or booleans.
    """

    name: field.Name
    category: field.CategoryWord
    title: field.Title = None
    style: field.Style = None
    size: field.Size = None
    position: field.Position = None
    yaw: field.Angle = None
    place: field.Place = None
    between: field.Two = None
    locked: field.Flag = False
    shapes: field.Shapes = None
    asset: field.AssetName = None
    attributes: field.Attributes = Field(default_factory=dict)

    def __init__(self, name: str, category: str, **fields: Any) -> None:
        super().__init__(name=name, category=category, **fields)

    @model_validator(mode="after")
    def _has_shapes(self) -> Node:
        if self.name in (self.between or ()):
            raise GraphError("between names the object itself, allowed: two others", ("between",))
        if self.asset is None and self.shapes == "own":
            raise GraphError("shapes is 'own' without an asset, allowed: asset, the file of the model", ("shapes",))
        if self.asset is not None and self.shapes not in (None, "own", "library"):
            raise GraphError(f"asset is given, but shapes is {self.shapes!r}, allowed: own or library", ("shapes",))
        return self

    @property
    def obstacle(self) -> str:
        """What it is in its own stage's words, where the vocabulary has none for it; "" for furniture."""
        word = self.attributes.get(OBSTACLE)
        return word if isinstance(word, str) else ""

    @property
    def placements(self) -> tuple[Placed, ...]:
        """What is said of its place in the room."""
        alone = [] if self.place is None else [Placed(self.name, self.place)]
        return (*alone, *([] if self.between is None else [Placed(self.name, "between", self.between)]))

    @classmethod
    def _title(cls, fields: dict[str, Any]) -> str:
        return f"object {shown(fields['name'])}: "


class Relation(PlainModel):
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
        sentence = " ".join(str(fields[part]) for part in ("subject", "predicate", "object"))
        return f"relation {shown(sentence)}: "

    @property
    def triple(self) -> tuple[str, str, str]:
        """(subject, predicate, object)."""
        return self.subject, self.predicate, self.object

    def __str__(self) -> str:
        return " ".join(self.triple)
