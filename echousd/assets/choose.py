"""Which model of a library stands for which object: by category, box, style and colours; none repeated needlessly."""

from __future__ import annotations

import math
import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from echomodel.sizes import size_statistics
from echomodel.vocabulary import vocabulary
from echousd.assets import STRETCH
from echousd.assets.colors import MOST, apart, oklab, stated_colors
from echousd.assets.colors import costs as color_costs
from echousd.assets.colors import table as color_table
from echousd.assets.licences import allowed
from echousd.assets.record import AssetRecord
from echousd.assets.table import Library, read_library

if TYPE_CHECKING:
    from echousd.options import RoomOptions

EQUALLY_GOOD = 0.12  # difference of costs among which the seed decides
OTHER_WORD, OTHER_FAMILY = 0.35, 0.8  # cost of a model of a related category
AGAIN, BEYOND, UNSURE, UNLIKE = 0.6, 3.0, 0.5, 0.25
SMALL, LARGE = 0.8, 1.2  # times the 5th and 95th percentile of a category: what is beyond looks like something else
TEXT = 3.0  # of the distance of a model's words from the wanted ones, as a cosine


@dataclass(frozen=True)
class AssetWishes:
    """What is asked of a library.

    Arguments:
        library: where models come from, None = only pieces of one's own.
        stretch: see `STRETCH`; models with joints or colliders of their own are never stretched.
        licences: which are allowed (`echousd.assets.licences.allowed`), empty = all.
        text: words that the models shall be like by CLIP (extra `text`), "" = none.
        collect: take models along with all that they need, instead of referring to where they lie.
        outside: folders besides those of the index and of the graph's file in which models may lie.

    Raises ValueError for a stretch that is not allowed and for an index of models that lie elsewhere.
    """

    library: Library | None = None
    stretch: float = STRETCH
    licences: tuple[str, ...] = ()
    text: str = ""
    collect: bool = False
    outside: tuple[Path, ...] = ()

    def __post_init__(self) -> None:
        if self.library is not None:
            self.library.check_reach(self.outside)
        if not (math.isfinite(self.stretch) and 1 <= self.stretch <= 4):
            raise ValueError(f"stretch is {self.stretch:g}, allowed: 1 to 4")

    @cached_property
    def shelves(self) -> dict[str, Shelf]:
        """Category -> the models that may be chosen for it."""
        if self.library is None:
            return {}
        found = {}
        for category, records in self.library.by_category.items():
            kept = [record for record in records if not self.licences or allowed(record.licence, self.licences)]
            if kept:
                found[category] = Shelf(tuple(kept))
        return found

    @cached_property
    def unlikeness(self) -> dict[str, float]:
        """Id of a model -> cost of its words against `text`; raises TextEncoderError where texts cannot be compared."""
        records = [record for shelf in self.shelves.values() for record in shelf.records] if self.text else []
        if not records:
            return {}
        import torch

        from echomodel.text import ClipTextEncoder

        described = [" ".join((r.name, r.category.replace("_", " "), *r.tags, *r.materials)) for r in records]
        vectors = ClipTextEncoder()([self.text, *described])
        vectors = torch.nn.functional.normalize(torch.as_tensor(vectors), dim=1)
        away = TEXT * (1.0 - vectors[1:] @ vectors[0])
        return dict(zip((record.id for record in records), away.tolist(), strict=True))


@dataclass(frozen=True, eq=False)
class Shelf:
    """The models of one category; `sizes` is (n, 3) float, metres."""

    records: tuple[AssetRecord, ...]

    @cached_property
    def sizes(self) -> np.ndarray:
        """(n, 3) float, metres."""
        return np.array([record.dims for record in self.records])

    @cached_property
    def doubts(self) -> np.ndarray:
        """(n,) float, what is not known for sure of category and front."""
        return np.array([2 - record.confidence - record.front_confidence for record in self.records])

    @cached_property
    def colors(self) -> np.ndarray:
        """(n, k, 4) float, shares and OKLab of colours."""
        return color_table([record.colors for record in self.records], MOST)

    def oddness(self, category: str) -> np.ndarray:
        """(n,) float, how far a model is out of the sizes of a category (logarithm, along its worst axis); 0 within."""
        table = size_statistics(category)
        low, high = np.log(table.low * SMALL), np.log(table.high * LARGE)
        turned = [np.log(self.sizes[:, axes]) for axes in ((0, 1, 2), (2, 1, 0))]
        return np.minimum(*(np.maximum(0.0, np.maximum(low - side, side - high)).max(1) for side in turned))


