"""Whether a piece of furniture holds together: which of its solids touch nothing, told from their own distances."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from echomodel.data.furniture.solids import Solid
from echomodel.data.furniture.touching import group_of


def loose_solids(solids: Sequence[Solid]) -> list[int]:
    """Numbers of the solids that no chain of touching solids joins to the largest body of the piece.

    Arguments:
        solids: of a furniture program, metres; cores do not count.
    """
    seen = [number for number, solid in enumerate(solids) if not solid.core]
    group, main = group_of([solids[number] for number in seen])
    return [seen[number] for number in np.flatnonzero(group != main)]
