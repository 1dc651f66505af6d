"""Sampling with a compact model: what a caller gives, what samplers call, boxes and descriptions that come of it."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from echomodel.arrays import Array, beside, clipped, full, kit, on_device, pairs_in, rows, sum_of, without_slopes
from echomodel.boxes import Boxes, BoxScale
from echomodel.compact.layout import temperatures
from echomodel.compact.learned import places
from echomodel.compact.pairs import Pairs, pairs_of
from echomodel.config import BranchConfig, Sampler
from echomodel.graph import GraphBatch, GraphEdit
from echomodel.late import Late
from echomodel.randomness import normal
from echomodel.samplers import Predict, Sampling, clean_from, sample
from echomodel.standing import plan_of_graph, settled
from echomodel.vocabulary import vocabulary

if TYPE_CHECKING:
    from echomodel.compact.model import CompactModel
    from echomodel.compact.plain import PlainModel

Model: TypeAlias = "CompactModel | PlainModel"
AFTER = 40  # steps of guidance after the last of the sampler
guided, mended = Late("echomodel.guidance:guided"), Late("echomodel.guidance:mended")


def box_scale(model: Model, category: Array) -> BoxScale:
    """What the normalised numbers of boxes of `category` (N,) int64 stand for."""
    return model.statistics.scale(places("categories", model.config.categories, category))


def layout_predictor(model: Model, graph: GraphBatch, pairs: Pairs, latent: Array, rules: Array) -> Predict:
    """Clean boxes (N, 8) in noisy ones; arguments as for `LayoutDenoiser.context`."""
    context = model.layout.context(graph, pairs, latent, rules, box_scale(model, graph.category))

    def predict(x: Array, level: Array) -> Array:
        return clean_from(model.layout(x, level, context), x, level, model.config.layout.objective)

    return predict


def agreeing(predict: Predict, groups: Array) -> Predict:
    """Clean codes on which each group agrees, their mean, so that equal furniture stays equal from the first step on.

    Arguments:
        predict: the denoiser's clean sample (N, K).
        groups: (N,) int64, number of each node's group in [0, N). Known nodes (level 0) speak for their whole group.
    """
    alone = np.array_equal(on_device(groups, None), np.arange(len(groups)))

    def agreed(x: Array, level: Array) -> Array:
        clean = predict(x, level)
        weight = kit(level).where(level == 0, full(clean, len(clean), 1.0), 1e-6)[:, None]
        return group_means(clean * weight, groups) / group_means(weight, groups)

    return predict if alone else agreed


def group_means(values: Array, groups: Array) -> Array:
    """Each value (N, ...) replaced by the mean of its group; groups (N,) int64 in [0, N)."""
    count = sum_of(groups, full(values, len(values), 1.0), len(values))[groups]
    return sum_of(groups, values, len(values))[groups] / count.reshape(-1, *[1] * (values.ndim - 1))


@dataclass(frozen=True, eq=False)
class CompactSampling(Sampling):
    """How a compact model samples; what is given beside goes by these.

    Arguments:
        sampler: None = the branch's. rules: the rule set that the relations are meant in, `strict` or `sgfront`.
        relation_guidance: of the first step down what the terms of the objective miss, metres (`echomodel.guidance`),
            0 = off, None = the branch's.
        noise: (N, K) starting noise in place of the generator's, taken as it is (no candidates).
        candidates: draws of a shape, of which the most whole that bears what stands on it is kept (pieces of one class
            and style together); None = the branch's.
        styles: (N,) int64, nodes with one number of 0 or more are furniture of one style, beside those that relations
            of style join; None = nothing is known of styles.
    """

    sampler: Sampler | None = None
    rules: str = "strict"
    relation_guidance: float | None = None
    noise: Array | None = None
    candidates: int | None = None
    styles: Array | None = None

    def denoised(
        self, predict: Predict, noise: Array, settings: BranchConfig, temperature: Array | None = None
    ) -> Array:
        """What becomes of `noise` (N, ...), by the branch's sampler, steps and temperature where none are asked for."""
        return sample(
            self.sampler or settings.sampler, predict, noise, self.steps or settings.steps, settings.objective,
            known=self.known, known_mask=self.known_mask, generator=self.generator, progress=self.progress,
            temperature=settings.temperature if temperature is None else temperature,
        )  # fmt: skip

    def start(self, nodes: int, width: int, device: Any) -> Array:
        """The noise (nodes, width) that is given, checked, or the generator's."""
        if self.noise is None:
            return normal((nodes, width), self.generator, device)
        if tuple(self.noise.shape) != (nodes, width):
            raise ValueError(f"noise is {tuple(self.noise.shape)}, expected {(nodes, width)}")
        bad = ~kit(self.noise).isfinite(self.noise).all(1)
        if bool(bad.any()):
            raise ValueError(f"noise of node {int(rows(bad)[0])} is not finite")
        return on_device(self.noise, device)


