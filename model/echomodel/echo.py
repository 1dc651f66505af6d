"""EchoModel: the compact model behind two calls, boxes for a graph and shapes for its boxes."""

from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from echomodel.arrays import Array, beside, on_device, without_slopes
from echomodel.boxes import Boxes
from echomodel.compact.learned import unlearned
from echomodel.compact.pairs import pairs_of
from echomodel.compact.sampling import (
    CompactSampling,
    Model,
    known_values,
    sample_boxes,
    sample_descriptions,
    with_whole_styles,
)
from echomodel.compact.weights import WeightsError, branches
from echomodel.config import CompactConfig
from echomodel.files import SHIPPED
from echomodel.graph import GraphBatch, GraphEdit
from echomodel.late import Late
from echomodel.triangles import firsts
from echomodel.vocabulary import vocabulary

CHECKPOINT = "checkpoint.safetensors"  # beside the weights in the folder of a training
load_weights, load_plain = Late("echomodel.compact.model:load_weights"), Late("echomodel.compact.plain:load_plain")
sample_shapes = Late("echomodel.compact.shape:sample_shapes")


class EchoModel:
    """Samples rooms with a compact model; equal arguments and generator state give equal results on one device.

    Arguments:
        model: the model, of torch in evaluation mode or of numpy; graphs and what is known may be of either, what
            is sampled is of its own.
        hash: short hash of the weights it came from.
    """

    preset = "compact"  # how this model's preset is called

    def __init__(self, model: Model, hash: str = "") -> None:
        self.model: Any = model if model.device is None else model.eval()
        self.hash = hash

    @classmethod
    def load(cls, path: str | Path | None = None, *, device: Any = "cpu") -> "EchoModel":
        """Load the weights that ship with the package, a weights file, a folder of such, or that of a training.

        Arguments:
            path: file or folder, None = the shipped weights.
            device: where to; None = the shipped weights as arrays of numpy.

        Raises WeightsError where there are none, or they are damaged or do not belong together.
        """
        source = SHIPPED if path is None else Path(path)
        files = [source]
        if source.is_dir():
            files = sorted(file for file in source.glob("*.safetensors") if file.name != CHECKPOINT)
        if path is not None and not files:
            raise WeightsError(f"{source}: holds no weights files (.safetensors)")
        return cls(*(load_plain(files) if device is None and path is None else load_weights(files, device)))

    @cached_property
    def in_torch(self) -> "EchoModel":
        """The same weights as modules of torch, which shapes need."""
        return EchoModel.load() if self.device is None else self

    @property
    def branches(self) -> frozenset[str]:
        """What can be sampled with these weights: `layout`, `shape`, `furniture`."""
        return branches(self.model.parts)

    @property
    def config(self) -> CompactConfig:
        """Sizes, objectives and default steps."""
        return self.model.config

    @property
    def device(self) -> Any:
        """Where the weights are; None = they are arrays of numpy."""
        return self.model.device

    @without_slopes
    def sample_layout(self, graph: GraphBatch, **how: Any) -> Boxes:
        """Boxes for all objects of S scenes (EchoScene 3.3), in the room frame of `Boxes`; sizes are positive.

        Arguments:
            graph: S scenes, N nodes. how: fields of `CompactSampling`.

        Raises ValueError for a graph, box or argument that the model cannot work with; the message names it.
        """
        graph = self._checked(graph, "layout")
        return sample_boxes(self.model, self.graph_latent, graph, self._how(graph, how))

    @without_slopes
    def graph_latent(self, graph: GraphBatch, edit: GraphEdit | None = None) -> Array:
        """Latent nodes (N, latent width) that both branches read; `edit` routes them through the manipulator's edit."""
        pairs = pairs_of(graph, self.config.predicates)
        if edit is None:
            return self.model.latent(graph.category, pairs)
        added = on_device(edit.added, self.device)
        old = pairs_of(graph.with_triplets(on_device(edit.before, self.device)), self.config.predicates)
        old = old.without(~added, old.stated)
        return self.model.latent(graph.category, pairs, before=old, added=added, touched=edit.touched(graph))

    def unlearned(self, graph: GraphBatch) -> tuple[str, ...]:
        """One sentence for every word of the graph that the weights do not know, and what becomes of it."""
        return unlearned(graph, self.config)

    def sample_shapes(self, graph: GraphBatch, boxes: Boxes, **how: Any) -> Array:
        """Shapes for all objects of S scenes (EchoScene 3.4); objects of one class and style become equal.

        Arguments as for `sample_layout`; the shapes will fill the sizes of the boxes.

        Returns (N, 64, 64, 64) float32 truncated signed distances on the box-normalised grid, negative inside.
        """
        own = self.in_torch
        graph, boxes = own._checked(graph, "shape"), own._of(graph, boxes)
        found = sample_shapes(own.model, own.graph_latent, graph, boxes, equal_furniture(graph), own._how(graph, how))
        return on_device(found, self.device)

    @without_slopes
    def sample_furniture(self, graph: GraphBatch, boxes: Boxes, **how: Any) -> Array:
        """Descriptions of all pieces of furniture of S scenes (`echomodel.furniture.style`).

        Arguments as for `sample_layout`; only the sizes of the boxes matter.

        Returns (N, D) float32; pieces of one class that relations of style or material join are equal.
        """
        graph, boxes = self._checked(graph, "furniture"), self._of(graph, boxes)
        by, equal = self._how(graph, how), equal_furniture(graph)
        own = self.config.furniture
        start = by.start(graph.num_nodes, sum(own.kinds) + own.numbers, self.device)
        graph = with_whole_styles(graph, joined(graph, by.styles))
        return sample_descriptions(
            self.model, graph, boxes.size, self.graph_latent(graph, by.edit), equal,
            start[equal] if by.noise is None else start, by,
        )  # fmt: skip

    def _how(self, graph: GraphBatch, options: dict[str, Any]) -> CompactSampling:
        """What a caller asks for, with what is known checked and on the model's device."""
        how = CompactSampling(**options)
        known, mask = known_values(graph, how.known, how.known_mask, self.device)
        return replace(how, known=known, known_mask=mask)

    def _checked(self, graph: GraphBatch, branch: str) -> GraphBatch:
        if branch not in self.branches:
            held = ", ".join(sorted(self.model.parts))
            raise ValueError(f"these weights hold {held}, this needs latent and {branch}; name others")
        graph.check()
        return graph.to(self.device)

    def _of(self, graph: GraphBatch, boxes: Boxes) -> Boxes:
        if len(boxes) != graph.num_nodes:
            raise ValueError(f"{len(boxes)} boxes for a graph of {graph.num_nodes} nodes, expected one each")
        boxes = boxes.to(self.device)
        boxes.check()
        return boxes


def equal_furniture(graph: GraphBatch) -> Array:
    """(N,) int64: for every node the first node of its class that relations of style or material join it to."""
    own = graph.to(None)
    joins = np.isin(own.triplets[:, 1], vocabulary().uniting("shape"))
    joins &= own.category[own.triplets[:, 0]] == own.category[own.triplets[:, 2]]
    return beside(firsts(own.triplets[joins][:, [0, 2]], own.num_nodes), graph.category)


def joined(graph: GraphBatch, styles: Array | None = None) -> Array:
    """(N,) int64: for every node the first node of its style, by relations of style and by `styles` (N,), -1 = none."""
    own = graph.to(None)
    ends = own.triplets[np.isin(own.triplets[:, 1], vocabulary().uniting("style"))][:, [0, 2]]
    if styles is not None:
        styles = on_device(styles, None)
        same = (styles[:, None] == styles) & (own.scene[:, None] == own.scene) & (styles >= 0)
        ends = np.concatenate([ends, np.argwhere(same)])
    return beside(firsts(ends, own.num_nodes), graph.category)
