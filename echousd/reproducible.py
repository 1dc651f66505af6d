"""Same bytes on every machine of a kind: one thread where a sum's order shows, and numbers rounded between stages.

A sum that is split among threads is rounded differently for every number of them, and one bit of a box is enough to
give another mesh. So the networks run on one thread, and each stage hands on numbers that are coarser than that noise.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np
import torch

from echomodel.boxes import Boxes

if TYPE_CHECKING:
    from echousd.graph import SceneGraph

LENGTH = 1e-4  # metres
ANGLE = 0.01  # degrees
DISTANCE = 1e-4  # of a signed distance on the normalised grid
TOLD = 1e-4  # of a number that describes a piece of furniture


@contextmanager
def one_thread() -> Iterator[None]:
    """Run torch on one thread inside the block, whatever the machine or the environment offers."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def rounded_boxes(graph: SceneGraph, boxes: Boxes) -> Boxes:
    """The boxes in tenths of a millimetre and hundredths of a degree; what the graph fixes stays exactly as given."""
    turn = np.deg2rad(_round(np.rad2deg(np.asarray(boxes.yaw, float)), ANGLE))
    size = np.maximum(_round(np.asarray(boxes.size, float), LENGTH), LENGTH)
    position = _round(np.asarray(boxes.position, float), LENGTH)
    for i, node in enumerate(graph.nodes):
        size[i] = size[i] if node.size is None else node.size
        position[i] = position[i] if node.position is None else node.position
        turn[i] = turn[i] if node.yaw is None else node.yaw
    return Boxes(*(torch.as_tensor(v, dtype=torch.float32) for v in (size, position, turn)))


def rounded_grids(grids: np.ndarray) -> np.ndarray:
    """(n, d, d, d) float32 signed distances in steps of `DISTANCE`."""
    return _round(np.asarray(grids, float), DISTANCE).astype(np.float32)


def rounded_descriptions(told: np.ndarray) -> np.ndarray:
    """(n, d) float32 descriptions of furniture in steps of `TOLD`."""
    return _round(np.asarray(told, float), TOLD).astype(np.float32)


def _round(values: np.ndarray, step: float) -> np.ndarray:
    return np.round(values / step) * step + 0.0
