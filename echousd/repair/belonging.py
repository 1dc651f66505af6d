"""Which things may share space because they belong together: one rule for the repair and for the check."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from echomodel.vocabulary import Category, vocabulary


def shared_fraction(first: Category, second: Category) -> tuple[float, int]:
    """How far two categories may overlap, as (share, whose side it is a share of: 0 = first, 1 = second)."""
    for guest, host, owner in ((first, second, 0), (second, first, 1)):
        for word, share in host.admits:
            if word in (guest.name, guest.role):
                return share, owner
    return 0.0, 0


def allowed_overlap(categories: Sequence[str], size: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Depth in metres to which each pair may overlap because the two belong together (0 for pairs that do not).

    Arguments:
        categories: n category words.
        size: (n, 3) float, extents in metres.
        pairs: (p, 2) int, positions of the two objects.

    Returns: (p,) float.

    Raises `UnknownWord` for a category that the vocabulary does not hold.
    """
    if not len(pairs):
        return np.zeros(0)
    words = [(categories[i], categories[j]) for i, j in pairs.tolist()]
    rows = {word: vocabulary().category(word) for word in {*categories}}
    shares = {(one, other): shared_fraction(rows[one], rows[other]) for one, other in {*words}}
    share, owner = (np.array(column) for column in zip(*(shares[pair] for pair in words), strict=True))
    side = size[pairs[np.arange(len(pairs)), owner]]
    return share * np.minimum(side[:, 0], side[:, 2])
