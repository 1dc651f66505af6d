"""Margins and verdicts of given relations: how well boxes keep what a graph asks for."""

from __future__ import annotations

import copy
from collections.abc import Iterable
from typing import Any

import torch
from torch import Tensor

from echomodel.rules.geometry import BoxesLike, PairGeometry, pairs
from echomodel.rules.sets import RuleSet, rule_set
from echomodel.vocabulary import vocabulary


class _Tensors:
    """Boxes as floating-point tensors of one kind."""

    def __init__(self, boxes: BoxesLike, dtype: torch.dtype | None = None) -> None:
        size = torch.as_tensor(boxes.size)
        kind = dtype or (size.dtype if size.is_floating_point() else torch.float32)
        self.size = size.to(kind)
        self.position = torch.as_tensor(boxes.position).to(self.size)
        self.yaw = torch.as_tensor(boxes.yaw).to(self.size)

    def of_fixed_size(self) -> _Tensors:
        """The same boxes, through whose sizes no gradient passes."""
        fixed = copy.copy(self)
        fixed.size = self.size.detach()
        return fixed


def measured(rules: str = "strict") -> frozenset[int]:
    """Ids of the predicates that the rules can measure on boxes; raises ValueError for an unknown set."""
    return frozenset(rule_set(rules).margins)


def margins(
    boxes: BoxesLike,
    triplets: Tensor,
    *,
    rules: str = "strict",
    scene: Tensor | None = None,
    center: Tensor | None = None,
    fronts: Tensor | None = None,
    rigid: bool = False,
) -> Tensor:
    """Signed margin of every relation, >= 0 iff it is satisfied; differentiable in size, position and yaw.

    Arguments:
        boxes: N boxes, `size (N, 3)` and `position (N, 3)` in metres, `yaw (N,)` in radians, float tensors or arrays.
        triplets: (E, 3) int64 [subject, predicate id, object], indices into the boxes.
        rules: `strict` or `sgfront`.
        scene: (N,) int64, scene of each node; needed where `center` holds several rows.
        center: (2,) or (S, 2) float, x and z of the rooms' centres; default the origin. Only `symmetrical_to` asks.
        fronts: (N,) bool, boxes that have a front (`echomodel.rules.fronts`), whose headings `symmetrical_to` measures
            in the set `strict`, too; None = none.
        rigid: relations of place have no gradient in the sizes: furniture moves aside, it does not shrink.

    Returns (E,) float, in metres (sides, close by, standing on, above, symmetrical to) or as a ratio (sizes, overlap);
    0 where the rules do not measure the predicate. Never NaN or infinite for finite boxes.
    """
    return _margins(_Tensors(boxes), triplets, rule_set(rules), scene, center, fronts, rigid)


def fronts(categories: Iterable[str]) -> Tensor:
    """(N,) bool, which of the categories have a front; words that the vocabulary does not hold have none."""
    return torch.tensor([_has_front(word) for word in categories], dtype=torch.bool)


def verdicts(boxes: BoxesLike, triplets: Tensor, *, rules: str = "strict", **about: Any) -> Tensor:
    """Hard verdict of every relation: (E,) int8, 1 kept, 0 broken, -1 not measured. Arguments as for `margins`."""
    chosen = rule_set(rules)
    triplets = torch.as_tensor(triplets)
    with torch.no_grad():
        margin = _margins(_Tensors(boxes, torch.float64), triplets, chosen, **about)
    predicate = triplets[:, 1]
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


def _margins(
    boxes: _Tensors,
    triplets: Tensor,
    rules: RuleSet,
    scene: Tensor | None = None,
    center: Tensor | None = None,
    fronts: Tensor | None = None,
    rigid: bool = False,
) -> Tensor:
    triplets = torch.as_tensor(triplets, device=boxes.size.device)
    centre = node_centres(boxes.position, scene, center)
    out = boxes.size.new_zeros(len(triplets))
    headed = None if fronts is None else torch.as_tensor(fronts, device=boxes.size.device)
    placed = boxes.of_fixed_size() if rigid else boxes
    words, told = vocabulary().predicates, triplets[:, 1]
    there = {words[number].name: words[number] for number in sorted(set(told.tolist())) if 0 <= number < len(words)}
    for name, rule in rules.rules.items():  # in their order, so that gradients add up in one
        if name in there and rule.margin is not None:
            chosen = (told == there[name].id).nonzero()[:, 0]
            subject, object_ = triplets[chosen, 0], triplets[chosen, 2]
            of = boxes if there[name].measures == "size" else placed  # all others are of place
            pair = pairs(of, subject, object_, centre, oriented=rules.oriented, fronts=headed)
            out = out.index_copy(0, chosen, rule.margin(pair))
    return out


def node_centres(position: Tensor, scene: Tensor | None, center: Tensor | None) -> Tensor:
    """(N, 3) centre of each node's room from `center` (2,) or (S, 2) and `scene` (N,); zeros where not given."""
    out = torch.zeros_like(position)
    if center is not None:
        plan = torch.as_tensor(center).to(position)
        if plan.ndim == 2:
            if scene is None and len(plan) > 1:
                raise ValueError(f"center has {len(plan)} rows but scene is missing: give the scene of each node")
            plan = plan[0] if scene is None else plan[torch.as_tensor(scene)]
        out[:, [0, 2]] = plan.expand(len(position), 2)
    return out


def _has_front(word: str) -> bool:
    row = vocabulary().known_category(word)
    return row is not None and row.front


def _among(predicate: Tensor, ids: frozenset[int]) -> Tensor:
    table = torch.tensor(sorted(ids), dtype=predicate.dtype, device=predicate.device)
    return torch.isin(predicate, table)
