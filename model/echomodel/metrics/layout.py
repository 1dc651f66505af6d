"""Layout metrics: relations kept per predicate and group, and how sizes are distributed (EchoScene, section 4.2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from torch import Tensor

from echomodel.rules import verdicts
from echomodel.rules.geometry import BoxesLike
from echomodel.vocabulary import vocabulary

# The groups of the published table; `above` is ours, the published code does not measure it.
GROUPS = {
    "left/right": ("left", "right"),
    "front/behind": ("front", "behind"),
    "bigger/smaller": ("bigger_than", "smaller_than"),
    "taller/shorter": ("taller_than", "shorter_than"),
    "standing_on": ("standing_on",),
    "close_by": ("close_by",),
    "symmetrical_to": ("symmetrical_to",),
    "above": ("above",),
}
LEAST_FOR_KS = 30


@dataclass(frozen=True)
class RelationScores:
    """How many relations were measured and kept.

    Arguments:
        kept, measured: predicate name -> number of triplets.
    """

    kept: Mapping[str, int]
    measured: Mapping[str, int]

    def share(self, *predicates: str) -> float | None:
        """Kept share over the given predicates, None where none was measured."""
        measured = sum(self.measured.get(p, 0) for p in predicates)
        return sum(self.kept.get(p, 0) for p in predicates) / measured if measured else None

    def group(self, name: str) -> float | None:
        """Mean of the shares of a group's predicates (as the published table pairs left with right)."""
        shares = [share for p in GROUPS[name] if (share := self.share(p)) is not None]
        return float(np.mean(shares)) if shares else None

    def to_json(self) -> dict:
        """Shares per predicate and group, `total` over all triplets, `mean` over the groups that were measured."""
        groups = {name: share for name in GROUPS if (share := self.group(name)) is not None}
        return {
            "relations": {p: {"kept": self.share(p), "n": n} for p, n in self.measured.items() if n},
            "groups": groups,
            "total": self.share(*self.measured),
            "mean": float(np.mean(list(groups.values()))) if groups else None,
            "n": sum(self.measured.values()),
        }


def relation_scores(
    boxes: BoxesLike,
    triplets: Tensor,
    *,
    rules: str = "strict",
    scene: Tensor | None = None,
    center: Tensor | None = None,
    fronts: Tensor | None = None,
    subset: Tensor | None = None,
) -> RelationScores:
    """Count the kept relations of any number of scenes.

    Arguments:
        boxes, triplets, rules, scene, center, fronts: as for `echomodel.rules.verdicts`; boxes from any source. Without
            `fronts` `symmetrical_to` goes by places alone, as the published table does.
        subset: (E,) bool, the triplets to count; default all.
    """
    verdict = verdicts(boxes, triplets, rules=rules, scene=scene, center=center, fronts=fronts)
    counted = verdict >= 0
    if subset is not None:
        counted &= subset
    kept, measured = {}, {}
    for predicate in vocabulary().predicates:
        chosen = counted & (triplets[:, 1] == predicate.id)
        if predicate.measures:
            measured[predicate.name] = int(chosen.sum())
            kept[predicate.name] = int((chosen & (verdict == 1)).sum())
    return RelationScores(kept, measured)


@dataclass(frozen=True)
class SizeRow:
    """Sizes of one class along one axis: number here and there, ratio of the medians, Kolmogorov-Smirnov distance."""

    category: str
    axis: str
    n: int
    real_n: int
    median_ratio: float
    ks: float | None


def size_rows(
    categories: Sequence[str], size: np.ndarray, real_categories: Sequence[str], real_size: np.ndarray
) -> list[SizeRow]:
    """Compare the distributions of sizes, class by class and axis by axis.

    Arguments:
        categories: n words. size: (n, 3) float, metres.
        real_categories, real_size: the same of the real (or true) boxes, m of them.

    Returns:
        A row per class that both have and axis; the distance where both have 30 or more.
    """
    names, real_names = np.array(categories), np.array(real_categories)
    rows = []
    for name in sorted(set(categories) & set(real_categories)):
        ours, real = size[names == name], real_size[real_names == name]
        enough = min(len(ours), len(real)) >= LEAST_FOR_KS
        for k, axis in enumerate("xyz"):
            ratio = float(np.median(ours[:, k]) / max(np.median(real[:, k]), 1e-6))
            distance = kolmogorov_smirnov(ours[:, k], real[:, k]) if enough else None
            rows.append(SizeRow(name, axis, len(ours), len(real), ratio, distance))
    return rows


def kolmogorov_smirnov(a: np.ndarray, b: np.ndarray) -> float:
    """Largest distance between the two empirical distribution functions, 0 to 1; values are rounded to 0.1 mm, so that
    sizes that passed through float32 still tie."""
    from scipy.stats import ks_2samp

    return float(ks_2samp(np.round(a, 4), np.round(b, 4), method="asymp").statistic)


def touched_triplets(triplets: Tensor, nodes: Tensor) -> Tensor:
    """(E,) bool, the triplets with an end among `nodes` (N,) bool."""
    return nodes[triplets[:, 0]] | nodes[triplets[:, 2]]
