"""A room of several sources: each object's own word counts, and what a library lacks the project makes itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from echousd.shapes.geometry import Geometry
from echousd.shapes.sources import default_source, shape_source
from echousd.shapes.sources.retrieval import source_of
from echousd.shapes.sources.source import ShapeRequest, Shapes

if TYPE_CHECKING:
    from echomodel.protocols import RoomModel
    from echousd.graph import SceneGraph


def sources_of(graph: SceneGraph, shapes: str) -> dict[str, str]:
    """Object name -> name of its source.

    Arguments:
        shapes: the source of objects that say nothing.
    """
    return {node.name: source_of(node, shapes) for node in graph.nodes}


def check_sources(names: Sequence[str], model: RoomModel | None) -> None:
    """Raises ValueError where one of the sources cannot give shapes with this model."""
    for name in dict.fromkeys(names):
        shape_source(name).check(model)


def mixed_shapes(request: ShapeRequest, shapes: str) -> Shapes:
    """Geometry of all wanted objects, each from its own source; raises ValueError as the sources do."""
    named = sources_of(request.graph, shapes)
    spare = default_source(request.model)
    groups: dict[str, list[str]] = {}
    for row in request.rows:
        name = request.graph.names[row]
        source = spare if name in request.retrieved.missing else named[name]
        groups.setdefault(source, []).append(name)
    if len(groups) == 1 and request.wanted is None:
        return shape_source(next(iter(groups))).shapes(request)
    owners: dict[str, str] = {}
    geometry: dict[str, Geometry] = {}
    for source, names in groups.items():
        made = shape_source(source).shapes(replace(request, wanted=tuple(names)))
        owners |= made.owners
        geometry |= made.geometry
    return Shapes({name: owners[name] for name in request.graph.names if name in owners}, geometry)
