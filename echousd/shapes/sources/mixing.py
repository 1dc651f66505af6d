"""Sources of shapes by name: furniture of parts, sampled shapes, boxes, models of a library; a room of several."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from echomodel.arrays import on_device
from echomodel.furniture import solids
from echomodel.furniture.style import WIDTH, piece_of
from echomodel.late import Late
from echomodel.vocabulary import vocabulary
from echousd.graph.arrays import DESCRIPTION, graph_batch, one_thread, rounded, seeded
from echousd.shapes.geometry import Geometry, Origin
from echousd.shapes.joinery import assembled
from echousd.shapes.sources.named import source_of
from echousd.shapes.sources.source import ShapeRequest, Shapes, having, per_asset
from echousd.shapes.styles import stated_styles

if TYPE_CHECKING:
    from echomodel.protocols import RoomModel

WHOLE = "echousd.shapes.sources.whole"


def furniture_of_parts(request: ShapeRequest) -> Shapes:
    """Pieces built by programs from the descriptions that the model samples, sharp and of several materials."""
    described, size = descriptions(request), np.asarray(request.boxes.size, float)
    named = stated_styles(request.graph)

    def make(row: int) -> Geometry:
        vector = tuple(round(float(v), 4) for v in described[row])
        style, choices = piece_of(np.array(vector), named[request.graph.nodes[row].name])
        kind = vocabulary().category(request.graph.nodes[row].category)
        parts = solids(kind.name, style, choices, size[row])
        origin = Origin("parts")
        return assembled(parts, size[row], faces=request.faces, origin=origin, description=vector, round=kind.round)

    return per_asset(request, make)


def descriptions(request: ShapeRequest) -> np.ndarray:
    """(n, WIDTH) float32: the model's description of every object, rounded; those of an edited graph that stay count.

    Raises ValueError as `having` does.
    """
    graph, model = request.graph, having("furniture", request.model)
    words = sorted(set(request.styles.values()))
    styles = np.array([words.index(request.styles[name]) for name in graph.names])
    extra = request.edited
    kept = {name: form.description for name, form in request.kept.items() if len(form.description) == WIDTH}
    if kept:
        extra["known"] = np.array([kept.get(name, (0.0,) * WIDTH) for name in graph.names], np.float32)
        extra["known_mask"] = np.array([name in kept for name in graph.names])
    with request.timer.stage("shapes") as tell, one_thread():
        found = model.sample_furniture(
            graph_batch(graph), request.centred, generator=seeded(request.seed, "parts"), steps=request.steps,
            styles=styles, progress=tell, **extra,
        )  # fmt: skip
    return rounded(on_device(found, None), DESCRIPTION).astype(np.float32)


@dataclass(frozen=True)
class ShapeSource:
    """Where geometry comes from."""

    # gives geometry of the wanted objects; raises ValueError naming the object that there is none for
    shapes: Callable[[ShapeRequest], Shapes]
    # raises ValueError, before any long work, where the source cannot give shapes with a model
    check: Callable[[RoomModel | None], object] = lambda model: None


SOURCES = {  # those of `echousd.graph.fields.SHAPES`
    "parts": ShapeSource(furniture_of_parts, partial(having, "furniture")),
    "sdf": ShapeSource(Late(f"{WHOLE}:sampled_shapes"), partial(having, "shape")),
    "boxes": ShapeSource(Late(f"{WHOLE}:plain_boxes")),
    "library": ShapeSource(partial(Late(f"{WHOLE}:chosen_models"), source="library")),
    "guided": ShapeSource(partial(Late(f"{WHOLE}:chosen_models"), source="guided"), partial(having, "shape")),
    "own": ShapeSource(partial(Late(f"{WHOLE}:chosen_models"), source="own")),
}


def default_source(model: RoomModel | None) -> str:
    """`parts` where the model can describe furniture, else `sdf`."""
    return "parts" if model is None or "furniture" in model.branches else "sdf"


def check_sources(names: Sequence[str], model: RoomModel | None) -> None:
    """Raises ValueError where one of the sources cannot give shapes with this model."""
    for name in dict.fromkeys(names):
        SOURCES[name].check(model)


def mixed_shapes(request: ShapeRequest, shapes: str) -> Shapes:
    """Geometry of all wanted objects, each from its own source; raises ValueError as the sources do."""
    spare = default_source(request.model)
    groups: dict[str, list[str]] = {}
    for row in request.rows:
        name = request.graph.names[row]
        source = spare if name in request.retrieved.missing else source_of(request.graph.nodes[row], shapes)
        groups.setdefault(source, []).append(name)
    owners: dict[str, str] = {}
    geometry: dict[str, Geometry] = {}
    for source, names in groups.items():
        found = SOURCES[source].shapes(replace(request, wanted=tuple(names)))
        owners |= found.owners
        geometry |= found.geometry
    return Shapes({name: owners[name] for name in request.graph.names if name in owners}, geometry)
