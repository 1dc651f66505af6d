"""Rule of scale: nothing is larger or smaller than such furniture comes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
import torch

from echomodel.rules.living.found import Found, found
from echomodel.rules.living.plan import Plan, kind_of

LARGEST, SMALLEST = 1.2, 0.5  # times the 95th and 5th percentile of the class: 97 % of real pieces lie between
USUAL = 0.6  # power of the ratio of the 5th and 95th percentile to the median


@cache
def size_range(category: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Smallest and largest side lengths x, y, z in metres that a person takes for one of the category."""
    from echomodel.data.furniture.sizes import size_statistics

    table = size_statistics(category)
    return tuple((table.low * SMALLEST).tolist()), tuple((table.high * LARGEST).tolist())


def usual_sizes(categories: Sequence[str], size: np.ndarray, *, lenient: np.ndarray) -> np.ndarray:
    """(n, 3) float: sizes brought into what most of their kind have; words outside the vocabulary keep theirs.

    Arguments:
        categories: n words. size: (n, 3) float, metres.
        lenient: (n,) bool, boxes that are only brought into what the rule of scale allows.
    """
    from echomodel.data.furniture.sizes import size_statistics

    out = size.copy()
    for number, word in enumerate(categories):
        if not kind_of(word).name:
            continue
        low, high = (np.array(side) for side in size_range(word))
        if not lenient[number]:
            table = size_statistics(word)
            low, high = (table.median * (end / table.median) ** USUAL for end in (table.low, table.high))
        out[number] = np.clip(size[number], low, high)
    return out


def scale(plan: Plan) -> Found:
    """A piece has the size of its kind; boards and seats may be turned by a quarter."""
    known = [number for number, kind in enumerate(plan.kinds) if kind.name]
    who = torch.tensor(known, dtype=torch.int64)
    ranges = [size_range(plan.kinds[number].name) for number in known]
    low = plan.numbers([r[0] for r in ranges]).reshape(-1, 3)
    high = plan.numbers([r[1] for r in ranges]).reshape(-1, 3)
    size = plan.size[who].clamp_min(1e-3)
    margin = torch.minimum((size / low).log(), (high / size).log())
    least, axis = margin.min(1)
    return found(who, least, measure=size.gather(1, axis[:, None])[:, 0], words=axis)
