"""Rule of scale: nothing is larger or smaller than such furniture comes."""

from __future__ import annotations

from functools import cache

import torch

from echomodel.rules.living.found import Found, found
from echomodel.rules.living.plan import Plan

LARGEST, SMALLEST = 1.2, 0.5  # times the 95th and 5th percentile of the class: 97 % of real pieces lie between
AXES = ("wide", "high", "deep")


@cache
def size_range(category: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Smallest and largest side lengths x, y, z in metres that a person takes for one of the category."""
    from echomodel.data.furniture.sizes import size_statistics

    table = size_statistics(category)
    return tuple((table.low * SMALLEST).tolist()), tuple((table.high * LARGEST).tolist())


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