def known_values(graph: GraphBatch, known: Any, mask: Array | None, device: Any) -> tuple[Any, Array | None]:
    """Known values and their mask on `device`, with unknown rows replaced by something harmless."""
    if (known is None) != (mask is None):
        raise ValueError("known and known_mask belong together, one of them is missing")
    if known is None or mask is None:
        return None, None
    nodes = graph.num_nodes
    if len(known) != nodes or tuple(mask.shape) != (nodes,) or str(mask.dtype).removeprefix("torch.") != "bool":
        found = f"{len(known)} values and a {tuple(mask.shape)} {mask.dtype} mask"
        raise ValueError(f"known: {found} for a graph of {nodes} nodes, expected one of each per node (bool)")
    mask = on_device(mask, device)
    if isinstance(known, Boxes):
        known = known.to(device)
        zeros, ones = kit(mask).zeros_like, kit(mask).ones_like
        filled = Boxes(ones(known.size), zeros(known.position), zeros(known.yaw)).replaced(mask, known)
        filled.check()
        return filled, mask
    known = on_device(known, device)
    bad = ~kit(known).isfinite(known.reshape(nodes, -1)).all(1) & mask
    if bool(bad.any()):
        raise ValueError(f"known shape of node {int(rows(bad)[0])} holds values that are not finite")
    return kit(known).where(mask.reshape(-1, *[1] * (known.ndim - 1)), known, kit(known).ones_like(known)), mask


Latent = Callable[[GraphBatch, GraphEdit | None], Array]


def sample_boxes(model: Model, latent: Latent, graph: GraphBatch, how: CompactSampling) -> Boxes:
    """Boxes (N) of S scenes, drawn from noise; each stands or hangs at the height that what carries it gives.

    Arguments:
        model: with a layout branch. latent: the latent graph of some scenes before and after an edit.
        graph: checked and on the model's device. how: to sample; what is known is checked.

    Raises ValueError for rules that the model does not know.
    """
    config = model.config.layout
    scale = box_scale(model, graph.category)
    known = None if how.known is None else how.known.encode(scale)
    if how.rules not in model.config.rules:
        raise ValueError(f"rules is {how.rules!r}, allowed: {', '.join(model.config.rules)}")
    rules = kit(graph.room_type).full_like(graph.room_type, model.config.rules.index(how.rules))
    pairs = pairs_of(graph, model.config.predicates)
    predict = layout_predictor(model, graph, pairs, latent(graph, how.edit), rules)
    strength = config.guidance if how.relation_guidance is None else how.relation_guidance
    plan = plan_of_graph(graph.to("cpu" if strength else None), how.rules)  # slopes are torch's
    if strength:
        predict = guided(predict, plan, scale, strength=strength, rounds=config.guidance_rounds)
    noise = how.start(graph.num_nodes, 8, model.device)
    vectors = replace(how, known=known).denoised(predict, noise, config, temperatures(config, noise))
    boxes = Boxes.decode(vectors, scale)
    boxes = Boxes(clipped(boxes.size, 0.01, 20.0), boxes.position, boxes.yaw)
    if strength:
        boxes = mended(plan, boxes, strength=strength, rounds=AFTER, fixed=how.known_mask)
    boxes = settled(plan, boxes, how.known_mask)
    if how.known is None or how.known_mask is None:
        return boxes
    return boxes.replaced(how.known_mask, how.known)


def with_whole_styles(graph: GraphBatch, groups: Array) -> GraphBatch:
    """The graph with every two nodes of one group told to be of one style: who is like my like is like me.

    `groups`: (N,) int64, number of each node's style group in [0, N).
    """
    alike = (groups[:, None] == groups) & (graph.scene[:, None] == graph.scene)
    subject, target = pairs_in(alike & beside(~np.eye(len(groups), dtype=bool), groups))
    same = kit(subject).full_like(subject, vocabulary().predicate_id("same_style_as"))
    same_style = kit(subject).stack([subject, same, target], 1)
    return graph.with_triplets(kit(same_style).concat([graph.triplets, same_style]))


@without_slopes
def sample_descriptions(
    model: Model, graph: GraphBatch, size: Array, latent: Array, equal: Array, noise: Array,
    how: CompactSampling,
) -> Array:  # fmt: skip
    """Descriptions (N, D) of all pieces of S scenes.

    Arguments:
        graph: S scenes, N nodes. size: (N, 3) float32, metres.
        latent: (N, latent width), of the graph.
        equal: (N,) int64, number of each piece's group in [0, N); a group agrees on one description.
        noise: (N, D) starting noise. how: to sample.
    """
    context = model.furniture.context(graph, size, pairs_of(graph, model.config.predicates), latent)

    def predict(x: Array, level: Array) -> Array:
        return model.furniture(x, level, context)

    return how.denoised(agreeing(predict, equal), noise, model.config.furniture)
