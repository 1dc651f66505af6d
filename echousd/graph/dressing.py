"""Small things as nodes of a room's scene graph (option `dress_graph`)."""

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import AfterValidator

from echomodel.dressing import SMALL
from echousd.graph import fields as field
from echousd.graph.nodes import PlainModel, Relation
from echousd.graph.values import shown


def _small_word(value: str) -> str:
    if value not in SMALL:
        raise ValueError(f"found {shown(value)}, allowed of a small thing: {', '.join(sorted(SMALL))}")
    return value


class SmallNode(PlainModel):
    """A small thing of the room's dressing, such as a book or a rug.

    Arguments:
        name: valid USD identifier, unique among all nodes of the room.
        category: a category of small things (`echomodel.dressing.SMALL`).
        size: (x, y, z) extents in its own frame, metres.
        position: (x, y, z) centre of the bottom face in the room frame, metres.
        yaw: radians about +Y; at 0 the front looks along +Z.
        place: against_wall for what hangs on a wall.
    """

    name: field.Name
    category: Annotated[str, AfterValidator(_small_word)]
    size: field.Size = None
    position: field.Position = None
    yaw: field.Angle = None
    place: field.Place = None

    @classmethod
    def _title(cls, fields: dict[str, Any]) -> str:
        return f"object {shown(fields['name'])}: "


@dataclass(frozen=True)
class DressingGraph:
    """The small things of a room as nodes.

    Arguments:
        nodes: one for every thing.
        relations: of small things to furniture, or to another small thing; a subject is in `nodes`.
    """

    nodes: tuple[SmallNode, ...] = ()
    relations: tuple[Relation, ...] = ()
