"""Rooms: generated, labelled and read per second on one core, against what a training step consumes.

    OMP_NUM_THREADS=1 python benchmarks/rooms.py [--rooms 2000]

Wanted: at least 200 rooms per second and core (boxes only); a 64-scene batch is read faster than the compact model's
layout step (forward and backward) consumes it. CPU seconds of this process, so that a busy machine does not count.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from echomodel.compact.model import CompactModel
from echomodel.config import CompactConfig
from echomodel.data.roomset import RoomSet, build_rooms
from echomodel.rooms.generator import generate_rooms
from echomodel.rules import label_rooms
from echomodel.training.layout_stage import LayoutStage, statistics_of
from echomodel.training.recipe import Recipe
from echomodel.training.rooms import PackedRooms

SCENES = 64


def seconds(work: Callable[[], object], repeats: int = 3) -> float:
    """The least CPU time of a few runs."""
    best = float("inf")
    for _ in range(repeats):
        start = time.process_time()
        work()
        best = min(best, time.process_time() - start)
    return best


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rooms", type=int, default=2000)
    count = parser.parse_args().rooms
    torch.set_num_threads(1)
    rooms = generate_rooms(count, 1)
    rate = count / seconds(lambda: generate_rooms(count, 1))
    print(f"generated      {rate:8.0f} rooms/s   (wanted: 200)   mean {np.mean([len(r) for r in rooms]):.1f} objects")
    rate = count / seconds(lambda: [label_rooms(rooms[k : k + 100]) for k in range(0, count, 100)])
    print(f"labelled       {rate:8.0f} rooms/s")
    with tempfile.TemporaryDirectory() as folder:
        build_rooms(folder, count, 1, 8)
        size = sum(path.stat().st_size for path in Path(folder).iterdir())
        print(f"on disk        {size / count:8.0f} bytes/room")
        stored = RoomSet(folder)
        read = seconds(lambda: PackedRooms.build([stored.room(k) for k in range(SCENES)], 0))
        print(f"read           {read * 1e3:8.2f} ms per batch of {SCENES} scenes")
        few = [stored.room(k) for k in range(SCENES)]
    packed = PackedRooms.build(few, 0)
    nodes = int(packed.count.sum())
    statistics = statistics_of(packed.boxes, packed.category, len(CompactConfig().categories))
    model = CompactModel(CompactConfig(), statistics, ("latent", "layout"))
    stage = LayoutStage(packed, packed, Recipe("layout", 1, nodes=nodes, relation_weight=1.0))
    generator = torch.Generator().manual_seed(0)

    def step() -> None:
        loss, _ = stage.loss(model, generator)
        loss.backward()

    consumed = seconds(step)
    print(f"layout step    {consumed * 1e3:8.2f} ms for {nodes} nodes: {consumed / read:.0f} times the reading")


if __name__ == "__main__":
    main()