@dataclass(frozen=True)
class Asked:
    """One object that needs a model: name, category, style, box (3) in metres, who shares its model.

    `stated` are words of its graph, whose colours it shall have where they name any.
    """

    name: str
    category: str
    style: str
    size: tuple[float, float, float]
    shares: str = ""
    stated: str = ""


def choose(
    wishes: AssetWishes, asked: Sequence[Asked], seed: int, *, kept: Mapping[str, AssetRecord] | None = None,
    nearness: Mapping[str, Mapping[str, float]] | None = None, palette: np.ndarray | None = None,
) -> tuple[dict[str, AssetRecord], list[str]]:  # fmt: skip
    """Object name -> its model, and the objects that the library has nothing for; equal arguments give equal choices.

    Arguments:
        asked: objects in the order in which they choose; those of one `shares` get one model.
        kept: object name -> model that is chosen already. nearness: object name -> id of a model -> cost of its shape
            against the one that was generated (`--shapes guided`). palette: (p, 3) linear colours of the room.
    """
    chosen, missing = dict(kept or {}), []
    groups: dict[str, AssetRecord] = {}
    styles: dict[str, list[AssetRecord]] = {}
    for one in asked:
        if one.name in chosen:
            groups.setdefault(one.shares or one.name, chosen[one.name])
            styles.setdefault(one.style, []).append(chosen[one.name])
    used = {record.id for record in chosen.values()}
    tones = oklab(np.asarray(palette, float).reshape(-1, 3)) if palette is not None else np.zeros((0, 3))
    if len(tones):
        tones = np.concatenate([tones, np.reshape(stated_colors(wishes.text), (-1, 3))])
    for one in asked:
        if one.name in chosen:
            continue
        found = groups.get(one.shares) if one.shares else None
        if found is None:
            near = (nearness or {}).get(one.name)
            found = _best(wishes, one, used, styles.get(one.style, ()), f"{seed} {one.shares or one.name}", near, tones)
        if found is None:
            missing.append(one.name)
            continue
        chosen[one.name] = found
        if one.shares:
            groups[one.shares] = found
        styles.setdefault(one.style, []).append(found)
        used.add(found.id)
    return chosen, missing


def fits(record: AssetRecord, size: Sequence[float] | np.ndarray, stretch: float) -> bool:
    """Whether a model fills a box (3) without being stretched by more than allowed along any axis."""
    limit = 1.0 + 1e-6 if record.rigid else stretch
    ratio = np.abs(np.log(np.asarray(size, float) / np.array(record.dims)))
    return bool(ratio.max() <= math.log(limit) + 1e-6)


