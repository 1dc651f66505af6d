"""What the same work costs in another checkout of this repository, in CPU seconds of one thread, in turns.

    git worktree add --detach ../before REVISION && python benchmarks/two_trees.py ../before [--repeats 3]

A ratio below one: this tree is faster. Graphs without the relations that only one of them knows, a room of boxes.
"""

from __future__ import annotations

import argparse
import gc
import os
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path

HERE = Path(__file__).parents[1]


def measure(tree: Path) -> None:
    """Print a line a measurement: its name and the least CPU seconds of several."""
    sys.path.insert(0, str(tree / "benchmarks"))
    import graph_stage
    import numpy as np
    import torch

    import echousd
    from echousd.graph import load_graph
    from echousd.stage.graphs import save_layer
    from echousd.stage.write import graph_layer

    warnings.simplefilter("ignore")
    torch.set_num_threads(1)
    folder = Path(tempfile.mkdtemp())

    class Words:
        categories = graph_stage.WORDS.categories
        predicates = tuple(one for one in graph_stage.WORDS.predicates if 0 < one.id < 16)

    graph_stage.WORDS = Words  # type: ignore[assignment, misc]
    graph = graph_stage.random_graph(150, 1500, np.random.default_rng(0))
    room = echousd.generate(load_graph(tree / "samples" / "bedroom.usda"), seed=1, shapes="boxes", place=False)

    def stage() -> None:
        save_layer(graph_layer(graph), folder / "graph.usda")
        echousd.read_graph(str(folder / "graph.usda"))

    def write() -> None:
        room.save(Path(tempfile.mkdtemp(dir=folder)), preview=False)

    work: dict[str, Callable[[], object]] = {
        "graph stage": stage,
        "room writing": write,
    }
    for name, run in work.items():
        spent = []
        for _ in range(6):
            gc.collect()
            started = time.process_time()
            run()
            spent.append(time.process_time() - started)
        print(f"{name}\t{min(spent)}")


def main() -> None:
    """Measure both trees in turns and print the ratios of the least."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("other", type=Path)
    arguments.add_argument("--repeats", type=int, default=3)
    arguments.add_argument("--only", action="store_true", help=argparse.SUPPRESS)
    options = arguments.parse_args()
    if options.only:
        measure(options.other)
        return
    least: dict[tuple[Path, str], float] = {}
    for _ in range(options.repeats):
        for tree in (options.other.resolve(), HERE):
            paths = os.pathsep.join((str(tree), str(tree / "model")))
            done = subprocess.run(
                [sys.executable, __file__, str(tree), "--only"], check=True, text=True, capture_output=True,
                env={**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": paths},
            )  # fmt: skip
            for line in done.stdout.splitlines():
                name, seconds = line.split("\t")
                least[tree, name] = min(float(seconds), least.get((tree, name), float("inf")))
    for tree, name in least:
        if tree == HERE:
            now, before = least[tree, name], least[options.other.resolve(), name]
            print(f"{name}: {before * 1e3:.1f} -> {now * 1e3:.1f} ms, ratio {now / before:.2f}")


if __name__ == "__main__":
    main()
