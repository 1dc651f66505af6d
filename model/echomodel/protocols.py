"""What every model of rooms can do, whatever its preset: the pipeline, edits and scores know no more of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, TypeGuard

import torch
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.graph import GraphBatch
from echomodel.progress import StepListener


@dataclass(frozen=True, eq=False)
class GraphEdit:
    """How a graph came about by editing another one over the same nodes (EchoScene 3.2).

    Arguments:
        before: (E, 3) int64, the triplets before the edit.
        added: (N,) bool, nodes that were not there before; triplets of `before` do not touch them.
    """

    before: Tensor
    added: Tensor


def touched_nodes(graph: GraphBatch, edit: GraphEdit) -> Tensor:
    """(N,) bool: nodes that were added, and both ends of every triplet that came or went."""
    touched = edit.added.to(graph.category.device).clone()
    now, before = ({tuple(row) for row in triplets.tolist()} for triplets in (graph.triplets, edit.before))
    for subject, _, target in now ^ before:
        touched[subject] = True
        touched[target] = True
    return touched


class RoomModel(Protocol):
    """Boxes for a scene graph and, where it has the branch, shapes for the boxes."""

    @property
    def preset(self) -> str:
        """`compact`, `paper` or `released`."""
        ...

    @property
    def hash(self) -> str:
        """Short hash of the weights, empty for weights without a file."""
        ...

    @property
    def branches(self) -> frozenset[str]:
        """What can be sampled: `layout`, `shape` (`sample_shapes`), `furniture` (see `FurnitureModel`)."""
        ...

    def unlearned(self, graph: GraphBatch) -> tuple[str, ...]:
        """One sentence for every word of the graph that the weights do not know, and what becomes of it."""
        ...

    def sample_layout(
        self,
        graph: GraphBatch,
        *,
        generator: torch.Generator,
        steps: int | None = None,
        known: Boxes | None = None,
        known_mask: Tensor | None = None,
        edit: GraphEdit | None = None,
        progress: StepListener | None = None,
    ) -> Boxes:
        """Boxes of N objects in the frame of `Boxes`, the floor's middle at the origin (EchoScene 3.3).

        Arguments:
            graph: S scenes, N nodes.
            generator: source of all randomness.
            steps: sampling steps, None = the model's own; raises ValueError for more than there are.
            known, known_mask: N boxes and (N,) bool; where true the box is given and comes back unchanged.
            edit: what was changed in the graph, None = nothing.
            progress: called with (steps done, steps).
        """
        ...

    def sample_shapes(
        self,
        graph: GraphBatch,
        boxes: Boxes,
        *,
        generator: torch.Generator,
        steps: int | None = None,
        edit: GraphEdit | None = None,
        progress: StepListener | None = None,
    ) -> Tensor:
        """(N, R, R, R) float32 signed distances on the box-normalised grid, negative inside (EchoScene 3.4).

        Raises ValueError for a model without a shape branch.
        """
        ...

    def reconstruct(self, grids: Tensor) -> Tensor:
        """Grids (N, 64, 64, 64) float32 in [-1, 1] through the autoencoder and back; raises ValueError where it takes
        others."""
        ...


class FurnitureModel(RoomModel, Protocol):
    """A model of rooms that also describes furniture."""

    @property
    def description_width(self) -> int:
        """Numbers in a description."""
        ...

    def sample_furniture(
        self,
        graph: GraphBatch,
        boxes: Boxes,
        *,
        generator: torch.Generator,
        steps: int | None = None,
        known: Tensor | None = None,
        known_mask: Tensor | None = None,
        styles: Tensor | None = None,
        edit: GraphEdit | None = None,
        progress: StepListener | None = None,
    ) -> Tensor:
        """Descriptions (N, D) float32 of N pieces of furniture, see `EchoModel.sample_furniture`."""
        ...


def furnishes(model: RoomModel | None) -> TypeGuard[FurnitureModel]:
    """Whether there is a model and it describes furniture."""
    return model is not None and "furniture" in model.branches
