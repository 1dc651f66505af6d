"""EchoModel: the compact model behind two calls, boxes for a graph and shapes for its boxes."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from importlib import resources
from pathlib import Path

import torch
from torch import Tensor, nn

from echomodel.boxes import Boxes
from echomodel.compact.branches import branches
from echomodel.compact.furnishing import sample_descriptions, with_whole_styles
from echomodel.compact.given import Sampling, known_values, repeated, starting_noise
from echomodel.compact.layouts import LayoutSampling, sample_boxes
from echomodel.compact.learned import unlearned
from echomodel.compact.model import CompactModel, WeightsError, load_weights
from echomodel.compact.pairs import pairs_of
from echomodel.compact.predictors import agreeing, group_means, merit, shape_predictor
from echomodel.config import CompactConfig, Sampler
from echomodel.graph import GraphBatch
from echomodel.packed import pack_linear_maps
from echomodel.progress import StepListener, part_of
from echomodel.protocols import GraphEdit, touched_nodes
from echomodel.randomness import Randomness
from echomodel.samplers import Predict, guided
from echomodel.vocabulary import vocabulary

TOGETHER = 256  # objects that are denoised at a time when several draws are made: larger products, bounded memory
# Steps of what one stage hands to the next, coarser than the noise of sums in another order: equal bytes follow.
LATER = ("autoencoder", "shape")  # shipped parts that few rooms need: three quarters of the bytes
CODE, DISTANCE = 1e-3, 1e-4


class EchoModel:
    """Samples rooms with a `CompactModel`; equal arguments and generator state give equal results on one device.

    Arguments:
        model: the model, in evaluation mode.
        hash: short hash of the weights it came from.
        packed: on a CPU, lay the shape denoiser's linear maps out for oneDNN, equal but for rounding and 1.5 times as
            fast (`benchmarks/inference_modes.py`); do not train the model on then.
        half_decode: decode shapes in bfloat16, which is faster where the processor has it (AVX-512 BF16, AMX) and
            slower elsewhere.
    """

    def __init__(self, model: CompactModel, hash: str = "", *, packed: bool = True, half_decode: bool = False) -> None:
        self.model, self.hash, self.half_decode = model.eval(), hash, half_decode
        if packed and "shape" in model.parts and self.device.type == "cpu":
            if "shape" in model.later:
                model.later["shape"] = partial(_packed, model.later["shape"])
            else:
                pack_linear_maps(model.shape)

    @classmethod
    def load(
        cls, path: str | Path | None = None, *, device: torch.device | str = "cpu", half_decode: bool = False
    ) -> EchoModel:
        """Load the weights that ship with the package, a weights file, or a folder of weights files.

        Arguments:
            path: file or folder, None = the shipped weights. device: where to. half_decode: as in the class.

        Raises:
            WeightsError: there are none, or they are damaged or do not belong together.
        """
        source = Path(str(resources.files("echomodel") / "weights")) if path is None else Path(path)
        files = sorted(source.glob("*.safetensors")) if source.is_dir() else [source]
        if path is not None and not files:
            raise WeightsError(f"{source}: holds no weights files (.safetensors)")
        return cls(*load_weights(files, device, LATER if path is None else ()), half_decode=half_decode)

    @property
    def preset(self) -> str:
        """`compact`: how this model's preset is called."""
        return "compact"

    @property
    def branches(self) -> frozenset[str]:
        """What can be sampled with these weights: `layout`, `shape`, `furniture`."""
        return branches(self.model.parts)

    @property
    def description_width(self) -> int:
        """Numbers in a description of a piece of furniture."""
        return sum(self.config.furniture.kinds) + self.config.furniture.numbers

    @property
    def config(self) -> CompactConfig:
        """Sizes, objectives and default steps."""
        return self.model.config

    @property
    def device(self) -> torch.device:
        """Where the weights are."""
        return self.model.device

    @torch.no_grad()
    def sample_layout(
        self,
        graph: GraphBatch,
        *,
        generator: Randomness,
        steps: int | None = None,
        sampler: Sampler | None = None,
        known: Boxes | None = None,
        known_mask: Tensor | None = None,
        edit: GraphEdit | None = None,
        rules: str = "strict",
        guidance: float = 1.0,
        relation_guidance: float | None = None,
        noise: Tensor | None = None,
        progress: StepListener | None = None,
    ) -> Boxes:
        """Boxes for all objects of S scenes (EchoScene 3.3), in the room frame of `Boxes`.

        Arguments:
            graph: S scenes, N nodes.
            generator: source of all randomness, or one a scene.
            steps, sampler: None = the config's.
            known, known_mask: N boxes and (N,) bool; where true the box is given and comes back unchanged.
            edit: what was changed in the graph, None = nothing.
            rules: the rule set that the relations are meant in, `strict` or `sgfront`.
            guidance: scale of classifier-free guidance towards the relations, 1 = off.
            relation_guidance: strength of the pull of the rules' margins on the denoised boxes at every step, 0 = off,
                None = the config's.
            noise: (N, 8) starting noise in place of the generator's.
            progress: called with (steps done, steps).

        Returns:
            N boxes; sizes are positive.

        Raises:
            ValueError: a graph, box or argument that the model cannot work with; the message names it.
        """
        graph = self._checked(graph)
        known, known_mask = known_values(graph, known, known_mask, self.device)
        by = Sampling(generator, steps, sampler, None, known_mask, guidance, progress)
        how = LayoutSampling(by, rules, known, edit, relation_guidance, noise)
        return sample_boxes(self.model, self.graph_latent, graph, how)

    @torch.no_grad()
    def graph_latent(self, graph: GraphBatch, edit: GraphEdit | None = None) -> Tensor:
        """Latent nodes (N, latent width) that both branches read; `edit` routes them through the manipulator's edit."""
        pairs = pairs_of(graph, self.config.predicates)
        if edit is None:
            return self.model.latent(graph.category, pairs)
        old = pairs_of(graph.with_triplets(edit.before.to(self.device)), self.config.predicates)
        added = edit.added.to(self.device)
        return self.model.latent(
            graph.category, pairs, before=old.without(~added, old.told), added=added, touched=touched_nodes(graph, edit)
        )

    def unlearned(self, graph: GraphBatch) -> tuple[str, ...]:
        """One sentence for every word of the graph that the weights do not know, and what becomes of it."""
        return unlearned(graph, self.config)

    @torch.no_grad()
    def sample_shapes(
        self,
        graph: GraphBatch,
        boxes: Boxes,
        *,
        generator: torch.Generator,
        steps: int | None = None,
        sampler: Sampler | None = None,
        known: Tensor | None = None,
        known_mask: Tensor | None = None,
        edit: GraphEdit | None = None,
        guidance: float = 1.0,
        noise: Tensor | None = None,
        candidates: int | None = None,
        progress: StepListener | None = None,
    ) -> Tensor:
        """Shapes for all objects of S scenes (EchoScene 3.4); objects of one class and style become equal.

        Arguments:
            graph: S scenes, N nodes.
            boxes: N boxes, whose sizes the shapes will fill.
            known, known_mask: (N, 64, 64, 64) signed distances and (N,) bool; where true the shape is given and comes
                back unchanged.
            noise: (N, K) starting noise in place of the generator's, taken as it is (no temperature, no candidates).
            candidates: draws per object, of which the most whole that bears what stands on it is kept (pieces of one
                class and style together).
            generator, steps, sampler, edit, guidance, progress: as for `sample_layout`.

        Returns:
            (N, 64, 64, 64) float32 truncated signed distances on the box-normalised grid, negative inside.

        Raises:
            ValueError: a graph, box, shape or argument that the model cannot work with; the message names it.
        """
        settings, coder = self.config.shape, self.model.autoencoder
        graph, boxes = self._checked(graph), self._of(graph, boxes)
        known, known_mask = known_values(graph, known, known_mask, self.device)
        given = None if known is None else self.model.shape.codes(coder.encode(known))
        equal = equal_furniture(graph)
        tries = 1 if noise is not None else candidates or settings.candidates
        width = max(1, min(tries, TOGETHER // graph.num_nodes))
        rounds = [min(width, tries - start) for start in range(0, tries, width)]
        grids, best = torch.empty(0), torch.empty(0)
        for number, count in enumerate(rounds):
            starts = [
                starting_noise((graph.num_nodes, settings.components), generator, noise, self.device)
                for _ in range(count)
            ]
            if noise is None:
                starts = [settings.temperature * x[equal] for x in starts]
            how = Sampling(
                generator, steps, sampler, repeated(given, count), repeated(known_mask, count), guidance,
                part_of(progress, number, len(rounds)),
            )  # fmt: skip
            predict = self._shape_predictor(graph, boxes.size, equal, edit, guidance, count)
            codes = how.denoised(predict, torch.cat(starts), settings)
            for draw in codes.chunk(count):
                drawn = self._decoded(draw)
                whole = group_means(merit(drawn, boxes, graph.triplets), equal) if tries > 1 else best
                if not len(grids):
                    grids, best = drawn, whole
                    continue
                better = whole > best
                grids, best = torch.where(better[:, None, None, None], drawn, grids), torch.maximum(best, whole)
        if known is None or known_mask is None:
            return grids
        return torch.where(known_mask[:, None, None, None], known, grids)

    @torch.no_grad()
    def reconstruct(self, grids: Tensor) -> Tensor:
        """Grids (N, 64, 64, 64) in [-1, 1] through the autoencoder and back."""
        if "autoencoder" not in self.model.parts:
            raise ValueError(f"the weights ({self.hash}) hold no autoencoder")
        coder = self.model.autoencoder
        return coder.decode(coder.encode(grids.to(self.device))).float()

    @torch.no_grad()
    def sample_furniture(
        self,
        graph: GraphBatch,
        boxes: Boxes,
        *,
        generator: torch.Generator,
        steps: int | None = None,
        sampler: Sampler | None = None,
        known: Tensor | None = None,
        known_mask: Tensor | None = None,
        styles: Tensor | None = None,
        edit: GraphEdit | None = None,
        guidance: float = 1.0,
        noise: Tensor | None = None,
        progress: StepListener | None = None,
    ) -> Tensor:
        """Descriptions of all pieces of furniture of S scenes (`echomodel.furniture.description`).

        Arguments:
            graph, boxes: N nodes and their boxes; only the sizes matter.
            known, known_mask: (N, D) descriptions and (N,) bool; where true a piece is given and comes back unchanged.
            styles: (N,) int64, nodes with one number of 0 or more are of one style, beside those that relations of
                style join; None = nothing is known of styles.
            noise: (N, D) starting noise in place of the generator's.
            generator, steps, sampler, edit, guidance, progress: as for `sample_layout`.

        Returns:
            (N, D) float32; pieces of one class that relations of style or material join are equal.

        Raises:
            ValueError: a graph, box or argument that the model cannot work with; the message names it.
        """
        settings = self.config.furniture
        graph, boxes = self._checked(graph), self._of(graph, boxes)
        known, known_mask = known_values(graph, known, known_mask, self.device)
        equal = equal_furniture(graph)
        start = starting_noise((graph.num_nodes, self.description_width), generator, noise, self.device)
        graph = with_whole_styles(graph, joined(graph, styles))
        bare = graph.with_triplets(graph.triplets[:0])
        return sample_descriptions(
            self.model, graph, boxes.size, self.graph_latent(graph, edit), equal,
            settings.temperature * start[equal] if noise is None else start,
            Sampling(generator, steps, sampler, known, known_mask, guidance, progress),
            bare_latent=None if guidance == 1.0 else self.graph_latent(bare),
        )  # fmt: skip

    def _shape_predictor(
        self, graph: GraphBatch, size: Tensor, equal: Tensor, edit: GraphEdit | None, guidance: float, count: int
    ) -> Predict:
        """The denoiser of `count` draws behind one another, each of all objects of the graph."""

        def of(one: GraphBatch, latent: Tensor) -> Predict:
            many = GraphBatch.pack([one] * count)
            pairs = pairs_of(many, self.config.predicates)
            return shape_predictor(self.model, many, size.repeat(count, 1), pairs, latent.repeat(count, 1))

        predict = of(graph, self.graph_latent(graph, edit))
        if guidance != 1.0:
            bare = graph.with_triplets(graph.triplets[:0])
            predict = guided(predict, of(bare, self.graph_latent(bare)), guidance)
        first = torch.arange(count, device=equal.device).repeat_interleave(len(equal)) * len(equal)
        return agreeing(predict, equal.repeat(count) + first)

    def _decoded(self, codes: Tensor) -> Tensor:
        """Signed distances (N, 64, 64, 64) float32 of codes, a few objects at a time; both are rounded."""
        latents, decode = self.model.shape.latents, self.model.autoencoder.decode
        with torch.autocast(self.device.type, torch.bfloat16) if self.half_decode else nullcontext():
            grids = torch.cat([decode(latents(part)).float() for part in _rounded(codes, CODE).split(4)])
        return _rounded(grids, DISTANCE)

    def _checked(self, graph: GraphBatch) -> GraphBatch:
        graph.check()
        return graph.to(self.device)

    def _of(self, graph: GraphBatch, boxes: Boxes) -> Boxes:
        if len(boxes) != graph.num_nodes:
            raise ValueError(f"{len(boxes)} boxes for a graph of {graph.num_nodes} nodes, expected one each")
        boxes = boxes.to(self.device)
        boxes.check()
        return boxes


def _rounded(values: Tensor, step: float) -> Tensor:
    return (values / step).round() * step


def _packed(read: Callable[[], nn.Module]) -> nn.Module:
    module = read()
    pack_linear_maps(module)
    return module


def equal_furniture(graph: GraphBatch) -> Tensor:
    """(N,) int64: for every node the first node of its class that relations of style or material join it to."""
    triplets = graph.triplets
    joins = torch.isin(triplets[:, 1], triplets.new_tensor(vocabulary().uniting("shape")))
    joins &= graph.category[triplets[:, 0]] == graph.category[triplets[:, 2]]
    return _first_joined(graph.num_nodes, triplets[joins][:, [0, 2]])


def joined(graph: GraphBatch, styles: Tensor | None = None) -> Tensor:
    """(N,) int64: for every node the first node of its style, by relations of style and by `styles` (N,), -1 = none."""
    triplets = graph.triplets
    ends = triplets[torch.isin(triplets[:, 1], triplets.new_tensor(vocabulary().uniting("style")))][:, [0, 2]]
    if styles is not None:
        styles = styles.to(triplets.device)
        same = (styles[:, None] == styles) & (graph.scene[:, None] == graph.scene) & (styles >= 0)
        ends = torch.cat([ends, same.nonzero()])
    return _first_joined(graph.num_nodes, ends)


def _first_joined(nodes: int, ends: Tensor) -> Tensor:
    """(N,) int64: for every node the first that a chain of the pairs `ends` (E, 2) joins it to."""
    first = torch.arange(nodes, device=ends.device)
    while len(ends):
        lowest = first[ends].amin(1)
        lower = first.scatter_reduce(0, ends.flatten(), lowest.repeat_interleave(2), "amin")
        if torch.equal(lower, first):
            break
        first = lower
    return first