def _best(
    wishes: AssetWishes, one: Asked, used: set[str], company: Sequence[AssetRecord], seed: str,
    nearness: Mapping[str, float] | None, tones: np.ndarray,
) -> AssetRecord | None:  # fmt: skip
    ranked: list[tuple[float, str, AssetRecord]] = []
    wanted = np.reshape(stated_colors(one.stated), (-1, 3))
    worn = np.array([other.colors[1:4] for other in company if other.colors]).reshape(-1, 3)  # their main ones
    loud = True  # until there is one whose colours are not
    for category, cost in _shelves_for(one.category, wishes):
        if category != one.category and one.category in wishes.shelves and not loud:
            break  # kin of what is there stand in for it alone where all of it is loud
        shelf = wishes.shelves[category]
        colors = color_costs(shelf.colors, one.category, tones, wanted)
        loud = loud and bool((colors > OTHER_WORD).all())
        ratio = np.abs(np.log(np.array(one.size) / shelf.sizes))
        costs = cost + ratio.mean(1) + BEYOND * np.maximum(ratio - math.log(wishes.stretch), 0).sum(1)
        odd = shelf.oddness(one.category)
        costs += UNSURE * shelf.doubts + BEYOND * odd + colors
        if category != one.category:  # nobody dines at a coffee table, however near it is of kin
            costs[odd > 0] = np.inf
        for number in np.argsort(costs, kind="stable")[:64]:
            if not np.isfinite(costs[number]):
                break
            record = shelf.records[number]
            total = float(costs[number]) + (AGAIN if record.id in used else 0.0) + UNLIKE * _unlike(record, company)
            total += apart(record.colors, worn)
            total += (nearness or {}).get(record.id, 0.0) + wishes.unlikeness.get(record.id, 0.0)
            ranked.append((total, record.id, record))
    if not ranked:
        return None
    ranked.sort(key=lambda entry: entry[:2])
    good = [entry for entry in ranked if entry[0] <= ranked[0][0] + EQUALLY_GOOD]
    return random.Random(seed).choice(good)[2] if nearness is None else ranked[0][2]


def _shelves_for(word: str, wishes: AssetWishes) -> list[tuple[str, float]]:
    """Categories whose models may stand for one, with what that costs; those of the nearest kind, its own first."""
    row = vocabulary().category(word)
    found = [(word, 0.0)] if word in wishes.shelves else []
    # a table lamp does not hang from a ceiling
    alike = [c for c in vocabulary().categories if c.name in wishes.shelves and c.support == row.support]
    words = [c.name for c in alike if c.sgfront == row.sgfront or (c.like or c.name) == (row.like or row.name)]
    family = [c.name for c in alike if (c.coarse, c.role) == (row.coarse, row.role)]
    for others, cost in ((words, OTHER_WORD), (family, OTHER_FAMILY)):
        found += [(name, cost) for name in others if name != word]
        if found:
            break
    return found


def _unlike(record: AssetRecord, company: Sequence[AssetRecord]) -> float:
    """0 where a model is like those of its style group by author, words and materials, 1 where nothing is alike."""
    if not company:
        return 0.0
    own = _words(record)
    shares = []
    for other in company:
        words = _words(other)
        alike = len(own & words) / max(min(len(own), len(words)), 1)
        shares.append(max(alike, 0.5 if record.author and record.author == other.author else 0.0))
    return 1.0 - sum(shares) / len(shares)


def _words(record: AssetRecord) -> frozenset[str]:
    return _split((*record.tags, *record.materials))


@lru_cache(maxsize=1 << 16)
def _split(texts: tuple[str, ...]) -> frozenset[str]:
    words = " ".join(texts).lower().replace("_", " ").split()
    return frozenset(word for word in words if len(word) > 2 and word.isalpha())


def wishes_of(asked: RoomOptions, outside: Sequence[str | Path] = ()) -> AssetWishes:
    """What options ask of a library; raises ValueError for what is not there.

    `outside`: folders besides that of the index in which its models may lie.
    """
    index = Path(asked.assets or "")
    changed = index.stat().st_mtime_ns if asked.assets and index.is_file() else 0
    beyond = tuple(map(str, outside))
    return _wishes(asked.assets, changed, asked.stretch, asked.licenses or "", asked.text, asked.collect, beyond)


@lru_cache(maxsize=4)  # words are compared with those of all models once in a process
def _wishes(
    assets: str | None, changed: int, stretch: float, licenses: str, text: str, collect: bool, outside: tuple[str, ...]
) -> AssetWishes:
    """`changed`: when the index was written. `licenses`: with commas between."""
    words = tuple(word.strip() for word in licenses.split(",") if word.strip())
    library = None if assets is None else read_library(assets)
    wishes = AssetWishes(library, stretch, words, text, collect, outside=tuple(map(Path, outside)))
    _ = wishes.unlikeness  # what is absent is told before any long work
    return wishes
