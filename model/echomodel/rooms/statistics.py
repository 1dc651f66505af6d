"""What rooms of each type look like in the statistics of real ones, and draws from their percentiles."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources

import numpy as np

from echomodel.rows import RoomType
from echomodel.sizes import room_statistics
from echomodel.vocabulary import vocabulary

AT_WALL = 0.2  # metres: a class with a larger median gap does not belong at a wall
QUARTILE = 0.674  # standard score of the third quartile
USUAL_GAPS = (0.0, 0.03, 0.06)  # metres between a back and its wall: quartiles of classes without figures
_KNOTS = {5: (-1.645, -0.674, 0.0, 0.674, 1.645), 3: (-1.645, 0.0, 1.645)}


@dataclass(frozen=True)
class RoomTypeStatistics:
    """Percentiles (5, 25, 50, 75, 95) of one kind of room in metres, and which categories it holds.

    `presence`: category -> (share of rooms that have it, counts and their shares).
    """

    name: str
    area: tuple[float, ...]
    short: tuple[float, ...]
    long: tuple[float, ...]
    height: tuple[float, ...]
    rectangular: float
    cuts: tuple[float, ...]
    presence: dict[str, tuple[float, tuple[int, ...], tuple[float, ...]]]


@cache
def room_type_statistics(name: str, *, requests: bool = True) -> RoomTypeStatistics:
    """The part of one room type of the vocabulary, or of the one that it is like; raises ValueError for another word.

    Arguments:
        name: room type.
        requests: give as `presence` the shares to ask for (see `benchmarks/room_requests.py`), not those of real rooms.
    """
    rooms = room_statistics()["rooms"]
    if name not in rooms:
        row = next((row for row in vocabulary().room_types if row.name == name and row.like), None)
        if row is None:
            raise ValueError(f"no statistics for room type {name!r}: allowed are {', '.join(rooms)}")
        like = room_type_statistics(row.like, requests=requests)
        return _planned(row, like) if row.floor else like
    raw = rooms[name]
    asked = room_requests()["presence"].get(name, {}) if requests else {}
    presence = {}
    for category, entry in raw["presence"].items():
        counts = tuple(int(count) for count in entry["counts"])
        weights = np.array(list(entry["counts"].values()), float)
        share = asked.get(category, entry["share"])
        presence[category] = (share, counts, tuple(np.cumsum(weights / weights.sum()).tolist()))
    return RoomTypeStatistics(
        name=name, area=tuple(raw["area"]), short=tuple(raw["short"]), long=tuple(raw["long"]),
        height=tuple(raw["height"]), rectangular=raw["rectangular"],
        cuts=vocabulary().room_type(name).cuts, presence=presence,
    )  # fmt: skip


def _planned(row: RoomType, like: RoomTypeStatistics) -> RoomTypeStatistics:
    """Statistics of rooms that nobody measured, by what they are planned with."""
    area, short = ([low, math.sqrt(low * mean), mean, math.sqrt(mean * high), high] for low, mean, high in row.floor)
    long = tuple(a / s for a, s in zip(area, short, strict=True))
    presence: dict[str, tuple[float, tuple[int, ...], tuple[float, ...]]] = {
        category: (1.0, (count,), (1.0,)) for category, count in row.contents
    }
    presence |= {category: (share, (1,), (1.0,)) for category, share in row.maybe}
    return replace(
        like, name=row.name, area=tuple(area), short=tuple(short), long=long, rectangular=1.0 - row.cut,
        cuts=row.cuts, presence=presence,
    )  # fmt: skip


@cache
def back_gaps(category: str) -> tuple[float, float, float]:
    """Quartiles of the gap between the backs of a category at a wall and that wall, metres."""
    low, middle, high = room_statistics()["walls"].get(category, {}).get("back_gap", USUAL_GAPS)
    return (low, middle, high) if middle < AT_WALL else USUAL_GAPS


@cache
def room_requests() -> dict[str, dict]:
    """What to ask for so that rooms come out like real ones (see `benchmarks/room_requests.py`).

    `presence`: room type -> category -> share of rooms; `size`: category -> shift of x, y, z in standard deviations.
    """
    return json.loads(resources.files("echomodel.data").joinpath("room_requests.json").read_text("utf-8"))


def quantile(percentiles: tuple[float, ...], z: float) -> float:
    """The value at the standard score `z` of a distribution given by 3 or 5 percentiles, linear between them."""
    knots = _KNOTS[len(percentiles)]
    z = min(max(z, -2.1), 2.1)
    if z <= knots[0] or z >= knots[-1]:
        at = 0 if z <= knots[0] else len(knots) - 2
        slope = (percentiles[at + 1] - percentiles[at]) / (knots[at + 1] - knots[at])
        return percentiles[at] + slope * (z - knots[at])
    return float(np.interp(z, knots, percentiles))
