"""Halls: rooms of two or three zones on a floor as large as all of them need, with 15 to 40 pieces of furniture."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np

from echomodel.rooms.statistics import RoomTypeStatistics, room_type_statistics
from echomodel.vocabulary import vocabulary

THREE = 0.4  # share of the halls that have a third zone
WALLS_SHARED = 0.85  # zones of one room need less floor than rooms of their own
LARGEST = 80.0  # square metres


def hall_of(statistics: RoomTypeStatistics, rng: np.random.Generator) -> tuple[RoomTypeStatistics, list[str]]:
    """Statistics of a floor for several zones, and the room types of all zones, the room's own first."""
    names, shares = zip(*vocabulary().room_type(statistics.name).zones, strict=True)
    weights = np.cumsum(shares)
    count = 1 + int(rng.random() < THREE)
    types = [statistics.name, *(names[int(np.searchsorted(weights, rng.random() * weights[-1]))] for _ in range(count))]
    area = WALLS_SHARED * sum(room_type_statistics(name).area[2] for name in types) * float(rng.uniform(0.9, 1.5))
    area = min(area, LARGEST)
    side = (area / statistics.area[2]) ** 0.5
    return replace(
        statistics,
        area=(area,) * 5,
        short=tuple(side * value for value in statistics.short),
        long=tuple(side * value for value in statistics.long),
    ), types


def together(wanted: list[dict[str, int]]) -> dict[str, int]:
    """What all zones ask for."""
    total: Counter[str] = Counter()
    for zone in wanted:
        total.update(zone)
    return dict(total)
