"""The margins of the relations of a graph with their gradients in closed form, one pass per family of predicates.

These are the margins of `echomodel.rules` (a test compares both, values and gradients); written out for numpy because
the automatic gradients of many small tensors took most of the time of a repair.
"""

from __future__ import annotations

import numpy as np

from echousd.repair.footprints import (
    FIRST,
    SECOND,
    Pairs,
    Values,
    centre_inside,
    corner_distance,
    mirror_distance,
    overlap_ratio,
    pairs_of,
    penetration,
)
from echousd.repair.geometry import spread


def relation_margins(
    size: np.ndarray, position: np.ndarray, yaw: np.ndarray, triplets: np.ndarray, *, rules: str, centre: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The margins of the relations and their gradients; 0 where the rules do not measure the predicate.

    Arguments:
        size, position: (n, 3) float, metres; yaw: (n,) float, radians; triplets: (e, 3) int.
        rules: `strict` or `sgfront`; centre: (2,) float, x and z of the room's centre.

    Returns: margins (e,) float and gradient (e, n, 6) float in the columns of `geometry`.
    """
    from echomodel.rules import sets

    chosen = sets.rule_set(rules)
    strict = chosen is sets.STRICT
    families = {
        (sets.LEFT, sets.RIGHT, sets.FRONT, sets.BEHIND): _beside,
        (sets.CLOSE,): _close,
        (sets.ABOVE,): _above,
        (sets.ON,): _standing_on,
        (sets.BIGGER, sets.SMALLER): _volumes,
        (sets.TALLER, sets.SHORTER): _tops,
        (sets.SYMMETRICAL,): _symmetrical,
    }
    ends, predicate = triplets[:, [0, 2]], triplets[:, 1]
    every = pairs_of(size, position - (centre[0], 0.0, centre[1]), yaw, ends, oriented=chosen.oriented)
    value, gradient = np.zeros(len(triplets)), every.zeros()
    for family, margin in families.items():
        rows = np.flatnonzero(np.isin(predicate, [word for word in family if word in chosen.margins]))
        if len(rows):
            value[rows], gradient[rows] = margin(every.take(rows), predicate[rows], strict)
    return value, spread(gradient, ends, len(size))


def _smaller(one: Values, two: Values) -> Values:
    first = one[0] <= two[0]
    return np.where(first, one[0], two[0]), np.where(first[:, None, None], one[1], two[1])


def _beside(pair: Pairs, predicate: np.ndarray, strict: bool) -> Values:
    """On the side that is asked for and not running into the object."""
    from echomodel.rules.sets import APART, BEHIND, FRONT, LEFT, OVERLAP

    r = np.arange(len(pair))
    by_x = np.isin(predicate, (FRONT, BEHIND))
    sign = np.where(np.isin(predicate, (LEFT, BEHIND)), -1.0, 1.0)
    gradient = pair.zeros()
    gradient[r, FIRST, np.where(by_x, 0, 2)] = sign
    gradient[r, SECOND, np.where(by_x, 0, 2)] = -sign
    along = sign * np.where(by_x, *pair.flat().T)
    ratio, by_box = overlap_ratio(pair)
    return _smaller((along - np.where(by_x & (not strict), -APART, APART), gradient), (OVERLAP - ratio, -by_box))


def _close(pair: Pairs, predicate: np.ndarray, strict: bool) -> Values:
    from echomodel.rules.sets import NEAR

    distance, gradient = corner_distance(pair)
    return NEAR - distance, -gradient


def _symmetrical(pair: Pairs, predicate: np.ndarray, strict: bool) -> Values:
    from echomodel.rules.sets import NEAR

    distance, gradient = mirror_distance(pair, point=not strict)
    return NEAR - distance, -gradient


def _above(pair: Pairs, predicate: np.ndarray, strict: bool) -> Values:
    from echomodel.rules.sets import TOUCH

    value, gradient = _rise(pair, to_top=True)
    return _smaller((value - TOUCH, gradient), penetration(pair))


def _standing_on(pair: Pairs, predicate: np.ndarray, strict: bool) -> Values:
    from echomodel.rules.sets import TOUCH

    value, gradient = _rise(pair, to_top=strict)
    level = TOUCH - np.abs(value), -np.sign(value)[:, None, None] * gradient
    return _smaller(level, centre_inside(pair)) if strict else level


def _rise(pair: Pairs, *, to_top: bool) -> Values:
    """Height of the subject's bottom over the object's top, or over its bottom."""
    gradient = pair.zeros()
    gradient[:, FIRST, 1], gradient[:, SECOND, 1] = 1.0, -1.0
    if to_top:
        gradient[:, SECOND, 4] = -pair.size[:, SECOND, 1]
    return pair.position[:, FIRST, 1] - (pair.top() if to_top else pair.position[..., 1])[:, SECOND], gradient


def _volumes(pair: Pairs, predicate: np.ndarray, strict: bool) -> Values:
    from echomodel.rules.sets import BIGGER, VOLUME

    volume, gradient = pair.size.prod(-1), pair.zeros()
    gradient[:, :, 3:] = volume[..., None]
    return _larger(volume, gradient, predicate == BIGGER, VOLUME, strict)


def _tops(pair: Pairs, predicate: np.ndarray, strict: bool) -> Values:
    from echomodel.rules.sets import HEIGHT, TALLER

    gradient = pair.zeros()
    gradient[..., 1], gradient[..., 4] = 1.0, pair.size[..., 1]
    return _larger(pair.top(), gradient, predicate == TALLER, HEIGHT, strict)


def _larger(quantity: np.ndarray, gradient: np.ndarray, more: np.ndarray, needed: float, strict: bool) -> Values:
    """How much more (or less) the subject has of a quantity than the object: (s - o) / larger, as published / s."""
    s, o = quantity.T
    by = np.where(s >= o, FIRST, SECOND) if strict else np.full(len(s), FIRST)
    base = quantity[np.arange(len(s)), by]
    base = np.maximum(base, 1e-6) if strict else np.where(np.abs(base) < 1e-12, 1e-12, base)
    ratio, sign = (s - o) / base, np.where(more, 1.0, -1.0)
    weight = np.stack((1.0 - ratio * (by == FIRST), -1.0 - ratio * (by == SECOND)), 1)
    return sign * ratio - needed, (sign / base)[:, None, None] * (weight[..., None] * gradient)
