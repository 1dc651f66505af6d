"""Lamps at the ceiling follow what they light when the solver moves it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from echomodel.objective.plan import kind_of
from echomodel.vocabulary import vocabulary
from echousd.place.distances import BED_LIT

OVER = 0.15  # metres between the middles of a lamp and of the table that it hangs over


def lamps_along(
    categories: Sequence[str], before: np.ndarray, after: np.ndarray, triplets: np.ndarray, fixed: np.ndarray
) -> np.ndarray:
    """(n, 3) float: the positions afterwards, lamps over what moved moved with it.

    Arguments:
        before, after: (n, 3) float, where the boxes stood when the lamps were hung, and where they stand now.
        triplets: (e, 3) int; a lamp that is told of anything else than what it hangs over stays.
        fixed: (n,) bool, boxes that must not move.
    """
    kinds, out = [kind_of(word) for word in categories], after.copy()
    above = vocabulary().predicate_id("above")
    lit = [j for j, kind in enumerate(kinds) if kind.support == "floor" and kind.role in ("board", "bed")]
    for i, kind in enumerate(kinds):
        if kind.support != "ceiling" or fixed[i] or not lit:
            continue
        off = np.hypot(*(before[lit] - before[i])[:, [0, 2]].T)
        j = lit[int(off.argmin())]
        ends = triplets[(triplets[:, [0, 2]] == i).any(1)][:, [0, 2]].ravel().tolist()
        told = [k for a, predicate, k in triplets.tolist() if a == i and predicate == above and k in lit]
        if len(told) == 1:  # perhaps in a row with others
            j = told[0]
        elif off.min() >= (BED_LIT.most if kinds[j].role == "bed" else OVER):
            continue
        if {*ends} <= {i, j}:
            out[i, [0, 2]] += (after[j] - before[j])[[0, 2]] - (after[i] - before[i])[[0, 2]]
    return out
