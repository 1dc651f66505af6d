"""The section of shapes: pieces alone against a set (the paper's Tables 3 and 6), and told styles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import torch
import trimesh

from echomodel.boxes import Boxes
from echomodel.data.shapeset import ShapeSet
from echomodel.furniture import Choices, Style, mesh_of, solids
from echomodel.furniture.style import piece_of
from echomodel.graph import GraphBatch
from echomodel.loading import load_model
from echomodel.metrics.furniture import piece_scores, sampled, style_scores, usual_size
from echomodel.metrics.pointsets import chamfer, set_scores, surface_points
from echomodel.metrics.statistics import Figure, mean
from echomodel.protocols import FurnitureModel, RoomModel, furnishes
from echomodel.tsdf import mesh_from_tsdf
from echomodel.vocabulary import vocabulary
from echousd.evaluation.runs import Run, Table, note
from echousd.evaluation.systems import shuffled_model

PUBLISHED = (  # classes of the paper's Tables 3 and 6, in our words
    "double_bed", "nightstand", "wardrobe", "dining_chair", "dining_table", "cabinet", "floor_lamp", "shelf",
    "multi_seat_sofa", "tv_stand",
)  # fmt: skip
CONSISTENT = ("wardrobe", "nightstand", "dining_chair", "dining_table")  # classes of Table 3
POINTS, MOVED = 1024, 128  # points of a shape, and of those that the earth mover's distance looks at
SUITES, PAIRS = 24, 6  # of four classes told one style; of one class
DISTANCES = {"Chamfer": 0, "EMD": MOVED}
FIGURES = {"mmd": "MMD", "cov": "COV", "acc": "1-NNA", "variety": "variety"}
Pieces = Sequence[tuple[trimesh.Trimesh, dict[str, float]]]


def shapes(run: Run) -> list[Table]:
    """Tables 3 and 6: MMD, COV, 1-NNA by Chamfer and earth mover's distance, and whether told styles agree."""
    seed, count = run.settings.seed, max(4, min(12, run.settings.count // 2))
    rng = np.random.default_rng([seed, 20])
    sizes = {word: np.stack([usual_size(word, rng) for _ in range(count)]) for word in PUBLISHED}
    models: dict[str, RoomModel] = {"network": load_model(None), "shuffled": shuffled_model()}
    models |= {s.name: load_model(s.weights) for s in run.systems if s.weights and not s.finish}
    models = {name: model for name, model in models.items() if model.branches & {"shape", "furniture"}}
    made: dict[str, Mapping[str, Sequence[trimesh.Trimesh]]] = {}
    rows: dict[str, dict[str, Figure]] = {}
    for name, model in models.items():
        found = {word: pieces(model, [[word]] * count, sizes[word], seed) for word in PUBLISHED}
        made[name] = {word: [mesh for mesh, _ in row] for word, row in found.items()}
        scores = [score for row in found.values() for _, score in row]
        rows[name] = {
            key: mean([score[key] for score in scores], seed) for key in ("closed", "loose") if key in scores[0]
        }
    made["retrieval"] = {word: row[::-1] for word, row in programs(sizes, [seed, 21, 0]).items()}
    made["random"] = {word: [trimesh.creation.box(size) for size in sizes[word]] for word in PUBLISHED}
    made["programs"] = programs(sizes, [seed, 21, 1])
    against = {word: clouds(row) for word, row in programs(sizes, [seed, 21, 2]).items()}
    if run.settings.shapes:
        against = _set_clouds(Path(run.settings.shapes), count, seed)
    ours = {name: {word: clouds(row[word]) for word in against} for name, row in made.items()}
    scored = {
        (name, distance): set_scores(by_class, against, points=points)
        for name, by_class in ours.items() for distance, points in DISTANCES.items()
    }  # fmt: skip
    for (name, distance), by_class in scored.items():
        for key, title in FIGURES.items():
            rows.setdefault(name, {})[f"{title}, {distance}"] = mean([row[key] for row in by_class.values()], seed)
    told = note("shapes", count=count, against=run.settings.shapes or "pieces of the programs drawn anew")
    tables = [Table("shapes", "Shapes", told, {name: rows[name] for name in made})]
    for key in ("mmd", "cov", "acc"):
        for distance in DISTANCES:
            by = {name: {word: Figure(row[key]) for word, row in scored[name, distance].items()} for name in made}
            tables.append(Table("shapes", f"{FIGURES[key]} by class, {distance}", "As above.", by, plain=True))
    return [*tables, _consistency(models, sizes, seed)]


def pieces(model: RoomModel, scenes: Sequence[Sequence[str]], sizes: np.ndarray, seed: int, told: str = "") -> Pieces:
    """The furniture of scenes that a model makes, with its scores where it is written in parts.

    Arguments:
        scenes: categories of each. sizes: (N, 3) metres. told: predicate that joins all of a scene, "" = none.
    """
    predicate = vocabulary().predicate_id(told) if told else 0
    graph = GraphBatch.pack([
        GraphBatch.single(
            [vocabulary().category_id(word) for word in scene],
            [(i, predicate, j) for i in range(len(scene)) for j in range(len(scene)) if told and i != j],
        )
        for scene in scenes
    ])  # fmt: skip
    generator, words = torch.Generator().manual_seed(seed), [word for scene in scenes for word in scene]
    if furnishes(model):
        found = sampled(model, graph, sizes, generator).numpy()
        rows = zip(words, found, sizes, strict=True)
        return [piece_scores(solids(word, *piece_of(vector), size), size) for word, vector, size in rows]
    boxes = Boxes(torch.from_numpy(sizes).float(), torch.zeros(len(sizes), 3), torch.zeros(len(sizes)))
    return [(_mesh(grid), {}) for grid in model.sample_shapes(graph, boxes, generator=generator).numpy(force=True)]


def _mesh(grid: np.ndarray) -> trimesh.Trimesh:
    try:
        return mesh_from_tsdf(grid)
    except ValueError:  # without a surface, as untrained networks write them
        return trimesh.creation.box((1, 1, 1))


def programs(sizes: Mapping[str, np.ndarray], seed: Sequence[int]) -> dict[str, list[trimesh.Trimesh]]:
    """Pieces of the programs, drawn anew for every seed."""
    luck = np.random.default_rng(list(seed))
    return {
        word: [mesh_of(solids(word, Style.draw(luck), Choices.draw(luck), size), size) for size in rows]
        for word, rows in sizes.items()
    }


def clouds(meshes: Sequence[trimesh.Trimesh]) -> np.ndarray:
    """(n, POINTS, 3) float32 points on the surfaces in the unit box."""
    units = [trimesh.Trimesh((m.vertices - m.bounds[0]) / m.extents - 0.5, m.faces, process=False) for m in meshes]
    return np.stack([surface_points(unit, POINTS) for unit in units])


def _consistency(models: Mapping[str, RoomModel], sizes: Mapping[str, np.ndarray], seed: int) -> Table:
    """Table 3: Chamfer distances of pieces of one class that are told to be of one style."""
    rows: dict[str, dict[str, Figure]] = {}
    for name, model in {**models, "independent shapes": models["network"]}.items():
        told = "same_style_as" if name in models else ""
        rows[name] = _styles(model, bool(told), seed) if furnishes(model) else {}
        for word in CONSISTENT:
            doubled = np.repeat(sizes[word][:PAIRS], 2, axis=0)
            scenes = [[word] * 2] * (len(doubled) // 2) if told else [[word]] * len(doubled)
            found = torch.from_numpy(clouds([mesh for mesh, _ in pieces(model, scenes, doubled, seed, told)]))
            apart = [1000 * float(chamfer(one, found[2 * k + 1 :][:1])) for k, one in enumerate(found[::2])]
            rows[name][f"{word} x 1000"] = mean(apart, seed)
    rows["random"] = {f"{word} x 1000": Figure(0.0) for word in CONSISTENT}
    return Table("shapes", "Consistency", note("consistency"), rows)


def _styles(model: FurnitureModel, together: bool, seed: int) -> dict[str, Figure]:
    generator = torch.Generator().manual_seed(seed)

    def drawn(graph: GraphBatch, wanted: np.ndarray) -> torch.Tensor:
        alone = [GraphBatch.single([category]) for category in graph.category.tolist()]
        return sampled(model, graph if together else GraphBatch.pack(alone), wanted, generator)

    found = style_scores(drawn, len(vocabulary().categories), SUITES, seed)
    return {f"style distance, {key}": Figure(value) for key, value in found.items()}


def _set_clouds(folder: Path, count: int, seed: int) -> dict[str, np.ndarray]:
    found = ShapeSet(folder / "shapes" if (folder / "shapes").is_dir() else folder)
    rng, out = np.random.default_rng([seed, 22]), {}
    for word in PUBLISHED:
        if word in found.categories:
            chosen = rng.permutation(np.flatnonzero(found.category == found.categories.index(word)))[:count]
            out[word] = clouds([mesh_from_tsdf(found[int(i)]) for i in chosen])
    return out
