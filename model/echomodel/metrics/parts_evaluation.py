"""Scores of furniture made of parts: do pieces hold together, share a told style, differ else, look like the class."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import torch
import trimesh
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.furniture import Choices, Style, mesh_of, sample_size, solids
from echomodel.furniture.description import GROUPS, HOT, STYLE, piece_of
from echomodel.furniture.solids import Solid
from echomodel.graph import GraphBatch
from echomodel.metrics.pieces import loose_solids
from echomodel.metrics.shape_evaluation import FIRST_ROOM
from echomodel.metrics.shapes import reference_points, set_scores, surface_points
from echomodel.objective.sizes import size_range
from echomodel.progress import StageListener
from echomodel.rooms.generator import generate_rooms
from echomodel.rules import label_relations
from echomodel.tsdf import mesh_from_tsdf
from echomodel.vocabulary import vocabulary

if TYPE_CHECKING:
    from echomodel.data.shapeset import ShapeSet
    from echomodel.echo import EchoModel

POINTS = 1024
SUITE = 4  # pieces of different classes in a suite
ROOMS = "rooms"  # key of the meshes that stand in rooms
NOTHING = {"pieces": 0.0, "closed": 0.0, "loose": 0.0, "box_error": 0.0}


@dataclass(frozen=True)
class PartsEvaluation:
    """How much to score; `steps`, None = the model's.

    Arguments:
        per_class: pieces of every class, each alone. suites: of four pieces of different classes. rooms: of the room
            generator, half of their relations told, all of whose furniture is made.
    """

    per_class: int = 8
    suites: int = 64
    rooms: int = 0
    seed: int = 0
    steps: int | None = None


def evaluate_parts(
    model: EchoModel,
    settings: PartsEvaluation = PartsEvaluation(),
    shapes: ShapeSet | None = None,
    progress: StageListener | None = None,
) -> tuple[dict, dict[str, list[trimesh.Trimesh]]]:
    """Generate pieces of every class and suites of classes, and score both.

    Arguments:
        model: with a furniture branch. settings: how much, and the seed.
        shapes: set to compare with as well, of real meshes for example.
        progress: called with (what, done, all).

    Returns:
        `pieces` (how many, closed, loose, largest error of the box), `sets` against pieces of styles drawn anew (and
        `shapes_sets` against the set), `rooms_pieces` of generated rooms, `style` within told suites and elsewhere,
        `diversity` within a class; and the meshes by class, those of rooms under "rooms".

    Raises ValueError for weights without a furniture branch.
    """
    if "furniture" not in model.branches:
        raise ValueError(f"the weights ({model.hash}) hold no furniture branch; name weights with --model")
    told = progress or (lambda what, done, total: None)
    rng = np.random.default_rng([settings.seed, 2])
    generator = torch.Generator().manual_seed(settings.seed)
    meshes: dict[str, list[trimesh.Trimesh]] = {}
    fresh: dict[str, list[trimesh.Trimesh]] = {}
    counts = dict(NOTHING)
    spread, distinct = [], 0
    words = [category.name for category in vocabulary().categories]
    for number, name in enumerate(words):
        sizes = np.stack([usual_size(name, rng) for _ in range(settings.per_class)])
        graph = GraphBatch.pack([GraphBatch.single([number])] * settings.per_class)
        found = sampled(model, graph, sizes, generator, settings.steps)
        meshes[name], fresh[name] = [], []
        for vector, size in zip(found.numpy(), sizes, strict=True):
            meshes[name].append(counted(counts, solids(name, *piece_of(vector), size), size))
            fresh[name].append(mesh_of(solids(name, Style.draw(rng), Choices.draw(rng), size), size))
        apart = style_distances(found)[~torch.eye(len(found), dtype=torch.bool)]
        spread.append(float(apart.mean()) if len(apart) else 0.0)
        distinct += len({tuple(np.round(vector, 2)) for vector in found.numpy()})
        told("classes", number + 1, len(words))
    ours = clouds(meshes)
    result: dict = {"model": model.hash, **asdict(settings), "pieces": counts, "sets": set_scores(ours, clouds(fresh))}
    if shapes is not None:
        result["shapes_set"] = str(shapes.directory)
        against = reference_points(shapes, ours, rng, lambda grid: _cloud(mesh_from_tsdf(grid)))
        result["shapes_sets"] = set_scores(ours, against)
    if settings.rooms:
        result["rooms_pieces"], meshes[ROOMS] = room_pieces(model, settings, generator)
    made = partial(sampled, model, generator=generator, steps=settings.steps)
    result["style"] = style_scores(made, len(words), settings)
    result["diversity"] = {"style_distance": float(np.mean(spread)), "distinct": distinct}
    return result, meshes


def room_pieces(
    model: EchoModel, settings: PartsEvaluation, generator: torch.Generator
) -> tuple[dict[str, float], list[trimesh.Trimesh]]:
    """The furniture of generated rooms: counts as for the pieces that stand alone, and the meshes."""
    rng = np.random.default_rng([settings.seed, 6])
    words = [category.name for category in vocabulary().categories]
    counts, meshes = dict(NOTHING), []
    for room in generate_rooms(settings.rooms, settings.seed, start=FIRST_ROOM):
        relations = label_relations(room, rules="strict", drop=0.5, rng=rng)
        graph = GraphBatch.from_room(room, triplets=torch.from_numpy(relations))
        found = model.sample_furniture(graph, Boxes.from_room(room), generator=generator, steps=settings.steps)
        for number, vector, size in zip(graph.category.tolist(), found.float().cpu().numpy(), room.size, strict=True):
            extent = np.asarray(size, float)
            meshes.append(counted(counts, solids(words[number], *piece_of(vector), extent), extent))
    return counts, meshes


def counted(counts: dict[str, float], parts: list[Solid], size: np.ndarray) -> trimesh.Trimesh:
    """The mesh of one piece, taken into account."""
    mesh = mesh_of(parts, size)
    counts["pieces"] += 1
    counts["closed"] += bool(mesh.is_watertight and mesh.is_winding_consistent)
    counts["loose"] += bool(loose_solids(parts))
    counts["box_error"] = max(counts["box_error"], float(np.abs(mesh.extents - size).max()))
    return mesh


def style_scores(
    styles: Callable[[GraphBatch, np.ndarray], Tensor], classes: int, settings: PartsEvaluation
) -> dict[str, float]:
    """Mean style distance of pieces of different classes: told to be of one style, nothing told, of other suites.

    `ratio` is the first over the last.

    Arguments:
        styles: graph, and (N, 3) metres, -> (N, D) descriptions or styles. classes: the first of the vocabulary.
    """
    rng = np.random.default_rng([settings.seed, 4])
    words, same = vocabulary().categories, vocabulary().predicate_id("same_style_as")
    every = [(i, same, j) for i in range(SUITE) for j in range(SUITE) if i != j]
    out: dict[str, float] = {}
    for name, triplets in (("told", every), ("untold", [])):
        suites = [rng.permutation(classes)[:SUITE].tolist() for _ in range(settings.suites)]
        graph = GraphBatch.pack([GraphBatch.single(suite, triplets) for suite in suites])
        sizes = np.stack([usual_size(words[number].name, rng) for suite in suites for number in suite])
        distance = style_distances(styles(graph, sizes))
        other = graph.category[:, None] != graph.category
        scene = graph.scene[:, None] == graph.scene
        out[name] = float(distance[scene & other].mean())
        if name == "told":
            out["other"] = float(distance[~scene & other].mean())
    return {**out, "ratio": out["told"] / max(out["other"], 1e-12)}


def style_distances(descriptions: Tensor) -> Tensor:
    """(N, N) in [0, 1]: mean of the share of kinds that differ and of how far the proportions lie apart.

    Arguments:
        descriptions: (N, D).
    """
    words, start = [], 0
    for size in GROUPS:
        words.append(descriptions[:, start : start + size].argmax(1))
        start += size
    kinds = torch.stack(words, 1)
    differ = (kinds[:, None] != kinds).float().mean(2)
    numbers = descriptions[:, HOT:STYLE]
    return (differ + (numbers[:, None] - numbers).abs().mean(2) / 2) / 2


def usual_size(category: str, rng: np.random.Generator) -> np.ndarray:
    """(3,) float, metres: a size as `sample_size` draws it, within what a person takes for one of the category."""
    return np.clip(sample_size(category, rng), *map(np.array, size_range(category)))


def sampled(
    model: EchoModel, graph: GraphBatch, sizes: np.ndarray, generator: torch.Generator, steps: int | None = None
) -> Tensor:
    """(N, D) float32 descriptions of the furniture of a graph in boxes `sizes` (N, 3), metres."""
    count = graph.num_nodes
    boxes = Boxes(torch.from_numpy(sizes).float(), torch.zeros(count, 3), torch.zeros(count))
    return model.sample_furniture(graph, boxes, generator=generator, steps=steps).float().cpu()


def clouds(meshes: dict[str, list[trimesh.Trimesh]]) -> dict[str, np.ndarray]:
    """Points on the surfaces in the unit box, class -> (n, POINTS, 3)."""
    return {name: np.stack([_cloud(mesh) for mesh in found]) for name, found in meshes.items() if found}


def _cloud(mesh: trimesh.Trimesh) -> np.ndarray:
    unit = trimesh.Trimesh((mesh.vertices - mesh.bounds[0]) / mesh.extents - 0.5, mesh.faces, process=False)
    return surface_points(unit, POINTS)
