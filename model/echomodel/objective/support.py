"""What each piece of furniture rests on, and which may share space because they belong together."""

from collections.abc import Sequence

import numpy as np

from echomodel.arrays import Array, at_least, kit
from echomodel.boxes2d import seen
from echomodel.vocabulary import Category, vocabulary

ON_FLOOR, ON_CEILING, FREE = -1, -2, -3
CARRIER_REACH = 0.5  # metres: a lamp or television further from every carrier stands on the floor
LIFTED = 0.3  # metres: what begins higher and hangs by habit hangs


def carriers(
    kinds: Sequence[Category], size: np.ndarray, position: np.ndarray, yaw: np.ndarray, triplets: np.ndarray
) -> np.ndarray:
    """What each object stands on: as the relations say, else the nearest carrier for what rests on tables.

    Arguments:
        kinds: n rows of the vocabulary. size, position: (n, 3) float, metres; yaw: (n,) float, radians.
        triplets: (e, 3) int, [subject, predicate id, object].

    Returns: (n,) int, the carrier of each, `ON_FLOOR`, `ON_CEILING` or `FREE`; never a cycle.
    """
    n = len(kinds)
    out = np.array([{"floor": ON_FLOOR, "ceiling": ON_CEILING}.get(kind.support, FREE) for kind in kinds], int)
    resting = [predicate.id for predicate in vocabulary().predicates if predicate.rests]
    for subject, _, target in triplets[np.isin(triplets[:, 1], resting)]:
        if subject != target and not _reaches(out, int(target), int(subject)):
            out[subject] = target
    for i in range(n):
        if kinds[i].support != "table" or out[i] >= 0:
            continue
        away = (position[i] - position)[:, [0, 2]]
        local = np.abs(seen(away, yaw)) - 0.5 * size[:, [0, 2]]
        distance = np.linalg.norm(np.maximum(local, 0.0), axis=1) + 1e-3 * np.hypot(*away.T)
        for k in range(n):
            if k == i or not kinds[k].carries or _reaches(out, k, i):
                distance[k] = np.inf
        best = int(distance.argmin())
        if distance[best] < CARRIER_REACH:
            out[i] = best
        else:
            out[i] = FREE if position[i, 1] > LIFTED and kinds[i].hangs else ON_FLOOR
    return out


def _reaches(carrier: np.ndarray, start: int, goal: int) -> bool:
    while start >= 0:
        if start == goal:
            return True
        start = int(carrier[start])
    return False


def stacked(size: Array, position: Array, carrier: Array, ceiling: Array | float) -> Array:
    """(n, 3) positions with the bottoms on the floor, on what carries them or at the ceiling, else where they are.

    `carrier`: (n,) int, of `carriers`. `ceiling`: metres, NaN = unknown.
    """
    xp, high, out = kit(position), size[:, 1], position[:, 1]
    out = xp.where(carrier == ON_FLOOR, 0.0, out)
    out = xp.where((carrier == ON_CEILING) & xp.isfinite(ceiling), ceiling - high, out)
    for _ in range(len(out)):  # at most so many stand on one another
        on = xp.where(carrier >= 0, (out + high)[at_least(carrier, 0)], out)
        if (on == out).all():
            break
        out = on
    return xp.stack([position[:, 0], out, position[:, 2]], 1)


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
    words, kind = np.unique(categories, return_inverse=True)
    rows = [vocabulary().category(word) for word in words.tolist()]
    shares = np.array([[shared_fraction(one, other) for other in rows] for one in rows])
    share, owner = np.moveaxis(shares[kind[pairs[:, 0]], kind[pairs[:, 1]]], -1, 0)
    side = size[pairs[np.arange(len(pairs)), owner.astype(int)]]
    return share * np.minimum(side[:, 0], side[:, 2])
