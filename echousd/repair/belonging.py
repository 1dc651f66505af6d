"""Which things may share space and what things rest on: one set of rules for the repair and for the check."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from echomodel.vocabulary import vocabulary


def _kinds(words: str) -> frozenset[str]:
    return frozenset(words.split())


SEATS = _kinds(
    "armchair bar_stool bench chair chinese_chair dining_chair dressing_chair lounge_chair office_chair ottoman stool"
)
TABLES = _kinds("console_table corner_side_table desk dining_table dressing_table side_table table")
BEDS = _kinds("double_bed kids_bed single_bed")

# Furniture that stands with its back to a wall in at least four of five real rooms.
WALL_FURNITURE = BEDS | _kinds(
    "bookshelf cabinet children_cabinet console_table dresser dressing_table l_shaped_sofa loveseat_sofa "
    "multi_seat_sofa nightstand shelf sideboard sofa tv_stand wardrobe wine_cabinet"
)

# What can carry a lamp, a television or a plant on its top.
CARRIERS = TABLES | _kinds(
    "bookshelf cabinet children_cabinet coffee_table dresser nightstand round_end_table shelf sideboard tv_stand "
    "wine_cabinet"
)

# (one kind, other kind, share of the smaller horizontal side of the first kind that may overlap the second).
_EXCEPTIONS: tuple[tuple[frozenset[str], frozenset[str], float], ...] = (
    (SEATS, TABLES, 0.65),  # seats are tucked under tables and desks
    (_kinds("nightstand bench ottoman stool"), BEDS, 0.1),  # touch the bed, whose box includes its cover
    (_kinds("coffee_table ottoman stool"), _kinds("l_shaped_sofa"), 0.5),  # stand in the open corner of the L
)


def support(category: str) -> str:
    """What a category rests on: `floor`, `table`, `wall` or `ceiling`; an unknown word rests on the floor."""
    try:
        return vocabulary().category(category).support
    except ValueError:
        return "floor"


@cache
def shared_fraction(first: str, second: str) -> tuple[float, int]:
    """How far two categories may overlap, as (share, whose side it is a share of: 0 = first, 1 = second)."""
    for ones, others, share in _EXCEPTIONS:
        if first in ones and second in others:
            return share, 0
        if second in ones and first in others:
            return share, 1
    return 0.0, 0


def allowed_overlap(categories: Sequence[str], size: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Depth in metres to which each pair may overlap because the two belong together (0 for pairs that do not).

    Arguments:
        categories: n canonical category words.
        size: (n, 3) float, extents in metres.
        pairs: (p, 2) int, positions of the two objects.

    Returns: (p,) float.
    """
    if not len(pairs):
        return np.zeros(0)
    found = [shared_fraction(categories[i], categories[j]) for i, j in pairs.tolist()]
    share, owner = (np.array(column) for column in zip(*found, strict=True))
    side = size[pairs[np.arange(len(pairs)), owner]]
    return share * np.minimum(side[:, 0], side[:, 2])
