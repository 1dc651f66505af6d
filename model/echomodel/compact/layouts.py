"""Sampling of layouts: denoising the boxes of whole scenes (EchoScene 3.3)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import torch
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.compact.given import CompactSampling
from echomodel.compact.model import CompactModel
from echomodel.compact.pairs import pairs_of
from echomodel.compact.predictors import layout_predictor
from echomodel.graph import GraphBatch
from echomodel.guidance import relation_guided
from echomodel.protocols import GraphEdit
from echomodel.vocabulary import vocabulary

Latent = Callable[[GraphBatch, GraphEdit | None], Tensor]


def sample_boxes(model: CompactModel, latent: Latent, graph: GraphBatch, how: CompactSampling) -> Boxes:
    """Boxes (N) of S scenes, drawn from noise.

    Arguments:
        model: with a layout branch. latent: the latent graph of some scenes before and after an edit.
        graph: checked and on the model's device. how: to sample; what is known is checked.

    Raises:
        ValueError: rules that the model does not know.
    """
    config = model.config.layout
    scale = model.scale(graph.category)
    given = None if how.known is None else how.known.encode(scale)
    if how.rules not in model.config.rules:
        raise ValueError(f"rules is {how.rules!r}, allowed: {', '.join(model.config.rules)}")
    rules = torch.full_like(graph.room_type, model.config.rules.index(how.rules))
    pairs = pairs_of(graph, model.config.predicates)
    predict = layout_predictor(model, graph, pairs, latent(graph, how.edit), rules)
    strength = config.guidance if how.relation_guidance is None else how.relation_guidance
    if strength:
        predict = relation_guided(
            predict, graph.triplets, scale,
            rules=how.rules, strength=strength, rounds=config.guidance_rounds, floor=graph.floor[graph.scene],
            openings=_in_the_way(graph), category=graph.category, placements=graph.placements, scene=graph.scene,
        )  # fmt: skip
    noise = how.start(graph.num_nodes, 8, graph.category.device)
    vectors = replace(how, known=given).denoised(predict, noise, config)
    boxes = Boxes.decode(vectors, scale)
    boxes = Boxes(boxes.size.clamp(0.01, 20.0), boxes.position, boxes.yaw)
    if how.known is None or how.known_mask is None:
        return boxes
    return boxes.replaced(how.known_mask, how.known)


def _in_the_way(graph: GraphBatch) -> Tensor | None:
    """(N, O, ROW) the openings that each node must leave free: those of its room where it stands on the floor."""
    if not bool(torch.isfinite(graph.openings).any()):
        return None
    floor = [kind.support == "floor" for kind in vocabulary().categories]
    stands = torch.tensor(floor, device=graph.category.device)[graph.category]
    return torch.where(stands[:, None, None], graph.openings[graph.scene], torch.nan)
