"""Sources of shapes by name, models of a library among them; a room of several, where each object's own word counts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from echomodel.boxes import Boxes
from echomodel.protocols import RoomModel
from echousd.graph import SceneGraph
from echousd.progress import StageTimer
from echousd.shapes.geometry import Geometry
from echousd.shapes.sources import made
from echousd.shapes.sources.made import sampled_grids
from echousd.shapes.sources.retrieval import source_of
from echousd.shapes.sources.source import ShapeRequest, Shapes
from echousd.shapes.styles import EQUAL, style_groups

if TYPE_CHECKING:
    from echousd.assets.choose import AssetWishes


def chosen_models(request: ShapeRequest, source: str) -> Shapes:
    """What `ShapeRequest.retrieved` holds, as geometry of a source; objects with one model and size share an asset."""
    from echousd.shapes.originals.loading import geometry_of

    size = np.asarray(request.boxes.size, float)
    owners: dict[str, str] = {}
    geometry: dict[str, Geometry] = {}
    heads: list[int] = []
    chosen, files = request.retrieved.chosen, request.retrieved.files
    with request.timer.stage("meshes", len(request.rows)) as tell:
        for done, row in enumerate(request.rows, 1):
            node = request.graph.nodes[row]
            record = chosen[node.name]
            same = (
                other
                for other in heads
                if chosen[request.graph.nodes[other].name] == record
                and request.graph.nodes[other].category == node.category
                and np.abs(size[other] / size[row] - 1).max() <= EQUAL
            )
            first = next(same, None)
            if first is None:
                heads.append(row)
                box = (float(size[row][0]), float(size[row][1]), float(size[row][2]))
                collect = request.retrieved.collect
                geometry[node.name] = geometry_of(files[node.name], record, node.category, box, source, collect=collect)
            owners[node.name] = node.name if first is None else request.graph.nodes[first].name
            tell(done, len(request.rows))
    return Shapes(owners, geometry)


def shape_nearness(
    graph: SceneGraph, boxes: Boxes, shapes: str, wishes: AssetWishes, seed: int, model: RoomModel | None,
    steps: int | None, timer: StageTimer,
) -> Mapping[str, Mapping[str, float]] | None:  # fmt: skip
    """Object name -> id of a model -> cost of its shape against the generated one; None where nothing is guided.

    Raises ValueError for a library without descriptors. Arguments as for `retrieved` and `ShapeRequest`.
    """
    rows = [i for i, node in enumerate(graph.nodes) if source_of(node, shapes) == "guided" and node.asset is None]
    records = [record for shelf in wishes.shelves.values() for record in shelf.records]
    if not rows or not records:
        return None
    if not any(record.descriptor for record in records):
        assert wishes.library is not None
        raise ValueError(f"{wishes.library.file}: holds no descriptors; index the library with --descriptors")
    from echousd.assets.descriptor import descriptors, nearness

    grids = sampled_grids(ShapeRequest(graph, boxes, style_groups(graph), seed, model, steps, timer=timer))
    found = descriptors(model, np.asarray(grids)[rows])
    return nearness(found, [graph.names[i] for i in rows], records)


@dataclass(frozen=True)
class ShapeSource:
    """Where geometry comes from."""

    # gives geometry of the wanted objects; raises ValueError naming the object that there is none for
    shapes: Callable[[ShapeRequest], Shapes]
    # raises ValueError, before any long work, where the source cannot give shapes with a model
    check: Callable[[RoomModel | None], None] = lambda model: None


SOURCES = {  # those of `echousd.graph.fields.SHAPES`
    "parts": ShapeSource(made.furniture_of_parts, made.needs_furniture),
    "sdf": ShapeSource(made.sampled_shapes, made.needs_shapes),
    "boxes": ShapeSource(made.plain_boxes),
    "library": ShapeSource(partial(chosen_models, source="library")),
    "guided": ShapeSource(partial(chosen_models, source="guided"), made.needs_shapes),
    "independent": ShapeSource(made.lone_shapes, made.needs_shapes),
    "own": ShapeSource(partial(chosen_models, source="own")),
}


def default_source(model: RoomModel | None) -> str:
    """`parts` where the model can describe furniture, else `sdf`."""
    return "parts" if model is None or "furniture" in model.branches else "sdf"


def sources_of(graph: SceneGraph, shapes: str) -> dict[str, str]:
    """Object name -> name of its source. `shapes`: the source of objects that say nothing."""
    return {node.name: source_of(node, shapes) for node in graph.nodes}


def check_sources(names: Sequence[str], model: RoomModel | None) -> None:
    """Raises ValueError where one of the sources cannot give shapes with this model."""
    for name in dict.fromkeys(names):
        SOURCES[name].check(model)


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
        return SOURCES[next(iter(groups))].shapes(request)
    owners: dict[str, str] = {}
    geometry: dict[str, Geometry] = {}
    for source, names in groups.items():
        found = SOURCES[source].shapes(replace(request, wanted=tuple(names)))
        owners |= found.owners
        geometry |= found.geometry
    return Shapes({name: owners[name] for name in request.graph.names if name in owners}, geometry)
