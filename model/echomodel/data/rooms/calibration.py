"""Calibration: how often to ask for each category so that rooms hold it as often as real ones.

Not everything that is asked for finds a place, and some kinds exclude each other. `python -m
echomodel.data.rooms.calibration` writes the shares to ask for to `room_requests.json`, which the generator reads.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from echomodel.data.rooms.generator import generate_room
from echomodel.data.rooms.statistics import RoomTypeStatistics, room_type_statistics

ROUNDS, ROOMS, SEED = 8, 1200, 20
MOST = 0.97  # never ask for a category in every room unless it is in every real one
KINDS = ("bedroom", "living_room", "dining_room", "living_dining_room")


def calibrate(name: str) -> dict[str, float]:
    """Shares to ask for, category by category, for one room type."""
    wished = room_type_statistics(name, requests=False)
    asked = {category: share for category, (share, _, _) in wished.presence.items()}
    for number in range(ROUNDS):
        statistics = _with_shares(wished, asked)
        rng = np.random.default_rng([SEED, number])
        rooms = [generate_room(rng, name, statistics=statistics) for _ in range(ROOMS)]
        for category, (share, _, _) in wished.presence.items():
            got = sum(category in room.categories for room in rooms) / len(rooms)
            least, most = share / 4, 1.0 if share > MOST else MOST
            asked[category] = float(np.clip(asked[category] * (share / max(got, 0.01)) ** 0.7, least, most))
    return {category: round(share, 3) for category, share in asked.items()}


def _with_shares(statistics: RoomTypeStatistics, shares: dict[str, float]) -> RoomTypeStatistics:
    presence = {c: (shares[c], counts, weights) for c, (_, counts, weights) in statistics.presence.items()}
    return replace(statistics, presence=presence)


def write_requests(path: Path) -> None:
    """Calibrate all room types and write the table."""
    lines = ",\n".join(f" {json.dumps(kind)}: {json.dumps(calibrate(kind))}" for kind in KINDS)
    path.write_text(f"{{\n{lines}\n}}\n", "utf-8")


if __name__ == "__main__":
    write_requests(Path(__file__).parents[1] / "room_requests.json")
