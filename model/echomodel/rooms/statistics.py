"""What rooms of each type look like in the statistics of real ones, and draws from their percentiles."""

import json
import math
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources

import numpy as np

from echomodel.rows import RoomType
from echomodel.sizes import room_statistics
from echomodel.vocabulary import vocabulary

QUARTILE = 0.674  # standard score of the third quartile


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
def room_requests() -> dict[str, dict]:
    """What to ask for so that rooms come out like real ones (see `benchmarks/room_requests.py`).

    `presence`: room type -> category -> share of rooms; `size`: category -> shift of x, y, z in standard deviations.
    """
    return json.loads(resources.files("echomodel.data").joinpath("room_requests.json").read_text("utf-8"))
