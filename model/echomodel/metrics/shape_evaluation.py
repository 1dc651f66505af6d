"""Scores of a model's shapes: held-out shapes reconstructed, and what it makes up for rooms it has not seen."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import numpy as np
import torch
import trimesh

from echomodel.boxes import Boxes
from echomodel.furniture import sample_size
from echomodel.graph import GraphBatch
from echomodel.metrics.shapes import (
    reconstruction_scores,
    reference_points,
    set_scores,
    style_likeness,
    surface_points,
    watertight_share,
)
from echomodel.progress import StageListener
from echomodel.rooms.generator import generate_rooms
from echomodel.rules import label_relations
from echomodel.tsdf import mesh_from_tsdf
from echomodel.vocabulary import vocabulary

if TYPE_CHECKING:
    from echomodel.data.shapeset import ShapeSet
    from echomodel.protocols import RoomModel

POINTS = 1024
FIRST_ROOM = 10_000_000  # rooms from here on are in no training set of ours


@dataclass(frozen=True)
class ShapeEvaluation:
    """How much to score: `limit` held-out shapes, `rooms` rooms to fill; sampling `steps`, None = the model's."""

    limit: int = 200
    rooms: int = 12
    seed: int = 0
    steps: int | None = None
    drop: float = 0.5


def evaluate_shapes(
    model: RoomModel,
    shapes: ShapeSet,
    settings: ShapeEvaluation = ShapeEvaluation(),
    progress: StageListener | None = None,
) -> tuple[dict, dict[str, list[trimesh.Trimesh]]]:
    """Score reconstruction on held-out shapes of a set, and generation against the set's shapes of the same classes.

    Arguments:
        model: whose autoencoder and shape branch are scored.
        shapes: parametric set or set of real meshes.
        settings: how much, and the seed.
        progress: called with (what, done, all).

    Returns:
        `reconstruction`: per class and "all"; with `rooms` above 0 also `generation`: the number of objects, those
        without any surface, the share of closed meshes, `sets` (MMD, COV, 1-NNA per class) and `style` (Chamfer within
        groups of the same style and between them); and the generated meshes by class.

    Raises ValueError when the set has nothing held out or the weights lack a part.
    """
    told = progress or (lambda what, done, total: None)
    if settings.rooms and "shape" not in model.branches:
        raise ValueError(f"the weights ({model.hash}) hold no shape branch; name weights with --model")
    held = np.flatnonzero(shapes.held_out)
    if len(held) == 0:
        raise ValueError(f"{shapes.directory}: holds out no shape to reconstruct")
    rng = np.random.default_rng(settings.seed)
    chosen = np.sort(rng.permutation(held)[: settings.limit])
    names = [shapes.categories[shapes.category[i]] for i in chosen]
    result: dict = {"set": str(shapes.directory), "model": model.hash, **asdict(settings)}
    result["reconstruction"] = reconstruction_scores(
        lambda i: shapes[int(chosen[i])], names,
        lambda grid: model.reconstruct(torch.from_numpy(grid)[None])[0].cpu().numpy(),
        lambda done, total: told("reconstruct", done, total),
    )  # fmt: skip
    meshes: dict[str, list[trimesh.Trimesh]] = {}
    if settings.rooms:
        result["generation"], meshes = _generation(model, shapes, settings, told)
    return result, meshes


def class_shapes(
    model: RoomModel, count: int, seed: int = 0, progress: StageListener | None = None
) -> dict[str, list[tuple[np.ndarray, np.ndarray]]]:
    """Generate `count` objects of every class, each alone in its scene: (64, 64, 64) grids and (3,) sizes in metres.

    Arguments:
        model: whose shape branch is sampled with its defaults.
        count: objects per class.
        seed: seed of the sizes, which are drawn as the furniture's are, and of the sampling.
        progress: called with (what, classes done, all).
    """
    words = [category.name for category in vocabulary().categories]
    rng, generator = np.random.default_rng([seed, 2]), torch.Generator().manual_seed(seed)
    found: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {}
    for number, name in enumerate(words):
        sizes = np.stack([sample_size(name, rng) for _ in range(count)])
        graph = GraphBatch.pack([GraphBatch.single([number])] * count)
        boxes = Boxes(torch.from_numpy(sizes).float(), torch.zeros(count, 3), torch.zeros(count))
        grids = model.sample_shapes(graph, boxes, generator=generator).float().cpu().numpy()
        found[name] = list(zip(grids, sizes, strict=True))
        if progress:
            progress("classes", number + 1, len(words))
    return found


def _generation(
    model: RoomModel, shapes: ShapeSet, settings: ShapeEvaluation, told: StageListener
) -> tuple[dict, dict[str, list[trimesh.Trimesh]]]:
    words = [category.name for category in vocabulary().categories]
    rng = np.random.default_rng([settings.seed, 1])
    generator = torch.Generator().manual_seed(settings.seed)
    meshes: dict[str, list[trimesh.Trimesh]] = defaultdict(list)
    points: dict[str, list[np.ndarray]] = defaultdict(list)
    groups: list[tuple[str, object]] = []
    cloud: list[np.ndarray] = []
    empty = 0
    rooms = generate_rooms(settings.rooms, settings.seed, start=FIRST_ROOM)
    for number, room in enumerate(rooms):
        relations = label_relations(room, rules="strict", drop=settings.drop, rng=rng)
        graph = GraphBatch.from_room(room, triplets=torch.from_numpy(relations))
        boxes = Boxes.from_room(room)
        grids = model.sample_shapes(graph, boxes, generator=generator, steps=settings.steps).float().cpu().numpy()
        for i, grid in enumerate(grids):
            name = words[int(graph.category[i])]
            try:
                mesh = mesh_from_tsdf(grid)
            except ValueError:
                empty += 1
                continue
            sample = surface_points(mesh, POINTS)
            points[name].append(sample)
            cloud.append(sample)
            groups.append((name, (number, room.models[i] or i) if room.models else i))
            meshes[name].append(mesh)
        told("generate", number + 1, len(rooms))
    every = [mesh for found in meshes.values() for mesh in found]
    against = reference_points(shapes, points, rng, lambda grid: surface_points(mesh_from_tsdf(grid), POINTS))
    scores = {
        "objects": len(every) + empty,
        "empty": empty,
        "watertight": watertight_share(every) if every else 0.0,
        "sets": set_scores({k: np.stack(v) for k, v in points.items()}, against),
        "style": style_likeness(np.stack(cloud), groups) if cloud else {},
    }
    return scores, dict(meshes)
