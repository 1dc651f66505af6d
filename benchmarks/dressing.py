"""What small things, textures and pictures cost a room: CPU seconds of one process, bytes of a room.

    OMP_NUM_THREADS=1 python benchmarks/dressing.py bedroom.usda some

The room is generated once with bare furniture; then it is written with the dressing that is named, first with nothing
kept in the process (cold), then again (warm), into a folder of its own and beside a store.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import echousd
from echousd.draw.from_files import render
from echousd.draw.tracing import QUICK
from echousd.options import RoomOptions


def bytes_of(folder: Path) -> float:
    """Megabytes below a folder."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) / 1e6


def main() -> None:
    """Print the figures of one room and dressing."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("graph")
    parser.add_argument("dress", choices=("none", "some", "full"))
    parser.add_argument("--seed", type=int, default=3)
    arguments = parser.parse_args()
    bare = echousd.generate(arguments.graph, seed=arguments.seed, options=RoomOptions(walls=True))
    room = replace(bare, options=RoomOptions(walls=True, dress=arguments.dress))
    spent = []
    with tempfile.TemporaryDirectory() as scratch:
        for run in ("cold", "warm"):
            started = time.process_time()
            root = room.save(Path(scratch) / run, preview=False)
            spent.append(time.process_time() - started)
        shared = room.save(Path(scratch) / "shared", preview=False, store=Path(scratch) / "store")
        for _ in range(2):
            started = time.process_time()
            render(root, size=400, rays=QUICK)
            drawn = time.process_time() - started
        whole, own = bytes_of(root.parent), bytes_of(shared.parent)
    print(f"{arguments.dress}: write cold {spent[0]:.2f} s, warm {spent[1]:.2f} s; preview {drawn:.2f} s")
    print(f"{whole:.2f} MB alone, {own:.2f} MB beside a store")


if __name__ == "__main__":
    main()
