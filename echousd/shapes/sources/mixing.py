"""Sources of shapes by name: furniture of parts, sampled shapes, boxes, models of a library; a room of several."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
import trimesh

from echomodel.boxes import Boxes
from echomodel.furniture import solids
from echomodel.furniture.style import WIDTH, piece_of
from echomodel.graph import GraphBatch
from echomodel.protocols import RoomModel, furnishes
from echomodel.vocabulary import vocabulary
from echousd.graph import SceneGraph
from echousd.progress import StageTimer
from echousd.shapes.colliders import colliders_of
from echousd.shapes.geometry import Geometry, Origin, Part
from echousd.shapes.joinery import assembled
from echousd.shapes.looks import material_groups
from echousd.shapes.meshing import LEAST_FACES, box_mesh, mesh_from_shape
from echousd.shapes.sources.retrieval import source_of
from echousd.shapes.sources.source import ShapeRequest, Shapes, per_asset
from echousd.shapes.styles import EQUAL, style_groups, told_styles
from echousd.tensors import floor_centre, graph_batch, one_thread, rounded_descriptions, rounded_grids, seeded

if TYPE_CHECKING:
    from echousd.assets.choose import AssetWishes

TRIES = 6  # simplifications until the cut mesh is within its budget


def plain_boxes(request: ShapeRequest) -> Shapes:
    """Every object is the box that it fills."""
    size, origin = np.asarray(request.boxes.size, float), Origin("boxes")

    def make(row: int) -> Geometry:
        return solid_geometry(box_mesh(size[row]), request.graph.nodes[row].category, origin)

    return per_asset(request, make)


def solid_geometry(mesh: trimesh.Trimesh, category: str, origin: Origin) -> Geometry:
    """The geometry of one mesh (object frame, metres) whose category says which materials it has where."""
    cut, slots = material_groups(mesh, category)
    return Geometry((Part("mesh", cut, slots),), colliders_of(mesh, category), origin)


def needs_shapes(model: RoomModel | None) -> None:
    """Raises ValueError for a model without a shape branch."""
    if model is None or "shape" not in model.branches:
        raise ValueError("these weights have no shape branch; use shapes 'boxes' (--shapes boxes) or other weights")


def sampled_shapes(request: ShapeRequest) -> Shapes:
    """Meshes of shapes from the model's shape branch (EchoScene 3.4).

    Objects of an edited graph that stay are sampled along, the others hear them.
    """
    return _meshed(request, sampled_grids(request), within_budget)


def lone_shapes(request: ShapeRequest) -> Shapes:
    """Meshes of shapes that were sampled one by one: no object hears of another.

    For comparisons (the paper's rows of layout + class-to-shape generation).
    """

    def make(grid: np.ndarray, size: np.ndarray, category: str, faces: int) -> Geometry:
        return solid_geometry(mesh_from_shape(grid, size, faces=faces), category, Origin("independent"))

    alone = [graph_batch(request.graph.replaced(nodes=(node,), relations=())) for node in request.graph.nodes]
    return _meshed(request, _grids(request, GraphBatch.pack(alone), "independent"), make, alike=False)


def _meshed(request: ShapeRequest, grids: np.ndarray, mesh: Callable[..., Geometry], *, alike: bool = True) -> Shapes:
    size = np.asarray(request.boxes.size, float)

    def make(row: int) -> Geometry:
        node = request.graph.nodes[row]
        try:
            return mesh(grids[row], size[row], node.category, request.faces)
        except ValueError as error:
            raise ValueError(f"shape of {node.name!r}: {error}; try another seed or shapes 'boxes'") from None

    return per_asset(request, make, alike=alike)


def within_budget(grid: np.ndarray, size: np.ndarray, category: str, faces: int) -> Geometry:
    """The geometry of a shape with at most `faces` triangles once it is cut along the borders of its materials.

    Arguments: as for `mesh_from_shape`, raises what it raises. A budget of a few hundred may be too small for the cuts
    alone; the best that was found is given then.
    """
    asked, best = faces, None
    for _ in range(TRIES):
        found = solid_geometry(mesh_from_shape(grid, size, faces=asked), category, Origin("sdf"))
        best = found if best is None or found.faces < best.faces else best
        if found.faces <= faces or asked == LEAST_FACES:
            break
        asked = max(LEAST_FACES, int(0.99 * asked * faces / found.faces))
    assert best is not None
    return best


def sampled_grids(request: ShapeRequest) -> np.ndarray:
    """(n, 64, 64, 64) float32 TSDFs of all objects; raises ValueError for a model without a shape branch."""
    return _grids(request, graph_batch(request.graph), "shapes", _edit_of(request))


def _grids(request: ShapeRequest, batch: GraphBatch, stream: str, extra: dict[str, Any] | None = None) -> np.ndarray:
    """As `sampled_grids`, of any graph with one node for each box; `stream` is that of the random numbers."""
    needs_shapes(request.model)
    assert request.model is not None
    with request.timer.stage("shapes") as tell, one_thread():
        grids = request.model.sample_shapes(
            batch, _centred(request), generator=seeded(request.seed, stream), steps=request.steps, progress=tell,
            **(extra or {}),
        )  # fmt: skip
        return rounded_grids(grids.numpy(force=True))


def _centred(request: ShapeRequest) -> Boxes:
    boxes = request.boxes
    return Boxes(boxes.size, boxes.position - floor_centre(request.graph), boxes.yaw)


def _edit_of(request: ShapeRequest) -> dict[str, Any]:
    return {} if request.change is None else {"edit": request.change}


def needs_furniture(model: RoomModel | None) -> None:
    """Raises ValueError for a model without a furniture branch, or one that describes furniture in other words."""
    if not furnishes(model):
        raise ValueError("these weights have no furniture branch; use --shapes sdf, --shapes boxes or other weights")
    if model.description_width != WIDTH:
        raise ValueError(
            f"these weights describe furniture by {model.description_width} numbers, this version by {WIDTH}; "
            "train them again or use --shapes sdf"
        )


def furniture_of_parts(request: ShapeRequest) -> Shapes:
    """Pieces built by programs from the descriptions that the model samples, sharp and of several materials."""
    described, size = descriptions(request), np.asarray(request.boxes.size, float)
    named = told_styles(request.graph)

    def make(row: int) -> Geometry:
        told = tuple(round(float(v), 4) for v in described[row])
        style, choices = piece_of(np.array(told), named[request.graph.nodes[row].name])
        kind = vocabulary().category(request.graph.nodes[row].category)
        parts = solids(kind.name, style, choices, size[row])
        origin = Origin("parts")
        return assembled(parts, size[row], faces=request.faces, origin=origin, description=told, round=kind.round)

    return per_asset(request, make)


def descriptions(request: ShapeRequest) -> np.ndarray:
    """(n, WIDTH) float32: the model's description of every object, rounded; those of an edited graph that stay count.

    Raises ValueError as `needs_furniture` does.
    """
    graph, model = request.graph, request.model
    needs_furniture(model)
    assert furnishes(model)
    words = sorted(set(request.styles.values()))
    styles = torch.tensor([words.index(request.styles[name]) for name in graph.names])
    extra = _edit_of(request)
    kept = {name: form.description for name, form in request.kept.items() if len(form.description) == WIDTH}
    if kept:
        extra["known"] = torch.tensor([kept.get(name, (0.0,) * WIDTH) for name in graph.names])
        extra["known_mask"] = torch.tensor([name in kept for name in graph.names])
    with request.timer.stage("shapes") as tell, one_thread():
        found = model.sample_furniture(
            graph_batch(graph), _centred(request), generator=seeded(request.seed, "parts"), steps=request.steps,
            styles=styles, progress=tell, **extra,
        )  # fmt: skip
    return rounded_descriptions(np.asarray(found.cpu()))


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
    "parts": ShapeSource(furniture_of_parts, needs_furniture),
    "sdf": ShapeSource(sampled_shapes, needs_shapes),
    "boxes": ShapeSource(plain_boxes),
    "library": ShapeSource(partial(chosen_models, source="library")),
    "guided": ShapeSource(partial(chosen_models, source="guided"), needs_shapes),
    "independent": ShapeSource(lone_shapes, needs_shapes),
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
