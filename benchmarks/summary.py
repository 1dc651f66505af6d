"""What every area takes, as one table of ratios: CPU seconds over those of a matrix product and of reading memory.

    OMP_NUM_THREADS=1 python benchmarks/summary.py [--repeats 3] [--out table.json]

A matrix product is one of 2048 x 2048 in float32, a read one of 512 MB, both on this machine, one thread. The sample
living room, seed 7, warm. Ratios depend less on the machine than the seconds beside them do.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import machine
import numpy as np
import torch

SAMPLE = Path(__file__).parents[1] / "samples" / "living_room.usda"
HOME = "kitchen open_to living, hall door living, hall door bedroom*2, hall door bathroom"
READ = 512e6  # bytes of a read


def areas(folder: Path) -> dict[str, Callable[[], object]]:
    """Area -> what is run, in this order: later ones read what earlier ones wrote."""
    import echousd
    from echomodel.loading import load_model
    from echomodel.metrics.layouts import layout_scores, tasks_of
    from echomodel.rooms.generator import generate_rooms
    from echousd.checks import check
    from echousd.draw.from_files import render
    from echousd.evaluation.systems import BASES, System, finished
    from echousd.exporting.formats import export
    from echousd.home.graph import HomeGraph
    from echousd.home.plan import plan_home
    from echousd.settle.settle import settle

    task = tasks_of(generate_rooms(1, 770_000, room_type="living_room"), 0, stated=1.0)[0]
    load_model(None)
    held: dict[str, object] = {}

    def made() -> object:
        held["room"] = echousd.generate(SAMPLE, seed=7)
        return held["room"]

    root = folder / "living_room" / "living_room.usda"
    return {
        "graph read": lambda: echousd.read_graph(SAMPLE),
        "a room of the generator": lambda: generate_rooms(1, 5, room_type="living_room"),
        "a layout drawn": lambda: BASES["network"][0]([task], 0),
        "a layout searched": lambda: finished(System.parse("real+search"), task, [task.room]),
        "a layout scored": lambda: layout_scores(task, task.room),
        "a room generated": made,
        "a room written": lambda: held["room"].save(root.parent, preview=False),  # type: ignore[attr-defined]
        "a room checked": lambda: check(root),
        "a room simulated": lambda: settle(root),
        "a picture": lambda: render(root),
        "a home of six rooms planned": lambda: plan_home(HomeGraph.from_words(HOME, area=75)),
        "a glb": lambda: export(root, folder / "room.glb", force=True),
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    torch.set_num_threads(1)
    machine.clock = "cpu"
    rate, bandwidth = machine.report_machine(1)
    product, read = 2 * 2048**3 / rate, READ / bandwidth
    table = {}
    with tempfile.TemporaryDirectory() as scratch:
        for name, run in areas(Path(scratch)).items():
            run()  # warm
            spent = []
            for _ in range(options.repeats):
                began = time.process_time()
                run()
                spent.append(time.process_time() - began)
            best = float(np.min(spent))
            table[name] = {"seconds": best, "matrix products": best / product, "reads": best / read}
            print(
                f"{name:26s} {best:8.3f} s {best / product:9.2f} matrix products {best / read:9.2f} reads", flush=True
            )
    if options.out:
        options.out.write_text(json.dumps(table, indent=1) + "\n")


if __name__ == "__main__":
    main()
