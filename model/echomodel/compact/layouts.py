"""Sampling of layouts: denoising the boxes of whole scenes, from noise or from a draft (EchoScene 3.3)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.compact.given import Sampling, starting_noise
from echomodel.compact.model import CompactModel
from echomodel.compact.pairs import pairs_of
from echomodel.compact.predictors import layout_predictor
from echomodel.floors import known as floors_known
from echomodel.graph import GraphBatch
from echomodel.guidance import relation_guided
from echomodel.protocols import GraphEdit
from echomodel.randomness import for_scenes, uniform
from echomodel.samplers import Predict, guided
from echomodel.vocabulary import vocabulary

TRUST = 2.0  # a draft that keeps a share of what is told is begun on with this power of it as probability
MOST_TOLD = 4.0  # relations an object; graphs that tell more leave nothing for a draft to add
Latent = Callable[[GraphBatch, GraphEdit | None], Tensor]


@dataclass(frozen=True, eq=False)
class LayoutSampling:
    """How layouts are sampled and what is given; fields as the arguments of `EchoModel.sample_layout`.

    Arguments:
        by: how every branch is sampled; what is known is here, in metres.
    """

    by: Sampling
    rules: str
    known: Boxes | None = None
    edit: GraphEdit | None = None
    relation_guidance: float | None = None
    noise: Tensor | None = None
    start: float | None = None


def sample_boxes(model: CompactModel, latent: Latent, graph: GraphBatch, how: LayoutSampling) -> Boxes:
    """Boxes (N) of S scenes; those that few relations are told of begin on a draft, if the floors are known.

    Arguments:
        model: with a layout branch. latent: the latent graph of some scenes before and after an edit.
        graph: checked and on the model's device.

    Raises:
        ValueError: rules that the model does not know.
    """
    begin = model.config.layout.start if how.start is None else how.start
    bound = how.known is not None or how.edit is not None or how.noise is not None
    if begin >= 1 or bound or not bool(floors_known(graph.floor).all()):
        return _denoised(model, latent, graph, how, None, 1.0)
    from echomodel.drafts import drafted  # the room generator: a baseline, not on the way of what ships

    counts = graph.node_counts
    told = torch.bincount(graph.scene[graph.triplets[:, 0]], minlength=len(counts)) / counts
    open_ = told <= MOST_TOLD
    if not bool(open_.any()):
        return _denoised(model, latent, graph, how, None, 1.0)
    some = for_scenes(how.by.generator, open_)
    draft, share = drafted(_scenes(graph, open_).to("cpu"), some, rules=how.rules)
    trusted = open_.clone()
    luck = uniform(len(share), some)
    trusted[open_] = (luck < share**TRUST).to(open_.device)
    draft = draft[trusted[open_].repeat_interleave(counts[open_]).cpu()].to(graph.category.device)
    out = torch.zeros(graph.num_nodes, 7, device=graph.category.device)
    for mask, level in ((trusted, begin), (~trusted, 1.0)):
        if bool(mask.any()):
            # the same steps again for the other scenes would be told twice
            own, told_of = for_scenes(how.by.generator, mask), how.by.progress if bool(mask[0]) else None
            part = replace(how, by=replace(how.by, generator=own, progress=told_of))
            scenes = graph if bool(mask.all()) else _scenes(graph, mask)
            boxes = _denoised(model, latent, scenes, part, draft if level < 1 else None, level)
            out[mask[graph.scene]] = torch.cat([boxes.size, boxes.position, boxes.yaw[:, None]], 1)
    return Boxes(out[:, :3], out[:, 3:6], out[:, 6])


def _scenes(graph: GraphBatch, mask: Tensor) -> GraphBatch:
    """The scenes where `mask` (S,) bool is true."""
    return GraphBatch.pack([scene for scene, chosen in zip(graph.unpack(), mask.tolist(), strict=True) if chosen])


def _denoised(
    model: CompactModel, latent: Latent, graph: GraphBatch, how: LayoutSampling, draft: Boxes | None, start: float
) -> Boxes:
    config, by = model.config.layout, how.by
    scale = model.scale(graph.category)
    given = None if how.known is None else how.known.encode(scale)
    conditional = _predictor(model, graph, latent(graph, how.edit), how.rules)
    if by.guidance != 1.0:
        bare = graph.with_triplets(graph.triplets[:0])
        conditional = guided(conditional, _predictor(model, bare, latent(bare, None), how.rules), by.guidance)
    strength = config.guidance if how.relation_guidance is None else how.relation_guidance
    if strength:
        conditional = relation_guided(
            conditional, graph.triplets, scale,
            rules=how.rules, strength=strength, rounds=config.guidance_rounds, floor=graph.floor[graph.scene],
            openings=_in_the_way(graph), category=graph.category, placements=graph.placements,
        )  # fmt: skip
    noise = starting_noise((graph.num_nodes, 8), by.generator, how.noise, graph.category.device)
    begun = None if draft is None else draft.encode(scale)
    vectors = replace(by, known=given).denoised(conditional, noise, config, draft=begun, start=start)
    boxes = Boxes.decode(vectors, scale)
    boxes = Boxes(boxes.size.clamp(0.01, 20.0), boxes.position, boxes.yaw)
    if how.known is None or by.known_mask is None:
        return boxes
    return boxes.replaced(by.known_mask, how.known)


def _in_the_way(graph: GraphBatch) -> Tensor | None:
    """(N, O, ROW) the openings that each node must leave free: those of its room where it stands on the floor."""
    if not bool(torch.isfinite(graph.openings).any()):
        return None
    floor = [kind.support == "floor" for kind in vocabulary().categories]
    stands = torch.tensor(floor, device=graph.category.device)[graph.category]
    return torch.where(stands[:, None, None], graph.openings[graph.scene], torch.nan)


def _predictor(model: CompactModel, graph: GraphBatch, latent: Tensor, rules: str) -> Predict:
    config = model.config
    if rules not in config.rules:
        raise ValueError(f"rules is {rules!r}, allowed: {', '.join(config.rules)}")
    chosen = torch.full_like(graph.room_type, config.rules.index(rules))
    return layout_predictor(model, graph, pairs_of(graph, config.predicates), latent, chosen)
