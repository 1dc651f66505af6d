"""The two sets of rules: `sgfront` (what the published code measures) and `strict` (the same words, meant)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

from echomodel.rules.geometry import TINY, PairGeometry

Margin = Callable[[PairGeometry], Tensor]

APART = 0.05  # metres between two centres for left, right, front and behind
OVERLAP = 0.3  # largest intersection over the smaller volume for the same four
VOLUME = 0.15  # relative difference of volume for bigger and smaller
HEIGHT = 0.1  # relative difference of the tops for taller and shorter
TOUCH = 0.04  # metres of vertical play for standing on
NEAR = 0.45  # metres for close by and symmetrical to
LEFT, RIGHT, FRONT, BEHIND, CLOSE, ABOVE, ON, BIGGER, SMALLER, TALLER, SHORTER, SYMMETRICAL = range(1, 13)
SIZES = frozenset({BIGGER, SMALLER, TALLER, SHORTER})  # what sizes answer for; all others are relations of place


@dataclass(frozen=True)
class RuleSet:
    """Named rules: per predicate id a signed margin (metres or ratio), satisfied iff >= 0.

    Arguments:
        name: `strict` or `sgfront`.
        oriented: whether boxes are measured with their yaw (else as the published code does).
        margins: predicate id -> margin of a batch of pairs, (P,) float.
        open: predicates whose bound itself does not count (satisfied iff > 0).
        labels: predicate id -> margin that a pair needs to be labelled with it.
    """

    name: str
    oriented: bool
    margins: Mapping[int, Margin]
    open: frozenset[int]
    labels: Mapping[int, Margin]


def _beside(axis: int, sign: float, needed: float) -> Margin:
    """Subject on the given side of the object by at least `needed` metres, without running into it."""

    def margin(pair: PairGeometry) -> Tensor:
        return torch.minimum(sign * pair.offset[:, axis] - needed, OVERLAP - pair.overlap_ratio)

    return margin


def _relative(pair_values: Callable[[PairGeometry], tuple[Tensor, Tensor]], sign: float, needed: float) -> Margin:
    """(s - o) / s as published: the ratio to the subject, so that `bigger` and `smaller` are not quite inverse."""

    def margin(pair: PairGeometry) -> Tensor:
        s, o = pair_values(pair)
        safe = torch.where(s.abs() < TINY, torch.full_like(s, TINY), s)
        return sign * (s - o) / safe - needed

    return margin


def _relative_to_larger(
    pair_values: Callable[[PairGeometry], tuple[Tensor, Tensor]], sign: float, needed: float
) -> Margin:
    """(s - o) / max(s, o): bounded, and `bigger` is exactly the inverse of `smaller`."""

    def margin(pair: PairGeometry) -> Tensor:
        s, o = pair_values(pair)
        return sign * (s - o) / torch.maximum(s, o).clamp_min(1e-6) - needed

    return margin


def _volumes(pair: PairGeometry) -> tuple[Tensor, Tensor]:
    return pair.size_s.prod(-1), pair.size_o.prod(-1)


def _tops(pair: PairGeometry) -> tuple[Tensor, Tensor]:
    return pair.top_s, pair.top_o


def _close(pair: PairGeometry) -> Tensor:
    return NEAR - pair.corner_distance


def _sgfront_standing_on(pair: PairGeometry) -> Tensor:
    return TOUCH - (pair.position_s[:, 1] - pair.position_o[:, 1]).abs()


def _sgfront_symmetrical(pair: PairGeometry) -> Tensor:
    return NEAR - pair.mirror_distance(point=True)


def _higher(pair: PairGeometry) -> Tensor:
    """SG-FRONT labels `above` by height alone: a ceiling lamp is above everything that does not reach it."""
    return pair.position_s[:, 1] - pair.top_o


def _standing_on(pair: PairGeometry) -> Tensor:
    return torch.minimum(TOUCH - (pair.position_s[:, 1] - pair.top_o).abs(), pair.centre_inside)


def _above(pair: PairGeometry) -> Tensor:
    return torch.minimum(pair.position_s[:, 1] - pair.top_o - TOUCH, pair.footprint_penetration)


def _symmetrical(pair: PairGeometry) -> Tensor:
    return NEAR - pair.mirror_distance(point=False)


_SGFRONT: dict[int, Margin] = {
    LEFT: _beside(2, -1.0, APART),
    RIGHT: _beside(2, 1.0, APART),
    FRONT: _beside(0, 1.0, -APART),
    BEHIND: _beside(0, -1.0, -APART),
    CLOSE: _close,
    ON: _sgfront_standing_on,
    BIGGER: _relative(_volumes, 1.0, VOLUME),
    SMALLER: _relative(_volumes, -1.0, VOLUME),
    TALLER: _relative(_tops, 1.0, HEIGHT),
    SHORTER: _relative(_tops, -1.0, HEIGHT),
    SYMMETRICAL: _sgfront_symmetrical,
}

SGFRONT = RuleSet(
    name="sgfront",
    oriented=False,
    margins=_SGFRONT,
    open=frozenset({ON, SYMMETRICAL}),
    # Labels need a real distance where the check tolerates a wrong one; only the floor carries `standing on`, because
    # the check compares the bottoms of the two.
    labels={
        **{predicate: margin for predicate, margin in _SGFRONT.items() if predicate != ON},
        FRONT: _beside(0, 1.0, APART),
        BEHIND: _beside(0, -1.0, APART),
        ABOVE: _higher,
    },
)

_STRICT: dict[int, Margin] = {
    LEFT: _beside(2, -1.0, APART),
    RIGHT: _beside(2, 1.0, APART),
    FRONT: _beside(0, 1.0, APART),
    BEHIND: _beside(0, -1.0, APART),
    CLOSE: _close,
    ABOVE: _above,
    ON: _standing_on,
    BIGGER: _relative_to_larger(_volumes, 1.0, VOLUME),
    SMALLER: _relative_to_larger(_volumes, -1.0, VOLUME),
    TALLER: _relative_to_larger(_tops, 1.0, HEIGHT),
    SHORTER: _relative_to_larger(_tops, -1.0, HEIGHT),
    SYMMETRICAL: _symmetrical,
}

STRICT = RuleSet(name="strict", oriented=True, margins=_STRICT, open=frozenset(), labels=_STRICT)

RULE_SETS = {rules.name: rules for rules in (STRICT, SGFRONT)}


def rule_set(name: str) -> RuleSet:
    """The set called `name`; raises ValueError for any other word."""
    if name not in RULE_SETS:
        raise ValueError(f"unknown rules {name!r}: allowed are {', '.join(RULE_SETS)}")
    return RULE_SETS[name]
