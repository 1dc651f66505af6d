"""A cold room of eight objects beside one busy process: the default against one thread, and against itself alone.

    python benchmarks/busy_neighbour.py [--rounds 3] [--neighbours 1]

Each round makes the room three times as a new process, in turns: as installed and alone, as installed beside
processes that count for ever, and with OMP_NUM_THREADS=1 beside the same. Wanted of the least seconds: with neighbours
the default is never slower than one thread and takes at most twice what it takes alone. Threads that spin while they
wait would show in the seconds of the processor too, which other load on the machine changes less. Then the stages of
`timings` of `--json` are added up beside the wall clock, and `echousd.generate` is called three times in one process,
which keeps the model.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

GRAPH = """room: bedroom
objects: {bed: double_bed, left_stand: nightstand, right_stand: nightstand, wardrobe: wardrobe, desk: desk,
  chair: office_chair, lamp: table_lamp, plant: plant}
relations:
  [left_stand left of bed, right_stand right of bed, left_stand close by bed, lamp standing on left_stand,
   chair close by desk, wardrobe taller than bed]
"""
COLD = "import sys; from echousd.cli.main import main; sys.argv[0] = 'echousd'; main()"
WARM = """
import sys, time, echousd
from echousd.graph import load_graph
for _ in range(3):
    started = time.process_time()
    echousd.generate(load_graph(sys.argv[1]), seed=7)
    print(round(time.process_time() - started, 2))
"""


def count_for_ever() -> None:
    """One core's worth of work."""
    number = 0
    while True:
        number += 1


@contextmanager
def neighbours(count: int) -> Iterator[None]:
    """Busy processes beside the block."""
    busy = [multiprocessing.Process(target=count_for_ever, daemon=True) for _ in range(count)]
    for process in busy:
        process.start()
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.join()


def cold_room(folder: Path, **environment: str) -> tuple[float, float, dict[str, float]]:
    """Seconds of the wall clock and of the processor of one new process, and its own timings."""
    (folder / "graph.yaml").write_text(GRAPH)
    words = ["generate", "graph.yaml", "-o", "room", "--seed", "7", "--force", "--json"]
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    started = time.perf_counter()
    command, around = [sys.executable, "-c", COLD, *words], {**os.environ, **environment}
    done = subprocess.run(command, cwd=folder, env=around, capture_output=True, text=True, check=True)
    wall = time.perf_counter() - started
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - used.ru_utime - used.ru_stime
    return wall, cpu, json.loads(done.stdout)["timings"]


def main() -> None:
    """Print the least seconds of each way, their ratios, the stages, and the calls in one process."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--rounds", type=int, default=3)
    words.add_argument("--neighbours", type=int, default=1)
    asked = words.parse_args()
    for name in ("OMP_NUM_THREADS", "PYTHONDONTWRITEBYTECODE"):  # installed packages have their byte code
        os.environ.pop(name, None)
    found: dict[str, list[tuple[float, float, dict[str, float]]]] = {"alone": [], "beside": [], "one thread beside": []}
    with tempfile.TemporaryDirectory() as place:
        cold_room(Path(place))  # files and byte code are read from the disk once
        for _ in range(asked.rounds):
            found["alone"].append(cold_room(Path(place)))
            with neighbours(asked.neighbours):
                found["beside"].append(cold_room(Path(place)))
                found["one thread beside"].append(cold_room(Path(place), OMP_NUM_THREADS="1"))
        least = {way: tuple(min(run[clock] for run in runs) for clock in (0, 1)) for way, runs in found.items()}
        for way, (wall, cpu) in least.items():
            print(f"{way:<18} wall {wall:6.2f} s   processor {cpu:6.2f} s", flush=True)
        for clock, name in ((0, "wall"), (1, "processor")):
            one = least["beside"][clock] / least["one thread beside"][clock]
            alone = least["beside"][clock] / least["alone"][clock]
            print(
                f"{name:<10} beside / one thread beside {one:.2f} (at most 1), beside / alone {alone:.2f} (at most 2)"
            )
        wall, _, stages = min(found["alone"], key=lambda run: run[0])
        total = stages.pop("total")
        print(f"stages: {', '.join(f'{name} {seconds:.2f}' for name, seconds in stages.items())}")
        print(f"sum {sum(stages.values()):.2f}, total {total:.2f}, process {wall:.2f} s (with Python's own start)")
        done = subprocess.run(
            [sys.executable, "-c", WARM, str(Path(place) / "graph.yaml")], capture_output=True, text=True, check=True
        )
        print(f"generate() three times in one process: {' '.join(done.stdout.split())} s of the processor")


if __name__ == "__main__":
    main()
