"""Scores of furniture made of parts: do pieces hold together, share a told style, differ else."""

from collections.abc import Callable, Sequence

import numpy as np
import torch
import trimesh
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.furniture import mesh_of, sample_size
from echomodel.furniture.distances import distance
from echomodel.furniture.solids import Array, Solid
from echomodel.furniture.style import GROUPS, HOT, STYLE
from echomodel.graph import GraphBatch
from echomodel.objective.sizes import size_range
from echomodel.protocols import RoomModel
from echomodel.triangles import linked, spread
from echomodel.vocabulary import vocabulary

TOUCH = 0.006  # metres between solids that still count as joined
POINTS = 160  # on the surface of a solid


def loose_solids(solids: Sequence[Solid]) -> list[int]:
    """Numbers of the solids that no chain of touching solids joins to the largest body of the piece.

    `solids`: of a furniture program, metres; cores do not count.
    """
    seen = [number for number, solid in enumerate(solids) if not solid.core]
    group, main = group_of([solids[number] for number in seen])
    return [seen[number] for number in np.flatnonzero(group != main)]


def group_of(solids: Sequence[Solid]) -> tuple[Array, int]:
    """Number (n,) of the body that each solid is part of, and which body is the largest; none may be a core."""
    meshes = [solid.mesh(2) for solid in solids]
    surfaces = [np.concatenate([points, spread(points[faces], POINTS)[0]]) for points, faces in meshes]
    low = np.array([points.min(0) for points in surfaces]) - TOUCH
    high = np.array([points.max(0) for points in surfaces]) + TOUCH
    near = (low[:, None] <= high[None]).all(2) & (high[:, None] >= low[None]).all(2)
    pairs = zip(*np.nonzero(np.triu(near, 1)), strict=True)
    joined = [(i, j) for i, j in pairs if _touches(surfaces[i], solids[j]) or _touches(surfaces[j], solids[i])]
    group = linked(joined, len(solids))
    return group, int(np.bincount(group).argmax())


def _touches(points: Array, solid: Solid) -> bool:
    x, y, z = points.T
    return bool((distance(solid, x, y, z, np.ones(3)) <= TOUCH).any())


SUITE = 4  # pieces of different classes in a suite


def piece_scores(parts: Sequence[Solid], size: np.ndarray) -> tuple[trimesh.Trimesh, dict[str, float]]:
    """The mesh of one piece; whether it is `closed`, has `loose` parts, and how far it is off its box, metres."""
    with np.errstate(divide="ignore", invalid="ignore"):
        mesh = mesh_of(list(parts), size)
        try:
            loose = bool(loose_solids(parts))
        except ZeroDivisionError:  # a solid without height, as untrained networks write them, touches nothing
            loose = True
    return mesh, {
        "closed": float(mesh.is_watertight and mesh.is_winding_consistent),
        "loose": float(loose),
        "box_error": float(np.abs(mesh.extents - size).max()),
    }


def style_scores(
    styles: Callable[[GraphBatch, np.ndarray], Tensor], classes: int, suites: int, seed: int
) -> dict[str, float]:
    """Mean style distance of pieces of different classes: told to be of one style, nothing told, of other suites.

    `ratio` is the first over the last.

    Arguments:
        styles: graph, and (N, 3) metres, -> (N, D) descriptions. classes: the first of the vocabulary.
    """
    rng = np.random.default_rng([seed, 4])
    words, same = vocabulary().categories, vocabulary().predicate_id("same_style_as")
    every = [(i, same, j) for i in range(SUITE) for j in range(SUITE) if i != j]
    out: dict[str, float] = {}
    for name, triplets in (("told", every), ("untold", [])):
        drawn = [rng.permutation(classes)[:SUITE].tolist() for _ in range(suites)]
        graph = GraphBatch.pack([GraphBatch.single(suite, triplets) for suite in drawn])
        sizes = np.stack([usual_size(words[number].name, rng) for suite in drawn for number in suite])
        described = styles(graph, sizes)
        kinds = torch.stack([part.argmax(1) for part in described[:, :HOT].split(GROUPS, 1)], 1)
        numbers = described[:, HOT:STYLE]
        apart = (numbers[:, None] - numbers).abs().mean(2)  # of proportions, and the share of kinds that differ
        distance = ((kinds[:, None] != kinds).float().mean(2) + apart / 2) / 2
        other = graph.category[:, None] != graph.category
        scene = graph.scene[:, None] == graph.scene
        out[name] = float(distance[scene & other].mean())
        if name == "told":
            out["other"] = float(distance[~scene & other].mean())
    return {**out, "ratio": out["told"] / max(out["other"], 1e-12)}


def usual_size(category: str, rng: np.random.Generator) -> np.ndarray:
    """(3,) float, metres: a size as `sample_size` draws it, within what a person takes for one of the category."""
    return np.clip(sample_size(category, rng), *map(np.array, size_range(category)))


def sampled(model: RoomModel, graph: GraphBatch, sizes: np.ndarray, generator: torch.Generator) -> Tensor:
    """(N, D) float32 descriptions of the furniture of a graph in boxes `sizes` (N, 3), metres."""
    count = graph.num_nodes
    boxes = Boxes(torch.from_numpy(sizes).float(), torch.zeros(count, 3), torch.zeros(count))
    return model.sample_furniture(graph, boxes, generator=generator).float().cpu()
