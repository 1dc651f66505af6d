"""Ways of making furniture of parts beside each other: same boxes, same references, one judge of style for all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
import trimesh
from torch import Tensor

from echomodel.compact.assembling import sample_tokens
from echomodel.compact.furnishing import with_whole_styles
from echomodel.compact.given import Sampling
from echomodel.compact.joined import equal_furniture, joined
from echomodel.data.furniture import Choices, Style, mesh_of, solids
from echomodel.data.furniture.description import piece_of
from echomodel.data.furniture.mirroring import solids_of
from echomodel.data.furniture.snapping import snapped
from echomodel.data.furniture.solids import Solid
from echomodel.echo import EchoModel
from echomodel.graph import GraphBatch
from echomodel.metrics.parts_evaluation import (
    PartsEvaluation,
    clouds,
    counted,
    sampled,
    style_distances,
    style_scores,
    usual_size,
)
from echomodel.metrics.shapes import set_scores
from echomodel.metrics.style_judge import StyleJudge
from echomodel.vocabulary import vocabulary

Way = Callable[[GraphBatch, np.ndarray, torch.Generator], list[list[Solid]]]


@dataclass(frozen=True, eq=False)
class Described:
    """Way (a): the furniture branch says descriptions, a program builds them."""

    model: EchoModel

    def __call__(self, graph: GraphBatch, sizes: np.ndarray, generator: torch.Generator) -> list[list[Solid]]:
        found = sampled(self.model, graph, sizes, generator).numpy()
        return [solids(name, *piece_of(v), s) for name, v, s in zip(_names(graph), found, sizes, strict=True)]


@dataclass(frozen=True, eq=False)
class Tokens:
    """Way (b): the token branch says the solids one by one, which are snapped afterwards (or not)."""

    model: EchoModel
    snap: bool = True
    steps: int | None = None

    def __call__(self, graph: GraphBatch, sizes: np.ndarray, generator: torch.Generator) -> list[list[Solid]]:
        size, equal = torch.from_numpy(sizes).float(), equal_furniture(graph)
        whole = with_whole_styles(graph, joined(graph, None))
        found = sample_tokens(self.model.model, whole, size, equal, generator, Sampling(generator, self.steps))
        out = []
        for tokens, s in zip(found, sizes, strict=True):
            said = tokens.numpy().astype(float)
            out.append(solids_of(snapped(said, s) if self.snap else said, s))
        return out


def drawn(graph: GraphBatch, sizes: np.ndarray, generator: torch.Generator) -> list[list[Solid]]:
    """The programs' own pieces: one style for all of a scene where any relation tells one, else one each."""
    rng = np.random.default_rng(int(torch.randint(2**31, (1,), generator=generator)))
    suites = [Style.draw(rng) for _ in range(graph.num_scenes)]
    told = len(graph.triplets) > 0
    return [
        solids(name, suites[scene] if told else Style.draw(rng), Choices.draw(rng), size)
        for name, scene, size in zip(_names(graph), graph.scene.tolist(), sizes, strict=True)
    ]


def evaluate_way(
    way: Way, judge: StyleJudge, settings: PartsEvaluation
) -> tuple[dict, dict[str, list[trimesh.Trimesh]]]:
    """Scores of a way as `evaluate_parts` gives them, but for style, which the judge tells; and the meshes by class."""
    rng = np.random.default_rng([settings.seed, 2])
    generator = torch.Generator().manual_seed(settings.seed)

    def styles(graph: GraphBatch, sizes: np.ndarray) -> Tensor:
        return judge.styles(way(graph, sizes, generator), graph.category, sizes)

    meshes: dict[str, list[trimesh.Trimesh]] = {}
    fresh: dict[str, list[trimesh.Trimesh]] = {}
    counts: dict[str, float] = {"pieces": 0, "closed": 0, "loose": 0, "solids": 0, "box_error": 0.0}
    spread = []
    for number, category in enumerate(vocabulary().categories[: way_words(judge)]):
        name = category.name
        sizes = np.stack([usual_size(name, rng) for _ in range(settings.per_class)])
        graph = GraphBatch.pack([GraphBatch.single([number])] * settings.per_class)
        pieces = way(graph, sizes, generator)
        meshes[name] = [counted(counts, parts, size) for parts, size in zip(pieces, sizes, strict=True)]
        counts["solids"] += sum(len(parts) for parts in pieces)
        fresh[name] = [mesh_of(solids(name, Style.draw(rng), Choices.draw(rng), size), size) for size in sizes]
        apart = style_distances(judge.styles(pieces, graph.category, sizes))
        spread.append(float(apart[~torch.eye(len(apart), dtype=torch.bool)].mean()))
    result: dict = {"pieces": counts, "sets": set_scores(clouds(meshes), clouds(fresh)).get("mean", {})}
    result["style"] = style_scores(styles, way_words(judge), settings)
    result["diversity"] = float(np.mean(spread))
    return result, meshes


def way_words(judge: StyleJudge) -> int:
    """How many classes the judge knows."""
    return judge.category.num_embeddings


def _names(graph: GraphBatch) -> list[str]:
    words = vocabulary().categories
    return [words[number].name for number in graph.category.tolist()]
