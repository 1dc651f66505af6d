"""What every model of rooms can do, whatever its preset: the pipeline, edits and scores know no more of it."""

from dataclasses import dataclass
from typing import Any, Protocol, TypeGuard

import numpy as np

from echomodel.arrays import Array, beside
from echomodel.boxes import Boxes
from echomodel.graph import GraphBatch
from echomodel.progress import StepListener
from echomodel.randomness import Randomness


@dataclass(frozen=True, eq=False)
class GraphEdit:
    """How a graph came about by editing another one over the same nodes (EchoScene 3.2).

    Arguments:
        before: (E, 3) int64, the triplets before the edit.
        added: (N,) bool, nodes that were not there before; triplets of `before` do not touch them.
    """

    before: Array
    added: Array


@dataclass(frozen=True, eq=False)
class Sampling:
    """How a model samples and what it is given: the keyword arguments of every `sample_...` of a `RoomModel`.

    Arguments:
        generator: source of all randomness, or one a scene.
        steps: of the sampler, None = the model's own; those that there are not raise ValueError.
        known, known_mask: what is sampled (boxes, distances or descriptions) of N nodes, and (N,) bool; where true it
            is given and comes back unchanged.
        edit: what was changed in the graph, None = nothing.
        progress: called with (steps done, steps).
    """

    generator: Randomness
    steps: int | None = None
    known: Any = None
    known_mask: Array | None = None
    edit: GraphEdit | None = None
    progress: StepListener | None = None


def touched_nodes(graph: GraphBatch, edit: GraphEdit) -> Array:
    """(N,) bool: nodes that were added, and both ends of every triplet that came or went."""
    touched = np.array(edit.added.tolist(), bool)
    now, before = ({tuple(row) for row in triplets.tolist()} for triplets in (graph.triplets, edit.before))
    for subject, _, target in now ^ before:
        touched[[subject, target]] = True
    return beside(touched, graph.category)


class RoomModel(Protocol):
    """Boxes for a scene graph and, where it has the branch, shapes for the boxes."""

    @property
    def preset(self) -> str:
        """`compact`, `paper` or `released`."""

    @property
    def hash(self) -> str:
        """Short hash of the weights, empty for weights without a file."""

    @property
    def branches(self) -> frozenset[str]:
        """What can be sampled: `layout`, `shape` (`sample_shapes`), `furniture` (see `FurnitureModel`)."""

    def unlearned(self, graph: GraphBatch) -> tuple[str, ...]:
        """One sentence for every word of the graph that the weights do not know, and what becomes of it."""

    def sample_layout(self, graph: GraphBatch, **how: Any) -> Boxes:
        """Boxes of N objects in the frame of `Boxes`, the floor's middle at the origin (EchoScene 3.3).

        Arguments:
            graph: S scenes, N nodes. how: fields of the model's `Sampling`.
        """

    def sample_shapes(self, graph: GraphBatch, boxes: Boxes, **how: Any) -> Array:
        """(N, R, R, R) float32 signed distances on the box-normalised grid, negative inside (EchoScene 3.4).

        Arguments as for `sample_layout`. Raises ValueError for a model without a shape branch.
        """


class FurnitureModel(RoomModel, Protocol):
    """A model of rooms that also describes furniture."""

    def sample_furniture(self, graph: GraphBatch, boxes: Boxes, **how: Any) -> Array:
        """Descriptions (N, D) float32 of N pieces of furniture; arguments as for `sample_layout`."""


def furnishes(model: RoomModel | None) -> TypeGuard[FurnitureModel]:
    """Whether there is a model and it describes furniture."""
    return model is not None and "furniture" in model.branches
