"""Margins and verdicts of given relations: how well boxes keep what a graph asks for."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from echomodel.arrays import Array, beside, cast, full, held, kit, put, rows
from echomodel.rules.geometry import BoxesLike, PairGeometry, Spread, pairs
from echomodel.rules.sets import RuleSet, rule_set
from echomodel.vocabulary import vocabulary


def floating(boxes: BoxesLike, dtype: Any = None) -> Spread:
    """Boxes as floating-point arrays of one type, of the library that theirs are of."""
    dtype = dtype or (boxes.size[:0] / 1).dtype
    every = (boxes.size, boxes.position, boxes.yaw)
    return Spread(*(of.astype(dtype) if isinstance(of, np.ndarray) else of.to(dtype) for of in every))


def measured(rules: str = "strict") -> frozenset[int]:
    """Ids of the predicates that the rules can measure on boxes; raises ValueError for an unknown set."""
    return frozenset(rule_set(rules).margins)


def margins(
    boxes: BoxesLike, triplets: Array, *, rules: str = "strict", center: Array | None = None,
    fronts: Array | None = None, rigid: bool = False,
) -> Array:  # fmt: skip
    """Signed margin of every relation, >= 0 iff it is satisfied; differentiable in size, position and yaw.

    Arguments:
        boxes: N boxes, `size (N, 3)` and `position (N, 3)` in metres, `yaw (N,)` in radians, float arrays.
        triplets: (E, 3) int64 [subject, predicate id, object], indices into the boxes.
        rules: `strict` or `sgfront`.
        center: (2,) float, x and z of the room's centre; default the origin. Only `symmetrical_to` asks.
        fronts: (N,) bool, boxes that have a front (`echomodel.rules.fronts`), whose headings `symmetrical_to` measures
            in the set `strict`, too; None = none.
        rigid: relations of place have no gradient in the sizes: furniture moves aside, it does not shrink.

    Returns (E,) float, in metres (sides, close by, standing on, above, symmetrical to) or as a ratio (sizes, overlap);
    0 where the rules do not measure the predicate. Never NaN or infinite for finite boxes.
    """
    own = floating(boxes)
    triplets, centre = beside(triplets, own.size), kit(own.size).zeros_like(own.position)
    if center is not None:
        centre[:, ::2] = beside(center, own.size)
    out = full(own.size, len(triplets), 0.0)
    headed = None if fronts is None else beside(fronts, own.size)
    placed = replace(own, size=held(own.size)) if rigid else own
    words, kinds, chosen = vocabulary().predicates, triplets[:, 1], rule_set(rules)
    there = {words[number].name: words[number] for number in sorted(set(kinds.tolist())) if 0 <= number < len(words)}
    for name, rule in chosen.rules.items():  # in their order, so that gradients add up in one
        if name in there and rule.margin is not None:
            at = rows(kinds == there[name].id)
            of = own if there[name].measures == "size" else placed  # all others are of place
            pair = pairs(of, triplets[at, 0], triplets[at, 2], centre, oriented=chosen.oriented, fronts=headed)
            out = put(out, at, rule.margin(pair))
    return out


def fronts(categories: Iterable[str]) -> np.ndarray:
    """(N,) bool, which of the categories have a front; words that the vocabulary does not hold have none."""
    rows = (vocabulary().known_category(word) for word in categories)
    return np.array([row is not None and row.front for row in rows], bool)


def verdicts(boxes: BoxesLike, triplets: Array, *, rules: str = "strict", **about: Any) -> Array:
    """Hard verdict of every relation: (E,) int8, 1 kept, 0 broken, -1 not measured. Arguments as for `margins`."""
    own = floating(boxes, kit(boxes.size).float64)
    own = Spread(held(own.size), held(own.position), held(own.yaw))
    return judged(margins(own, triplets, rules=rules, **about), triplets, rules)


def judged(margin: Array, triplets: Array, rules: str) -> Array:
    """The `verdicts` (E,) int8 on relations (E, 3) int64 with these margins (E,) float."""
    xp, chosen, predicate = kit(margin), rule_set(rules), beside(triplets, margin)[:, 1]
    kept = xp.where(_among(predicate, chosen.open), margin > 0, margin >= 0)
    return xp.where(_among(predicate, frozenset(chosen.margins)), kept, xp.full_like(kept, -1, dtype=xp.int8))


def pair_margins(pair: PairGeometry, predicate: Array, rules: RuleSet) -> Array:
    """(P,) signed margin of each pair by the rule of its predicate (P,) int64, 0 where that is not measured.

    What several rules need of the geometry is computed once.
    """
    out = full(pair.yaw_s, len(predicate), 0.0)
    for number in sorted(set(predicate.tolist())):
        rule = rules.rules.get(vocabulary().predicates[number].name)
        if rule is not None and rule.margin is not None:
            out = pair.kit.where(predicate == number, rule.margin(pair), out)
    return out


def _among(predicate: Array, ids: frozenset[int]) -> Array:
    return (predicate[:, None] == cast(sorted(ids), predicate)).any(1)
