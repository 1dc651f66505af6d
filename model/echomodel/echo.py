"""EchoModel: the compact model behind two calls, boxes for a graph and shapes for its boxes."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.compact.learned import unlearned
from echomodel.compact.model import CompactModel, WeightsError, branches, load_weights
from echomodel.compact.pairs import pairs_of
from echomodel.compact.sampling import (
    CompactSampling,
    known_values,
    sample_boxes,
    sample_descriptions,
    with_whole_styles,
)
from echomodel.config import CompactConfig
from echomodel.graph import GraphBatch
from echomodel.late import Late
from echomodel.protocols import GraphEdit, touched_nodes
from echomodel.vocabulary import vocabulary

CHECKPOINT = "checkpoint.safetensors"  # beside the weights in the folder of a training
LATER = ("autoencoder", "shape")  # shipped parts that few rooms need: three quarters of the bytes
sample_shapes, packed_shape = Late("echomodel.compact.shape:sample_shapes"), Late("echomodel.packed:packed")


class EchoModel:
    """Samples rooms with a `CompactModel`; equal arguments and generator state give equal results on one device.

    Arguments:
        model: the model, in evaluation mode.
        hash: short hash of the weights it came from.
        packed: on a CPU, lay the shape denoiser's linear maps out for oneDNN, equal but for rounding and 1.5 times as
            fast (`benchmarks/inference_modes.py`); do not train the model on then.
    """

    preset = "compact"  # how this model's preset is called

    def __init__(self, model: CompactModel, hash: str = "", *, packed: bool = True) -> None:
        self.model, self.hash = model.eval(), hash
        if packed and "shape" in model.parts and self.device.type == "cpu":
            if "shape" in model.later:
                model.later["shape"] = partial(packed_shape, model.later["shape"])
            else:
                packed_shape(lambda: model.shape)

    @classmethod
    def load(cls, path: str | Path | None = None, *, device: torch.device | str = "cpu") -> EchoModel:
        """Load the weights that ship with the package, a weights file, a folder of such, or that of a training.

        Arguments:
            path: file or folder, None = the shipped weights. device: where to.

        Raises WeightsError where there are none, or they are damaged or do not belong together.
        """
        source = Path(str(resources.files("echomodel") / "weights")) if path is None else Path(path)
        files = [source]
        if source.is_dir():
            files = sorted(file for file in source.glob("*.safetensors") if file.name != CHECKPOINT)
        if path is not None and not files:
            raise WeightsError(f"{source}: holds no weights files (.safetensors)")
        return cls(*load_weights(files, device, LATER if path is None else ()))

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
    def sample_layout(self, graph: GraphBatch, **how: Any) -> Boxes:
        """Boxes for all objects of S scenes (EchoScene 3.3), in the room frame of `Boxes`; sizes are positive.

        Arguments:
            graph: S scenes, N nodes. how: fields of `CompactSampling`.

        Raises ValueError for a graph, box or argument that the model cannot work with; the message names it.
        """
        graph = self._checked(graph)
        return sample_boxes(self.model, self.graph_latent, graph, self._how(graph, how))

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
    def sample_shapes(self, graph: GraphBatch, boxes: Boxes, **how: Any) -> Tensor:
        """Shapes for all objects of S scenes (EchoScene 3.4); objects of one class and style become equal.

        Arguments as for `sample_layout`; the shapes will fill the sizes of the boxes.

        Returns (N, 64, 64, 64) float32 truncated signed distances on the box-normalised grid, negative inside.
        """
        graph, boxes = self._checked(graph), self._of(graph, boxes)
        found: Tensor = sample_shapes(self.model, self.graph_latent, graph, boxes, equal_furniture(graph),
                                      self._how(graph, how))  # fmt: skip
        return found

    @torch.no_grad()
    def sample_furniture(self, graph: GraphBatch, boxes: Boxes, **how: Any) -> Tensor:
        """Descriptions of all pieces of furniture of S scenes (`echomodel.furniture.style`).

        Arguments as for `sample_layout`; only the sizes of the boxes matter.

        Returns (N, D) float32; pieces of one class that relations of style or material join are equal.
        """
        graph, boxes = self._checked(graph), self._of(graph, boxes)
        by, equal = self._how(graph, how), equal_furniture(graph)
        start = by.start(graph.num_nodes, self.description_width, self.device)
        graph = with_whole_styles(graph, joined(graph, by.styles))
        return sample_descriptions(
            self.model, graph, boxes.size, self.graph_latent(graph, by.edit), equal,
            self.config.furniture.temperature * start[equal] if by.noise is None else start, by,
        )  # fmt: skip

    def _how(self, graph: GraphBatch, told: dict[str, Any]) -> CompactSampling:
        """What a caller asks for, with what is known checked and on the model's device."""
        how = CompactSampling(**told)
        known, mask = known_values(graph, how.known, how.known_mask, self.device)
        return replace(how, known=known, known_mask=mask)

    def _checked(self, graph: GraphBatch) -> GraphBatch:
        graph.check()
        return graph.to(self.device)

    def _of(self, graph: GraphBatch, boxes: Boxes) -> Boxes:
        if len(boxes) != graph.num_nodes:
            raise ValueError(f"{len(boxes)} boxes for a graph of {graph.num_nodes} nodes, expected one each")
        boxes = boxes.to(self.device)
        boxes.check()
        return boxes


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
