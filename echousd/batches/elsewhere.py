"""A model whose shapes are sampled in another process, which has the device: a room asks, and is made with the answer.

A room's shapes depend on its repaired boxes, which its worker makes; the device's process samples them. What the two
say to one another are pickles of this run's own processes, and nothing of them is ever on a disk.
"""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import torch

if TYPE_CHECKING:
    from echomodel.boxes import Boxes
    from echomodel.graph import GraphBatch
    from echomodel.protocols import RoomModel

METHODS = ("sample_shapes", "sample_furniture")


class SamplesWanted(Exception):  # no error: the caller has them sampled and asks again
    """A room wants samples that its process does not draw; `call` is what `sampled` takes."""

    def __init__(self, call: bytes) -> None:
        super().__init__()
        self.call = call


class ElsewhereModel:
    """`RoomModel` with the samples of another process for shapes and furniture; all else is its own model's.

    Arguments:
        own: a model with the same weights in this process. answers: what `sampled` gave, call by call.
    """

    def __init__(self, own: RoomModel, answers: tuple[bytes, ...]) -> None:
        self._own = own
        self._answers: Iterator[bytes] = iter(answers)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._own, name)

    def sample_shapes(self, graph: GraphBatch, boxes: Boxes, **rest: Any) -> torch.Tensor:
        """As of the model; raises SamplesWanted."""
        return self._sampled("sample_shapes", graph, boxes, rest)

    def sample_furniture(self, graph: GraphBatch, boxes: Boxes, **rest: Any) -> torch.Tensor:
        """As of the model; raises SamplesWanted."""
        return self._sampled("sample_furniture", graph, boxes, rest)

    def _sampled(self, method: str, graph: GraphBatch, boxes: Boxes, rest: dict[str, Any]) -> torch.Tensor:
        answer = next(self._answers, None)
        if answer is None:
            state = rest.pop("generator").get_state()
            rest.pop("progress", None)
            raise SamplesWanted(pickle.dumps((method, graph, boxes, state, rest)))
        found = pickle.loads(answer)
        assert isinstance(found, torch.Tensor)
        return found


def sampled(model: RoomModel, call: bytes) -> bytes:
    """What a model samples for a call of `SamplesWanted`, for `ElsewhereModel`; raises what the model raises."""
    method, graph, boxes, state, rest = pickle.loads(call)
    if method not in METHODS:
        raise ValueError(f"{method!r:.40} is no call for samples, allowed: {', '.join(METHODS)}")
    generator = torch.Generator()
    generator.set_state(state)
    return pickle.dumps(getattr(model, method)(graph, boxes, generator=generator, **rest).cpu())
