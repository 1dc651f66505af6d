"""What a graph says of the places of single objects, as constraints of placing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from echousd.place.geometry import COLUMNS

if TYPE_CHECKING:
    from echomodel.rules.placements import Spread, Stated, Walls
    from echousd.graph import SceneGraph


def stated_placements(graph: SceneGraph) -> tuple[Stated, ...]:
    """The placements of a graph by the numbers of its nodes, in the order of `SceneGraph.placements`."""
    from echomodel.rules.placements import Stated

    row = {name: i for i, name in enumerate(graph.names)}
    return tuple(
        Stated(one.placement, row[one.subject], tuple(row[name] for name in one.others)) for one in graph.placements
    )


def placement_rows(
    stated: Sequence[Stated],
    walls: Walls | None,
    categories: Sequence[str],
    size: np.ndarray,
    position: np.ndarray,
    yaw: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Margin (m,) float, metres, of every placement, and its gradient (m, n, 6) in the columns of `geometry`.

    Furniture moves for it, none grows or shrinks.

    Arguments:
        walls: of the room; None = what needs them is passed over (margin 0).
        categories: n words. size, position: (n, 3) float, metres; yaw: (n,) float, radians.
    """
    import torch

    from echomodel.rules.placements import margin_of

    n = len(size)
    value, gradient = np.zeros(len(stated)), np.zeros((len(stated), n, COLUMNS))
    for row, one in enumerate(stated):
        if walls is None and not one.others:
            continue
        at = torch.tensor(position, dtype=torch.float64, requires_grad=True)
        every = [_spread(size[i : i + 1], at[i : i + 1], yaw[i : i + 1]) for i in range(n)]
        margin = margin_of(one, every, walls, categories)
        (slope,) = torch.autograd.grad(margin.sum(), at)
        value[row], gradient[row, :, :3] = float(margin.detach()), slope.numpy()
    return value, gradient


def _spread(size: object, position: object, yaw: object) -> Spread:
    import torch

    from echomodel.rules.placements import Spread

    return Spread(*(torch.as_tensor(values, dtype=torch.float64) for values in (size, position, yaw)))
