"""What a rule hands back: whom it looked at, by how much they keep it, and what a person is told."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True, eq=False)
class Found:
    """One rule at P boxes.

    Arguments:
        who: (P,) int64, the box that a fault is counted for. other: (P,) int64, what it is about, -1 = nothing.
        margin: (P,) float, metres, radians or a share; >= 0 iff the rule is kept.
        measure: (P,) float, the number that the sentence names. words: (P,) int64, which sentence of the rule's it is.
    """

    who: Tensor
    other: Tensor
    margin: Tensor
    measure: Tensor
    words: Tensor

    def take(self, rows: Tensor) -> Found:
        """Some of the rows, by number or mask."""
        return Found(self.who[rows], self.other[rows], self.margin[rows], self.measure[rows], self.words[rows])


def found(
    who: Tensor, margin: Tensor, *, other: Tensor | None = None, measure: Tensor | None = None,
    words: Tensor | None = None,
) -> Found:  # fmt: skip
    """A `Found` with what is left out filled in: nothing, the margin, the first sentence."""
    return Found(
        who,
        torch.full_like(who, -1) if other is None else other,
        margin,
        margin if measure is None else measure,
        torch.zeros_like(who) if words is None else words,
    )


def nobody(like: Tensor) -> Found:
    """A `Found` of a rule that looks at no box of a plan, with numbers like these."""
    none, nothing = torch.zeros(0, dtype=torch.int64), like.new_zeros(0)
    return Found(none, none, nothing, nothing, none)


def worst(who: Tensor, margin: Tensor, other: Tensor, count: int, nothing: float) -> tuple[Tensor, Tensor]:
    """Of the rows (P,) of each box the least margin (count,), `nothing` where it has none, and whom that is about."""
    least = margin.new_full((count,), nothing).scatter_reduce(0, who, margin, "amin")
    about = torch.full((count,), -1, dtype=torch.int64)
    hit = margin.detach() <= least.detach()[who]
    about[who[hit]] = other[hit]
    return least, about


def joined(first: Found, second: Found) -> Found:
    """The rows of both."""
    pairs = ((getattr(one, name) for one in (first, second)) for name in ("who", "other", "margin", "measure", "words"))
    return Found(*(torch.cat(list(pair)) for pair in pairs))
