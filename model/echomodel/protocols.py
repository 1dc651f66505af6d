"""What every model of rooms can do, whatever its preset: the pipeline, edits and scores know no more of it."""

from typing import Any, Protocol

from echomodel.arrays import Array
from echomodel.boxes import Boxes
from echomodel.graph import GraphBatch


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
        """What can be sampled: `layout`, `shape`, `furniture`."""

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

    def sample_furniture(self, graph: GraphBatch, boxes: Boxes, **how: Any) -> Array:
        """Descriptions (N, D) float32 of N pieces of furniture.

        Arguments as for `sample_layout`. Raises ValueError for a model without a furniture branch.
        """
