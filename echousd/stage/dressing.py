"""Small things that are nodes on a stage (`echo:source` = dressing); readers of graphs pass over them, these do not."""

from __future__ import annotations

import os

from pxr import Usd

from echousd.graph import GraphError
from echousd.graph.small import DressingGraph, SmallNode
from echousd.stage import encoding as usd
from echousd.stage import values
from echousd.stage.encoding import StageError
from echousd.stage.files import opened
from echousd.stage.read import node_names, place, relation_of, the_room, value

_FIELDS = {usd.CATEGORY: "category", usd.SIZE: "size", usd.POSITION: "position", usd.YAW: "yaw", usd.PLACE: "place"}


def read_dressing(stage: Usd.Stage | str | os.PathLike[str], room: str | None = None) -> DressingGraph:
    """The small things that are nodes on a stage or in a file, and their relations; those of the layout that is shown.

    Empty where the room was made without `dress_graph`, and where its layer `dressing` is muted.

    Arguments:
        room: prim path of the room, needed where there are several.

    Raises StageError that names the prim at fault, for one with a category that no small thing has.
    """
    stage = opened(stage)
    with values.reading(stage):
        prims = the_room(stage, room)
        names = node_names(prims, small=True)
        nodes = tuple(read_small(prim) for prim in prims.small)
        found = (relation_of(prim, names) for prim in prims.small_relations)
        return DressingGraph(nodes, tuple(relation for relation in found if relation))


def read_small(prim: Usd.Prim) -> SmallNode:
    """The small thing that a prim states; raises StageError."""
    fields = {field: value(prim, name) for name, field in _FIELDS.items()}
    if fields["category"] is None:
        raise StageError(f"{place(prim)}: no category, allowed: {usd.CATEGORY}, one of those of small things")
    try:
        return SmallNode(name=prim.GetName(), **fields)
    except GraphError as error:
        raise StageError(f"{place(prim)}: {error}") from None
