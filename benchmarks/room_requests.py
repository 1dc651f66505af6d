"""Calibration: how often and how large to ask for each category so that rooms hold it as real ones do.

Not everything that is asked for finds a place, some kinds exclude each other, and what is wide fits less often. This
writes what to ask for to the model's `data/room_requests.json`, which the generator reads. It starts from the table in
place: sizes are calibrated in rooms that hold what was asked for last.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from echomodel import data
from echomodel.files import write_text
from echomodel.rooms.generator import generate_room
from echomodel.rooms.statistics import RoomTypeStatistics, room_type_statistics
from echomodel.sizes import room_statistics, size_score

ROUNDS, ROOMS, SIZE_ROOMS, SEED = 8, 1200, 3000, 20
FEWEST, FARTHEST = 60, 1.0  # pieces that a median needs, and the largest shift in standard deviations
MOST = 0.97  # never ask for a category in every room unless it is in every real one
KINDS = ("bedroom", "living_room", "dining_room", "living_dining_room")


def calibrate_presence(name: str, size_shift: dict[str, list[float]]) -> dict[str, float]:
    """Shares to ask for, category by category, for one room type."""
    wished = room_type_statistics(name, requests=False)
    asked = {category: share for category, (share, _, _) in wished.presence.items()}
    for number in range(ROUNDS):
        statistics = _with_shares(wished, asked)
        rng = np.random.default_rng([SEED, number])
        rooms = [generate_room(rng, name, statistics=statistics, size_shift=size_shift) for _ in range(ROOMS)]
        for category, (share, _, _) in wished.presence.items():
            got = sum(category in room.categories for room in rooms) / len(rooms)
            least, most = share / 4, 1.0 if share > MOST else MOST
            asked[category] = float(np.clip(asked[category] * (share / max(got, 0.01)) ** 0.7, least, most))
    return {category: round(share, 3) for category, share in asked.items()}


def _with_shares(statistics: RoomTypeStatistics, shares: dict[str, float]) -> RoomTypeStatistics:
    presence = {c: (shares[c], counts, weights) for c, (_, counts, weights) in statistics.presence.items()}
    return replace(statistics, presence=presence)


def calibrate_size() -> dict[str, list[float]]:
    """Shifts of size, category by category, with which the medians of what finds a place are those of real rooms."""
    shift: dict[str, list[float]] = {}
    for number in range(ROUNDS):
        rng = np.random.default_rng([SEED, number])
        placed: dict[str, list[np.ndarray]] = {}
        for _ in range(SIZE_ROOMS):
            room = generate_room(rng, size_shift=shift)
            for category, size in zip(room.categories, room.size, strict=True):
                placed.setdefault(category, []).append(size)
        for category, sizes in placed.items():
            if category in room_statistics()["sizes"] and len(sizes) >= FEWEST:
                off = np.median(size_score(category, np.array(sizes)), axis=0)
                new = np.clip(np.array(shift.get(category, np.zeros(3))) - 0.7 * off, -FARTHEST, FARTHEST)
                shift[category] = new.round(3).tolist()
    return shift


def write_requests(path: Path) -> None:
    """Calibrate the sizes, then the presence in all room types, and write the tables."""
    sizes = calibrate_size()
    presence = {kind: calibrate_presence(kind, sizes) for kind in KINDS}
    tables = [
        f' "{name}": {{\n' + ",\n".join(f"  {json.dumps(key)}: {json.dumps(table[key])}" for key in table) + "\n }"
        for name, table in (("presence", presence), ("size", sizes))
    ]
    write_text(path, "{\n" + ",\n".join(tables) + "\n}\n")


if __name__ == "__main__":
    write_requests(Path(data.__file__).with_name("room_requests.json"))
