"""Margins and verdicts of given relations: how well boxes keep what a graph asks for."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import torch
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.rules.geometry import BoxesLike, PairGeometry, pairs
from echomodel.rules.sets import RuleSet, rule_set
from echomodel.vocabulary import vocabulary


def tensors(boxes: BoxesLike, dtype: torch.dtype | None = None) -> Boxes:
    """Boxes as floating-point tensors of one kind."""
    size = torch.as_tensor(boxes.size)
    size = size.to(dtype or (size.dtype if size.is_floating_point() else torch.float32))
    return Boxes(size, torch.as_tensor(boxes.position).to(size), torch.as_tensor(boxes.yaw).to(size))


def measured(rules: str = "strict") -> frozenset[int]:
    """Ids of the predicates that the rules can measure on boxes; raises ValueError for an unknown set."""
    return frozenset(rule_set(rules).margins)


def margins(
    boxes: BoxesLike,
    triplets: Tensor,
    *,
    rules: str = "strict",
    center: Tensor | None = None,
    fronts: Tensor | None = None,
    rigid: bool = False,
) -> Tensor:
    """Signed margin of every relation, >= 0 iff it is satisfied; differentiable in size, position and yaw.

    Arguments:
        boxes: N boxes, `size (N, 3)` and `position (N, 3)` in metres, `yaw (N,)` in radians, float tensors or arrays.
        triplets: (E, 3) int64 [subject, predicate id, object], indices into the boxes.
        rules: `strict` or `sgfront`.
        center: (2,) float, x and z of the room's centre; default the origin. Only `symmetrical_to` asks.
        fronts: (N,) bool, boxes that have a front (`echomodel.rules.fronts`), whose headings `symmetrical_to` measures
            in the set `strict`, too; None = none.
        rigid: relations of place have no gradient in the sizes: furniture moves aside, it does not shrink.

    Returns (E,) float, in metres (sides, close by, standing on, above, symmetrical to) or as a ratio (sizes, overlap);
    0 where the rules do not measure the predicate. Never NaN or infinite for finite boxes.
    """
    own = tensors(boxes)
    triplets = torch.as_tensor(triplets, device=own.size.device)
    centre = torch.zeros_like(own.position)
    if center is not None:
        centre[:, [0, 2]] = torch.as_tensor(center).to(centre)
    out = own.size.new_zeros(len(triplets))
    headed = None if fronts is None else torch.as_tensor(fronts, device=own.size.device)
    placed = replace(own, size=own.size.detach()) if rigid else own
    words, told, chosen = vocabulary().predicates, triplets[:, 1], rule_set(rules)
    there = {words[number].name: words[number] for number in sorted(set(told.tolist())) if 0 <= number < len(words)}
    for name, rule in chosen.rules.items():  # in their order, so that gradients add up in one
        if name in there and rule.margin is not None:
            rows = (told == there[name].id).nonzero()[:, 0]
            of = own if there[name].measures == "size" else placed  # all others are of place
            ends = triplets[rows, 0], triplets[rows, 2]
            pair = pairs(of, *ends, centre, oriented=chosen.oriented, fronts=headed)
            out = out.index_copy(0, rows, rule.margin(pair))
    return out


def fronts(categories: Iterable[str]) -> Tensor:
    """(N,) bool, which of the categories have a front; words that the vocabulary does not hold have none."""
    rows = (vocabulary().known_category(word) for word in categories)
    return torch.tensor([row is not None and row.front for row in rows], dtype=torch.bool)


def verdicts(boxes: BoxesLike, triplets: Tensor, *, rules: str = "strict", **about: Any) -> Tensor:
    """Hard verdict of every relation: (E,) int8, 1 kept, 0 broken, -1 not measured. Arguments as for `margins`."""
    triplets = torch.as_tensor(triplets)
    with torch.no_grad():
        return judged(margins(tensors(boxes, torch.float64), triplets, rules=rules, **about), triplets, rules)


def judged(margin: Tensor, triplets: Tensor, rules: str) -> Tensor:
    """The `verdicts` (E,) int8 on relations (E, 3) int64 with these margins (E,) float."""
    chosen, predicate = rule_set(rules), triplets[:, 1]
    kept = torch.where(_among(predicate, chosen.open), margin > 0, margin >= 0)
    unmeasured = torch.full_like(kept, -1, dtype=torch.int8)
    return torch.where(_among(predicate, frozenset(chosen.margins)), kept.to(torch.int8), unmeasured)


def pair_margins(pair: PairGeometry, predicate: Tensor, rules: RuleSet) -> Tensor:
    """(P,) signed margin of each pair by the rule of its predicate (P,) int64, 0 where that is not measured.

    What several rules need of the geometry is computed once.
    """
    out = pair.yaw_s.new_zeros(len(predicate))
    for number in sorted(set(predicate.tolist())):
        rule = rules.rules.get(vocabulary().predicates[number].name)
        if rule is not None and rule.margin is not None:
            out = torch.where(predicate == number, rule.margin(pair), out)
    return out


def _among(predicate: Tensor, ids: frozenset[int]) -> Tensor:
    table = torch.tensor(sorted(ids), dtype=predicate.dtype, device=predicate.device)
    return torch.isin(predicate, table)
